"""Meshes of Blender: the size of their UV maps, and their files for the process."""
import math

import bpy
import numpy

# Share of the texels that several triangles may cover, because charts may touch.
MOST_OVERLAP = 0.01
# A UV map whose densest tenth has this many times the length of its least dense tenth is uneven.
UNEVEN = 1.5


class Unfit(Exception):
    """The mesh cannot be used as asked; the text says why and how to fix it."""


def evaluated(thing):
    """The object with modifiers, and its mesh. `release` must be called with the object afterwards."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    depsgraph.update()
    seen = thing.evaluated_get(depsgraph)
    mesh = seen.to_mesh()
    if mesh is None:
        raise Unfit(f"{thing.name} is no mesh; choose a mesh object")
    return seen, mesh


def release(seen):
    """Frees the mesh of `evaluated`."""
    seen.to_mesh_clear()


def arrays(mesh, uv_map, slot=None):
    """Corners of a mesh as arrays: positions (n, 3), the vertex of each corner (t, 3) and the UVs of corners (t, 3, 2).

    `slot` chooses the triangles of one material. Without the UV map, the UVs are None.
    """
    positions = numpy.empty(len(mesh.vertices) * 3, dtype=numpy.float32)
    mesh.vertices.foreach_get("co", positions)
    mesh.calc_loop_triangles()
    count = len(mesh.loop_triangles)
    corners, loops = (numpy.empty(count * 3, dtype=numpy.int32) for _ in range(2))
    mesh.loop_triangles.foreach_get("vertices", corners)
    mesh.loop_triangles.foreach_get("loops", loops)
    corners, loops = corners.reshape(-1, 3), loops.reshape(-1, 3)
    layers = [layer for layer in mesh.uv_layers if (layer.name == uv_map if uv_map else layer.active_render)]
    layer = layers[0] if layers else None
    uvs = None
    if layer is not None:
        flat = numpy.empty(len(mesh.loops) * 2, dtype=numpy.float32)
        layer.uv.foreach_get("vector", flat)
        uvs = flat.reshape(-1, 2)[loops]
    if slot is not None:
        used = numpy.empty(count, dtype=numpy.int32)
        mesh.loop_triangles.foreach_get("material_index", used)
        chosen = used == slot
        corners = corners[chosen]
        uvs = uvs[chosen] if uvs is not None else None
    return positions.reshape(-1, 3), corners, uvs


def density(positions, corners, uvs, scale):
    """The length on the surface in metres of one unit of u and of v, and how uneven it is.

    Both are medians over the triangles, weighted by area. `scale` is that of the object. The third number is the ratio of the
    longest tenth to the shortest. Returns None if no triangle has an area in the UV map.
    """
    points = positions.astype(numpy.float64)[corners] * numpy.asarray(scale, dtype=numpy.float64)
    flat = uvs.astype(numpy.float64)
    one, other = points[:, 1] - points[:, 0], points[:, 2] - points[:, 0]
    du, dv = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0]
    area = du[:, 0] * dv[:, 1] - du[:, 1] * dv[:, 0]
    size = numpy.linalg.norm(numpy.cross(one, other), axis=1)
    good = (numpy.abs(area) > 1e-14) & (size > 0)
    if not good.any():
        return None
    one, other, du, dv, area, size = one[good], other[good], du[good], dv[good], area[good], size[good]
    along_u = numpy.linalg.norm(one * dv[:, 1:] - other * du[:, 1:], axis=1) / numpy.abs(area)
    along_v = numpy.linalg.norm(other * du[:, :1] - one * dv[:, :1], axis=1) / numpy.abs(area)
    length = numpy.sqrt(along_u * along_v)
    low, high = _quantile(length, size, 0.1), _quantile(length, size, 0.9)
    return _quantile(along_u, size, 0.5), _quantile(along_v, size, 0.5), high / low


def _quantile(values, weights, share):
    order = numpy.argsort(values)
    total = numpy.cumsum(weights[order])
    return float(values[order][numpy.searchsorted(total, share * total[-1])])


def slots_of(thing, material):
    """The number of the material among those of the object; None if all faces have it."""
    slots = [slot.material for slot in thing.material_slots]
    return slots.index(material) if len(slots) > 1 and material in slots else None


def measure(thing, material, uv_map):
    """`density` of an object for the faces with a material. Raises `Unfit` if there are none, or without a usable UV map."""
    seen, mesh = evaluated(thing)
    try:
        positions, corners, uvs = arrays(mesh, uv_map, slots_of(thing, material))
        found = density(positions, corners, uvs, seen.matrix_world.to_scale()) if uvs is not None else None
    finally:
        release(seen)
    if not len(corners):
        raise Unfit(f"no face of {thing.name} has the material {material.name}; assign it in Edit Mode: Material > Assign")
    if uvs is None:
        raise Unfit(f"{thing.name} has no UV map; add one (Edit Mode > U > Smart UV Project), or lay the material by Box")
    if found is None:
        raise Unfit(f"the UV map of {thing.name} has no area; unwrap it again (Edit Mode > U > Smart UV Project), or use Box")
    return found


def pieces(count, corners):
    """The number of the connected piece of each vertex."""
    labels = numpy.arange(count)
    while True:
        before = labels.copy()
        least = labels[corners].min(axis=1)
        for corner in range(3):
            numpy.minimum.at(labels, corners[:, corner], least)
        labels = labels[labels]
        if (labels == before).all():
            return numpy.unique(labels, return_inverse=True)[1].reshape(-1)


def scatter(points, corners, spread, seed):
    """Lays each connected piece along z by its longest side, and shifts it by up to `spread` mm along x, y and z, as boards of a tree.

    Pieces lie around the origin afterwards; those of one shape get the same grain only by chance.
    """
    points = points.copy()
    labels = pieces(len(points), corners)
    random = numpy.random.RandomState(seed % 2**32)
    for piece in range(labels.max() + 1):
        mine = labels == piece
        own = points[mine]
        low, high = own.min(axis=0), own.max(axis=0)
        # Turned so that the longest axis comes last.
        turned = numpy.roll(own - (low + high) / 2, 2 - int(numpy.argmax(high - low)), axis=1)
        points[mine] = turned + random.uniform(-1, 1, 3) * spread
    return points


def write_obj(path, positions, corners, uvs, scale, spread=None, seed=0):
    """Writes triangles as OBJ in mm, z up. `scale` is that of the object; `spread` and `seed` are those of `scatter`."""
    used, corners = numpy.unique(corners, return_inverse=True)
    corners = corners.reshape(-1, 3)
    points = positions.astype(numpy.float64)[used] * (numpy.asarray(scale, dtype=numpy.float64) * 1000)
    if spread is not None:
        points = scatter(points, corners, numpy.asarray(spread), seed)
    corners = corners + 1
    # Equal UVs of one vertex are one entry.
    flat, entries = numpy.unique(uvs.reshape(-1, 2), axis=0, return_inverse=True)
    entries = entries.reshape(-1, 3) + 1
    with open(path, "w", encoding="ascii") as file:
        file.write("o mesh\n")
        file.write("".join("v %.6g %.6g %.6g\n" % tuple(row) for row in points.tolist()))
        file.write("".join("vt %.7g %.7g\n" % tuple(row) for row in flat.tolist()))
        rows = numpy.stack([corners, entries], axis=2).reshape(-1, 6).tolist()
        file.write("".join("f %d/%d %d/%d %d/%d\n" % tuple(row) for row in rows))


def export(path, thing, material):
    """Writes the evaluated mesh of an object, the faces with a material. Raises `Unfit` without UVs or faces."""
    shibo = material.shibo
    seen, mesh = evaluated(thing)
    try:
        positions, corners, uvs = arrays(mesh, shibo.uv_map, slots_of(thing, material))
        if uvs is None:
            raise Unfit(f"{thing.name} has no UV map; add one: Edit Mode > U > Smart UV Project")
        if not len(corners):
            raise Unfit(f"no face of {thing.name} has the material {material.name}")
        spread = tuple(shibo.spread) if shibo.by == "PIECES" else None
        write_obj(path, positions, corners, uvs, seen.matrix_world.to_scale(), spread, shibo.seed)
    finally:
        release(seen)


def judge(answer, name):
    """Refuses a mesh that pictures cannot be laid on. `answer` is that of the request `mesh`."""
    if not answer["uv"]:
        raise Unfit(f"{name} has no UV map; add one: Edit Mode > U > Smart UV Project")
    if answer["overlaps"] > MOST_OVERLAP:
        share = math.ceil(answer["overlaps"] * 100)
        raise Unfit(f"faces of {name} overlap in the UV map ({share} % of it); lay them apart: U > Pack Islands or Smart UV Project")


def place(thing, tree, move):
    """Position of an object in the solid as the protocol takes it.

    `tree` is an object whose z axis is the pith. Without one, `move` is the position in mm.
    """
    if tree is None:
        return {"move": [round(part, 4) for part in move], "turn": [0.0, 0.0, 0.0]}

    def rigid(matrix):
        location, rotation, _ = matrix.decompose()
        turned = rotation.to_matrix().to_4x4()
        turned.translation = location
        return turned

    matrix = rigid(tree.matrix_world).inverted() @ rigid(thing.matrix_world)
    # Rotations are those about x, then y, then z in both programs.
    turn = matrix.to_euler("XYZ")
    return {
        "move": [round(part * 1000, 4) for part in matrix.translation],
        "turn": [round(math.degrees(part), 4) for part in turn],
    }
