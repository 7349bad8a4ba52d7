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


def rimmed(height):
    """Samples with those on the rim, where the canvas tiles."""
    side = (height[:, :1] + height[:, -1:]) / 2
    wide = np.hstack([side, height, side])
    edge = (wide[:1] + wide[-1:]) / 2
    return np.vstack([edge, wide, edge])


def positions(count):
    """Places of samples along a side, rims included."""
    return np.r_[0, (np.arange(count) + 0.5) * WIDTH / count, WIDTH]


def cells(places, at):
    """The cell of each place, and the share of the way through it."""
    n = np.clip(np.searchsorted(places, at) - 1, 0, len(places) - 2)
    return n, (at - places[n]) / (places[n + 1] - places[n])


def bilinear(corners, u, v):
    """Heights within cells, and the allowance there: a quarter of the twist."""
    a, b, c, d = corners
    return (a * (1 - u) + b * u) * (1 - v) + (c * (1 - u) + d * u) * v, np.abs(a + d - b - c) / 4


def on_canvas(height, x, y):
    grid, size = rimmed(height), height.shape[0]
    (i, u), (j, v) = cells(positions(size), x % WIDTH), cells(positions(size), y % WIDTH)
    return bilinear((grid[j, i], grid[j, i + 1], grid[j + 1, i], grid[j + 1, i + 1]), u, v)


def random_points(corners, count):
    """Points inside of facets, chosen by area."""
    rng = np.random.default_rng(1)
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    root, part = np.sqrt(rng.random(count)), rng.random(count)
    weights = np.stack([1 - root, root * (1 - part), root * part], axis=1)
    return np.einsum("nk,nkd->nd", weights, corners[rng.choice(len(corners), count, p=area / area.sum())])


def crossings(corners, axis, places):
    """The points at which the edges of facets cross lines between samples."""
    ends = np.concatenate([corners[:, [k, (k + 1) % 3]] for k in range(3)])
    ends = np.take_along_axis(ends, np.argsort(ends[:, :, axis], axis=1)[:, :, None], axis=1)
    low, high = ends[:, 0], ends[:, 1]
    first = np.searchsorted(places, low[:, axis] + 1e-6)
    counts = np.maximum(np.searchsorted(places, high[:, axis] - 1e-6) - first, 0)
    edge = np.repeat(np.arange(len(ends)), counts)
    line = first[edge] + np.arange(len(edge)) - np.repeat(np.cumsum(counts) - counts, counts)
    share = (places[line] - low[edge, axis]) / (high[edge, axis] - low[edge, axis])
    return low[edge] + share[:, None] * (high[edge] - low[edge])


def facets(name, mesh, height, thickness, error, mould, tiles):
    """The relief between the samples: edges where they cross lines between samples, and the inside of facets."""
    if mould:
        height = -height[:, ::-1]
    corners = np.asarray(mesh.vertices, np.float64)[np.asarray(mesh.faces)]
    sides = corners[:, 1:] - corners[:, :1]
    area = sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0]
    corners = corners[area > 0] * [1, -1, 1] + [0, WIDTH, -thickness]
    own = positions(height.shape[0])
    across = np.concatenate([own + tile * WIDTH for tile in range(tiles)])
    crossed = np.concatenate([crossings(corners, 0, across), crossings(corners, 1, own)])
    off = np.abs(crossed[:, 2] - on_canvas(height, crossed[:, 0], crossed[:, 1])[0]).max()
    assert len(crossed) > 1000 and off <= error + 2e-6, f"{name}: an edge is {off} mm off, {error} are allowed"
    inside = random_points(corners, 100_000)
    wanted, allowance = on_canvas(height, inside[:, 0], inside[:, 1])
    over = (np.abs(inside[:, 2] - wanted) - allowance).max()
    assert over <= error + 2e-6, f"{name}: a point of a facet is {over} mm off, {error} are allowed"
    return off, over


def rolled(name, mesh, height, error):
    """The inside of a roll's facets, along the radius."""
    size, length, radius = height.shape[0], 2 * WIDTH, 2 * WIDTH / (2 * np.pi)
    corners = np.asarray(mesh.vertices, np.float64)[np.asarray(mesh.faces)]
    far, z = np.hypot(corners[:, :, 0], corners[:, :, 1]).min(axis=1), corners[:, :, 2]
    is_end = (z.max(axis=1) < 1e-6) | (z.min(axis=1) > length - 1e-6)
    points = random_points(corners[(far > 2) & ~is_end], 200_000)
    column = np.arctan2(points[:, 1], points[:, 0]) % (2 * np.pi) / (2 * np.pi) * 2 * size - 0.5
    left, u = np.floor(column).astype(int), column - np.floor(column)
    j, v = cells(positions(size), (length - points[:, 2]) % WIDTH)
    grid = rimmed(height)[:, 1:-1]
    around = left % size, (left + 1) % size
    wanted, allowance = bilinear([grid[row, column] for row in (j, j + 1) for column in around], u, v)
    over = (np.abs(np.hypot(points[:, 0], points[:, 1]) - radius - wanted) - allowance).max()
    assert over <= error + 2e-6, f"{name}: a point of a facet is {over} mm off, {error} are allowed"
    return over


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
        edges, inside = facets(name, mesh, height, thickness, 0.005, mould, tiles)
        print(f"{name}: {len(mesh.faces)} triangles, {mesh.volume:.3f} mm³")
        print(f"{name}: samples within {off:.6f} mm, edges {edges:.6f} mm, facets {inside:.6f} mm")
        if file.endswith(".stl"):
            admesh(folder / file)
            sliced(folder / file, report, thickness + height.max())
    mesh, report = load(folder / "roll.3mf"), json.loads((folder / "roll_report.json").read_text())
    closed("roll", mesh, report, 0)
    radii("roll", mesh, height, 0.01)
    inside = rolled("roll", mesh, height, 0.01)
    print(f"roll: {len(mesh.faces)} triangles, {mesh.volume:.3f} mm³, facets within {inside:.6f} mm")
    sliced(folder / "roll.3mf", report, 2 * WIDTH)
    for name, file, euler in [("carved_ring", "3mf", 0), ("carved_ball", "stl", 2), ("carved_box", "ply", 2)]:
        mesh, report = load(folder / f"{name}.{file}"), json.loads((folder / f"{name}_report.json").read_text())
        closed(name, mesh, report, euler)
        print(f"{name}: {len(mesh.faces)} triangles, {mesh.volume:.3f} mm³, closed")
    admesh(folder / "carved_ball.stl")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
