"""Shared by the tests in Blender: the extension, small scenes, renders, and pictures of the command."""
import os
import subprocess
import sys
import tempfile
import time

import bpy
import numpy

HERE = os.path.dirname(os.path.abspath(__file__))
SHIBO = os.path.abspath(os.environ["SHIBO"])
FOLDER = tempfile.mkdtemp(prefix="shibo-blender-")
SIDE = 160

# The extension finds the command in PATH.
os.makedirs(os.path.join(FOLDER, "bin"))
os.symlink(SHIBO, os.path.join(FOLDER, "bin", "shibo"))
os.environ["PATH"] = os.path.join(FOLDER, "bin") + os.pathsep + os.environ["PATH"]
sys.path.insert(0, os.path.dirname(HERE))

import shibo  # noqa: E402
from shibo import live  # noqa: E402

STRIPES = """(version: 1, canvas: (size_mm: 20, resolution: 256, tile: Both, seed: 1),
  params: { "bright": Number(default: 0.9, range: (0, 1), doc: "Bright stripes") },
  nodes: { "s": "= mix(0.02, $bright, smoothstep(0.49, 0.51, fract(x / 10)))", "m": Material(base_color: "s", roughness: 1) },
  outputs: { "material": "m" })
"""


def fresh():
    """An empty file."""
    bpy.ops.wm.read_factory_settings(use_empty=True)


def path(name):
    """A path in the folder of the tests."""
    return os.path.join(FOLDER, name)


def text(name, content):
    """Writes a file; returns its path."""
    with open(path(name), "w", encoding="utf-8") as file:
        file.write(content)
    return path(name)


def plane(size=0.04):
    """A plane."""
    bpy.ops.mesh.primitive_plane_add(size=size)
    return bpy.context.object


def pixels(image):
    """All pixels as an array of rows from the bottom."""
    flat = numpy.empty(len(image.pixels), dtype=numpy.float32)
    image.pixels.foreach_get(flat)
    return flat.reshape(image.size[1], image.size[0], 4)


def image(material, channel):
    """The pixels of a channel."""
    return pixels(material.shibo.images[channel].image)


def rendered_by_command(graph, *options, size=128):
    """The folder with pictures that `shibo render` writes."""
    folder = tempfile.mkdtemp(dir=FOLDER)
    subprocess.run([SHIBO, "render", graph, "-o", folder, "--resolution", str(size), "--quiet", *options], check=True)
    return folder


def load(file, space):
    """An image of a file."""
    loaded = bpy.data.images.load(file)
    loaded.colorspace_settings.name = space
    return loaded


def settings(samples=8):
    """Cycles with one sun, and a grey sky."""
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.device = "CYCLES", "CPU"
    scene.cycles.samples, scene.cycles.seed, scene.cycles.use_denoising = samples, 7, False
    scene.render.resolution_x = scene.render.resolution_y = SIDE
    scene.render.image_settings.file_format = "PNG"
    scene.view_settings.view_transform = "Standard"
    scene.world = bpy.data.worlds.new("world")
    if bpy.app.version < (5, 0, 0):
        scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs[1].default_value = 0.3
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.energy, sun.rotation_euler = 3, (0.9, 0.2, 0.6)
    scene.collection.objects.link(sun)
    return scene


def camera(width, at):
    """Looks straight down at a place."""
    scene = bpy.context.scene
    seen = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    seen.data.type, seen.data.ortho_scale, seen.location = "ORTHO", width, (*at, 1)
    scene.collection.objects.link(seen)
    scene.camera = seen


def picture():
    """The rendered picture, as values of 0 to 1."""
    scene = bpy.context.scene
    scene.render.filepath = path("render.png")
    bpy.ops.render.render(write_still=True)
    loaded = bpy.data.images.load(scene.render.filepath)
    found = pixels(loaded)[:, :, :3].copy()
    bpy.data.images.remove(loaded)
    return found


def settle(material, seconds=20):
    """Steps as the timer does, until the final pictures are in place.

    Returns the computing time in seconds of the longest step; the time on the clock also depends on other programs.
    """
    longest, end = 0.0, time.monotonic() + seconds
    work = live.work_of(material)
    while time.monotonic() < end:
        begin = time.thread_time()
        wait = live.step(time.monotonic())
        longest = max(longest, time.thread_time() - begin)
        if work.is_finished(material):
            return longest
        time.sleep(wait)
    raise AssertionError(f"not finished: {material.shibo.status}")
