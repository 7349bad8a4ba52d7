//! Files made of heights, end to end: films, greys for a laser, contour lines, and pictures with the range of their
//! values.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::export::{files, text};
use crate::support::Desk;
use image::DynamicImage;

/// A round hill of 2 mm on 60 × 30 mm, and a wave that tiles.
const GRAPH: &str = r#"(
  canvas: (size_mm: (60, 30), resolution: (120, 60), tile: Both, seed: 3),
  nodes: {
    "hill": "= 2 * exp(-((x - 30) * (x - 30) + (y - 15) * (y - 15)) / 40)",
    "wave": "= 0.5 * sin(360 * u)",
    "noise": Perlin(size: 10),
    "height": Remap(input: "noise", to: (-0.4, 0.1)),
    "skin": Material(height: "height"),
    "bare": Material(roughness: 0.5),
  },
  outputs: { OUTPUTS },
)"#;

fn desk(outputs: &str) -> Desk {
    let desk = Desk::new();
    desk.write("a.ron", GRAPH.replace("OUTPUTS", outputs));
    desk
}

fn picture(desk: &Desk, file: &str) -> DynamicImage {
    image::open(desk.path(file)).unwrap()
}

/// The heights of the graph's output `exact`, in mm.
fn heights(desk: &Desk) -> Vec<f32> {
    let layer = exr::prelude::read_first_flat_layer_from_file(desk.path("out/exact.exr")).unwrap().layer_data;
    layer.channel_data.list[0].sample_data.values_as_f32().collect()
}

/// The value of a tag of a little-endian TIFF file: a number, or a quotient of two.
fn tag(bytes: &[u8], wanted: u16) -> Option<f64> {
    let short = |at: usize| u16::from_le_bytes(bytes[at..at + 2].try_into().unwrap());
    let long = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
    let start = long(4) as usize;
    let entry = (0..short(start) as usize).map(|k| start + 2 + 12 * k).find(|at| short(*at) == wanted)?;
    Some(match short(entry + 2) {
        5 => f64::from(long(long(entry + 8) as usize)) / f64::from(long(long(entry + 8) as usize + 4)),
        3 => f64::from(short(entry + 8)),
        _ => f64::from(long(entry + 8)),
    })
}

#[test]
fn films_add_up_to_the_nearest_depth_at_every_pixel() {
    let desk = desk(
        r#""f": Films(height: "skin", films: 3, margin: 5, format: Png), "exact": File(from: "height", format: Exr)"#,
    );
    desk.shibo("render a.ron -o out").expect(0);
    let names: Vec<String> = files(&desk, "out").into_iter().collect();
    assert_eq!(names, ["exact.exr", "f_1.png", "f_2.png", "f_3.png", "f_films.json"]);
    let table: serde_json::Value = serde_json::from_str(&text(&desk, "out/f_films.json")).unwrap();
    let number = |value: &serde_json::Value| value.as_f64().unwrap();
    let depths: Vec<f64> = table["depths_mm"].as_array().unwrap().iter().map(number).collect();
    let steps: Vec<f64> = table["films"].as_array().unwrap().iter().map(|film| number(&film["step_mm"])).collect();
    let (datum, worst) = (number(&table["datum_mm"]), number(&table["greatest_error_mm"]));
    assert!(depths.is_sorted() && depths.len() == 4 && depths[0] == 0.0, "{depths:?}");
    let films: Vec<_> = (1..=3).map(|k| picture(&desk, &format!("out/f_{k}.png")).to_luma8()).collect();
    assert_eq!(films[0].dimensions(), (140, 80), "10 pixels of margin on each side");
    for (k, height) in (0..).zip(heights(&desk)) {
        let open = films.iter().zip(&steps).filter(|(film, _)| film.get_pixel(k % 120 + 10, k / 120 + 10).0[0] == 0);
        let etched: f64 = open.map(|(_, step)| step).sum();
        let depth = datum - f64::from(height);
        let nearest = depths.iter().map(|level| (level - depth).abs()).fold(f64::INFINITY, f64::min);
        assert!(((etched - depth).abs() - nearest).abs() < 1e-5 && nearest <= worst + 1e-5, "{k}: {etched} {depth}");
    }
    let marks = |film: &image::GrayImage| film.rows().take(10).flatten().filter(|pixel| pixel.0[0] == 0).count();
    assert!(marks(&films[0]) > 0 && marks(&films[0]) < marks(&films[2]), "squares count the films");
}

#[test]
fn films_of_tiff_have_one_bit_and_their_size() {
    let desk = desk(r#""f": Films(height: "height", films: 2, tiles: (2, 1), margin: 0)"#);
    desk.shibo("render a.ron -o out").expect(0);
    let bytes = desk.read("out/f_2.tif");
    let tags = [256, 257, 258, 259, 262, 277, 282, 283, 296].map(|number| tag(&bytes, number));
    assert_eq!(tags, [240.0, 60.0, 1.0, 8.0, 0.0, 1.0, 20.0, 20.0, 3.0].map(Some));
}

#[test]
fn films_of_svg_are_areas_in_mm() {
    let desk = desk(r#""f": Films(height: "hill", depths: [0.5, 1, 1.5, 2], datum: 2, margin: 6, format: Svg)"#);
    desk.shibo("render a.ron -o out").expect(0);
    let drawing = text(&desk, "out/f_4.svg");
    assert!(drawing.contains(r#"width="72mm" height="42mm" viewBox="0 0 72 42""#), "{drawing}");
    assert!(drawing.contains(r#"fill-rule="evenodd""#) && drawing.contains("L0.000 0.000L"), "{drawing}");
    assert!(drawing.matches("<rect").count() == 10 + 4, "{drawing}");
}

#[test]
fn greys_burn_the_depth_of_each_height() {
    let desk = desk(
        r#""g": Engrave(height: "height", calibration: [(0, 0), (0.1, 0.5), (0.6, 1)], deep: White, depth: U16),
           "p": Engrave(height: "height", calibration: [(0, 0), (0.3, 1)], passes: 2, format: Tiff),
           "exact": File(from: "height", format: Exr)"#,
    );
    desk.shibo("render a.ron -o out").expect(0);
    let exact = heights(&desk);
    let datum = exact.iter().copied().fold(f32::MIN, f32::max);
    let greys = picture(&desk, "out/g.png").to_luma16();
    for (pixel, height) in greys.pixels().zip(&exact) {
        let (depth, grey) = (datum - height, f32::from(pixel.0[0]) / 65_535.0);
        let wanted = if depth < 0.1 { 5.0 * depth } else { 0.5 + depth - 0.1 };
        assert!((grey - wanted).abs() < 1e-4, "{depth}: {grey} {wanted}");
    }
    let black = picture(&desk, "out/p.tiff").to_luma8();
    for (pixel, height) in black.pixels().zip(&exact) {
        let wanted = 1.0 - (datum - height) / 0.6;
        assert!((f32::from(pixel.0[0]) / 255.0 - wanted).abs() < 0.003);
    }
    assert_eq!(tag(&desk.read("out/p.tiff"), 282), Some(20.0));
}

/// The length of the lines of each level, and the least and greatest distance of their points from the middle.
fn lines(drawing: &str) -> Vec<(f64, usize, f64, f64)> {
    let group = |line: &str| {
        let level = line.strip_prefix("<g id=\"level_")?.split('"').next()?.parse().ok()?;
        let data = line.split(" d=\"").nth(1)?.split('"').next()?;
        let points = data.split(['M', 'L', 'Z']).filter(|point| !point.is_empty());
        let far = points.map(|point| {
            let (x, y) = point.split_once(' ').unwrap();
            f64::hypot(x.parse::<f64>().unwrap() - 30.0, y.parse::<f64>().unwrap() - 15.0)
        });
        let (low, high) = far.fold((f64::INFINITY, 0.0_f64), |(a, b), r| (a.min(r), b.max(r)));
        Some((level, data.matches('Z').count(), low, high))
    };
    drawing.lines().filter_map(group).collect()
}

#[test]
fn contours_lie_at_their_level() {
    let desk = desk(
        r#""c": Contours(height: "hill", step: 0.5), "d": Contours(height: "hill", levels: [0.3, 1.2], format: Dxf),
           "w": Contours(height: "wave", levels: [0])"#,
    );
    desk.shibo("render a.ron -o out").expect(0);
    let found = lines(&text(&desk, "out/c.svg"));
    assert_eq!(found.iter().map(|level| level.0).collect::<Vec<_>>(), [0.5, 1.0, 1.5]);
    for (level, closed, low, high) in found {
        let radius = (40.0 * (2.0_f64 / level).ln()).sqrt();
        assert!(closed == 1 && low > radius - 0.03 && high < radius + 0.03, "{level}: {low} {high} {radius}");
    }
    let file = text(&desk, "out/d.dxf");
    let groups: Vec<&str> = file.lines().map(str::trim).collect();
    let polylines = groups.chunks(2).filter(|pair| pair[0] == "0" && pair[1] == "POLYLINE").count();
    assert!(polylines == 2 && file.contains("Z_300_UM") && file.contains("Z_1200_UM"));
    // The wave is 0 in the middle and at the rim, where its lines lie as well.
    let drawing = text(&desk, "out/w.svg");
    assert!(["30.000 0.000", "30.000 30.000"].iter().all(|end| drawing.contains(end)), "{drawing}");
}

#[test]
fn a_fitted_range_uses_all_integers_and_states_its_heights() {
    let desk = desk(
        r#""t": File(from: "height", format: Tiff, depth: U16, range: Fit), "p": File(from: "height", range: Fit),
           "m": File(from: "skin", format: Png, range: (-1, 1)), "exact": File(from: "height", format: Exr)"#,
    );
    desk.shibo("render a.ron -o out").expect(0);
    let exact = heights(&desk);
    let (low, high) = exact.iter().fold((f32::MAX, f32::MIN), |(a, b), v| (a.min(*v), b.max(*v)));
    for file in ["out/t.tiff", "out/p.png"] {
        let samples = picture(&desk, file).to_luma16();
        let codes: Vec<u16> = samples.pixels().map(|pixel| pixel.0[0]).collect();
        assert!(codes.contains(&0) && codes.contains(&u16::MAX), "{file}");
        let back = |code: u16| low + (high - low) * f32::from(code) / 65_535.0;
        assert!(codes.iter().zip(&exact).all(|(code, height)| (back(*code) - height).abs() < 1e-5), "{file}");
        let bytes = desk.read(file);
        let has = |text: &str| bytes.windows(text.len()).any(|part| part == text.as_bytes());
        assert!(has("shibo:pixel_mm"), "{file}");
    }
    let bytes = desk.read("out/m_height.png");
    let has = |text: &str| bytes.windows(text.len()).any(|part| part == text.as_bytes());
    assert!(has("shibo:height_mm\0-1 1") && has("shibo:pixel_mm\x000.5 0.5"));
    let told = desk.shibo("render a.ron -o parts --part 1/1 --output p").expect(2).stderr;
    assert!(told.contains("range of the whole picture"), "{told}");
}

#[test]
fn refuses_what_cannot_be_made_with_place_and_remedy() {
    for (output, code, message, help) in [
        (r#"Films(height: "bare")"#, "type-mismatch", "has none", "channel `height`"),
        (r#"Films(films: 3)"#, "missing-input", "`Films` has no `height`", "height: \"node\""),
        (r#"Films(height: "height", films: 0)"#, "out-of-range", "a whole number from 1 to 16", ""),
        (r#"Films(height: "height", depths: [0.2, 0.1])"#, "bad-value", "must rise", "sort them"),
        (r#"Films(height: "height", depths: [0.2], code: Binary)"#, "bad-value", "even depths", "leave"),
        (r#"Films(height: "height", depths: [0.05, 0.1])"#, "too-deep", "mm deep at (", "add a depth"),
        (r#"Films(height: "height", datum: -3)"#, "bad-value", "nothing to etch", "leave `datum` out"),
        (r#"Films(height: "height", tiles: (400, 251), format: Svg)"#, "too-large", "at most 100000", "`format: Tiff`"),
        (r#"Films(height: "height", margin: -1)"#, "out-of-range", "from 0 to 200", ""),
        (
            r#"Engrave(height: "height", calibration: [(0, 0), (0.1, 1)])"#,
            "too-deep",
            "calibration ends at 0.1",
            "passes: ",
        ),
        (r#"Engrave(height: "height", calibration: [(0, 0), (0, 1)])"#, "bad-value", "must rise", "sort"),
        (r#"Engrave(height: "height", calibration: [(0, 0), (1, 255)])"#, "out-of-range", "0 to 1", "255"),
        (r#"Engrave(height: "height", calibration: 4)"#, "type-mismatch", "a list of pairs", ""),
        (r#"Contours(height: "height", step: 0.2, levels: [0])"#, "bad-value", "both tell the levels", "leave `step`"),
        (r#"Contours(height: "height", step: 0)"#, "out-of-range", "from 0.001 to 100", ""),
        (r#"File(from: "height", range: Fitted)"#, "unknown-variant", "Fitted", "Fit"),
    ] {
        // The second output must not be written without the first one.
        let desk = desk(&format!("\"bad\": {output}, \"good\": File(from: \"hill\", range: Fit)"));
        let told = desk.shibo("render a.ron -o out").expect(1).stderr;
        assert!(told.contains(code) && told.contains(message) && told.contains(help), "{output}: {told}");
        assert!(told.contains("a.ron:"), "{told}");
        let left = if desk.path("out").exists() { files(&desk, "out") } else { Default::default() };
        assert!(left.is_empty(), "{output}: {left:?}");
    }
}

/// A drawing without lines and a blank picture are told in every run, from the cache as well.
#[test]
fn empty_drawings_and_blank_pictures_are_told() {
    let desk = desk(r#""c": Contours(height: "height", levels: [99]), "g": Engrave(height: "height", datum: -3)"#);
    for run in ["a", "b"] {
        let told = desk.shibo(&format!("render a.ron -o {run}")).expect(0).stderr;
        assert!(told.contains("the level 99 mm has no line: the heights range from -0."), "{told}");
        assert!(told.contains("no height lies below the datum of -3 mm: the picture is blank"), "{told}");
    }
}

#[test]
fn a_canvas_that_does_not_tile_makes_one_tile() {
    let desk = Desk::new();
    let outputs = r#""f": Films(height: "height", tiles: (1, 2))"#;
    desk.write("a.ron", GRAPH.replace("OUTPUTS", outputs).replace("tile: Both", "tile: X"));
    let told = desk.shibo("render a.ron -o out").expect(1).stderr;
    assert!(told.contains("does-not-tile") && told.contains("canvases down"), "{told}");
}

#[test]
fn files_have_the_same_bytes_for_any_threads_memory_and_cache() {
    let outputs = r#""f": Films(height: "height", films: 2), "g": Engrave(height: "height"), "c": Contours(height: "height"),
        "t": File(from: "height", format: Tiff, range: Fit)"#;
    let desk = desk(outputs);
    for run in ["-o a --threads 1", "-o b --threads 4 --memory 64", "-o c --no-cache"] {
        desk.shibo(&format!("render a.ron {run}")).expect(0);
    }
    let names = files(&desk, "a");
    assert_eq!(names.len(), 6, "{names:?}");
    for name in names {
        let [a, b, c] = ["a", "b", "c"].map(|folder| desk.read(&format!("{folder}/{name}")));
        assert!(a == b && b == c, "{name}");
    }
}
