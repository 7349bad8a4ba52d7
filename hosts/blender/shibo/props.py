"""The declared properties of materials, `material.shibo`, and the preferences."""
import os

import bpy
from bpy.props import (
    BoolProperty, CollectionProperty, EnumProperty, FloatVectorProperty, IntProperty, PointerProperty, StringProperty)

from . import live

WAYS = (
    ("UV", "UV", "By the UV map: a metre of the surface shows a metre of the material"),
    ("BOX", "Box", "From six sides, by the coordinates of the object; needs no UV map"),
    ("CUT", "Through the object", "Cut out of a block, such as a tree: the grain runs through it. Needs a UV map without overlaps"),
)
PARTS = (
    ("WHOLE", "One block", "The object is cut out of one block"),
    ("PIECES", "Each piece", "Each connected piece of the mesh is a board of its own, its longest side along the trunk"),
)


def _reset(properties, _context):
    live.reset(properties.id_data)


def _graph(properties, _context):
    # Parameters and preset belong to the graph of before.
    properties.given = ""
    live.wake()


def _presets(properties, _context, edit_text):
    return [name for name in live.presets(properties.id_data) if edit_text.lower() in name.lower()]


def _status(properties):
    return live.status(properties.id_data)


class ShiboImage(bpy.types.PropertyGroup):
    """An image of a material; its name is the channel."""
    image: PointerProperty(type=bpy.types.Image)


class ShiboError(bpy.types.PropertyGroup):
    """An error of the graph."""
    file: StringProperty(name="File")
    line: IntProperty(name="Line")
    column: IntProperty(name="Column")
    message: StringProperty(name="Message")


class ShiboMaterial(bpy.types.PropertyGroup):
    """State of a material other than the parameters of its graph."""
    graph: StringProperty(name="Graph", description="A file, or shibo:NAME for a graph that comes with Shibo", update=_graph)
    preset: StringProperty(name="Preset", description="A preset of the graph", search=_presets, update=_reset)
    seed: IntProperty(name="Seed", description="Another seed gives another piece of the same material", min=0)
    size: IntProperty(name="Final size", description="Pixels of the longer side of the pictures", default=1024, min=16, max=16384)
    size_edit: IntProperty(
        name="Size while editing", description="Pixels of the longer side while values change", default=256, min=16, max=16384)
    live: BoolProperty(name="Live", description="Follow every change of a value and every save of the graph", default=True)
    pack: BoolProperty(name="Pack", description="Pack the pictures into the .blend when it is saved", default=True)
    lay: EnumProperty(name="Lay by", description="How the pictures lie on objects", items=WAYS)
    by: EnumProperty(name="Pieces", description="Cut the whole object from one place of the block, or each connected piece from a place of its own", items=PARTS)
    spread: FloatVectorProperty(
        name="Spread (mm)", description="Largest random shift of a piece in the tree, either way", size=3, default=(40, 40, 400), min=0)
    move: FloatVectorProperty(
        name="Place (mm)", description="Position of the object in the tree, whose pith (centre) is the z axis", size=3, default=(0, 60, 0))
    object: PointerProperty(name="Object", description="The object that is cut out of the solid", type=bpy.types.Object)
    place: PointerProperty(
        name="Tree", description="An empty whose place is the foot of the tree, and whose z axis is the pith", type=bpy.types.Object)
    uv_map: StringProperty(name="UV map", description="The UV map in use; empty for the one that renders use")
    density: FloatVectorProperty(name="Length in metres of the UV square, along u and v", size=2, default=(1.0, 1.0))
    scale: FloatVectorProperty(name="Scale of the object", size=3, default=(1.0, 1.0, 1.0))
    # The values that the graph gave last, as JSON: a parameter that still has its value follows the graph.
    given: StringProperty()
    tree: PointerProperty(type=bpy.types.NodeTree)
    images: CollectionProperty(type=ShiboImage)
    errors: CollectionProperty(type=ShiboError)
    status: StringProperty(name="Status", get=_status)


class ShiboPreferences(bpy.types.AddonPreferences):
    """Preferences of the extension."""
    bl_idname = __package__

    program: StringProperty(
        name="Program", subtype="FILE_PATH",
        description="Path of the program shibo. If empty: the copy inside the extension, otherwise the one in PATH",
        update=lambda _properties, _context: live.restart())

    def draw(self, _context):
        self.layout.prop(self, "program")
        self.layout.label(text=live.program_line())


def preferred():
    """The path of the program in the preferences; empty without one."""
    addon = bpy.context.preferences.addons.get(__package__)
    return bpy.path.abspath(addon.preferences.program) if addon and addon.preferences else ""


def bundled():
    """The path of the program inside the extension."""
    return os.path.join(os.path.dirname(__file__), "bin", "shibo.exe" if os.name == "nt" else "shibo")


CLASSES = (ShiboImage, ShiboError, ShiboMaterial, ShiboPreferences)
