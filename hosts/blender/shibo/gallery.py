"""The graphs that come with Shibo: a list to search, with small pictures that the process makes when it has nothing else to do."""
import os
import shutil

import bpy
import bpy.utils.previews
from bpy.props import EnumProperty, StringProperty

from . import live, ops

# Pixels of a small picture.
SIDE = 96
# Longest wait in seconds for the list of graphs.
PATIENCE = 5.0

_state = {"previews": None, "waiting": [], "open": None, "client": None, "failed": set(), "items": [], "graphs": [], "build": ""}


def graphs():
    """The shipped graphs without parts of others: pairs of name and description."""
    hello = live.keeper.hello
    if hello:
        # The list stays when the process ends.
        _state["graphs"] = [(graph["name"], graph["doc"]) for graph in hello["graphs"] if not graph["part"]]
        _state["build"] = hello["build"][:12]
    return _state["graphs"]


def _folder():
    try:
        return bpy.utils.extension_path_user(__package__, path="pictures", create=True)
    except (AttributeError, ValueError):
        # This is no installed extension.
        return bpy.app.tempdir


def _file(name):
    return os.path.join(_folder(), f"{name}-{_state['build']}.png")


def icon(graph):
    """The number of the icon of a shipped graph; 0 without one."""
    previews = _state["previews"]
    name = graph.removeprefix("shibo:")
    if previews is None or not graph.startswith("shibo:") or not graphs():
        return 0
    if name not in previews:
        if not os.path.isfile(_file(name)):
            if name not in _state["waiting"] and name not in _state["failed"]:
                _state["waiting"].insert(0, name)
            return 0
        previews.load(name, _file(name), "IMAGE")
    return previews[name].icon_id


def is_busy():
    """True while pictures are missing."""
    return bool(_state["waiting"] or _state["open"])


def step(client):
    """Begins the next small picture if none is being made."""
    if _state["client"] is not client:
        # The process of before took its requests with it.
        _state["client"], _state["open"] = client, None
    while _state["waiting"] and _state["open"] is None:
        name = _state["waiting"].pop(0)
        if os.path.isfile(_file(name)):
            continue
        _state["open"] = name
        client.ask("open", then=lambda answer: _opened(client, name, answer), graph=f"shibo:{name}")


def _opened(client, name, answer):
    if "error" in answer:
        _finish(name, False)
        return
    graph, outputs = answer["ok"]["graph"], answer["ok"]["outputs"]
    lit = next((output["name"] for output in outputs if output["type"] == "Rgb"), None)
    material = next((output["name"] for output in outputs if output["type"] == "Material"), None)
    files = []

    def done(answer):
        try:
            if files and "ok" in answer:
                shutil.copyfile(files[0], _file(name))
        except OSError:
            files.clear()
        _finish(name, bool(files))
        if client.ended is None:
            client.ask("free", files=files)
            client.ask("close", graph=graph)

    fields = {"as": "png", "output": lit or f"{material}.base_color"}
    client.ask("render", done, lambda event: files.append(event["file"]) if "file" in event else None,
               graph=graph, sizes=[SIDE], components=3, **fields)


def _finish(name, made):
    _state["open"] = None
    if not made:
        _state["failed"].add(name)


def _items(_operator, _context):
    # Blender needs the texts to stay in memory.
    _state["items"] = [
        (f"shibo:{name}", name.replace("_", " "), doc, icon(f"shibo:{name}"), at) for at, (name, doc) in enumerate(graphs())
    ] or [("", "no graphs", live.program_line(), 0, 0)]
    return _state["items"]


class SHIBO_OT_choose(bpy.types.Operator):
    """Choose one of the graphs that come with Shibo"""
    bl_idname = "shibo.choose"
    bl_label = "Choose a Graph"
    bl_options = {"REGISTER", "UNDO"}
    bl_property = "graph"

    graph: EnumProperty(name="Graph", items=_items)

    def invoke(self, context, _event):
        if not hear():
            self.report({"ERROR"}, live.program_line())
            return {"CANCELLED"}
        context.window_manager.invoke_search_popup(self)
        return {"FINISHED"}

    def execute(self, context):
        return use(self, context, self.graph)


class SHIBO_OT_open_file(bpy.types.Operator):
    """Choose a graph file"""
    bl_idname = "shibo.open_file"
    bl_label = "Open a Graph File"
    bl_options = {"REGISTER", "UNDO"}

    filepath: StringProperty(subtype="FILE_PATH")
    filter_glob: StringProperty(default="*.ron;*.json", options={"HIDDEN"})

    def invoke(self, context, _event):
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, context):
        return use(self, context, self.filepath)


def hear():
    """Starts the process, and waits for its list of graphs; false without a process."""
    client = live.keeper.client()
    if client is None:
        return False
    if not client.hello:
        client.poll(PATIENCE)
    return bool(client.hello)


def use(operator, context, graph):
    """Gives the current material another graph, or the object a new material."""
    material = ops.current(context)
    if material is None or not material.shibo.graph:
        return bpy.ops.shibo.add(graph=graph)
    if not live.is_own(material):
        operator.report({"ERROR"}, "the material is linked from another file; change it there")
        return {"CANCELLED"}
    material.shibo.preset = ""
    material.shibo.graph = graph
    return bpy.ops.shibo.update()


def register():
    """Starts the collection of pictures."""
    _state["previews"] = bpy.utils.previews.new()


def unregister():
    """Removes the collection of pictures."""
    if _state["previews"] is not None:
        bpy.utils.previews.remove(_state["previews"])
    _state.update(previews=None, waiting=[], open=None, client=None, items=[], failed=set())


CLASSES = (SHIBO_OT_choose, SHIBO_OT_open_file)
