"""Panels: the properties of a material, and the sidebar of the 3D view."""
import bpy

from . import gallery, live, nodes, params
from .ops import current


class Drawn:
    """The contents of both panels."""
    bl_label = "Shibo"

    @classmethod
    def poll(cls, context):
        return context.object is not None and hasattr(context.object.data, "materials")

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        material = current(context)
        if material is None or not material.shibo.graph:
            layout.operator("shibo.choose", text="Choose a Graph", icon="MATERIAL")
            layout.operator("shibo.open_file", text="Open a Graph File", icon="FILE_FOLDER")
            return
        shibo = material.shibo
        if not live.is_own(material):
            layout.label(text=live.status(material), icon="LINKED")
            return
        _graph(layout, shibo)
        _values(layout, material)
        box = layout.column(align=True)
        box.prop(shibo, "size_edit")
        box.prop(shibo, "size")
        _lay(layout, shibo)
        layout.prop(shibo, "live")
        _status(layout, material)
        _files(layout, shibo)


def _graph(layout, shibo):
    row = layout.row(align=True)
    row.prop(shibo, "graph")
    row.operator("shibo.choose", text="", icon="VIEWZOOM")
    row.operator("shibo.open_file", text="", icon="FILE_FOLDER")
    icon = gallery.icon(shibo.graph)
    if icon:
        layout.template_icon(icon_value=icon, scale=5)
    row = layout.row(align=True)
    if shibo.graph.startswith("shibo:"):
        row.operator("shibo.new_file", icon="FILE_NEW")
    else:
        row.operator("shibo.edit", icon="GREASEPENCIL")
        row.operator("shibo.keep", text="Save Values", icon="FILE_TICK")


def _values(layout, material):
    work = live.work_of(material)
    if work.info is None:
        return
    if work.info["presets"]:
        layout.prop(material.shibo, "preset")
    column = layout.column()
    for param in work.info["params"]:
        key = params.key(param["name"])
        if key in material:
            unit = f" ({param['unit']})" if param["unit"] else ""
            column.prop(material, f'["{bpy.utils.escape_identifier(key)}"]', text=param["name"].replace("_", " ").capitalize() + unit)
    layout.prop(material.shibo, "seed")


def _lay(layout, shibo):
    row = layout.row(align=True)
    for way, label in (("UV", "UV"), ("BOX", "Box"), ("CUT", "Through the Object")):
        row.operator("shibo.lay", text=label, depress=shibo.lay == way).by = way
    if shibo.lay == "CUT":
        layout.prop(shibo, "object")
        layout.prop(shibo, "by")
        if shibo.by == "PIECES":
            layout.prop(shibo, "spread")
        layout.prop(shibo, "place")
        if shibo.place is None:
            layout.prop(shibo, "move")
    layout.operator("shibo.measure", icon="DRIVER_DISTANCE")


def _status(layout, material):
    row = layout.row()
    errors = len(material.shibo.errors)
    row.label(text=live.status(material), icon="ERROR" if errors else "INFO")
    if errors:
        row.operator("shibo.show")
    elif not live.keeper.running and live.keeper.trouble:
        row.operator("shibo.restart", text="", icon="FILE_REFRESH")
    elif nodes.node_of(material) is None and material.shibo.tree is not None:
        layout.label(text="the node group is missing in the material: add it in the shader editor (Add > Group)", icon="INFO")
    layout.operator("shibo.update", icon="FILE_REFRESH")


def _files(layout, shibo):
    layout.prop(shibo, "pack")
    row = layout.row(align=True)
    row.operator("shibo.bake", icon="RENDER_STILL")
    row.operator("shibo.pack", icon="PACKAGE")
    row.operator("shibo.remove", icon="X")


class SHIBO_PT_material(Drawn, bpy.types.Panel):
    """The panel among the properties of a material."""
    bl_idname = "SHIBO_PT_material"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "material"


class SHIBO_PT_sidebar(Drawn, bpy.types.Panel):
    """The panel in the sidebar of the 3D view."""
    bl_idname = "SHIBO_PT_sidebar"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "Shibo"


CLASSES = (SHIBO_PT_material, SHIBO_PT_sidebar)
