"""The work of one material: opening its graph, asking for pictures, and putting them into images and nodes."""
import concurrent.futures
import functools
import json
import os
import time

import bpy

from . import images, meshes, nodes, params

# A coarse render that has run this long in seconds may be replaced by one of newer values. Before, it is shown first, so pictures
# follow a slider that moves all the time.
LONG = 1.5
# Seconds without a change before the final size is rendered.
REST = 0.4
# Reads files of pictures, so that Blender waits only for the copies into images.
_readers = concurrent.futures.ThreadPoolExecutor(1, thread_name_prefix="shibo")


class Work:
    """The state of a material that is not saved."""

    def __init__(self, uid):
        self.uid = uid
        self.forget()

    def forget(self):
        """Forgets the process: everything is asked again."""
        # The graph as it was opened, its name for requests, and the answer.
        self.source, self.stamp, self.graph, self.info = None, None, None, None
        # Errors of the last save, after which the last good graph stays; errors of the last request.
        self.broken, self.failed = [], []
        # True until the parameters of a new description were made.
        self.fresh = False
        # The name of the mesh for requests, its file, and its `mold`.
        self.mesh, self.mesh_file, self.meshed = None, "", None
        # A line about the last bake.
        self.note = ""
        self.restart()

    def restart(self):
        """Forgets the pictures: all are asked and written again."""
        self.asked, self.asked_size, self.asked_at = None, 0, 0.0
        self.changed_at = 0.0
        self.generation = getattr(self, "generation", 0) + 1
        self.requests = set()
        self.arrived, self.channels, self.applied, self.told = [], {}, {}, {}
        self.laid = None
        self.progress, self.sharp = "", ""
        self.forced = False

    @property
    def errors(self):
        """All errors that people must see."""
        return self.broken or self.failed

    # -- The graph

    def look(self, material, client, now, direct=False):
        """Opens the graph, or asks for pictures, if that is due: coarse ones first unless `direct`. Changes no data of Blender."""
        source = self._source(material)
        if source != self.source or self.graph is None and self.errors and self._stamp(source) != self.stamp:
            self._open(source, client)
        if self.info is None or self.graph is None or not (material.shibo.live or self.forced):
            return
        if material.shibo.lay == "CUT" and (self.mesh is None or self.meshed != self.mold(material)):
            return
        wanted = self.wanted(material)
        size, coarse = material.shibo.size, min(material.shibo.size_edit, material.shibo.size)
        if direct:
            coarse = size
        if wanted != self.asked:
            busy = self.requests or self.arrived
            if busy and self.asked_size <= coarse < size and now - self.asked_at < LONG:
                return
            self.changed_at = now
            self._ask(material, client, wanted, coarse, now)
        elif self.asked_size < size and not self.requests and not self.arrived and not self.failed and now - self.changed_at > REST:
            self._ask(material, client, wanted, size, now)

    def _source(self, material):
        graph = material.shibo.graph
        return graph if graph.startswith("shibo:") else bpy.path.abspath(graph)

    def _stamp(self, source):
        try:
            return os.stat(source).st_mtime_ns
        except OSError:
            return None

    def _open(self, source, client):
        if self.graph is not None:
            client.ask("close", graph=self.graph)
        self._drop_mesh(client)
        self.forget()
        self.source, self.stamp = source, self._stamp(source)
        client.ask("open", then=functools.partial(self._opened, source), graph=source, watch=not source.startswith("shibo:"))

    def _opened(self, source, answer):
        if source != self.source:
            return
        if "error" in answer:
            self.fail(answer["error"])
            return
        self.graph = answer["ok"]["graph"]
        self.take(answer["ok"])

    def take(self, info):
        """Takes the description of the graph, after `open` and after a save of its file."""
        self.info = info
        self.broken, self.failed = [], []
        self.asked, self.laid = None, None
        self.fresh = True
        if not self.output(None):
            self.fail({"message": "the graph has no material among its outputs; name one in `outputs`"})

    def fail(self, error):
        """Keeps the errors of an answer."""
        if error.get("code") not in ("cancelled", "ended"):
            self.failed = error.get("errors") or [{"message": error["message"]}]

    def output(self, name):
        """The material among the outputs that has this name, or the first."""
        found = [output for output in self.info["outputs"] if output["type"] == "Material"]
        return next((output for output in found if output["name"] == name), found[0] if found else None)

    def settle(self, material):
        """Makes the parameters of a graph that was read."""
        self.fresh = False
        shibo = material.shibo
        if shibo.preset and shibo.preset not in self.info["presets"]:
            shibo.preset = ""
        if not shibo.given:
            # Parameters of another graph.
            params.remove(material)
            shibo.seed = min(self.info["canvas"]["seed"], params.MOST_INT)
        before = json.loads(shibo.given) if shibo.given else {}
        shibo.given = json.dumps(params.ensure(material, self.info, shibo.preset, before))

    # -- Renders

    def wanted(self, material, values=None):
        """All that the pictures depend on, but their size. `values` is the material with other values of its parameters."""
        shibo = material.shibo
        output = self.output(None)
        if output is None:
            return None
        request = {
            "output": output["name"],
            "set": params.changed(values or material, self.info, shibo.preset),
            "preset": shibo.preset or None,
            "seed": shibo.seed if shibo.seed != self.info["canvas"]["seed"] else None,
        }
        if shibo.lay == "CUT" and shibo.object:
            request["on"] = {"mesh": self.mesh, "by": "None", "place": meshes.place(shibo.object, shibo.place, shibo.move)}
        return request

    def _ask(self, material, client, wanted, size, now):
        if wanted is None:
            return
        self.generation += 1
        self.asked, self.asked_size, self.asked_at = wanted, size, now
        self.requests, self.arrived = set(), []
        self.failed, self.note = [], ""
        self.sharp = ""
        channels = [channel for channel in self.output(None)["channels"] if channel in nodes.SOCKETS]
        if not channels:
            self.fail({"message": "the material of the graph has no channel that Blender shows"})
        for form in ("u8", "f32"):
            chosen = [channel for channel in channels if (channel in images.FLOATS) == (form == "f32")]
            if chosen:
                self._render(client, form, channels=chosen, sizes=[size], **wanted)

    def _render(self, client, form, **fields):
        generation = self.generation
        self.requests.add(form)
        fields["as"] = form
        client.ask(
            "render", functools.partial(self._done, generation, form), functools.partial(self._event, generation),
            graph=self.graph, slot=f"{self.uid} {form}", rows="bottom", components=4, **fields)

    def _event(self, generation, message):
        if generation != self.generation:
            return
        if message["event"] == "progress":
            self.progress = f"computing {message['node']} {message['done']}/{message['of']}"
            return
        channel = message["channel"]
        if message["event"] == "same":
            message = {**self.told.get((channel, message["width"]), {}), **message}
        self.told[channel, message["width"]] = message
        if "value" in message:
            self.arrived.append((channel, message, tuple(message["value"])))
        elif "file" in message and self.applied.get(channel) != message["key"]:
            pixels = _readers.submit(images.samples, message["file"], message["as"], message["width"], message["height"])
            self.arrived.append((channel, message, pixels))

    def _done(self, generation, form, answer):
        if generation != self.generation:
            return
        self.requests.discard(form)
        if "error" in answer:
            self.fail(answer["error"])

    # -- Into Blender

    def put(self, material):
        """Puts the first picture that has arrived into its image; false if none is ready."""
        if not self.arrived or not (isinstance(self.arrived[0][2], tuple) or self.arrived[0][2].done()):
            return False
        channel, message, pixels = self.arrived.pop(0)
        if isinstance(pixels, tuple):
            self.channels[channel] = pixels
            self.applied.pop(channel, None)
            return True
        try:
            pixels = pixels.result()
        except (OSError, ValueError):
            # A newer render has replaced the file.
            self.asked = None
            return True
        image = images.ensure(material, channel, message["width"], message["height"])
        images.write(image, pixels)
        self.channels[channel] = image
        self.applied[channel] = message["key"]
        return True

    def finish(self, material):
        """Connects the pictures when all have arrived. Returns the images, for the objects that read them."""
        lay = self.lay(material)
        complete = self.asked is not None and not self.requests and not self.arrived and not self.failed and self.channels
        if not complete or self.sharp and self.laid == lay:
            return ()
        known = self.output(None)["channels"]
        for channel in [channel for channel in self.channels if channel not in known]:
            del self.channels[channel]
        nodes.ensure(material, self.channels, lay)
        for channel in list(images.all_of(material)):
            if not hasattr(self.channels.get(channel), "pixels"):
                images.drop(material, channel)
        if not self.sharp:
            self.sharp = f"sharp at {self.asked_size}, {time.monotonic() - self.asked_at:.1f} s"
            self.forced = self.forced and self.asked_size < material.shibo.size
        self.laid = lay
        self.progress = ""
        return tuple(images.all_of(material).values())

    def lay(self, material):
        """How the pictures lie on objects, as `nodes.ensure` takes it."""
        shibo = material.shibo
        size = self.info["canvas"]["size_mm"] if self.info else (1000, 1000)
        return {
            "by": shibo.lay, "size_mm": tuple(size), "density": tuple(shibo.density), "scale": tuple(shibo.scale),
            "uv_map": shibo.uv_map,
        }

    def retry(self):
        """Asks for everything again: the graph if it failed, the mesh, and all pictures. What has not changed is not computed again."""
        if self.graph is None:
            self.source = None
        self.asked, self.failed = None, []
        self.applied.clear()
        self.meshed = None

    def is_finished(self, material):
        """True if the final pictures are in place, or cannot be made."""
        if self.failed:
            return True
        final = self.sharp and not self.requests and not self.arrived and self.asked_size >= material.shibo.size
        return bool(final) and self.info is not None and self.wanted(material) == self.asked and self.laid == self.lay(material)

    def status(self):
        """A line about the state."""
        if self.errors:
            first = self.errors[0]
            return f"line {first['line']}: {first['message']}" if first.get("line") else first["message"]
        if self.info is None:
            return "opening the graph"
        if self.requests or self.arrived:
            return self.progress or "computing"
        return self.note or self.sharp

    # -- Through the object

    def mold(self, material):
        """All that the mesh is made from but its shape, which is read again on request."""
        shibo = material.shibo
        pieces = (tuple(shibo.spread), shibo.seed) if shibo.by == "PIECES" else None
        return shibo.object and shibo.object.session_uid, shibo.uv_map, pieces

    def export(self, material, client):
        """Sends the mesh of the object. Raises `meshes.Unfit` if it has no suitable UVs."""
        self._drop_mesh(client)
        thing = material.shibo.object
        if thing is None:
            raise meshes.Unfit("no object is set; select it, and click Through the Object again")
        path = os.path.join(client.hello["folder"], f"{self.uid}-{time.monotonic_ns()}.obj")
        meshes.export(path, thing, material)
        name = thing.name
        client.ask("mesh", then=functools.partial(self._meshed, client, path, name), file=path, unit="mm", up="Z")

    def _meshed(self, client, path, name, answer):
        if "error" in answer:
            self.fail(answer["error"])
            return
        try:
            meshes.judge(answer["ok"], name)
        except meshes.Unfit as unfit:
            self.fail({"message": str(unfit)})
            return
        # Renders read the file again, so it stays as long as the mesh.
        self.mesh, self.mesh_file = answer["ok"]["mesh"], path
        self.asked = None

    def _drop_mesh(self, client):
        if self.mesh is None:
            return
        client.ask("close", mesh=self.mesh)
        self.mesh = None
        try:
            os.remove(self.mesh_file)
        except OSError:
            pass

    def close(self, client):
        """Lets the process forget the material."""
        for form in ("u8", "f32"):
            client.ask("close", slot=f"{self.uid} {form}")
        if self.graph is not None:
            client.ask("close", graph=self.graph)
        self._drop_mesh(client)
