"""The parts of Blender 5 that the extension uses, without Blender. Rules of 5.x hold: removed names fail here.

- `use_nodes` cannot be set; every material has a tree.
- Declared properties are no custom properties: `group["name"]` does not reach them.
- Sockets of groups are made by `tree.interface`; trees have no `inputs` and `outputs`.
- Fields of nodes, images and descriptions of custom properties that 5.x does not have are refused.
"""
from . import types  # noqa: F401, I001  (before data_blocks, which it ends with)
from . import app, data_blocks, ops, props, utils
from .data_blocks import Context, Data, path

data = Data()
context = Context()


def reset():
    """An empty file, as after File > New."""
    for handler in list(app.handlers.load_pre):
        handler(None)
    data.__init__()
    context.object = None
    for handler in list(app.handlers.load_post):
        handler(None)
