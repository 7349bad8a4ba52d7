#!/usr/bin/env python3
"""Fits graphs to stand-ins for photographs, and makes the pictures of docs/fit. Not run by CI.

    python3.11 -m venv VENV && VENV/bin/pip install 'bpy==4.5.*' pillow                # 370 MB, once
    VENV/bin/python tests/fit/showcase.py target/release/shibo                         # all
    VENV/bin/python tests/fit/showcase.py target/release/shibo goat --out /tmp/look    # one, into another folder

A stand-in is a shipped graph with hidden values (`draw` in measure.py) and another seed, on a flat plate that another renderer draws:
Cycles of Blender, with true displacement, a lamp at one side, and a grey sky. Its height is cut by 512 × 512 squares, and its maps are
sampled by Cycles. Noise of a sensor is added, the picture is scaled by a Lanczos filter, and saved as JPEG of quality 85. `shibo fit`
gets this file and the width, and nothing else. For each graph the script writes NAME.png (stand-in, fit at two seeds, start) and
prints a row of the table in docs/fit.md.
"""
import argparse
import json
import math
import random
import shutil
import tempfile
from pathlib import Path

import bpy
import numpy as np
from measure import ROOT, SIDE, draw, gram, lit_by, load, misses, run, wasserstein
from PIL import Image

NAMES = ["goat", "pebbled", "herringbone", "granite", "venetian_plaster"]
PIXELS = 512  # of Cycles
SHOWN = 448  # of the stand-in
FRAME = 0.95  # of the plate is seen, so that its edges are not
TILE = 176  # of the pictures in docs/fit
SAMPLES = 12  # of Cycles; its noise stays


def texture(material, folder, channel, space, vector):
    """A node that reads a channel, if the graph has it."""
    for ext in ("png", "exr"):
        path = folder / f"material_{channel}.{ext}"
        if path.exists():
            node = material.node_tree.nodes.new("ShaderNodeTexImage")
            node.image = bpy.data.images.load(str(path))
            node.image.colorspace_settings.name = space
            node.interpolation = "Cubic"
            material.node_tree.links.new(vector, node.inputs["Vector"])
            return node.outputs[0]
    return None


def cycles(folder, out, width, azimuth, elevation, seed):
    """Draws the maps in a folder as a flat plate of `width` mm, and makes a photograph of it."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.max_bounces = 4
    scene.cycles.samples, scene.cycles.seed, scene.cycles.use_denoising = SAMPLES, seed, False
    scene.render.resolution_x = scene.render.resolution_y = PIXELS
    scene.view_settings.view_transform = "Standard"

    material = bpy.data.materials.new("material")
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    shader, output, uv = nodes["Principled BSDF"], nodes["Material Output"], nodes.new("ShaderNodeTexCoord").outputs["UV"]
    sockets = {"base_color": ("sRGB", "Base Color"), "roughness": ("Non-Color", "Roughness"), "metallic": ("Non-Color", "Metallic"),
               "coat": ("Non-Color", "Coat Weight"), "sheen": ("Non-Color", "Sheen Weight")}
    for channel, (space, socket) in sockets.items():
        read = texture(material, folder, channel, space, uv)
        if read:
            links.new(read, shader.inputs[socket])
    height = texture(material, folder, "height", "Non-Color", uv)
    if height:
        moved = nodes.new("ShaderNodeDisplacement")
        moved.inputs["Midlevel"].default_value = 0
        moved.inputs["Scale"].default_value = 2 / width  # the plate is two units wide, heights are mm
        links.new(height, moved.inputs["Height"])
        links.new(moved.outputs[0], output.inputs["Displacement"])
        material.displacement_method = "BOTH"

    bpy.ops.mesh.primitive_grid_add(x_subdivisions=512, y_subdivisions=512, size=2)
    plate = bpy.context.object
    plate.data.polygons.foreach_set("use_smooth", [True] * len(plate.data.polygons))
    plate.data.materials.append(material)

    # A white matt plate shows as 0.85, wherever the lamp is.
    bpy.ops.object.light_add(type="SUN", rotation=(0, math.radians(90 - elevation), math.radians(azimuth)))
    lamp = bpy.context.object.data
    lamp.energy, lamp.angle = math.pi * 0.6 / math.sin(math.radians(elevation)), math.radians(12)
    world = bpy.data.worlds.new("world")
    scene.world, world.use_nodes = world, True
    world.node_tree.nodes["Background"].inputs[0].default_value = (0.25, 0.25, 0.25, 1)

    bpy.ops.object.camera_add(location=(0, 0, 10))
    camera = bpy.context.object
    camera.data.angle = 2 * math.atan(FRAME / 10)
    scene.camera = camera
    scene.render.filepath = str(out.with_suffix(".png"))
    bpy.ops.render.render(write_still=True)

    rgb = np.asarray(Image.open(out.with_suffix(".png")).convert("RGB"), float)
    rgb += np.random.default_rng(seed).normal(0, 2.0, rgb.shape)
    picture = Image.fromarray(np.clip(np.round(rgb), 0, 255).astype(np.uint8))
    picture.resize((SHOWN, SHOWN), Image.LANCZOS).save(out, quality=85)


def judged(group, target):
    """Both judges, as the mean over a group of pictures."""
    return [float(np.mean([judge(one, target) for one in group])) for judge in (wasserstein, gram)]


def showcase(program, name, number, folder, out, extra):
    rng = random.Random(f"showcase {name} {number}")
    source = ROOT / "graphs" / f"{name}.ron"
    form = json.loads(run(program, "fmt", "--to", "json", source))
    size = form["canvas"]["size_mm"]
    plate = round(0.5 * (min(size) if isinstance(size, list) else size), 2)
    hidden, ranges = draw(form, rng)
    azimuth, elevation = rng.uniform(0, 360), rng.uniform(30, 55)
    graphs = folder / "graphs"
    shutil.copytree(ROOT / "graphs", graphs)

    def render(graph, seed, output, resolution, values=None, preset=None):
        to = folder / f"{graph}_{output}_{seed}_{preset}"
        sets = [word for key, value in [("seed", seed), *(values or {}).items()] for word in ("--set", f"{key}={value}")]
        run(program, "render", graphs / f"{graph}.ron", "-o", to, "--resolution", resolution, "--output", output, "--no-cache", *sets,
            *(["--preset", preset] if preset else []))
        return to

    def photograph(graph, seed, **more):
        to = folder / f"{graph}_{seed}.jpg"
        cycles(render(graph, seed, "material", 1024, **more), to, plate, azimuth, elevation, seed)
        return to

    def lit(graph, seed, **more):
        return next(render(graph, seed, "lit", 4 * SIDE, **more).glob("*.png"))

    # The plate of Cycles has another canvas than the graph that is fitted.
    (graphs / "hidden.ron").write_text(lit_by(source.read_text(), plate, azimuth, elevation)[0])
    photo = photograph("hidden", 4242, values=hidden)
    width = round(FRAME * plate, 3)
    shutil.copy(source, graphs / "fitted.ron")
    found = json.loads(run(program, "fit", graphs / "fitted.ron", photo, "--width-mm", width, "--preset", "found", "--format", "json",
                           "--quiet", *extra))
    light = found["light"] or {}
    for fresh, text in (("seen", graphs / "fitted.ron"), ("start", source), ("truth", graphs / "hidden.ron")):
        text, _ = lit_by(text.read_text(), width, light.get("azimuth", 225.0), light.get("elevation"))
        (graphs / f"{fresh}.ron").write_text(text)
    (graphs / "made.ron").write_text(lit_by((graphs / "fitted.ron").read_text(), plate, azimuth, elevation)[0])

    target = load(photo)
    fits = [lit("seen", seed, preset="found") for seed in (1, 2)]
    start = lit("start", 1)
    others = [lit("start", 1, preset=preset) for preset in form.get("presets", {})]
    rows = {
        "floor": judged([load(photograph("hidden", 1, values=hidden))], target),
        "fit": judged([load(path) for path in fits], target),
        "made": judged([load(photograph("made", 1, preset="found"))], target),
        "truth": judged([load(lit("truth", 1, values=hidden))], target),
        "preset": [min(values) for values in zip(*(judged([load(path)], target) for path in [start, *others]))],
    }
    sheet = Image.new("RGB", (4 * TILE + 12, TILE), "white")
    for at, path in enumerate([photo, *fits, start]):
        sheet.paste(Image.open(path).convert("RGB").resize((TILE, TILE), Image.BOX), (at * (TILE + 4), 0))
    out.mkdir(parents=True, exist_ok=True)
    sheet.quantize(192, dither=Image.Dither.NONE).save(out / f"{name}.png", optimize=True)
    shutil.copy(photo, Path(tempfile.gettempdir()) / f"showcase_{name}.jpg")

    numbers = misses(found, hidden, ranges)
    median = lambda values: f"{100 * float(np.median(values)):.1f} %" if values else "–"
    cells = " | ".join(f"{1e3 * rows[key][0]:.2f}, {rows[key][1]:.3f}" for key in ("floor", "fit", "made", "truth", "preset"))
    nearest = min(one for one in (found["start"], (found["nearest_preset"] or {}).get("distance")) if one is not None)
    print(f"| {name}, {len(found['parameters']) + 1 + (light.get('elevation') is not None)} | {found['renders']} | {found['cpu_s']:.0f} | "
          f"{found['floor']:.2f} → **{found['distance']:.2f}** ({nearest:.2f}) | {cells} | "
          f"{median([e for e, *_ in numbers])}, {median([e for e, sure, *_ in numbers if sure])} | "
          f"{sum(sure for _, sure, *_ in numbers)} of {len(numbers)} | {sum(held for *_, held, _ in numbers)} of {len(numbers)} |", flush=True)
    print("  hidden", json.dumps(hidden), "light", round(azimuth), round(elevation), flush=True)
    print("  found", json.dumps({key: one["value"] for key, one in found["parameters"].items()}), json.dumps(light), found["unreached"], flush=True)


def main():
    args = argparse.ArgumentParser()
    args.add_argument("program")
    args.add_argument("names", nargs="*", default=NAMES)
    args.add_argument("--number", type=int, default=1, help="of the hidden values")
    args.add_argument("--out", type=Path, default=ROOT / "docs" / "fit")
    args.add_argument("--renders", type=int)
    args = args.parse_args()
    print("| graph, unknowns | renders | CPU s | d: floor → fit (preset) | floor | fit | fit in Cycles | hidden in Shibo | nearest preset | "
          "median error of numbers: all, determined | determined | errors hold |\n" + "|---" * 12 + "|")
    for name in args.names:
        with tempfile.TemporaryDirectory() as folder:
            extra = ["--renders", args.renders] if args.renders else []
            try:
                showcase(str(Path(args.program).resolve()), name, args.number, Path(folder), args.out, extra)
            except RuntimeError as error:
                print(f"{name}: {error}", flush=True)


if __name__ == "__main__":
    main()
