#!/usr/bin/env python3
"""Makes a page that compares exemplars with the results of Shibo and other programs, with measurements.

    benches/synthesis_page.py OUT SIZE EXEMPLAR.png…      -> OUT/index.html and its pictures

Shibo renders with target/release/shibo (SHIBO=… for another), on one thread and without a cache, with the presets PRESETS
("Fast Structured Best") and the seeds SEEDS ("1 2 3 4"); the first seed is shown, and figures are means. Other programs take
part if they are on PATH: gmic (syntexturize_matchpatch) and texture-synthesis (crate texture-synthesis-cli).
SCORER="python3 quality.py" is called with EXEMPLAR OUTPUT and prints a line of JSON with `score` and `rep`. Needs numpy and Pillow.

torn: the share of patches of 7x7 pixels whose nearest patch of the exemplar is more than 0.45 of its deviation away; they look
broken. sharp: the energy of the gradients of patches over that of their nearest patches; below 1 is blurred. CPU: user and
system seconds of the whole program, the minimum of its runs.
"""
import html
import json
import os
import resource
import shlex
import shutil
import subprocess
import sys

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
import numpy as np
from PIL import Image

SIDE = 7


def load(path):
    return np.asarray(Image.open(path).convert("RGB"), np.float32) / 255


def patches(picture):
    return np.lib.stride_tricks.sliding_window_view(picture, (SIDE, SIDE), axis=(0, 1)).reshape(-1, 3, SIDE, SIDE)


def energy(patches):
    return float((np.diff(patches, axis=-1) ** 2).sum() + (np.diff(patches, axis=-2) ** 2).sum())


def torn(exemplar, result, samples=2000):
    """The share of torn patches, and the sharpness."""
    known, shown = patches(exemplar), patches(result)
    shown = shown[np.random.default_rng(0).choice(len(shown), min(samples, len(shown)), replace=False)]
    flat = known.reshape(len(known), -1)
    norms, far, wanted = (flat**2).sum(1), 0, []
    for part in np.array_split(shown, max(1, len(shown) // 256)):
        part = part.reshape(len(part), -1)
        nearest = (norms - 2 * part @ flat.T).argmin(1)
        distance = np.sqrt(((part - flat[nearest]) ** 2).mean(1)) / exemplar.std((0, 1)).mean()
        far += int((distance > 0.45).sum())
        wanted.append(nearest)
    return far / len(shown), energy(shown) / max(energy(known[np.concatenate(wanted)]), 1e-9)


def timed(command):
    """CPU seconds of a command; None if it fails."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    if subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode:
        return None
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def shibo(out, exemplar, name, size, preset, seed):
    width, height = Image.open(exemplar).size
    stem = f"{name}_shibo_{preset}_{seed}"
    graph = f"""( version: 1, canvas: (size_mm: {size}, resolution: {size}, tile: Both, seed: {seed}),
  nodes: {{
    "picture": Image(path: {json.dumps(os.path.abspath(exemplar))}, size_mm: ({width}, {height})),
    "exemplar": Exemplar(input: "picture"),
    "coords": Synthesize(exemplar: "exemplar", preset: {preset}),
    "shown": SampleExemplar(coords: "coords", input: "picture"),
  }},
  outputs: {{ "{stem}": File(from: "shown", format: Png, depth: U8) }} )
"""
    path = os.path.join(out, stem + ".ron")
    with open(path, "w") as file:
        file.write(graph)
    program = os.environ.get("SHIBO", "target/release/shibo")
    cpu = timed([program, "render", path, "-o", out, "--no-cache", "--threads", "1"])
    return os.path.join(out, stem + ".png"), cpu


def others(out, exemplar, name, size):
    picture = os.path.join(out, f"{name}_matchpatch.png")
    if shutil.which("gmic"):
        yield "matchpatch", picture, ["gmic", exemplar, "syntexturize_matchpatch", f"{size},{size}", "round.", "c.", "0,255", "o.", picture]
    picture = os.path.join(out, f"{name}_embark.png")
    if shutil.which("texture-synthesis"):
        args = ["--no-progress", "--seed", "1", "--out-size", str(size), "-o", picture, "generate", "--", exemplar]
        yield "Embark", picture, ["texture-synthesis", *args]


def measure(exemplar, pictures, cpus):
    """The means of the measurements, by name."""
    values = [dict(zip(("torn", "sharp"), torn(load(exemplar), load(picture)))) for picture in pictures]
    if scorer := os.environ.get("SCORER"):
        for value, picture in zip(values, pictures):
            printed = subprocess.run([*shlex.split(scorer), exemplar, picture], capture_output=True, text=True).stdout
            scored = json.loads(printed) if printed.strip() else {}
            value.update({key: scored[key] for key in ("score", "rep") if key in scored})
    means = {key: sum(value[key] for value in values) / len(values) for key in values[0]}
    return {**means, "CPU s": min(cpus)}


def main(out, size, exemplars):
    os.makedirs(out, exist_ok=True)
    presets = os.environ.get("PRESETS", "Fast Structured Best").split()
    seeds = os.environ.get("SEEDS", "1 2 3 4").split()
    rows, sums = [], {}
    for exemplar in exemplars:
        name = os.path.splitext(os.path.basename(exemplar))[0]
        shutil.copy(exemplar, os.path.join(out, f"{name}.png"))
        cells = [f'<td><img src="{html.escape(name)}.png"><br>{html.escape(name)}</td>']
        made = []
        for preset in presets:
            runs = [shibo(out, exemplar, name, size, preset, seed) for seed in seeds]
            runs = [run for run in runs if run[1] is not None]
            made.append((f"Shibo {preset}", [run[0] for run in runs], [run[1] for run in runs]))
        made += [(program, [picture], [timed(command)]) for program, picture, command in others(out, exemplar, name, size)]
        for program, pictures, cpus in made:
            if not pictures or None in cpus:
                cells.append(f"<td>{html.escape(program)} failed</td>")
                continue
            values = measure(exemplar, pictures, cpus)
            sums.setdefault(program, []).append(values)
            text = ", ".join(f"{key} {value:.3f}" for key, value in values.items())
            print(f"{name:14} {program:18} {text}", flush=True)
            shown = os.path.basename(pictures[0])
            cells.append(f'<td><img src="{html.escape(shown)}"><br>{html.escape(program)}: {text}</td>')
        rows.append(f"<tr>{''.join(cells)}</tr>")
    means = []
    for program, all_values in sums.items():
        mean = {key: sum(v[key] for v in all_values) / len(all_values) for key in all_values[0]}
        text = ", ".join(f"{key} {value:.3f}" for key, value in mean.items())
        print(f"{'mean':14} {program:18} {text}")
        means.append(f"<li>{html.escape(program)}: {text}</li>")
    style = "td { vertical-align: top; font: 13px sans-serif } img { image-rendering: pixelated }"
    with open(os.path.join(out, "index.html"), "w") as page:
        page.write(
            f"<!doctype html><meta charset=utf-8><title>Exemplar synthesis</title><style>{style}</style>"
            f"<h1>Exemplar synthesis</h1><p>Means of all exemplars:</p><ul>{''.join(means)}</ul><table>{''.join(rows)}</table>"
        )


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    main(sys.argv[1], int(sys.argv[2]), sys.argv[3:])
