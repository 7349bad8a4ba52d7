//! Presets of synthesis keep their promises and warn of ignored parameters; coordinates go to a file and come back.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::Desk;
use serde_json::Value as Json;

/// A graph of some nodes; the first of them is on line 5.
fn graph(canvas: &str, nodes: &str, output: &str) -> String {
    format!(
        "(\n  version: 1,\n  canvas: ({canvas}),\n  nodes: {{\n{nodes}\n  }},\n  outputs: {{ \"out\": {output} }},\n)\n"
    )
}

fn coords(desk: &Desk, node: &str) -> Vec<[f64; 2]> {
    let json = desk.shibo(&format!("dump a.ron {node} --no-cache")).expect(0).json();
    let pair = |pair: &Json| [0, 1].map(|k| pair[k].as_f64().unwrap());
    json["coords"].as_array().unwrap().iter().map(pair).collect()
}

/// True if the right and lower neighbours of each pixel show the exemplar one pixel further, modulo its side.
fn goes_on(map: &[[f64; 2]], w: usize, side: f64) -> bool {
    let near = |a: f64, b: f64| ((a - b).rem_euclid(side) - side / 2.0).abs() > side / 2.0 - 1e-3;
    (0..map.len()).all(|p| {
        let [u, v] = map[0];
        near(map[p][0], u + (p % w) as f64) && near(map[p][1], v + (p / w) as f64)
    })
}

#[test]
fn patent_preset_repeats_exemplar_at_any_size() {
    let desk = Desk::new();
    let unbent = ", jacobian: JacobianFromAngleScale()";
    for (side, tile, more) in [
        (24, "Both", ""),
        (16, "None", ""),
        (24, "None", ""),
        (12, "Both", ""),
        (12, "Both", unbent),
        (12, "X", unbent),
        (12, "None", ", start_size: 8"),
        (16, "Both", ", start_size: 4"),
    ] {
        let nodes = format!(
            r#"    "ground": Perlin(size: 7),
    "exemplar": Exemplar(input: "ground", size: ({side}, {side}), size_mm: ({side}, {side}), periodic: Yes),
    "coords": Synthesize(exemplar: "exemplar", preset: Patent, size: (48, 48){more}),"#
        );
        desk.write(
            "a.ron",
            graph(&format!("size_mm: 48, resolution: 48, tile: {tile}, seed: 1"), &nodes, "\"ground\""),
        );
        assert!(goes_on(&coords(&desk, "coords"), 48, f64::from(side)), "{side} {tile} {more}");
    }
}

#[test]
fn warns_of_parameters_that_preset_ignores() {
    let desk = Desk::new();
    let warned = |more: &str| {
        let nodes = format!(
            r#"    "ground": Perlin(size: 7),
    "exemplar": Exemplar(input: "ground", size: (16, 16)),
    "coords": Synthesize(exemplar: "exemplar", {more}),
    "shown": SampleExemplar(coords: "coords", input: "ground"),"#
        );
        desk.write("a.ron", graph("size_mm: 32, resolution: 32, tile: Both, seed: 1", &nodes, "\"shown\""));
        let ran = desk.shibo("render a.ron -o . --no-cache").expect(0);
        ["copy_size", "even_use", "scope", "mend", "sub_passes"]
            .map(|name| ran.stderr.contains(&format!("`{name}` does nothing")))
    };
    assert_eq!(
        warned("preset: Patent, copy_size: 2, even_use: 1, scope: Local, mend: 2, sub_passes: 9"),
        [true, true, true, true, false]
    );
    assert_eq!(
        warned("copy_size: 2, even_use: 1, scope: Local, mend: 2, sub_passes: 9"),
        [false, false, false, false, true]
    );
    assert_eq!(warned("preset: Patent"), [false; 5]);
}

#[test]
fn presets_set_rounds_of_mending() {
    let desk = Desk::new();
    let at = |more: &str| {
        let nodes = format!(
            r#"    "ground": Worley(size: 5, jitter: 0.8),
    "exemplar": Exemplar(input: "ground.border", size: (40, 40), periodic: No),
    "coords": Synthesize(exemplar: "exemplar", {more}),"#
        );
        desk.write("a.ron", graph("size_mm: 64, resolution: 64, tile: Both, seed: 1", &nodes, "\"ground\""));
        coords(&desk, "coords")
    };
    let (fast, usual, best) = (at("preset: Fast"), at(""), at("preset: Best"));
    assert!(fast == at("mend: 0") && usual == at("mend: 2"));
    // `Best` also leaves fewer patches as they are.
    assert!(fast != usual && usual != best && best == at("preset: Best, mend: 4") && best != at("mend: 4"));
}

#[test]
fn coordinates_go_to_a_file_and_come_back() {
    let desk = Desk::new();
    let nodes = r#"    "ground": Worley(size: 5, jitter: 0.8),
    "exemplar": Exemplar(input: "ground.border", size: (40, 30)),
    "coords": Synthesize(exemplar: "exemplar", size: (64, 48)),
    "field": CoordsToField(coords: "coords"),"#;
    let canvas = "size_mm: (64, 48), resolution: (64, 48), tile: Both, seed: 1";
    desk.write("a.ron", graph(canvas, nodes, r#"File(from: "field", format: Exr)"#));
    desk.shibo("render a.ron -o . --no-cache").expect(0);
    let made = coords(&desk, "coords");
    let read = r#"    "ground": Worley(size: 5, jitter: 0.8),
    "exemplar": Exemplar(input: "ground.border", size: (40, 30)),
    "u": Image(path: "out.exr", size_mm: (64, 48), layer: "X", color_space: Raw),
    "v": Image(path: "out.exr", size_mm: (64, 48), layer: "Y", color_space: Raw),
    "both": "= (u, v)",
    "coords": CoordsFromField(input: "both", exemplar: "exemplar", size: (64, 48)),
    "shares": CoordsToField(coords: "coords", unit: Share),
    "again": CoordsFromField(input: "shares", exemplar: "exemplar", size: (64, 48), unit: Share),"#;
    desk.write("a.ron", graph(canvas, read, r#""shares""#));
    assert_eq!(coords(&desk, "coords"), made);
    let again = coords(&desk, "again");
    assert!(again.iter().zip(&made).all(|(a, b)| (a[0] - b[0]).abs() + (a[1] - b[1]).abs() < 1e-4));
    let spread = made.iter().filter(|at| at[0] != made[0][0]).count();
    assert!(spread > 1000, "the map shows one place");
}

#[test]
fn coordinate_files_state_exemplar_size() {
    let desk = Desk::new();
    let of = |size: &str, more: &str| {
        format!(
            r#"    "ground": Worley(size: 5, jitter: 0.8),
    "exemplar": Exemplar(input: "ground.border", size: {size}),
{more}"#
        )
    };
    let canvas = "size_mm: (64, 48), resolution: (64, 48), tile: Both, seed: 1";
    let made = of("(40, 30)", r#"    "coords": Synthesize(exemplar: "exemplar", size: (64, 48)),"#);
    desk.write("a.ron", graph(canvas, &made, r#""coords""#));
    let made = coords(&desk, "coords");
    desk.shibo("render a.ron -o . --no-cache").expect(0);
    let wrong = desk.shibo("render a.ron -o . --no-cache --format png").expect(2).stderr;
    assert!(wrong.contains("only EXR can hold"), "{wrong}");

    let read = r#"    "coords": CoordsFromField(file: "out.exr", exemplar: "exemplar"),"#;
    desk.write("a.ron", graph(canvas, &of("(40, 30)", read), r#""coords""#));
    assert_eq!(coords(&desk, "coords"), made);

    desk.write("b.ron", graph(canvas, &of("(30, 40)", read), r#""coords""#));
    let wrong = desk.shibo("render b.ron -o . --no-cache").expect(1).stderr;
    assert!(wrong.contains("in an exemplar of `40x30` pixels; this one has `30x40`"), "{wrong}");

    let both = r#"    "coords": CoordsFromField(input: "= (ground, ground)", file: "out.exr", exemplar: "exemplar"),"#;
    desk.write("b.ron", graph(canvas, &of("(40, 30)", both), r#""coords""#));
    assert!(desk.shibo("check b.ron").expect(1).stderr.contains("both `input` and `file` are given"));
    let neither = r#"    "coords": CoordsFromField(exemplar: "exemplar"),"#;
    desk.write("b.ron", graph(canvas, &of("(40, 30)", neither), r#""coords""#));
    assert!(desk.shibo("check b.ron").expect(1).stderr.contains("connect `input`, or name a `file`"));
}
