//! Extremely deep or wide graphs: each command evaluates them or refuses with a reason, and none overflows its stack.
use crate::support::Desk;
use std::fmt::Write;

const COUNT: usize = 20_000;

/// A chain of nodes: `first`, then `COUNT` times `next`, in which `IN` is a wire from the node before, and `BEFORE` its name.
fn chain(first: &str, next: &str, last: &str) -> String {
    let mut nodes = format!("\"n0\": {first},\n");
    for i in 1..COUNT {
        writeln!(
            nodes,
            "\"n{i}\": {},",
            next.replace("IN", &format!("\"n{}\"", i - 1)).replace("BEFORE", &format!("n{}", i - 1))
        )
        .unwrap();
    }
    let last = last.replace("IN", &format!("\"n{}\"", COUNT - 1));
    format!(
        "(version: 1, canvas: (size_mm: 8, resolution: 16), nodes: {{ {nodes} \"out\": {last} }}, outputs: {{ \"out\": \"out\" }})"
    )
}

#[test]
fn chains_of_every_kind_are_evaluated() {
    let desk = Desk::new();
    let fields = chain("Perlin(size: 4)", "Invert(input: IN)", "Remap(input: IN)");
    let moved = chain("Perlin(size: 4)", "Warp(input: IN, x: \"n0\", amount: 0.001)", "Remap(input: IN)");
    // Repeated cubic interpolation at the same places amplifies values.
    let bent = chain("Perlin(size: 4)", "Warp(input: IN, amount: 0.4)", "Remap(input: IN)");
    let formulas = chain("Perlin(size: 4)", "\"= BEFORE * 1.0001\"", "Remap(input: IN)");
    let solids = chain("SolidNoise(size: 3)", "\"= max(BEFORE, n0)\"", "CutPlane(solid: IN)");
    let materials =
        chain("Material(roughness: 0.5)", "BlendMaterials(base: IN, top: \"n0\", mask: 0.5)", "Material(from: IN)");
    for (name, text) in [
        ("fields", fields),
        ("moved", moved),
        ("bent", bent),
        ("formulas", formulas),
        ("solids", solids),
        ("materials", materials),
    ] {
        desk.write(&format!("{name}.ron"), text);
        desk.shibo(&format!("check {name}.ron")).expect(0);
        desk.shibo(&format!("render {name}.ron -o {name} --no-cache --quiet")).expect(0);
    }
    for command in ["graph --format dot", "graph --format svg", "render --region 3,3,5,5 -o region --no-cache --quiet"]
    {
        let (name, options) = command.split_once(' ').unwrap();
        desk.shibo(&format!("{name} fields.ron {options}")).expect(0);
    }
    desk.shibo("dump fields.ron n19999").expect(0);
    desk.shibo("prepare moved.ron --cache-dir cache").expect(0);
    desk.shibo("fmt fields.ron").expect(0);
    desk.shibo("fmt fields.ron --check").expect(0);
}

#[test]
fn wide_nodes_and_files_are_evaluated_or_refused() {
    let desk = Desk::new();
    let head = "(version: 1, canvas: (size_mm: 8, resolution: 16), nodes: {";
    let points: String = (0..COUNT).map(|i| format!("({}, {}),", i % 8, i / 2500)).collect();
    desk.write("points.ron", format!("{head} \"p\": PointList(points: [{points}]), \"d\": Dots(points: \"p\", diameter: 0.2) }}, outputs: {{ \"d\": \"d\" }})"));
    desk.shibo("render points.ron -o points --no-cache --quiet").expect(0);
    let mut wide = format!("{head} \"n0\": Perlin(size: 3),");
    (1..COUNT).for_each(|i| write!(wide, "\"n{i}\": \"= n0 + 0.{i}\",").unwrap());
    let outputs: String = (0..COUNT).map(|i| format!("\"o{i}\": \"n{i}\",")).collect();
    desk.write("wide.ron", format!("{wide} }}, outputs: {{ {outputs} }})"));
    desk.shibo("check wide.ron").expect(0);
    desk.shibo("render wide.ron --output o19999 -o wide --no-cache --quiet").expect(0);
    let brackets = format!("\"n\": Perlin(size: \"= {}1\")", "(".repeat(COUNT));
    let fields = format!("\"p\": Perlin(size: 2), \"n\": \"= {}\"", vec!["p"; 3 * COUNT].join("+"));
    for nodes in [brackets, fields] {
        desk.write("formula.ron", format!("{head} {nodes} }}, outputs: {{ \"n\": \"n\" }})"));
        let refused = desk.shibo("check formula.ron").expect(1);
        assert!(refused.stderr.contains("bad-expression") && refused.stderr.len() < 4000, "{}", refused.stderr);
    }
    let numbers = format!("\"n\": Perlin(size: \"= {}\")", vec!["1"; COUNT].join("+"));
    desk.write("numbers.ron", format!("{head} {numbers} }}, outputs: {{ \"n\": \"n\" }})"));
    desk.shibo("check numbers.ron").expect(0);
    desk.write("nested.ron", format!("{head} \"n\": Perlin(size: {}1", "[".repeat(COUNT)));
    desk.shibo("check nested.ron").expect(1);
}

/// The work for a mistake does not grow with the length of its line.
#[test]
fn many_mistakes_in_one_line_are_told() {
    let desk = Desk::new();
    let nodes: String = (0..3000).map(|i| format!("\"n{i}\": Perlin(sizee: 2),")).collect();
    desk.write("line.ron", format!("(nodes: {{ {nodes} }})"));
    let told = desk.shibo("check --format json line.ron").expect(1).json();
    let errors = told["errors"].as_array().unwrap();
    let unknown = errors.iter().filter(|one| one["code"] == "unknown-field").count();
    // The list ends at 1,000 errors.
    assert!(errors.len() == 1000 && unknown > 990, "{unknown} of {}", errors.len());
}

#[test]
fn a_thousand_imports_are_evaluated_or_refused() {
    let desk = Desk::new();
    let leaf = "(params: { \"size\": Number(default: 3, doc: \"Size\") }, nodes: { \"n\": Perlin(size: \"$size\") }, outputs: { \"n\": \"n\" })";
    for i in 0..1000 {
        desk.write(&format!("leaf{i}.ron"), leaf);
        let next = format!(
            "(imports: {{ \"a\": \"deep{}.ron\" }}, nodes: {{ \"n\": Use(graph: \"a\") }}, outputs: {{ \"n\": \"n.n\" }})",
            i + 1
        );
        desk.write(&format!("deep{i}.ron"), next);
    }
    desk.write("deep1000.ron", leaf);
    let imports: String = (0..1000).map(|i| format!("\"i{i}\": \"leaf{i}.ron\",")).collect();
    let uses: String = (0..1000).map(|i| format!("\"u{i}\": Use(graph: \"i{i}\"),")).collect();
    desk.write(
        "wide.ron",
        format!("(version: 1, imports: {{ {imports} }}, nodes: {{ {uses} }}, outputs: {{ \"u\": \"u7.n\" }})"),
    );
    let wide = desk.shibo("check wide.ron");
    assert!(wide.code == Some(0) || wide.stderr.contains("imports"), "{}", wide.stderr);
    let deep = desk.shibo("check deep0.ron").expect(1);
    assert!(deep.stderr.contains("deep"), "{}", deep.stderr);
}
