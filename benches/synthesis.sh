#!/usr/bin/env bash
# Compares exemplar synthesis with other programs: CPU seconds, peak memory and, with a scorer, quality.
# usage: benches/synthesis.sh OUT SIZE EXEMPLAR.png...
#   Shibo renders with target/release/shibo (SHIBO=… for another), from scratch and without a cache, on one thread (THREADS=…),
#   with the seeds SEEDS ("1 2 3 4") and presets PRESETS ("Structured"); peak memory is above that of an empty graph.
#   Other programs run if they are on PATH: texture-synthesis (crate texture-synthesis-cli), gmic (syntexturize_matchpatch).
#   ANGLE=37 compares a synthesis rotated by 37 degrees, and the rotated picture of an unrotated synthesis, with the rotated exemplar.
#   SCORER="python3 quality.py" is called with EXEMPLAR OUTPUT and prints one line of JSON; the mean over the seeds is shown.
set -euo pipefail
out=$1 size=$2; shift 2; mkdir -p "$out"
shibo=${SHIBO:-target/release/shibo} threads=${THREADS:-1}
[ -x "$shibo" ] || { echo "no $shibo: cargo build --release first" >&2; exit 2; }
terms="score rep acf seam"
scores() { # EXEMPLAR PICTURE...
  local exemplar=$1; shift
  [ -n "${SCORER:-}" ] || { echo "     -      -      -      -"; return; }
  for picture in "$@"; do $SCORER "$exemplar" "$picture" || true; done | awk -v terms="$terms" '
    { count = split(terms, name, " ")
      for (k = 1; k <= count; k++) if (match($0, "\"" name[k] "\": [-0-9.e]+")) {
        part = substr($0, RSTART, RLENGTH); sub(/.*: /, "", part); sum[k] += part; n[k]++ } }
    END { for (k = 1; k <= 4; k++) printf "%6s ", n[k] ? sprintf("%.3f", sum[k] / n[k]) : "-"; print "" }'
}
# The minimum CPU seconds and peak KiB of RUNS runs (three; one for a slow program): RUNS COMMAND...
measure() {
  local runs=$1 log least=999999 peak=99999999 user system kib; shift; log=$(mktemp)
  for _ in $(seq "$runs"); do
    if command -v /usr/bin/time >/dev/null; then
      /usr/bin/time -f "%U %S %M" -o "$log" "$@" >/dev/null 2>&1 || { rm -f "$log"; return 1; }
      read -r user system kib < <(tail -1 "$log")
    else
      { TIMEFORMAT="%U %S"; time "$@" >/dev/null 2>&1; } 2>"$log" || { rm -f "$log"; return 1; }
      read -r user system < <(tail -1 "$log"); kib=0
    fi
    least=$(echo "$user $system $least" | awk '{ t = $1 + $2; print t < $3 ? t : $3 }')
    peak=$(( kib < peak ? kib : peak ))
  done
  rm -f "$log"; echo "$least $peak"
}
line() { # LABEL EXEMPLAR CPU KIB PICTURE...
  local label=$1 exemplar=$2 cpu=$3 kib=$4; shift 4
  printf '%-22s %-12s %8.2f %9.1f %s\n' "$label" "$(basename "$exemplar" .png)" "$cpu" \
    "$(echo "$kib" | awk '{ print $1 * 1.024e-3 }')" "$(scores "$exemplar" "$@")"
}
# Crops the middle of a picture rotated by ANGLE to SIDE pixels: PICTURE WIDTH HEIGHT SIDE NAME
# Filters once, with the filter that renders a synthesis: filtering twice or with another filter changes sharpness, colours and
# detail.
turned() {
  local graph levels=0 doubled="" most=$(( $2 > $3 ? $2 : $3 )) n
  while [ $(( 1 << levels )) -lt "$most" ]; do
    doubled+="\"c$(( levels + 1 ))\": UpsampleCoords(coords: \"c$levels\", jacobian: \"turn\"), "
    levels=$(( levels + 1 ))
  done
  n=$(( 1 << levels ))
  cat > "$out/$5_whole.ron" <<GRAPH
( version: 1, canvas: (size_mm: $n, resolution: $n, tile: None, seed: 1),
  nodes: {
    "picture": Image(path: "$(realpath "$1")", size_mm: ($2, $3)),
    "turn": JacobianFromAngleScale(angle: $ANGLE),
    "c0": StartCoords(size: (1, 1), coords: [($(awk -v w="$2" -v h="$3" 'BEGIN { print w / 2 ", " h / 2 }'))], levels: $levels), $doubled
    "turned": SampleExemplar(coords: "c$levels", input: "picture", jacobian: "turn"),
  },
  outputs: { "$5_whole": File(from: "turned", format: Png, depth: U8) } )
GRAPH
  cat > "$out/$5.ron" <<GRAPH
( version: 1, canvas: (size_mm: $4, resolution: $4, tile: None, seed: 1),
  nodes: {
    "middle": Image(path: "$(realpath "$out")/$5_whole.png", crop: ($(( (n - $4) / 2 )), $(( (n - $4) / 2 )), $4, $4)),
  },
  outputs: { "$5": File(from: "middle", format: Png, depth: U8) } )
GRAPH
  for graph in "$5_whole" "$5"; do
    "$shibo" render "$out/$graph.ron" -o "$out" --no-cache -q >/dev/null 2>"$out/$5.log" ||
      { echo "shibo failed on $graph.ron" >&2; exit 1; }
  done
}
# The side of the largest square, an even number of pixels, inside a square of side N that is rotated by ANGLE.
inside() {
  awk -v n="$1" -v a="$ANGLE" 'BEGIN { r = a * atan2(0, -1) / 180; s = sin(r); c = cos(r); print 2 * int(n / ((s < 0 ? -s : s) + (c < 0 ? -c : c)) / 2) }'
}
cat > "$out/idle.ron" <<'GRAPH'
( version: 1, canvas: (size_mm: 8, resolution: 8, tile: Both, seed: 1),
  nodes: { "a": Perlin(size: 4) }, outputs: { "idle": File(from: "a", format: Png, depth: U8) } )
GRAPH
read -r _ idle < <(measure 3 "$shibo" render "$out/idle.ron" -o "$out" --no-cache --threads "$threads")
printf '%-22s %-12s %8s %9s %6s %6s %6s %6s\n' program exemplar "CPU s" "peak MB" $terms
for exemplar in "$@"; do
  name=$(basename "$exemplar" .png)
  read -r width height < <(od -An -tu1 -j16 -N8 "$exemplar" | awk '{print ($1*16777216+$2*65536+$3*256+$4), ($5*16777216+$6*65536+$7*256+$8)}')
  for preset in ${PRESETS:-Structured}; do
    pictures=() cpu=999999 kib=0
    for seed in ${SEEDS:-1 2 3 4}; do
      graph="${preset}_${name}_$seed"
      cat > "$out/$graph.ron" <<GRAPH
( version: 1, canvas: (size_mm: $size, resolution: $size, tile: Both, seed: $seed),
  nodes: {
    "picture": Image(path: "$(realpath "$exemplar")", size_mm: ($width, $height)),
    "exemplar": Exemplar(input: "picture"),
    "coords": Synthesize(exemplar: "exemplar", preset: $preset),
    "shown": SampleExemplar(coords: "coords", input: "picture"),
  },
  outputs: { "shibo_$graph": File(from: "shown", format: Png, depth: U8) } )
GRAPH
      read -r now peak < <(measure 1 "$shibo" render "$out/$graph.ron" -o "$out" --no-cache --threads "$threads") ||
        { echo "shibo failed on $graph.ron" >&2; exit 1; }
      cpu=$(echo "$now $cpu" | awk '{ print $1 < $2 ? $1 : $2 }') kib=$(( peak > kib ? peak : kib ))
      pictures+=("$out/shibo_$graph.png")
    done
    line "shibo $preset" "$exemplar" "$cpu" $(( kib - idle )) "${pictures[@]}"
    if [ -n "${ANGLE:-}" ]; then
      turned "$exemplar" "$width" "$height" "$(inside $(( width < height ? width : height )))" "crop_$name"
      plain=() bent=() cpu=999999 kib=0
      for seed in ${SEEDS:-1 2 3 4}; do
        turned "$out/shibo_${preset}_${name}_$seed.png" "$size" "$size" "$(inside "$size")" "plain_${preset}_${name}_$seed"
        plain+=("$out/plain_${preset}_${name}_$seed.png")
        graph="bent_${preset}_${name}_$seed"
        sed -e "s/preset: $preset/jacobian: \"turn\", &/; s/\"exemplar\": Exemplar/\"turn\": JacobianFromAngleScale(angle: $ANGLE), &/" \
          -e "s/SampleExemplar(/&jacobian: \"turn\", /; s/\"shibo_[^\"]*\"/\"$graph\"/" "$out/${preset}_${name}_$seed.ron" > "$out/$graph.ron"
        read -r now peak < <(measure 1 "$shibo" render "$out/$graph.ron" -o "$out" --no-cache --threads "$threads") ||
          { echo "shibo failed on $graph.ron" >&2; exit 1; }
        cpu=$(echo "$now $cpu" | awk '{ print $1 < $2 ? $1 : $2 }') kib=$(( peak > kib ? peak : kib ))
        bent+=("$out/$graph.png")
      done
      line "picture turned" "$out/crop_$name.png" 0 0 "${plain[@]}"
      line "synthesis turned" "$out/crop_$name.png" "$cpu" $(( kib - idle )) "${bent[@]}"
    fi
  done
  if command -v texture-synthesis >/dev/null; then
    picture="$out/embark_$name.png"
    read -r cpu kib < <(measure 1 texture-synthesis --no-progress --seed 1 --out-size "$size" -o "$picture" generate -- "$exemplar") &&
      line embark "$exemplar" "$cpu" "$kib" "$picture"
  fi
  if command -v gmic >/dev/null; then
    picture="$out/matchpatch_$name.png"
    read -r cpu kib < <(measure 1 gmic "$exemplar" syntexturize_matchpatch "$size,$size" round. c. 0,255 o. "$picture") &&
      line matchpatch "$exemplar" "$cpu" "$kib" "$picture"
  fi
done
command -v texture-synthesis >/dev/null || echo "skipped: texture-synthesis is not installed"
command -v gmic >/dev/null || echo "skipped: gmic is not installed"
