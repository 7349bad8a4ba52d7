//! Rows of the source end to end: start coordinates, compared channels, and lookups at any level and resolution.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::Desk;
use serde_json::Value as Json;

/// A graph of some nodes; the first of them is on line 5.
fn graph(canvas: &str, nodes: &str, output: &str) -> String {
    format!(
        "(\n  version: 1,\n  canvas: ({canvas}),\n  nodes: {{\n{nodes}\n  }},\n  outputs: {{ \"out\": \"{output}\" }},\n)\n"
    )
}

/// A picture in which no two pixels are equal, if it is small.
fn picture(desk: &Desk, name: &str, (w, h): (u32, u32)) {
    let pixel = |x: u32, y: u32| {
        let v = |k: u32| u8::try_from((x * 37 + y * 91 + x * y * k) % 251).unwrap();
        image::Rgb([v(3), v(5), v(11)])
    };
    image::RgbImage::from_fn(w, h, pixel).save(desk.path(name)).unwrap();
}

fn dump(desk: &Desk, node: &str, more: &str) -> Json {
    desk.shibo(&format!("dump a.ron {node} --no-cache {more}")).expect(0).json()
}

fn values(desk: &Desk, node: &str, more: &str) -> Vec<f64> {
    dump(desk, node, more)["values"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

fn coords(desk: &Desk, node: &str) -> Vec<[f64; 2]> {
    let pair = |pair: &Json| [0, 1].map(|k| pair[k].as_f64().unwrap());
    dump(desk, node, "")["coords"].as_array().unwrap().iter().map(pair).collect()
}

#[test]
fn pixels_show_the_exemplar_at_their_coordinates_without_a_blur() {
    let desk = Desk::new();
    picture(&desk, "a.png", (24, 18));
    let nodes = r#"    "picture": Image(path: "a.png", size_mm: (24, 18)),
    "exemplar": Exemplar(input: "picture"),
    "coords": Synthesize(exemplar: "exemplar"),
    "shown": SampleExemplar(coords: "coords", input: "picture"),"#;
    desk.write("a.ron", graph("size_mm: 40, resolution: 40, tile: Both, seed: 1", nodes, "shown"));
    let (coords, shown, exemplar) =
        (coords(&desk, "coords"), values(&desk, "shown", ""), values(&desk, "exemplar", ""));
    assert_eq!((coords.len(), shown.len(), exemplar.len()), (1600, 4800, 3 * 24 * 18));
    for (p, [u, v]) in coords.iter().enumerate() {
        let from = v.floor() * 24.0 + u.floor();
        // Isometric synthesis copies pixels: coordinates are pixel centres.
        assert!((u.fract() - 0.5).abs() + (v.fract() - 0.5).abs() < 1e-4, "{u} {v}");
        for c in 0..3 {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the number of a pixel")]
            let wanted = exemplar[3 * from as usize + c];
            assert!((shown[3 * p + c] - wanted).abs() < 1e-4, "pixel {p}: {} is not {wanted}", shown[3 * p + c]);
        }
    }
}

/// From a single start pixel, coordinates are an affine map, which magnification keeps: all levels agree in the middle.
const LEVELS: &str = r#"    "picture": Image(path: "a.png", size_mm: 16),
    "j": JacobianFromAngleScale(angle: 90, scale: SCALE),
    "one": StartCoords(size: (1, 1), coords: [(8, 8)], levels: 3),
    "two": UpsampleCoords(coords: "one", jacobian: "j"),
    "four": UpsampleCoords(coords: "two", jacobian: "j"),
    "eight": UpsampleCoords(coords: "four", jacobian: "j"),
    "coarse": SampleExemplar(coords: "four", input: "picture", jacobian: "j"),
    "fine": SampleExemplar(coords: "eight", input: "picture", jacobian: "j"),"#;

#[test]
fn levels_in_between_show_the_texture_too() {
    let desk = Desk::new();
    picture(&desk, "a.png", (16, 16));
    let nodes = LEVELS.replace("SCALE", "1");
    desk.write("a.ron", graph("size_mm: 8, resolution: 8, tile: None, seed: 1", &nodes, "fine"));
    assert_eq!(
        [dump(&desk, "four", "")["spacing"].as_u64(), dump(&desk, "eight", "")["spacing"].as_u64()],
        [Some(2), Some(1)]
    );
    let (coarse, fine) = (values(&desk, "coarse", ""), values(&desk, "fine", ""));
    for (x, y) in (1..7).flat_map(|x| (1..7).map(move |y| (x, y))) {
        for at in (0..3).map(|c| 3 * (8 * y + x) + c) {
            assert!((coarse[at] - fine[at]).abs() < 1e-5, "({x}, {y}): {} is not {}", coarse[at], fine[at]);
        }
    }
    // The texture is not uniform.
    assert!((fine[3 * 27] - fine[3 * 28]).abs() > 0.01);
}

#[test]
fn samples_detail_between_coordinates() {
    let desk = Desk::new();
    picture(&desk, "a.png", (16, 16));
    // Features are half as large: neighbouring coordinates are two exemplar pixels apart.
    let nodes = LEVELS.replace("SCALE", "0.5").replace("angle: 90", "angle: 0");
    desk.write("a.ron", graph("size_mm: 8, resolution: 8, tile: None, seed: 1", &nodes, "fine"));
    let whole = values(&desk, "fine", "--resolution 16");
    let image = image::open(desk.path("a.png")).unwrap().to_rgb8();
    let linear = |v: u8| {
        let v = f64::from(v) / 255.0;
        if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
    };
    for (x, y) in (1..15u32).flat_map(|x| (1..15u32).map(move |y| (x, y))) {
        for c in 0..3 {
            let (made, wanted) = (whole[(3 * (16 * y + x)) as usize + c], linear(image.get_pixel(x, y)[c]));
            assert!((made - wanted).abs() < 1e-4, "({x}, {y}): {made} is not {wanted}");
        }
    }
}

#[test]
fn starts_from_earlier_result() {
    let desk = Desk::new();
    // All neighbours in a shifted exemplar fit exactly, so correction changes nothing.
    let at = |start: &str| {
        let nodes = format!(
            r#"    "ground": Perlin(size: 5),
    "exemplar": Exemplar(input: "ground", size: (32, 32), periodic: Yes),
    "shift": StartCoords(size: (1, 1), coords: [(21, 27)], levels: 5),
    "b": UpsampleCoords(coords: "shift"),
    "c": UpsampleCoords(coords: "b"),
    "d": UpsampleCoords(coords: "c"),
    "e": UpsampleCoords(coords: "d"),
    "f": UpsampleCoords(coords: "e"),
    "earlier": Synthesize(exemplar: "exemplar", seed: 3),
    "coords": Synthesize(exemplar: "exemplar", even_use: 0, {start}),"#
        );
        desk.write("a.ron", graph("size_mm: 32, resolution: 32, tile: Both, seed: 1", &nodes, "ground"));
        coords(&desk, "coords")
    };
    let is_shift = |map: &[[f64; 2]]| {
        let near = |v: f64, n: usize, from: f64| ((v - n as f64 - from + 16.0).rem_euclid(32.0) - 16.0).abs() < 1e-3;
        (0..map.len()).filter(|&p| near(map[p][0], p % 32, 5.5) && near(map[p][1], p / 32, 11.5)).count()
    };
    // Starts at the finest level, by the source's preset and by the default one, and at the coarsest level.
    assert_eq!(is_shift(&at("preset: Patent, start: \"f\"")), 1024);
    assert_eq!(is_shift(&at("start: \"f\"")), 1024);
    assert_eq!(is_shift(&at("start: \"shift\"")), 1024);
    let (without, with) = (at("seed: 4"), at("seed: 4, start: \"earlier\""));
    assert!(is_shift(&without) < 200);
    let earlier = coords(&desk, "earlier");
    let same = |map: &[[f64; 2]]| map.iter().zip(&earlier).filter(|(a, b)| a == b).count();
    assert!(same(&with) > 3 * same(&without) + 100, "{} {}", same(&with), same(&without));
}

#[test]
fn jacobians_follow_vectors_and_warps_and_multiply() {
    let desk = Desk::new();
    let nodes = r#"    "turn": JacobianFromAngleScale(angle: 90),
    "half": JacobianFromAngleScale(scale: 2),
    "both": JacobianMultiply(a: "turn", b: "half"),
    "along": JacobianFromVectors(x: 0, y: 3),
    "ramp": Gradient(),
    "warp": JacobianFromWarp(x: "ramp", amount: 4),
    "ground": Perlin(),"#;
    desk.write("a.ron", graph("size_mm: 16, resolution: 16, tile: None, seed: 1", nodes, "ground"));
    let middle = |node: &str| -> Vec<f64> { values(&desk, node, "")[4 * (8 * 16 + 8)..][..4].to_vec() };
    // The ramp rises by 1 over 16 mm, and the displacement by 8 mm.
    for (node, wanted) in [
        ("turn", [0.0, 1.0, -1.0, 0.0]),
        ("half", [0.5, 0.0, 0.0, 0.5]),
        ("both", [0.0, 0.5, -0.5, 0.0]),
        ("along", [0.0, 1.0, -1.0, 0.0]),
        ("warp", [1.5, 0.0, 0.0, 1.0]),
    ] {
        let made = middle(node);
        assert!(made.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-4), "{node}: {made:?}");
    }
}

#[test]
fn weights_and_encoding_decide_what_is_compared() {
    let desk = Desk::new();
    let at = |more: &str| {
        let nodes = format!(
            r#"    "ground": Perlin(size: 5),
    "other": Worley(size: 4),
    "color": GradientMap(input: "ground", stops: [(0, "\#000"), (1, "\#fc8")]),
    "exemplar": Exemplar(input: "color", size: (32, 32){more}),
    "coords": Synthesize(exemplar: "exemplar", size: (64, 64)),"#
        )
        .replace("\\#", "#");
        desk.write("a.ron", graph("size_mm: 48, resolution: 48, tile: Both, seed: 1", &nodes, "ground"));
        coords(&desk, "coords")
    };
    let plain = at("");
    assert_eq!(plain, at(", others: [\"other\"], weights: [1, 0]"));
    assert_ne!(plain, at(", others: [\"other\"]"));
    assert_ne!(at(", others: [\"other\"], weights: [1, 0.2]"), at(", others: [\"other\"]"));
    assert_ne!(plain, at(", compare: Linear"));
}

/// A graph with pictures of four resolutions and the given widths in mm.
fn sizes(desk: &Desk, [other, guide, mask]: [&str; 3]) {
    picture(desk, "a.png", (32, 32));
    picture(desk, "b.png", (64, 48));
    picture(desk, "guide.png", (7, 5));
    // Only the right half may be shown.
    image::GrayImage::from_fn(4, 9, |x, _| image::Luma([if x < 2 { 0 } else { 255 }]))
        .save(desk.path("mask.png"))
        .unwrap();
    let nodes = format!(
        r#"    "a": Image(path: "a.png", size_mm: 16),
    "b": Image(path: "b.png"{other}),
    "guide": Image(path: "guide.png"{guide}),
    "mask": Image(path: "mask.png"{mask}, filter: Nearest),
    "exemplar": Exemplar(input: "a", others: ["b"], guide: "guide", mask: "mask"),
    "coords": Synthesize(exemplar: "exemplar", guide: "guide"),
    "shown": SampleExemplar(coords: "coords", input: "b"),"#
    );
    desk.write("a.ron", graph("size_mm: 48, resolution: 48, tile: Both, seed: 1", &nodes, "shown"));
}

#[test]
fn maps_guides_and_masks_of_other_sizes_are_aligned_by_place() {
    let desk = Desk::new();
    sizes(&desk, [", size_mm: 16"; 3]);
    let ran = desk.shibo("render a.ron --no-cache").expect(0);
    assert!(!ran.stderr.contains("advice"), "{}", ran.stderr);
    let coords = coords(&desk, "coords");
    let hidden = coords.iter().filter(|c| c[0] < 16.0).count();
    assert!(hidden * 100 < coords.len(), "{hidden} of {} show what the mask hides", coords.len());
}

#[test]
fn advises_on_pictures_with_another_place() {
    for (port, sizes_mm, words) in [
        ("others", ["", ", size_mm: 16", ", size_mm: 16"], "`others` is a picture of 48x48 mm at (0, 0)"),
        ("guide", [", size_mm: 16", ", size_mm: 8", ", size_mm: 16"], "`guide` is a picture of 8x8 mm at (0, 0)"),
        ("mask", [", size_mm: 16", ", size_mm: 16", ", size_mm: 16, position: (2, 0)"], "16x16 mm at (2, 0)"),
    ] {
        let desk = Desk::new();
        sizes(&desk, sizes_mm);
        let ran = desk.shibo("render a.ron --no-cache").expect(0);
        let flat = ran.stderr.split_whitespace().filter(|w| *w != "\u{2502}").collect::<Vec<_>>().join(" ");
        assert!(flat.contains(words) && flat.contains("`input` one of 16x16 mm"), "{port}: {flat}");
        assert!(ran.stderr.contains("advice") && ran.stderr.contains("a.ron:9:"), "{port}: {}", ran.stderr);
    }
    // A mask three times as wide hides the whole exemplar.
    let desk = Desk::new();
    sizes(&desk, [", size_mm: 16", ", size_mm: 16", ""]);
    let ran = desk.shibo("render a.ron --no-cache").expect(1);
    assert!(ran.stderr.contains("the mask leaves nothing") && ran.stderr.contains("a.ron:9:"), "{}", ran.stderr);
}

/// Coordinates, and the place where a tiling canvas begins, are found on the exemplar's pixels.
#[test]
fn the_layout_does_not_depend_on_the_resolution() {
    let desk = Desk::new();
    let nodes = r#"    "cells": Worley(size: 5, jitter: 0.6),
    "exemplar": Exemplar(input: "cells.border", size_mm: 24, size: (32, 32)),
    "coords": Synthesize(exemplar: "exemplar"),
    "shown": SampleExemplar(coords: "coords", input: "cells.border"),"#;
    let at = |resolution: u32| {
        let canvas = format!("size_mm: 60, resolution: {resolution}, tile: Both, seed: 7");
        desk.write("a.ron", graph(&canvas, nodes, "shown"));
        coords(&desk, "coords")
    };
    let first = at(40);
    assert_eq!(first.len(), 80 * 80);
    assert!([17, 80, 256].into_iter().all(|resolution| at(resolution) == first));
}
