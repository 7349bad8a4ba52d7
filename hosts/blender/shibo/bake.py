"""Writing the pictures of a material into a folder, where its images then find them."""
import functools
import os
import shutil
import time

import bpy

from . import images, live, nodes


class Bake:
    """An unfinished bake. It ends when all renders are answered."""

    def __init__(self, material, folder, size):
        self.uid = material.session_uid
        self.folder = folder
        self.waiting = set()
        self.files = {}
        self.trouble = ""
        work = live.work_of(material)
        client = live.keeper.client()
        wanted = work.wanted(material)
        channels = [channel for channel in work.output(None)["channels"] if channel in nodes.SOCKETS]
        for form in ("png", "exr"):
            chosen = [channel for channel in channels if (channel in images.FLOATS) == (form == "exr")]
            if chosen:
                self.waiting.add(form)
                fields = {"as": form}
                client.ask("render", functools.partial(self._done, client, form), self._event, graph=work.graph,
                           slot=self._slot(form), channels=chosen, sizes=[size], **wanted, **fields)

    def _slot(self, form):
        return f"{self.uid} bake {form}"

    def _event(self, message):
        if message["event"] == "picture" and "file" in message:
            self.files[message["channel"]] = message["file"]

    def _done(self, client, form, answer):
        self.waiting.discard(form)
        if "error" in answer:
            self.trouble = self.trouble or answer["error"]["message"]
        if self.waiting:
            return
        material = next((one for one in bpy.data.materials if one.session_uid == self.uid), None)
        try:
            if material is not None and not self.trouble:
                self._use(material)
        except OSError as error:
            self.trouble = f"the pictures cannot be written: {error}"
        if client.ended is None:
            client.ask("free", files=list(self.files.values()))
            for form in ("png", "exr"):
                client.ask("close", slot=self._slot(form))
        work = live.work_of(material) if material is not None else None
        if work is not None:
            work.note = self.trouble or f"baked into {self.folder}"

    def _use(self, material):
        """Copies the files, and lets the images use them."""
        folder = bpy.path.abspath(self.folder)
        os.makedirs(folder, exist_ok=True)
        # The files are the state from now on: later changes of values do not touch them.
        material.shibo.live = False
        material.shibo.pack = False
        for channel, file in self.files.items():
            name = f"{bpy.path.clean_name(material.name)}_{channel}{os.path.splitext(file)[1]}"
            path = os.path.join(folder, name)
            shutil.copyfile(file, path + ".part")
            os.replace(path + ".part", path)
            image = images.find(material, channel)
            if image is None:
                continue
            if image.packed_file is not None:
                image.unpack(method="REMOVE")
            image.source = "FILE"
            image.filepath = bpy.path.relpath(path) if self.folder.startswith("//") else path
            image.reload()
        live.work_of(material).applied.clear()


def start(material, folder, size, wait):
    """Starts a bake. With `wait` it is done afterwards. Returns the reason why it cannot be done, or an empty text."""
    trouble = live.finish(material)
    if trouble:
        return trouble
    baked = Bake(material, folder, size)
    end = time.monotonic() + live.PATIENCE
    while wait and baked.waiting and time.monotonic() < end:
        live.step(time.monotonic(), wait=True)
    if wait and baked.waiting:
        return f"not done after {live.PATIENCE:g} s"
    return baked.trouble
