"""Tests of what Cycles renders: sizes, ways to lay pictures, and a material that was made by hand."""
import os

import bpy
import numpy

from __main__ import Case
from scene import STRIPES, camera, fresh, image, load, picture, plane, rendered_by_command, settings, text

LEATHER = """(version: 1, canvas: (size_mm: 40, resolution: 256, tile: Both, seed: 1),
  nodes: {
    "h": Fractal(size: 6, octaves: 3), "height": "= 0.4 * h", "n": HeightToNormal(input: "height"),
    "c": "= mix((0.5, 0.2, 0.1), (0.1, 0.3, 0.5), h)",
    "m": Material(base_color: "c", roughness: "= 0.3 + 0.3 * h", normal: "n", metallic: 0.2, anisotropy: 0.7,
      anisotropy_angle: "= 90 * h", specular: 0.6, coat: 0.3, sheen: 0.1),
  },
  outputs: { "material": "m" })
"""


def stripes(pixels):
    """The number of periods across the picture, by the strongest frequency and its neighbours."""
    row = pixels[:, :, 1].mean(axis=0)
    row = (row - row.mean()) * numpy.hanning(len(row))
    power = numpy.abs(numpy.fft.rfft(row, 16 * len(row)))
    return numpy.argmax(power[16:]) / 16 + 1


class Cycles(Case):
    def test_stripes_have_their_width(self):
        graph = text("width.ron", STRIPES)
        for by, scale in (("UV", 1.0), ("UV", 1.7), ("BOX", 1.0), ("BOX", 1.7)):
            with self.subTest(by=by, scale=scale):
                fresh()
                settings()
                camera(0.1, (0, 0))
                thing = plane(0.2)
                thing.scale = (scale, scale, scale)
                bpy.context.view_layer.update()
                self.add(graph, thing=thing)
                bpy.ops.shibo.lay(by=by)
                # 100 mm with a period of 10 mm.
                self.assertAlmostEqual(stripes(picture()), 10, delta=0.1)

    def test_by_hand(self):
        graph = text("hand.ron", LEATHER)
        folder = rendered_by_command(graph, size=128)

        def ours():
            material = self.add(graph, size=128, thing=plane(0.04))
            self.assertIn("Tangent", material.shibo.tree.interface.items_tree)

        def hand(turned=False, tangent=True, by=1.0):
            material = bpy.data.materials.new("hand")
            if bpy.app.version < (5, 0, 0):
                material.use_nodes = True
            nodes, links = material.node_tree.nodes, material.node_tree.links
            surface, place = nodes["Principled BSDF"], nodes.new("ShaderNodeMapping")
            links.new(nodes.new("ShaderNodeTexCoord").outputs["UV"], place.inputs["Vector"])
            place.inputs["Scale"].default_value = (by, by, 1)

            def channel(name, space="Non-Color"):
                node = nodes.new("ShaderNodeTexImage")
                ending = next(end for end in ("png", "exr") if os.path.exists(f"{folder}/material_{name}.{end}"))
                node.image = load(f"{folder}/material_{name}.{ending}", space)
                links.new(place.outputs["Vector"], node.inputs["Vector"])
                return node.outputs["Color"]

            links.new(channel("base_color", "sRGB"), surface.inputs["Base Color"])
            links.new(channel("roughness"), surface.inputs["Roughness"])
            normal = nodes.new("ShaderNodeNormalMap")
            normal.inputs["Strength"].default_value = -1.0 if turned else 1.0
            links.new(channel("normal"), normal.inputs["Color"])
            links.new(normal.outputs["Normal"], surface.inputs["Normal"])
            turn = nodes.new("ShaderNodeMath")
            turn.operation = "MULTIPLY_ADD"
            turn.inputs[1].default_value, turn.inputs[2].default_value = -1 / 360, 0.25
            links.new(channel("anisotropy_angle"), turn.inputs[0])
            links.new(turn.outputs[0], surface.inputs["Anisotropic Rotation"])
            if tangent:
                along = nodes.new("ShaderNodeTangent")
                along.direction_type = "UV_MAP"
                links.new(along.outputs[0], surface.inputs["Tangent"])
            numbers = {"Metallic": 0.2, "Anisotropic": 0.7, "Specular IOR Level": 0.3, "Coat Weight": 0.3, "Sheen Weight": 0.1}
            for socket, value in numbers.items():
                surface.inputs[socket].default_value = value
            plane(0.04).data.materials.append(material)

        def seen(make):
            fresh()
            settings(16)
            camera(0.04, (0, 0))
            make()
            return picture()

        reference = seen(hand)
        distance = {
            "ours": seen(ours),
            "turned": seen(lambda: hand(turned=True)),
            "no tangent": seen(lambda: hand(tangent=False)),
            "half": seen(lambda: hand(by=0.5)),
        }
        distance = {name: float(numpy.abs(other - reference).mean()) * 255 for name, other in distance.items()}
        print("of 255 from a material made by hand:", {name: round(value, 3) for name, value in distance.items()})
        self.assertLessEqual(distance["ours"], 1.0)
        self.assertLess(distance["ours"], min(value for name, value in distance.items() if name != "ours") / 3)

    def test_box_equals_uv_on_a_plane(self):
        graph = text("box.ron", LEATHER)

        def seen(by, turned=0.0):
            fresh()
            settings(16)
            thing = plane(0.04)
            thing.rotation_euler[2] = turned
            camera(0.03, (0, 0))
            bpy.context.view_layer.update()
            self.add(graph, thing=thing)
            bpy.ops.shibo.lay(by=by)
            return picture()

        pictures = {by: [seen(by, turned) for turned in (0.0, numpy.pi / 2)] for by in ("UV", "BOX")}
        for at in range(2):
            self.assertLess(numpy.abs(pictures["UV"][at] - pictures["BOX"][at]).mean() * 255, 1.0)
        # The light comes from elsewhere for a turned plane, so normals count.
        self.assertGreater(numpy.abs(numpy.rot90(pictures["BOX"][0]) - pictures["BOX"][1]).mean() * 255, 3.0)

    def test_wood_runs_through_the_object(self):
        bpy.ops.mesh.primitive_cube_add(size=0.1)
        thing = bpy.context.object
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.uv.smart_project(island_margin=0.05)
        bpy.ops.object.mode_set(mode="OBJECT")
        material = self.add("shibo:walnut", size=512, thing=thing)
        material.shibo.move = (0, 0, 0)
        self.assertEqual(bpy.ops.shibo.lay(by="CUT"), {"FINISHED"})
        wood, mesh = image(material, "base_color"), thing.data
        uvs = numpy.array([loop.vector for loop in mesh.uv_layers[0].uv])
        edges = {}
        for face in mesh.polygons:
            loops = list(face.loop_indices)
            middle = uvs[loops].mean(axis=0)
            for a, b in zip(loops, loops[1:] + loops[:1]):
                # A little inside of the face.
                ends = [(mesh.loops[loop].vertex_index, uvs[loop] + 0.012 * (middle - uvs[loop])) for loop in (a, b)]
                ends.sort(key=lambda end: end[0])
                edges.setdefault((ends[0][0], ends[1][0]), []).append((ends[0][1], ends[1][1]))

        def along(ends):
            steps = numpy.linspace(0.1, 0.9, 40)[:, None]
            places = ((ends[0] + steps * (ends[1] - ends[0])) * 512).astype(int)
            return wood[places[:, 1], places[:, 0], :3]

        same = numpy.mean([numpy.abs(along(one) - along(other)).mean() for one, other in edges.values()])
        lines = [along(sides[0]) for sides in edges.values()]
        others = numpy.mean([numpy.abs(a - b).mean() for a in lines for b in lines if a is not b])
        print(f"colours on both sides of an edge differ by {same * 255:.1f} of 255, those of two edges by {others * 255:.1f}")
        self.assertLess(same, 0.7 * others)
        # A tree of the user.
        before = wood.copy()
        tree = bpy.data.objects.new("tree", None)
        tree.location = (0.3, 0, 0)
        bpy.context.scene.collection.objects.link(tree)
        bpy.context.view_layer.update()
        material.shibo.place = tree
        self.assertEqual(bpy.ops.shibo.update(wait=True), {"FINISHED"})
        self.assertGreater(numpy.abs(image(material, "base_color") - before).max(), 0.05)
        placed = image(material, "base_color").copy()
        material.shibo.place = None
        material.shibo.move = (-300, 0, 0)
        self.assertEqual(bpy.ops.shibo.update(wait=True), {"FINISHED"})
        self.assertLess(numpy.abs(image(material, "base_color") - placed).max(), 1 / 255)

    def test_unfit_uvs_are_refused(self):
        thing = plane()
        material = self.add("shibo:walnut", size=64, thing=thing)
        thing.data.uv_layers.remove(thing.data.uv_layers[0])
        thing.data.update_tag()
        with self.assertRaisesRegex(RuntimeError, "no UV map; add one"):
            bpy.ops.shibo.lay(by="UV")
        with self.assertRaisesRegex(RuntimeError, "no UV map; add one"):
            bpy.ops.shibo.lay(by="CUT")
        bpy.ops.mesh.primitive_cube_add(size=0.1)
        cube = bpy.context.object
        cube.data.materials.append(material)
        for at, loop in enumerate(cube.data.uv_layers[0].uv):
            loop.vector = ((0, 0), (1, 0), (1, 1), (0, 1))[at % 4]
        with self.assertRaisesRegex(RuntimeError, "overlap in the UV map"):
            bpy.ops.shibo.lay(by="CUT")
