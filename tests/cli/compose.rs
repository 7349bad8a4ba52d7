//! Graphs within graphs, end to end: instances, material inputs, the library, and values that reach into instances.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::{Desk, number};
use serde_json::Value as Json;

/// A sub-graph of random nodes, a number, a material and points.
const PART: &str = r##"(
  version: 1,
  canvas: (size_mm: 16, resolution: 16, tile: Both, seed: 1),
  inputs: { "mask": Gray(default: 0.25) },
  params: {
    "gap": Number(default: 1, range: (0, 9), doc: "A number to look at"),
    "size": Number(default: 4, range: (1, 8), unit: "mm", doc: "Size of the bumps"),
  },
  presets: { "wide": { "gap": 2, "size": 8 }, "fine": { "size": 2 } },
  nodes: {
    "bumps": Perlin(size: "$size"),
    "scattered": PoissonPoints(pitch: 2),
    "dots": Dots(points: "scattered", diameter: 2),
    "number": "= $gap",
    "normal": HeightToNormal(input: "bumps"),
    "surface": Material(base_color: "#806040", height: "bumps", normal: "normal"),
    "given": "= mask",
  },
  outputs: { "bumps": "bumps", "dots": "dots", "number": "number", "material": "surface", "points": "scattered", "given": "given" },
)"##;

fn desk(canvas: &str, nodes: &str, outputs: &str) -> Desk {
    let desk = Desk::new();
    desk.write("part.ron", PART.replace("\"points\": \"scattered\",", ""));
    desk.write("points.ron", PART);
    main(&desk, "main.ron", canvas, nodes, outputs);
    desk
}

fn main(desk: &Desk, name: &str, canvas: &str, nodes: &str, outputs: &str) {
    desk.write(
        name,
        format!(
            "(version: 1, canvas: (size_mm: 16, resolution: 16, {canvas}),\n\
             imports: {{ \"part\": \"part\", \"points\": \"points.ron\" }},\nparams: {{ \"n\": Integer(default: 7, doc: \"x\") }},\n\
             nodes: {{\n{nodes}\n}},\noutputs: {{ {outputs} }})"
        ),
    );
}

/// The values that `dump` prints for a node.
#[track_caller]
fn values(desk: &Desk, node: &str, args: &[&str]) -> Vec<f64> {
    let mut line = vec!["dump", "main.ron", node];
    line.extend(args);
    let json = desk.run(line).expect(0).json();
    json["values"].as_array().unwrap_or_else(|| panic!("{json}")).iter().map(number).collect()
}

/// The first error or warning: line, message and help.
#[track_caller]
fn first(desk: &Desk, list: &str) -> (u64, String, String) {
    let json = desk.shibo("check main.ron --format json").json();
    let one = json[list].as_array().and_then(|list| list.first()).unwrap_or_else(|| panic!("{json}")).clone();
    let text = |key: &str| one[key].as_str().unwrap_or_default().to_owned();
    (one["line"].as_u64().unwrap(), text("message"), text("help"))
}

#[test]
fn a_seed_makes_another_instance() {
    let nodes = r#""a": Use(graph: "part"), "b": Use(graph: "part"), "five": Use(graph: "part", seed: 5),
        "again": Use(graph: "part", seed: 5), "six": Use(graph: "part", seed: 6), "seven": Use(graph: "part", seed: "$n"),
        "plain": Perlin(size: 4), "big": Use(graph: "part", seed: 18446744073709551615)"#;
    let desk = desk("tile: Both, seed: 1", nodes, "");
    for output in ["bumps", "dots"] {
        let of = |instance: &str| values(&desk, &format!("{instance}.{output}"), &[]);
        assert_eq!(of("a"), of("b"), "{output}");
        assert_eq!(of("five"), of("again"), "{output}");
        let different = ["a", "five", "six", "seven", "big"].map(of);
        for (i, one) in different.iter().enumerate() {
            assert!(different[..i].iter().all(|other| other != one), "{output} {i}");
        }
    }
    // Without a seed the nodes of an instance equal those outside.
    assert_eq!(values(&desk, "a.bumps", &[]), values(&desk, "plain", &[]));
    // The seed of the canvas changes all instances.
    let before = values(&desk, "five.bumps", &[]);
    main(&desk, "main.ron", "tile: Both, seed: 2", nodes, "");
    assert_ne!(values(&desk, "five.bumps", &[]), before);
    main(
        &desk,
        "main.ron",
        "tile: Both",
        r#""a": Use(graph: "part",
        seed: 1.5)"#,
        "",
    );
    let (line, message, _) = first(&desk, "errors");
    assert!(line == 6 && message.contains("`seed` must be a whole number"), "{line}: {message}");
}

#[test]
fn instances_inside_of_instances_have_seeds_of_their_own() {
    let desk = desk("tile: Both, seed: 1", r#""x": Use(graph: "part", seed: 1), "y": Use(graph: "part", seed: 2)"#, "");
    desk.write(
        "outer.ron",
        r#"(version: 1, imports: { "part": "part.ron" }, nodes: { "inner": Use(graph: "part", seed: 1) }, outputs: { "bumps": "inner.bumps" })"#,
    );
    desk.write(
        "main.ron",
        r#"(version: 1, canvas: (size_mm: 16, resolution: 16, seed: 1), imports: { "outer": "outer", "part": "part" }, nodes: {
          "a": Use(graph: "outer"), "b": Use(graph: "outer", seed: 3), "c": Use(graph: "outer", seed: 4), "d": Use(graph: "part", seed: 1) })"#,
    );
    let of = |name: &str| values(&desk, &format!("{name}.bumps"), &[]);
    assert_eq!(of("a"), of("d"), "without a seed the outer one changes nothing");
    assert!(of("a") != of("b") && of("b") != of("c"));
}

#[test]
fn ranks_set_over_with_over_preset() {
    let nodes = r#""a": Use(graph: "part"), "p": Use(graph: "part", preset: "wide"), "w": Use(graph: "part", preset: "wide", with: { "gap": 3 }),
        "both": Use(graph: "part", preset: "wide+fine"), "plain": Perlin(size: 2)"#;
    let desk = desk("tile: Both, seed: 1", nodes, "");
    let gap = |instance: &str, args: &[&str]| values(&desk, &format!("{instance}.number"), args)[0];
    assert_eq!([gap("a", &[]), gap("p", &[]), gap("w", &[]), gap("both", &[])], [1.0, 2.0, 3.0, 2.0]);
    // Of two presets the second one wins.
    assert_eq!(values(&desk, "both.bumps", &[]), values(&desk, "plain", &[]));
    assert_eq!(gap("w", &["--set", "w.gap=4"]), 4.0);
    assert_eq!(gap("w", &["--set", "w/gap=5"]), 5.0);
    assert_eq!(gap("p", &["--set", "w/gap=5"]), 2.0);
    let wrong = |set: &str| desk.run(["check", "main.ron", "--set", set]).expect(1).stderr;
    assert!(wrong("w.gop=1").contains("did you mean `gap`?"), "{}", wrong("w.gop=1"));
    assert!(wrong("v.gap=1").contains("no sub-graph `v`"), "{}", wrong("v.gap=1"));
    assert!(wrong("w.mask=1").contains("give it in `with`"), "{}", wrong("w.mask=1"));
    assert!(wrong("w.gap=10").contains("between 0 and 9"), "{}", wrong("w.gap=10"));
    main(&desk, "main.ron", "tile: Both", "\"a\": Use(graph: \"part\",\n preset: \"wild\")", "");
    let (line, message, help) = first(&desk, "errors");
    assert!(
        line == 6 && message.contains("`part` has no preset `wild`") && help.contains("`wide`"),
        "{message}; {help}"
    );
}

#[test]
fn set_reaches_into_nested_instances() {
    let desk = desk("tile: Both", "", "");
    desk.write(
        "outer.ron",
        r#"(version: 1, imports: { "part": "part.ron" }, nodes: { "inner": Use(graph: "part") }, outputs: { "number": "inner.number" })"#,
    );
    desk.write(
        "main.ron",
        r#"(version: 1, canvas: (size_mm: 16, resolution: 4), imports: { "outer": "outer.ron" }, nodes: { "a": Use(graph: "outer"), "b": Use(graph: "outer") })"#,
    );
    for set in ["a.inner.gap=6", "a/inner/gap=6"] {
        assert_eq!(values(&desk, "a.number", &["--set", set])[0], 6.0);
        assert_eq!(values(&desk, "b.number", &["--set", set])[0], 1.0);
        assert_eq!(values(&desk, "a/inner/number", &["--set", set])[0], 6.0);
        assert_eq!(values(&desk, "a.inner.number", &["--set", set])[0], 6.0);
    }
}

#[test]
fn an_instance_is_laid_out_as_transform_does() {
    let nodes = r#""a": Use(graph: "part", canvas: (angle: 90, scale: 0.5, offset: (3, 1))), "b": Use(graph: "part"),
        "moved": Transform(input: "b.bumps", angle: 90, scale: 0.5, offset: (3, 1)),
        "n": "= a.material.normal", "n0": HeightToNormal(input: "b.bumps"),
        "moved_n": Transform(input: "n0", angle: 90, scale: 0.5, offset: (3, 1)),
        "h": "= a.material.height", "same": Use(graph: "part", canvas: ())"#;
    let desk = desk("tile: Both, seed: 1", nodes, r#""a": "a.material", "b": "a.bumps""#);
    assert_eq!(values(&desk, "a.bumps", &[]), values(&desk, "moved", &[]));
    assert_eq!(values(&desk, "h", &[]), values(&desk, "moved", &[]));
    assert_eq!(values(&desk, "n", &[]), values(&desk, "moved_n", &[]));
    assert_eq!(values(&desk, "same.bumps", &[]), values(&desk, "b.bumps", &[]));
    let warnings = desk.shibo("check main.ron --format json").expect(0).json()["warnings"].clone();
    // The nodes for comparison are no outputs.
    let unused = |warning: &Json| warning["message"].as_str().unwrap().starts_with("no output needs");
    assert!(warnings.as_array().unwrap().iter().all(unused), "{warnings}");
    desk.shibo("check main.ron --verify").expect(0);
    // The output of the graph is the transformed one.
    desk.shibo("render main.ron --output b --format exr").expect(0);
    main(
        &desk,
        "main.ron",
        "tile: Both, seed: 1",
        "\"a\": Use(graph: \"part\", seed: 2,\n canvas: (angle: 30))",
        r#""b": "a.bumps""#,
    );
    let (line, message, _) = first(&desk, "warnings");
    assert!(line == 6 && message.contains("does not tile"), "{line}: {message}");
}

#[test]
fn transforms_ids_of_instances() {
    let desk = desk("tile: Both", "", "");
    let bricks = r#"(version: 1, canvas: (size_mm: 16, resolution: 16, tile: Both, seed: 1),
      nodes: { "floor": Brick(size: (7.5, 3.5), gap: 0.5), "all": Worley(size: 4) },
      outputs: { "ids": "floor.ids", "cells": "all.ids", "own": "random" })"#;
    let random = r#""random": RegionRandom(ids: "floor.ids")"#;
    desk.write("points.ron", bricks.replace("nodes: {", &format!("nodes: {{ {random},")));
    let nodes = r#""a": Use(graph: "points", canvas: (angle: 90, offset: (3, 1))), "b": Use(graph: "points"),
        "of_moved": RegionRandom(ids: "a.ids"), "moved": Transform(input: "b.own", angle: 90, offset: (3, 1)),
        "chosen": Each(graph: "part", over: 3, ids: "a.cells"), "shown": "= chosen.bumps""#;
    main(&desk, "main.ron", "tile: Both", nodes, r#""of": "of_moved", "shown": "shown""#);
    // A quarter turn maps pixels to pixels: values by transformed id equal transformed values.
    let (numbers, colors) = (values(&desk, "of_moved", &[]), values(&desk, "moved", &[]));
    assert!(numbers.iter().zip(&colors).all(|(a, b)| (a - b).abs() < 1e-6), "{numbers:?} {colors:?}");
    assert!(numbers.iter().any(|v| *v != numbers[0]));
    desk.shibo("check main.ron --verify").expect(0);
    // At any other angle ids are not interpolated between neighbours.
    let turned = r#""a": Use(graph: "points", canvas: (angle: 31)), "b": Use(graph: "points"),
        "of_a": RegionRandom(ids: "a.ids"), "of_b": RegionRandom(ids: "b.ids")"#;
    main(&desk, "main.ron", "tile: None", turned, r#""a": "of_a", "b": "of_b""#);
    let ids = values(&desk, "a.ids", &["--resolution", "64"]);
    assert!(ids.iter().all(|id| id.fract() == 0.0 && *id >= 1.0), "{ids:?}");
    assert!(ids.iter().any(|id| *id != ids[0]));
}

#[test]
fn warns_of_mask_in_place_of_distance() {
    let shapes = r#""panel": Shape(size: 6), "grown": ShapeMath(operation: Offset, a: "panel.distance", amount: 1)"#;
    let desk = desk("tile: Both", shapes, "");
    let said = |node: &str| {
        main(&desk, "main.ron", "tile: Both", &format!("{shapes},\n{node}"), "");
        first(&desk, "warnings")
    };
    let (line, message, help) = said(r#""more": ShapeMath(operation: Shell, a: "panel", amount: 1)"#);
    assert!(
        line == 6 && message.contains("`a` takes a distance in mm") && message.contains("`mask`"),
        "{line}: {message}"
    );
    assert!(help.contains("`distance`"), "{help}");
    // Ports that fit give no warning.
    let through = r##""good": Blend(base: "#000000", top: "#ffffff", mask: "grown.mask"),
        "made": Perlin(size: 4), "also": ShapeMath(a: "made", b: "grown")"##;
    main(&desk, "main.ron", "tile: Both", &format!("{shapes},\n{through}"), "");
    assert_eq!(desk.shibo("check main.ron --format json").expect(0).json()["warnings"], Json::Array(Vec::new()));
}

#[test]
fn a_turned_instance_fills_a_canvas_that_does_not_tile() {
    let desk = desk(
        "tile: None, seed: 1",
        r#""a": Use(graph: "part", canvas: (angle: 45, scale: 0.8)), "b": Use(graph: "part")"#,
        "",
    );
    let dots = |node: &str| values(&desk, node, &["--resolution", "64"]);
    let in_corners = |dots: &[f64]| {
        let near = |i: usize| !(12..52).contains(&i);
        (0..64 * 64).filter(|i| near(i % 64) && near(i / 64) && dots[*i] > 0.0).count()
    };
    let (turned, plain) = (in_corners(&dots("a.dots")), in_corners(&dots("b.dots")));
    assert!(plain > 100 && 2 * turned > plain, "{turned} {plain}");
    assert_eq!(desk.shibo("check main.ron --format json").expect(0).json()["warnings"], Json::Array(Vec::new()));
    main(&desk, "main.ron", "tile: None", r#""a": Use(graph: "part", canvas: (scale: 0.01))"#, "");
    assert!(first(&desk, "warnings").2.contains("8 times"));
}

#[test]
fn refuses_layout_of_points_and_bad_layouts() {
    let desk = desk("tile: Both", "", "");
    let refused = |nodes: &str| {
        main(&desk, "main.ron", "tile: Both", nodes, "");
        desk.shibo("check main.ron").expect(1);
        first(&desk, "errors")
    };
    let (line, message, help) =
        refused("\"a\": Use(graph: \"points\", canvas: (angle: 90)),\n\"d\": Dots(points: \"a.points\", diameter: 1)");
    assert!(
        line == 6 && message.contains("Points") && help.contains("leave `canvas` out"),
        "{line}: {message}; {help}"
    );
    for (canvas, wanted) in [
        ("(scale: 0)", "between 0.001 and 1000"),
        ("(scale: \"x\")", "a number or a pair"),
        ("(angle: 361)", "between -360 and 360"),
        ("(turn: 3)", "no field `turn`"),
        ("45", "named fields"),
    ] {
        let (line, message, _) = refused(&format!("\"a\": Use(graph: \"part\",\n canvas: {canvas})"));
        assert!(line == 6 && message.contains(wanted), "{canvas}: {line}: {message}");
    }
    let (_, message, help) = refused("\"a\": Use(graph: \"part\", sed: 3)");
    assert!(message.contains("no field `sed`") && help.contains("`seed`"), "{message}; {help}");
    // Points without a reader are no error.
    main(&desk, "main.ron", "tile: Both", "\"a\": Use(graph: \"points\", canvas: (angle: 90))", "\"a\": \"a.bumps\"");
    desk.shibo("check main.ron").expect(0);
}

#[test]
fn passes_materials_to_sub_graphs() {
    let desk = desk("tile: Both", "", "");
    desk.write(
        "over.ron",
        r##"(version: 1, canvas: (size_mm: 16, resolution: 16),
          inputs: { "ground": Material(doc: "Below"), "top": Material(default: "own") },
          nodes: {
            "own": Material(base_color: "#ff0000", roughness: 0.25),
            "g": "= ground.roughness",
            "t": "= top.roughness",
            "mixed": "= g + t",
            "made": Material(base_color: "#000000", roughness: "mixed"),
          },
          outputs: { "material": "made", "ground": "ground", "top": "top", "mixed": "mixed" })"##,
    );
    // Rendered alone, the graph uses the default of the missing roughness, ½, without a warning.
    let json = desk.shibo("check over.ron --format json").expect(0).json();
    assert_eq!(
        (json["errors"].as_array().unwrap().len(), json["warnings"].as_array().unwrap().len()),
        (0, 0),
        "{json}"
    );
    assert_eq!(number(&desk.shibo("dump over.ron mixed").expect(0).json()["values"][0]), 0.75);
    desk.shibo("render over.ron -o alone").expect(0);
    assert_eq!(
        desk.names("alone"),
        ["material_base_color.png", "material_roughness.png", "mixed.png", "top_base_color.png", "top_roughness.png"]
    );
    let using = |with: &str| {
        desk.write(
            "main.ron",
            format!(
                r##"(version: 1, canvas: (size_mm: 16, resolution: 4), imports: {{ "over": "over" }}, nodes: {{
                "one": Material(roughness: 0.125), "bare": Material(base_color: "#123456"),
                "u": Use(graph: "over", with: {{ {with} }}),
              }}, outputs: {{ "m": "u.material", "ground": "u.ground" }})"##
            ),
        );
    };
    using(r#""ground": "one""#);
    assert_eq!(values(&desk, "u.mixed", &[])[0], 0.375);
    using(r#""ground": "one", "top": "one""#);
    assert_eq!(values(&desk, "u.mixed", &[])[0], 0.25);
    // A missing channel is reported where the material is given.
    using(r#""ground": "bare""#);
    let (line, message, _) = first(&desk, "warnings");
    assert!(line == 3 && message.contains("no channel `roughness`"), "{line}: {message}");
    using("");
    let (line, message, help) = first(&desk, "errors");
    assert!(line == 3 && message.contains("needs `ground` (Material)"), "{line}: {message}");
    assert!(help.contains("with: { \"ground\": \"node\" }"), "{help}");
}

#[test]
fn the_library_is_found_by_name() {
    let desk = Desk::new();
    let list = desk.shibo("new --list").expect(0).stdout;
    for name in ["starter", "walnut", "calf", "wrinkles"] {
        assert!(list.lines().any(|line| line.split_whitespace().next() == Some(name)), "{name}: {list}");
    }
    desk.write(
        "main.ron",
        r#"(version: 1, canvas: (size_mm: 60, resolution: 16, tile: None), imports: { "bricks": "shibo:bricks", "fin": "shibo:finish.ron", "photo": "shibo:calf_from_photo" },
          nodes: { "b": Use(graph: "bricks", with: { "width": 60 }), "f": Use(graph: "fin"), "p": Use(graph: "photo") },
          outputs: { "b": "b.color", "p": "p.material" })"#,
    );
    desk.shibo("check main.ron").expect(0);
    assert!(values(&desk, "b.color", &[]).len() == 3 * 16 * 16);
    desk.shibo("render shibo:bricks --resolution 16 -o alone").expect(0);
    assert_eq!(desk.names("alone"), ["color.png", "height.png"]);
    desk.write("main.ron", "(version: 1, imports: {\n\"w\": \"shibo:walnt\" }, nodes: {})");
    let (line, message, help) = first(&desk, "errors");
    assert!(
        line == 2 && message.contains("no graph `walnt`") && help.contains("`walnut`"),
        "{line}: {message}; {help}"
    );
    // The message suggests the missing prefix `shibo:`.
    desk.write("main.ron", "(version: 1, imports: { \"w\": \"walnut.ron\" }, nodes: {})");
    assert!(first(&desk, "errors").2.contains("\"shibo:walnut\""));
    // A copy of a graph that imported its neighbours is complete.
    desk.shibo("new mine --from goat").expect(0);
    desk.shibo("check mine.ron").expect(0);
}

#[test]
fn shipped_materials_are_interchangeable() {
    let desk = Desk::new();
    let list = desk.shibo("new --list").expect(0).stdout;
    let sections = list.split("\n\n").filter(|section| section.starts_with("Graphs to render"));
    // Materials made on a mesh have no flat picture `lit`.
    let on_meshes =
        ["bound_handle", "chair_seat", "dressed_bust", "knife_handle", "plank", "rope_on_torus", "turned_bowl"];
    // Strips of woven_leather are too long for the small canvas, and its grain is too fine for the large one.
    let flat = ["noise_basics", "source_figures", "straight_vs_curved", "woven_leather"];
    let others = [&flat[..], &on_meshes[..]].concat();
    // Features of these are wider than the canvas of the others.
    let wide = "brick_wall concrete forest_floor gravel guided sand_ripples snow stucco tyre_rubber urushi venetian_plaster verdigris";
    let wide: Vec<&str> = wide.split(' ').collect();
    // The number of fibres and the length of runs follow the canvas.
    let both = ["suede", "weeping_rust"];
    let lines = sections.flat_map(|section| section.lines().skip(1));
    let names: Vec<&str> = lines.filter_map(|line| line.split_whitespace().next()).collect();
    assert!(names.len() > 25, "{names:?}");
    for (size, is_wide) in [(30, false), (600, true)] {
        let mut text = format!("(version: 1, canvas: (size_mm: {size}, tile: None), imports: {{\n");
        let fits = |name: &str| both.contains(&name) || wide.contains(&name) == is_wide;
        let materials = || names.iter().filter(|name| !others.contains(name) && fits(name));
        for name in materials() {
            text += &format!("\"{name}\": \"shibo:{name}\",\n");
        }
        text += "}, nodes: {\n";
        for name in materials() {
            text +=
                &format!("\"{name}\": Use(graph: \"{name}\"), \"of_{name}\": Relief(material: \"{name}.material\"),\n");
        }
        text += "}, outputs: {\n";
        for name in materials() {
            text += &format!("\"a_{name}\": \"of_{name}\", \"b_{name}\": \"{name}.lit\",\n");
        }
        desk.write("main.ron", text + "})");
        desk.shibo("check main.ron").expect(0);
    }
}

#[test]
fn imports_are_found_without_extension_and_along_a_path() {
    let desk = Desk::new();
    std::fs::create_dir_all(desk.path("work")).unwrap();
    std::fs::create_dir_all(desk.path("shared/deep")).unwrap();
    desk.write("shared/deep/part.ron", PART);
    desk.write(
        "work/main.ron",
        r#"(version: 1, canvas: (size_mm: 16, resolution: 4), imports: { "part": "part" }, nodes: { "a": Use(graph: "part") }, outputs: { "n": "a.number" })"#,
    );
    let ran = desk.shibo("check work/main.ron").expect(1);
    assert!(ran.stderr.contains("shibo.toml"), "{}", ran.stderr);
    desk.write("work/shibo.toml", "# where parts are\n[imports]\npaths = [\"nowhere\", \"../shared/deep\"]\n");
    desk.shibo("check work/main.ron").expect(0);
    // A graph in the same folder comes first.
    desk.write("work/part.ron", PART.replace("default: 1,", "default: 8,"));
    assert_eq!(number(&desk.shibo("dump work/main.ron a.number").expect(0).json()["values"][0]), 8.0);
    desk.write("work/shibo.toml", "[imports]\npath = \"lib\"\n");
    let json = desk.shibo("check work/main.ron --format json").expect(1).json();
    let error = &json["errors"][0];
    assert!(error["file"].as_str().unwrap().ends_with("shibo.toml") && error["line"] == 2, "{json}");
}

#[test]
fn each_piece_shows_one_of_several_instances() {
    // All outputs of the instances are in use, so nothing is reported as unused.
    const OUTPUTS: &str = r#""m": "four.material", "d": "four.dots", "b": "four.bumps", "n": "four.number", "o": "one.bumps", "s": "seeded.bumps""#;
    let nodes = r#""cells": Worley(size: 4), "four": Each(graph: "part", over: 4, ids: "cells.ids", with: { "gap": "= 1 + $index" }),
        "one": Each(graph: "part", over: 1, ids: "cells.ids"), "seeded": Each(graph: "part", over: "= 2 + 2", seed: 9, ids: "cells.ids"),
        "i0": Use(graph: "part", seed: 0), "c": "= four.material.height""#;
    let desk = desk("tile: Both, seed: 1", nodes, OUTPUTS);
    let fine = |node: &str| values(&desk, node, &["--resolution", "64"]);
    let (ids, gaps) = (fine("cells.ids"), fine("four.number"));
    // A piece always shows the same instance, and every instance shows somewhere.
    let mut of_piece = std::collections::BTreeMap::new();
    for (id, gap) in ids.iter().zip(&gaps) {
        assert_eq!(of_piece.entry(id.to_bits()).or_insert(*gap), gap);
    }
    let shown: std::collections::BTreeSet<u64> = gaps.iter().map(|gap| gap.to_bits()).collect();
    assert_eq!(shown, [1.0_f64, 2.0, 3.0, 4.0].map(f64::to_bits).into());
    // Each instance has a seed of its own, and shows the same as rendered alone.
    let instances: Vec<Vec<f64>> = (0..4).map(|i| fine(&format!("four/{i}/bumps"))).collect();
    assert!((1..4).all(|i| !instances[..i].contains(&instances[i])));
    for (k, value) in fine("c").iter().enumerate() {
        let shown = (1_u8..=4).position(|number| f64::from(number) == gaps[k]).unwrap();
        assert_eq!(*value, instances[shown][k], "{k}");
    }
    assert_eq!(fine("four.bumps"), fine("c"));
    assert_eq!(fine("one.bumps"), fine("one/0/bumps"));
    assert_ne!(fine("seeded.bumps"), fine("four.bumps"));
    let all = values(&desk, "four.number", &["--set", "four.gap=9"]);
    assert!(all.iter().all(|gap| *gap == 9.0));
    let one = values(&desk, "four.number", &["--set", "four.2.gap=9"]);
    assert!(one.contains(&9.0) && !one.contains(&3.0) && one.contains(&4.0));
    desk.shibo("check main.ron --verify").expect(0);
    desk.shibo("render main.ron --resolution 300 -q").expect(0);
    let dot = desk.shibo("graph main.ron --format dot").expect(0).stdout;
    assert!(dot.contains("Use part\\nfour") && !dot.contains("four/"), "{dot}");
}

#[test]
fn refuses_invalid_use_of_each() {
    let desk = desk("tile: Both", "", "");
    for (each, wanted, help) in [
        ("over: 2, graph: \"part\"", "has no `ids`", "ids: \"node.ids\""),
        ("ids: \"c.ids\", graph: \"part\"", "has no `over`", "over: 4"),
        ("ids: \"c.ids\", over: 0, graph: \"part\"", "between 1 and 64", ""),
        ("ids: \"c.ids\", over: 2.5, graph: \"part\"", "between 1 and 64", ""),
        ("ids: \"c\", over: 2, graph: \"part\"", "takes Ids", ""),
        ("ids: 3, over: 2, graph: \"part\"", "takes Ids", ""),
        ("ids: \"c.ids\", over: 2, graph: \"part\", evr: 1", "`Each` has no field `evr`", "over"),
        ("ids: \"c.ids\", over: 2", "`Each` has no `graph`", "imports"),
    ] {
        main(
            &desk,
            "main.ron",
            "tile: Both",
            &format!("\"c\": Worley(size: 4),\n\"e\": Each({each})"),
            "\"e\": \"e.bumps\"",
        );
        let (line, message, found) = first(&desk, "errors");
        assert!(line == 6 && message.contains(wanted) && found.contains(help), "{each}: {line}: {message}; {found}");
    }
    let points = "\"c\": Worley(size: 4), \"e\": Each(graph: \"points\", over: 2, ids: \"c.ids\"),\n\"d\": Dots(points: \"e.points\", diameter: 1)";
    main(&desk, "main.ron", "tile: Both", points, "");
    let (line, message, _) = first(&desk, "errors");
    assert!(line == 6 && message.contains("Points"), "{line}: {message}");
}
