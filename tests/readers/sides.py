"""Renders a .glb in Blender from four sides and from above, side by side: borders of charts must be invisible.

    python sides.py FILE.glb OUT.png [PIXELS]
"""
import math
import os
import sys

import bpy
import numpy

file, out = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
side = int(sys.argv[3]) if len(sys.argv) > 3 else 420

bpy.ops.wm.read_factory_settings(use_empty=True)
scene = bpy.context.scene
bpy.ops.import_scene.gltf(filepath=file)
corners = [o.matrix_world @ v.co for o in scene.objects if o.type == "MESH" for v in o.data.vertices]
places = numpy.array([c[:] for c in corners])
low, high = places.min(axis=0), places.max(axis=0)
middle, radius = (low + high) / 2, numpy.linalg.norm(high - low) / 2

scene.render.engine, scene.cycles.device, scene.cycles.samples = "CYCLES", "CPU", 12
scene.render.resolution_x = scene.render.resolution_y = side
scene.view_settings.view_transform = "AgX"
world = bpy.data.worlds.new("world")
world.use_nodes = True
world.node_tree.nodes["Background"].inputs[0].default_value = (0.8, 0.85, 0.9, 1)
world.node_tree.nodes["Background"].inputs[1].default_value = 0.5
scene.world = world


def towards(thing, direction):
    """Turns an object so that its -z axis has the given direction."""
    x, y, z = direction
    thing.rotation_euler = (math.atan2(math.hypot(x, y), -z), 0, math.atan2(-x, y))


camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
camera.data.lens, camera.data.clip_start, camera.data.clip_end = 60, radius / 100, radius * 100
scene.collection.objects.link(camera)
scene.camera = camera
sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
sun.data.energy, sun.data.angle = 3, 0.1
scene.collection.objects.link(sun)

pictures = []
for azimuth, height in ((0, 22), (90, 22), (180, 22), (270, 22), (30, 70), (210, -40)):
    a, e = math.radians(azimuth), math.radians(height)
    way = numpy.array([math.sin(a) * math.cos(e), -math.cos(a) * math.cos(e), math.sin(e)])
    camera.location = middle + way * radius * 3.9
    towards(camera, -way)
    # Light from the upper left, slightly in front of the object.
    light = way + 0.9 * numpy.array([-math.cos(a), -math.sin(a), 0]) + numpy.array([0, 0, 0.7])
    towards(sun, -light)
    scene.render.filepath = out
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(out)
    pictures.append(numpy.array(image.pixels[:]).reshape(side, side, 4))
    bpy.data.images.remove(image)
rows = [numpy.concatenate(pictures[k : k + 3], axis=1) for k in (0, 3)]
# Rows of Blender's images run upwards.
whole = numpy.concatenate(rows[::-1], axis=0)
image = bpy.data.images.new("sides", whole.shape[1], whole.shape[0])
image.pixels = whole.ravel()
image.filepath_raw, image.file_format = out, "PNG"
image.save()
