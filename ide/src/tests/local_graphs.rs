//! Local graphs: each has names of its own, and shares the imports, graphs and functions of its file.
use super::super::actions::apply;
use super::super::hover::hover;
use super::super::rename::rename;
use super::super::tokens::{Token, tokens};
use super::super::{Section, complete, diagnose, navigate, structure};
use super::edits::NoPictures;
use super::{offered, with};

const TEXT: &str = r#"(
  functions: { "twice(a)": "2 * a" },
  graphs: {
    // A layer of waves.
    "layer": (
      inputs: { "ground": Gray(default: 0.5) },
      params: { "depth": Number(default: 1) },
      nodes: {
        "waves": Perlin(),
        "lost": Perlin(),
        "relief": "= twice(waves) * $depth + ground",
      },
      outputs: { "relief": "relief" },
    ),
    "both": (
      nodes: { "l": Use(graph: "layer"), "sum": "= l.relief + 1" },
      outputs: { "sum": "sum" },
    ),
  },
  nodes: {
    "waves": Worley(),
    "fine": Use(graph: "layer", with: { "depth": 0.2, "ground": "waves" }),
    "more": Use(graph: "both"),
    "end": "= fine.relief + more.sum + waves",
  },
  outputs: { "o": "end" },
)
"#;

#[test]
fn offers_the_names_of_a_local_graph() {
    let has = |from: &str, to: &str, label: &str| {
        let text = TEXT.replacen(from, to, 1);
        offered(&text).iter().any(|one| one == label)
    };
    let own = ("= twice(waves) * $depth + ground", "= |");
    for name in ["waves", "ground", "$depth", "twice", "u"] {
        assert!(has(own.0, own.1, name), "{name}");
    }
    for name in ["fine", "end", "l"] {
        assert!(!has(own.0, own.1, name), "{name}");
    }
    let outer = ("= fine.relief + more.sum", "= |");
    assert!(has(outer.0, outer.1, "fine") && !has(outer.0, outer.1, "ground"));
    assert!(!has(outer.0, outer.1, "$depth"));
    assert!(has("graph: \"both\"", "graph: \"|\"", "both") && has("graph: \"both\"", "graph: \"|\"", "layer"));
    // A local graph uses only those before it.
    let inner = ("Use(graph: \"layer\"), \"sum\"", "Use(graph: \"|\"), \"sum\"");
    assert!(has(inner.0, inner.1, "layer") && !has(inner.0, inner.1, "both"));
    let with = ("\"depth\": 0.2, ", "\"|\", ");
    assert!(has(with.0, with.1, "depth"));
    assert!(has("  functions: {", "  |\n  functions: {", "presets"));
    assert!(has("      outputs: { \"sum\"", "      |\n      outputs: { \"sum\"", "params"));
    assert!(!has("      outputs: { \"sum\"", "      |\n      outputs: { \"sum\"", "canvas"));
    assert!(has("      nodes: { \"l\": Use(graph: \"layer\")", "nodes: { \"l\": Use(|)", "graph"));
}

#[test]
fn renames_within_a_local_graph() {
    with(TEXT, |cx, file| {
        let renamed = |at: usize, name: &str| apply(TEXT, &rename(cx, file, at, name).unwrap()[&file.path]);
        let inner = renamed(TEXT.find("twice(waves)").unwrap() + 6, "sea");
        assert!(inner.contains("\"sea\": Perlin()") && inner.contains("= twice(sea) * $depth"), "{inner}");
        assert!(inner.contains("\"waves\": Worley()") && inner.contains("more.sum + waves"), "{inner}");
        let outer = renamed(TEXT.find("more.sum + waves").unwrap() + 11, "sea");
        assert!(outer.contains("\"sea\": Worley()") && outer.contains("\"ground\": \"sea\""), "{outer}");
        assert!(outer.contains("\"waves\": Perlin()"), "{outer}");
        let output = renamed(TEXT.find("l.relief").unwrap() + 2, "height");
        assert!(output.contains("{ \"height\": \"relief\" }") && output.contains("= l.height + 1"), "{output}");
        assert!(output.contains("= fine.height + more.sum"), "{output}");
        let graph = renamed(TEXT.find("graph: \"layer\"").unwrap() + 8, "sheet");
        assert_eq!(graph.matches("\"sheet\"").count(), 3, "{graph}");
        let param = renamed(TEXT.find("$depth").unwrap() + 1, "deep");
        assert!(param.contains("with: { \"deep\": 0.2"), "{param}");
        let function = renamed(TEXT.find("twice(a)").unwrap(), "double");
        assert!(function.contains("= double(waves)"), "{function}");
        assert!(rename(cx, file, TEXT.find("\"layer\"").unwrap() + 1, "both").unwrap_err().contains("already"));
    });
}

#[test]
fn finds_declarations_in_local_graphs() {
    with(TEXT, |cx, file| {
        let target = |at: usize| {
            let (_, place) = navigate::definition(cx, file, at).unwrap();
            TEXT[place.range.start..].lines().next().unwrap().trim_end_matches(',')
        };
        assert_eq!(target(TEXT.find("twice(waves)").unwrap() + 6), "\"waves\": Perlin()");
        assert_eq!(target(TEXT.find("fine.relief").unwrap() + 6), "\"relief\": \"relief\" }");
        assert_eq!(target(TEXT.find("graph: \"both\"").unwrap() + 8), "\"both\": (");
        let references = navigate::references(cx, file, TEXT.find("\"layer\"").unwrap() + 1);
        assert_eq!(references.len(), 3);
        let shown = hover(cx, TEXT.find("graph: \"layer\"").unwrap() + 8, &NoPictures).unwrap().markdown;
        assert!(shown.starts_with("local graph **layer**\n\nA layer of waves."), "{shown}");
        assert!(shown.contains("Inputs: `ground`") && shown.contains("Outputs: `relief`"), "{shown}");
    });
}

#[test]
fn reads_the_structure_of_local_graphs() {
    with(TEXT, |cx, file| {
        let outline = structure::outline(cx);
        let graphs = outline.iter().find(|entry| entry.name == "graphs").unwrap();
        let layer = &graphs.children[0];
        assert_eq!((layer.name.as_str(), layer.section), ("layer", Some(Section::Graphs)));
        let nodes = layer.children.iter().find(|entry| entry.name == "nodes").unwrap();
        let shown: Vec<_> = nodes.children.iter().map(|n| (n.name.as_str(), n.detail.as_str())).collect();
        assert_eq!(shown, [("waves", "Perlin → Gray"), ("lost", "Perlin → Gray"), ("relief", "formula → Gray")]);
        let hints = diagnose::hints(cx);
        let unused: Vec<&str> = hints.iter().map(|hint| file.at(&hint.range)).collect();
        assert_eq!(unused, ["\"lost\": Perlin()"]);
        let all = tokens(cx);
        assert!(all.windows(2).all(|pair| pair[0].0.end <= pair[1].0.start));
        let kinds: Vec<&str> =
            all.iter().filter(|(_, token)| *token == Token::Kind).map(|(range, _)| file.at(range)).collect();
        assert_eq!(kinds, ["Gray", "Number", "Perlin", "Perlin", "Use", "Worley", "Use", "Use"]);
        let at = TEXT.find("ground\",").unwrap();
        let selected = structure::selections(cx, at);
        assert!(selected.windows(2).all(|pair| pair[1].start <= pair[0].start && pair[0].end <= pair[1].end));
        assert!(selected.iter().any(|range| file.at(range).starts_with("\"layer\": (")));
        assert!(selected.iter().any(|range| file.at(range).starts_with("\"relief\": \"= twice")));
        assert_eq!(*selected.last().unwrap(), 0..TEXT.len());
        assert!(complete(cx, TEXT.find("// A layer").unwrap() + 4).is_empty());
    });
}

#[test]
fn survives_graphs_that_use_themselves() {
    let uses = |name: &str| (0..20).map(|n| format!("\"u{n}\": Use(graph: \"{name}\"), ")).collect::<String>();
    let outputs = (0..20).map(|n| format!("\"o{n}\": \"u{n}.o{n}\", ")).collect::<String>();
    let graphs: String = (0..20)
        .map(|n| {
            format!("\"g{n}\": (nodes: {{ {} }}, outputs: {{ {outputs} }}), ", uses(&format!("g{}", n.max(1) - 1)))
        })
        .collect();
    let text = format!(
        "(graphs: {{ {graphs} }}, nodes: {{ {} \"n\": \"= u1.o1 + 1\" }}, outputs: {{ \"o\": \"n\" }})",
        uses("g19")
    );
    with(&text, |cx, _| {
        assert_eq!(structure::outline(cx).len(), 3);
        assert!(!complete(cx, text.find("u1.o1 + 1").unwrap() + 3).is_empty());
    });
}
