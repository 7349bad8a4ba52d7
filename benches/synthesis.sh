#!/usr/bin/env bash
# Exemplar synthesis beside other programs: CPU seconds, peak memory and, with a scorer, quality.
# usage: benches/synthesis.sh OUT SIZE EXEMPLAR.png...
#   Shibo renders with target/release/shibo (SHIBO=… for another), from nothing and without a cache, on one thread.
#   Others run where they are on PATH: texture-synthesis (crate texture-synthesis-cli), gmic (syntexturize_matchpatch).
#   SCORER="python3 quality.py" is called with EXEMPLAR OUTPUT and prints one line of JSON with `score`.
set -euo pipefail
out=$1 size=$2; shift 2; mkdir -p "$out"
shibo=${SHIBO:-target/release/shibo}
[ -x "$shibo" ] || { echo "no $shibo: cargo build --release first" >&2; exit 2; }
score() { # EXEMPLAR PICTURE
  [ -n "${SCORER:-}" ] && [ -f "$2" ] || { echo "-"; return; }
  $SCORER "$1" "$2" | sed -n 's/.*"score": \([0-9.]*\).*/\1/p'
}
timed() { # LABEL EXEMPLAR PICTURE COMMAND...
  local label=$1 exemplar=$2 picture=$3 before after; shift 3
  local log; log=$(mktemp)
  if command -v /usr/bin/time >/dev/null; then
    /usr/bin/time -f "%U %S %M" -o "$log" "$@" >/dev/null 2>&1 || { echo "$label failed"; return; }
    read -r user system peak < <(tail -1 "$log")
  else
    read -r user system < <( { TIMEFORMAT="%U %S"; time "$@" >/dev/null 2>&1; } 2>&1 ) && peak=0
  fi
  rm -f "$log"
  printf '%-12s %-20s %8.2f %9.1f %8s\n' "$label" "$(basename "$exemplar" .png)" \
    "$(echo "$user $system" | awk '{print $1 + $2}')" "$(echo "$peak" | awk '{print $1 / 1024}')" "$(score "$exemplar" "$picture")"
}
printf '%-12s %-20s %8s %9s %8s\n' program exemplar "CPU s" "peak MiB" score
for exemplar in "$@"; do
  name=$(basename "$exemplar" .png)
  side=$(od -An -tu1 -j16 -N8 "$exemplar" | awk '{print ($1*16777216+$2*65536+$3*256+$4), ($5*16777216+$6*65536+$7*256+$8)}')
  read -r width height <<< "$side"
  cat > "$out/$name.ron" <<GRAPH
( version: 1, canvas: (size_mm: $size, resolution: $size, tile: Both, seed: 1),
  nodes: {
    "picture": Image(path: "$(realpath "$exemplar")", size_mm: ($width, $height)),
    "exemplar": Exemplar(input: "picture"),
    "coords": Synthesize(exemplar: "exemplar"),
    "shown": SampleExemplar(coords: "coords", input: "picture"),
  },
  outputs: { "shibo_$name": File(from: "shown", format: Png, depth: U8) } )
GRAPH
  timed shibo "$exemplar" "$out/shibo_$name.png" "$shibo" render "$out/$name.ron" -o "$out" --no-cache --threads 1
  if command -v texture-synthesis >/dev/null; then
    timed embark "$exemplar" "$out/embark_$name.png" texture-synthesis --no-progress --seed 1 --out-size "$size" \
      -o "$out/embark_$name.png" generate -- "$exemplar"
  fi
  if command -v gmic >/dev/null; then
    timed matchpatch "$exemplar" "$out/matchpatch_$name.png" gmic "$exemplar" syntexturize_matchpatch "$size,$size" round. \
      c. 0,255 o. "$out/matchpatch_$name.png"
  fi
done
command -v texture-synthesis >/dev/null || echo "skipped: texture-synthesis is not installed"
command -v gmic >/dev/null || echo "skipped: gmic is not installed"
