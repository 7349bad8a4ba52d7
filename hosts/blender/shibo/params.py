"""The parameters of a graph as custom properties of a material, named `shibo_NAME`."""
import json

PREFIX = "shibo_"
# Bound of the sliders of numbers without a range.
FAR = 1e6
MOST_INT = 2**31 - 1


def key(name):
    """The name of the property of a parameter."""
    return PREFIX + name


def linear(hexadecimal):
    """`#rrggbb` as three linear numbers; None for another text."""
    digits = hexadecimal.lstrip("#")
    if len(digits) != 6:
        return None
    try:
        parts = [int(digits[at:at + 2], 16) / 255 for at in (0, 2, 4)]
    except ValueError:
        return None
    return [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]


def stored(param, value):
    """A value of the protocol as the property holds it."""
    kind = param["type"]
    if kind == "Color":
        color = linear(value) if isinstance(value, str) else value
        return [float(part) for part in (color or [0.0, 0.0, 0.0])[:3]]
    if kind == "Choice" and value in (param["options"] or ()):
        return param["options"].index(value)
    if kind == "Number":
        return float(value)
    if kind == "Integer":
        return max(-MOST_INT, min(MOST_INT, int(value)))
    if kind == "Bool":
        return bool(value)
    if isinstance(value, list) and value and all(isinstance(part, (int, float)) for part in value):
        return [float(part) for part in value]
    return value if isinstance(value, str) else json.dumps(value)


def sent(param, value):
    """A value of the property as the protocol takes it."""
    if param["type"] == "Choice" and isinstance(value, int):
        options = param["options"]
        return options[max(0, min(value, len(options) - 1))]
    if param["type"] == "Bool":
        return bool(value)
    return value


def plain(value):
    """A value of a property without types of Blender."""
    return list(value) if hasattr(value, "__len__") and not isinstance(value, str) else value


def baseline(info, preset=""):
    """The values of the graph with a preset, as the properties hold them."""
    changed = info["presets"].get(preset, {})
    return {param["name"]: stored(param, changed.get(param["name"], param["value"])) for param in info["params"]}


def _fits(value, other):
    """True if a property with this value can hold the other."""
    if isinstance(other, list):
        return isinstance(value, list) and len(value) == len(other)
    if isinstance(other, float):
        return isinstance(value, (int, float)) and not isinstance(value, bool)
    return type(value) is type(other)


def _describe(material, param, value):
    """Sets range, unit and description of a property."""
    ui = material.id_properties_ui(key(param["name"]))
    unit = f" ({param['unit']})" if param["unit"] else ""
    fields = {"description": (param["doc"] or param["name"]) + unit}
    low, high = param["range"] or (-FAR, FAR)
    if param["type"] == "Choice" and isinstance(value, int):
        fields["items"] = [(name, name.replace("_", " "), "", at) for at, name in enumerate(param["options"])]
    elif param["type"] == "Color":
        fields.update(subtype="COLOR", min=0.0, soft_max=1.0)
    elif isinstance(value, bool):
        pass
    elif isinstance(value, int):
        low, high = param["range"] or (-MOST_INT, MOST_INT)
        low, high = int(max(low, -MOST_INT)), int(min(high, MOST_INT))
        fields.update(min=low, max=high, soft_min=low, soft_max=high, default=value)
    elif isinstance(value, float):
        fields.update(min=low, max=high, soft_min=low, soft_max=high, default=value, precision=3, step=_step(low, high))
    elif param["type"] == "Path":
        fields["subtype"] = "FILE_PATH"
    ui.update(**fields)


def _step(low, high):
    """The step of a slider, in hundredths, for about a hundred steps in a range."""
    return max(0.01, min(100.0, high - low)) if high - low < 2 * FAR else 10.0


def ensure(material, info, preset, before):
    """Makes the properties of all parameters, in the order of the graph, and removes others.

    `before` has the values that the graph gave last time: a property that still has such a value follows the graph. Returns the
    values that the graph gives now.
    """
    now = baseline(info, preset)
    kept = {name: plain(material[key(name)]) for name in now if key(name) in material}
    for name in [name for name in material.keys() if name.startswith(PREFIX)]:
        del material[name]
    for param in info["params"]:
        name = param["name"]
        value = now[name]
        if name in kept and _fits(kept[name], value) and kept[name] != before.get(name):
            value = type(value)(kept[name]) if isinstance(value, (float, int)) else kept[name]
        material[key(name)] = value
        _describe(material, param, value)
    return now


def reset(material, info, preset):
    """Sets all parameters to the values of a preset."""
    for name, value in baseline(info, preset).items():
        if key(name) in material:
            material[key(name)] = value


def changed(material, info, preset):
    """The values that differ from those of the graph with its preset, for a request."""
    values = {}
    base = baseline(info, preset)
    for param in info["params"]:
        name = param["name"]
        value = material.get(key(name))
        if value is not None and plain(value) != base[name]:
            values[name] = sent(param, plain(value))
    return values


def remove(material):
    """Removes the properties of all parameters."""
    for name in [name for name in material.keys() if name.startswith(PREFIX)]:
        del material[name]
