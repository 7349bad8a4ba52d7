//! Wood end to end: the published vectors by `shibo dump --at`, agreement of cuts, and thin rings without aliasing.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::{Desk, number};
use serde_json::Value as Json;
use shibo_engine::eval::{CancelToken, Silent};
use shibo_engine::session::{Session, Settings};
use shibo_graph::{LoadOptions, load_text};
use shibo_value::{Channel, Tile, Value, Window, linear_to_srgb};
use std::fmt::Write;
use std::path::Path;

fn vectors() -> Json {
    serde_json::from_str(include_str!("../../kernel/tests/vectors/wood.json")).unwrap()
}

/// JSON lists as RON tuples inside a list.
fn points(list: &Json) -> String {
    let point = |p: &Json| format!("({}, {}, {})", p[0], p[1], p[2]);
    list.as_array().unwrap().iter().map(point).collect::<Vec<_>>().join(", ")
}

fn csv(queries: &Json) -> String {
    queries.as_array().unwrap().iter().fold(String::new(), |mut text, q| {
        writeln!(text, "{},{},{}", q["P"][0], q["P"][1], q["P"][2]).unwrap();
        text
    })
}

fn same(dump: &Json, queries: &Json, key: &str) {
    let (got, want) = (dump["values"].as_array().unwrap(), queries.as_array().unwrap());
    assert_eq!(got.len(), want.len());
    for (got, want) in got.iter().zip(want) {
        let (a, b) = (number(got), number(&want[key]));
        assert!(a == b || (a - b).abs() < 1e-9 * b.abs().max(1.0), "{key}: {a} {want}");
    }
}

#[test]
fn dumped_times_and_skeletons_are_those_of_the_vectors() {
    let vectors = vectors();
    let desk = Desk::new();
    for skeleton in vectors["skeletons"].as_array().unwrap() {
        let scheme = if skeleton["scheme"] == "local" { "Local" } else { "Natural" };
        let graph = format!(
            "(canvas: (size_mm: 10, tile: None), nodes: {{ \"nodes\": TrunkNodes(nodes: [{}]), \
             \"raw\": FitSkeleton(curve: \"nodes\", scheme: {scheme}), \"tree\": EqualizeHeight(skeleton: \"raw\"), \
             \"time\": TrunkTime(tree: Tree(skeleton: \"raw\", elongation_speed: 2, thickening_speed: 0.5)) }})",
            points(&skeleton["nodes"])
        );
        desk.write("a.ron", graph);
        desk.write("at.csv", csv(&skeleton["queries"]));
        same(&desk.shibo("dump a.ron time --at at.csv").expect(0).json(), &skeleton["queries"], "T");
        same(&desk.shibo("dump a.ron time.distance --at at.csv").expect(0).json(), &skeleton["queries"], "d");
        // The same nodes from a file.
        let lines = skeleton["nodes"].as_array().unwrap().iter().map(|n| format!("{}, {}, {}\n", n[0], n[1], n[2]));
        desk.write("nodes.csv", format!("# x, y, z in mm\n{}", lines.collect::<String>()));
        let graph = std::fs::read_to_string(desk.path("a.ron")).unwrap();
        let list = format!("nodes: [{}]", points(&skeleton["nodes"]));
        assert!(graph.contains(&list));
        desk.write("b.ron", graph.replace(&list, "file: \"nodes.csv\""));
        same(&desk.shibo("dump b.ron time --at at.csv").expect(0).json(), &skeleton["queries"], "T");
        for (node, key) in [("raw", "controls_raw"), ("tree", "controls_equalised")] {
            let dump = desk.shibo(&format!("dump a.ron {node}")).expect(0).json();
            let flat = |v: &Json| -> Vec<f64> {
                let lists = v.as_array().unwrap().iter().flat_map(|s| s.as_array().unwrap());
                lists.flat_map(|p| p.as_array().unwrap().iter().map(|n| n.as_f64().unwrap())).collect()
            };
            let (a, b) = (flat(&dump["trunk"]), flat(&skeleton[key]));
            assert!(a.len() == b.len() && a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-9), "{key}");
        }
    }
}

#[test]
fn dumped_branches_and_baselines_are_those_of_the_vectors() {
    let vectors = vectors();
    let desk = Desk::new();
    let named = |name: &Json| vectors["skeletons"].as_array().unwrap().iter().find(|s| s["name"] == *name).unwrap();
    for case in vectors["branches"].as_array().unwrap() {
        let branch = |b: &Json| {
            format!(
                "(height: {}, direction: ({}, {}, {}), thickening_speed: {})",
                b["z"], b["dir"][0], b["dir"][1], b["dir"][2], b["vb"]
            )
        };
        let list: Vec<String> = case["branches"].as_array().unwrap().iter().map(branch).collect();
        let graph = format!(
            "(canvas: (size_mm: 10, tile: None), nodes: {{ \"nodes\": TrunkNodes(nodes: [{}]), \
             \"raw\": FitSkeleton(curve: \"nodes\"), \"tree\": Branches(skeleton: \"raw\", branches: [{}]), \
             \"t1\": TrunkTime(tree: Tree(skeleton: \"tree\", elongation_speed: 2, thickening_speed: 0.5)), \
             \"t2\": BranchTime(tree: Tree(skeleton: \"tree\", elongation_speed: 2)), \
             \"first\": BranchTime(tree: Tree(skeleton: \"tree\", elongation_speed: 2), branch: 0), \
             \"time\": BlendTimes(times: [\"t1\", \"t2\"]), \"least\": BlendTimes(times: [\"t1\", \"t2\"], k: inf) }})",
            points(&named(&case["skeleton"])["nodes"]),
            list.join(", ")
        );
        desk.write("a.ron", graph);
        desk.write("at.csv", csv(&case["queries"]));
        let dump = |node: &str| desk.shibo(&format!("dump a.ron {node} --at at.csv")).expect(0).json();
        same(&dump("time"), &case["queries"], "T");
        same(&dump("t1"), &case["queries"], "T1");
        let (first, second, least) = (dump("first"), dump("t2"), dump("least"));
        for (i, query) in case["queries"].as_array().unwrap().iter().enumerate() {
            let (got, want) = (number(&first["values"][i]), number(&query["T2"][0]));
            assert!(got == want || (got / want - 1.0).abs() < 1e-9, "{got} {want}");
            // Exactly the minimum of the times of the trunk and of all branches.
            let all = query["T2"].as_array().unwrap().iter().map(number).fold(number(&query["T1"]), f64::min);
            let branches = number(&second["values"][i]);
            assert!((number(&least["values"][i]) - number(&query["T1"]).min(branches)).abs() < 1e-9);
            assert!(all >= number(&least["values"][i]) - 1e-9);
        }
    }
    for case in vectors["straight"].as_array().unwrap() {
        let graph = format!(
            "(canvas: (size_mm: 10, tile: None), nodes: {{ \"nodes\": TrunkNodes(nodes: [{}]), \
             \"time\": StraightTime(curve: \"nodes\", elongation_speed: {}, thickening_speed: {}) }})",
            points(&named(&case["skeleton"])["nodes"]),
            case["va"],
            case["vb"]
        );
        desk.write("a.ron", graph);
        desk.write("at.csv", csv(&case["queries"]));
        same(&desk.shibo("dump a.ron time --at at.csv").expect(0).json(), &case["queries"], "T");
    }
}

#[test]
fn colours_are_looked_up_by_number() {
    let vectors = vectors();
    let desk = Desk::new();
    let table = vectors["colour"]["table"].as_array().unwrap();
    // Two stops for each entry keep its colour constant.
    let n = table.len() as f64;
    let stop = |(i, c): (usize, &Json)| {
        let (from, to) = (i as f64 / n, (i + 1) as f64 / n);
        format!("({from}, ({}, {}, {})), ({to}, ({}, {}, {}))", c[0], c[1], c[2], c[0], c[1], c[2])
    };
    let stops: Vec<String> = table.iter().enumerate().map(stop).collect();
    for (interpolate, key) in [(false, "nearest"), (true, "linear")] {
        // On the pith, time depends on z only.
        let graph = format!(
            "(canvas: (size_mm: 10, tile: None), nodes: {{ \"nodes\": TrunkNodes(nodes: [(0, 0, -10), (0, 0, 50)]), \
             \"tree\": FitSkeleton(curve: \"nodes\"), \"time\": TrunkTime(tree: Tree(skeleton: \"tree\", elongation_speed: 1)), \
             \"rings\": ColorPattern(stops: [{}], entries: {n}), \
             \"wood\": RingColor(time: \"time\", pattern: \"rings\", filter: None, interpolate: {interpolate}) }})",
            stops.join(", ")
        );
        desk.write("a.ron", graph);
        let entries = vectors["colour"]["entries"].as_array().unwrap();
        let at: String = entries.iter().map(|e| format!("0,0,{}\n", e["T"])).collect();
        desk.write("at.csv", at);
        let dump = desk.shibo("dump a.ron wood --at at.csv").expect(0).json();
        for (i, entry) in entries.iter().enumerate() {
            for c in 0..3 {
                let (got, want) = (number(&dump["values"][3 * i + c]), number(&entry[key][c]));
                assert!((got - want).abs() < 3e-6, "{key} {entry}: {got}");
            }
        }
    }
}

fn session() -> Session {
    Session::new(shibo_nodes::registry(), &Settings { threads: 2, ..Settings::default() }).unwrap()
}

/// The picture of the node `out` of a graph.
fn picture(session: &Session, canvas: &str, nodes: &str) -> Tile {
    let text = format!("(canvas: {canvas}, nodes: {{ {nodes} }})");
    let options = LoadOptions { working_dir: ".".into(), ..LoadOptions::default() };
    let loaded = load_text(Path::new("test.ron"), &text, session.registry(), &options);
    let messages: Vec<&str> = loaded.diagnostics.iter().map(|d| d.message.as_str()).collect();
    assert_eq!(messages, Vec::<&str>::new());
    let graph = loaded.graph.unwrap();
    let node = graph.nodes.node_indices().find(|i| graph.nodes[*i].name == "out").unwrap();
    let cancel = CancelToken::default();
    let Value::Field(field) = session.value(&graph, (node, 0), &cancel, &Silent).unwrap() else { panic!("no field") };
    let size = graph.canvas.resolution;
    session
        .rasters(&graph, &field, &[(graph.canvas.grid(size), Window::full(size))], &cancel, &Silent)
        .unwrap()
        .0
        .remove(0)
}

/// Three faces of the block in `graphs/oak_cuts.ron`, unchanged: on shared edges, colours agree within one level of
/// 255.
#[test]
fn three_cuts_agree_on_their_shared_edges() {
    let session = session();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("graphs/oak_cuts.ron");
    let graph = session.load(&path, &LoadOptions::default()).graph.unwrap();
    let (width, height) = (graph.canvas.resolution.x, graph.canvas.resolution.y);
    let bottom = height.cast_signed() - 1;
    let cancel = CancelToken::default();
    let line = |name: &str, window: Window| -> Tile {
        let output = graph.outputs.iter().find(|o| o.name == name).unwrap();
        let field = match session.value(&graph, (output.node, output.output), &cancel, &Silent).unwrap() {
            Value::Field(field) => field,
            Value::Material(material) => material.get(Channel::BaseColor).unwrap().clone(),
            _ => panic!("no picture"),
        };
        let grid = graph.canvas.grid(graph.canvas.resolution);
        session.rasters(&graph, &field, &[(grid, window)], &cancel, &Silent).unwrap().0.remove(0)
    };
    let row = |y: i32| Window { x: 0, y, width, height: 1 };
    let column = |x: i32| Window { x, y: 0, width: 1, height };
    let (face_low, face_left) = (line("material", row(bottom)), line("material", column(0)));
    let (edge_top, edge_left) = (line("edge", row(0)), line("edge", column(0)));
    let (end_top, end_left) = (line("end", row(0)), line("end", column(0)));
    let byte = |v: f32| linear_to_srgb(v.clamp(0.0, 1.0)) * 255.0;
    let rows = usize::try_from(height).unwrap();
    for c in 0..3 {
        let (mut worst, mut seen) = ([0.0_f32; 3], (f32::MAX, f32::MIN));
        let mut compare = |pair: usize, a: f32, b: f32| {
            worst[pair] = worst[pair].max((byte(a) - byte(b)).abs());
            seen = (seen.0.min(byte(a)), seen.1.max(byte(a)));
        };
        face_low.plane(c).iter().zip(edge_top.plane(c)).for_each(|(a, b)| compare(0, *a, *b));
        (0..rows).for_each(|j| compare(1, face_left.plane(c)[j], end_left.plane(c)[rows - 1 - j]));
        (0..rows).for_each(|j| compare(2, edge_left.plane(c)[j], end_top.plane(c)[j]));
        assert!(worst.iter().all(|w| *w <= 1.0), "channel {c}: {worst:?}");
        assert!(seen.1 - seen.0 > 60.0, "there is something to be seen: {seen:?}");
    }
}

/// Low-frequency energy of the difference to a reference, relative to the energy of the reference.
fn moire(picture: &[f32], reference: &[f32], n: usize) -> f64 {
    let soft = |v: &[f32]| -> Vec<f64> {
        let kernel: Vec<f64> = (-6..=6).map(|d| (-0.5 * f64::from(d * d) / 4.0).exp()).collect();
        let total: f64 = kernel.iter().sum();
        let pass = |v: &[f64], step: usize, from: usize| -> Vec<f64> {
            let at = |i: usize, k: usize| {
                let place = (i / from % n) as i64 + k as i64 - 6;
                let place = usize::try_from(place.clamp(0, n as i64 - 1)).unwrap();
                v[i - i / from % n * step + place * step]
            };
            (0..n * n).map(|i| (0..13).map(|k| kernel[k] * at(i, k)).sum::<f64>() / total).collect()
        };
        let wide: Vec<f64> = v.iter().map(|v| f64::from(*v)).collect();
        pass(&pass(&wide, 1, 1), n, n)
    };
    let (a, b) = (soft(picture), soft(reference));
    let mean = b.iter().sum::<f64>() / b.len() as f64;
    let error: f64 = a.iter().zip(&b).map(|(a, b)| (a - b).powi(2)).sum();
    error / b.iter().map(|b| (b - mean).powi(2)).sum::<f64>()
}

#[test]
fn thin_rings_do_not_alias_on_a_small_board() {
    let session = session();
    let nodes = |filter: &str| {
        format!(
            "{} \"out\": CutPlane(solid: \"wood\", preset: EndGrain, distance: 10, height: 1200),",
            format_args!(
                r##""pith": TrunkNodes(height: (0, 4000), count: 21, wander: 2.5), "tree": FitSkeleton(curve: "pith"),
                "even": TrunkTime(tree: Tree(skeleton: "tree", elongation_speed: 420, thickening_speed: 1.15)),
                "time": VaryGrowth(time: "even", tree: "tree", series: Generated, sigma: 0.24, eccentricity: 0.05),
                "year": ColorPattern(stops: [(0, "#f0d8b0"), (0.6, "#edd0a2"), (0.82, "#e0b580"), (0.95, "#c99058"), (1, "#e3c192")]),
                "wood": RingColor(time: "time", pattern: "year", late_variation: 0.35, filter: {filter}),"##
            )
        )
    };
    let n = 96;
    let small = |filter: &str| picture(&session, "(size_mm: 144, resolution: 96, tile: None)", &nodes(filter));
    let fine = picture(&session, "(size_mm: 144, resolution: 1152, tile: None)", &nodes("None"));
    let mut reference = vec![0.0_f32; n * n];
    for y in 0..1152 {
        for x in 0..1152 {
            reference[y / 12 * n + x / 12] += fine.row(1, y)[x] / 144.0;
        }
    }
    let (exact, point) = (small("Exact"), small("None"));
    let (good, bad) = (moire(exact.plane(1), &reference, n), moire(point.plane(1), &reference, n));
    // Allowed is a twentieth of the reference's energy.
    assert!(good < 0.05 && bad > 100.0 * good, "{good} {bad}");
}

/// Halving the sample distance halves the largest step in the time of the curved method; the straight method keeps its
/// jumps.
#[test]
fn curved_time_is_continuous_where_the_straight_one_jumps() {
    let session = session();
    let steps = |node: &str| {
        [100, 200, 400].map(|n| {
            let canvas = format!("(size_mm: 300, resolution: {n}, tile: None)");
            let nodes = format!(
                r#""nodes": TrunkNodes(nodes: [(0, 0, -60), (14, 6, 0), (-22, -4, 60), (-30, 12, 120), (16, 8, 180), (34, -6, 240), (6, 4, 300), (-10, 0, 360)]),
                "tree": FitSkeleton(curve: "nodes"), {node}
                "out": CutPlane(solid: "time", origin: (-150, 0, 300), u: (300, 0, 0), v: (0, 0, -300)),"#
            );
            let tile = picture(&session, &canvas, &nodes);
            let mut largest = 0.0_f32;
            for y in 0..n {
                for x in 1..n {
                    let along = (tile.row(0, y)[x] - tile.row(0, y)[x - 1]).abs();
                    let down = if y > 0 { (tile.row(0, y)[x] - tile.row(0, y - 1)[x]).abs() } else { 0.0 };
                    largest = largest.max(along).max(down);
                }
            }
            largest
        })
    };
    let curved =
        steps(r#""time": TrunkTime(tree: Tree(skeleton: "tree", elongation_speed: 40, thickening_speed: 3)),"#);
    let straight = steps(r#""time": StraightTime(curve: "nodes", elongation_speed: 40, thickening_speed: 3),"#);
    assert!(curved[1] / curved[0] < 0.6 && curved[2] / curved[1] < 0.6, "{curved:?}");
    assert!(straight[2] / straight[0] > 0.8, "{straight:?}");
}
