"""Tests of the extension on a stub of Blender 5: SHIBO=path/to/shibo python3 on_stub.py

SHIBO_EXTENSION=FOLDER tests the package `shibo` of that folder, such as an unpacked archive.
"""
import os
import re
import sys
import tempfile
import time
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
EXTENSION = os.environ.get("SHIBO_EXTENSION", os.path.dirname(HERE))
sys.path[:0] = [os.path.join(HERE, "stub"), EXTENSION]
BIN = tempfile.mkdtemp()
os.symlink(os.path.abspath(os.environ["SHIBO"]), os.path.join(BIN, "shibo"))
os.environ["PATH"] = BIN + os.pathsep + os.environ["PATH"]

import bpy  # noqa: E402
import numpy  # noqa: E402

import shibo  # noqa: E402
from shibo import live, meshes, params  # noqa: E402


def square(size=0.04, scale=1.0):
    thing = bpy.data.objects.new("square", bpy.data_blocks.Mesh(size), scale)
    bpy.context.object = thing
    return thing


class Case(unittest.TestCase):
    def setUp(self):
        shibo.register()

    def tearDown(self):
        bpy.reset()
        shibo.unregister()
        bpy.app.background = True
        self.assertFalse(live.keeper.running)

    def add(self, graph="shibo:starter", **fields):
        thing = bpy.context.object or square()
        self.assertEqual(bpy.ops.shibo.add(graph=graph, size=32, **fields), {"FINISHED"})
        return thing.data.materials[-1]


class Materials(Case):
    def test_the_group_has_the_names_of_the_surface(self):
        material = self.add()
        group = material.node_tree.nodes["Shibo starter"]
        self.assertEqual([socket.name for socket in group.outputs], ["Base Color", "Roughness", "Normal", "Displacement", "AO"])
        surface, output = material.node_tree.nodes[0], material.node_tree.nodes[1]
        for name in ("Base Color", "Roughness", "Normal"):
            self.assertEqual(surface.inputs[name].links[0].from_node, group)
        self.assertTrue(output.inputs["Displacement"].is_linked)
        self.assertEqual(material.displacement_method, "BOTH")
        size = material.shibo.tree.nodes["Size"].inputs["Scale"].default_value
        numpy.testing.assert_allclose(size, (1, 1, 1), rtol=1e-5)

    def test_images_have_the_right_form(self):
        images = {entry.name: entry.image for entry in self.add().shibo.images}
        self.assertEqual({name for name, image in images.items() if image.is_float}, {"normal", "height"})
        self.assertEqual({name: image.colorspace_settings.name for name, image in images.items() if name != "ao"},
                         {"base_color": "sRGB", "roughness": "Non-Color", "normal": "Non-Color", "height": "Non-Color"})
        for name, image in images.items():
            self.assertEqual(image.size, (32, 32))
            if name != "ao":
                self.assertGreater(image.values.reshape(-1, 4)[:, :3].std(), 0, name)

    def test_a_value_changes_the_same_images(self):
        material = self.add()
        before = {entry.name: (entry.image, entry.image.values.copy()) for entry in material.shibo.images}
        material["shibo_color"] = [0.1, 0.2, 0.6]
        bpy.ops.shibo.update(wait=True)
        changed = {name for name, (image, values) in before.items() if not numpy.array_equal(image.values, values)}
        self.assertEqual({entry.image for entry in material.shibo.images}, {image for image, _ in before.values()})
        self.assertEqual(changed, {"base_color"})

    def test_numbers_stay_numbers(self):
        folder = tempfile.mkdtemp()
        graph = os.path.join(folder, "flat.ron")
        with open(graph, "w", encoding="utf-8") as file:
            file.write('(version: 1, canvas: (size_mm: 10, resolution: 16), params: { "r": Number(default: 0.25, range: (0, 1)) }, nodes: {'
                       ' "m": Material(base_color: (0.5, 0.25, 0.1), roughness: "$r", anisotropy: 0.5, anisotropy_angle: 0,'
                       ' specular: 0.5, emission: (0, 2, 0)) }, outputs: { "m": "m" })')
        material = self.add(graph)
        nodes = material.shibo.tree.nodes
        self.assertEqual(len(material.shibo.images), 0)
        self.assertEqual(nodes["roughness"].outputs[0].default_value, 0.25)
        self.assertEqual(nodes["anisotropy_angle"].outputs[0].default_value, 0.25)
        self.assertEqual(nodes["specular"].outputs[0].default_value, 0.25)
        numpy.testing.assert_allclose(nodes["emission"].outputs[0].default_value, (0, 2, 0, 1))
        self.assertEqual(nodes["Emission Strength"].outputs[0].default_value, 1)
        self.assertTrue(material.node_tree.nodes[0].inputs["Tangent"].is_linked)
        material["shibo_r"] = 0.75
        bpy.ops.shibo.update(wait=True)
        self.assertEqual(nodes["roughness"].outputs[0].default_value, 0.75)

    def test_box_and_back(self):
        square(0.04, scale=2.0)
        material = self.add()
        numpy.testing.assert_allclose(material.shibo.density, (0.08, 0.08), rtol=1e-5)
        links = len(material.node_tree.links)
        bpy.ops.shibo.lay(by="BOX")
        tree = material.shibo.tree
        images = [node for node in tree.nodes if node.bl_idname == "ShaderNodeTexImage"]
        self.assertEqual(len(images), 15)
        self.assertEqual(tree.nodes["Metres"].inputs[1].default_value, (2, 2, 2))
        self.assertEqual(tree.nodes["Size X"].inputs[1].default_value, (25, 25, 1))
        bpy.ops.shibo.lay(by="UV")
        self.assertEqual(len([node for node in tree.nodes if node.bl_idname == "ShaderNodeTexImage"]), 5)
        self.assertEqual(len(material.node_tree.links), links)

    def test_wood_through_the_object(self):
        material = self.add("shibo:walnut")
        flat = material.shibo.images["base_color"].image.values.copy()
        bpy.ops.shibo.lay(by="CUT")
        self.assertFalse(numpy.array_equal(material.shibo.images["base_color"].image.values, flat))
        self.assertIsNone(material.shibo.tree.nodes.get("Size"))
        bpy.context.object.data.uv_layers.clear()
        with self.assertRaisesRegex(RuntimeError, "no UV map; add one"):
            bpy.ops.shibo.measure()

    def test_a_copy_gets_its_own(self):
        material = self.add()
        copy = material.copy()
        live.finish(copy)
        self.assertNotEqual(copy.shibo.tree, material.shibo.tree)
        self.assertFalse({entry.image for entry in copy.shibo.images} & {entry.image for entry in material.shibo.images})

    def test_a_linked_material_is_left_alone(self):
        material = self.add()
        material.library = object()
        self.assertFalse(bpy.ops.shibo.update.poll())
        updates = material.shibo.images["ao"].image.updates
        material["shibo_pitch"] = 3.0
        live.step(time.monotonic())
        self.assertEqual(material.shibo.images["ao"].image.updates, updates)
        material.library = None

    def test_saving_packs(self):
        material = self.add()
        for handler in bpy.app.handlers.save_pre:
            handler(None)
        self.assertTrue(all(entry.image.packed_file for entry in material.shibo.images))
        material["shibo_pitch"] = 3.0
        material.shibo.size = 64
        bpy.ops.shibo.update(wait=True)
        self.assertEqual(material.shibo.images["ao"].image.size, (64, 64))

    def test_remove_leaves_nothing(self):
        material = self.add()
        bpy.ops.shibo.remove()
        self.assertEqual([name for name in material.keys() if name.startswith("shibo_")], [])
        self.assertEqual([node.bl_idname for node in material.node_tree.nodes], ["ShaderNodeBsdfPrincipled", "ShaderNodeOutputMaterial"])
        self.assertFalse(live.keeper.running)

    def test_the_timer_follows_a_value_in_the_panel(self):
        bpy.app.background = False
        bpy.app.timers.register(live._timer)
        thing = square()
        bpy.ops.shibo.add(graph="shibo:starter", size=64)
        material = thing.data.materials[0]

        def run():
            end = time.monotonic() + 30
            while not live.work_of(material).is_finished(material) and time.monotonic() < end:
                time.sleep(bpy.app.timers.run())

        run()
        before = material.shibo.images["height"].image.values.copy()
        material["shibo_pitch"] = 3.0
        run()
        self.assertFalse(numpy.array_equal(material.shibo.images["height"].image.values, before))
        self.assertTrue(material.shibo.status.startswith("sharp at 64"), material.shibo.status)
        while bpy.app.timers.run() != live.IDLE:
            time.sleep(0.1)

    @unittest.skipIf(os.path.exists(os.path.join(EXTENSION, "shibo", "bin")), "this extension has its own program")
    def test_without_the_program_a_line_says_so(self):
        path, os.environ["PATH"] = os.environ["PATH"], ""
        try:
            square()
            with self.assertRaisesRegex(RuntimeError, "shibo is not in PATH; install it"):
                bpy.ops.shibo.add(graph="shibo:starter")
        finally:
            os.environ["PATH"] = path


class Parameters(unittest.TestCase):
    INFO = {"presets": {"dark": {"c": "#000000"}}, "params": [
        {"name": "n", "type": "Number", "value": 1, "range": [0, 4], "unit": "mm", "doc": "A length", "options": None},
        {"name": "c", "type": "Color", "value": "#ffffff", "range": None, "unit": None, "doc": None, "options": None},
        {"name": "i", "type": "Integer", "value": 3, "range": None, "unit": None, "doc": None, "options": None},
        {"name": "b", "type": "Bool", "value": True, "range": None, "unit": None, "doc": None, "options": None},
        {"name": "w", "type": "Choice", "value": "B", "range": None, "unit": None, "doc": None, "options": ["A", "B"]},
        {"name": "p", "type": "Path", "value": "a.png", "range": None, "unit": None, "doc": None, "options": None},
    ]}

    def test_types_and_descriptions(self):
        material = bpy.data_blocks.Image("x", None, 1, 1)
        given = params.ensure(material, self.INFO, "", {})
        self.assertEqual(material.keys(), [f"shibo_{name}" for name in "ncibwp"])
        self.assertEqual(material.id_properties_ui("shibo_n").as_dict()["description"], "A length (mm)")
        self.assertEqual(material.id_properties_ui("shibo_w").as_dict()["items"][1][:2], ("B", "B"))
        self.assertEqual(params.changed(material, self.INFO, ""), {})
        self.assertEqual(params.changed(material, self.INFO, "dark"), {"c": [1.0, 1.0, 1.0]})
        material["shibo_w"], material["shibo_b"], material["shibo_n"] = 0, 0, 2
        self.assertEqual(params.changed(material, self.INFO, ""), {"w": "A", "b": False, "n": 2})
        # Values that were changed by hand stay when the graph gives others; the rest follows.
        other = {**self.INFO, "params": [{**param, "value": 3} if param["name"] in "ni" else param for param in self.INFO["params"][:3]]}
        other["params"][2]["value"] = 7
        params.ensure(material, other, "", given)
        self.assertEqual({name: material[name] for name in material.keys()}, {"shibo_n": 2.0, "shibo_c": [1.0, 1.0, 1.0], "shibo_i": 7})

    def test_colours_are_linear(self):
        numpy.testing.assert_allclose(params.linear("#ff8000"), (1, 0.2158605, 0), atol=1e-6)
        self.assertIsNone(params.linear("red"))


class Meshes(unittest.TestCase):
    def test_pieces_lie_along_the_trunk(self):
        # Two boards: one along x, one along y.
        box = numpy.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
        points = numpy.r_[box * (400, 40, 20), box * (30, 300, 10) + 1000]
        faces = numpy.array([(0, 1, 3), (0, 3, 2), (4, 5, 7), (4, 7, 6), (0, 4, 1), (2, 6, 3)])
        corners = numpy.r_[faces, faces + 8]
        moved = meshes.scatter(points, corners, numpy.zeros(3), 1)
        sizes = [numpy.ptp(moved[at:at + 8], axis=0) for at in (0, 8)]
        numpy.testing.assert_allclose(sizes, [(40, 20, 400), (10, 30, 300)])
        # Boards are turned, not mirrored.
        volume = lambda all_: numpy.linalg.det(all_[[4, 2, 1]] - all_[0])
        self.assertGreater(volume(moved[:8]) * volume(points[:8]), 0)
        self.assertGreater(volume(moved[8:]) * volume(points[8:]), 0)

    def test_density_of_a_stretched_map(self):
        points = numpy.array([(0, 0, 0), (2, 0, 0), (2, 1, 0)], dtype=float)
        uvs = numpy.array([[(0, 0), (1, 0), (1, 1)]], dtype=float)
        self.assertEqual(meshes.density(points, numpy.array([(0, 1, 2)]), uvs, (1, 3, 1))[:2], (2, 3))
        self.assertIsNone(meshes.density(points, numpy.array([(0, 1, 2)]), uvs * 0, (1, 1, 1)))


class Manifest(unittest.TestCase):
    def test_schema(self):
        with open(os.path.join(EXTENSION, "shibo", "blender_manifest.toml"), encoding="utf-8") as file:
            text = file.read()
        fields = dict(re.findall(r'^(\w+) = (.*)$', text, re.M))
        self.assertEqual(fields["schema_version"], '"1.0.0"')
        self.assertEqual((fields["id"], fields["type"]), ('"shibo"', '"add-on"'))
        for name in ("schema_version", "id", "version", "name", "tagline", "maintainer", "type", "blender_version_min", "license"):
            self.assertIn(name, fields)
        for name in ("tagline", "files"):
            line = fields[name].strip('"')
            self.assertLessEqual(len(line), 64)
            self.assertNotRegex(line[-1], r"[.,:;!?]")
        self.assertRegex(fields["version"], r'^"\d+\.\d+\.\d+"$')
        self.assertTrue(all(name.startswith('"SPDX:') for name in fields["license"].strip("[]").split(", ")))


if __name__ == "__main__":
    unittest.main()
