#!/usr/bin/env python3
"""Measures `shibo fit` on pictures of shipped graphs with hidden values. Not run by CI. Needs numpy and Pillow.

    python3 tests/fit/measure.py target/release/shibo goat pebbled calf

For each graph, numbers are drawn from the middle 80 % of their ranges, colours lie within 12 % of those of a preset, the light comes
from a hidden direction, and the seed differs. The picture is fitted, and judged by two measures that the fit does not use: sliced
Wasserstein distance of raw patches, and the Gram matrices of random filters. `floor` is the measure between seeds of the hidden values.
"""
import json
import random
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
SIDE = 128


def run(program, *args, cwd=None):
    done = subprocess.run([program, *map(str, args)], cwd=cwd, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{args}: {done.stderr[-800:]}")
    return done.stdout


def patches(rgb, rng, side=7, count=4000):
    h, w = rgb.shape[:2]
    y, x = rng.integers(0, h - side, count), rng.integers(0, w - side, count)
    return np.stack([rgb[a:a + side, b:b + side].ravel() for a, b in zip(y, x)])


def wasserstein(a, b):
    """Sliced Wasserstein distance of 7 × 7 patches, at two scales."""
    total = 0.0
    for step in (1, 2):
        rng = np.random.default_rng(5)
        pa, pb = (patches(z[::step, ::step], rng) for z in (a, b))
        d = np.random.default_rng(9).standard_normal((pa.shape[1], 96))
        d /= np.linalg.norm(d, axis=0)
        total += float(((np.sort(pa @ d, 0) - np.sort(pb @ d, 0)) ** 2).mean())
    return total / 2


def grams(rgb):
    rng, out, z = np.random.default_rng(3), [], rgb - 0.5
    for _ in range(3):
        k = rng.standard_normal((32, 5, 5, z.shape[2])) / np.sqrt(25 * z.shape[2])
        v = np.lib.stride_tricks.sliding_window_view(z, (5, 5), (0, 1))
        f = np.maximum(np.einsum("hwcij,kijc->hwk", v, k, optimize=True), 0)
        flat = f.reshape(-1, f.shape[2])
        out.append(flat.T @ flat / len(flat))
        z = f[: f.shape[0] // 2 * 2, : f.shape[1] // 2 * 2].reshape(f.shape[0] // 2, 2, f.shape[1] // 2, 2, -1).mean((1, 3))
    return out


def gram(a, b):
    """Distance of the Gram matrices of three layers of random filters, relative to their size."""
    return float(np.mean([np.linalg.norm(x - y) / np.linalg.norm(y) for x, y in zip(grams(a), grams(b))]))


def load(path):
    return np.asarray(Image.open(path).convert("RGB").resize((SIDE, SIDE), Image.BOX), float) / 255


def srgb(linear):
    v = max(0.0, min(1.0, linear))
    return 12.92 * v if v <= 0.0031308 else 1.055 * v ** (1 / 2.4) - 0.055


def color(value):
    if isinstance(value, str) and re.fullmatch(r"#[0-9a-fA-F]{6}", value):
        return [int(value[i:i + 2], 16) / 255 for i in (1, 3, 5)]
    if isinstance(value, str) and re.fullmatch(r"#[0-9a-fA-F]{3}", value):
        return [int(c, 16) / 15 for c in value[1:]]
    if isinstance(value, list):
        return [srgb(v) for v in value]
    return None


def hexed(rgb):
    return "#" + "".join(f"{round(255 * max(0, min(1, v))):02x}" for v in rgb)


def lit_by(text, width, azimuth, elevation):
    """The text with a canvas of another size and another direction of the light. `elevation` may be None."""
    text = re.sub(r"size_mm:\s*(\([^)]*\)|[^,)]+)", f"size_mm: {width}", text, count=1)
    node = re.search(r'"lit":\s*"([\w-]+)"', text[text.index("outputs:"):]) if "outputs:" in text else None
    name = node.group(1) if node else "lit"
    at = re.search(rf'"{name}":\s*Relief\(', text)
    if not at:
        return text, False
    depth, end = 1, at.end()
    while depth:
        depth += {"(": 1, ")": -1}.get(text[end], 0)
        end += 1
    body = re.sub(r",?\s*(azimuth|elevation):\s*[^,)]+", "", text[at.end():end - 1]).rstrip().rstrip(",")
    high = "" if elevation is None else f", elevation: {elevation:.1f}"
    return text[:at.end()] + body + f", azimuth: {azimuth:.1f}" + high + text[end - 1:], True


def draw(form, rng):
    """Hidden values of a graph, and the ranges of its numbers: low, high, and whether they are directions of half a turn."""
    start = rng.choice([{}] + list(form.get("presets", {}).values()))
    hidden, ranges = {}, {}
    for key, value in form["params"].items():
        kind, body = next(iter(value.items())) if len(value) == 1 else (value.get("type"), value)
        default = body["default"]
        if kind == "Number" and "range" in body:
            low, high = body["range"]
            hidden[key] = low + (high - low) * (0.1 + 0.8 * rng.random())
            ranges[key] = (low, high, body.get("unit") == "°" and high - low == 180)
            if low > 0 and high / low > 3:
                hidden[key] = low * (high / low) ** (0.1 + 0.8 * rng.random())
        elif kind == "Color" and (rgb := color(start.get(key, default))):
            hidden[key] = hexed([v + 0.12 * (2 * rng.random() - 1) for v in rgb])
    hidden.pop("exposure", None)
    return hidden, ranges


def misses(found, hidden, ranges):
    """For each fitted number: its error as a share of the range, whether it counts as determined, whether the error holds, its name."""
    rows = []
    for key, one in found["parameters"].items():
        if key not in ranges:
            continue
        low, high, half = ranges[key]
        apart = abs(one["value"] - hidden[key])
        apart = min(apart, 180 - apart) if half else apart
        share = apart / (high - low)
        if low > 0 and high / low > 3:
            share = abs(np.log(one["value"] / hidden[key])) / np.log(high / low)
        rows.append((float(share), one["determined"], bool(share <= 2.5 * one["error_share"]), key))
    return rows


def measure(program, name, seed, folder, extra):
    rng = random.Random(f"{name} {seed}")
    source = ROOT / "graphs" / f"{name}.ron"
    form = json.loads(run(program, "fmt", "--to", "json", source))
    size = form.get("canvas", {}).get("size_mm", 100)
    size = min(size) if isinstance(size, list) else size
    width = round(0.5 * size, 2)
    presets = form.get("presets", {})
    hidden, ranges = draw(form, rng)
    graphs = folder / "graphs"
    if not graphs.exists():
        shutil.copytree(ROOT / "graphs", graphs)
    azimuth, elevation = rng.uniform(0, 360), rng.uniform(25, 65)
    text, lit = lit_by(source.read_text(), width, azimuth, elevation)
    (graphs / "hidden.ron").write_text(text)
    output = "lit" if lit else "material.base_color"

    def render(graph, out, number, values=None, preset=None):
        args = ["render", graphs / graph, "-o", folder / out, "--resolution", 4 * SIDE, "--set", f"seed={number}", "--output", output, "--no-cache"]
        for key, value in (values or {}).items():
            args += ["--set", f"{key}={value}"]
        run(program, *args, *(["--preset", preset] if preset else []))
        return next((folder / out).glob("*.png"))

    try:
        target = render("hidden.ron", "target", 4242, hidden)
    except RuntimeError as error:
        print(f"{name} {seed}: hidden values are refused: {str(error)[-200:]}", flush=True)
        return None
    photo = folder / "photo.png"
    shutil.copy(target, photo)
    shutil.copy(source, graphs / "fitted.ron")
    found = json.loads(run(program, "fit", graphs / "fitted.ron", photo, "--width-mm", width, "--preset", "found", "--format", "json",
                           "--quiet", "--output", output, "--sheet", folder / f"{name}_{seed}.png", *extra))
    light = found["light"] or {}
    for out, fresh in (("fit.ron", graphs / "fitted.ron"), ("start.ron", source)):
        text, _ = lit_by(fresh.read_text(), width, light.get("azimuth") or azimuth, light.get("elevation") or elevation)
        (graphs / out).write_text(text)
    a = load(photo)
    floor = [load(render("hidden.ron", "floor", n, hidden)) for n in (1, 2, 3)]
    fits = [load(render("fit.ron", "fit", n, preset="found")) for n in (1, 2, 3)]
    others = [load(render("start.ron", "start", 1, preset=p)) for p in [None, *list(presets)[:8]]]
    row = {"graph": name, "seed": seed, "unknowns": len(found["parameters"]) + 2 * bool(light), "renders": found["renders"]}
    for judge in (wasserstein, gram):
        f, g = (float(np.mean([judge(b, a) for b in group])) for group in (floor, fits))
        row[judge.__name__] = (f, g, min(judge(b, a) for b in others))
    errors = misses(found, hidden, ranges)
    row["numbers"] = len(errors)
    row["determined"] = sum(d for _, d, _, _ in errors)
    row["held"] = sum(h for _, _, h, _ in errors)
    row["error"] = float(np.median([e for e, *_ in errors])) if errors else None
    sure = [e for e, d, *_ in errors if d]
    row["error_determined"] = float(np.median(sure)) if sure else None
    row |= {key: found[key] for key in ("distance", "floor", "start", "cpu_s", "unreached", "refused")}
    row["preset"] = (found["nearest_preset"] or {}).get("distance")
    row["detail"] = {key: round(e, 3) for e, *_, key in errors}
    return row


def main():
    program, *rest = sys.argv[1:]
    program = str(Path(program).resolve())
    extra = []
    if "--" in rest:
        extra = rest[rest.index("--") + 1:]
        rest = rest[:rest.index("--")]
    names, seeds = [r for r in rest if not r.isdigit()], [int(r) for r in rest if r.isdigit()] or [1]
    print("| graph, unknowns | renders | d: floor → fit (preset) | patches × 1000: floor → fit (preset) | Gram: floor → fit (preset) | numbers: median error, determined | determined | errors hold | CPU s |")
    print("|---|---|---|---|---|---|---|---|---|")
    for name in names:
        for seed in seeds:
            keep = Path(tempfile.gettempdir()) / "shibo_fit_measure"
            keep.mkdir(exist_ok=True)
            with tempfile.TemporaryDirectory() as folder:
                try:
                    row = measure(program, name, seed, Path(folder), extra)
                except RuntimeError as error:
                    print(f"{name} {seed}: {error}", flush=True)
                    continue
                for sheet in Path(folder).glob(f"{name}_{seed}.png"):
                    shutil.copy(sheet, keep)
            if row is None:
                continue
            w, g = row["wasserstein"], row["gram"]
            share = lambda v: "–" if v is None else f"{100 * v:.1f} %"
            preset = row["preset"] if row["preset"] is not None else row["start"]
            print(f"| {name}, {row['unknowns']} | {row['renders']} | {row['floor']:.2f} → **{row['distance']:.2f}** ({preset:.2f}) | "
                  f"{1e3 * w[0]:.3f} → **{1e3 * w[1]:.3f}** ({1e3 * w[2]:.2f}) | {g[0]:.3f} → **{g[1]:.3f}** ({g[2]:.3f}) | "
                  f"{share(row['error'])}, {share(row['error_determined'])} | {row['determined']} of {row['numbers']} | "
                  f"{row['held']} of {row['numbers']} | {row['cpu_s']:.1f} |", flush=True)
            print(json.dumps(row), file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
