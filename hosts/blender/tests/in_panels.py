"""Tests of the panels, drawn onto a layout that checks names, and of the small pictures of graphs."""
import os
import subprocess
import sys
import time

import bpy

from __main__ import Case
from scene import STRIPES, live, path, plane, text
from shibo import gallery, panel


class Layout:
    """A layout that refuses properties and operators that do not exist, and keeps all texts."""

    def __init__(self, texts=None):
        self.texts = [] if texts is None else texts

    def row(self, **_):
        return Layout(self.texts)

    column = box = row

    def label(self, text="", icon="NONE"):
        self.texts.append(text)

    def prop(self, owner, name, text=None, **_):
        if name.startswith("["):
            owner.path_resolve(name)
        elif name not in owner.bl_rna.properties:
            raise AttributeError(name)
        self.texts.append(text or name)

    def operator(self, name, text=None, icon="NONE", depress=False):
        family, operator = name.split(".")
        kind = getattr(getattr(bpy.ops, family), operator).get_rna_type()
        if icon not in bpy.types.UILayout.bl_rna.functions["label"].parameters["icon"].enum_items:
            raise AttributeError(icon)
        self.texts.append(text or kind.name)
        return type("Fields", (), {})()

    def template_icon(self, icon_value, scale):
        self.texts.append(f"icon {icon_value}")


def drawn():
    """All texts of the panel."""
    layout = Layout()
    shown = type("Shown", (), {"layout": layout})()
    panel.Drawn.draw(shown, bpy.context)
    return layout.texts


class Panels(Case):
    def test_an_object_without_a_graph_offers_them(self):
        plane()
        self.assertEqual(drawn(), ["Choose a Graph", "Open a Graph File"])

    def test_all_parts_are_drawn(self):
        material = self.add(size=32)
        texts = drawn()
        for part in ("preset", "Pitch (mm)", "Color", "seed", "size_edit", "UV", "Box", "Through the Object", "live", "Update", "pack"):
            self.assertIn(part, texts)
        self.assertTrue(any(line.startswith("sharp at 32") for line in texts), texts)
        material.shibo.by = "PIECES"
        material.shibo.lay = "CUT"
        self.assertLess({"object", "by", "spread", "place", "move"}, set(drawn()))

    def test_errors_are_drawn(self):
        plane()
        with self.assertRaises(RuntimeError):
            bpy.ops.shibo.add(graph=text("wrong.ron", STRIPES.replace("fract", "fracture")))
        texts = drawn()
        self.assertIn("Show", texts)
        self.assertTrue(any(line.startswith("line 3:") for line in texts), texts)

    def test_a_graph_gets_a_small_picture(self):
        self.add(size=32)
        self.assertLess({"calf", "walnut"}, {name for name, _ in gallery.graphs()})
        gallery.icon("shibo:calf")
        end = time.monotonic() + 30
        while not gallery.icon("shibo:calf") and not gallery._state["failed"] and time.monotonic() < end:
            time.sleep(min(0.05, live.step(time.monotonic())))
        self.assertGreater(os.path.getsize(gallery._file("calf")), 1000)
        os.remove(gallery._file("calf"))

    def test_another_graph_replaces_the_parameters(self):
        material = self.add(size=32)
        self.assertEqual(bpy.ops.shibo.choose("EXEC_DEFAULT", graph="shibo:walnut"), {"FINISHED"})
        self.assertIn("shibo_rings", material)
        self.assertNotIn("shibo_pitch", material)
        self.assertIn("Tangent", material.shibo.tree.interface.items_tree)
        self.assertEqual(bpy.ops.shibo.new_file(filepath=path("mine.ron")), {"FINISHED"})
        self.assertEqual(material.shibo.graph, path("mine.ron"))
        self.assertIn("shibo_rings", material)
        with self.assertRaisesRegex(RuntimeError, "file already"):
            bpy.ops.shibo.new_file(filepath=path("mine.ron"))


class Extension(Case):
    def test_installed_from_the_archive(self):
        folder = path("dist")
        build = os.path.join(os.path.dirname(__file__), "..", "build")
        made = subprocess.run([build, folder, os.environ["SHIBO"]], check=True, capture_output=True, text=True).stdout
        archive = made.splitlines()[1].split(": ")[0]
        code = (
            "import bpy, os, sys, time\n"
            "bpy.ops.extensions.package_install_files(filepath=sys.argv[1], repo='user_default', enable_on_install=True)\n"
            "bpy.ops.mesh.primitive_plane_add(size=0.1)\n"
            "bpy.ops.shibo.add(graph='shibo:starter', size=32)\n"
            "print('STATUS', bpy.context.object.active_material.shibo.status, flush=True)\n"
            "import bl_ext.user_default.shibo as s; print('PROGRAM', s.live.keeper.client().program, flush=True)\n"
            "bpy.ops.preferences.addon_disable(module='bl_ext.user_default.shibo')\n"
            "os._exit(0)\n")
        own = {**os.environ, "PATH": "/usr/bin:/bin", "BLENDER_USER_RESOURCES": path("user")}
        done = subprocess.run([sys.executable, "-c", code, archive], env=own, capture_output=True, text=True, timeout=120)
        self.assertIn("STATUS sharp at 32", done.stdout, done.stdout + done.stderr)
        self.assertIn("/bin/shibo", done.stdout.split("PROGRAM")[1])
