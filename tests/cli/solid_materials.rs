//! Materials in space: a material of solids is cut with all its channels, placed, warped, blended and mirrored.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::{Desk, number};

/// A tree and the parts of its wood.
const TREE: &str = r##"
    "pith": TrunkNodes(height: (-600, 600), count: 7, wander: 9),
    "trunk": FitSkeleton(curve: "pith"),
    "time": TrunkTime(tree: "trunk"),
    "rings": RingColor(time: "time", pattern: ColorPattern()),
    "fiber": FiberSpace(time: "time", tree: "trunk", curl: 0.4, curl_length: 9),
    "light": FiberShading(color: "rings", direction: "fiber.direction"),
    "knots": SolidNoise(size: 6),
    "wood": Material(
      base_color: "= 0.8 * rings", roughness: "= 0.6 - 0.1 * rings.late", height: "= 0.05 * rings.late",
      anisotropy: "light.anisotropy", anisotropy_angle: "light.angle",
    ),
"##;

fn desk(nodes: &str) -> Desk {
    let desk = Desk::new();
    let canvas = "canvas: (size_mm: (40, 24), resolution: 40, tile: None, seed: 3)";
    desk.write("main.ron", format!("(version: 1, {canvas}, nodes: {{\n{TREE}\n{nodes}\n}})"));
    desk
}

/// The values that `dump` prints for a node.
#[track_caller]
fn values(desk: &Desk, node: &str) -> Vec<f64> {
    let json = desk.run(["dump", "main.ron", node]).expect(0).json();
    json["values"].as_array().unwrap_or_else(|| panic!("{json}")).iter().map(number).collect()
}

/// Fails unless the nodes of each pair have the same values, which are not all equal.
#[track_caller]
fn same(desk: &Desk, pairs: &[(&str, &str)]) {
    for (one, other) in pairs {
        let (a, b) = (values(desk, one), values(desk, other));
        assert_eq!(a.len(), b.len(), "{one} {other}");
        let apart = a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(apart <= 1e-4, "{one} and {other} differ by {apart}");
        assert!(a.iter().any(|value| *value != a[0]), "{one} is constant");
    }
}

#[test]
fn cuts_show_all_channels() {
    let desk = desk(
        r##"
        "flat": CutPlane(solid: "wood", preset: FlatSawn, distance: 30),
        "color": "= flat.base_color",
        "color_alone": CutPlane(solid: "= 0.8 * rings", preset: FlatSawn, distance: 30),
        "late": CutPlane(solid: "rings.late", preset: FlatSawn, distance: 30),
        "rough": "= flat.roughness",
        "rough_alone": "= 0.6 - 0.1 * late",
        "height": "= flat.height",
        "height_alone": "= 0.05 * late",
        "normal": "= flat.normal",
        "normal_alone": "= normal_node",
        "normal_node": HeightToNormal(input: "height_alone"),
        "angle": "= flat.anisotropy_angle",
        "angle_alone": CutPlane(solid: "light.angle", preset: FlatSawn, distance: 30),
        "turned": Material(from: "wood", normal: "light.normal"),
        "flat_turned": CutPlane(solid: "turned", preset: FlatSawn, distance: 30),
        "both_normals": "= flat_turned.normal",
        "both_alone": "= both_node",
        "tilt": CutPlane(solid: "light.normal", preset: FlatSawn, distance: 30),
        "both_node": BlendNormals(base: "normal_node", detail: "tilt"),
        "round": CutSurface(solid: "wood", shape: Cylinder, radius: 6),
        "round_color": "= round.base_color",
        "round_alone": CutSurface(solid: "= 0.8 * rings", shape: Cylinder, radius: 6),
        "board": Board(solid: "wood", size: (40, 24, 5), middle: (0, 30, 0)),
        "side": "= board.side.base_color",
        "board_alone": Board(solid: "= 0.8 * rings", size: (40, 24, 5), middle: (0, 30, 0)),
        "side_alone": "= board_alone.side",
        "placed": WarpSolid(solid: PlaceInTree(solid: "wood", position: (0, 25, 10), turn: (20, 0, 0)), amount: 1),
        "placed_cut": CutPlane(solid: "placed"),
        "placed_height": "= placed_cut.height",
        "placed_one": PlaceInTree(solid: "= 0.05 * rings.late", position: (0, 25, 10), turn: (20, 0, 0)),
        "placed_alone": CutPlane(solid: WarpSolid(solid: "placed_one", amount: 1)),
        "atlas": MeshAtlas(mesh: MeshShape(shape: Sphere, radius: 5)),
        "baked": BakeSolid(atlas: "atlas", solid: "wood"),
        "baked_color": "= baked.base_color",
        "baked_alone": BakeSolid(atlas: "atlas", solid: "= 0.8 * rings"),
        "baked_normal": "= baked.normal",
        "baked_height": BakeSolid(atlas: "atlas", solid: "= 0.05 * rings.late"),
        "baked_normal_node": HeightToNormal(input: "baked_height", atlas: "atlas"),
        "baked_normal_alone": "= baked_normal_node",
        "pieces": Brick(size: (9, 5), gap: 0.5),
        "boards": CutPlane(solid: "wood", others: ["stone"], preset: FlatSawn, distance: 30, local: "pieces.local",
          ids: "pieces.ids", angle: "pieces.angle", spread: (5, 5, 200)),
        "stone": Material(base_color: "knots", height: "= 0.2 * knots", coat: 0.5),
        "boards_height": "= boards.height",
        "boards_alone": CutPlane(solid: "= 0.05 * rings.late", others: ["= 0.2 * knots"], preset: FlatSawn,
          distance: 30, local: "pieces.local", ids: "pieces.ids", angle: "pieces.angle", spread: (5, 5, 200)),
        "boards_coat": "= boards.coat",
        "boards_tree": "= 0.5 * boards.tree",
        "##,
    );
    same(
        &desk,
        &[
            ("color", "color_alone"),
            ("rough", "rough_alone"),
            ("height", "height_alone"),
            ("normal", "normal_alone"),
            ("angle", "angle_alone"),
            ("both_normals", "both_alone"),
            ("round_color", "round_alone"),
            ("side", "side_alone"),
            ("placed_height", "placed_alone"),
            ("baked_color", "baked_alone"),
            ("baked_normal", "baked_normal_alone"),
            ("boards_height", "boards_alone"),
            ("boards_coat", "boards_tree"),
        ],
    );
}

#[test]
fn blends_in_space_equal_blends_of_cuts() {
    let desk = desk(
        r##"
        "paint": Material(base_color: "#2040c0", roughness: 0.2, coat: 1),
        "where": "= smoothstep(0.4, 0.6, knots)",
        "painted": BlendMaterials(base: "wood", top: "paint", mask: "where", opacity: 0.9),
        "painted_cut": CutPlane(solid: "painted", preset: FlatSawn, distance: 30),
        "cut": CutPlane(solid: "wood", preset: FlatSawn, distance: 30),
        "where_cut": CutPlane(solid: "where", preset: FlatSawn, distance: 30),
        "cut_painted": BlendMaterials(base: "cut", top: "paint", mask: "where_cut", opacity: 0.9),
        "stone": Material(base_color: "#808080", height: "= 0.1 * knots"),
        "higher": LayerMaterials(layers: [(material: "wood"), (material: "stone", by: Height), (material: "paint", mask: "where")]),
        "higher_cut": CutPlane(solid: "higher", preset: FlatSawn, distance: 30),
        "stone_cut": CutPlane(solid: "stone", preset: FlatSawn, distance: 30),
        "cut_higher": LayerMaterials(layers: [
          (material: "cut"), (material: "stone_cut", by: Height), (material: "paint", mask: "where_cut"),
        ]),
        "a1": "= painted_cut.base_color", "a2": "= cut_painted.base_color",
        "b1": "= painted_cut.coat", "b2": "= cut_painted.coat",
        "c1": "= higher_cut.base_color", "c2": "= cut_higher.base_color",
        "d1": "= higher_cut.height", "d2": "= cut_higher.height",
        "e1": CutPlane(solid: "painted.weight", preset: FlatSawn, distance: 30), "e2": "= 0.9 * where_cut",
        "f1": "= chosen.coat", "f2": "= painted_cut.coat",
        "g1": "= adjusted_cut.base_color", "g2": "= cut_adjusted.base_color",
        "adjusted_cut": CutPlane(solid: AdjustMaterial(material: "wood", hue: 30, tint: "#ffe0a0"), preset: FlatSawn,
          distance: 30),
        "cut_adjusted": AdjustMaterial(material: "cut", hue: 30, tint: "#ffe0a0"),
        "chosen": CutPlane(solid: SwitchMaterial(inputs: ["wood", "painted"], which: 1), preset: FlatSawn, distance: 30),
        "##,
    );
    same(&desk, &[("a1", "a2"), ("b1", "b2"), ("c1", "c2"), ("d1", "d2"), ("e1", "e2"), ("f1", "f2"), ("g1", "g2")]);
}

#[test]
fn changed_solids_equal_changed_cuts() {
    let nodes = |at: &str, wood: &str, knots: &str, late: &str| {
        format!(
            r##"
            "{at}_grey": Hsv(input: "{wood}", hue: 40, saturation: "{knots}", value: 0.9),
            "{at}_levels": Levels(input: "{at}_grey", high: 0.6, gamma: 1.3),
            "{at}_steps": Quantize(input: "{knots}", levels: 5, softness: 0.4),
            "{at}_low": Remap(input: Invert(input: "{at}_steps"), to: (0.2, 0.7)),
            "{at}_curve": Curve(input: "{at}_low", points: [(0, 0.1), (1, 0.8)]),
            "{at}_edge": Threshold(input: "{knots}", softness: 0.3),
            "{at}_ramp": GradientMap(input: "{at}_curve"),
            "{at}_blend": Blend(base: "{at}_levels", top: "{at}_ramp", mask: "{at}_edge", mode: Multiply),
            "{at}_new": ReplaceColor(input: "{at}_blend", from: "#806040", tolerance: 0.2, softness: 0.3),
            "{at}_space": ConvertColor(input: "{at}_new"),
            "{at}_switch": Switch(inputs: ["{at}_space", "{late}"], by: "{at}_edge"),
            "{at}_height": HeightBlend(base: "{late}", top: "{knots}", mask: "{at}_edge"),
            "##
        )
    };
    let cut =
        |name: &str, of: &str| format!("\"{name}\": CutPlane(solid: \"{of}\", preset: FlatSawn, distance: 30),\n");
    let cuts = [("wood_cut", "rings"), ("knots_cut", "knots"), ("late_cut", "rings.late")].map(|(a, b)| cut(a, b));
    let ends =
        [("a1", "a_switch"), ("b1", "a_height"), ("c1", "a_blend"), ("d1", "a_height.weight"), ("e1", "a_new.mask")];
    let desk = desk(
        &[
            nodes("a", "rings", "knots", "rings.late"),
            cuts.concat(),
            nodes("b", "wood_cut", "knots_cut", "late_cut"),
            ends.map(|(name, of)| cut(name, of)).concat(),
            r#""d2": "= b_height.weight", "e2": "= b_new.mask","#.to_owned(),
        ]
        .concat(),
    );
    same(&desk, &[("a1", "b_switch"), ("b1", "b_height"), ("c1", "b_blend"), ("d1", "d2"), ("e1", "e2")]);
}

#[test]
fn materials_of_constants_go_with_solids() {
    let desk = desk(
        r##"
        "red": Material(base_color: "#c02020", roughness: 0.2, height: 0.3),
        "blue": Material(base_color: "#2020c0", coat: 1, height: 0.1),
        "violet": BlendMaterials(base: "red", top: "blue", mask: 0.25),
        "higher": LayerMaterials(layers: [(material: "violet"), (material: "blue", by: Height)]),
        "where": "= smoothstep(0.4, 0.6, knots)",
        "painted": BlendMaterials(base: "wood", top: "higher", mask: "where"),
        "cut": CutPlane(solid: "painted", preset: FlatSawn, distance: 30),
        "shown": "= cut.base_color",
        "wood_cut": CutPlane(solid: "wood", preset: FlatSawn, distance: 30),
        "where_cut": CutPlane(solid: "where", preset: FlatSawn, distance: 30),
        "by_hand": BlendMaterials(base: "wood_cut", top: "higher", mask: "where_cut"),
        "expected": "= by_hand.base_color",
        "##,
    );
    same(&desk, &[("shown", "expected")]);
}

#[test]
fn exports_cut_materials_in_space_along_their_mesh() {
    let mesh = r#""atlas": MeshAtlas(mesh: MeshShape(shape: Cube, size: (20, 20, 20))), "baked": BakeSolid(atlas: "atlas", solid: "wood"),"#;
    let desk = desk(mesh);
    let graph = String::from_utf8(desk.read("main.ron")).unwrap();
    for (name, material) in [("one", "wood"), ("other", "baked")] {
        let outputs = format!("outputs: {{ \"it\": Obj(material: \"{material}\", mesh: \"atlas\") }}");
        let end = graph.rfind("\n})").unwrap();
        desk.write(&format!("{name}.ron"), format!("{}\n}}, {outputs})", &graph[..end]));
        desk.run(["render", &format!("{name}.ron"), "-o", name]).expect(0);
    }
    for file in ["it_base_color.png", "it_normal.png", "it_roughness.png"] {
        let [one, other] = ["one", "other"].map(|folder| std::fs::read(desk.path(format!("{folder}/{file}"))).unwrap());
        assert!(one == other, "{file}");
    }
    let outputs = r#"outputs: { "it": Obj(material: "wood") }"#;
    let end = graph.rfind("\n})").unwrap();
    desk.write("plane.ron", format!("{}\n}}, {outputs})", &graph[..end]));
    let shown = desk.run(["check", "plane.ron"]).expect(1).stderr;
    assert!(shown.contains("`Obj` takes a material; `wood` is SolidMaterial"), "{shown}");
    assert!(shown.contains("`CutPlane`, `CutSurface` or `Board`, or give the mesh as an atlas"), "{shown}");
}

#[test]
fn mirrored_cuts_meet_at_their_borders() {
    // The mirror image of the plane, and pieces of which every second one is turned over like the page of a book.
    let desk = desk(
        r##"
        "cut": CutPlane(solid: "wood", preset: FlatSawn, distance: 30, offset: 8),
        "over": CutPlane(solid: "wood", preset: FlatSawn, distance: 30, offset: 8, mirror: (1, 0)),
        "back": TransformMaterial(material: "over", mirror: (true, false)),
        "a1": "= cut.base_color", "a2": "= back.base_color",
        "b1": "= cos(2 * cut.anisotropy_angle)", "b2": "= cos(2 * back.anisotropy_angle)",
        "c1": "= cut.height", "c2": "= back.height",
        "leaves": Brick(layout: Stack, size: (10, 24), gap: 0, bevel: 0),
        "in_leaf": "= (y - 12, x - 10 * floor(x / 10) - 5)",
        "book": CutPlane(solid: "wood", local: "in_leaf", ids: "leaves.ids", angle: 90, preset: FlatSawn, distance: 30,
          offset: 8, mirror: "= (0, floor(x / 10) % 2)"),
        "d1": "= book.base_color.r",
        "e1": "= sin(2 * book.anisotropy_angle)",
        "##,
    );
    same(&desk, &[("a1", "a2"), ("b1", "b2"), ("c1", "c2")]);
    for (node, sign) in [("d1", 1.0), ("e1", -1.0)] {
        let rows = values(&desk, node);
        for row in rows.chunks(40) {
            for leaf in 0..3 {
                for k in 0..10 {
                    let (left, right) = (row[10 * leaf + k], row[10 * leaf + 19 - k]);
                    assert!((left - sign * right).abs() < 1e-4, "{node}, leaf {leaf}, pixel {k}: {left} {right}");
                }
            }
        }
        assert!(rows.iter().any(|value| value.abs() > 1e-3), "{node}");
    }
}

#[test]
fn values_on_the_canvas_and_in_space_are_told_apart() {
    let errors = |node: &str| {
        let desk = desk(&format!("\"noise\": Perlin(size: 4),\n\"field_wood\": Material(height: \"noise\"),\n{node}"));
        desk.run(["check", "main.ron"]).expect(1).stderr
    };
    let shown = errors(r##""bad": Material(base_color: "rings", roughness: "noise"),"##);
    for part in
        ["`roughness` is a field (Gray), but `base_color` is in space", "\"noise\"", "CutPlane(solid: \"rings\")"]
    {
        assert!(shown.contains(part), "{part} in {shown}");
    }
    let shown = errors(r##""bad": BlendMaterials(base: "wood", top: "field_wood"),"##);
    assert!(shown.contains("`top` is a material on the canvas, but `base` is in space"), "{shown}");
    let shown = errors(r##""bad": BlendMaterials(base: "wood", top: "wood", mask: "noise"),"##);
    assert!(shown.contains("`mask` is a field (Gray), but `base` is in space"), "{shown}");
    let shown = errors(r##""bad": Relief(material: "wood"),"##);
    assert!(shown.contains("`material` takes Material; \"wood\" is SolidMaterial"), "{shown}");
    assert!(
        shown.contains("cut it with `CutPlane`, `CutSurface` or `Board`: write `CutPlane(solid: \"wood\")`"),
        "{shown}"
    );
    let shown = errors(r##""bad": Hsv(input: "rings", saturation: "noise"),"##);
    assert!(shown.contains("`saturation` is a field (Gray), but `input` is in space"), "{shown}");
    let shown = errors(r##""bad": Switch(inputs: ["knots", "noise"]),"##);
    assert!(shown.contains("`inputs` is a field (Gray), but `inputs` is in space"), "{shown}");
    // Errors of evaluation.
    let desk = desk(r##""x": CutPlane(solid: "wood", preset: FlatSawn, mirror: "= (u, 0)"), "y": "= x.height","##);
    let shown = desk.run(["dump", "main.ron", "y"]).expect(1).stderr;
    assert!(shown.contains("`mirror` differs from place to place"), "{shown}");
}
