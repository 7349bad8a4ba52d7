"""Materials from graphs of Shibo. The program `shibo bridge` computes the pictures; see docs/blender.md."""
import atexit

import bpy

from . import gallery, live, ops, panel, props

CLASSES = props.CLASSES + ops.CLASSES + gallery.CLASSES + panel.CLASSES


def register():
    """Adds classes, handlers and the timer."""
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    bpy.types.Material.shibo = bpy.props.PointerProperty(type=props.ShiboMaterial)
    gallery.register()
    live.register()
    atexit.register(live.keeper.stop)


def unregister():
    """Removes all that `register` added, and ends the process."""
    atexit.unregister(live.keeper.stop)
    live.unregister()
    gallery.unregister()
    del bpy.types.Material.shibo
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
