"""Renders objects in Blender for docs/gallery.md: a .glb as it is, or maps on a cloth that hangs over an edge.

    python objects.py OUT.png FILE.glb [size=MM] [turn=DEGREES] [tilt=DEGREES] [from=DEGREES] [samples=N] [side=PIXELS]
    python objects.py OUT.png cloth:PREFIX [mm=CANVAS] …         PREFIX_base_color.png, PREFIX_normal.png, …

`size` is the longest side in the picture, `turn` rotates the object about its vertical axis, `tilt` lays it down, `from`
is the angle of the camera above the horizon. All share one studio: a grey floor that curves up behind, a large soft light
from the left, a narrow one from behind.
"""
import math
import os
import sys

import bpy
from mathutils import Vector

out, source = os.path.abspath(sys.argv[1]), sys.argv[2]
given = dict(argument.split("=") for argument in sys.argv[3:])


def number(name, usual):
    return float(given.get(name, usual))


def studio():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = int(number("samples", 96))
    scene.cycles.use_denoising = True
    scene.cycles.seed = 7
    scene.render.resolution_x = scene.render.resolution_y = int(number("side", 400))
    scene.render.image_settings.file_format = "PNG"
    scene.render.image_settings.color_mode = "RGB"
    scene.render.image_settings.compression = 100
    scene.view_settings.view_transform = "Filmic"
    scene.view_settings.look = "Medium High Contrast"
    scene.view_settings.exposure = number("exposure", 0)
    world = bpy.data.worlds.new("world")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs[0].default_value = (0.9, 0.95, 1.0, 1)
    world.node_tree.nodes["Background"].inputs[1].default_value = number("fill", 0.25)
    scene.world = world

    def light(place, energy, size, color):
        lamp = bpy.data.objects.new("light", bpy.data.lights.new("light", "AREA"))
        lamp.data.energy, lamp.data.size, lamp.data.color = energy, size, color
        lamp.location = place
        lamp.rotation_euler = (Vector((0, 0, 0.3)) - Vector(place)).to_track_quat("-Z", "Y").to_euler()
        scene.collection.objects.link(lamp)

    light((-2.2, -1.0, 2.6), number("key", 110), 1.2, (1.0, 0.96, 0.9))
    light((1.9, 2.2, 1.9), number("rim", 60), 0.6, (0.92, 0.96, 1.0))
    return scene


def floor():
    """A sheet that lies on the ground and curves up behind."""
    points = [(-8.0, 0.0)]
    points += [(1.6 + math.sin(a) * 2, 2 - math.cos(a) * 2) for a in (math.pi / 2 * i / 24 for i in range(25))]
    points += [(3.6, 9.0)]
    corners = [(x, y, z) for y, z in points for x in (-9.0, 9.0)]
    faces = [(2 * i, 2 * i + 1, 2 * i + 3, 2 * i + 2) for i in range(len(points) - 1)]
    mesh = bpy.data.meshes.new("floor")
    mesh.from_pydata(corners, [], faces)
    for face in mesh.polygons:
        face.use_smooth = True
    material = bpy.data.materials.new("floor")
    material.use_nodes = True
    material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (0.24, 0.235, 0.23, 1)
    material.node_tree.nodes["Principled BSDF"].inputs["Roughness"].default_value = 0.85
    mesh.materials.append(material)
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("floor", mesh))


def of_maps(prefix):
    material = bpy.data.materials.new("material")
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    shader = nodes["Principled BSDF"]
    coords, mapping = nodes.new("ShaderNodeTexCoord"), nodes.new("ShaderNodeMapping")
    mapping.inputs["Scale"].default_value = (number("across", 1.6), number("across", 1.6), 1)
    links.new(coords.outputs["UV"], mapping.inputs["Vector"])
    sockets = {
        "base_color": "Base Color", "roughness": "Roughness", "metallic": "Metallic", "coat": "Coat Weight",
        "coat_roughness": "Coat Roughness", "sheen": "Sheen Weight", "normal": "Normal", "coat_normal": "Coat Normal",
    }
    for channel, socket in sockets.items():
        path = f"{prefix}_{channel}.png"
        if not os.path.exists(path):
            continue
        node = nodes.new("ShaderNodeTexImage")
        node.image = bpy.data.images.load(os.path.abspath(path))
        node.image.colorspace_settings.name = "sRGB" if channel == "base_color" else "Non-Color"
        node.interpolation = "Cubic"
        links.new(mapping.outputs["Vector"], node.inputs["Vector"])
        color = node.outputs["Color"]
        if channel.endswith("normal"):
            bump = nodes.new("ShaderNodeNormalMap")
            links.new(color, bump.inputs["Color"])
            color = bump.outputs["Normal"]
        links.new(color, shader.inputs[socket])
    return material


def cloth(prefix):
    """A hide laid over a pole: it hangs down in folds that open towards its edge."""
    n = 320
    wide, long, radius = 1.25, 1.1, 0.06
    corners, faces, uvs = [], [], []
    arc = radius * math.pi / 2
    for j in range(n + 1):
        for i in range(n + 1):
            u, v = i / n, j / n
            x = (u - 0.5) * wide
            # Distance from the top of the pole; a small part of the hide lies behind it.
            way = (v - 0.1) * long
            turn = max(min(way / radius, math.pi / 2), -math.pi / 2)
            down = max(abs(way) - arc, 0.0)
            y, z = -radius * math.sin(turn), radius * math.cos(turn) - down
            # Folds open towards the edge, each of its own width.
            deep = min(1.0, down / 0.8) if way > 0 else 0.0
            ease = deep * deep * (3 - 2 * deep)
            phase = 9 * x + 1.1 * math.sin(2.3 * x + 1.1) + 0.6 * deep
            y -= ease * 0.1 * (math.sin(phase) + 0.25 * math.sin(2.3 * phase + 1.7))
            x += ease * (0.04 * math.cos(phase) - 0.06 * x)
            corners.append((x, y, 0.98 + z + 0.01 * math.sin(5 * x)))
            uvs.append((u * wide, v * long))
    for j in range(n):
        for i in range(n):
            k = j * (n + 1) + i
            faces.append((k, k + 1, k + n + 2, k + n + 1))
    mesh = bpy.data.meshes.new("cloth")
    mesh.from_pydata(corners, [], faces)
    layer = mesh.uv_layers.new()
    for loop in mesh.loops:
        layer.data[loop.index].uv = (uvs[loop.vertex_index][0], -uvs[loop.vertex_index][1])
    for face in mesh.polygons:
        face.use_smooth = True
    mesh.materials.append(of_maps(prefix))
    thing = bpy.data.objects.new("cloth", mesh)
    bpy.context.scene.collection.objects.link(thing)
    return [thing]


def loaded(path):
    bpy.ops.import_scene.gltf(filepath=os.path.abspath(path))
    return [thing for thing in bpy.context.scene.objects if thing.type == "MESH"]


def corners_of(things):
    bpy.context.view_layer.update()
    return [thing.matrix_world @ Vector(corner) for thing in things for corner in thing.bound_box]


def placed(things):
    """Turns and scales the object, and puts it on the floor."""
    pivot = bpy.data.objects.new("pivot", None)
    bpy.context.scene.collection.objects.link(pivot)
    for thing in things:
        if thing.parent is None:
            thing.parent = pivot
    pivot.rotation_mode = "XYZ"
    pivot.rotation_euler = [math.radians(number(name, 0)) for name in ("tilt", "roll", "turn")]
    corners = corners_of(things)
    size = max(max(c[k] for c in corners) - min(c[k] for c in corners) for k in range(3))
    pivot.scale = [number("size", 1.0) / size] * 3
    corners = corners_of(things)
    low, high = ([pick(c[k] for c in corners) for k in range(3)] for pick in (min, max))
    pivot.location = (-(low[0] + high[0]) / 2, -(low[1] + high[1]) / 2, -low[2])
    bpy.context.view_layer.update()
    return (high[2] - low[2]) / 2


def camera(scene, aim):
    view = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    view.data.lens = 75
    up = math.radians(number("from", 28))
    away = number("away", 2.75)
    target = Vector((0, 0, aim + number("lift", 0)))
    view.location = target + Vector((0, -math.cos(up), math.sin(up))) * away
    view.rotation_euler = (target - view.location).to_track_quat("-Z", "Y").to_euler()
    scene.collection.objects.link(view)
    scene.camera = view


scene = studio()
if source.startswith("cloth:"):
    cloth(source.removeprefix("cloth:"))
    aim = 0.58
else:
    aim = placed(loaded(source))
if given.get("floor", "yes") == "yes":
    floor()
camera(scene, aim)
scene.render.filepath = out
bpy.ops.render.render(write_still=True)
