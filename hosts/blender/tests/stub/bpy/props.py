"""Declared properties: annotations that `utils.register_class` turns into fields."""


class Declared:
    """A declared property."""

    def __init__(self, make, fields, known):
        unknown = set(fields) - known - {"name", "description", "default", "update", "get", "set", "options", "search"}
        if unknown:
            raise TypeError(f"unknown fields {unknown}")
        self.make, self.fields, self.name = make, fields, f"declared {id(self)}"

    def install(self, owner, name):
        self.name = name
        setattr(owner, name, self)

    def __get__(self, thing, _owner=None):
        if thing is None:
            return self
        if "get" in self.fields:
            return self.fields["get"](thing)
        values = thing.__dict__.setdefault("_declared", {})
        if self.name not in values:
            values[self.name] = self.make(thing)
        return values[self.name]

    def __set__(self, thing, value):
        if "get" in self.fields:
            raise AttributeError(f"{self.name} is read-only")
        before, items = self.__get__(thing), self.fields.get("items")
        if isinstance(before, tuple):
            value = tuple(float(part) for part in value)
        elif isinstance(before, (int, float)):
            value = type(before)(value)
        elif isinstance(items, tuple) and value not in [item[0] for item in items]:
            raise TypeError(f"enum {value!r} not found")
        elif isinstance(before, str) and not isinstance(value, str):
            raise TypeError(f"{self.name} takes a text, not {value!r}")
        thing.__dict__["_declared"][self.name] = value
        if "update" in self.fields:
            from . import context
            self.fields["update"](thing, context)


def _plain(default, *known):
    return lambda **fields: Declared(lambda _: fields.get("default", default), fields, set(known))


BoolProperty = _plain(False)
IntProperty = _plain(0, "min", "max", "soft_min", "soft_max")
StringProperty = _plain("", "subtype", "maxlen")


def FloatVectorProperty(size=3, **fields):
    return Declared(lambda _: tuple(map(float, fields.get("default", (0.0,) * size))), fields, {"min", "max", "subtype", "unit"})


def EnumProperty(items, **fields):
    first = "" if callable(items) else items[0][0]
    return Declared(lambda _: fields.get("default", first), {**fields, "items": items}, {"items"})


def PointerProperty(type, **fields):
    from .types import PropertyGroup

    def make(owner):
        if not issubclass(type, PropertyGroup):
            return None
        group = type()
        group.id_data = getattr(owner, "id_data", owner)
        return group
    return Declared(make, fields, {"poll"})


def CollectionProperty(type, **fields):
    from .data_blocks import Groups
    return Declared(lambda owner: Groups(type, getattr(owner, "id_data", owner)), fields, set())
