"""Checks bodies that Shibo wrote: closed, oriented, of the right volume, and within the error.

    check.py FOLDER

The folder holds the outputs of tests/objects/bodies.ron.
"""
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import manifold3d
import numpy as np
import OpenEXR
import trimesh

WIDTH = 12.0


def load(path):
    mesh = trimesh.load(path, process=False, force="mesh")
    if path.suffix == ".stl":
        mesh.merge_vertices(digits_vertex=7)
    return mesh


def closed(name, mesh, report, euler):
    assert mesh.is_watertight, f"{name} has holes"
    assert mesh.is_winding_consistent, f"{name} is not oriented"
    assert mesh.euler_number == euler, f"{name}: Euler number {mesh.euler_number}"
    assert mesh.body_count == 1, f"{name} has {mesh.body_count} pieces"
    assert len(mesh.faces) == report["triangles"], f"{name}: {len(mesh.faces)} triangles"
    assert len(mesh.vertices) == report["vertices"], f"{name}: {len(mesh.vertices)} vertices"
    assert abs(mesh.volume / report["volume_mm3"] - 1) < 1e-6, f"{name}: volume {mesh.volume}"
    assert abs(mesh.area / report["area_mm2"] - 1) < 1e-6, f"{name}: area {mesh.area}"
    solid = manifold3d.Manifold(
        manifold3d.Mesh(np.array(mesh.vertices, np.float32), np.array(mesh.faces, np.uint32))
    )
    assert solid.status() == manifold3d.Error.NoError, f"{name}: {solid.status()}"
    assert abs(solid.volume() / report["volume_mm3"] - 1) < 1e-4, f"{name}: Manifold has {solid.volume()}"


def top(vertices, faces, places):
    """Heights of the upper facets at places of the plane, by brute force in cells."""
    corners = vertices[faces]
    a, b, c = (corners[:, k] for k in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    found = np.full(len(places), np.nan)
    order = np.argsort(places[:, 1], kind="stable")
    rows = places[order, 1]
    for n in np.flatnonzero(area > 0):
        p, q, r = a[n], b[n], c[n]
        low, high = min(p[1], q[1], r[1]) - 1e-7, max(p[1], q[1], r[1]) + 1e-7
        near = order[np.searchsorted(rows, low) : np.searchsorted(rows, high, "right")]
        at = places[near]
        u = ((q[0] - at[:, 0]) * (r[1] - at[:, 1]) - (q[1] - at[:, 1]) * (r[0] - at[:, 0])) / area[n]
        v = ((r[0] - at[:, 0]) * (p[1] - at[:, 1]) - (r[1] - at[:, 1]) * (p[0] - at[:, 0])) / area[n]
        w = 1 - u - v
        inside = (u >= -1e-7) & (v >= -1e-7) & (w >= -1e-7)
        found[near[inside]] = (u * p[2] + v * q[2] + w * r[2])[inside]
    return found


def samples(name, mesh, height, thickness, error, mould, tiles):
    size = height.shape[0]
    if mould:
        height = -height[:, ::-1]
    height = np.tile(height, (1, tiles))
    step = WIDTH / size
    y, x = np.mgrid[0:size, 0 : size * tiles]
    places = np.stack([(x.ravel() + 0.5) * step, WIDTH - (y.ravel() + 0.5) * step], axis=1)
    vertices = np.asarray(mesh.vertices, np.float64)
    found = top(vertices, np.asarray(mesh.faces), places)
    off = np.abs(found - (thickness + height.ravel()))
    assert not np.isnan(off).any(), f"{name}: {np.isnan(off).sum()} samples have no facet above them"
    assert off.max() <= error + 1e-6, f"{name}: a sample is {off.max()} mm off, {error} are allowed"
    return off.max()


def radii(name, mesh, height, error):
    """Distances of the roll's vertices from the height, along the radius. Vertices are samples."""
    size = height.shape[0]
    vertices = np.asarray(mesh.vertices, np.float64)
    radius = 2 * WIDTH / (2 * np.pi)
    r = np.hypot(vertices[:, 0], vertices[:, 1])
    outer = (r > 2) & (vertices[:, 2] > 1e-6) & (vertices[:, 2] < 2 * WIDTH - 1e-6)
    angle = np.arctan2(vertices[outer, 1], vertices[outer, 0]) % (2 * np.pi)
    column = angle / (2 * np.pi) * 2 * size - 0.5
    row = (2 * WIDTH - vertices[outer, 2]) / WIDTH * size - 0.5
    left, part = np.floor(column).astype(int), column - np.floor(column)
    whole = np.abs(row - np.round(row)) < 1e-3
    rows = np.round(row).astype(int) % size
    between = height[rows, left % size] * (1 - part) + height[rows, (left + 1) % size] * part
    off = np.abs(r[outer] - radius - between)[whole]
    assert whole.sum() > 1000 and off.max() < 1e-5, f"{name}: a vertex is {off.max()} mm off"
    ends = [
        {tuple(v) for v in np.round(vertices[np.abs(vertices[:, 2] - z) < 1e-6][:, :2], 6)} for z in (0, 2 * WIDTH)
    ]
    assert ends[0] == ends[1], f"{name}: the ends differ"


def admesh(path):
    if not shutil.which("admesh"):
        print("skipped: admesh, it is not installed: apt-get install admesh")
        return
    told = subprocess.run(["admesh", str(path)], capture_output=True, text=True, errors="replace", check=True).stdout
    for line in ["Total disconnected facets", "Degenerate facets", "Edges fixed", "Facets removed", "Backwards edges", "Normals fixed"]:
        numbers = [part.split()[0] for part in told.split(line)[1:2] for part in [part.split(":")[1]]]
        assert numbers and int(numbers[0]) == 0, f"admesh: {line}: {numbers}"


def sliced(path, report, thickness):
    """Slices a body, which must need no repair."""
    if not os.environ.get("SHIBO_CI_FULL"):
        return
    if not shutil.which("prusa-slicer"):
        print("skipped: prusa-slicer, it is not installed: apt-get install --no-install-recommends prusa-slicer")
        return
    told = subprocess.run(["prusa-slicer", "--info", str(path)], capture_output=True, text=True, errors="replace", check=True).stdout
    told = dict(line.split(" = ") for line in told.splitlines() if " = " in line)
    assert told["manifold"] == "yes" and int(told["number_of_parts"]) == 1, f"{path.name}: {told}"
    repairs = {name for name in told if "repair" in name or name.endswith(("_edges", "_reversed", "_removed", "_fixed", "_added"))}
    assert not repairs, f"{path.name} is repaired: {told}"
    assert int(told["number_of_facets"]) == report["triangles"], f"{path.name}: {told}"
    assert abs(float(told["volume"]) / report["volume_mm3"] - 1) < 1e-4, f"{path.name}: {told}"
    code = path.with_suffix(".gcode")
    command = ["prusa-slicer", "--export-gcode", "--layer-height", "0.2", "--output", str(code), str(path)]
    subprocess.run(command, capture_output=True, check=True)
    heights = [float(line[3:]) for line in code.read_text().splitlines() if line.startswith(";Z:")]
    assert abs(heights[-1] - thickness) < 0.21, f"{path.name}: the last layer ends at {heights[-1]} mm"
    print(f"{path.name}: sliced into {len(heights)} layers")


def main(folder):
    part = OpenEXR.File(str(folder / "height.exr")).parts[0]
    height = next(iter(part.channels.values())).pixels.astype(np.float64)
    for name, file, thickness, mould, tiles in [("plate", "plate.stl", 2, False, 1), ("even", "even.ply", 2, True, 2)]:
        mesh, report = load(folder / file), json.loads((folder / f"{name}_report.json").read_text())
        closed(name, mesh, report, 2)
        ideal = tiles * WIDTH * WIDTH * (thickness + (-1 if mould else 1) * height.mean())
        assert abs(mesh.volume / ideal - 1) < 2e-3, f"{name}: volume {mesh.volume}, {ideal} expected"
        off = samples(name, mesh, height, thickness, 0.005, mould, tiles)
        print(f"{name}: {len(mesh.faces)} triangles, {mesh.volume:.3f} mm³, samples within {off:.6f} mm")
        if file.endswith(".stl"):
            admesh(folder / file)
            sliced(folder / file, report, thickness + height.max())
    mesh, report = load(folder / "roll.3mf"), json.loads((folder / "roll_report.json").read_text())
    closed("roll", mesh, report, 0)
    radii("roll", mesh, height, 0.01)
    print(f"roll: {len(mesh.faces)} triangles, {mesh.volume:.3f} mm³")
    sliced(folder / "roll.3mf", report, 2 * WIDTH)
    for name, file, euler in [("carved_ring", "3mf", 0), ("carved_ball", "stl", 2), ("carved_box", "ply", 2)]:
        mesh, report = load(folder / f"{name}.{file}"), json.loads((folder / f"{name}_report.json").read_text())
        closed(name, mesh, report, euler)
        print(f"{name}: {len(mesh.faces)} triangles, {mesh.volume:.3f} mm³, closed")
    admesh(folder / "carved_ball.stl")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
