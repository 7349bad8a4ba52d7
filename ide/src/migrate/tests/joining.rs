//! Values that are written where they are read, and values that keep a node.
use super::{graph, lines, migrated};

fn nodes(text: &str, outputs: &str) -> String {
    lines(text, outputs).0
}

#[test]
fn chains_become_one_formula() {
    let chain = r#"    "h1": Math(operation: MultiplyAdd, a: "n", b: 0.16, c: -0.08),
    "h2": Math(operation: MultiplyAdd, a: "k", b: "= -0.16 * $wide", c: "h1"),
    "h3": Math(operation: Multiply, a: "h2", b: "$wide"),
    "r": HeightToNormal(input: "h3"),
    "e": Emboss(input: "h3"),
"#;
    let expected = r#"    "h3": "= $wide * (0.16 * n - 0.08 - 0.16 * $wide * k)",
    "r": HeightToNormal(input: "h3"),
    "e": Emboss(input: "h3"),
"#;
    assert_eq!(nodes(chain, "\"o\": \"r\", \"p\": \"e\""), expected);
}

#[test]
fn nodes_with_several_readers_stay() {
    let text = r#"    "h": Math(operation: Multiply, a: "n", b: 2),
    "r": Math(operation: Add, a: "h", b: "k"),
    "q": Math(operation: Multiply, a: "h", b: "h"),
"#;
    let (nodes, outputs) = lines(text, "\"o\": \"r\", \"p\": \"q\"");
    assert_eq!(nodes, "    \"h\": \"= 2 * n\",\n");
    assert_eq!(outputs, "\"o\": \"= h + k\", \"p\": \"= h * h\"");
}

#[test]
fn formula_that_uses_a_value_twice_keeps_its_name() {
    let text = r#"    "h": Math(operation: Multiply, a: "n", b: 2),
    "r": Expression(a: "h", formula: "a * (1 - a)"),
"#;
    assert_eq!(lines(text, "\"o\": \"r\"").1, "\"o\": \"= h * (1 - h)\"");
}

#[test]
fn results_that_may_not_be_finite_keep_their_nodes() {
    let text = r#"    "q": Math(operation: Divide, a: "n", b: "k"),
    "r": Math(operation: Add, a: "q", b: 1),
    "whole": Math(operation: Divide, a: "k", b: "n"),
    "e": Emboss(input: "whole"),
"#;
    let (nodes, outputs) = lines(text, "\"o\": \"r\", \"p\": \"e\"");
    assert_eq!(nodes, "    \"q\": \"= n / k\",\n    \"e\": Emboss(input: \"= k / n\"),\n");
    assert_eq!(outputs, "\"o\": \"= q + 1\", \"p\": \"e\"");
}

#[test]
fn long_formulas_grow_no_further() {
    let mut text = "    \"h0\": Math(operation: Multiply, a: \"n\", b: 2),\n".to_owned();
    for i in 1..40 {
        text += &format!("    \"h{i}\": Math(operation: MultiplyAdd, a: \"k\", b: 0.{i}, c: \"h{}\"),\n", i - 1);
    }
    let (nodes, outputs) = lines(&text, "\"o\": \"h39\"");
    let formulas: Vec<&str> = nodes.lines().collect();
    assert!((3..8).contains(&formulas.len()), "{nodes}");
    for line in formulas {
        assert!(line.len() <= 120 && line.matches(['+', '*', '-']).count() <= 14, "{line}");
    }
    assert!(outputs.starts_with("\"o\": \"= h"), "{outputs}");
}

#[test]
fn lines_keep_to_the_width() {
    let text = r#"    "tall": Expression(a: "n", b: "k", formula: "0.123 * smoothstep(0.1234, 0.5678, a) + 0.456 * smoothstep(0.2345, 0.6789, b) - 0.1"),
    "r": AmbientOcclusion(input: "tall", radius: 0.25, strength: 1.6),
"#;
    let found = nodes(text, "\"o\": \"r\"");
    let formula = "0.123 * smoothstep(0.1234, 0.5678, n) + 0.456 * smoothstep(0.2345, 0.6789, k) - 0.1";
    let expected = format!(
        "    \"tall\": \"= {formula}\",\n    \"r\": AmbientOcclusion(input: \"tall\", radius: 0.25, strength: 1.6),\n"
    );
    assert_eq!(found, expected);
}

#[test]
fn very_long_formulas_have_lines() {
    let formula = (0..12).map(|i| format!("0.{i}5 * smoothstep(0.1, 0.9, a)")).collect::<Vec<_>>().join(" + ");
    let found =
        nodes(&format!("    \"r\": Expression(a: \"n\", formula: \"{formula}\"),\n"), "\"o\": \"r\", \"p\": \"r\"");
    assert!(found.starts_with("    \"r\": r#\"= 0.05 * smoothstep(0.1, 0.9, n) + "), "{found}");
    assert!(found.lines().all(|line| line.len() <= 120) && found.lines().count() > 2, "{found}");
    assert!(found.lines().skip(1).all(|line| line.starts_with("      + 0.")), "{found}");
}

#[test]
fn every_place_of_a_node_holds_a_formula() {
    let text = r#"    "a1": Math(operation: Multiply, a: "n", b: 2),
    "a2": Math(operation: Multiply, a: "n", b: 3),
    "a3": Math(operation: Multiply, a: "n", b: 4),
    "a4": Math(operation: Multiply, a: "n", b: 5),
    "list": Switch(inputs: ["a1", "k"]),
    "given": Use(graph: "other", with: { "field": "a2" }),
    "layered": LayerMaterials(base: "m", layers: [(material: "m", mask: "a3")]),
    "inside": Blur(input: Emboss(input: "a4")),
"#;
    let expected = r#"    "list": Switch(inputs: ["= 2 * n", "k"]),
    "given": Use(graph: "other", with: { "field": "= 3 * n" }),
    "layered": LayerMaterials(base: "m", layers: [(material: "m", mask: "= 4 * n")]),
    "inside": Blur(input: Emboss(input: "= 5 * n")),
"#;
    assert_eq!(nodes(text, "\"o\": \"list\""), expected);
}

#[test]
fn defaults_of_inputs_hold_formulas() {
    let text = "(\n  inputs: {\n    \"tall\": Gray(default: \"plain\"),\n  },\n  nodes: {\n    \"n\": Perlin(),\n    \
                \"plain\": Math(operation: Multiply, a: \"n\", b: -0.12),\n    \
                \"r\": Math(a: \"tall\", b: 1),\n  },\n  outputs: { \"o\": \"r\" },\n)\n";
    let expected = "(\n  inputs: {\n    \"tall\": Gray(default: \"= -0.12 * n\"),\n  },\n  nodes: {\n    \"n\": Perlin(),\n  },\n  \
                    outputs: { \"o\": \"= tall + 1\" },\n)\n";
    assert_eq!(migrated(text).text, expected);
}

#[test]
fn files_read_nodes_but_hold_no_formulas() {
    let text = r#"    "h": Math(operation: Multiply, a: "n", b: 2),
    "path": MaterialChannel(material: "m", channel: Height),
"#;
    let (nodes, outputs) = lines(text, "\"o\": File(from: \"h\", depth: U16), \"p\": File(from: \"path\")");
    assert_eq!(nodes, "    \"h\": \"= 2 * n\",\n");
    assert_eq!(outputs, "\"o\": File(from: \"h\", depth: U16), \"p\": File(from: \"m.height\")".trim_end_matches(')'));
}

#[test]
fn nodes_in_place_become_formulas_in_place() {
    let text = r#"    "r": Blur(input: Math(operation: Multiply, a: Math(a: "n", b: 1), b: Expression(a: "k", formula: "a / 2"))),
"#;
    assert_eq!(nodes(text, "\"o\": \"r\""), "    \"r\": Blur(input: \"= k / 2 * (n + 1)\"),\n");
}

#[test]
fn other_nodes_in_place_get_names() {
    let text = r#"    "r": Math(operation: Multiply, a: Perlin(size: 4, mask: Math(a: "n", b: 1)), b: Perlin(size: 5)),
    "place": SplitChannels(input: HeightToNormal(input: "k")),
    "e": Math(a: "place.r", b: "place.g"),
"#;
    let expected = r#"    "perlin": Perlin(size: 4, mask: "= n + 1"),
    "perlin_2": Perlin(size: 5),
    "place": HeightToNormal(input: "k"),
"#;
    let (nodes, outputs) = lines(text, "\"o\": \"r\", \"p\": \"e\"");
    let expected = if nodes.contains("mask: Math") {
        expected.replace("\"= n + 1\"", "Math(a: \"n\", b: 1)")
    } else {
        expected.to_owned()
    };
    let mut sorted: Vec<&str> = nodes.lines().collect();
    sorted.sort_unstable();
    let mut wanted: Vec<&str> = expected.lines().collect();
    wanted.sort_unstable();
    assert_eq!(sorted, wanted);
    assert_eq!(outputs.matches("perlin").count(), 2, "{outputs}");
    assert!(outputs.contains("\"p\": \"= place.r + place.g\""), "{outputs}");
}

#[test]
fn comments_move_with_nodes_that_get_names() {
    let text = r#"    "r": Math(
      // outside
      a: Perlin(
        // inside
        size: 4,
      ),
      b: 2,
    ),
"#;
    let expected = r#"    // outside
    "perlin": Perlin(
      // inside
      size: 4,
    ),
    "r": "= perlin + 2",
"#;
    assert_eq!(nodes(text, "\"o\": \"r\", \"p\": \"r\""), expected);
}

#[test]
fn outputs_of_parameters_are_formulas() {
    let text = "    \"r\": Constant(value: \"$wide\"),\n";
    assert_eq!(lines(text, "\"o\": \"r\"").1, "\"o\": \"= $wide\"");
}

#[test]
fn comments_keep_nodes() {
    let text = r#"    // Twice the noise.
    "above": Math(operation: Multiply, a: "n", b: 2),

    "behind": Math(operation: Multiply, a: "k", b: 3), // three times
    "inside": Math(
      // four times
      operation: Multiply,
      a: "k",
      b: 4,
    ),
    "noted": Math(operation: Multiply, a: "k", b: 5, note: "five times"),

    "r": Expression(a: "above", b: "behind", c: "inside", d: "noted", formula: "max(a, b, c, d)"),
    "e": Emboss(input: "r"),
"#;
    let expected = r#"    // Twice the noise.
    "above": "= 2 * n",

    "behind": "= 3 * k", // three times
    // four times
    "inside": "= 4 * k",
    // five times
    "noted": "= 5 * k",

    "e": Emboss(input: "= max(above, behind, inside, noted)"),
"#;
    assert_eq!(nodes(text, "\"o\": \"e\""), expected);
}

#[test]
fn comment_stays_above_what_it_describes() {
    let text = r#"    // Dye gathers in grooves.
    "in_folds": Math(operation: Multiply, a: "n", b: 0.8),
    "both": Math(operation: Max, a: "k", b: "in_folds"),
    "dyed": Math(operation: Max, a: "both", b: "p.mask"),
    // Another run.
    "more": Math(operation: Multiply, a: "dyed", b: "dyed"),
    "e": Emboss(input: "more"),
    "f": Blur(input: "e"),
"#;
    let expected = r#"    // Dye gathers in grooves.
    "dyed": "= max(k, 0.8 * n, p.mask)",
    // Another run.
    "e": Emboss(input: "= dyed * dyed"),
    "f": Blur(input: "e"),
"#;
    assert_eq!(nodes(text, "\"o\": \"f\""), expected);
}

#[test]
fn formula_below_a_comment_is_not_moved_into_another_node() {
    let text = r#"    // Short cells.
    "short": Fractal(size: 2),
    "mixed": Expression(a: "short", b: "n", formula: "mix(a, b, 0.5)"),
    // Pores.
    "pores": Blur(input: "mixed"),

    "loose": Math(operation: Multiply, a: "n", b: 2),
    // Edges.
    "edges": Emboss(input: "loose"),
"#;
    let expected = r#"    // Short cells.
    "short": Fractal(size: 2),
    "mixed": "= mix(short, n, 0.5)",
    // Pores.
    "pores": Blur(input: "mixed"),

    // Edges.
    "edges": Emboss(input: "= 2 * n"),
"#;
    assert_eq!(nodes(text, "\"o\": \"pores\", \"p\": \"edges\""), expected);
}

#[test]
fn outputs_hold_formulas_without_comments() {
    let text = r#"    // The same as solids.
    "first": Math(operation: Multiply, a: "n", b: 2),
    "second": Math(operation: Multiply, a: "n", b: 3),

    "third": Math(operation: Multiply, a: "n", b: 4),
"#;
    let (nodes, outputs) = lines(text, "\"a\": \"first\", \"b\": \"second\", \"c\": \"third\"");
    assert_eq!(nodes.matches("= ").count(), 2, "{nodes}");
    assert_eq!(outputs, "\"a\": \"first\", \"b\": \"second\", \"c\": \"= 4 * n\"");
}

#[test]
fn several_values_of_a_node_get_names() {
    let text = r#"    "h": HeightToNormal(input: "n"),
    "parts": SplitChannels(input: "h"),
    "q": Expression(a: "parts.x", b: "parts.y", formula: "a * a + b * b"),
"#;
    let (nodes, outputs) = lines(text, "\"o\": \"q\"");
    let expected = "    \"h\": HeightToNormal(input: \"n\"),\n    \"parts\": \"= 2 * h.x - 1\",\n    \"parts_y\": \"= 2 * h.y - 1\",\n";
    assert_eq!(nodes, expected);
    assert_eq!(outputs, "\"o\": \"= parts * parts + parts_y * parts_y\"");
}

#[test]
fn nodes_that_nothing_reads_stay() {
    let text = "    \"h\": Math(operation: Multiply, a: \"n\", b: 2),\n    \"q\": MaterialChannel(material: \"m\"),\n";
    assert_eq!(nodes(text, "\"o\": \"n\""), "    \"h\": \"= 2 * n\",\n    \"q\": \"= m.height\",\n");
}

#[test]
fn formulas_of_the_new_language_take_part() {
    let text = r#"    "h": Math(operation: Multiply, a: "n", b: 2),
    "path": MaterialChannel(material: "m"),
    "mine": "= h + path * c.r",
    "local": "= let h = 3; h + n",
    "e": Emboss(input: "mine"),
"#;
    let expected = r#"    "mine": "= 2 * n + m.height * c.r",
    "local": "= let h = 3; h + n",
    "e": Emboss(input: "mine"),
"#;
    assert_eq!(nodes(text, "\"o\": \"e\""), expected);
}

#[test]
fn local_graphs_are_rewritten() {
    let text = graph("    \"h\": Math(a: \"n\", b: 2),\n", "\"o\": \"h\"").replace(
        "  nodes: {",
        "  graphs: {\n    \"inner\": (\n      nodes: {\n        \"h\": Perlin(),\n        \"q\": Math(operation: Multiply, a: \"h\", b: 3),\n      },\n      outputs: { \"o\": \"q\" },\n    ),\n  },\n  nodes: {",
    );
    let found = migrated(&text).text;
    assert!(
        found.contains("outputs: { \"o\": \"= 3 * h\" }") && found.contains("outputs: { \"o\": \"= n + 2\" }"),
        "{found}"
    );
}
