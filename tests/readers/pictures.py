"""Renders each export in Blender from straight above, in the same light, beside Shibo's own picture.

    python pictures.py FOLDER OUT     FOLDER/lit.png and FOLDER/TARGET/material*; writes OUT/NAME.jpg
"""
import os
import re
import runpy
import sys

import bpy
import numpy

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import targets as others

folder, out = (os.path.abspath(path) for path in sys.argv[1:])
SIDE = 320
script = os.path.join(folder, "blender", "material_blender.py")
scale = re.search(r'inputs\["Scale"\]\.default_value = \(([^)]*)\)', open(script).read()).group(1)
per_metre = [float(number) for number in scale.split(",")][:2]


def fresh():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = 24
    scene.cycles.use_denoising = False
    scene.cycles.seed = 7
    scene.render.resolution_x = scene.render.resolution_y = SIDE
    scene.render.image_settings.file_format = "JPEG"
    scene.render.image_settings.quality = 88
    scene.view_settings.view_transform = "Standard"
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.type = "ORTHO"
    # The canvas, which lies at the top left of the square metre.
    camera.data.ortho_scale = 1.0 / per_metre[0]
    camera.location = (-0.5 + 0.5 / per_metre[0], 0.5 - 0.5 / per_metre[1], 1)
    scene.collection.objects.link(camera)
    scene.camera = camera
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.energy = 6
    # From the top left, as in Shibo's own pictures.
    sun.rotation_euler = (-0.6, -0.6, 0)
    sun.data.angle = 0.2
    scene.collection.objects.link(sun)
    world = bpy.data.worlds.new("world")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs[1].default_value = 0.3
    scene.world = world
    return scene


def blender():
    plane(runpy.run_path(script)["build"]("material", os.path.join(folder, "blender")))


def gltf(file):
    bpy.ops.import_scene.gltf(filepath=os.path.join(folder, file))


def obj(file):
    # The file is in mm.
    bpy.ops.wm.obj_import(filepath=os.path.join(folder, file), global_scale=0.001)


def usd(file):
    bpy.ops.wm.usd_import(filepath=os.path.join(folder, file), import_textures_mode="IMPORT_PACK")


def pixels(path):
    image = bpy.data.images.load(path)
    width, height = image.size
    return numpy.array(image.pixels[:]).reshape(height, width, 4)[:, :, :3]


def placing():
    source = open(script).read()
    found = {name: re.search(rf'inputs\["{name}"\]\.default_value = \(([^)]*)\)', source) for name in ("Scale", "Location")}
    return {name: tuple(float(n) for n in match.group(1).split(",")) for name, match in found.items() if match}


def plane(material):
    bpy.ops.mesh.primitive_plane_add(size=1)
    bpy.context.object.data.materials.append(material)


def other(target):
    # Values for which a target has no picture are set by hand.
    numbers = {name: value[0] for name, value in runpy.run_path(script)["NUMBERS"].items() if len(value) == 1}
    where = os.path.join(folder, target)
    material, read = others.of_target(target, where, numbers, placing())
    unread = {name for name in os.listdir(where) if name.endswith((".png", ".exr"))} - read
    print(f"{target} has also {', '.join(sorted(unread)) or 'nothing'}")
    plane(material)


def materialx():
    plane(others.of_materialx(os.path.join(folder, "materialx", "material.mtlx"), placing()))


targets = {
    "blender": blender,
    "gltf": lambda: gltf("gltf/material.glb"),
    "gltf-files": lambda: gltf("gltf-files/material.gltf"),
    "usd": lambda: usd("usd/material.usda"),
    "usdz": lambda: usd("usdz/material.usdz"),
    "obj": lambda: obj("obj/material.obj"),
    "materialx": materialx,
    **{target: lambda target=target: other(target) for target in others.TARGETS},
}
made = {}
for name, load in targets.items():
    scene = fresh()
    load()
    meshes = [thing for thing in bpy.data.objects if thing.type == "MESH"]
    assert len(meshes) == 1, f"{name}: {len(meshes)} meshes"
    sides = sorted(meshes[0].dimensions)[1:]
    assert max(abs(side - 1) for side in sides) < 1e-4, f"{name}: {sides} m"
    # Embedded and separate files must look the same: one picture of both is kept.
    kept = folder if name in ("gltf-files", "usdz") else out
    scene.render.filepath = os.path.join(kept, f"{name}.jpg")
    bpy.ops.render.render(write_still=True)
    made[name] = pixels(scene.render.filepath)
scene = fresh()
own = bpy.data.images.load(os.path.join(folder, "lit.png"))
own.scale(SIDE, SIDE)
own.save_render(os.path.join(out, "shibo.jpg"), scene=scene)
for one, other in (("gltf", "gltf-files"), ("usd", "usdz")):
    if numpy.abs(made[one] - made[other]).max() > 0:
        sys.exit(f"{one} and {other} do not look the same")
for name, picture in made.items():
    print(f"{name}: {numpy.abs(picture - made['blender']).mean() * 255:.2f} of 255 from what the script builds")
