//! The canvas in the command: resolutions of canvases that are not square, and outputs that do not tile.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::Desk;

const WIDE: &str = r#"(
  canvas: (size_mm: (40, 20), resolution: 64, tile: Both),
  nodes: { "bumps": Perlin(size: 5) },
  outputs: { "bumps": "bumps" },
)"#;

/// Width and height of a picture of the desk.
fn size(desk: &Desk, name: &str) -> (u32, u32) {
    image::image_dimensions(desk.path(name)).unwrap()
}

#[test]
fn one_number_keeps_the_shape_of_the_canvas() {
    let desk = Desk::new();
    desk.write("a.ron", WIDE);
    for (option, expected) in [("", (64, 32)), (" --resolution 32", (32, 16)), (" --resolution 32x16", (32, 16))] {
        let ran = desk.shibo(&format!("render a.ron --no-cache{option}")).expect(0);
        assert_eq!(size(&desk, "out/bumps.png"), expected, "{option}");
        assert!(!ran.stderr.contains("warning"), "{option}: {}", ran.stderr);
    }
    let dumped = desk.shibo("dump a.ron bumps --resolution 8 --no-cache").expect(0).json();
    assert_eq!(dumped["size"], serde_json::json!([8, 4]));
}

#[test]
fn a_pair_is_taken_literally_with_a_warning() {
    let desk = Desk::new();
    desk.write("a.ron", WIDE);
    let ran = desk.shibo("render a.ron --no-cache --resolution 32x32").expect(0);
    assert_eq!(size(&desk, "out/bumps.png"), (32, 32));
    assert_eq!(ran.stderr.matches("warning[advice]").count(), 1, "{}", ran.stderr);
    assert!(ran.stderr.contains("squashed") && ran.stderr.contains("32x16"), "{}", ran.stderr);
    desk.write("b.ron", WIDE.replace("resolution: 64", "resolution: (64, 64)"));
    let checked = desk.shibo("check b.ron").expect(0);
    assert!(checked.stderr.contains("squashed") && checked.stderr.contains("b.ron:2:43"), "{}", checked.stderr);
}

#[test]
fn a_node_that_breaks_the_tiling_is_shown_once_in_few_lines() {
    let desk = Desk::new();
    let nodes: String = (0..4).map(|i| format!("    \"a{i}\": \"= ramp\",\n\n\n")).collect();
    let outputs: String = (0..4).map(|i| format!("    \"o{i}\": \"a{i}\",\n\n")).collect();
    desk.write(
        "a.ron",
        format!("(\n  canvas: (size_mm: 20, resolution: 16),\n  nodes: {{\n    \"ramp\": Gradient(),\n{nodes}  }},\n  outputs: {{\n{outputs}  }},\n)"),
    );
    for command in ["check a.ron", "render a.ron --no-cache --quiet"] {
        let ran = desk.shibo(command).expect(0);
        let lines = ran.stderr.trim_end().lines().count();
        assert_eq!(ran.stderr.matches("does not repeat with the canvas").count(), 1, "{command}: {}", ran.stderr);
        assert!(lines <= 9 && ran.stderr.contains("a.ron:4:13"), "{command}: {lines} lines\n{}", ran.stderr);
    }
}

#[test]
fn a_formula_that_grows_breaks_the_tiling_where_the_growth_shows() {
    let desk = Desk::new();
    let advice = |outputs: &str| {
        desk.write(
            "a.ron",
            format!(
                "(canvas: (size_mm: 20, resolution: 16), nodes: {{ \"place\": \"= x / 5\", \"twice\": \"= place * 2\",\n\
                 \"waves\": \"= sin(twice * 360) + place % 1\", \"soft\": Blur(input: \"twice\", radius: 1),\n\
                 \"lost\": \"= place * place\" }}, outputs: {{ {outputs} }})"
            ),
        );
        let ran = desk.shibo("check a.ron").expect(0);
        ran.stderr.lines().filter(|line| line.contains("not tile")).map(str::to_owned).collect::<Vec<_>>().join(" ")
    };
    assert_eq!(advice("\"a\": \"waves\""), "");
    assert!(advice("\"a\": \"waves\", \"b\": \"twice\"").contains("the output `b` does not tile: node `twice`"));
    assert!(advice("\"a\": \"soft\"").contains("the output `a` does not tile: node `twice`"));
    assert!(advice("\"a\": \"lost\"").contains("the output `a` does not tile: node `lost`"));
    // The remedy is one for formulas.
    let ran = desk.shibo("check a.ron").expect(0);
    assert!(ran.stderr.contains("fract(4 * v)"), "{}", ran.stderr);
}

#[test]
fn vectors_go_only_with_vectors() {
    let desk = Desk::new();
    let check = |top: &str| {
        desk.write(
            "a.ron",
            format!(
                "(nodes: {{ \"flow\": Curl(size: 9), \"grey\": Perlin(size: 5), \"other\": Curl(size: 4),\n\
                 \"both\": Blend(base: \"flow\", top: {top}), \"bent\": Warp(input: \"grey\", by: \"both\"),\n\
                 \"moved\": Transform(input: \"both\", angle: 90) }}, outputs: {{ \"a\": \"bent\", \"b\": \"moved.x\" }})"
            ),
        );
        desk.shibo("check a.ron")
    };
    check("\"other\"").expect(0);
    check("(0.5, 1)").expect(0);
    let ran = check("\"grey\"").expect(1);
    assert!(
        ran.stderr.contains("`top` is Gray, but `base` is Vec2") && ran.stderr.contains("a.ron:2:"),
        "{}",
        ran.stderr
    );
}

#[test]
fn accepts_exemplar_that_does_not_tile() {
    let desk = Desk::new();
    desk.write(
        "a.ron",
        "(canvas: (size_mm: 20, resolution: 16), nodes: { \"ramp\": Gradient(), \"e\": Exemplar(input: \"ramp\"), \
         \"c\": Synthesize(exemplar: \"e\"), \"s\": SampleExemplar(coords: \"c\", input: \"ramp\"), \
         \"m\": MagnifyCoords(coords: \"c\", input: \"ramp\") }, outputs: { \"s\": \"s\", \"m\": \"m\", \"ramp\": \"ramp\" })",
    );
    let ran = desk.shibo("check a.ron").expect(0);
    assert!(ran.stderr.contains("the output `ramp` does not tile"), "{}", ran.stderr);
}

#[test]
fn the_library_of_wrinkles_follows_the_canvas() {
    let desk = Desk::new();
    let library = concat!(env!("CARGO_MANIFEST_DIR"), "/graphs/lib/wrinkles.ron");
    for tile in ["None", "X", "Both"] {
        let text = format!(
            "(imports: {{ \"w\": {library:?} }}, canvas: (size_mm: 12, resolution: 32, tile: {tile}), \
             nodes: {{ \"u\": Use(graph: \"w\") }}, outputs: {{ \"grooves\": \"u.grooves\" }})"
        );
        desk.write("a.ron", text);
        desk.shibo("render a.ron --no-cache").expect(0);
    }
}
