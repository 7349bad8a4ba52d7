"""Operators, as functions `bpy.ops.FAMILY.NAME`. An error that is reported is raised."""
import types as _types

from .props import Declared

_module = globals()


def add(cls):
    """Makes an operator callable."""
    if not hasattr(cls, "execute"):
        return
    family, name = cls.bl_idname.split(".")
    place = _module.setdefault(family, _types.SimpleNamespace())

    def call(**fields):
        from . import context
        operator = cls()
        for field, value in fields.items():
            if not isinstance(getattr(cls, field, None), Declared):
                raise TypeError(f"{cls.bl_idname} has no property {field}")
            setattr(operator, field, value)
        if not call.poll():
            raise RuntimeError(f"{cls.bl_idname}.poll() failed, context is incorrect")
        operator.reports = []
        result = operator.execute(context)
        errors = [text for kind, text in operator.reports if "ERROR" in kind]
        if errors:
            raise RuntimeError(f"Error: {errors[0]}")
        return result

    def poll():
        from . import context
        return cls.poll(context) if hasattr(cls, "poll") else True

    call.poll = poll
    setattr(place, name, call)


def remove(cls):
    if hasattr(cls, "execute"):
        family, name = cls.bl_idname.split(".")
        delattr(_module[family], name)
