"""Renders in Blender the material built by the script of `Preset(target: Blender)` and the one of a .glb, and compares
both with a material set up by hand from the same pictures; materials with deliberate errors must differ more.

    python blender.py FOLDER     the folder of the exported pictures, the script and the .glb
"""
import glob
import os
import runpy
import sys

import bpy
import numpy

folder = os.path.abspath(sys.argv[1])
script = glob.glob(os.path.join(folder, "*_blender.py"))[0]
stem = script[: -len("_blender.py")]
build = runpy.run_path(script)["build"]
scale = next(line for line in open(script) if 'inputs["Scale"].default_value = (' in line).split("= (")[1].split(",")
per_metre = [float(scale[0]), float(scale[1])]


def fresh():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = 16
    scene.cycles.use_denoising = False
    scene.cycles.seed = 7
    scene.render.resolution_x = scene.render.resolution_y = 400
    scene.view_settings.view_transform = "Standard"
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.type = "ORTHO"
    # Shows the canvas from above.
    camera.data.ortho_scale = 1.0 / per_metre[0]
    camera.location = (-0.5 + 0.5 / per_metre[0], 0.5 - 0.5 / per_metre[1], 1)
    scene.collection.objects.link(camera)
    scene.camera = camera
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.energy = 3
    sun.rotation_euler = (0.9, 0.2, 0.6)
    scene.collection.objects.link(sun)
    world = bpy.data.worlds.new("world")
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs[1].default_value = 0.3
    scene.world = world
    return scene


def plane(material):
    bpy.ops.mesh.primitive_plane_add(size=1)
    bpy.context.object.data.materials.append(material)


def picture():
    scene = bpy.context.scene
    scene.render.filepath = os.path.join(folder, "_render.png")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    return numpy.array(image.pixels[:]).reshape(400, 400, 4)[:, :, :3]


def by_hand(flip=False, by=1.0):
    """A material as a person sets it up; `flip` inverts normals, `by` changes the scale."""
    material = bpy.data.materials.new("hand")
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    surface = nodes["Principled BSDF"]
    where, placed = nodes.new("ShaderNodeTexCoord"), nodes.new("ShaderNodeMapping")
    placed.inputs["Scale"].default_value = (per_metre[0] * by, per_metre[1] * by, 1)
    placed.inputs["Location"].default_value = (0, 1 - per_metre[1] * by, 0)
    links.new(where.outputs["UV"], placed.inputs["Vector"])

    def image(channel, space):
        node = nodes.new("ShaderNodeTexImage")
        node.image = bpy.data.images.load(f"{stem}_{channel}.png")
        node.image.colorspace_settings.name = space
        links.new(placed.outputs["Vector"], node.inputs["Vector"])
        return node.outputs["Color"]

    links.new(image("base_color", "sRGB"), surface.inputs["Base Color"])
    for channel, socket in (("roughness", "Roughness"), ("metallic", "Metallic"), ("coat", "Coat Weight"),
                            ("coat_roughness", "Coat Roughness"), ("sheen", "Sheen Weight"), ("anisotropy", "Anisotropic")):
        if os.path.exists(f"{stem}_{channel}.png"):
            links.new(image(channel, "Non-Color"), surface.inputs[socket])
    if os.path.exists(f"{stem}_anisotropy_angle.exr"):
        # Converts degrees clockwise along fibres to turns counter-clockwise across them.
        node, turn = nodes.new("ShaderNodeTexImage"), nodes.new("ShaderNodeMath")
        across = nodes.new("ShaderNodeMath")
        node.image = bpy.data.images.load(f"{stem}_anisotropy_angle.exr")
        node.image.colorspace_settings.name = "Non-Color"
        links.new(placed.outputs["Vector"], node.inputs["Vector"])
        turn.operation = "DIVIDE"
        turn.inputs[1].default_value = -360
        links.new(node.outputs["Color"], turn.inputs[0])
        across.operation = "ADD"
        across.inputs[1].default_value = 0.25
        links.new(turn.outputs["Value"], across.inputs[0])
        links.new(across.outputs["Value"], surface.inputs["Anisotropic Rotation"])
        tangent = nodes.new("ShaderNodeTangent")
        tangent.direction_type = "UV_MAP"
        links.new(tangent.outputs["Tangent"], surface.inputs["Tangent"])
    for channel, socket in (("normal", "Normal"), ("coat_normal", "Coat Normal")):
        if not os.path.exists(f"{stem}_{channel}.png"):
            continue
        color = image(channel, "Non-Color")
        if flip:
            curve = nodes.new("ShaderNodeRGBCurve")
            green = curve.mapping.curves[1]
            green.points[0].location, green.points[1].location = (0, 1), (1, 0)
            links.new(color, curve.inputs["Color"])
            color = curve.outputs["Color"]
        normal = nodes.new("ShaderNodeNormalMap")
        links.new(color, normal.inputs["Color"])
        links.new(normal.outputs["Normal"], surface.inputs[socket])
    return material


def rendered(make):
    fresh()
    made = make()
    if made is not None:
        plane(made)
    return picture()


def constants(material):
    """Copies the numbers of the script to the material made by hand, which has its own pictures."""
    of, to = build("numbers", folder), material
    for socket in of.node_tree.nodes["Principled BSDF"].inputs:
        target = to.node_tree.nodes["Principled BSDF"].inputs.get(socket.name)
        if target is not None and not socket.is_linked and not target.is_linked and hasattr(socket, "default_value"):
            target.default_value = socket.default_value
    return material


def bare(material):
    """Removes displacement: the plane has only four corners, and glTF has no displacement."""
    links = material.node_tree.links
    for link in list(material.node_tree.nodes["Material Output"].inputs["Displacement"].links):
        links.remove(link)
    return material


def glb():
    bpy.ops.import_scene.gltf(filepath=f"{stem}.glb")
    size = bpy.context.selected_objects[0].dimensions
    assert max(abs(size[0] - 1), abs(size[1] - 1)) < 1e-4, f"the plane of the .glb is {size[:]}"
    return None


hand = rendered(lambda: constants(by_hand()))
far = {
    "normals turned over": rendered(lambda: constants(by_hand(flip=True))),
    "half the scale": rendered(lambda: constants(by_hand(by=0.5))),
}
near = {"the script": rendered(lambda: bare(build("script", folder))), "the .glb": rendered(glb)}
distance = {name: float(numpy.abs(other - hand).mean()) * 255 for name, other in {**near, **far}.items()}
for name, value in distance.items():
    print(f"{name}: {value:.3f} of 255 from the material set up by hand")
worst, least = max(distance[n] for n in near), min(distance[n] for n in far)
if worst > 1.0 or worst >= least:
    sys.exit("what is exported does not look like the material set up by hand")
