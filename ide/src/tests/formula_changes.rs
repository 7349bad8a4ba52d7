//! Formulas: renames, and actions that name a part or put a node in place.
use super::super::actions::{actions, apply};
use super::super::navigate;
use super::super::rename::rename;
use super::{at_cursor, registry, with};
use shibo_graph::{LoadOptions, load_text};
use std::path::Path;

/// The text after the name at the `|` was changed, or the reason for a refusal.
fn renamed(node: &str, name: &str) -> Result<String, String> {
    at_cursor(node, |cx, file, at| {
        let edits = rename(cx, file, at, name)?;
        Ok(edits.get(&file.path).map_or(file.text.to_string(), |edits| apply(&file.text, edits)))
    })
}

#[test]
fn renames_in_formulas_and_paths() {
    // Texts, new names, and what the result must contain.
    for (node, name, wanted) in [
        (r#""last": "= wa|ves * 2 - waves""#, "sea", r#""last": "= sea * 2 - sea""#),
        (r#""last": "= wa|ves * 2""#, "sea", r#"Material(base_color: "color", height: "sea")"#),
        (r#""last": "= lea|ther.height.x""#, "hide", r#""= hide.height.x""#),
        (r#""last": Blur(input: "lea|ther.height")"#, "hide", r#"input: "hide.height""#),
        (r#""last": "= $ti|nt.r * $pitch""#, "stain", r#""= $stain.r * $pitch""#),
        (r#""last": "= rid|ge(waves, 1)""#, "crest", r#""= crest(waves, 1)""#),
        (r#""last": "= rid|ge(waves, 1)""#, "crest", r#""crest(x, w)":"#),
        (r#""last": "= line|s.groove(waves)""#, "ruled", r#""= ruled.groove(waves)""#),
        (r#""last": "= line|s.groove(waves)""#, "ruled", r#"imports: { "ruled": "lines.ron" }"#),
        (r#""last": "= let fa|r = u; far.x * waves""#, "near", r#""= let near = u; near.x * waves""#),
        (
            r##""last": r#"= waves
           + wa|ves"#"##,
            "sea",
            "= sea\n           + sea\"#",
        ),
        (r#""last": "= fie|ld""#, "given", r#"inputs: { "given": Gray"#),
        (r#""last": "= \u{77}aves * wa|ves""#, "sea", ""),
        (r#""la|st": Perlin()"#, "final", r#""after": "= final + 1""#),
    ] {
        let text = renamed(node, name).unwrap_or_else(|error| panic!("{node}: {error}"));
        assert!(text.contains(wanted), "{node}: {text}");
    }
    let values = renamed(r#""last": "= ridge(|waves, 1)", "w": "= ridge(x, 1)""#, "sea").unwrap();
    assert!(values.contains("\"ridge(x, w)\": \"1 - smoothstep(0, w, abs(x))\""), "{values}");
}

#[test]
fn refuses_names_that_change_the_meaning() {
    for (node, name, why) in [
        (r#""last": "= wa|ves * x""#, "x", "would hide"),
        (r#""last": "= wa|ves * 2 * pi""#, "pi", "would hide"),
        (r#""last": "= if($style == Fine, wa|ves, 0)""#, "Fine", "would hide"),
        (r#""last": "= let r = 1; wa|ves * r""#, "r", "local name"),
        (r#""last": "= wa|ves""#, "let", "word of formulas"),
        (r#""last": "= let fa|r = 1; far * waves""#, "waves", "would hide"),
        (r#""last": "= let fa|r = 1; far * u""#, "u", "would hide"),
        (r#""last": "= let fa|r = 1; let near = 2; far * near""#, "near", "already"),
        (r#""last": "= rid|ge(waves, 1)""#, "clamp", "function of the language"),
        (r#""last": "= wa|ves""#, "cells", "already"),
        (r#""last": "= clam|p(waves, 0, 1)""#, "other", "there is no name"),
        (r#""last": "= unkno|wn""#, "other", "there is no name"),
    ] {
        match renamed(node, name) {
            Err(error) => assert!(error.contains(why), "{node}: {error}"),
            Ok(text) => panic!("{node}: {text}"),
        }
    }
    // Nothing reads the position, so nothing changes its meaning.
    assert!(renamed(r#""last": "= wa|ves * 2""#, "x").is_ok());
}

#[test]
fn renames_values_of_functions() {
    let text = "(functions: { \"f(a, b)\": \"a * b + g(a)\", \"g(a)\": \"a\" }, nodes: { \"a\": Perlin(), \"n\": \"= f(a, 1)\" }, outputs: { \"o\": \"n\" })";
    with(text, |cx, file| {
        let renamed = |at: usize, name: &str| rename(cx, file, at, name).map(|edits| apply(text, &edits[&file.path]));
        let at = text.find("a, b").unwrap();
        let wanted = text.replace("\"f(a, b)\": \"a * b + g(a)\"", "\"f(c, b)\": \"c * b + g(c)\"");
        assert_eq!(renamed(at, "c"), Ok(wanted));
        assert!(renamed(at, "b").unwrap_err().contains("already"));
        let of_g = renamed(text.find("g(a)\",").unwrap(), "h").unwrap();
        assert!(of_g.contains("a * b + h(a)") && of_g.contains("\"h(a)\": \"a\""), "{of_g}");
        let places = navigate::references(cx, file, text.find("f(a, 1)").unwrap());
        assert_eq!(places.len(), 2);
        assert_eq!(navigate::highlight(cx, at).len(), 3);
    });
}

#[test]
fn renames_outputs_of_uses_in_formulas() {
    let text = r#"(graphs: { "layer": (nodes: { "m": Material(), "p": Perlin() }, outputs: { "all": "m", "part": "p" }) },
 nodes: { "l": Use(graph: "layer"), "n": "= l.part * l.all.height", "k": Blur(input: "l.height") }, outputs: { "o": "n", "q": "k" })"#;
    with(text, |cx, file| {
        let at = text.find("l.part").unwrap() + 3;
        let edits = rename(cx, file, at, "share").unwrap();
        let renamed = apply(text, &edits[&file.path]);
        assert!(renamed.contains("\"share\": \"p\"") && renamed.contains("= l.share * l.all.height"), "{renamed}");
        assert!(rename(cx, file, at, "height").unwrap_err().contains("would hide the channel"));
    });
}

/// The text after the action whose title begins with `title`; `None` if it is not offered. A second `|` ends the selection.
fn after(text: &str, title: &str) -> Option<String> {
    let (from, to) = (text.find('|').unwrap(), text.rfind('|').unwrap());
    let plain = text.replace('|', "");
    with(&plain, |cx, file| {
        let selected = from..if to == from { from } else { to - 1 };
        let found = actions(cx, &selected, &[]).into_iter().find(|action| action.title.starts_with(title))?;
        let changed = apply(&plain, &found.edits[&file.path]);
        let loaded = load_text(Path::new("/nowhere/a.ron"), &changed, &registry(), &LoadOptions::default());
        assert!(loaded.graph.is_some(), "{changed}\n{:?}", loaded.diagnostics);
        Some(changed)
    })
}

/// A graph with these nodes, of which `n` is shown.
fn graph(nodes: &str) -> String {
    format!(
        "(\n  nodes: {{\n    \"a\": Perlin(),\n    \"b\": Perlin(seed: 1),\n{nodes}\n  }},\n  outputs: {{ \"o\": \"n\" }},\n)\n"
    )
}

#[test]
fn names_parts_of_formulas() {
    for (before, after_it) in [
        (
            "    // About n.\n    \"n\": \"= a |* 2 + b\",",
            Some("    \"n_part\": \"= a * 2\",\n    // About n.\n    \"n\": \"= n_part + b\","),
        ),
        ("    \"n\": \"= a * |(2 + b)\",", Some("    \"n_part\": \"= 2 + b\",\n    \"n\": \"= a * n_part\",")),
        ("    \"n\": \"= a * (|2 + b|)\",", Some("    \"n_part\": \"= 2 + b\",\n    \"n\": \"= a * n_part\",")),
        (
            "    \"n\": \"= clam|p(a, 0, 1) ^ 2\",",
            Some("    \"n_part\": \"= clamp(a, 0, 1)\",\n    \"n\": \"= n_part ^ 2\","),
        ),
        (
            "    \"n\": \"= let r = a + 1; b |* r - 2 * b\",",
            Some("    \"n_part\": \"= let r = a + 1; b * r\",\n    \"n\": \"= let r = a + 1; n_part - 2 * b\","),
        ),
        (
            "    \"n\": \"= let r = a |+ 1; b * r\",",
            Some("    \"n_part\": \"= a + 1\",\n    \"n\": \"= let r = n_part; b * r\","),
        ),
        (
            "    \"n\": Blur(input: \"= a |+ b\"),",
            Some("    \"n_part\": \"= a + b\",\n    \"n\": Blur(input: \"n_part\"),"),
        ),
        (
            "    \"n_part\": \"= b\",\n    \"n\": Blur(input: \"= |(a, b, 1).bgr * n_part\"),",
            Some(
                "    \"n_part\": \"= b\",\n    \"n_part_2\": \"= (a, b, 1)\",\n    \"n\": Blur(input: \"= n_part_2.bgr * n_part\"),",
            ),
        ),
        // The whole value of a node, single words, and formulas with mistakes.
        ("    \"n\": \"= a |+ b\",", None),
        ("    \"n\": \"= |a + b\",", None),
        ("    \"n\": Blur(input: \"= a + |2\"),", None),
    ] {
        let changed = after(&graph(before), "Name this part as node");
        let wanted = after_it.map(graph);
        assert_eq!(changed, wanted, "{before}");
    }
    let output = graph("    \"n\": \"= a\",").replace("\"o\": \"n\"", "\"o\": \"= n |* b\"");
    let changed = after(&output, "Name this part").unwrap();
    assert!(
        changed.contains("\"n\": \"= a\",\n    \"o_part\": \"= n * b\",\n")
            && changed.contains("{ \"o\": \"o_part\" }"),
        "{changed}"
    );
}

#[test]
fn puts_formulas_in_place() {
    for (before, after_it) in [
        // On the name of a node with a single reader.
        ("    \"m|\": \"= a + 1\",\n    \"n\": \"= m * b\",", Some("    \"n\": \"= (a + 1) * b\",")),
        ("    \"m|\": \"= a * 2\",\n    \"n\": \"= m + b\",", Some("    \"n\": \"= a * 2 + b\",")),
        ("    \"m|\": \"= a * 2\",\n    \"n\": Blur(input: \"m\"),", Some("    \"n\": Blur(input: \"= a * 2\"),")),
        (
            "    \"m|\": \"= (a, b, 1)\",\n    \"n\": Blur(input: \"m.r\"),",
            Some("    \"n\": Blur(input: \"= (a, b, 1).r\"),"),
        ),
        (
            "    \"m|\": \"= let r = a + 1; r * r\",\n    \"n\": \"= 2 * m\",",
            Some("    \"n\": \"= let r = a + 1; 2 * (r * r)\","),
        ),
        // At a reference; other readers keep the node.
        (
            "    \"m\": \"= a + 1\",\n    \"n\": \"= m| * m\",",
            Some("    \"m\": \"= a + 1\",\n    \"n\": \"= (a + 1) * m\","),
        ),
        ("    \"m|\": \"= a + 1\",\n    \"n\": \"= m * m\",", None),
        ("    \"m|\": \"= a + x\",\n    \"n\": \"= let x = 1; m * x\",", None),
        ("    \"n\": \"= a| * b\",", None),
    ] {
        let changed = after(&graph(before), "Put `");
        assert_eq!(changed, after_it.map(graph), "{before}");
    }
}

#[test]
fn extracts_and_inlines_formulas() {
    let text = r##"(
  functions: { "twice(a)": "2 * half(a)", "half(a)": "a / 2", "other(a)": "a" },
  params: { "p": Number(default: -2) },
  nodes: {
    "a": Perlin(),
    "m": Material(height: "a"),
    |"b": "= twice(a) * $p ^ 2 + m.height",
    "c": Blur(input: "b"),|
    "d": "= c * b",
  },
  outputs: { "o": "d", "q": "= b + 1" },
)
"##;
    let (from, to) = (text.find('|').unwrap(), text.rfind('|').unwrap());
    let plain = text.replace('|', "");
    let (changed, created) = with(&plain, |cx, file| {
        let found = actions(cx, &(from..to - 1), &[]);
        let action = found.into_iter().find(|action| action.title.starts_with("Extract")).unwrap();
        (apply(&plain, &action.edits[&file.path]), action.creates[0].1.clone())
    });
    assert!(created.contains("\"b\": \"= twice(a) * $p ^ 2 + m.height\""), "{created}");
    assert!(
        created.contains("\"twice(a)\"") && created.contains("\"half(a)\"") && !created.contains("other"),
        "{created}"
    );
    assert!(created.contains("\"a\": Gray(default: 0.5)") && created.contains("\"m\": Material()"), "{created}");
    assert!(
        changed.contains("\"d\": \"= c_part.c * c_part.b\"") && changed.contains("\"q\": \"= c_part.b + 1\""),
        "{changed}"
    );
    // And back again.
    let mut workspace = super::super::Workspace::new(std::sync::Arc::new(registry()), Vec::new());
    workspace.open(Path::new("/nowhere/c.ron"), created.as_str());
    let file = workspace.open(Path::new("/nowhere/a.ron"), changed.as_str());
    let cx = super::super::Cx { world: &workspace, file: &file };
    let at = changed.find("\"c_part\": Use").unwrap();
    let found = actions(cx, &(at..at), &[]);
    let action = found.into_iter().find(|action| action.title.starts_with("Put the nodes")).unwrap();
    let back = apply(&changed, &action.edits[&file.path]);
    assert!(back.contains("\"c_part_b\": \"= c.twice(a) * $p ^ 2 + m.height\""), "{back}");
    assert!(back.contains("\"d\": \"= c_part_c * c_part_b\"") && back.contains("\"q\": \"= c_part_b + 1\""), "{back}");
}

#[test]
fn inlines_values_into_formulas() {
    let text = r#"(
  graphs: {
    "layer": (
      inputs: { "f": Gray(default: 0.5), "g": Gray(default: "= own * 2") },
      params: { "p": Number(default: -2) },
      nodes: { "own": Perlin(), "n": "= f ^ 2 * $p + g" },
      outputs: { "n": "n", "sum": "= n + f" },
    ),
  },
  nodes: {
    "a": Perlin(),
    "l|": Use(graph: "layer", with: { "f": "= a + 1" }),
    "m": "= 2 * l.sum",
  },
  outputs: { "o": "m", "q": "l" },
)
"#;
    let changed = after(text, "Put the nodes").unwrap();
    // The formula that is given to `f` has several readers.
    assert!(changed.contains("\"l_f\": \"= a + 1\",\n    \"l_own\""), "{changed}");
    assert!(changed.contains("\"l_n\": \"= l_f ^ 2 * (-2) + l_own * 2\""), "{changed}");
    assert!(changed.contains("\"m\": \"= 2 * (l_n + l_f)\"") && changed.contains("\"q\": \"l_n\""), "{changed}");
}
