//! Loading graph files: the linked graph, settings of the command line, and robustness against bad input.
use crate::graph_nodes;

use proptest::prelude::*;
use shibo_graph::{Gate, Input, Limits, LoadOptions, Loaded, load, load_text};
use shibo_value::diagnostics::Code;
use shibo_value::files::Memory;
use shibo_value::{Tiling, Type};
use std::path::Path;

const VALID: &str = r##"(
  version: 1, // the only one
  canvas: (size_mm: (60, 30), resolution: (64, 32), tile: X, seed: 7),
  params: {
    "pitch": Number(default: 0.8, range: (0.2, 4.0), unit: "mm", doc: "How far"),
    "n": Integer(default: 4),
    "on": Bool(default: true),
    "tint": Color(default: "#5b3a24"),
    "label": Text(default: "say \"hi\""),
    "form": Choice(default: "Linear", options: ["Smooth", "Linear"]),
  },
  presets: { "fine": { "pitch": 0.5, "tint": (0.1, 0.2, 0.3) } },
  nodes: {
    "bands": Bands(pitch: "$pitch", count: "= $n * 2", width: ("= $pitch / 2", 3), tint: "$tint", label: "$label",
      on: "$on", profile: "$form", k: inf, points: [(1, 2), ("$pitch", 4)], note: "a note",
      branches: [(height: 1, count: "$n")]),
    "again": Bands(profile: Fixed(0.5), label: r#"raw "text""#, line: 3),
    "points": GridPoints(pitch: 1),
    "springs": Springs(lattice: "points.lattice"),
    "sum": Sum(inputs: ["bands", 0.25, "again.value"]),
    "mixed": Mix(a: "bands.color", b: "#fff"),
    "gray": Mix(a: "bands"),
    "calf": Surface(base_color: "mixed", roughness: 0.5, height: "sum"),
    "tinted": Surface(base_color: "$tint", roughness: "= 1 - $pitch / 2"),
    "moved": Warp(input: "gray", vector: (1, -2)),
    "bare": GridPoints(pitch: 2),
  },
  outputs: { "calf": "calf", "height": File(from: "sum", format: Exr, depth: F32), "m-1.x": "moved" },
)"##;

fn with(text: &str, options: &LoadOptions) -> Loaded {
    load_text(Path::new("dir/a.ron"), text, &graph_nodes::registry(), options)
}

fn plain(text: &str) -> Loaded {
    with(text, &LoadOptions::default())
}

fn messages(loaded: &Loaded) -> Vec<String> {
    let show = |d: &shibo_value::diagnostics::Diagnostic| {
        let at = loaded.sources.position(d.span.file, d.span.start);
        format!("{}:{}:{} {} {}", loaded.sources.path(d.span.file).display(), at.line, at.column, d.code, d.message)
    };
    loaded.diagnostics.iter().map(show).collect()
}

#[test]
fn a_graph_is_linked() {
    let loaded = plain(VALID);
    assert_eq!(messages(&loaded), Vec::<String>::new());
    let graph = loaded.graph.unwrap();
    assert_eq!(
        (graph.canvas.seed, graph.canvas.resolution.x, graph.canvas.tile),
        (7, 64, Tiling { x: true, y: false })
    );
    let node = |name: &str| graph.nodes.node_weights().find(|node| node.name == name).unwrap();
    let sum = node("sum");
    assert_eq!(sum.slots, ["inputs", "inputs", "inputs"]);
    assert!(matches!(&sum.inputs[1], Input::Constant(field) if field.as_constant() == Some(&[0.25])));
    assert!(matches!(&sum.inputs[2], Input::Wire { output: 0, .. }));
    assert_eq!(node("springs").slots, ["lattice"]);
    assert!(matches!(&node("springs").inputs[0], Input::Wire { output: 1, .. }));
    assert_eq!((node("mixed").outputs[0], node("gray").outputs[0]), (Type::Rgb, Type::Gray));
    assert!(matches!(&node("tinted").inputs[0], Input::Constant(field) if field.ty() == Type::Rgb));
    assert!(matches!(&node("tinted").inputs[1], Input::Constant(field) if field.as_constant() == Some(&[0.6])));
    let outputs: Vec<_> = graph.outputs.iter().map(|output| (output.name.as_str(), output.ty)).collect();
    assert_eq!(outputs, [("calf", Type::Material), ("height", Type::Gray), ("m-1.x", Type::Gray)]);
    assert_eq!(graph.params[0].value, "0.8");
    assert_eq!(graph.presets, ["fine"]);
    assert_eq!(graph.nodes.edge_count(), 8);
}

/// The parameters of a node as its cache key sees them.
fn canonical(node: &str) -> Vec<u8> {
    let loaded = plain(&format!("(params: {{\"x\": Number(default: 8)}}, nodes: {{ \"a\": {node} }})"));
    let graph = loaded.graph.unwrap_or_else(|| panic!("{node}"));
    graph.nodes.node_weights().next().expect("there is one node").node.canonical()
}

#[test]
fn spelling_changes_no_key() {
    let same = canonical("Bands(pitch: 8.0, amount: 0.5)");
    for other in [
        "Bands(amount: 0.50, /* order */ pitch: 8)",
        "Bands(pitch: 8.00,)",
        "Bands(pitch: \"$x\", // a line\n)",
        "Bands(pitch: \"= $x + 0\", note: \"n\")",
        "Bands(pitch: 0.8e1, width: (1, 2.0))",
    ] {
        assert_eq!(canonical(other), same, "{other}");
    }
    assert_ne!(canonical("Bands(pitch: 8.1)"), same);
}

#[test]
fn the_command_line_sets_parameters() {
    let set = |set: &[(&str, &str)]| LoadOptions {
        set: set.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect(),
        preset: Some("fine".to_owned()),
        ..LoadOptions::default()
    };
    let good = with(VALID, &set(&[("n", "3"), ("label", "bare words"), ("tint", "#000000"), ("form", "Smooth")]));
    assert_eq!(messages(&good), Vec::<String>::new());
    let values: Vec<_> = good.graph.unwrap().params.into_iter().map(|param| param.value).collect();
    assert_eq!(values, ["0.5", "3", "true", "\"#000000\"", "\"bare words\"", "Smooth"]);

    let bad =
        with(VALID, &set(&[("pitch", "-3"), ("nope", "1"), ("n", "1.5"), ("on", "yes please"), ("form", "Flat")]));
    assert_eq!(
        messages(&bad),
        [
            "<command line>:1:13 out-of-range pitch is `-3`; it must be between 0.2 and 4 mm",
            "<command line>:1:7 unknown-param there is no parameter `nope`",
            "<command line>:1:9 type-mismatch parameter `n` must be a whole number; found a number `1.5`",
            "<command line>:1:10 type-mismatch parameter `on` must be `true` or `false`; found a text `\"yes please\"`",
            "<command line>:1:12 unknown-variant parameter `form` has no option `Flat`",
        ]
    );
    let preset = LoadOptions { preset: Some("fin".to_owned()), ..LoadOptions::default() };
    let bad = with(VALID, &preset);
    assert_eq!(messages(&bad), ["<command line>:1:10 unknown-variant there is no preset `fin`"]);
    assert_eq!(bad.diagnostics[0].help.as_deref(), Some("did you mean `fine`?"));
}

#[test]
fn reports_bad_values_of_the_command_line() {
    let text = "(params: {\"x\": Number(default: 1)}, nodes: {\"a\": Bands(pitch: \"$x\")})";
    let options = LoadOptions { set: vec![("x".to_owned(), "-1".to_owned())], ..LoadOptions::default() };
    let loaded = with(text, &options);
    assert_eq!(messages(&loaded), ["<command line>:1:9 out-of-range pitch is `-1`; it must be greater than 0 mm"]);
    assert_eq!(loaded.sources.position(loaded.diagnostics[0].related[0].span.file, 64).column, 65);
}

#[test]
fn sub_graphs_are_expanded() {
    let folder = tempfile::tempdir().unwrap();
    let inner = "(params: {\"p\": Number(default: 1)}, inputs: {\"f\": Gray(default: 0.5), \"c\": Rgb(default: \"own\")},
        nodes: {\"own\": Bands(pitch: \"$p\"), \"m\": Mix(a: \"f\", b: \"c\")}, outputs: {\"o\": \"m\", \"own\": \"own\"})";
    let outer = "(imports: {\"i\": \"i.ron\"}, nodes: {\"b\": Bands(), \"u\": Use(graph: \"i\", with: {\"f\": \"b\", \"p\": \"= 1+1\"}),
        \"v\": Use(graph: \"i\", with: {\"f\": \"u.own\", \"c\": \"b\"}), \"out\": Mix(a: \"v\", b: \"u\")}, outputs: {\"o\": \"out\"})";
    std::fs::write(folder.path().join("i.ron"), inner).unwrap();
    std::fs::write(folder.path().join("o.ron"), outer).unwrap();
    let loaded = load(&folder.path().join("o.ron"), &graph_nodes::registry(), &LoadOptions::default());
    assert_eq!(messages(&loaded), Vec::<String>::new());
    // A missing `shibo.toml`, in this folder or above, counts as read: once created, it would state where imports are.
    let (own, above): (Vec<_>, Vec<_>) = loaded.files.iter().partition(|path| path.starts_with(folder.path()));
    assert_eq!(own, ["o.ron", "shibo.toml", "i.ron"].map(|name| folder.path().join(name)).iter().collect::<Vec<_>>());
    assert!(!above.is_empty() && above.iter().all(|path| path.ends_with("shibo.toml")), "{above:?}");
    let graph = loaded.graph.unwrap();
    let mut names: Vec<_> = graph.nodes.node_weights().map(|node| node.name.as_str()).collect();
    names.sort_unstable();
    assert_eq!(names, ["b", "out", "u/f", "u/m", "u/own", "v/c", "v/f", "v/m", "v/own"]);
    let convert = graph.nodes.node_weights().find(|node| node.name == "v/c").unwrap();
    assert_eq!((convert.outputs[0], convert.node.no_op()), (Type::Rgb, None));
    let same = graph.nodes.node_weights().find(|node| node.name == "v/f").unwrap();
    assert_eq!((same.outputs[0], same.node.no_op()), (Type::Gray, Some("input")));
}

#[test]
fn paths_are_relative_to_their_graph_file() {
    let folder = tempfile::tempdir().unwrap();
    let (lib, work) = (folder.path().join("lib"), folder.path().join("work"));
    std::fs::create_dir(&lib).unwrap();
    std::fs::create_dir(&work).unwrap();
    for file in ["lib/a.png", "b.png", "work/c.png"] {
        std::fs::write(folder.path().join(file), "x").unwrap();
    }
    let inner =
        "(params: {\"p\": Path(default: \"a.png\")}, nodes: {\"i\": Image(path: \"$p\")}, outputs: {\"o\": \"i\"})";
    std::fs::write(lib.join("i.ron"), inner).unwrap();
    let outer =
        "(imports: {\"i\": \"lib/i.ron\"}, params: {\"q\": Path(default: \"b.png\")}, nodes: {\"u\": Use(graph: \"i\"),
        \"v\": Use(graph: \"i\", with: {\"p\": \"b.png\"}), \"w\": Use(graph: \"i\", with: {\"p\": \"$q\"})})";
    let main = folder.path().join("o.ron");
    std::fs::write(&main, outer).unwrap();
    let options = LoadOptions {
        set: vec![("q".to_owned(), "c.png".to_owned())],
        working_dir: work.clone(),
        ..LoadOptions::default()
    };
    let loaded = load(&main, &graph_nodes::registry(), &options);
    assert_eq!(messages(&loaded), Vec::<String>::new());
    let graph = loaded.graph.unwrap();
    let files = graph.nodes.node_weights().flat_map(|node| &node.files);
    let files: Vec<_> = files.map(|(_, file)| file.path().to_owned()).collect();
    assert_eq!(files, [lib.join("a.png"), folder.path().join("b.png"), work.join("c.png")]);
}

#[test]
fn unsaved_texts_count_instead_of_files() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("lib")).unwrap();
    let main = folder.path().join("main.ron");
    let text = |node: &str| format!("(nodes: {{\"a\": {node}}}, outputs: {{\"a\": \"a\"}})");
    let imports = "(imports: {\"i\": \"lib/../one.ron\", \"n\": \"lib/new\"}, ";
    std::fs::write(&main, text("Bands()").replacen('(', imports, 1)).unwrap();
    std::fs::write(folder.path().join("one.ron"), text("Bandz()")).unwrap();
    let overlay = [("one.ron", text("Bands()")), ("lib/new.ron", text("Bunds()"))];
    let options = LoadOptions {
        overlay: overlay.into_iter().map(|(name, text)| (folder.path().join(name), text.into())).collect(),
        ..LoadOptions::default()
    };
    let plain = load(&main, &graph_nodes::registry(), &LoadOptions::default());
    let codes = |loaded: &Loaded| loaded.diagnostics.iter().map(|d| d.code).collect::<Vec<_>>();
    assert_eq!(codes(&plain), [Code::FileNotFound, Code::UnknownKind], "{:?}", messages(&plain));
    let loaded = load(&main, &graph_nodes::registry(), &options);
    assert_eq!(codes(&loaded), [Code::UnknownKind], "{:?}", messages(&loaded));
    assert!(loaded.diagnostics[0].message.contains("Bunds"));
}

#[test]
fn refuses_unusable_files() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let code = |name: &str| {
        let loaded = load(&path(name), &graph_nodes::registry(), &LoadOptions::default());
        assert!(loaded.graph.is_none());
        assert_eq!(loaded.files[0], path(name));
        let d = &loaded.diagnostics[0];
        let at = loaded.sources.position(d.span.file, d.span.start);
        (d.code, at.line, at.column)
    };
    std::fs::write(path("empty"), "").unwrap();
    std::fs::write(path("binary"), b"(\nab\xff").unwrap();
    std::fs::write(path("deep"), "[".repeat(200)).unwrap();
    std::fs::write(path("huge"), vec![b' '; (8 << 20) + 1]).unwrap();
    assert_eq!(code("nowhere"), (Code::FileNotFound, 1, 1));
    assert_eq!(code(""), (Code::BadFile, 1, 1));
    assert_eq!(code("empty"), (Code::Syntax, 1, 1));
    assert_eq!(code("binary"), (Code::BadFile, 2, 3));
    assert_eq!(code("deep").0, Code::TooLarge);
    assert_eq!(code("huge"), (Code::TooLarge, 1, 1));
    #[cfg(unix)]
    {
        let made = std::process::Command::new("mkfifo").arg(path("pipe")).status();
        if made.is_ok_and(|status| status.success()) {
            assert_eq!(code("pipe"), (Code::BadFile, 1, 1));
        }
        assert_eq!(
            load(Path::new("/dev/zero"), &graph_nodes::registry(), &LoadOptions::default()).diagnostics[0].code,
            Code::BadFile
        );
    }
}

#[test]
fn refuses_exponential_imports() {
    let folder = tempfile::tempdir().unwrap();
    for i in 0..12 {
        let nodes: String = (0..10).map(|n| format!("\"n{n}\": Use(graph: \"i\"),")).collect();
        let text = format!("(imports: {{\"i\": \"{}.ron\"}}, nodes: {{{nodes}}}, outputs: {{\"o\": \"n0\"}})", i + 1);
        std::fs::write(folder.path().join(format!("{i}.ron")), text).unwrap();
    }
    std::fs::write(folder.path().join("12.ron"), "(nodes: {\"a\": Bands()}, outputs: {\"o\": \"a\"})").unwrap();
    let limits = Limits { max_nodes: 1000, ..Limits::default() };
    let options = LoadOptions { limits, ..LoadOptions::default() };
    let loaded = load(&folder.path().join("0.ron"), &graph_nodes::registry(), &options);
    assert!(loaded.graph.is_none());
    let codes: Vec<_> = loaded.diagnostics.iter().map(|d| d.code).collect();
    assert_eq!(codes, [Code::TooLarge], "{:?}", messages(&loaded));
}

/// A chain of nodes, each with a parameter and an expression.
fn chain(nodes: usize) -> String {
    let node = |i: usize| match i {
        0 => "\"n0\": Bands(pitch: \"$x\"),\n".to_owned(),
        i => format!("\"n{i}\": Mix(a: \"n{}\", b: 0.5, amount: \"= $x / {i}\"),\n", i - 1),
    };
    let nodes: String = (0..nodes).map(node).collect();
    format!("(params: {{\"x\": Number(default: 1)}}, nodes: {{{nodes}}}, outputs: {{\"o\": \"n1\"}})")
}

#[test]
fn every_node_is_built_once() {
    // The time is measured by `cargo bench --bench commands`.
    let registry = graph_nodes::registry();
    for count in [60, 600] {
        let before = graph_nodes::built();
        let loaded = load_text(Path::new("a.ron"), &chain(count), &registry, &LoadOptions::default());
        assert!(loaded.graph.is_some(), "{:?}", messages(&loaded));
        assert_eq!(graph_nodes::built() - before, count);
    }
}

fn check_spans(loaded: &Loaded) {
    for d in &loaded.diagnostics {
        for span in std::iter::once(d.span).chain(d.related.iter().map(|related| related.span)) {
            let text = loaded.sources.text(span.file);
            assert!(span.start <= span.end && span.end <= text.len(), "{d:?}");
            assert!(text.is_char_boundary(span.start) && text.is_char_boundary(span.end), "{d:?}");
        }
    }
    assert_eq!(loaded.graph.is_none(), loaded.has_errors());
}

#[test]
fn errors_of_formulas_lie_within_the_text() {
    for formula in ["=", "= ", "= é", "= a +", "= 1 é", "=é", "= $", "= $é", "= (", "= \u{a0}", "= \"", "= a \u{3000}"]
    {
        for end in ["", "\"", "\" }) é", "é"] {
            check_spans(&plain(&format!("(nodes: {{ \"a\": \"{formula}{end}")));
            check_spans(&plain(&format!("(nodes: {{ \"a\": Bands(pitch: \"{formula}{end}")));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 3000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn never_panics_at_changed_texts(at in 0..VALID.len(), len in 0_usize..40, put in ".{0,6}|[\"$=(){},.:a-z0-9#-]{0,8}") {
        let (at, end) = (VALID.floor_char_boundary(at), VALID.floor_char_boundary((at + len).min(VALID.len())));
        check_spans(&plain(&format!("{}{put}{}", &VALID[..at], &VALID[end.max(at)..])));
        check_spans(&plain(&VALID[..at]));
    }

    #[test]
    fn never_panics_at_exchanged_words(from in 0_usize..200, to in 0_usize..200) {
        let words: Vec<_> = VALID.split_inclusive([' ', ',', '(', ')', ':']).collect();
        let mut changed = words.clone();
        changed.swap(from % words.len(), to % words.len());
        check_spans(&plain(&changed.concat()));
        changed[from % words.len()] = "\"$pitch\"";
        check_spans(&plain(&changed.concat()));
    }

    #[test]
    fn never_panics_at_any_setting(value in "\\PC{0,12}", name in 0_usize..6) {
        let name = ["pitch", "n", "on", "tint", "label", "form"][name];
        let options = LoadOptions { set: vec![(name.to_owned(), value)], ..LoadOptions::default() };
        check_spans(&with(VALID, &options));
    }
}

#[test]
fn reads_graphs_and_their_files_from_memory() {
    let text = r#"(version: 1, canvas: (size_mm: (8, 8), resolution: (8, 8)), imports: { "p": "parts/p" },
  nodes: { "a": Image(path: "pictures/a.png"), "b": Image(path: "b.png") }, outputs: { "a": "a" })"#;
    let files = Memory::default().with("main.ron", text).with("parts/p.ron", "(version: 1, nodes: {}, outputs: {})");
    let files = files.with("./pictures/a.png", b"content");
    let read = |files: Memory| {
        let options = LoadOptions { gate: Gate::of(files), ..LoadOptions::default() };
        load(Path::new("main.ron"), &graph_nodes::registry(), &options)
    };
    let loaded = read(files.clone());
    let errors: Vec<String> =
        loaded.diagnostics.iter().filter(|one| !one.warning).map(|one| one.message.clone()).collect();
    assert_eq!(errors, ["there is no file `b.png`"]);
    let loaded = read(files.with("b.png", "other"));
    let graph = loaded.graph.unwrap_or_else(|| panic!("{:?}", loaded.diagnostics));
    let content = |name: &str| {
        let node = graph.nodes.node_weights().find(|node| node.name == name).unwrap();
        node.files[0].1.bytes(99).unwrap()
    };
    assert_eq!((content("a"), content("b")), (b"content".to_vec(), b"other".to_vec()));
    assert!(loaded.files.contains(&"parts/p.ron".into()), "{:?}", loaded.files);
}
