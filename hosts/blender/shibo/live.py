"""Keeps all materials with a graph up to date: a timer asks and receives, handlers notice changes."""
import time

import bpy
from bpy.app.handlers import persistent

from . import images, meshes, nodes, params
from .client import Keeper
from .work import Work

# Seconds between looks: pictures wait; renders run; something changed a moment ago; nothing happens.
BUSY, RUNNING, AWAKE, IDLE = 0.005, 0.02, 0.1, 0.5
# Seconds after a change in which looks are frequent.
WAKING = 5.0
# Longest time in seconds that an operator waits for pictures.
PATIENCE = 600.0
# The same for writing values into a file.
KEEPING = 10.0

_works = {}
_state = {"awake": 0.0, "depth": 0}


def _locate():
    from . import client, props
    return client.find(props.preferred(), props.bundled())


keeper = Keeper(_locate)


def managed():
    """The materials that follow a graph. Linked and overridden ones are not changed."""
    seen = set()
    own = [material for material in bpy.data.materials if material.shibo.graph and is_own(material)]
    # A copy shares group and images with its original until it gets its own.
    for material in sorted(own, key=lambda material: material.session_uid not in _works):
        tree = material.shibo.tree
        if tree is not None and tree in seen:
            _separate(material)
        seen.add(tree)
    return own


def is_own(material):
    """False for a linked or overridden material."""
    return material.library is None and material.override_library is None


def _separate(material):
    """Gives a copy of a material a group and images of its own."""
    node = nodes.node_of(material)
    material.shibo.tree = material.shibo.tree.copy()
    material.shibo.images.clear()
    if node is not None:
        node.node_tree = material.shibo.tree


def work_of(material):
    """The work of a material."""
    uid = material.session_uid
    if uid not in _works:
        _works[uid] = Work(uid)
    return _works[uid]


def status(material):
    """A line about a material for people."""
    if not is_own(material):
        return "linked or overridden from another file; change it there"
    if keeper.trouble and not keeper.running:
        return f"Shibo does not run: {keeper.trouble}"
    work = _works.get(material.session_uid)
    line = work.status() if work else ""
    if keeper.crashes and keeper.running and not line.startswith("line"):
        line += f" (started again after: {keeper.trouble})"
    return line


def program_line():
    """A line about the program for people."""
    if keeper.running:
        version = (keeper.hello or {}).get("version")
        return f"Shibo {version} runs" if version else "Shibo is starting; try again in a few seconds"
    return keeper.trouble or keeper.ended or "Shibo starts with the first material"


def presets(material):
    """The names of the presets of a material's graph."""
    info = work_of(material).info
    return list(info["presets"]) if info else []


def reset(material):
    """Sets the parameters to the values of the chosen preset."""
    work = _works.get(material.session_uid)
    if work and work.info and is_own(material):
        params.reset(material, work.info, material.shibo.preset)
        work.fresh = True
    wake()


def restart():
    """Ends the process; the next look starts it, with no memory of crashes."""
    keeper.stop()
    for work in _works.values():
        work.forget()
    wake()


# -- Looks

def step(now, wait=False):
    """Receives and asks; puts one picture in place, or all that are ready if `wait`. Returns the seconds until the next step."""
    if _state["depth"]:
        return BUSY
    _state["depth"] += 1
    try:
        return _step(now, wait)
    finally:
        _state["depth"] -= 1


def _step(now, wait):
    from . import gallery
    materials = managed()
    _end_unused(materials, gallery.is_busy())
    if not materials and not gallery.is_busy():
        return IDLE
    crashes = keeper.crashes
    client = keeper.client()
    if keeper.crashes != crashes or client is None:
        for work in _works.values():
            work.forget()
    if client is None:
        return IDLE
    for event in client.poll(RUNNING if wait else 0.0):
        _changed(event)
    rendering = bpy.app.is_job_running("RENDER")
    placed = False
    for material in materials:
        work = work_of(material)
        if rendering:
            continue
        if work.info is not None and (work.fresh or not material.shibo.given):
            work.settle(material)
        _mesh(material, work, client)
        work.look(material, client, now, wait)
        while (wait or not placed) and work.put(material):
            placed = True
        # Nodes are made in a step of their own, so no step takes long.
        ready = () if placed and not wait else work.finish(material)
        if ready:
            images.tag_users(ready)
        _tell(material, work)
    if placed:
        return BUSY
    if not any(work.requests for work in _works.values()) and not wait and gallery.is_busy():
        gallery.step(client)
        return RUNNING
    return _interval(now)


def _interval(now):
    works = _works.values()
    if any(work.arrived for work in works):
        return BUSY
    if any(work.requests or work.info is None and not work.errors for work in works):
        return RUNNING
    waits = any(work.asked_size and not work.sharp or work.changed_at and now - work.changed_at < 1.0 for work in works)
    return AWAKE if waits or now < _state["awake"] else IDLE


def _changed(event):
    """A save of a file that is watched."""
    for work in _works.values():
        if work.graph is not None and work.graph == event.get("graph"):
            if event["event"] == "changed":
                work.take(event)
            elif event["event"] == "broken":
                work.broken = event["errors"]


def _mesh(material, work, client):
    """Sends the mesh of a material that is cut from a solid, once."""
    if material.shibo.lay != "CUT" or work.info is None or not client.hello:
        return
    mold = work.mold(material)
    if work.meshed == mold:
        return
    work.meshed = mold
    try:
        work.export(material, client)
    except meshes.Unfit as unfit:
        work.fail({"message": str(unfit)})


def _tell(material, work):
    """Writes the errors into the material, for the panel and for scripts."""
    told = material.shibo.errors
    now = [(error.get("file") or "", error.get("line") or 0, error.get("column") or 0, error["message"]) for error in work.errors]
    if [(error.file, error.line, error.column, error.message) for error in told] != now:
        told.clear()
        for file, line, column, message in now:
            error = told.add()
            error.file, error.line, error.column, error.message = file, line, column, message


def _end_unused(materials, is_used):
    """Ends the work of materials that are gone, and the process after the last one if nothing else uses it."""
    used = {material.session_uid for material in materials}
    for uid in [uid for uid in _works if uid not in used]:
        work = _works.pop(uid)
        if keeper.running:
            work.close(keeper.client())
    if not materials and not is_used and keeper.running:
        keeper.stop()


def finish(material, seconds=PATIENCE):
    """Waits until the final pictures of a material are in place. Returns the reason why they are not, or an empty text."""
    work = work_of(material)
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        work.forced = True
        step(time.monotonic(), wait=True)
        if keeper.trouble and not keeper.running:
            return status(material)
        if work.is_finished(material):
            work.forced = False
            return status(material) if work.errors else ""
    return f"not done after {seconds:g} s: {status(material)}"


def keep(material):
    """Writes the values of the parameters into the file of the graph. Returns the reason why they are not, or an empty text."""
    work = work_of(material)
    if work.graph is None or not keeper.running:
        return status(material) or "the graph is not open yet"
    if material.shibo.graph.startswith("shibo:"):
        return "graphs that come with Shibo cannot be changed; make a file with New Graph from This"
    answers = []
    fields = {"preset": material.shibo.preset} if material.shibo.preset else {}
    values = params.changed(material, work.info, material.shibo.preset)
    keeper.client().ask("keep", answers.append, graph=work.graph, values=values, sha256=work.info["sha256"], **fields)
    end = time.monotonic() + KEEPING
    while not answers and keeper.running and time.monotonic() < end:
        step(time.monotonic(), wait=True)
    if not answers:
        return f"no answer after {KEEPING:g} s"
    return answers[0]["error"]["message"] if "error" in answers[0] else ""


# -- Timer and handlers

def _timer():
    now = time.monotonic()
    try:
        return step(now)
    except ReferenceError:
        # Data was removed during the step.
        return AWAKE


def wake():
    """Looks soon."""
    _state["awake"] = time.monotonic() + WAKING
    if not bpy.app.background:
        if bpy.app.timers.is_registered(_timer):
            bpy.app.timers.unregister(_timer)
        bpy.app.timers.register(_timer, first_interval=BUSY, persistent=True)


@persistent
def _on_depsgraph(_scene, depsgraph):
    """Asks for pictures as soon as a value changes. Nothing of Blender is changed here."""
    if _state["depth"] or not _works or not keeper.running:
        return
    if not any(isinstance(update.id, (bpy.types.Material, bpy.types.Object)) for update in depsgraph.updates):
        return
    now = time.monotonic()
    for material in bpy.data.materials:
        work = _works.get(material.session_uid)
        if work is not None and material.shibo.graph and is_own(material) and work.info is not None and not work.fresh:
            before = work.generation
            work.look(material, keeper.client(), now)
            if work.generation != before:
                wake()
    if now > _state["awake"] - WAKING + AWAKE:
        wake()


@persistent
def _on_load_pre(*_):
    keeper.stop()
    _works.clear()


@persistent
def _on_load(*_):
    wake()


@persistent
def _on_undo(*_):
    # Pixels and values may be others now.
    for work in _works.values():
        work.restart()
    wake()


@persistent
def _on_save(*_):
    for material in bpy.data.materials:
        if material.shibo.graph and material.shibo.pack and is_own(material):
            images.pack(material)


@persistent
def _on_frame(scene, depsgraph=None):
    """Brings animated parameters up to date before a frame is rendered without a window."""
    if not bpy.app.background or depsgraph is None or _state["depth"]:
        return
    for material in managed():
        action = material.animation_data
        work = _works.get(material.session_uid)
        if action and material.shibo.live and work and work.info:
            seen = material.evaluated_get(depsgraph)
            for name in params.baseline(work.info):
                key = params.key(name)
                if key in seen and params.plain(seen[key]) != params.plain(material[key]):
                    material[key] = params.plain(seen[key])
            finish(material)


HANDLERS = {
    "depsgraph_update_post": _on_depsgraph,
    "load_pre": _on_load_pre,
    "load_post": _on_load,
    "undo_post": _on_undo,
    "redo_post": _on_undo,
    "save_pre": _on_save,
    "frame_change_post": _on_frame,
}


def register():
    """Starts the timer and the handlers."""
    for name, handler in HANDLERS.items():
        getattr(bpy.app.handlers, name).append(handler)
    wake()


def unregister():
    """Ends the timer, the handlers and the process."""
    if bpy.app.timers.is_registered(_timer):
        bpy.app.timers.unregister(_timer)
    for name, handler in HANDLERS.items():
        if handler in getattr(bpy.app.handlers, name):
            getattr(bpy.app.handlers, name).remove(handler)
    keeper.stop()
    _works.clear()
