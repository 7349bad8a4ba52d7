//! Wood end to end: skeletons, surfaces and pictures from users, and their mistakes.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::{Desk, number};
use shibo_value::linear_to_srgb;
use std::fmt::Write;

/// Values of the graph's solid `name` at two points, as printed.
fn dump(desk: &Desk, name: &str) -> Vec<f64> {
    let dump = desk.shibo(&format!("dump a.ron {name} --at at.csv")).expect(0).json();
    dump["values"].as_array().unwrap().iter().map(number).collect()
}

#[test]
fn given_control_points_are_taken_as_they_are() {
    let desk = Desk::new();
    desk.write(
        "a.ron",
        "(canvas: (size_mm: 10, tile: None), nodes: { \
         \"points\": TrunkNodes(nodes: [(0, 0, 0), (1, 0, 3), (2, 1, 5), (2, 2, 9), (2, 3, 13), (0, 4, 16), (0, 5, 21)]), \
         \"tree\": FitSkeleton(curve: \"points\", scheme: Given) })",
    );
    let dump = desk.shibo("dump a.ron tree").expect(0).json();
    assert_eq!(dump["trunk"].as_array().unwrap().len(), 2);
    assert_eq!(dump["trunk"][0][1], serde_json::json!([1.0, 0.0, 3.0]));
    assert_eq!(dump["trunk"][1][0], dump["trunk"][0][3]);
}

#[test]
fn placed_solids_are_those_of_the_tree() {
    let desk = Desk::new();
    let tree = "\"n\": TrunkNodes(nodes: [(0, 0, 0), (2, 1, 50), (0, 0, 100)]), \"s\": FitSkeleton(curve: \"n\"), \
                \"t\": TrunkTime(tree: \"s\"),";
    // A turn by 90° about z takes x to y.
    let placed = "\"p\": PlaceInTree(solid: \"t\", position: (3, 4, 50), turn: (0, 0, 90), scale: 2),";
    let cut = "\"cut\": CutPlane(solid: \"p\", origin: (1, 0, 5), u: (10, 0, 0), v: (0, 0, 10)),";
    desk.write(
        "a.ron",
        format!("(canvas: (size_mm: 10, resolution: 10, tile: None), nodes: {{ {tree} {placed} {cut} }})"),
    );
    desk.write("at.csv", "1,0,5\n0,0,0\n");
    let moved = dump(&desk, "p");
    desk.write("at.csv", "3,6,60\n3,4,50\n");
    let direct = dump(&desk, "t");
    assert!(moved.iter().zip(&direct).all(|(a, b)| (a - b).abs() < 1e-9), "{moved:?} {direct:?}");
    // Pixel (2, 3) has its centre at (2.5, 3.5) mm of the canvas.
    desk.write("at.csv", "3.5,0,8.5\n");
    let want = dump(&desk, "p");
    let field = desk.shibo("dump a.ron cut").expect(0).json();
    assert!((number(&field["values"][32]) - want[0]).abs() < 1e-5);
}

/// A grid of coplanar points from a file shows the same as a plane.
#[test]
fn surface_from_file_equals_plane() {
    let desk = Desk::new();
    let mut rows = String::new();
    for v in [0.0, 0.5, 1.0] {
        for u in [0.0, 0.25, 0.5, 0.75, 1.0] {
            writeln!(rows, "{},{},{}", 1.0 + 20.0 * u, 3.0 * v, 5.0 + 30.0 * v).unwrap();
        }
        rows.push('\n');
    }
    desk.write("grid.csv", rows);
    let nodes = "\"n\": TrunkNodes(nodes: [(0, 0, 0), (2, 1, 50), (0, 0, 100)]), \"s\": FitSkeleton(curve: \"n\"), \
                 \"t\": TrunkTime(tree: \"s\"), \
                 \"file\": CutSurface(solid: \"t\", shape: Points, file: \"grid.csv\"), \
                 \"plane\": CutPlane(solid: \"t\", origin: (1, 0, 5), u: (20, 0, 0), v: (0, 3, 30)),";
    desk.write("a.ron", format!("(canvas: (size_mm: 10, resolution: 16, tile: None), nodes: {{ {nodes} }})"));
    let values = |node: &str| -> Vec<f64> {
        let dump = desk.shibo(&format!("dump a.ron {node}")).expect(0).json();
        dump["values"].as_array().unwrap().iter().map(number).collect()
    };
    let (file, plane) = (values("file"), values("plane"));
    assert_eq!(file.len(), 256);
    assert!(file.iter().zip(&plane).all(|(a, b)| (a - b).abs() < 1e-4), "{file:?} {plane:?}");
    assert!(plane[255] - plane[0] > 1.0, "there is something to be seen");
}

/// Years from a picture: their colours, and the point of the line where they begin.
#[test]
fn reads_year_pattern_from_picture() {
    let desk = Desk::new();
    // Twenty years of 24 pixels, from light to dark.
    let shade = |x: u32| 220 - 4 * u8::try_from(x % 24).unwrap();
    let picture = image::RgbImage::from_fn(480, 60, |x, _| image::Rgb([shade(x), shade(x) - 40, shade(x) - 90]));
    picture.save(desk.path("rings.png")).unwrap();
    desk.write(
        "a.ron",
        "(canvas: (size_mm: (80, 10), resolution: (480, 60), tile: None), nodes: { \
         \"p\": Image(path: \"rings.png\"), \
         \"out\": ColorPattern(image: \"p\", line: ((3, 5), (77, 5)), strip: 3, entries: 24), \
         \"in\": ColorPattern(image: \"p\", line: ((77, 5), (3, 5)), strip: 3, entries: 24) })",
    );
    for node in ["out", "in"] {
        let dump = desk.shibo(&format!("dump a.ron {node}")).expect(0).json();
        let table = dump["table"].as_array().unwrap();
        assert_eq!(table.len(), 24);
        for (color, x) in table.iter().zip(0..) {
            let byte = [shade(x), shade(x) - 40, shade(x) - 90];
            for c in 0..3 {
                #[expect(clippy::cast_possible_truncation, reason = "a colour")]
                let got = linear_to_srgb(number(&color[c]) as f32) * 255.0;
                assert!((got - f32::from(byte[c])).abs() < 4.0, "{node}, entry {x}: {got} is not {}", byte[c]);
            }
        }
    }
}

#[test]
fn warns_of_leaning_trunk() {
    let desk = Desk::new();
    let graph = |x: f64| {
        format!(
            "(canvas: (size_mm: 10, tile: None), nodes: {{\n\"n\": TrunkNodes(nodes: [(0, 0, 0), (0, 0, 50), ({x}, 0, 100)]), \
             \"s\": FitSkeleton(curve: \"n\", scheme: Local) }})"
        )
    };
    desk.write("a.ron", graph(90.0));
    let ran = desk.shibo("dump a.ron s").expect(0);
    let text = ran.stderr.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(text.contains("leans by 61° between nodes 1 and 2") && text.contains("a.ron:2:"), "{}", ran.stderr);
    desk.write("a.ron", graph(40.0));
    assert_eq!(desk.shibo("dump a.ron s").expect(0).stderr, "");
}

#[test]
fn the_earlier_method_has_branches_too() {
    let desk = Desk::new();
    let nodes = "\"n\": TrunkNodes(nodes: [(0, 0, 0), (2, 1, 50), (0, 0, 100)]), \"s\": FitSkeleton(curve: \"n\"), \
                 \"b\": Branches(skeleton: \"s\", branches: [(height: 40, direction: (1, 0, 0.5), thickening_speed: 0.5)]), \
                 \"plain\": StraightTime(curve: \"n\"), \"both\": StraightTime(curve: \"n\", branches: \"b\"), \
                 \"branch\": BranchTime(tree: \"b\"),";
    desk.write("a.ron", format!("(canvas: (size_mm: 10, tile: None), nodes: {{ {nodes} }})"));
    desk.write("at.csv", "30,2,55\n-30,0,30\n");
    let (plain, both, branch) = (dump(&desk, "plain"), dump(&desk, "both"), dump(&desk, "branch"));
    let want = 1.0 / (plain[0].powi(-2) + branch[0].powi(-2)).sqrt();
    assert!((both[0] - want).abs() < 1e-9 && both[0] < plain[0]);
    assert!(branch[1].is_infinite() && both[1] == plain[1]);
}

/// Every mistake of users is refused at its place, with the valid values.
#[test]
fn refuses_invalid_wood_parameters() {
    let desk = Desk::new();
    desk.write("ragged.csv", "0,0,0\n1,0,0\n\n0,1,0\n");
    desk.write("nan.csv", "0,0,0\n1,0,nan\n");
    desk.write("short.csv", "0,0,0\n1,0\n");
    desk.write("huge.csv", "0,0,0\n1,0,0\n\n0,1,0\n1e308,1,0\n");
    desk.write("falls.csv", "0,0,0\n1,0,5\n0,0,4\n");
    let tree = r#""n": TrunkNodes(nodes: [(0, 0, 0), (2, 1, 50), (0, 0, 100)]), "s": FitSkeleton(curve: "n"), "t": TrunkTime(tree: "s"),"#;
    let cases = [
        (r#""a": TrunkNodes(nodes: [(0, 0, 0), (1, 0, 5), (0, 0, 4)]),"#, "bad-value", "node 2 is at height `4`"),
        (r#""a": TrunkNodes(nodes: [(0, 0, 0), (1, 0, 5), (0, 0, 5)]),"#, "bad-value", "node 2 is at height `5`"),
        (r#""a": TrunkNodes(nodes: [(0, 0, 0)]),"#, "bad-value", "a trunk needs at least 2"),
        (
            r#""n": TrunkNodes(nodes: [(0, 0, 0), (1, 0, 1), (0, 0, 6.2)]), "f": FitSkeleton(curve: "n"), "a": EqualizeHeight(skeleton: "f"),"#,
            "bad-value",
            "does not rise at node 0",
        ),
        (
            r#""n": TrunkNodes(nodes: [(0, 0, 0), (1, 0, 1), (0, 0, 8), (0, 0, 9)]), "f": FitSkeleton(curve: "n"), "a": TrunkTime(tree: "f"),"#,
            "bad-value",
            "does not rise at node",
        ),
        (r#""n": TrunkNodes(), "a": FitSkeleton(curve: "n", scheme: Given),"#, "bad-value", "there must be 4, 7, 10"),
        (r#""n": TrunkNodes(file: "short.csv"), "a": FitSkeleton(curve: "n"),"#, "bad-file", "line 2"),
        (r#""n": TrunkNodes(file: "nan.csv"), "a": FitSkeleton(curve: "n"),"#, "bad-file", "line 2"),
        (r#""n": TrunkNodes(file: "huge.csv"), "a": FitSkeleton(curve: "n"),"#, "bad-file", "line 5"),
        (
            r#""n": TrunkNodes(file: "falls.csv"), "a": FitSkeleton(curve: "n"),"#,
            "bad-value",
            "`falls.csv`: node 2 is at",
        ),
    ];
    let with_tree = [
        (r#""a": Branches(skeleton: "s", branches: [(height: 500)]),"#, "bad-value", "where there is no trunk"),
        (
            r#""a": Branches(skeleton: "s", branches: [(height: 5, thickening_speed: 0)]),"#,
            "out-of-range",
            "must be greater than 0",
        ),
        (
            r#""a": Branches(skeleton: "s", branches: [(height: 5, direction: (0, 0, 0))]),"#,
            "bad-value",
            "points nowhere",
        ),
        (r#""a": BranchTime(tree: "s", branch: 3),"#, "out-of-range", "numbered from 0"),
        (r#""a": TrunkTime(tree: Tree(skeleton: "s", thickening_speed: 0)),"#, "out-of-range", "greater than 0"),
        (r#""a": TrunkTime(tree: Tree(skeleton: "s", elongation_speed: -1)),"#, "out-of-range", "greater than 0"),
        (r#""a": BlendTimes(times: []),"#, "missing-input", "needs `times`"),
        (r#""a": BlendTimes(times: ["t"], origin: Branch),"#, "bad-value", "needs `tree`"),
        (r#""a": ColorPattern(stops: []),"#, "bad-value", "at least one stop"),
        (r##""a": ColorPattern(stops: [(0.5, "#fff"), (0.2, "#000")]),"##, "bad-value", "must not lie before"),
        (r##""p": "= #888", "a": ColorPattern(image: "p"),"##, "bad-value", "all is of one colour"),
        (
            r##""p": Perlin(), "q": GradientMap(input: "p"), "a": ColorPattern(image: "q", line: ((5, 5), (500, 5))),"##,
            "bad-value",
            "outside the picture",
        ),
        (
            r##""p": Perlin(), "q": GradientMap(input: "p"), "a": ColorPattern(image: "q", line: ((5, 5), (5, 5))),"##,
            "bad-value",
            "24 to 65536",
        ),
        (r#""a": VaryGrowth(time: "t", waves: [(20, 10, 100)]),"#, "bad-value", "would not rise outward"),
        (r#""a": VaryGrowth(time: "t", series: List([1, 0])),"#, "bad-value", "not greater than 0"),
        (r#""a": CutSurface(solid: "t", shape: Points, file: "ragged.csv"),"#, "bad-file", "this row has 1 points"),
        (r#""a": CutSurface(solid: "t", shape: Points, file: "nan.csv"),"#, "bad-file", "line 2"),
        (r#""a": CutSurface(solid: "t", shape: Points, file: "huge.csv"),"#, "bad-file", "line 5"),
        (r#""a": CutSurface(solid: "t", shape: Bezier),"#, "bad-value", "a patch needs 16"),
        (r#""a": CutPlane(solid: "t", u: (1, 0, 0), v: (2, 0, 0)),"#, "bad-value", "must span a plane"),
    ];
    let all = cases.iter().map(|c| (String::new(), c)).chain(with_tree.iter().map(|c| (tree.to_owned(), c)));
    for (before, (nodes, code, words)) in all {
        desk.write("a.ron", format!("(canvas: (size_mm: 40, tile: None), nodes: {{\n{before}\n{nodes}\n}})"));
        desk.write("p.csv", "1,2,3\n");
        let solid = nodes.contains("Time(") || nodes.contains("BlendTimes(") || nodes.contains("VaryGrowth(");
        let at = if solid { " --at p.csv" } else { " --resolution 8" };
        let ran = desk.shibo(&format!("dump a.ron a{at}"));
        assert_eq!(ran.code, Some(1), "{nodes}\n{}{}", ran.stdout, ran.stderr);
        let text = ran.stderr.split_whitespace().collect::<Vec<_>>().join(" ").replace("│ ", "");
        assert!(text.contains(words) && text.contains(code), "{nodes}: wanted {code}, `{words}`\n{}", ran.stderr);
        assert!(text.contains("a.ron:"), "{}", ran.stderr);
    }
}

/// Joins branches by the minimum of all times, as the source does, also with an unknown number of branches.
#[test]
fn whorls_can_be_joined_by_the_minimum() {
    let desk = Desk::new();
    let each: String = (0..6).map(|n| format!("\"b{n}\": BranchTime(tree: \"tree\", branch: {n}),")).collect();
    desk.write(
        "a.ron",
        format!(
            "(canvas: (size_mm: 10, tile: None), nodes: {{ \"n\": TrunkNodes(nodes: [(0, 0, 0), (2, 1, 300), (0, 0, 900)]), \
             \"trunk\": FitSkeleton(curve: \"n\"), \"t\": TrunkTime(tree: \"tree\"), {each} \
             \"tree\": Branches(skeleton: \"trunk\", whorl_spacing: 200, per_whorl: 3), \
             \"all\": BranchTime(tree: \"tree\", k: inf), \"min\": BlendTimes(times: [\"t\", \"all\"], k: inf), \
             \"all4\": BranchTime(tree: \"tree\", k: 4), \"plain\": BranchTime(tree: \"tree\") }})"
        ),
    );
    let tree = desk.shibo("dump a.ron tree").expect(0).json();
    let branches = tree["branches"].as_array().unwrap();
    assert!(branches.len() >= 6, "{}", branches.len());
    let mut at = String::new();
    for branch in &branches[..6] {
        let place = |d: usize| number(&branch["start"][d]) + 30.0 * number(&branch["direction"][d]) + 2.0;
        writeln!(at, "{},{},{}", place(0), place(1), place(2)).unwrap();
    }
    desk.write("at.csv", at);
    // Branches above are too far away to have an effect.
    let times: Vec<Vec<f64>> = (0..6).map(|n| dump(&desk, &format!("b{n}"))).collect();
    let trunk = dump(&desk, "t");
    let [all, min, all4, plain] = ["all", "min", "all4", "plain"].map(|name| dump(&desk, name));
    for p in 0..3 {
        let least = times.iter().map(|time| time[p]).fold(f64::INFINITY, f64::min);
        assert!(least.is_finite() && (all[p] - least).abs() < 1e-9, "{} {least}", all[p]);
        assert!((min[p] - least.min(trunk[p])).abs() < 1e-9);
        let norm = |k: f64| times.iter().map(|time| time[p].powf(-k)).sum::<f64>().powf(-1.0 / k);
        assert!((all4[p] - norm(4.0)).abs() < 1e-3 * least, "{} {}", all4[p], norm(4.0));
        assert!((plain[p] - norm(2.0)).abs() < 0.05 * least && plain[p] < all4[p] && all4[p] < all[p] + 1e-9);
    }
}

#[test]
fn warns_of_skeleton_without_branches() {
    let desk = Desk::new();
    desk.write(
        "a.ron",
        "(canvas: (size_mm: 10, tile: None), nodes: { \"n\": TrunkNodes(),\n\"s\": FitSkeleton(curve: \"n\"),\n\
         \"b\": BranchTime(tree: \"s\"),\n\"c\": CutPlane(solid: \"t\"), \"t\": BlendTimes(times: [\"x\", \"b\"]), \
         \"x\": TrunkTime(tree: \"s\") }, outputs: { \"o\": \"c\" })",
    );
    let ran = desk.shibo("render a.ron --resolution 32 --no-cache").expect(0);
    assert!(ran.stderr.contains("a.ron:3:23") && ran.stderr.contains("has no branches"), "{}", ran.stderr);
}
