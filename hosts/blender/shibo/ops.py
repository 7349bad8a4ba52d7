"""Operators. Each works without a window too: in background mode it waits until its work is done."""
import os
import subprocess

import bpy
from bpy.props import BoolProperty, EnumProperty, IntProperty, StringProperty

from . import bake, client, images, live, meshes, nodes, params, props

# Versions from 4.5 on ask for this where a path may begin with //.
RELATIVE = {"PATH_SUPPORTS_BLEND_RELATIVE"} if bpy.app.version >= (4, 5, 0) else set()


def current(context):
    """The material that the user works on, or None."""
    material = getattr(context, "material", None)
    if material is None and context.object is not None:
        material = context.object.active_material
    return material


def object_of(context, material):
    """The object that shows the material: the active one, or another."""
    active = context.object
    things = ([active] if active else []) + list(bpy.data.objects)
    return next((thing for thing in things if any(slot.material == material for slot in thing.material_slots)), None)


class OfMaterial:
    """An operator that needs a material with a graph."""
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        material = current(context)
        if material is None or not material.shibo.graph:
            cls.poll_message_set("Choose a graph for the material first")
            return False
        if not live.is_own(material):
            cls.poll_message_set("The material is linked from another file; change it there")
            return False
        return True

    def done(self, material, wait=False):
        """Brings the pictures up to date: at once in background mode or if `wait`, else by the timer."""
        live.work_of(material).forced = True
        live.keeper.hope()
        if not (wait or bpy.app.background):
            live.wake()
            return {"FINISHED"}
        return self.ended(live.finish(material))

    def ended(self, trouble):
        """The result of the operator: `trouble` is the reason of a failure, or empty."""
        if trouble:
            self.report({"ERROR"}, trouble)
            return {"CANCELLED"}
        return {"FINISHED"}

    def fit(self, thing, material):
        """Measures the object for the way in use. Raises `meshes.Unfit`."""
        shibo = material.shibo
        if thing is None:
            raise meshes.Unfit(f"no object has the material {material.name}; assign it to an object first")
        shibo.scale = thing.matrix_world.to_scale()
        if shibo.lay == "UV":
            u, v, uneven = meshes.measure(thing, material, shibo.uv_map)
            shibo.density = (u, v)
            if uneven > meshes.UNEVEN:
                self.report({"WARNING"}, f"the UV map of {thing.name} is uneven: lengths differ by a factor of {uneven:.1f}")
        elif shibo.lay == "CUT":
            info = live.work_of(material).info
            if info and not info["solid"]:
                raise meshes.Unfit("this graph has no solid to cut the object out of; use UV or Box, or choose a wood, agate or sandstone")
            shibo.object = thing
            live.work_of(material).retry()


class SHIBO_OT_add(OfMaterial, bpy.types.Operator):
    """Give the active object a material from a graph"""
    bl_idname = "shibo.add"
    bl_label = "Add Material"

    graph: StringProperty(name="Graph", description="A file, or shibo:NAME for a graph that comes with Shibo", default="shibo:calf")
    preset: StringProperty(name="Preset")
    size: IntProperty(name="Final size", description="Pixels of the longer side", default=1024, min=16, max=16384)

    @classmethod
    def poll(cls, context):
        if context.object is None or not hasattr(context.object.data, "materials"):
            cls.poll_message_set("Select an object that can have materials")
            return False
        return context.object.library is None

    def execute(self, context):
        thing = context.object
        name = os.path.splitext(os.path.basename(self.graph.removeprefix("shibo:")))[0]
        material = bpy.data.materials.new(name or "Shibo")
        if thing.material_slots:
            thing.material_slots[thing.active_material_index].material = material
        else:
            thing.data.materials.append(material)
        return start(self, thing, material)


def start(operator, thing, material):
    """Gives a material its graph, and lays it by the UV map if there is one."""
    shibo = material.shibo
    shibo.graph, shibo.preset, shibo.size = operator.graph, operator.preset, operator.size
    shibo.size_edit = min(256, operator.size)
    shibo.lay = "UV"
    try:
        operator.fit(thing, material)
    except meshes.Unfit:
        shibo.lay = "BOX"
    return operator.done(material)


class SHIBO_OT_update(OfMaterial, bpy.types.Operator):
    """Make the pictures again if anything has changed, also the mesh of the object"""
    bl_idname = "shibo.update"
    bl_label = "Update"

    wait: BoolProperty(name="Wait", description="Wait until the pictures are in place", default=False)

    def execute(self, context):
        material = current(context)
        live.work_of(material).retry()
        return self.done(material, self.wait)


class SHIBO_OT_lay(OfMaterial, bpy.types.Operator):
    """Choose how the pictures lie on the object"""
    bl_idname = "shibo.lay"
    bl_label = "Lay"

    by: EnumProperty(name="Lay by", items=props.WAYS)

    def execute(self, context):
        material = current(context)
        before = material.shibo.lay
        material.shibo.lay = self.by
        try:
            self.fit(object_of(context, material), material)
        except meshes.Unfit as unfit:
            material.shibo.lay = before
            self.report({"ERROR"}, str(unfit))
            return {"CANCELLED"}
        return self.done(material)


class SHIBO_OT_measure(OfMaterial, bpy.types.Operator):
    """Measure the object again: its scale, its UV map, and its shape if the material is cut through it"""
    bl_idname = "shibo.measure"
    bl_label = "Measure"

    def execute(self, context):
        material = current(context)
        try:
            self.fit(object_of(context, material), material)
        except meshes.Unfit as unfit:
            self.report({"ERROR"}, str(unfit))
            return {"CANCELLED"}
        return self.done(material)


class SHIBO_OT_bake(OfMaterial, bpy.types.Operator):
    """Write the pictures into a folder, and let the images use these files"""
    bl_idname = "shibo.bake"
    bl_label = "Bake to Folder"

    folder: StringProperty(name="Folder", subtype="DIR_PATH", default="//maps", options=RELATIVE)
    size: IntProperty(name="Size", description="Pixels of the longer side", default=4096, min=16, max=16384)

    def invoke(self, context, _event):
        return context.window_manager.invoke_props_dialog(self)

    def execute(self, context):
        material = current(context)
        if self.folder.startswith("//") and not bpy.data.filepath:
            self.report({"ERROR"}, "the .blend file is not saved yet: save it first, or choose a folder with a full path")
            return {"CANCELLED"}
        return self.ended(bake.start(material, self.folder, self.size, bpy.app.background))


class SHIBO_OT_pack(OfMaterial, bpy.types.Operator):
    """Pack the pictures into the .blend, now and whenever it is saved"""
    bl_idname = "shibo.pack"
    bl_label = "Pack"

    def execute(self, context):
        material = current(context)
        material.shibo.pack = True
        images.pack(material)
        return {"FINISHED"}


class SHIBO_OT_remove(OfMaterial, bpy.types.Operator):
    """Take the graph away from the material"""
    bl_idname = "shibo.remove"
    bl_label = "Remove"

    keep: BoolProperty(name="Keep the pictures", description="Leave nodes and images as they are", default=False)

    def execute(self, context):
        material = current(context)
        material.shibo.graph = ""
        if not self.keep:
            nodes.remove(material)
            images.remove(material)
        params.remove(material)
        material.shibo.images.clear()
        material.shibo.errors.clear()
        material.shibo.tree = None
        if bpy.app.background:
            live.step(0.0)
        return {"FINISHED"}


class SHIBO_OT_new_file(OfMaterial, bpy.types.Operator):
    """Copy a graph that comes with Shibo into a file of your own, and use it"""
    bl_idname = "shibo.new_file"
    bl_label = "New Graph from This"

    filepath: StringProperty(subtype="FILE_PATH")
    filter_glob: StringProperty(default="*.ron", options={"HIDDEN"})

    def invoke(self, context, _event):
        self.filepath = current(context).shibo.graph.removeprefix("shibo:") + ".ron"
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context):
        material = current(context)
        graph = material.shibo.graph
        if not graph.startswith("shibo:"):
            self.report({"ERROR"}, f"{graph} is a file already; edit it")
            return {"CANCELLED"}
        path = bpy.path.ensure_ext(bpy.path.abspath(self.filepath), ".ron")
        try:
            program = client.find(props.preferred(), props.bundled())
            made = subprocess.run([program, "new", path, "--from", graph.removeprefix("shibo:")], capture_output=True, timeout=20)
        except (client.Missing, OSError, subprocess.TimeoutExpired) as error:
            self.report({"ERROR"}, str(error))
            return {"CANCELLED"}
        if made.returncode:
            self.report({"ERROR"}, made.stderr.decode("utf-8", "replace").strip()[:400] or "the file cannot be made")
            return {"CANCELLED"}
        preset = material.shibo.preset
        material.shibo.graph = path
        material.shibo.preset = preset
        return self.done(material)


class SHIBO_OT_edit(OfMaterial, bpy.types.Operator):
    """Open the graph in the editor of the system"""
    bl_idname = "shibo.edit"
    bl_label = "Edit"
    bl_options = {"REGISTER"}

    def execute(self, context):
        graph = current(context).shibo.graph
        if graph.startswith("shibo:"):
            self.report({"ERROR"}, "graphs that come with Shibo cannot be changed; make a file with New Graph from This")
            return {"CANCELLED"}
        return bpy.ops.wm.path_open(filepath=bpy.path.abspath(graph))


class SHIBO_OT_keep(OfMaterial, bpy.types.Operator):
    """Write the values of the parameters into the file of the graph, as defaults or into the preset in use"""
    bl_idname = "shibo.keep"
    bl_label = "Save Values to the Graph"
    bl_options = {"REGISTER"}

    def execute(self, context):
        return self.ended(live.keep(current(context)))


class SHIBO_OT_show(OfMaterial, bpy.types.Operator):
    """Show all errors of the graph"""
    bl_idname = "shibo.show"
    bl_label = "Show"
    bl_options = {"REGISTER"}

    def execute(self, context):
        errors = current(context).shibo.errors

        def draw(menu, _context):
            for error in errors:
                place = f"{os.path.basename(error.file)}:{error.line}:{error.column}  " if error.line else ""
                menu.layout.label(text=place + error.message)

        context.window_manager.popup_menu(draw, title="Errors of the graph", icon="ERROR")
        return {"FINISHED"}


class SHIBO_OT_restart(bpy.types.Operator):
    """End the program shibo and start it again"""
    bl_idname = "shibo.restart"
    bl_label = "Start Shibo Again"

    def execute(self, _context):
        live.restart()
        return {"FINISHED"}


CLASSES = (
    SHIBO_OT_add, SHIBO_OT_update, SHIBO_OT_lay, SHIBO_OT_measure, SHIBO_OT_bake, SHIBO_OT_pack, SHIBO_OT_remove,
    SHIBO_OT_new_file, SHIBO_OT_edit, SHIBO_OT_keep, SHIBO_OT_show, SHIBO_OT_restart)
