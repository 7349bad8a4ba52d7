//! Formulas in graph files, end to end: the same values in one formula as in several, in every place that takes a formula.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::{Desk, number};
use std::fmt::Write as _;
use std::time::{Duration, Instant};

/// A folder with a graph of these sections.
fn desk(sections: &str, nodes: &str) -> Desk {
    let desk = Desk::new();
    let canvas = "canvas: (size_mm: (16, 12), resolution: 16, tile: Both, seed: 3)";
    let graph = format!("(version: 1, {canvas}, {sections}\nnodes: {{\n{nodes}\n}})");
    desk.write("main.ron", graph);
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
    for (formula, node) in pairs {
        let (formula_values, node_values) = (values(desk, formula), values(desk, node));
        let differs = formula_values.iter().zip(&node_values).position(|(a, b)| a != b);
        assert!(differs.is_none() && formula_values.len() == node_values.len(), "{formula} {node} {differs:?}");
        assert!(node_values.iter().any(|value| *value != node_values[0]), "{node}");
    }
}

#[test]
fn formulas_of_fields_equal_their_parts() {
    let desk = desk(
        r##"params: { "gain": Number(default: 0.4), "tint": Color(default: "#884422") },"##,
        r##"
        "cells": Worley(size: 5),
        "waves": Perlin(size: 4),
        "color": GradientMap(input: "waves", stops: [(0, "#204060"), (1, "#f0c080")]),
        "a1": "= cells.f2 * $gain + waves",
        "a2": "= max(a1, 0.3)",
        "b2": "= max($gain * cells.f2 + waves, 0.3)",
        "b3": r#"= let scaled = cells.f2 * $gain;
           max(scaled + waves, 0.3)"#,
        "c1": "= (color.b, color.g, color.r) * $tint",
        "c2": "= color.bgr * $tint",
        "c3": "= color.zyx * $tint",
        "d0": "= sin(360 * 2 * u) + x % 4",
        "d1": "= d0 + noise(v * 3, u * 4) + random(floor(y))",
        "d2": "= sin(360 * 2 * u) + x % 4 + noise(v * 3, u * 4) + random(floor(y))",
        "leather": Material(base_color: "color", height: "waves"),
        "e2": "= leather.height",
        "e3": Blend(base: "leather.height", top: 0, opacity: 0),
        "f1": "= color.r",
        "f2": Blend(base: "color.r", top: 0, opacity: 0),
        "g0": "= cells.f1 * waves",
        "g1": Blend(base: "g0", top: "color", opacity: 0.5),
        "g2": Blend(base: "= waves * cells.f1", top: "leather.base_color", opacity: 0.5),
        "i1": RegionRandom(ids: "pieces.ids", seed: 4),
        "pieces": Brick(size: (4, 3)),
        "i2": "= random(pieces.ids, 4)",
        "##,
    );
    same(
        &desk,
        &[
            ("b2", "a2"),
            ("b3", "a2"),
            ("c2", "c1"),
            ("c3", "c1"),
            ("d2", "d1"),
            ("e2", "waves"),
            ("e3", "waves"),
            ("f2", "f1"),
            ("g2", "g1"),
            ("i2", "i1"),
        ],
    );
}

#[test]
fn formulas_of_solids_equal_their_parts() {
    let desk = desk(
        "",
        r##"
        "clouds": SolidNoise(size: 6, octaves: 3),
        "stone": GradientMap(input: "clouds", stops: [(0.2, "#3a2f2a"), (0.8, "#f2e9d8")]),
        "b": "= smoothstep(0.3, 0.7, clouds)",
        "half": "= 0.5 * b",
        "a2": "= half + clouds",
        "cut1": CutPlane(solid: "a2"),
        "cut2": CutPlane(solid: "= 0.5 * smoothstep(0.3, 0.7, clouds) + clouds"),
        "mixed": "= stone + (red - stone) * b",
        "red": GradientMap(input: "clouds", stops: [(0, "#ff0000")]),
        "cut3": CutPlane(solid: "mixed"),
        "cut4": CutPlane(solid: "= mix(stone, red, clamp(b, 0, 1))"),
        "axis": CutPlane(solid: "= point.x / 16", origin: (0, 5, 0)),
        "cut5": "= u",
        "vector": SolidNoise(size: 4, place: "= (point.z, 0, 0) * clouds"),
        "##,
    );
    same(&desk, &[("cut2", "cut1"), ("cut4", "cut3"), ("axis", "cut5")]);
    desk.shibo("check main.ron").expect(0);
}

#[test]
fn random_numbers_follow_the_seed_of_the_canvas() {
    let desk = desk("", "\"r\": \"= random(floor(x)) + noise(x, y)\"");
    let of = |seed: &str| desk.run(["dump", "main.ron", "r", "--set", seed]).expect(0).json()["values"].clone();
    assert_eq!(of("seed=1"), of("seed=1"));
    assert_ne!(of("seed=1"), of("seed=2"));
}

#[test]
fn formulas_stand_in_every_place() {
    let desk = desk(
        r#"
        functions: { "ridge(x, w)": "1 - smoothstep(0, w, abs(x))", "twice(x)": "ridge(x, 1) * canvas.width / 8" },
        imports: { "lines": "lines" },
        graphs: {
          "layer": (
            inputs: { "mask": Gray(default: "= u * 0.5"), "tint": Rgb(default: 1) },
            params: { "size": Number(default: 4) },
            nodes: { "cells": Worley(size: "= $size / 2"), "shown": "= mask * cells.f1 * twice(0.5)" },
            outputs: { "shown": "= shown * tint.r" },
          ),
          "both": (
            nodes: { "one": Use(graph: "layer", with: { "mask": "= v" }) },
            outputs: { "one": "= one + 0" },
          ),
        },
        outputs: { "mask": "= step(0.5, waves)", "height": File(from: "= waves * 2", format: Exr) },"#,
        r#"
        "waves": Perlin(size: 4),
        "fine": Use(graph: "layer", with: { "mask": "= waves * 0.5", "tint": "= (waves, 0, 1)", "size": 3 }),
        "plain": Use(graph: "both"),
        "a": "= fine + plain",
        "sum": LayerMaterials(layers: [(material: "m"), (material: "m", mask: "= waves > 0.5")]),
        "m": Material(base_color: "= hsv(from_hsv((30, 0.5, waves)))", height: "= lines.bump(waves) * ridge(u, 0.4)"),
        "b": "= sum.height * twice(0.5)",
        "pitch": Perlin(size: "= ridge(0.5, 1) * 4 + lines.bump(1)"),
        "#,
    );
    let lines = r#"(version: 1, functions: { "half(x)": "x / 2", "bump(x)": "half(x) + 1" }, nodes: { "n": Perlin() }, outputs: { "n": "n" })"#;
    desk.write("lines.ron", lines);
    for node in ["a", "b", "pitch", "plain", "m.base_color"] {
        let values = values(&desk, node);
        assert!(values.iter().all(|value| value.is_finite()) && values.iter().any(|v| *v != values[0]), "{node}");
    }
    desk.shibo("render main.ron -o out").expect(0);
    assert_eq!(desk.names("out"), ["height.exr", "mask.png"]);
}

#[test]
fn fused_formulas_have_the_values_of_separate_ones() {
    let nodes = |outputs: &str| {
        let mut nodes = r#""waves": Perlin(size: 4), "f0": "= waves * 0.9 + 0.01 / (waves - waves)","#.to_owned();
        for k in 1..40 {
            let _ = writeln!(nodes, r#""f{k}": "= f{} * 0.97 + sin(f{} * 40) * 0.1 + u * {k} * 0.01","#, k - 1, k - 1);
        }
        nodes.push_str(outputs);
        nodes
    };
    // With a second reader, a formula is computed by itself.
    let alone = desk("", &nodes(r#""end": "= f39 * 1.5""#));
    let mut read = r#""end": "= f39 * 1.5""#.to_owned();
    for k in 0..40 {
        let _ = write!(read, r#", "g{k}": Blur(input: "f{k}", radius: 0.5)"#);
    }
    let shared = desk("", &nodes(&read));
    assert_eq!(values(&alone, "end"), values(&shared, "end"));
}

#[test]
fn odd_formulas_are_refused_in_time() {
    let many = |count: usize, each: &str| each.repeat(count);
    let names: String = (0..10_000).fold(String::new(), |mut text, k| {
        let _ = write!(text, " + n{k}");
        text
    });
    let chain: String = (0..2000).fold(String::new(), |mut text, k| {
        let _ = writeln!(text, "\"c{}\": \"= c{k} + 1\",", k + 1);
        text
    });
    for text in [
        format!("= {}waves", many(1 << 17, "(")),
        format!("= {}waves", many(1 << 17, "-")),
        format!("= {}waves", many(20_000, "let a = 1;")),
        format!("= waves{names}"),
        format!("= waves{}", many(40_000, " + waves")),
        format!("= waves{}", many(60_000, ".x")),
        format!("= f({}waves", many(30_000, "f(")),
    ] {
        let began = Instant::now();
        let functions = r#"functions: { "f(x)": "g(x) + g(x)", "g(x)": "f(x) + f(x)" },"#;
        let desk = desk(functions, &format!("\"waves\": Perlin(), \"a\": \"{text}\""));
        let ran = desk.shibo("check main.ron");
        assert!(ran.code == Some(1) && ran.stdout.len() + ran.stderr.len() < 1 << 20, "{:?}", ran.code);
        assert!(began.elapsed() < Duration::from_secs(20), "{:?}", began.elapsed());
    }
    let cycle = desk("", &format!("\"c0\": \"= c2000\",\n{chain}"));
    let told = cycle.shibo("check main.ron").expect(1);
    assert!(format!("{}{}", told.stdout, told.stderr).contains("nodes need each other"), "{}", told.stderr);
    let long = desk("", &format!("\"c0\": Perlin(),\n{chain}"));
    assert_eq!(values(&long, "c2000").len(), values(&long, "c0").len());
}
