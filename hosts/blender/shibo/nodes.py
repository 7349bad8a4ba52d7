"""The node group of a material: pictures and numbers of channels become the inputs of the Principled BSDF."""
import json

import bpy

from . import box
from .images import COLORS

# The output of the group for each channel: its name, which is that of an input of the Principled BSDF, and its type.
SOCKETS = {
    "base_color": ("Base Color", "NodeSocketColor"),
    "metallic": ("Metallic", "NodeSocketFloat"),
    "roughness": ("Roughness", "NodeSocketFloat"),
    "ior": ("IOR", "NodeSocketFloat"),
    "opacity": ("Alpha", "NodeSocketFloat"),
    "normal": ("Normal", "NodeSocketVector"),
    "subsurface": ("Subsurface Weight", "NodeSocketFloat"),
    "specular": ("Specular IOR Level", "NodeSocketFloat"),
    "anisotropy": ("Anisotropic", "NodeSocketFloat"),
    "anisotropy_angle": ("Anisotropic Rotation", "NodeSocketFloat"),
    "coat": ("Coat Weight", "NodeSocketFloat"),
    "coat_roughness": ("Coat Roughness", "NodeSocketFloat"),
    "coat_normal": ("Coat Normal", "NodeSocketVector"),
    "sheen": ("Sheen Weight", "NodeSocketFloat"),
    "emission": ("Emission Color", "NodeSocketColor"),
    "height": ("Displacement", "NodeSocketVector"),
    "ao": ("AO", "NodeSocketFloat"),
}
# Outputs that come with a channel.
ALSO = {
    "anisotropy_angle": ("Tangent", "NodeSocketVector"),
    "emission": ("Emission Strength", "NodeSocketFloat"),
}
NORMALS = ("normal", "coat_normal")
# The property of a group that tells how its nodes were made.
SHAPE = "shibo_shape"


class Builder:
    """Makes nodes from left to right."""

    def __init__(self, tree):
        self.tree = tree
        self.column = 0
        self.row = 0

    def node(self, kind, name="", inputs=(), **fields):
        """A node. `inputs` are pairs of an input and a number, a tuple or an output of another node."""
        node = self.tree.nodes.new(kind)
        node.location = (220 * self.column, -180 * self.row)
        self.row += 1
        if name:
            node.name = node.label = name
        for field, value in fields.items():
            setattr(node, field, value)
        for at, value in inputs:
            if isinstance(value, bpy.types.NodeSocket):
                self.tree.links.new(value, node.inputs[at])
            else:
                node.inputs[at].default_value = value
        return node

    def next(self):
        """Goes to the next column."""
        self.column, self.row = self.column + 1, 0

    def math(self, operation, *values):
        """The result of a Math node."""
        return self.node("ShaderNodeMath", inputs=enumerate(values), operation=operation).outputs[0]

    def vector(self, operation, *values, name=""):
        """The result of a Vector Math node; `SCALE` takes a vector and a number."""
        inputs = enumerate(values)
        if operation == "SCALE":
            inputs = ((0, values[0]), ("Scale", values[1]))
        node = self.node("ShaderNodeVectorMath", name, operation=operation, inputs=inputs)
        return node.outputs["Value" if operation in ("LENGTH", "DOT_PRODUCT") else "Vector"]

    def image(self, image, vector, repeats):
        """The colour of an image."""
        node = self.node("ShaderNodeTexImage", inputs=[("Vector", vector)], image=image)
        node.extension = "REPEAT" if repeats else "EXTEND"
        return node.outputs["Color"]


def kinds(channels):
    """How each channel enters the group: by a picture, or as a number."""
    return {channel: "image" if hasattr(value, "pixels") else "value" for channel, value in channels.items()}


def is_used(channel, kind):
    """True for a channel that the group shows: normals and heights that are the same everywhere change nothing."""
    return channel in SOCKETS and not (kind == "value" and channel in NORMALS + ("height",))


def wanted(channels):
    """The outputs of the group, as pairs of name and type."""
    names = []
    for channel, socket in SOCKETS.items():
        if channel in channels and is_used(channel, kinds(channels)[channel]):
            names.append(socket)
            names.extend([ALSO[channel]] if channel in ALSO else [])
    return names


def ensure(material, channels, lay):
    """Makes or changes the group of a material.

    `channels` has an image or a tuple of numbers for each channel. `lay` has `by` (`UV`, `BOX`, `CUT`), `size_mm`, `density` (metres
    of a unit of u and v), `scale` (of the object) and `uv_map`.
    """
    if bpy.app.version < (5, 0, 0):
        material.use_nodes = True
    tree = material.shibo.tree
    is_new = tree is None or tree.library is not None
    if is_new:
        tree = bpy.data.node_groups.new(f"Shibo {material.name}", "ShaderNodeTree")
        material.shibo.tree = tree
    fresh = _outputs(tree, wanted(channels))
    shape = json.dumps([lay["by"], kinds(channels)], sort_keys=True)
    if tree.get(SHAPE) != shape or _images(tree) != _images_of(channels):
        tree.nodes.clear()
        _build(tree, channels, lay)
        tree[SHAPE] = shape
    _set(tree, channels, lay)
    _join(material, tree, is_new, fresh)
    if "height" in channels and hasattr(material, "displacement_method") and is_new:
        material.displacement_method = "BOTH"


def _images(tree):
    return {node.image for node in tree.nodes if node.bl_idname == "ShaderNodeTexImage" and node.image}


def _images_of(channels):
    return {value for channel, value in channels.items() if channel in SOCKETS and hasattr(value, "pixels")}


def _outputs(tree, names):
    """Makes the outputs of the group; keeps those that exist, so links outside stay. Returns the new names."""
    have = {item.name: item for item in tree.interface.items_tree if item.item_type == "SOCKET"}
    for name, item in have.items():
        if name not in dict(names):
            tree.interface.remove(item)
    fresh = [(name, kind) for name, kind in names if name not in have]
    for name, kind in fresh:
        tree.interface.new_socket(name, in_out="OUTPUT", socket_type=kind)
    return [name for name, _ in fresh]


def _build(tree, channels, lay):
    """Makes the nodes of a group without nodes."""
    builder = Builder(tree)
    by, how = lay["by"], kinds(channels)
    repeats = by != "CUT"
    if by == "BOX":
        place = box.place(builder)
    else:
        vector = builder.node("ShaderNodeUVMap", "UV").outputs["UV"]
        if by == "UV":
            vector = builder.node("ShaderNodeMapping", "Size", [("Vector", vector)]).outputs["Vector"]
    builder.next()
    made = {}
    for channel, value in channels.items():
        if not is_used(channel, how[channel]):
            continue
        if how[channel] == "value":
            made[channel] = _number(builder, channel)
        elif by == "BOX":
            made[channel] = box.sample(builder, place, value, channel in NORMALS)
        else:
            made[channel] = builder.image(value, vector, repeats)
    builder.next()
    for channel, output in list(made.items()):
        made[channel] = _converted(builder, channel, output, how[channel], by)
    also = {}
    if "anisotropy_angle" in made:
        # Without it directions would turn about the object's z axis.
        if by == "BOX":
            also["Tangent"] = box.tangent(builder, place)
        else:
            also["Tangent"] = builder.node("ShaderNodeTangent", "Tangent", direction_type="UV_MAP").outputs["Tangent"]
    if "emission" in made:
        strength = builder.node("ShaderNodeValue", "Emission Strength")
        strength.outputs[0].default_value = 1.0
        also["Emission Strength"] = strength.outputs[0]
    builder.next()
    end = builder.node("NodeGroupOutput")
    for name, output in [(SOCKETS[channel][0], output) for channel, output in made.items()] + list(also.items()):
        tree.links.new(output, end.inputs[name])


def _number(builder, channel):
    kind = "ShaderNodeRGB" if channel in COLORS else "ShaderNodeValue"
    return builder.node(kind, channel).outputs[0]


def _converted(builder, channel, output, how, by):
    """The output for an input of the Principled BSDF."""
    if how == "value":
        return output
    if channel in NORMALS and by != "BOX":
        return builder.node("ShaderNodeNormalMap", channel, [("Color", output)]).outputs["Normal"]
    if channel == "height":
        # Heights are in mm.
        inputs = [("Height", output), ("Midlevel", 0.0), ("Scale", 0.001)]
        return builder.node("ShaderNodeDisplacement", channel, inputs).outputs["Displacement"]
    if channel == "anisotropy_angle":
        # Degrees along brush lines become turns across them, the other way round: v is up here.
        return builder.math("MULTIPLY_ADD", output, -1 / 360, 90 / 360)
    if channel == "specular":
        return builder.math("MULTIPLY", output, 0.5)
    return output


def _value(channel, value):
    """A number of a channel as an input of the Principled BSDF takes it."""
    if channel in COLORS:
        return (*value[:3], 1.0)
    if channel == "anisotropy_angle":
        return (90.0 - value[0]) / 360.0 % 1.0
    return value[0] * 0.5 if channel == "specular" else value[0]


def _put(socket, value):
    """Sets a default value; the same value again would start renders of Blender for nothing."""
    now = socket.default_value
    now = tuple(now) if hasattr(now, "__len__") else now
    same = len(now) == len(value) and all(abs(a - b) < 1e-6 for a, b in zip(now, value)) if isinstance(now, tuple) else now == value
    if not same:
        socket.default_value = value


def _set(tree, channels, lay):
    """Sets numbers and places."""
    for channel, value in channels.items():
        node = tree.nodes.get(channel)
        if node is not None and not hasattr(value, "pixels"):
            _put(node.outputs[0], _value(channel, value))
    width, height = lay["size_mm"]
    if lay["by"] == "UV":
        scale = (1000 * lay["density"][0] / width, 1000 * lay["density"][1] / height, 1.0)
        size = tree.nodes["Size"]
        _put(size.inputs["Scale"], scale)
        # The top of the picture lies at v = 1.
        _put(size.inputs["Location"], (0.0, 1.0 - scale[1], 0.0))
    if lay["by"] == "BOX":
        box.set_size(tree, (1000 / width, 1000 / height, 1.0), lay["scale"], _put)
    for node in tree.nodes:
        if node.bl_idname in ("ShaderNodeUVMap", "ShaderNodeTangent", "ShaderNodeNormalMap") and node.uv_map != lay["uv_map"]:
            node.uv_map = lay["uv_map"]


def surface_of(material):
    """The Principled BSDF and the output of a material; makes those that are missing."""
    nodes, links = material.node_tree.nodes, material.node_tree.links
    output = next((node for node in nodes if node.bl_idname == "ShaderNodeOutputMaterial" and node.is_active_output), None)
    output = output or nodes.new("ShaderNodeOutputMaterial")
    surface = next((node for node in nodes if node.bl_idname == "ShaderNodeBsdfPrincipled"), None)
    if surface is None:
        surface = nodes.new("ShaderNodeBsdfPrincipled")
        surface.location = (output.location[0] - 300, output.location[1])
        if not output.inputs["Surface"].is_linked:
            links.new(surface.outputs["BSDF"], output.inputs["Surface"])
    return surface, output


def node_of(material):
    """The node of the group in the material, or None."""
    tree = material.shibo.tree
    nodes = material.node_tree.nodes if material.node_tree and tree else ()
    return next((node for node in nodes if node.bl_idname == "ShaderNodeGroup" and node.node_tree == tree), None)


def _join(material, tree, is_new, fresh):
    """Adds a new group to the material, and links new outputs to inputs that have no link."""
    node = node_of(material)
    if node is None and not is_new:
        # The user took the group out.
        return
    if not fresh and node is not None:
        return
    surface, output = surface_of(material)
    if node is None:
        node = material.node_tree.nodes.new("ShaderNodeGroup")
        node.node_tree = tree
        node.name = node.label = tree.name
        node.width = 220
        node.location = (surface.location[0] - 320, surface.location[1])
    for name in fresh:
        target = (output if name == "Displacement" else surface).inputs.get(name)
        if target is not None and not target.is_linked:
            material.node_tree.links.new(node.outputs[name], target)


def remove(material):
    """Removes the group from the material."""
    node = node_of(material)
    tree = material.shibo.tree
    if node is not None:
        material.node_tree.nodes.remove(node)
    material.shibo.tree = None
    if tree is not None and tree.library is None and tree.users == 0:
        bpy.data.node_groups.remove(tree)
