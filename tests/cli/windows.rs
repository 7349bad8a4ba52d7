//! Windows of fields that valid parameters make very large: they are read coarsely or once per repeat, or refused
//! before any computation. The tests count the computed pixels, because time varies.
use crate::support::{Desk, samples};
use serde_json::Value as Json;

/// A graph of 64² pixels over 40 mm; its output is `a`.
fn graph(canvas: &str, nodes: &str) -> String {
    format!(
        "(version: 1, canvas: (size_mm: 40, resolution: 64, {canvas}), nodes: {{ \"s\": Perlin(size: 4), {nodes} }}, outputs: {{ \"o\": \"a\" }})"
    )
}

/// Renders `a.ron` and gives the number of pixels computed by each node.
#[track_caller]
fn computed(desk: &Desk, options: &str) -> impl Fn(&str) -> u64 {
    let stats = desk.shibo(&format!("render a.ron -o out --no-cache --quiet --stats json {options}")).expect(0).json();
    move |name| {
        let nodes = stats["nodes"].as_array().unwrap();
        let of = |node: &&Json| node["name"].as_str() == Some(name);
        nodes.iter().find(of).unwrap_or_else(|| panic!("{name}: {stats}"))["pixels"].as_u64().unwrap()
    }
}

/// Transforms that shrink until many canvases lie under a pixel, or enlarge until a filter covers thousands of pixels.
const FAR: [&str; 9] = [
    r#""a": Place(input: "s", size: 0.003, position: (12, 14), angle: 12)"#,
    r#""a": Place(input: "s", size: 1e-5, position: (12, 14), angle: 12)"#,
    r#""a": Place(input: "s", size: 1e-5, position: (12, 14))"#,
    r#""b": Transform(input: "s", scale: 0.001, angle: 10), "a": Transform(input: "b", scale: 0.001, angle: 10)"#,
    r#""b": Transform(input: "s", scale: 0.001), "a": Transform(input: "b", scale: 0.001, angle: 90)"#,
    r#""q": Blur(input: "s", radius: 1), "a": Transform(input: "q", scale: 1000, angle: 10)"#,
    r#""q": Blur(input: "s", radius: 1), "a": Transform(input: "q", scale: 1000)"#,
    r#""q": Blur(input: "s", radius: 1), "a": Crop(input: "q", size: 0.01, position: (3, 3))"#,
    r#""q": Blur(input: "s", radius: 1), "b": Crop(input: "q", size: 1e-6, position: (3, 3)), "c": Blur(input: "b", radius: 2), "a": Crop(input: "c", size: 1e-6, position: (3, 3))"#,
];

#[test]
fn far_reductions_and_enlargements_compute_few_pixels() {
    let desk = Desk::new();
    for (nodes, canvas) in FAR.iter().flat_map(|nodes| [(nodes, "tile: Both"), (nodes, "tile: None")]) {
        desk.write("a.ron", graph(canvas, nodes));
        let pixels = computed(&desk, "");
        assert!(pixels("s") < 1 << 23, "{canvas} {nodes}: {}", pixels("s"));
    }
}

#[test]
fn a_window_that_is_too_large_is_refused_at_its_parameter() {
    let desk = Desk::new();
    let enlarged = |node: &str| format!(r#""q": {node}, "a": Crop(input: "q", size: 0.0001, position: (3, 3))"#);
    let cases = [
        (r#""a": RadialBlur(input: "s", center: 1000000)"#.to_owned(), "1000000"),
        (enlarged(r#"DistanceField(input: "s", radius: 15)"#), "15"),
        (enlarged(r#"Median(input: "s", radius: 1.5)"#), "1.5"),
        (enlarged(r#"DirectionalBlur(input: "s", length: 16)"#), "16"),
    ];
    for (nodes, value) in cases {
        let text = graph("tile: None", &nodes);
        desk.write("a.ron", &text);
        let refused = desk.shibo("render a.ron -o out --no-cache --quiet").expect(1).stderr;
        assert!(refused.contains("error[too-large]") && refused.contains("so that less is read"), "{refused}");
        let place = refused.split_once("a.ron:1:").unwrap_or_else(|| panic!("{refused}")).1;
        let column: usize = place.split(|c: char| !c.is_ascii_digit()).next().unwrap().parse().unwrap();
        assert!(text[column - 1..].starts_with(value), "{column} {refused}");
    }
}

#[test]
fn small_pictures_compute_one_repeat() {
    let desk = Desk::new();
    let things = [
        r#""p": PoissonPoints(pitch: 0.5), "d": Dots(points: "p", diameter: (0.09, 0.17))"#,
        r#""d": Scratches()"#,
        r#""d": Fibers()"#,
        r#""d": TileSampler(input: "s")"#,
    ];
    let moves = ["offset: (0.1, 0.05)", "angle: 90", "offset: (0.1, 3), angle: 180", "angle: 30"];
    for (thing, by) in things.iter().flat_map(|thing| moves.map(|by| (thing, by))) {
        desk.write("a.ron", graph("tile: Both", &format!(r#"{thing}, "a": Transform(input: "d", {by})"#)));
        for resolution in [1, 2, 4] {
            let pixels = computed(&desk, &format!("--resolution {resolution}"))("d");
            assert!(pixels <= 4 * resolution * resolution, "{thing} {by} at {resolution}: {pixels}");
        }
    }
}

#[test]
fn moved_instances_compute_no_extra_pixels() {
    let desk = Desk::new();
    let part = r#"(version: 1, canvas: (size_mm: 40, resolution: 64), nodes: { "s": Fractal(size: 7), "b": Blur(input: "s", radius: 1.7), "h": HeightToNormal(input: "b") }, outputs: { "h": "h" })"#;
    desk.write("part.ron", part);
    let pixels = |canvas: &str| {
        desk.write(
            "a.ron",
            format!(
                r#"(version: 1, canvas: (size_mm: 40, resolution: 512, tile: Both), imports: {{ "part": "part.ron" }}, nodes: {{ "a": Use(graph: "part"{canvas}) }}, outputs: {{ "o": "a.h" }})"#
            ),
        );
        computed(&desk, "")("a/s")
    };
    let plain = pixels("");
    assert_eq!(plain, 512 * 512);
    for canvas in ["angle: 90", "angle: 180", "angle: 270", "offset: (3.3, 0.7)", "angle: 90, offset: (3.3, 0.7)"] {
        assert_eq!(pixels(&format!(", canvas: ({canvas})")), plain, "{canvas}");
    }
    assert_eq!(pixels(", canvas: (scale: 0.5)"), plain / 4);
    assert_eq!(pixels(", canvas: (scale: 0.5, angle: 90, offset: (3.3, 0.7))"), plain / 4);
    // Enlarged, filters reach twice as many pixels beyond the visible part, but at most one repeat.
    assert!(pixels(", canvas: (scale: 2)") <= 4 * plain);
}

#[test]
fn a_quarter_turn_permutes_the_pixels() {
    let desk = Desk::new();
    desk.write(
        "a.ron",
        graph("tile: Both", r#""q": Blur(input: "s", radius: 1), "a": Transform(input: "q", angle: 90)"#),
    );
    desk.shibo("render a.ron -o turned --no-cache --quiet").expect(0);
    desk.write("a.ron", graph("tile: Both", r#""a": Blur(input: "s", radius: 1)"#));
    desk.shibo("render a.ron -o plain --no-cache --quiet").expect(0);
    let (width, plain) = samples(&desk.path("plain/o.png"));
    let (_, turned) = samples(&desk.path("turned/o.png"));
    // +x turns towards +y, which points down.
    let at = |x: usize, y: usize| y * width + x;
    assert!((0..width).all(|y| (0..width).all(|x| turned[at(width - 1 - y, x)] == plain[at(x, y)])));
}

#[test]
fn node_times_sum_to_at_most_process_time() {
    let desk = Desk::new();
    let one = |k: u32| {
        format!(
            r#""p{k}": PoissonPoints(pitch: 1.2, seed: {k}), "l{k}": ConnectNeighbors(points: "p{k}"), "d{k}": DefineSprings(lattice: "l{k}", field: "s", stiffness: (1, 10)), "m{k}": SimulateSprings(springs: "d{k}", step: 0.1, steps: 300, drag: 4, boundary: Periodic), "w{k}": PlaceWrinkles(lattice: "m{k}"), "x{k}": DrawWrinkles(segments: "w{k}", width: (0.5, 1)),"#
        )
    };
    let sum: String = (1..8).map(|k| format!(r#""y{k}": "= x{k}.mask + y{}","#, k - 1)).collect();
    let all: String = (0..8).map(one).collect();
    desk.write("a.ron", graph("tile: Both", &format!(r#"{all} "y0": "= x0.mask", {sum} "a": Remap(input: "y7")"#)));
    let stats = desk.shibo("render a.ron -o out --no-cache --quiet --stats json --threads 8").expect(0).json();
    let nodes = stats["nodes"].as_array().unwrap();
    let sum: f64 = nodes.iter().map(|node| node["seconds"].as_f64().unwrap()).sum();
    let process = stats["cpu_s"].as_f64().unwrap();
    assert!(sum > 0.0 && sum <= process, "{sum} of {process}");
}

#[test]
fn an_instance_is_made_on_a_canvas_of_its_own() {
    let desk = Desk::new();
    let part = r#"(version: 1, canvas: (size_mm: 8, resolution: 8, tile: None, seed: 3), nodes: { "p": PoissonPoints(pitch: 1), "d": Dots(points: "p", diameter: 0.8) }, outputs: { "d": "d" })"#;
    desk.write("part.ron", part);
    desk.shibo("render part.ron -o alone --no-cache --quiet").expect(0);
    let sheet = |tile: &str| {
        format!(
            r#"(version: 1, canvas: (size_mm: 32, resolution: 32, tile: {tile}, seed: 3), imports: {{ "part": "part.ron" }}, nodes: {{ "a": Use(graph: "part", canvas: (size_mm: 8, offset: (-6, 7))) }}, outputs: {{ "d": "a.d" }})"#
        )
    };
    desk.write("a.ron", sheet("None"));
    desk.shibo("render a.ron -o out --no-cache --quiet").expect(0);
    let ((_, alone), (width, sheet_pixels)) = (samples(&desk.path("alone/d.png")), samples(&desk.path("out/d.png")));
    // The middle of the instance's canvas lies at (10, 23) mm.
    let at = |k: usize| (19 + k / 8) * width + 6 + k % 8;
    assert!(alone.iter().any(|pixel| pixel[0] > 0));
    assert!((0..64).all(|k| sheet_pixels[at(k)] == alone[k]));
    assert!(
        sheet_pixels.iter().map(|pixel| u64::from(pixel[0])).sum::<u64>()
            < 2 * alone.iter().map(|p| u64::from(p[0])).sum::<u64>()
    );
    desk.write("a.ron", sheet("Both"));
    let refused = desk.shibo("check a.ron --format json").expect(1).json();
    assert_eq!(refused["errors"][0]["code"], "bad-value", "{refused}");
    assert!(refused["errors"][0]["help"].as_str().unwrap().contains("tile: None"), "{refused}");
}
