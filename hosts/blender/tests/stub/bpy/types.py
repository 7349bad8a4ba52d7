"""Classes that the extension extends or asks for."""
from .nodes import NodeSocket, NodeTree  # noqa: F401


class PropertyGroup:
    """A group of declared properties. It is no dictionary of them."""
    id_data = None

    def __getitem__(self, name):
        raise KeyError(f"{name} is declared; 5.x has no dictionary access to it")


class Operator:
    def report(self, kind, text):
        self.reports.append((kind, text))

    @classmethod
    def poll_message_set(cls, text):
        cls.poll_text = text


class Panel:
    pass


class AddonPreferences:
    pass


class ID:
    """A data-block: custom properties by name, and an id that renaming does not change."""
    _next = 1

    def __init__(self, name, owner):
        self.name, self._owner = name, owner
        self.library = self.override_library = None
        self.session_uid = ID._next
        ID._next += 1
        self._custom, self._ui = {}, {}
        self.animation_data = None

    def __getitem__(self, key):
        return self._custom[key]

    def __setitem__(self, key, value):
        if not isinstance(value, (bool, int, float, str, list)):
            raise TypeError(f"a custom property cannot hold {value!r}")
        self._custom[key] = list(value) if isinstance(value, list) else value

    def __delitem__(self, key):
        del self._custom[key]

    def __contains__(self, key):
        return key in self._custom

    def get(self, key, default=None):
        return self._custom.get(key, default)

    def keys(self):
        return list(self._custom)

    def id_properties_ui(self, key):
        return _Ui(self._custom[key], self._ui.setdefault(key, {}))

    @property
    def users(self):
        return self._owner.users_of(self)


class _Ui:
    """The description of a custom property."""
    KNOWN = {
        bool: {"description", "default"},
        int: {"description", "default", "min", "max", "soft_min", "soft_max", "step", "subtype", "items"},
        float: {"description", "default", "min", "max", "soft_min", "soft_max", "step", "precision", "subtype"},
        str: {"description", "default", "subtype"},
    }

    def __init__(self, value, fields):
        self._kind = float if isinstance(value, list) else type(value)
        self._fields = fields

    def update(self, **fields):
        unknown = set(fields) - self.KNOWN[self._kind]
        if unknown:
            raise TypeError(f"a property of type {self._kind.__name__} has no {unknown}")
        self._fields.update(fields)

    def as_dict(self):
        return dict(self._fields)


from .data_blocks import Image, Material, Object  # noqa: E402,F401
