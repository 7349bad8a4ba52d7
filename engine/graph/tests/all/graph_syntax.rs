//! Syntax errors: each is reported once, near its place, and hides no other error.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::graph_nodes;

use shibo_graph::syntax::{TokenKind, Tree};
use shibo_graph::{LoadOptions, Loaded, load_text};
use shibo_value::diagnostics::{Code, Diagnostic};
use std::path::Path;

/// A typical graph, with a semantic error in its second line, in the last node and in the last output.
const GRAPH: &str = r##"(
  canvas: (size_mm: -40, resolution: 64, tile: Both),
  params: {
    "pitch": Number(default: 1.5, range: (0.4, 6), unit: "mm"),
    "label": Text(default: "x"),
  },
  presets: { "fine": { "pitch": 0.5 } },
  nodes: {
    // Bands.
    "bands": Bands(pitch: "$pitch", count: 3, label: "a, b"),
    "points": GridPoints(pitch: 1),
    "springs": Springs(
      lattice: "points.lattice",
      field: "bands",
    ),
    "sum": Sum(inputs: ["bands", 0.25, Bands(amount: 0.5)]),
    "mixed": Mix(a: Mix(a: "sum", b: 1), b: "bands", amount: "= 1 - 0.5"), // behind
    "wrong": Bands(pitch: -2),
  },
  outputs: {
    "sum": "sum",
    "lost": "nowhere",
  },
)
"##;

fn load(text: &str) -> Loaded {
    load_text(Path::new("a.ron"), text, &graph_nodes::registry(), &LoadOptions::default())
}

fn line(text: &str, at: usize) -> usize {
    text[..at].matches('\n').count() + 1
}

fn show(text: &str, found: &[Diagnostic]) -> String {
    found.iter().map(|d| format!("  line {}: {} {}\n", line(text, d.span.start), d.code, d.message)).collect()
}

/// The semantic errors, with the text that each one marks.
fn meant(text: &str, found: &[Diagnostic]) -> Vec<(Code, String)> {
    let of_meaning = found.iter().filter(|d| d.code != Code::Syntax && !d.warning);
    of_meaning.map(|d| (d.code, text[d.span.start..d.span.end].to_owned())).collect()
}

#[test]
fn reports_a_lost_token_near_its_place() {
    let whole = load(GRAPH);
    let wanted = meant(GRAPH, &whole.diagnostics);
    assert_eq!(wanted.len(), 3, "{}", show(GRAPH, &whole.diagnostics));
    let tokens = Tree::parse(GRAPH).tokens().to_vec();
    // Removes each token and each quote in turn. One syntax error must be reported nearby, and all other reports must
    // stay.
    let (mut faults, mut silent, mut wrong) = (0, 0, String::new());
    for token in &tokens {
        let mut cuts = vec![token.range()];
        if token.kind() == TokenKind::Str {
            cuts = vec![token.start()..token.start() + 1, token.end() - 1..token.end()];
        }
        if matches!(token.kind(), TokenKind::Ident | TokenKind::Number) {
            continue;
        }
        for cut in cuts {
            let text = format!("{} {}", &GRAPH[..cut.start], &GRAPH[cut.end..]);
            let tree = Tree::parse(text.as_str());
            faults += 1;
            if tree.errors().is_empty() {
                silent += 1;
                continue;
            }
            let found = load(&text);
            let syntax: Vec<_> = found.diagnostics.iter().filter(|d| d.code == Code::Syntax).collect();
            let extra: Vec<_> = meant(&text, &found.diagnostics).into_iter().filter(|d| !wanted.contains(d)).collect();
            let own = line(GRAPH, cut.start);
            let lost: Vec<_> = wanted
                .iter()
                .filter(|(_, word)| !meant(&text, &found.diagnostics).iter().any(|(_, found)| found == word))
                .filter(|(_, word)| line(GRAPH, GRAPH.find(word.as_str()).unwrap()) != own)
                .collect();
            let at = syntax.first().map_or(0, |d| d.span.start);
            let here = line(&text, at);
            // A missing token at the end of a line is noticed at the next entry; a comment may lie between.
            let near = (own..=own + 2).contains(&here);
            if syntax.len() != 1 || !extra.is_empty() || !lost.is_empty() || !near {
                wrong += &format!(
                    "{own}: without {:?} of {:?}\n{}",
                    &GRAPH[cut],
                    GRAPH.lines().nth(own - 1).unwrap(),
                    show(&text, &found.diagnostics)
                );
            }
        }
    }
    assert!(faults > 150 && silent <= 5, "{faults}, {silent}");
    assert!(wrong.is_empty(), "{wrong}");
}

#[test]
fn reports_all_of_several_mistakes() {
    let text = GRAPH
        .replace("count: 3,", "count: ,")
        .replace("\"points\": GridPoints(pitch: 1),", "\"points\": GridPoints(pitch: 1mm),")
        .replace("{ \"pitch\": 0.5 }", "{ \"pitch\" 0.5 }")
        .replace("\"sum\": \"sum\",", "\"sum\": \"sum,");
    let found = load(&text);
    let lines: Vec<_> = found.diagnostics.iter().map(|d| (line(&text, d.span.start), d.code)).collect();
    let wanted = [
        (2, Code::OutOfRange),
        (7, Code::Syntax),
        (10, Code::Syntax),
        (11, Code::Syntax),
        (18, Code::OutOfRange),
        (21, Code::Syntax),
        (22, Code::UnknownNode),
    ];
    assert_eq!(lines, wanted, "{}", show(&text, &found.diagnostics));
}
