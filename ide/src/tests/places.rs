//! Outlines, folds, selections and hints.
use super::super::{
    Cx, Section, Workspace, World, complete, diagnose, inlay, lens, navigate, signature, structure, tokens,
};
use super::{graphs, shipped, with};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_node::registry::{Family, Kind, Registry};
use shibo_node::{Context, Node, Output, Outputs};
use shibo_value::{Field, Stop, Type};
use std::path::Path;
use std::sync::Arc;

const TEXT: &str = "// One.
// Two.
(
  params: { \"p\": Number(default: 2, unit: \"mm\") },
  nodes: {
    // First.
    \"a\": Perlin(size: \"$p\"),
    \"b\": Blur(input: \"a\", radius: 1),

    // Second.
    \"c\": Blur(
      input: \"b\",
    ),
  },
  outputs: { \"o\": \"b\" },
)
";

#[test]
fn finds_outline_folds_and_selections() {
    with(TEXT, |cx, file| {
        let outline = structure::outline(cx);
        let nodes = outline.iter().find(|entry| entry.name == "nodes").unwrap();
        let shown: Vec<_> = nodes.children.iter().map(|n| (n.name.as_str(), n.detail.as_str())).collect();
        assert_eq!(shown, [("a", "Perlin → Gray"), ("b", "Blur → Gray"), ("c", "Blur → Gray")]);
        let folds: Vec<&str> = structure::folds(cx).iter().map(|(range, _)| file.at(range)).collect();
        assert!(folds.contains(&"// One.\n// Two."), "{folds:?}");
        assert!(
            folds.iter().any(|fold| fold.trim_start().starts_with("// First.") && fold.ends_with("radius: 1)")),
            "{folds:?}"
        );
        assert!(folds.iter().any(|fold| fold.starts_with("(\n      input")), "{folds:?}");
        let at = TEXT.find("a\", radius").unwrap();
        let selected: Vec<&str> = structure::selections(cx, at).iter().map(|range| file.at(range)).collect();
        assert_eq!(selected[..3], ["a", "\"a\"", "input: \"a\""]);
        assert_eq!(*selected.last().unwrap(), TEXT);
    });
    // A missing quote after a multi-byte letter.
    let open = "(version: 1, nodes: { \"a\": Perlin(note: \"é\n) })";
    with(open, |cx, file| {
        let ranges = structure::selections(cx, open.find('é').unwrap());
        assert!(ranges.len() > 2 && ranges.iter().all(|range| file.text.get(range.clone()).is_some()), "{ranges:?}");
    });
}

#[test]
fn shows_hints_inlays_and_signatures() {
    with(TEXT, |cx, file| {
        let hints = diagnose::hints(cx);
        assert_eq!(hints.len(), 1);
        assert!(hints[0].unneeded && file.at(&hints[0].range).starts_with("\"c\": Blur("));
        let inlays = inlay::inlays(cx, &(0..TEXT.len()), inlay::InlayKinds::default());
        let shown: Vec<(&str, &str)> =
            inlays.iter().map(|one| (TEXT[..one.at].rsplit([' ', '(']).next().unwrap(), one.text.as_str())).collect();
        assert!(shown.contains(&("\"$p\"", " = 2 mm")) && shown.contains(&("1", " mm")), "{shown:?}");
        let none = inlay::InlayKinds { units: false, values: false, types: false };
        assert!(inlay::inlays(cx, &(0..TEXT.len()), none).is_empty());
        let at = TEXT.find("a\", radius").unwrap();
        let (_, place) = navigate::definition(cx, file, at).unwrap();
        assert_eq!(file.at(&place.range), "\"a\"");
        let found = signature(cx, at).unwrap();
        assert_eq!(found.active.map(|i| &found.label[found.fields[i].0.clone()]), Some("input: Field"));
        let kinds: Vec<&str> = tokens::tokens(cx)
            .iter()
            .filter(|(_, token)| *token == tokens::Token::Kind)
            .map(|(range, _)| file.at(range))
            .collect();
        assert_eq!(kinds, ["Number", "Perlin", "Blur", "Blur"]);
        assert_eq!(lens::node_at(cx, at).as_deref(), Some("b"));
        assert_eq!(lens::node_at(cx, TEXT.find("\"o\"").unwrap()).as_deref(), Some("b"));
    });
}

/// Deprecated: nobody should use it any more. There is a better one.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
struct Old {
    /// Deprecated: it does nothing.
    level: f64,
}

impl Node for Old {
    const OUTPUTS: &'static [Output] = &[Output::new("value", Type::Gray, "Nothing.")];

    fn evaluate(&self, _cx: &Context<'_>) -> Result<Outputs, Stop> {
        Ok(Outputs::one(Field::constant(Type::Gray, &[0.0])))
    }
}

#[test]
fn shipped_graphs_need_all_their_nodes() {
    let workspace = shipped();
    for graph in shibo_library::graphs() {
        let file = workspace.file(&graphs().join(graph.path)).unwrap();
        let unused = diagnose::unused(Cx { world: &workspace, file: &file });
        let names: Vec<_> = unused.iter().map(|index| file.entries(Section::Nodes)[*index].name()).collect();
        assert!(names.is_empty(), "{}: {names:?}", graph.path);
    }
}

#[test]
fn allows_unused_names_with_underscore() {
    let mut workspace = Workspace::new(Arc::new(super::registry()), Vec::new());
    let text = "(imports: { \"g\": \"nowhere.ron\" }, nodes: { \"a\": Perlin(), \"_b\": Perlin(), \"c\": Perlin(), \
                \"u\": Use(graph: \"g\", with: { \"x\": \"c\" }) }, outputs: { \"o\": \"u\" })";
    let file = workspace.open(Path::new("/nowhere/a.ron"), text);
    let unused = diagnose::unused(Cx { world: &workspace, file: &file });
    assert_eq!(unused, [0], "what is given to a graph that cannot be read counts as needed");
}

#[test]
fn marks_deprecated_names() {
    let registry = Registry::new([Family { name: "Test", doc: "For tests.", kinds: vec![Kind::of::<Old>()] }]);
    let mut workspace = Workspace::new(Arc::new(registry), Vec::new());
    let text = "(nodes: { \"a\": Old(level: 1), \"b\": O }, outputs: { \"o\": \"a\", \"p\": \"b\" })";
    let file = workspace.open(Path::new("/nowhere/a.ron"), text);
    let cx = Cx { world: &workspace, file: &file };
    let hints = diagnose::hints(cx);
    let struck: Vec<&str> = hints.iter().filter(|hint| hint.deprecated).map(|hint| file.at(&hint.range)).collect();
    assert_eq!(struck, ["Old", "level"]);
    assert_eq!(hints[0].message, "Deprecated: nobody should use it any more.");
    let offers = complete(cx, text.find("O }").unwrap() + 1);
    assert!(offers.iter().any(|offer| offer.label == "Old" && offer.deprecated));
}

#[test]
fn bounds_answers_about_damaged_texts() {
    let nodes: String = (0..3000).map(|index| format!("    \"n{index}\": Perlin(),\n")).collect();
    let text = format!("(\n  nodes: {{\n{nodes}  }},\n  outputs: {{ \"o\": \"n0\" }},\n)\n");
    with(&text, |cx, _| assert_eq!(diagnose::hints(cx).len(), 1000));
    // Each sum contains the first number.
    let sum = format!("(nodes: {{ \"a\": \"= {}1\" }}, outputs: {{ \"o\": \"a\" }})", "1 + ".repeat(3000));
    with(&sum, |cx, _| {
        let ranges = structure::selections(cx, sum.find("1 +").unwrap());
        assert!((50..150).contains(&ranges.len()), "{}", ranges.len());
    });
    let comments = "/* a */ /* b */\n// c\n// d\n(nodes: {})\n/* e */ // f\n";
    with(comments, |cx, file| {
        let folds: Vec<&str> = structure::folds(cx).iter().map(|(range, _)| file.at(range)).collect();
        assert_eq!(folds, ["// c\n// d"]);
    });
}
