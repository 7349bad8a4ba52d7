//! Leather end to end: mistakes of users with their places, and segments as SVG.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::Desk;

/// A graph of some nodes; the first of them is on line 5.
fn graph(nodes: &str, output: &str) -> String {
    format!(
        "(\n  version: 1,\n  canvas: (size_mm: 30, resolution: 64, tile: Both, seed: 1),\n  nodes: {{\n{nodes}\n  }},\n  \
         outputs: {{ \"out\": \"{output}\" }},\n)\n"
    )
}

const CHAIN: &str = r#"    "links": ConnectNeighbors(points: "points"),
    "springs": DefineSprings(lattice: "links"),
    "moved": SimulateSprings(springs: "springs", boundary: Periodic, step: 0.1, drag: 6),
    "wrinkles": PlaceWrinkles(lattice: "moved"),
    "height": DrawWrinkles(segments: "wrinkles"),"#;

/// Renders a graph that must fail, and checks code, line, column, and a part of the message.
fn fails(nodes: &str, (code, line, column): (&str, u64, u64), words: &str) {
    let desk = Desk::new();
    desk.write("a.ron", graph(nodes, "height"));
    let ran = desk.shibo("render a.ron --no-cache --memory 64").expect(1);
    let place = format!("a.ron:{line}:{column}");
    assert!(ran.stderr.contains(&place) && ran.stderr.contains(code), "{place} {code}: {}", ran.stderr);
    // Messages are broken into lines.
    let flat = ran.stderr.split_whitespace().filter(|w| *w != "\u{2502}").collect::<Vec<_>>().join(" ");
    assert!(flat.contains(words), "{words}: {flat}");
    assert!(!desk.path("out/out.png").exists());
}

#[test]
fn points_are_checked() {
    let points = |text: &str| format!("    \"points\": {text},\n{CHAIN}");
    fails(&points("GridPoints(pitch: 0)"), ("out-of-range", 5, 33), "greater than 0");
    fails(&points("PoissonPoints(pitch: -1)"), ("out-of-range", 5, 36), "greater than 0");
    fails(
        &points("GridPoints(pitch: 31)"),
        ("out-of-range", 5, 33),
        "pitch is `31`; it must be at most as large as the canvas, 30 × 30 mm",
    );
    fails(&points("HexPoints(edge: 20)"), ("out-of-range", 5, 31), "must fit on the canvas");
    fails(&points("GridPoints(pitch: 0.03)"), ("too-large", 5, 33), "1000000 points");
    fails(&points("RandomPoints(count: 1000000)"), ("too-large", 5, 35), "64 MiB are allowed");
    fails(&points("PoissonPoints(pitch: 0.001)"), ("too-large", 5, 36), "at most 4000000 are allowed");
}

#[test]
fn ranges_links_and_fields_are_checked() {
    let with = |links: &str, springs: &str| {
        format!(
            "    \"points\": PoissonPoints(pitch: 1),\n    \"links\": {links},\n    \"springs\": {springs},\n    \"moved\": \
             SimulateSprings(springs: \"springs\", boundary: Periodic, step: 0.1, drag: 6),\n    \"wrinkles\": \
             PlaceWrinkles(lattice: \"moved\"),\n    \"height\": DrawWrinkles(segments: \"wrinkles\"),"
        )
    };
    let plain = "DefineSprings(lattice: \"links\")";
    let linked = "ConnectNeighbors(points: \"points\")";
    let links = "ConnectNeighbors(points: \"points\", neighbors: Radius(16))";
    fails(&with(links, plain), ("out-of-range", 6, 60), "less than half of it, 15 mm");
    let links = "ConnectNeighbors(points: \"points\", neighbors: HexEdges)";
    fails(&with(links, plain), ("bad-value", 6, 60), "corners of hexagons");
    let mass = "DefineMass(springs: \"plain\", mass: (0, 2)),\n    \"plain\": DefineSprings(lattice: \"links\")";
    fails(&with(linked, mass), ("out-of-range", 7, 52), "greater than 0");
    let springs = "DefineSprings(lattice: \"links\", sample_resolution: (0, 4))";
    fails(&with(linked, springs), ("out-of-range", 7, 68), "between 1 and 8192");
}

#[test]
fn refuses_excessive_lengths() {
    let with = |field: &str, springs: &str, draw: &str| {
        format!(
            "    \"points\": PoissonPoints(pitch: 1),\n    \"field\": {field},\n    \"links\": \
             ConnectNeighbors(points: \"points\"),\n    \"springs\": DefineSprings({springs}),\n    \"wrinkles\": \
             PlaceWrinkles(lattice: \"links\"),\n    \"height\": {draw},\n    \"moved\": SimulateSprings(springs: \
             \"springs\"),\n    \"all\": PlaceWrinkles(lattice: \"moved\"),"
        )
    };
    let (bands, springs) = ("BandPattern()", "lattice: \"links\", field: \"field\"");
    let draw = "DrawWrinkles(segments: \"all\")";
    let wide = "DrawWrinkles(segments: \"wrinkles\", width: 1e4)";
    fails(&with(bands, springs, wide), ("out-of-range", 10, 57), "at most 480 mm");
    let wide = "DrawWrinkles(segments: \"wrinkles\", width: 400)";
    fails(&with(bands, springs, wide), ("too-large", 10, 57), "at most 4096 are allowed");
    let wide = "Dots(points: \"points\", diameter: 5000)";
    fails(&with(bands, springs, wide), ("out-of-range", 10, 48), "at most 480 mm");
    fails(&with("BandPattern(length: 1e5)", springs, draw), ("out-of-range", 6, 34), "at most 480 mm");
    let near = "lattice: \"links\", field: \"field\", sample: Near(1000)";
    fails(&with(bands, near, draw), ("too-large", 8, 72), "`Near(1000)`");
    let mass =
        format!("{springs}),\n    \"heavy\": DefineMass(springs: \"springs\", field: \"field\", sample: Near(1000)");
    let nodes = with(bands, &mass, draw)
        .replace("SimulateSprings(springs: \"springs\")", "SimulateSprings(springs: \"heavy\")");
    fails(&nodes, ("too-large", 9, 69), "`Near(1000)`");
}

#[test]
fn reversed_ranges_and_missing_pictures() {
    let nodes = format!(
        "    \"points\": PoissonPoints(pitch: 1),\n    \"bands\": BandPattern(angle: (40, 20)),\n    \"photo\": \
         Image(path: \"none.png\"),\n{CHAIN}"
    );
    fails(&nodes, ("out-of-range", 6, 33), "the smaller number must come first");
    fails(&nodes, ("file-not-found", 7, 26), "none.png");
}

#[test]
fn reports_damaged_picture_at_its_node() {
    let desk = Desk::new();
    let ramp = std::fs::read("library/examples/ramp.png").unwrap();
    let chain = CHAIN.replace("lattice: \"links\"", "lattice: \"links\", field: \"photo\"");
    let nodes = format!("    \"photo\": Image(path: \"a.png\"),\n    \"points\": PoissonPoints(pitch: 1),\n{chain}");
    desk.write("a.ron", graph(&nodes, "height"));
    desk.write("a.png", &ramp);
    let ran = desk.shibo("render a.ron --no-cache --stats json").expect(0);
    let photo = ran.json()["nodes"].as_array().unwrap().iter().find(|n| n["name"] == "photo").unwrap().clone();
    assert_eq!(photo["state"], "computed", "{photo}");
    // `DefineSprings` reads the picture, but the error is reported at the `Image`.
    let mut broken = ramp.clone();
    let at = broken.len() - 20;
    broken[at] ^= 0x55;
    desk.write("a.png", &broken);
    let ran = desk.shibo("render a.ron --no-cache").expect(1);
    assert!(ran.stderr.contains("a.ron:5:26") && ran.stderr.contains("damaged"), "{}", ran.stderr);
}

#[test]
fn warns_of_springs_without_effect() {
    let desk = Desk::new();
    let chain = CHAIN.replace("points: \"points\"", "points: \"points\", neighbors: Radius(0.8)");
    desk.write("a.ron", graph(&format!("    \"points\": RandomPoints(count: 500),\n{chain}"), "height"));
    let ran = desk.shibo("render a.ron --no-cache").expect(0);
    assert!(ran.stderr.contains("of 500 points have no neighbour"), "{}", ran.stderr);
    let chain = CHAIN.replace("drag: 6", "drag: 6, break_force: 0.5");
    desk.write("b.ron", graph(&format!("    \"points\": PoissonPoints(pitch: 2),\n{chain}"), "height"));
    let ran = desk.shibo("render b.ron --no-cache").expect(0);
    assert!(ran.stderr.contains("springs break before the first step"), "{}", ran.stderr);
    let balanced = "    \"points\": GridPoints(pitch: 2, jitter: 0),\n    \"links\": ConnectNeighbors(points: \"points\", \
                    neighbors: Eight),\n    \"plain\": DefineSprings(lattice: \"links\", stiffness: 4),\n    \"springs\": \
                    DefineMass(springs: \"plain\", mass: 2),\n    \"moved\": SimulateSprings(springs: \"springs\"),\n    \
                    \"wrinkles\": PlaceWrinkles(lattice: \"moved\"),\n    \"height\": DrawWrinkles(segments: \"wrinkles\"),";
    desk.write("c.ron", graph(balanced, "height"));
    let ran = desk.shibo("render c.ron --no-cache").expect(0);
    assert!(ran.stderr.contains("hold each other in balance"), "{}", ran.stderr);
    let chain = CHAIN.replace("boundary: Periodic", "boundary: Fixed(15)");
    desk.write("d.ron", graph(&format!("    \"points\": PoissonPoints(pitch: 2),\n{chain}"), "height"));
    let ran = desk.shibo("render d.ron --no-cache").expect(0);
    assert!(ran.stderr.contains("d.ron:8:60") && ran.stderr.contains("nothing moves"), "{}", ran.stderr);
}

#[test]
fn grooves_without_a_width_are_warned_of() {
    let desk = Desk::new();
    let write = |drawing: &str| {
        let chain = CHAIN
            .replace("DrawWrinkles(segments: \"wrinkles\"", &format!("DrawWrinkles(segments: \"wrinkles\", {drawing}"));
        assert_ne!(chain, CHAIN);
        desk.write("a.ron", graph(&format!("    \"points\": PoissonPoints(pitch: 2),\n{chain}"), "height"));
        desk.shibo("check a.ron").expect(0).stderr
    };
    let said = write("width: 0");
    assert!(said.contains("width is `0`: nothing is drawn") && said.contains("fade: false"), "{said}");
    assert!(write("width: 0, min_width: 0, fade: false").contains("nothing is drawn"));
    for right in ["width: 0, fade: false", "width: (0, 0.3)"] {
        assert_eq!(write(right), "", "{right}");
    }
}

#[test]
fn advises_against_wide_range_of_band_angles() {
    let desk = Desk::new();
    desk.write("a.ron", graph("    \"height\": BandPattern(angle: (10, 40)),", "height"));
    let ran = desk.shibo("check a.ron").expect(0);
    assert!(ran.stderr.contains("a.ron:5:34") && ran.stderr.contains("less than 30"), "{}", ran.stderr);
}

#[test]
fn a_motion_that_diverges_names_the_step() {
    let chain = CHAIN.replace("drag: 6", "drag: 0, steps: 900").replace("step: 0.1", "step: 0.4");
    let nodes = format!("    \"points\": PoissonPoints(pitch: 2),\n{chain}");
    fails(&nodes, ("diverged", 8, 76), "diverged in step");
}

#[test]
fn segments_are_written_as_svg() {
    let desk = Desk::new();
    let text = graph(&format!("    \"points\": PoissonPoints(pitch: 2),\n{CHAIN}"), "height.segments");
    desk.write("a.ron", text.replace("outputs: {", "outputs: { \"picture\": \"height\","));
    desk.shibo("render a.ron --output out --format svg").expect(0);
    let first = std::fs::read_to_string(desk.path("out/out.svg")).unwrap();
    assert!(first.contains(r#"width="30mm" height="30mm" viewBox="0 0 30 30""#), "{}", &first[..300]);
    assert!(first.matches('M').count() > 500);
    let numbers = first.split("d=\"").skip(1).flat_map(|path| {
        path.split('"')
            .next()
            .unwrap()
            .split(['M', 'L', ' '])
            .filter(|n| !n.is_empty())
            .map(|n| n.parse::<f64>().unwrap())
            .collect::<Vec<_>>()
    });
    assert!(numbers.into_iter().all(|n| (0.0..=30.0).contains(&n)));
    // The same bytes by default and from the cache.
    desk.shibo("render a.ron -o again").expect(0);
    assert_eq!(std::fs::read_to_string(desk.path("again/out.svg")).unwrap(), first);
    assert!(desk.path("again/picture.png").exists());
    let corner = desk.shibo("render a.ron --output out --region 0,0,32,16 -o corner").expect(0);
    let part = std::fs::read_to_string(desk.path("corner/out.svg")).unwrap();
    assert!(part.contains(r#"viewBox="0 0 15 7.5""#), "{}", corner.stderr);
    let ran = desk.shibo("render a.ron --output picture --format svg").expect(2);
    assert!(ran.stderr.contains("SVG holds segments only"), "{}", ran.stderr);
    let ran = desk.shibo("render a.ron --output out --format png").expect(2);
    assert!(ran.stderr.contains("cannot hold"), "{}", ran.stderr);
}
