//! Exemplar synthesis end to end: odd exemplars work, impossible requests are refused with the reason, and coordinates
//! are those of the method.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::Desk;
use serde_json::Value as Json;

/// A graph of some nodes; the first of them is on line 5.
fn graph(canvas: &str, nodes: &str, output: &str) -> String {
    format!(
        "(\n  version: 1,\n  canvas: ({canvas}),\n  nodes: {{\n{nodes}\n  }},\n  outputs: {{ \"out\": \"{output}\" }},\n)\n"
    )
}

const CANVAS: &str = "size_mm: 48, resolution: 48, tile: Both, seed: 1";

/// A picture with different pixels, or a uniform one, with opacity 0 on its left.
fn picture(desk: &Desk, name: &str, (w, h): (u32, u32), plain: bool) {
    let pixel = |x: u32, y: u32| {
        let v = |k: u32| if plain { 90 } else { u8::try_from((x * 37 + y * 91 + x * y * k) % 251).unwrap() };
        image::Rgba([v(3), v(5), v(11), if x < w / 2 { 0 } else { 255 }])
    };
    image::RgbaImage::from_fn(w, h, pixel).save(desk.path(name)).unwrap();
}

const CHAIN: &str = r#"    "exemplar": Exemplar(input: "picture", mask: "picture.alpha"),
    "coords": Synthesize(exemplar: "exemplar", size: (40, 30)),
    "shown": SampleExemplar(coords: "coords", input: "picture"),"#;

#[test]
fn odd_exemplars_work() {
    let desk = Desk::new();
    for (size, plain) in
        [((1, 1), false), ((1, 9), false), ((7, 1), false), ((3, 1), false), ((20, 20), true), ((31, 12), false)]
    {
        picture(&desk, "a.png", size, plain);
        let nodes = format!("    \"picture\": Image(path: \"a.png\", size_mm: 12),\n{CHAIN}");
        let mut text = graph(CANVAS, &nodes, "shown");
        if size.0 == 1 {
            // An exemplar one pixel wide has no opaque pixel.
            text = text.replace(", mask: \"picture.alpha\"", "");
        }
        desk.write("a.ron", text);
        desk.shibo("render a.ron --no-cache").expect(0);
        let coords = desk.shibo("dump a.ron coords --no-cache").expect(0).json();
        for pair in coords["coords"].as_array().unwrap() {
            let [u, v] = [0, 1].map(|k| pair[k].as_f64().unwrap());
            assert!((0.0..f64::from(size.0)).contains(&u) && (0.0..f64::from(size.1)).contains(&v), "{size:?} {u} {v}");
        }
    }
}

#[test]
fn maps_of_other_sizes_are_aligned_by_place() {
    let desk = Desk::new();
    picture(&desk, "a.png", (16, 16), false);
    picture(&desk, "b.png", (64, 64), true);
    let nodes = r#"    "small": Image(path: "a.png", size_mm: 12),
    "large": Image(path: "b.png", size_mm: 12),
    "exemplar": Exemplar(input: "small", others: ["large"], weights: [1, 0.5]),
    "coords": Synthesize(exemplar: "exemplar"),
    "fine": MagnifyCoords(coords: "coords", input: "large"),"#;
    desk.write("a.ron", graph(CANVAS, nodes, "fine"));
    desk.shibo("render a.ron --no-cache --resolution 96").expect(0);
    let dump = desk.shibo("dump a.ron fine --no-cache").expect(0).json();
    let values: Vec<f64> = dump["values"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
    // All pixels of the fine picture are alike.
    assert!(values.iter().all(|v| (v - values[0]).abs() < 1e-5));
}

/// Renders a graph that must fail, and checks code, line, and a part of the message.
fn fails(nodes: &str, output: &str, (code, line): (&str, u64), words: &str) {
    let desk = Desk::new();
    picture(&desk, "a.png", (32, 32), false);
    desk.write("a.ron", graph(CANVAS, nodes, output));
    let ran = desk.shibo("render a.ron --no-cache --memory 64").expect(1);
    let place = format!("a.ron:{line}:");
    assert!(ran.stderr.contains(&place) && ran.stderr.contains(code), "{place} {code}: {}", ran.stderr);
    // Messages are broken into lines.
    let flat = ran.stderr.split_whitespace().filter(|w| *w != "\u{2502}").collect::<Vec<_>>().join(" ");
    assert!(flat.contains(words), "{words}: {flat}");
}

const GROUND: &str = r#"    "ground": Perlin(size: 6),
    "half": Threshold(input: "ground"),
"#;

#[test]
fn exemplars_are_checked() {
    let with = |text: &str| {
        format!(
            "{GROUND}    \"exemplar\": {text},\n    \"out\": Synthesize(exemplar: \"exemplar\"),\n    \"shown\": SampleExemplar(coords: \"out\", input: \"ground\"),"
        )
    };
    let fails = |text: &str, code: &str, words: &str| fails(&with(text), "shown", (code, 7), words);
    fails("Exemplar(input: \"ground\", mask: 0.2)", "bad-value", "leaves nothing");
    fails("Exemplar(input: \"ground\", size: (16384, 16384))", "too-large", "of `16384x16384` pixels");
    fails("Exemplar(input: \"ground\", size: (0, 4))", "out-of-range", "1");
    fails("Exemplar(input: \"ground\", weights: [1, 2, 3])", "bad-value", "3 weights for 1 fields");
    fails("Exemplar(input: \"ground\", weights: [0])", "bad-value", "0 channels are compared");
}

#[test]
fn jacobians_are_checked_with_their_place() {
    let with = |j: &str| {
        format!(
            "{GROUND}    \"exemplar\": Exemplar(input: \"ground\", size: (32, 32)),\n    \"j\": {j},\n    \"out\": \
             Synthesize(exemplar: \"exemplar\", jacobian: \"j\"),\n    \"shown\": SampleExemplar(coords: \"out\", input: \"ground\"),"
        )
    };
    let fails = |j: &str, words: &str| fails(&with(j), "shown", ("bad-value", 9), words);
    fails("JacobianFromAngleScale(scale: \"half\")", "mm, where it is [");
    fails("JacobianFromAngleScale(scale: 0)", "the Jacobian is not finite everywhere");
    fails("JacobianFromAngleScale(scale: 100)", "features grow more than 64 times");
    fails("JacobianFromAngleScale(scale: 0.01)", "features shrink more than 64 times");
}

#[test]
fn accepts_scale_beyond_the_levels() {
    for scale in ["30", "0.04"] {
        let desk = Desk::new();
        let nodes = format!(
            "{GROUND}    \"exemplar\": Exemplar(input: \"ground\", size: (32, 32)),\n    \"j\": JacobianFromAngleScale(scale: {scale}),\n    \
             \"out\": Synthesize(exemplar: \"exemplar\", jacobian: \"j\", size: (48, 48)),\n    \"shown\": SampleExemplar(coords: \"out\", input: \"ground\", jacobian: \"j\"),"
        );
        desk.write("a.ron", graph(CANVAS, &nodes, "shown"));
        desk.shibo("render a.ron --no-cache").expect(0);
    }
}

#[test]
fn stages_are_checked() {
    let start = |text: &str, next: &str| {
        format!(
            "{GROUND}    \"start\": {text},\n    \"out\": {next},\n    \"shown\": SampleExemplar(coords: \"out\", input: \"ground\"),"
        )
    };
    let up = "UpsampleCoords(coords: \"start\")";
    fails(
        &start("StartCoords(size: (2, 2), coords: [(1, 1)], levels: 2)", up),
        "shown",
        ("bad-value", 7),
        "there must be 4",
    );
    fails(&start("StartCoords(size: (2, 2))", up), "shown", ("bad-value", 8), "of the finest level already");
    let uneven =
        "CorrectCoords(coords: \"start\", exemplar: \"e\", sub_passes: 3),\n    \"e\": Exemplar(input: \"ground\")";
    fails(&start("StartCoords(size: (2, 2))", uneven), "shown", ("out-of-range", 8), "a square number");
}

fn coords(desk: &Desk, node: &str) -> Vec<[f64; 2]> {
    let dump = desk.shibo(&format!("dump a.ron {node} --no-cache")).expect(0).json();
    let pair = |pair: &Json| [0, 1].map(|k| pair[k].as_f64().unwrap());
    dump["coords"].as_array().unwrap().iter().map(pair).collect()
}

fn close(a: &[[f64; 2]], b: &[[f64; 2]], tolerance: f64) -> bool {
    a.len() == b.len() && a.iter().flatten().zip(b.iter().flatten()).all(|(a, b)| (a - b).abs() <= tolerance)
}

#[test]
fn a_constant_jacobian_turns_zeros_into_the_affine_map() {
    let desk = Desk::new();
    let nodes = r#"    "j": JacobianFromAngleScale(angle: 90, scale: 2),
    "s": StartCoords(size: (1, 1), levels: 3),
    "a": UpsampleCoords(coords: "s", jacobian: "j"),
    "b": UpsampleCoords(coords: "a", jacobian: "j"),
    "c": UpsampleCoords(coords: "b", jacobian: "j"),
    "ground": Perlin(),"#;
    desk.write("a.ron", graph(CANVAS, nodes, "ground"));
    // Features are turned by 90° from +x to +y and twice as large: a step down is half a step along the exemplar's x.
    let wanted: Vec<[f64; 2]> = (0..64)
        .map(|p| {
            let (x, y) = (f64::from(p % 8) - 3.5, f64::from(p / 8) - 3.5);
            [0.5 * y, -0.5 * x]
        })
        .collect();
    assert!(close(&coords(&desk, "c"), &wanted, 1e-5));
}

#[test]
fn patent_preset_equals_stages_of_the_source() {
    let desk = Desk::new();
    let mut nodes = String::from(
        r#"    "ground": Perlin(size: 5),
    "exemplar": Exemplar(input: "ground", size: (16, 16), periodic: Yes),
    "j": JacobianFromAngleScale(angle: 20, scale: 1.1),
    "driven": Synthesize(exemplar: "exemplar", jacobian: "j", preset: Patent, size: (32, 32)),
    "c0": StartCoords(size: (2, 2), levels: 4),
"#,
    );
    for level in 1..=4 {
        nodes += &format!(
            "    \"u{level}\": UpsampleCoords(coords: \"c{}\", jacobian: \"j\"),\n    \"c{level}\": CorrectCoords(coords: \
             \"u{level}\", exemplar: \"exemplar\", jacobian: \"j\", passes: 2),\n",
            level - 1
        );
    }
    desk.write("a.ron", graph(CANVAS, &nodes, "ground"));
    let (driven, staged) = (coords(&desk, "driven"), coords(&desk, "c4"));
    assert!(close(&driven, &staged, 1e-3), "the driver and the stages differ");
    // The preset uses no random numbers: another canvas seed changes nothing.
    desk.write(
        "a.ron",
        graph(&CANVAS.replace("seed: 1", "seed: 2"), &nodes.replace("Perlin(size: 5)", "Gradient()"), "ground"),
    );
    let (two, one) = (coords(&desk, "driven"), {
        desk.write("a.ron", graph(CANVAS, &nodes.replace("Perlin(size: 5)", "Gradient()"), "ground"));
        coords(&desk, "driven")
    });
    assert!(close(&one, &two, 0.0));
}

#[test]
fn a_larger_canvas_extends_a_smaller_one() {
    let nodes = r#"    "ground": Worley(size: 5),
    "exemplar": Exemplar(input: "ground", size: (32, 32), size_mm: 16),
    "coords": Synthesize(exemplar: "exemplar", origin: (-7, 3)),"#;
    let at = |size: u32| {
        let desk = Desk::new();
        // On a canvas that does not tile, noise does not depend on the size of the canvas, so both have the same
        // exemplar.
        let canvas = format!("size_mm: {size}, resolution: 64, tile: None, seed: 1");
        desk.write("a.ron", graph(&canvas, nodes, "ground"));
        coords(&desk, "coords")
    };
    let (small, large) = (at(30), at(48));
    for (p, at) in small.iter().enumerate() {
        assert_eq!(*at, large[p / 60 * 96 + p % 60], "pixel {p}");
    }
}

#[test]
fn output_follows_guide() {
    let desk = Desk::new();
    let nodes = r#"    "halves": Gradient(repeat: Mirror, times: 2),
    "which": Remap(input: "halves", from: (0.45, 0.55), clamp: true),
    "noise": Fractal(size: 3),
    "ground": "= noise + 0.3 * which",
    "exemplar": Exemplar(input: "ground", guide: "which", size: (64, 64)),
    "rows": Gradient(angle: 90, repeat: Mirror, times: 2),
    "wanted": Remap(input: "rows", from: (0.45, 0.55), clamp: true),
    "coords": Synthesize(exemplar: "exemplar", guide: "wanted", size: (96, 96), guide_weight: 4),
    "shown": SampleExemplar(coords: "coords", input: "which"),"#;
    desk.write("a.ron", graph("size_mm: 48, resolution: 96, tile: Both, seed: 1", nodes, "shown"));
    let values = |node: &str| -> Vec<f64> {
        let dump = desk.shibo(&format!("dump a.ron {node} --no-cache")).expect(0).json();
        dump["values"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
    };
    let (shown, wanted) = (values("shown"), values("wanted"));
    let off = shown.iter().zip(&wanted).map(|(a, b)| (a - b).abs()).sum::<f64>() / shown.len() as f64;
    assert!(off < 0.15, "the guide is missed by {off} on average");
}

#[test]
fn candidate_set_size_changes_coordinates() {
    let desk = Desk::new();
    let at = |sets: &str| {
        let nodes = format!(
            "{GROUND}    \"exemplar\": Exemplar(input: \"ground\", size: (32, 32)),\n    \"sets\": {sets},\n    \"coords\": \
             Synthesize(exemplar: \"sets\", size: (64, 64), mend: 0),\n    \"shown\": SampleExemplar(coords: \"coords\", input: \"ground\"),"
        );
        desk.write("a.ron", graph(CANVAS, &nodes, "shown"));
        coords(&desk, "coords")
    };
    let [one, two, four] = [1, 2, 4].map(|k| at(&format!("CandidateSets(exemplar: \"exemplar\", k: {k})")));
    let usual = at("AppearanceSpace(exemplar: \"exemplar\")");
    assert!(close(&two, &usual, 0.0), "two are what Synthesize takes by itself");
    assert!(!close(&one, &two, 0.0) && !close(&two, &four, 0.0) && !close(&one, &four, 0.0));
}

#[test]
fn the_distance_to_features_is_compared() {
    let desk = Desk::new();
    let at = |more: &str| {
        let nodes = format!(
            "    \"cells\": Worley(size: 5, jitter: 0.8),\n    \"lines\": Remap(input: \"cells.border\", from: (0, 0.4), to: (1, 0), clamp: true),\n    \
             \"exemplar\": Exemplar(input: \"lines\", size: (64, 64){more}),\n    \"coords\": Synthesize(exemplar: \"exemplar\", size: (96, 96)),\n    \
             \"shown\": SampleExemplar(coords: \"coords\", input: \"lines\"),"
        );
        desk.write("a.ron", graph(CANVAS, &nodes, "shown"));
        coords(&desk, "coords")
    };
    let plain = at("");
    assert!(!close(&plain, &at(", feature: \"lines\""), 0.0));
    assert!(close(&plain, &at(", feature: \"lines\", feature_weight: 0"), 0.0));
}
