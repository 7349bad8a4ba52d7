#!/usr/bin/env python3
"""Measures the shipped materials and renews the figures in docs/materials.md. Needs numpy and Pillow.

    python3 tests/materials/measure.py target/release/shibo [--only NAME,NAME] [--write]

For each graph with a material and a flat picture in light it measures:
- time: processor seconds of `shibo render GRAPH --output lit` at 2048 pixels of the longer side, with an empty cache;
- copies: 1024² pixels of `lit` are cut into places of 56 pixels, one each 28 pixels. A place is a copy if its correlation with
  another place of the picture, at any pixel, is more than .9. Differences of wavelengths over 28 pixels are taken out first, and
  places without contrast are left out;
- mean: the mean linear light of the picture at 256 pixels over that at 2048 pixels (printed only);
- seeds: the correlation between pictures of two seeds, each averaged to 24² values; the median of three pairs of seeds.
"""
import argparse
import os
import re
import resource
import subprocess
import sys
import tempfile

import numpy as np
from PIL import Image

PATCH, STEP = 56, 28
# Least deviation of a place, of 255: below it, rounding of the picture counts as structure.
FLAT = 1.0
TABLE = "docs/materials.md"


def render(shibo, graph, output, folder, *options):
    """Renders one output. Returns its pixels as luminance from 0 to 255, and the processor seconds."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [shibo, "render", graph, "-o", folder, "--output", output, "--cache-dir", folder + "/cache", "--quiet", *options]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        raise RuntimeError(f"{' '.join(command)}\n{done.stderr}")
    [name] = [name for name in os.listdir(folder) if name.endswith(".png")]
    picture = Image.open(os.path.join(folder, name)).convert("RGB")
    pixels = np.asarray(picture, np.float32) @ np.array([0.2126, 0.7152, 0.0722], np.float32)
    os.remove(os.path.join(folder, name))
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return pixels, seconds


def box(pixels, side):
    """Means over squares of this side, with the edges joined."""
    for axis in (0, 1):
        total = np.cumsum(np.concatenate([np.take(pixels, range(-side, 0), axis), pixels], axis), axis, dtype=np.float64)
        low = np.take(total, range(0, pixels.shape[axis]), axis)
        high = np.take(total, range(side, side + pixels.shape[axis]), axis)
        pixels = np.roll(((high - low) / side).astype(np.float32), -(side // 2), axis)
    return pixels


def unit_patches(pixels, side, rows, columns):
    """Patches at these corners as rows of unit length and mean 0, and their deviations."""
    view = np.lib.stride_tricks.sliding_window_view(np.pad(pixels, ((0, side), (0, side)), mode="wrap"), (side, side))
    return unit(view[np.ix_(rows, columns)], side)


def unit(view, side):
    """Patches as rows of unit length and mean 0, and their deviations."""
    patches = view.reshape(-1, side * side).astype(np.float32)
    patches = patches - patches.mean(1, keepdims=True)
    deviation = patches.std(1)
    return patches / np.maximum(deviation[:, None] * side, 1e-9), deviation


def copies(pixels):
    """The number of places that are copies, and the number of all places."""
    pixels = pixels - box(pixels, STEP)
    high, wide = pixels.shape
    rows, columns = np.arange(0, high, STEP), np.arange(0, wide, STEP)
    fine, deviation = unit_patches(pixels, PATCH, rows, columns)
    # First at a quarter of the pixels, everywhere; then the best places pixel by pixel.
    small = pixels[: high // 4 * 4, : wide // 4 * 4].reshape(high // 4, 4, wide // 4, 4).mean((1, 3))
    side = PATCH // 4
    coarse, _ = unit_patches(small, side, rows // 4, columns // 4)
    candidates = [[] for _ in fine]
    corners = [(row, column) for row in rows for column in columns]
    places = np.array(corners)
    for start in range(0, small.shape[0], 8):
        band = np.arange(start, min(start + 8, small.shape[0]))
        all_places, _ = unit_patches(small, side, band, np.arange(small.shape[1]))
        score = coarse @ all_places.T
        for patch, at in zip(*np.nonzero(score > 0.8)):
            row, column = band[at // small.shape[1]] * 4, (at % small.shape[1]) * 4
            away = np.abs(places[patch] - (row, column))
            away = np.minimum(away, np.array([high, wide]) - away)
            if away.max() >= PATCH:
                candidates[patch].append((score[patch, at], row, column))
    found = 0
    padded = np.pad(pixels, PATCH + 8, mode="wrap")
    for patch, near in enumerate(candidates):
        if deviation[patch] < FLAT:
            continue
        for _, row, column in sorted(near, reverse=True)[:12]:
            part = padded[row + PATCH + 4 : row + PATCH * 2 + 12, column + PATCH + 4 : column + PATCH * 2 + 12]
            around, _ = unit(np.lib.stride_tricks.sliding_window_view(part, (PATCH, PATCH)), PATCH)
            if (around @ fine[patch]).max() > 0.9:
                found += 1
                break
    return found, len(corners)


def means(pixels):
    """The picture as 24² means."""
    picture = Image.fromarray(pixels).resize((24, 24), Image.BOX)
    return np.asarray(picture, np.float64).ravel()


def seeds(pictures):
    """The median correlation of the pairs of three pictures."""
    values = [means(picture) for picture in pictures]
    pairs = [(0, 1), (0, 2), (1, 2)]
    flat = min(value.std() for value in values) < 1e-6
    return 0.0 if flat else float(np.median([np.corrcoef(values[a], values[b])[0, 1] for a, b in pairs]))


def light(pixels):
    """The mean of the linear light, as the luminance of encoded values."""
    return float((((pixels / 255 + 0.055) / 1.055) ** 2.4).mean())


def measure(shibo, name):
    """A row of figures: seconds, copies, seeds; and the mean."""
    graph = f"graphs/{name}.ron"
    with tempfile.TemporaryDirectory() as folder:
        large, seconds = render(shibo, graph, "lit", folder, "--resolution", "2048")
        small, _ = render(shibo, graph, "lit", folder, "--resolution", "256")
        mean = light(small) / max(light(large), 1e-9)
    with tempfile.TemporaryDirectory() as folder:
        first, _ = render(shibo, graph, "lit", folder, "--resolution", "1024")
        count, of = copies(first)
        others = [render(shibo, graph, "lit", folder, "--resolution", "512", "--set", f"seed={seed}")[0] for seed in (101, 202, 303)]
    return (f"{seconds:.1f}", f"{count} of {of}", f"{seeds(others):.2f}"), mean


def has_lit(name):
    text = open(f"graphs/{name}.ron", encoding="utf-8").read()
    return re.search(r'"lit":', text.rsplit("outputs:", 1)[-1]) is not None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("shibo", help="the program")
    parser.add_argument("--only", help="names of graphs, with commas")
    parser.add_argument("--write", action="store_true", help=f"renew the figures of {TABLE}")
    args = parser.parse_args()
    names = args.only.split(",") if args.only else sorted(file[:-4] for file in os.listdir("graphs") if file.endswith(".ron"))
    table = open(TABLE, encoding="utf-8").read() if args.write else ""
    for name in filter(has_lit, names):
        try:
            row, mean = measure(os.path.abspath(args.shibo), name)
        except RuntimeError as error:
            print(error, file=sys.stderr)
            continue
        print(f"{name:20} {row[0]:>7} s  copies {row[1]:14} seeds {row[2]:6} mean {mean:.3f}", flush=True)
        # | name | verdict | what gives it away | seconds | copies | seeds |
        pattern = rf"^(\| \[{name}\][^|]*\|[^|]*\|[^|]*\|)[^|\n]*\|[^|\n]*\|[^|\n]*\|$"
        table = re.sub(pattern, lambda found: found[1] + " " + " | ".join(row) + " |", table, flags=re.M)
    if args.write:
        with open(TABLE + ".part", "w", encoding="utf-8") as file:
            file.write(table)
        os.replace(TABLE + ".part", TABLE)


if __name__ == "__main__":
    main()
