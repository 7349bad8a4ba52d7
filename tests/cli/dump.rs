//! `shibo dump`, end to end.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::Desk;
use serde_json::{Value as Json, json};

fn count(json: &Json, key: &str) -> usize {
    json[key].as_array().unwrap_or_else(|| panic!("no list `{key}` in {json}")).len()
}

#[test]
fn objects_print_their_data() {
    let desk = Desk::with_graph();
    let points = desk.shibo("dump a.ron points --format json").expect(0).json();
    assert_eq!(points["type"], "Points");
    let n = count(&points, "points");
    assert!(n > 20 && points["points"][0].as_array().unwrap().len() == 2);
    let lattice = desk.shibo("dump a.ron links").expect(0).json();
    assert_eq!((lattice["type"].as_str(), count(&lattice, "points")), (Some("Lattice"), n));
    let links = count(&lattice, "links");
    assert_eq!(count(&lattice, "alive"), links);
    assert!(lattice.get("velocities").is_none() && lattice.get("broken").is_none());
    let springs = desk.shibo("dump a.ron springs").expect(0).json();
    assert_eq!(springs["type"], "SpringNet");
    assert_eq!(
        ["stiffness", "damping", "rest_length", "mass"].map(|key| count(&springs, key)),
        [links, links, links, n]
    );
    let moved = desk.shibo("dump a.ron moved").expect(0).json();
    assert_eq!((moved["type"].as_str(), count(&moved, "velocities")), (Some("Lattice"), n));
    assert_eq!(moved["broken"], json!([]));
    let segments = desk.shibo("dump a.ron wrinkles").expect(0).json();
    assert_eq!(segments["type"], "Segments");
    assert_eq!(segments["segments"][0].as_array().unwrap().len(), 4);
    assert!(segments["width"].is_array());
}

#[test]
fn fields_print_their_values_by_rows() {
    let desk = Desk::with_graph();
    let field = desk.shibo("dump a.ron strokes.mask --resolution 8x4").expect(0).json();
    assert_eq!((&field["type"], &field["size"], &field["channels"]), (&json!("Gray"), &json!([8, 4]), &json!(1)));
    assert_eq!(count(&field, "values"), 32);
    let whole = desk.shibo("dump a.ron bumps").expect(0).json();
    assert_eq!(whole["size"], json!([96, 96]));
    // Values are equal on any number of threads, with and without a cache.
    let one = desk.shibo("dump a.ron bumps --threads 1 --no-cache").expect(0).stdout;
    assert_eq!(one, desk.shibo("dump a.ron bumps --threads 8").expect(0).stdout);
}

#[test]
fn dumps_fields_at_points() {
    let desk = Desk::with_graph();
    let field = desk.shibo("dump a.ron bumps --resolution 40").expect(0).json();
    // The centres of pixels (0, 0), (3, 0) and (0, 2).
    desk.write("p.csv", "0.5,0.5\n3.5, 0.5\r\n\n0.5,2.5\n");
    let at = desk.shibo("dump a.ron bumps --resolution 40 --at p.csv").expect(0).json();
    assert_eq!((&at["type"], &at["channels"], count(&at, "values")), (&json!("Gray"), &json!(1), 3));
    for (i, pixel) in [0, 3, 80].into_iter().enumerate() {
        let (a, b) = (at["values"][i].as_f64().unwrap(), field["values"][pixel].as_f64().unwrap());
        assert!((a - b).abs() < 1e-5, "{a} {b}");
    }
    for (text, line) in
        [("1,2\nx,3\n", "line 2"), ("1\n", "line 1"), ("1,2,3\n1,2", "line 2"), ("1,2\n1,nan", "line 2")]
    {
        desk.write("p.csv", text);
        let ran = desk.shibo("dump a.ron bumps --at p.csv").expect(1);
        assert!(ran.stderr.contains("p.csv") && ran.stderr.contains(line), "{text}: {}", ran.stderr);
        assert_eq!(ran.stdout, "");
    }
    desk.shibo("dump a.ron bumps --at none.csv").expect(1);
    desk.shibo("dump a.ron bumps --at cache").expect(1);
    desk.write("p.csv", "1,2\n");
    let ran = desk.shibo("dump a.ron points --at p.csv").expect(2);
    assert!(ran.stderr.contains("Points"), "{}", ran.stderr);
    desk.write("p.csv", "1,2,3\n");
    let ran = desk.shibo("dump a.ron bumps --at p.csv").expect(2);
    assert!(ran.stderr.contains("not that of a mesh"), "{}", ran.stderr);
}

/// A field of a mesh is read at the nearest point of the surface.
#[test]
fn dumps_mesh_fields_at_points_in_space() {
    let desk = Desk::new();
    let graph = r#"( version: 1, canvas: (size_mm: 120, resolution: 2048, tile: None), nodes: {
        "box": MeshShape(shape: Cube, size: (60, 40, 20)), "atlas": MeshAtlas(mesh: "box", charts: New),
        "places": BakePosition(atlas: "atlas"), "other": MeshAtlas(mesh: "box"),
        "two": Blend(base: "places", top: BakePosition(atlas: "other")),
    }, outputs: { "o": "places" } )"#;
    desk.write("m.ron", graph);
    // Beside a face, on an edge, beyond a corner.
    desk.write("p.csv", "7,3,35\n30,20,-4\n90, 80, 70\n");
    let at = desk.shibo("dump m.ron places --at p.csv").expect(0).json();
    let values: Vec<f64> = at["values"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
    for (value, wanted) in values.iter().zip([7.0, 3.0, 10.0, 30.0, 20.0, -4.0, 30.0, 20.0, 10.0]) {
        assert!((value - wanted).abs() < 0.05, "{values:?}");
    }
    assert_eq!(values.len(), 9);
    let ran = desk.shibo("dump m.ron two --at p.csv").expect(2);
    assert!(ran.stderr.contains("several meshes") && ran.stderr.contains("`other`"), "{}", ran.stderr);
}

/// A field that depends on whole pictures or wide halos has the value of the pixel at that point.
#[test]
fn dumps_whole_picture_fields_from_their_pixels() {
    let desk = Desk::new();
    let graph = r#"( version: 1, canvas: (size_mm: 64, resolution: 64, tile: Both), nodes: {
        "noise": Perlin(size: 8), "wide": Blur(input: "noise", radius: 9),
        "mask": Threshold(input: "noise", level: 0.5), "parts": FloodFill(mask: "mask"), "drawn": RegionRandom(ids: "parts"),
    }, outputs: { "o": "drawn" } )"#;
    desk.write("a.ron", graph);
    let places: Vec<[usize; 2]> = (0..300).map(|k| [k * 7 % 64, k * 11 % 64]).collect();
    let lines = places.iter().map(|[x, y]| format!("{}.3,{}.8\n", x, y)).collect::<String>();
    desk.write("p.csv", lines);
    for node in ["wide", "drawn"] {
        let whole = desk.shibo(&format!("dump a.ron {node}")).expect(0).json();
        let at = desk.shibo(&format!("dump a.ron {node} --at p.csv")).expect(0).json();
        assert_eq!(count(&at, "values"), 300);
        for ([x, y], value) in places.iter().zip(at["values"].as_array().unwrap()) {
            assert_eq!(*value, whole["values"][y * 64 + x], "{node} at {x}, {y}");
        }
    }
    // A field with a small halo is evaluated exactly, not at the centre of the pixel.
    let whole = desk.shibo("dump a.ron noise").expect(0).json();
    let at = desk.shibo("dump a.ron noise --at p.csv").expect(0).json();
    assert_ne!(at["values"][0], whole["values"][0]);
}

#[test]
fn unknown_nodes_and_ports_are_wrong_usage() {
    let desk = Desk::with_graph();
    for (node, help) in [("bump", "did you mean `bumps`?"), ("strokes.msk", "did you mean `mask`?"), ("", "no node")] {
        let ran = desk.run(["dump", "a.ron", node]).expect(2);
        assert!(ran.stderr.contains(help), "{}", ran.stderr);
        assert_eq!(ran.stdout, "");
    }
}

#[test]
fn dumps_nodes_inside_sub_graphs() {
    let desk = Desk::with_graph();
    let outer = r#"( version: 1, imports: { "inner": "a.ron" },
        nodes: { "use": Use(graph: "inner", with: { "size": 3 }) }, outputs: { "o": "use.bumps" } )"#;
    desk.write("outer.ron", outer);
    let points = desk.shibo("dump outer.ron use/points").expect(0).json();
    assert_eq!(points["type"], "Points");
    let bumps = |name: &str| desk.run(["dump", "outer.ron", name]).expect(0).json();
    // The name of a sub-graph alone means its main output.
    assert_eq!(bumps("use"), bumps("use/bumps"));
    assert_eq!((bumps("use.bumps"), bumps("use.mask")), (bumps("use"), bumps("use/strokes.mask")));
    let ran = desk.shibo("dump outer.ron use/nothing").expect(2);
    assert!(ran.stderr.contains("`use` is a sub-graph without `nothing`"), "{}", ran.stderr);
}

/// A picture of one channel enters a port for any field as grey, a picture of more channels as colour. A node that
/// passes its input on unchanged keeps that type.
#[test]
fn pictures_of_one_channel_stay_grey() {
    let desk = Desk::new();
    let ramp: Vec<u8> = (0..48).map(|n| n * 5).collect();
    let gray = image::GrayImage::from_raw(8, 6, ramp.clone()).unwrap();
    gray.save(desk.path("gray.png")).unwrap();
    image::GrayAlphaImage::from_fn(8, 6, |x, y| image::LumaA([gray.get_pixel(x, y)[0], 200]))
        .save(desk.path("la.png"))
        .unwrap();
    image::RgbImage::from_raw(4, 4, ramp).unwrap().save(desk.path("rgb.png")).unwrap();
    for (file, ty, channels) in [("gray.png", "Gray", 1), ("la.png", "Gray", 1), ("rgb.png", "Rgb", 3)] {
        desk.write(
            "a.ron",
            format!(
                "(canvas: (size_mm: 8, resolution: 16), nodes: {{ \"p\": Image(path: \"{file}\"), \
                 \"same\": Warp(input: \"p\", amount: 0), \"soft\": Blur(input: \"same\", radius: 1), \
                 \"mixed\": Blend(base: \"p\", top: \"soft\"), \"height\": Emboss(input: \"p\"), \
                 \"tinted\": Blend(base: \"p\", top: \"#ff0000\"), \"rough\": Material(roughness: \"{}\", height: \"height\") }}, \
                 outputs: {{ \"soft\": \"soft\", \"p\": \"p\", \"same\": \"same\", \"height\": \"height\" }})",
                if ty == "Gray" { "soft" } else { "p" }
            ),
        );
        let ran = desk.shibo("render a.ron").expect(0);
        assert!(!ran.stderr.contains("error"), "{file}: {}", ran.stderr);
        let [same, soft, mixed, tinted] =
            ["same", "soft", "mixed", "tinted"].map(|node| desk.shibo(&format!("dump a.ron {node}")).expect(0).json());
        for dump in [&same, &soft, &mixed] {
            assert_eq!((&dump["type"], &dump["channels"]), (&json!(ty), &json!(channels)), "{file}");
        }
        assert_eq!(tinted["type"], "Rgb");
        // A passed-on input equals the output of a node that changes nothing.
        let picture = desk.shibo(&format!("dump a.ron p.{}", ty.to_lowercase())).expect(0).json();
        assert_eq!(same["values"], picture["values"], "{file}");
    }
    // The type is that of the chosen layer, and unknown if the file is missing.
    desk.write("a.ron", "(nodes: { \"p\": Image(path: \"rgb.png\", layer: \"G\"), \"s\": Blur(input: \"p\"), \"n\": HeightToNormal(input: \"s\") })");
    desk.shibo("check a.ron").expect(0);
    desk.write(
        "a.ron",
        "(nodes: { \"p\": Image(path: \"rgb.png\"), \"s\": Blur(input: \"p\"), \"n\": HeightToNormal(input: \"s\") })",
    );
    assert!(desk.shibo("check a.ron").expect(1).stderr.contains("takes Gray"));
    desk.write(
        "a.ron",
        "(nodes: { \"p\": Image(path: \"no.png\"), \"s\": Blur(input: \"p\"), \"n\": HeightToNormal(input: \"s\") })",
    );
    let errors = desk.shibo("check a.ron --format json").expect(1).json();
    assert_eq!(errors["errors"].as_array().unwrap().len(), 1, "{errors}");
}
