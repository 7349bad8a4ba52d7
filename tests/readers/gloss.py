"""Renders brushed metal in Blender, from the script of `Preset(target: Blender)` and from the .glb, and measures the
direction in which highlights stretch: across the brush lines, for an angle that is a number or a picture.

    python gloss.py FOLDER     the files of `shibo render brushed.ron --as blender` and `--as gltf`
"""
import math
import os
import runpy
import sys

import bpy
import numpy
from mathutils import Vector

folder = os.path.abspath(sys.argv[1])
SIDE = 128


def fresh():
    """Renders a square metre from straight above, y up."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.device = "CYCLES", "CPU"
    scene.cycles.samples, scene.cycles.seed, scene.cycles.use_denoising = 16, 7, False
    scene.render.resolution_x = scene.render.resolution_y = SIDE
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.type, camera.data.ortho_scale, camera.location = "ORTHO", 1.0, (0, 0, 3)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs[1].default_value = 0.0
    return scene


def light(kind, place):
    lamp = bpy.data.objects.new("light", bpy.data.lights.new("light", kind))
    lamp.data.energy = 3 if kind == "SUN" else 50
    lamp.location = place
    lamp.rotation_euler = (-Vector(place)).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(lamp)


def by_script(name):
    material = runpy.run_path(os.path.join(folder, f"{name}_blender.py"))["build"]()
    bpy.ops.mesh.primitive_plane_add(size=1)
    bpy.context.object.data.materials.append(material)


def by_glb(name):
    bpy.ops.import_scene.gltf(filepath=os.path.join(folder, f"{name}.glb"))
    # glTF says that the tangent follows the texture, but Blender's importer links none if the angle is a number.
    tree = bpy.context.selected_objects[0].data.materials[0].node_tree
    surface = next(node for node in tree.nodes if node.type == "BSDF_PRINCIPLED")
    if not surface.inputs["Tangent"].is_linked:
        tangent = tree.nodes.new("ShaderNodeTangent")
        tangent.direction_type = "UV_MAP"
        tree.links.new(tangent.outputs["Tangent"], surface.inputs["Tangent"])


def brightness(make, name, kind, place):
    """Pixels by rows from below."""
    scene = fresh()
    make(name)
    light(kind, place)
    scene.render.filepath = os.path.join(folder, "_gloss.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    pixels = numpy.array(image.pixels[:]).reshape(SIDE, SIDE, 4)[:, :, 1]
    bpy.data.images.remove(image)
    return pixels


axis = (numpy.arange(SIDE) + 0.5) / SIDE - 0.5
x, y = numpy.meshgrid(axis, axis)


def longest(pixels):
    """Direction of the central highlight in degrees counter-clockwise from +x, and its elongation."""
    weight = numpy.where(pixels > 0.3 * pixels.max(), pixels, 0)
    weight = weight / weight.sum()
    xx, yy, xy = (weight * x * x).sum(), (weight * y * y).sum(), (weight * x * y).sum()
    spread = math.hypot(xx - yy, 2 * xy)
    return math.degrees(0.5 * math.atan2(2 * xy, xx - yy)) % 180, math.sqrt((xx + yy + spread) / (xx + yy - spread))


wrong = []
for how, make in (("the script", by_script), ("the .glb", by_glb)):
    # Lines along x, and lines that fall to the right by 30°.
    for name, expected in (("level", 90), ("lines", 60), ("picture", 60)):
        angle, long = longest(brightness(make, name, "POINT", (0, 0, 0.5)))
        print(f"{name} by {how}: long at {angle:.1f}° instead of {expected}°, {long:.2f} times as long as wide")
        off = abs((angle - expected + 90) % 180 - 90)
        if off > 5 or long < 2:
            wrong.append(f"{name} by {how}")
    # The lines of a disc are circles: its highlights lie towards the light and away from it.
    azimuth = math.radians(20)
    high = math.radians(70)
    place = (math.cos(azimuth) * math.cos(high), math.sin(azimuth) * math.cos(high), math.sin(high))
    pixels = brightness(make, "disc", "SUN", place)
    ring = (numpy.hypot(x, y) > 0.15) & (numpy.hypot(x, y) < 0.45)
    turn = numpy.degrees(numpy.arctan2(y, x)) - 20
    near = [pixels[ring & (abs((turn - at + 90) % 180 - 90) < 12)].mean() for at in (0, 90)]
    print(f"disc by {how}: {near[0]:.3f} towards the light, {near[1]:.3f} beside it")
    if near[0] < 3 * near[1]:
        wrong.append(f"disc by {how}")
if wrong:
    sys.exit("highlights are not long across the brush lines: " + ", ".join(wrong))
