"""Builds in Blender the materials of programs that are not installed, from the pictures of a target, read as that
program reads them.

The tables repeat the documentation of each program: the picture and channel for each input, smoothness in place of
roughness, and normals whose y points down. A wrong picture then shows.
"""
import os

import bpy

# For each input of Blender's Principled BSDF: end of the file name, channel (None for colours and normals), conversion.
UNREAL = {
    "Base Color": ("BaseColor.png", None, "srgb"),
    "Roughness": ("ORM.png", "Green", None),
    "Metallic": ("ORM.png", "Blue", None),
    "Normal": ("Normal.png", None, "down"),
    "Coat Weight": ("ClearCoat.png", "Red", None),
    "Coat Roughness": ("ClearCoatRoughness.png", "Red", None),
    "Anisotropic": ("Anisotropy.png", "Red", None),
    "Tangent": ("Tangent.png", None, "down"),
    "Displacement": ("Height.exr", "Red", None),
}
UNITY = {
    "Base Color": ("BaseMap.png", None, "srgb"),
    "Roughness": ("MaskMap.png", "Alpha", "inverted"),
    "Metallic": ("MaskMap.png", "Red", None),
    "Normal": ("NormalMap.png", None, "up"),
    "Coat Weight": ("CoatMask.png", "Red", None),
    "Anisotropic": ("AnisotropyMap.png", "Red", None),
    "Tangent": ("TangentMap.png", None, "up"),
    "Displacement": ("HeightMap.exr", "Red", None),
}
GODOT = {
    "Base Color": ("albedo.png", None, "srgb"),
    "Roughness": ("roughness.png", "Red", None),
    "Metallic": ("metallic.png", "Red", None),
    "Normal": ("normal.png", None, "up"),
    "Coat Weight": ("clearcoat.png", "Red", None),
    "Coat Roughness": ("clearcoat.png", "Green", None),
    "Anisotropic": ("flow.png", "Alpha", None),
    "Tangent": ("flow.png", None, "up"),
    "Displacement": ("height.exr", "Red", None),
}
ARNOLD = {
    "Base Color": ("base_color.exr", None, None),
    "Roughness": ("specular_roughness.exr", "Red", None),
    "Metallic": ("metalness.exr", "Red", None),
    "Normal": ("normal.exr", None, "up"),
    "Coat Weight": ("coat.exr", "Red", None),
    "Coat Roughness": ("coat_roughness.exr", "Red", None),
    "Coat Normal": ("coat_normal.exr", None, "up"),
    "Anisotropic": ("specular_anisotropy.exr", "Red", None),
    "Displacement": ("displacement.exr", "Red", None),
}
RENDERMAN = {
    "Base Color": ("diffuseColor.exr", None, None),
    "Roughness": ("specularRoughness.exr", "Red", None),
    "Normal": ("bumpNormal.exr", None, "up"),
    "Coat Weight": ("clearcoatGain.exr", "Red", None),
    "Coat Roughness": ("clearcoatRoughness.exr", "Red", None),
    "Coat Normal": ("clearcoatBumpNormal.exr", None, "up"),
    "Anisotropic": ("specularAnisotropy.exr", "Red", None),
    "Displacement": ("displacement.exr", "Red", None),
}
TARGETS = {"unreal": UNREAL, "unity": UNITY, "godot": GODOT, "arnold": ARNOLD, "renderman": RENDERMAN}
# The same for the inputs of MaterialX's OpenPBR surface.
OPEN_PBR = {
    "base_color": ("Base Color", None),
    "specular_roughness": ("Roughness", "Red"),
    "base_metalness": ("Metallic", "Red"),
    "geometry_normal": ("Normal", None),
    "geometry_coat_normal": ("Coat Normal", None),
    "coat_weight": ("Coat Weight", "Red"),
    "coat_roughness": ("Coat Roughness", "Red"),
    "specular_roughness_anisotropy": ("Anisotropic", "Red"),
}


class Builder:
    """Builds a material whose pictures are placed on the UV map."""

    def __init__(self, placing):
        self.material = bpy.data.materials.new("material")
        self.material.use_nodes = True
        tree = self.material.node_tree
        self.nodes, self.links = tree.nodes, tree.links
        self.surface, self.output = self.nodes["Principled BSDF"], self.nodes["Material Output"]
        coordinates, self.placed = self.nodes.new("ShaderNodeTexCoord"), self.nodes.new("ShaderNodeMapping")
        for name, value in placing.items():
            self.placed.inputs[name].default_value = value
        self.links.new(coordinates.outputs["UV"], self.placed.inputs["Vector"])
        self.split = {}

    def picture(self, path, channel, srgb):
        node = self.nodes.new("ShaderNodeTexImage")
        node.image = bpy.data.images.load(path, check_existing=True)
        linear = "Non-Color" if channel or not path.endswith(".exr") else "Linear Rec.709"
        node.image.colorspace_settings.name = "sRGB" if srgb else linear
        node.extension = "EXTEND"
        self.links.new(self.placed.outputs["Vector"], node.inputs["Vector"])
        if channel == "Alpha":
            node.image.alpha_mode = "CHANNEL_PACKED"
            return node.outputs["Alpha"]
        if channel is None:
            return node.outputs["Color"]
        parts = self.nodes.new("ShaderNodeSeparateColor")
        self.links.new(node.outputs["Color"], parts.inputs["Color"])
        return parts.outputs[channel]

    def inverted(self, value):
        node = self.nodes.new("ShaderNodeMath")
        node.operation, node.inputs[0].default_value = "SUBTRACT", 1.0
        self.links.new(value, node.inputs[1])
        return node.outputs["Value"]

    def upwards(self, color):
        parts, whole = self.nodes.new("ShaderNodeSeparateColor"), self.nodes.new("ShaderNodeCombineColor")
        self.links.new(color, parts.inputs["Color"])
        for name in ("Red", "Blue"):
            self.links.new(parts.outputs[name], whole.inputs[name])
        self.links.new(self.inverted(parts.outputs["Green"]), whole.inputs["Green"])
        return whole.outputs["Color"]

    def feed(self, socket, path, channel, how):
        value = self.picture(path, channel, how == "srgb")
        if how == "inverted":
            value = self.inverted(value)
        if how == "down":
            value = self.upwards(value)
        if socket == "Displacement":
            # Heights are in mm.
            relief = self.nodes.new("ShaderNodeDisplacement")
            relief.inputs["Midlevel"].default_value, relief.inputs["Scale"].default_value = 0.0, 0.001
            self.links.new(value, relief.inputs["Height"])
            self.links.new(relief.outputs["Displacement"], self.output.inputs["Displacement"])
        elif socket in ("Normal", "Coat Normal", "Tangent"):
            # Tangents are stored like normals; Cycles projects them onto the surface.
            normal = self.nodes.new("ShaderNodeNormalMap")
            self.links.new(value, normal.inputs["Color"])
            self.links.new(normal.outputs["Normal"], self.surface.inputs[socket])
        else:
            self.links.new(value, self.surface.inputs[socket])


def of_target(target, folder, numbers, placing):
    """The material of a target's pictures in a folder; inputs without a picture are set to `numbers`."""
    builder, read = Builder(placing), set()
    for socket, (end, channel, how) in TARGETS[target].items():
        path = os.path.join(folder, f"material_{end}")
        if os.path.exists(path):
            builder.feed(socket, path, channel, how)
            read.add(os.path.basename(path))
        elif socket in numbers:
            builder.surface.inputs[socket].default_value = numbers[socket]
    for socket, value in numbers.items():
        if socket not in TARGETS[target]:
            builder.surface.inputs[socket].default_value = value
    return builder.material, read


def of_materialx(path, placing):
    """The material of a MaterialX document: pictures and numbers of its surface and displacement."""
    import MaterialX

    document = MaterialX.createDocument()
    MaterialX.readFromXmlFile(document, path)
    graph = document.getNodeGraphs()[0]
    builder, folder = Builder(placing), os.path.dirname(path)

    def image(output):
        node = graph.getNode(graph.getOutput(output).getNodeName())
        while node.getCategory() not in ("image", "tiledimage"):
            node = next(found for found in (graph.getNode(i.getNodeName()) for i in node.getInputs() if i.getNodeName()) if found)
        given = node.getInput("file")
        return os.path.join(folder, given.getValueString()), given.getAttribute("colorspace") == "srgb_texture"

    surface = next(node for node in document.getNodes() if node.getCategory() == "open_pbr_surface")
    for given in surface.getInputs():
        socket, channel = OPEN_PBR.get(given.getName(), (None, None))
        if socket is None:
            continue
        if given.getOutputString():
            path, srgb = image(given.getOutputString())
            builder.feed(socket, path, channel, "srgb" if srgb else "up")
        else:
            builder.surface.inputs[socket].default_value = float(given.getValueString())
    for node in document.getNodes():
        if node.getCategory() == "displacement":
            path, _ = image(node.getInput("displacement").getOutputString())
            builder.feed("Displacement", path, "Red", None)
            assert float(node.getInput("scale").getValueString()) == 0.001, "heights are not in mm"
    return builder.material
