"""Nodes that lay pictures from six sides, by the object's coordinates in metres.

On each side u goes to the right and v up, seen from outside; on the sides above and below v goes along y. Where the surface turns from
one side to another the pictures blend. Normals are rotated with their side.
"""
# Width of the blend: a side shows where its part of the normal is at least 1 - BLEND of the largest part.
BLEND = 0.2
SIDES = "XYZ"


def place(builder):
    """Places, weights and signs of the sides X, Y and Z, and the normal, all in the space of the object in metres."""
    where = builder.node("ShaderNodeTexCoord")
    metres = builder.vector("MULTIPLY", where.outputs["Object"], (1.0, 1.0, 1.0), name="Metres")
    # Normals are divided by the scale of the object.
    normal = builder.vector("DIVIDE", where.outputs["Normal"], (1.0, 1.0, 1.0), name="Metres of normals")
    normal = builder.vector("NORMALIZE", normal)
    builder.next()
    size = builder.node("ShaderNodeSeparateXYZ", inputs=[(0, builder.vector("ABSOLUTE", normal))])
    most = builder.math("MAXIMUM", builder.math("MAXIMUM", size.outputs[0], size.outputs[1]), size.outputs[2])
    least = builder.math("MULTIPLY", most, 1.0 - BLEND)
    over = [builder.math("MAXIMUM", builder.math("SUBTRACT", size.outputs[at], least), 0.0) for at in range(3)]
    builder.next()
    total = builder.math("ADD", builder.math("ADD", over[0], over[1]), over[2])
    weights = [builder.math("DIVIDE", one, total) for one in over]
    parts = builder.node("ShaderNodeSeparateXYZ", inputs=[(0, normal)]).outputs
    # On the sides of y, u goes against x.
    signs = [builder.math("SIGN", parts[at]) for at in range(3)]
    signs[1] = builder.math("MULTIPLY", signs[1], -1.0)
    builder.next()
    at = builder.node("ShaderNodeSeparateXYZ", inputs=[(0, metres)]).outputs
    sides = []
    for side, sign, (u, v) in zip(SIDES, signs, ((at[1], at[2]), (at[0], at[2]), (at[0], at[1]))):
        u = builder.math("MULTIPLY", u, sign)
        vector = builder.node("ShaderNodeCombineXYZ", inputs=[(0, u), (1, v)]).outputs[0]
        # The middle of the picture lies at the origin, so pictures without repetition have no seam there.
        sides.append(builder.vector("MULTIPLY_ADD", vector, (1.0, 1.0, 1.0), (0.5, 0.5, 0.0), name=f"Size {side}"))
    return {"sides": sides, "weights": weights, "signs": signs, "normal": normal}


def sample(builder, place, image, is_normal):
    """The blended colour of an image; for a normal map, the normal in world space."""
    total = None
    for at, (side, weight) in enumerate(zip(place["sides"], place["weights"])):
        color = builder.image(image, side, True)
        if is_normal:
            color = _normal(builder, place, at, color)
        total = builder.vector("SCALE", color, weight) if total is None else _add(builder, color, weight, total)
    return _to_world(builder, total) if is_normal else total


def _add(builder, color, weight, total):
    return builder.vector("ADD", builder.vector("SCALE", color, weight), total)


def _normal(builder, place, at, color):
    """The normal of a side in the space of the object."""
    parts = builder.node("ShaderNodeSeparateXYZ", inputs=[(0, builder.vector("MULTIPLY_ADD", color, (2.0,) * 3, (-1.0,) * 3))]).outputs
    along = builder.math("MULTIPLY", parts[0], place["signs"][at])
    # The axes of u and v on the sides X, Y and Z.
    u, v = ((1, 2), (0, 2), (0, 1))[at]
    flat = builder.node("ShaderNodeCombineXYZ", inputs=[(u, along), (v, parts[1])]).outputs[0]
    return builder.vector("ADD", flat, builder.vector("SCALE", place["normal"], parts[2]))


def tangent(builder, place):
    """The direction of u in world space."""
    x = builder.math("ADD", builder.math("MULTIPLY", place["signs"][1], place["weights"][1]),
                     builder.math("MULTIPLY", place["signs"][2], place["weights"][2]))
    y = builder.math("MULTIPLY", place["signs"][0], place["weights"][0])
    return _to_world(builder, builder.node("ShaderNodeCombineXYZ", inputs=[(0, x), (1, y)]).outputs[0])


def _to_world(builder, vector):
    """A direction of the object in metres, in world space."""
    vector = builder.vector("DIVIDE", vector, (1.0, 1.0, 1.0), name="Metres of directions")
    turned = builder.node("ShaderNodeVectorTransform", inputs=[("Vector", vector)], vector_type="VECTOR",
                          convert_from="OBJECT", convert_to="WORLD")
    return builder.vector("NORMALIZE", turned.outputs["Vector"])


def set_size(tree, per_metre, scale, put):
    """Sets the pictures per metre, and the scale of the object. `put` sets a default value."""
    for node in tree.nodes:
        if node.name.startswith("Size "):
            put(node.inputs[1], per_metre)
        elif node.name == "Metres of normals" or node.name.startswith("Metres"):
            put(node.inputs[1], tuple(scale))
