//! Graphs at and above the size limits: no recursion, no cost above linear in the text, and a bounded number of
//! reports.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::graph_nodes;

use shibo_graph::{Cancel, LoadOptions, Loaded, load, load_text};
use shibo_value::diagnostics::{Code, Diagnostic};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The limit of nodes in a graph, and of reports for a file.
const NODES: usize = 100_000;
const REPORTS: usize = 1000;

fn check(text: &str) -> Loaded {
    load_text(Path::new("a.ron"), text, &graph_nodes::registry(), &LoadOptions::default())
}

/// A graph of `count` nodes; the first has no input, the others are made from their index.
fn graph(count: usize, node: impl Fn(usize) -> String, output: &str) -> String {
    let nodes: String = (1..count).map(|i| format!("\"n{i}\": {},\n", node(i))).collect();
    format!("(nodes: {{\"n0\": Bands(),\n{nodes}}}, outputs: {{\"o\": \"{output}\"}})")
}

fn chain(count: usize) -> String {
    graph(count, |i| format!("Mix(a: \"n{}\")", i - 1), &format!("n{}", count - 1))
}

fn only(loaded: &Loaded) -> &Diagnostic {
    assert!(loaded.graph.is_none());
    let found: Vec<_> = loaded.diagnostics.iter().take(5).map(|d| &d.message).collect();
    assert_eq!(loaded.diagnostics.len(), 1, "{found:?}");
    &loaded.diagnostics[0]
}

#[test]
fn chains_and_wide_graphs_of_the_limit_are_checked() {
    let list: Vec<_> = (1..NODES - 1).map(|i| format!("\"n{i}\"")).collect();
    let sum = format!("Sum(inputs: [{}])", list.join(","));
    let wide = graph(NODES, |i| if i == NODES - 1 { sum.clone() } else { "Mix(a: \"n0\")".to_owned() }, "n1");
    for text in [chain(NODES), wide] {
        let loaded = check(&text);
        let graph = loaded.graph.unwrap_or_else(|| panic!("{:?}", loaded.diagnostics.first()));
        assert_eq!(graph.nodes.node_count(), NODES);
        assert!(graph.advice().is_empty());
    }
}

#[test]
fn refuses_one_node_more_with_the_reason() {
    let loaded = check(&chain(NODES + 1));
    let error = only(&loaded);
    assert_eq!(error.code, Code::TooLarge);
    assert!(error.message.contains("more than 100000 nodes"), "{}", error.message);
}

#[test]
fn reports_a_cycle_of_maximum_length_briefly() {
    let text = chain(NODES).replace("Bands()", &format!("Mix(a: \"n{}\")", NODES - 1));
    let loaded = check(&text);
    let error = only(&loaded);
    assert_eq!(error.code, Code::Cycle);
    assert!(error.message.len() < 200 && error.related.len() < 10, "{error:?}");
}

#[test]
fn a_thousand_imports_are_refused_with_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    let loaded = |name: &str| load(&folder.path().join(name), &graph_nodes::registry(), &LoadOptions::default());
    for i in 0..1000 {
        let next = i + 1;
        let text = format!(
            "(imports: {{\"i\": \"{next}.ron\"}}, nodes: {{\"n\": Use(graph: \"i\")}}, outputs: {{\"o\": \"n\"}})"
        );
        write(&format!("{i}.ron"), &text);
        write(&format!("leaf{i}.ron"), "(nodes: {\"n\": Bands()}, outputs: {\"o\": \"n\"})");
    }
    write("1000.ron", "(nodes: {\"n\": Bands()}, outputs: {\"o\": \"n\"})");
    let nested = loaded("0.ron");
    assert_eq!(only(&nested).code, Code::TooLarge);
    assert!(only(&nested).message.contains("nested 32 deep"), "{}", only(&nested).message);

    let imports: String = (0..1000).map(|i| format!("\"i{i}\": \"leaf{i}.ron\",")).collect();
    let nodes: String = (0..1000).map(|i| format!("\"n{i}\": Use(graph: \"i{i}\"),")).collect();
    write("wide.ron", &format!("(imports: {{{imports}}}, nodes: {{{nodes}}}, outputs: {{\"o\": \"n0\"}})"));
    let wide = loaded("wide.ron");
    assert!(wide.graph.is_none());
    assert_eq!(wide.diagnostics.len(), 1000 - 256);
    assert!(wide.diagnostics.iter().all(|d| d.code == Code::TooLarge), "{:?}", wide.diagnostics[0]);
}

#[test]
fn limits_the_number_of_errors() {
    let many = 20_000;
    let texts = [
        (graph(many, |_| "Perlim(size: 2)".to_owned(), "n0"), Code::UnknownKind),
        (graph(many, |i| format!("Mix(a: \"m{i}\")"), "n0"), Code::UnknownNode),
        (graph(many, |_| "Mix(a: \"points\", b: 0.5, nowhere: 1)".to_owned(), "n0"), Code::UnknownField),
        (format!("(nodes: {{ {} }})", "\"n\": Bands(),".repeat(many)), Code::DuplicateKey),
        (format!("(nodes: {{ \"n\": Bands(amount: \"= {}\") }})", "foo(1) + ".repeat(many)), Code::BadExpression),
    ];
    for (text, code) in texts {
        let loaded = check(&text);
        assert!(loaded.graph.is_none());
        assert!(loaded.diagnostics.iter().any(|d| d.code == code));
        if code == Code::BadExpression {
            assert!(loaded.diagnostics.len() <= 16);
            continue;
        }
        assert_eq!(loaded.diagnostics.len(), REPORTS);
        let last = loaded.diagnostics.last().unwrap();
        let told: usize = last.message.split(' ').next().unwrap().parse().unwrap();
        assert!(last.code == Code::TooLarge && !last.warning, "{last:?}");
        assert!(told + REPORTS >= many, "{told}: {}", last.message);
    }
}

#[test]
fn reports_errors_before_warnings() {
    let warnings = graph(3000, |_| "Bands(pitch: 13)".to_owned(), "n0");
    let loaded = check(&warnings);
    assert!(loaded.graph.is_some() && loaded.diagnostics.iter().all(|d| d.warning));
    assert_eq!(loaded.diagnostics.len(), REPORTS);
    let loaded = check(&warnings.replace("\"o\": \"n0\"", "\"o\": \"nowhere\""));
    assert!(loaded.graph.is_none());
    assert_eq!(loaded.diagnostics.iter().filter(|d| d.code == Code::UnknownNode).count(), 1);
    assert_eq!(loaded.diagnostics.len(), REPORTS);
    assert!(loaded.diagnostics.last().unwrap().warning, "what is left out are warnings");
}

#[test]
fn walks_long_chains_of_inputs_once() {
    let count = 20_000;
    let inputs: String = (0..count).map(|i| format!("\"i{i}\": Gray(default: \"i{}\"),", i + 1)).collect();
    let text = |last: &str, node: &str| {
        format!(
            "(inputs: {{{inputs} \"i{count}\": Gray(default: {last})}}, nodes: {{\"n\": {node}}}, outputs: {{\"o\": \"n\"}})"
        )
    };
    let loaded = check(&text("\"n\"", "Bands()"));
    assert!(loaded.graph.is_some(), "{:?}", loaded.diagnostics.first());
    let loaded = check(&text("0.5", "Mix(a: \"i7\", b: \"i0\")"));
    assert!(loaded.graph.is_some(), "{:?}", loaded.diagnostics.first());
    let loaded = check(&text("\"i5\"", "Bands()"));
    assert_eq!(only(&loaded).code, Code::Cycle);
}

#[test]
fn refuses_deeply_nested_expressions() {
    for text in ["(".repeat(1 << 17), "-".repeat(1 << 17), "min(".repeat(1 << 15), "2^".repeat(1 << 16)] {
        let loaded = check(&format!("(nodes: {{\"n\": Bands(amount: \"= {text}1\")}})"));
        let error = only(&loaded);
        assert_eq!(error.code, Code::BadExpression);
        assert!(error.message.contains("256"), "{}", error.message);
    }
}

/// Loads a text until the load asks for the `last` time whether it was cancelled; also returns how many times it asked.
fn load_until(last: usize, text: &str) -> (Loaded, usize) {
    let asked = Arc::new(AtomicUsize::new(0));
    let count = asked.clone();
    let cancel = Cancel::new(move || count.fetch_add(1, Ordering::Relaxed) + 1 >= last);
    let options = LoadOptions { cancel, ..LoadOptions::default() };
    let loaded = load_text(Path::new("a.ron"), text, &graph_nodes::registry(), &options);
    (loaded, asked.load(Ordering::Relaxed))
}

/// Functions `f0`, `f1` and so on, each of which calls the one before.
fn functions(count: usize) -> String {
    let others: String = (1..count).map(|i| format!("\"f{i}(x)\": \"f{}(x) + 1\", ", i - 1)).collect();
    format!("functions: {{ \"f0(x)\": \"x\", {others} }}")
}

#[test]
fn a_cancelled_load_ends_soon_and_tells_nothing() {
    let nodes: String = (0..200).map(|i| format!("\"n{i}\": \"= f20(x) + {i}\", ")).collect();
    let text = format!("({}, nodes: {{ {nodes} \"bad\": Nothing() }}, outputs: {{ \"o\": \"n0\" }})", functions(200));
    let (whole, asked) = load_until(usize::MAX, &text);
    assert_eq!(only(&whole).code, Code::UnknownKind);
    assert!(asked > 300, "asked {asked} times");
    for last in [1, 2, asked / 8, asked / 4, asked / 2, asked - 1, asked] {
        let (loaded, count) = load_until(last, &text);
        assert!(loaded.graph.is_none() && loaded.diagnostics.is_empty(), "{last}: {:?}", loaded.diagnostics);
        assert!(count < last + 10, "asked {} times after {last}", count - last);
    }
}

#[test]
fn functions_are_checked_once_and_have_a_limit_like_local_graphs() {
    let part = "(nodes: { \"n\": Bands() }, outputs: { \"o\": \"n\" })";
    let text = |functions_of_file: usize, count: usize| {
        let graphs: String = (0..count).map(|i| format!("\"g{i}\": {part}, ")).collect();
        let nodes = "nodes: { \"u\": Use(graph: \"g7\") }, outputs: { \"o\": \"u\" }";
        format!("({}, graphs: {{ {graphs} }}, {nodes})", functions(functions_of_file))
    };
    let (loaded, asked) = load_until(usize::MAX, &text(256, 256));
    assert!(loaded.graph.is_some(), "{:?}", loaded.diagnostics);
    // Each local graph asks for its node, not for all functions of the file.
    assert!(asked < 10_000, "asked {asked} times");
    for (count, graphs, what) in [(256, 20_000, "graphs"), (20_000, 256, "functions")] {
        let (loaded, _) = load_until(usize::MAX, &text(count, graphs));
        let error = only(&loaded);
        assert_eq!(error.code, Code::TooLarge);
        assert_eq!(error.message, format!("too many {what} in a file; there may be 256"));
    }
}

#[test]
fn brief_errors_are_the_same_without_suggestions() {
    let nodes =
        r#""a": Bandz(), "b": Mix(a: "aa", amont: 3), "red": Bands(), "c": Mix(a: "= redd + 1", b: "= clamb(1)")"#;
    let text = format!("(imports: {{}}, nodes: {{ {nodes} }}, outputs: {{ \"o\": \"bb\" }}, presetz: {{}})");
    let said = |brief: bool| {
        let options = LoadOptions { brief, ..LoadOptions::default() };
        load_text(Path::new("a.ron"), &text, &graph_nodes::registry(), &options).diagnostics
    };
    let (whole, brief) = (said(false), said(true));
    let errors = |of: &[Diagnostic]| of.iter().map(|d| (d.code, d.span, d.message.clone())).collect::<Vec<_>>();
    assert_eq!(errors(&whole), errors(&brief));
    let suggests = |of: &[Diagnostic]| {
        let helps = of.iter().filter_map(|d| d.help.as_deref());
        helps.filter(|help| help.contains("did you mean `Bands`")).count()
    };
    assert_eq!((whole.len() > 3, suggests(&whole), suggests(&brief)), (true, 1, 0), "{whole:?}");
}
