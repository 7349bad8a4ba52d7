"""Trees of nodes with the sockets and fields that the extension uses."""

VECTOR, COLOR = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)
SURFACE = {
    "Base Color": COLOR, "Metallic": 0.0, "Roughness": 0.5, "IOR": 1.5, "Alpha": 1.0, "Normal": VECTOR, "Subsurface Weight": 0.0,
    "Specular IOR Level": 0.5, "Anisotropic": 0.0, "Anisotropic Rotation": 0.0, "Tangent": VECTOR, "Coat Weight": 0.0,
    "Coat Roughness": 0.0, "Coat Normal": VECTOR, "Sheen Weight": 0.0, "Emission Color": COLOR, "Emission Strength": 0.0,
}
# For each type: inputs, outputs, and fields with their values or lists of allowed words.
KINDS = {
    "ShaderNodeBsdfPrincipled": (SURFACE, {"BSDF": None}, {}),
    "ShaderNodeOutputMaterial": ({"Surface": None, "Volume": None, "Displacement": VECTOR}, {}, {"is_active_output": True}),
    "ShaderNodeGroup": ({}, {}, {"node_tree": None}),
    "NodeGroupOutput": ({}, {}, {}),
    "ShaderNodeUVMap": ({}, {"UV": VECTOR}, {"uv_map": ""}),
    "ShaderNodeTexCoord": ({}, dict.fromkeys(("Generated", "Normal", "UV", "Object", "Camera", "Window", "Reflection"), VECTOR), {}),
    "ShaderNodeMapping": ({"Vector": VECTOR, "Location": VECTOR, "Rotation": VECTOR, "Scale": (1.0, 1.0, 1.0)}, {"Vector": VECTOR}, {}),
    "ShaderNodeTexImage": ({"Vector": VECTOR}, {"Color": COLOR, "Alpha": 1.0}, {
        "image": None, "extension": ("REPEAT", "EXTEND", "CLIP", "MIRROR")}),
    "ShaderNodeNormalMap": ({"Strength": 1.0, "Color": COLOR}, {"Normal": VECTOR}, {"uv_map": "", "space": ("TANGENT", "OBJECT", "WORLD")}),
    "ShaderNodeTangent": ({}, {"Tangent": VECTOR}, {"uv_map": "", "direction_type": ("RADIAL", "UV_MAP")}),
    "ShaderNodeDisplacement": ({"Height": 0.0, "Midlevel": 0.5, "Scale": 1.0, "Normal": VECTOR}, {"Displacement": VECTOR}, {}),
    "ShaderNodeValue": ({}, {"Value": 0.0}, {}),
    "ShaderNodeRGB": ({}, {"Color": COLOR}, {}),
    "ShaderNodeMath": ({"Value": 0.5, "Value_001": 0.5, "Value_002": 0.5}, {"Value": 0.0}, {
        "operation": ("ADD", "SUBTRACT", "MULTIPLY", "DIVIDE", "MULTIPLY_ADD", "MINIMUM", "MAXIMUM", "SIGN", "ABSOLUTE")}),
    "ShaderNodeVectorMath": ({"Vector": VECTOR, "Vector_001": VECTOR, "Vector_002": VECTOR, "Scale": 1.0}, {
        "Vector": VECTOR, "Value": 0.0}, {
        "operation": ("ADD", "SUBTRACT", "MULTIPLY", "DIVIDE", "MULTIPLY_ADD", "SCALE", "NORMALIZE", "ABSOLUTE", "LENGTH", "DOT_PRODUCT")}),
    "ShaderNodeSeparateXYZ": ({"Vector": VECTOR}, {"X": 0.0, "Y": 0.0, "Z": 0.0}, {}),
    "ShaderNodeCombineXYZ": ({"X": 0.0, "Y": 0.0, "Z": 0.0}, {"Vector": VECTOR}, {}),
    "ShaderNodeVectorTransform": ({"Vector": VECTOR}, {"Vector": VECTOR}, {
        "vector_type": ("VECTOR", "POINT", "NORMAL"), "convert_from": ("WORLD", "OBJECT", "CAMERA"),
        "convert_to": ("OBJECT", "WORLD", "CAMERA")}),
}
SOCKETS = ("NodeSocketFloat", "NodeSocketVector", "NodeSocketColor")


class NodeSocket:
    def __init__(self, node, name, value):
        self.node, self.name, self._value, self.links = node, name, value, []

    @property
    def is_linked(self):
        return bool(self.links)

    @property
    def default_value(self):
        return self._value

    @default_value.setter
    def default_value(self, value):
        if isinstance(self._value, tuple):
            if len(value) != len(self._value):
                raise ValueError(f"{self.name} takes {len(self._value)} numbers, not {len(value)}")
            self._value = tuple(float(part) for part in value)
        elif self._value is None:
            raise AttributeError(f"{self.name} has no value")
        else:
            self._value = float(value)


class Sockets(list):
    def get(self, name):
        return next((socket for socket in self if socket.name == name), None)

    def __getitem__(self, key):
        if isinstance(key, int):
            return list.__getitem__(self, key)
        found = self.get(key)
        if found is None:
            raise KeyError(key)
        return found

    def __contains__(self, name):
        return self.get(name) is not None


class Node:
    def __init__(self, tree, kind):
        inputs, outputs, fields = KINDS[kind]
        self.__dict__.update(id_tree=tree, bl_idname=kind, name=kind, label="", location=(0, 0), width=140.0, _fields=fields)
        for name, value in fields.items():
            self.__dict__[name] = value[0] if isinstance(value, tuple) else value
        self.__dict__["_inputs"] = Sockets(NodeSocket(self, name, value) for name, value in inputs.items())
        self.__dict__["_outputs"] = Sockets(NodeSocket(self, name, value) for name, value in outputs.items())

    def __setattr__(self, name, value):
        if name not in self.__dict__:
            raise AttributeError(f"{self.bl_idname} has no field {name}")
        allowed = self._fields.get(name)
        if isinstance(allowed, tuple) and value not in allowed:
            raise TypeError(f"{value} is no {name} of {self.bl_idname}")
        self.__dict__[name] = value

    def _of_group(self, sockets, tree):
        """The sockets follow the interface of the group."""
        names = [item.name for item in tree.interface.items_tree] if tree else []
        for socket in [socket for socket in sockets if socket.name not in names]:
            self.id_tree.links.cut(socket)
            sockets.remove(socket)
        for name in names:
            if name not in sockets:
                sockets.append(NodeSocket(self, name, VECTOR))
        return sockets

    @property
    def inputs(self):
        return self._of_group(self._inputs, self.id_tree) if self.bl_idname == "NodeGroupOutput" else self._inputs

    @property
    def outputs(self):
        return self._of_group(self._outputs, self.node_tree) if self.bl_idname == "ShaderNodeGroup" else self._outputs


class Link:
    def __init__(self, out, into):
        self.from_socket, self.to_socket, self.from_node, self.to_node = out, into, out.node, into.node


class Links(list):
    def new(self, out, into):
        if not any(out is socket for socket in out.node.outputs):
            raise TypeError(f"{out.name} is no output")
        self.cut(into)
        link = Link(out, into)
        out.links.append(link)
        into.links.append(link)
        self.append(link)
        return link

    def cut(self, socket):
        for link in list(socket.links):
            link.from_socket.links.remove(link)
            link.to_socket.links.remove(link)
            self.remove(link)


class Nodes(list):
    def __init__(self, tree):
        super().__init__()
        self.tree = tree

    def new(self, kind):
        node = Node(self.tree, kind)
        self.append(node)
        return node

    def get(self, name):
        return next((node for node in self if node.name == name), None)

    def __getitem__(self, key):
        found = list.__getitem__(self, key) if isinstance(key, int) else self.get(key)
        if found is None:
            raise KeyError(key)
        return found

    def remove(self, node):
        for socket in list(node.inputs) + list(node.outputs):
            self.tree.links.cut(socket)
        list.remove(self, node)

    def clear(self):
        for node in list(self):
            self.remove(node)


class Item:
    item_type = "SOCKET"

    def __init__(self, name):
        self.name = name


class Interface:
    def __init__(self):
        self.items_tree = []

    def new_socket(self, name, description="", in_out="INPUT", socket_type="NodeSocketFloat", parent=None):
        if in_out not in ("INPUT", "OUTPUT") or socket_type not in SOCKETS:
            raise TypeError(f"{in_out} {socket_type}")
        self.items_tree.append(Item(name))

    def remove(self, item):
        self.items_tree.remove(item)


class NodeTree:
    """The parts of a tree that materials and groups share."""

    def __init__(self):
        self.links = Links()
        self.nodes = Nodes(self)
        self.interface = Interface()
