"""Materials, images, groups, objects and meshes."""
import os
import types as _types

import numpy

from .nodes import NodeTree
from .types import ID


class Groups(list):
    """A collection of property groups."""

    def __init__(self, kind, owner):
        super().__init__()
        self._kind, self._id = kind, owner

    def add(self):
        group = self._kind()
        group.id_data = self._id
        if not hasattr(group, "name"):
            group.name = ""
        self.append(group)
        return group

    def get(self, name):
        return next((group for group in self if group.name == name), None)

    def find(self, name):
        return next((at for at, group in enumerate(self) if group.name == name), -1)

    def keys(self):
        return [group.name for group in self]

    def remove(self, at):
        del self[at]

    def __getitem__(self, key):
        return self.get(key) if isinstance(key, str) else list.__getitem__(self, key)


class Blocks(list):
    """All data-blocks of a type."""

    def __init__(self, kind, data):
        super().__init__()
        self._kind, self._data = kind, data

    def new(self, name, *args, **fields):
        block = self._kind(name, self._data, *args, **fields)
        self.append(block)
        return block

    def get(self, name):
        return next((block for block in self if block.name == name), None)

    def __getitem__(self, key):
        return self.get(key) if isinstance(key, str) else list.__getitem__(self, key)


class Pixels:
    def __init__(self, image):
        self._image = image

    def __len__(self):
        return self._image.size[0] * self._image.size[1] * 4

    def foreach_set(self, values):
        if len(values) != len(self) or values.dtype != numpy.float32:
            raise TypeError("the array has another length or type")
        image = self._image
        image.values = values.copy() if image.is_float else numpy.round(numpy.clip(values, 0, 1) * 255) / 255
        image.is_dirty = True

    def foreach_get(self, values):
        values[:] = self._image.values


class Image(ID):
    def __init__(self, name, data, width, height, alpha=False, float_buffer=False, is_data=False):
        super().__init__(name, data)
        self.generated_width, self.generated_height = width, height
        self.is_float, self.source, self.filepath, self.packed_file, self.is_dirty = float_buffer, "GENERATED", "", None, False
        self.alpha_mode, self.pixels, self.values = "STRAIGHT", Pixels(self), numpy.zeros(width * height * 4)
        self.colorspace_settings = _types.SimpleNamespace(name="Non-Color" if is_data else "sRGB")
        self.updates = 0

    @property
    def size(self):
        return self.generated_width, self.generated_height

    def update(self):
        self.updates += 1

    def pack(self):
        self.packed_file, self.source, self.is_dirty = object(), "FILE", False


class Group(NodeTree, ID):
    def __init__(self, name, data, kind):
        if kind != "ShaderNodeTree":
            raise TypeError(kind)
        ID.__init__(self, name, data)
        NodeTree.__init__(self)

    def copy(self):
        return self._owner.node_groups.new(self.name, "ShaderNodeTree")


class Material(ID):
    def __init__(self, name, data):
        super().__init__(name, data)
        self.__dict__["node_tree"] = NodeTree()
        self.displacement_method = "BUMP"
        surface, output = (self.node_tree.nodes.new(kind) for kind in ("ShaderNodeBsdfPrincipled", "ShaderNodeOutputMaterial"))
        self.node_tree.links.new(surface.outputs["BSDF"], output.inputs["Surface"])

    def __setattr__(self, name, value):
        if name == "use_nodes":
            raise AttributeError("5.x: every material uses nodes")
        super().__setattr__(name, value)

    def copy(self):
        other = self._owner.materials.new(self.name + ".001")
        other._custom = dict(self._custom)
        for name, value in self.shibo.__dict__.get("_declared", {}).items():
            if isinstance(value, Groups):
                for entry in value:
                    made = getattr(other.shibo, name).add()
                    made.__dict__["_declared"] = dict(entry.__dict__.get("_declared", {}))
                    made.name = entry.name
            else:
                other.shibo.__dict__.setdefault("_declared", {})[name] = value
        node = other.node_tree.nodes.new("ShaderNodeGroup")
        node.node_tree = other.shibo.tree
        return other


class Matrix:
    def __init__(self, scale):
        self._scale = scale

    def to_scale(self):
        return self._scale


class Array(list):
    """A list of elements with `foreach_get`."""

    def __init__(self, **fields):
        super().__init__(range(len(next(iter(fields.values())))))
        self._fields = fields

    def foreach_get(self, name, values):
        values[:] = numpy.asarray(self._fields[name]).reshape(-1)


class Mesh:
    """A square of two triangles."""

    def __init__(self, size):
        corners = numpy.array([(0, 0), (1, 0), (1, 1), (0, 1)], dtype=float)
        self.materials = []
        self.vertices = Array(co=numpy.c_[(corners - 0.5) * size, numpy.zeros(4)])
        self.loops = Array(vertex_index=range(4))
        triangles = [(0, 1, 2), (0, 2, 3)]
        self.loop_triangles = Array(vertices=triangles, loops=triangles, material_index=[0, 0])
        self.uv_layers = [_types.SimpleNamespace(name="UVMap", active_render=True, uv=Array(vector=corners))]

    def calc_loop_triangles(self):
        pass


class Object(ID):
    def __init__(self, name, data, mesh, scale=1.0):
        super().__init__(name, data)
        self.data, self.modifiers, self.matrix_world = mesh, [], Matrix((scale, scale, scale))

    @property
    def material_slots(self):
        return [_types.SimpleNamespace(material=material) for material in self.data.materials]

    @property
    def active_material(self):
        return self.data.materials[0] if self.data.materials else None

    def evaluated_get(self, _depsgraph):
        return self

    def to_mesh(self):
        return self.data

    def to_mesh_clear(self):
        pass


class Data:
    def __init__(self):
        self.filepath = ""
        self.materials, self.images, self.node_groups, self.objects = (
            Blocks(kind, self) for kind in (Material, Image, Group, Object))

    def users_of(self, block):
        trees = [material.node_tree for material in self.materials] + list(self.node_groups)
        nodes = [node for tree in trees for node in tree.nodes]
        count = sum(block in (getattr(node, "image", None), getattr(node, "node_tree", None)) for node in nodes)
        count += sum(entry.image == block for material in self.materials for entry in material.shibo.images)
        return count + sum(material.shibo.tree == block for material in self.materials)


class Context:
    def __init__(self):
        self.object = None
        self.preferences = _types.SimpleNamespace(addons={})

    def evaluated_depsgraph_get(self):
        return _types.SimpleNamespace(update=lambda: None)


path = _types.SimpleNamespace(
    abspath=lambda text: text, relpath=lambda text: text, clean_name=lambda text: text,
    ensure_ext=lambda text, end: text if text.endswith(end) else text + end, basename=os.path.basename)
