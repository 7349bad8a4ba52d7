//! Bad input: any bytes, deep nesting, many nodes, and cycles.
use super::{graph, kinds, migrated};
use crate::migrate::{migrate, rewrite_of};
use shibo_graph::syntax::Tree;
use std::time::Instant;

/// A small generator of pseudo-random numbers.
pub(super) struct Random(u64);

impl Random {
    /// A generator with a seed.
    pub(super) fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// A number below `most`.
    pub(super) fn below(&mut self, most: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        usize::try_from(self.0 >> 33).unwrap_or(0) % most
    }
}

const PIECES: [&str; 44] = [
    "(",
    ")",
    "{",
    "}",
    "[",
    "]",
    ",",
    ":",
    "\"",
    "nodes",
    "outputs",
    "inputs",
    "Math",
    "Expression",
    "SolidMath",
    "MixSolids",
    "MaterialChannel",
    "SetChannels",
    "SplitChannels",
    "MakeVector",
    "Constant",
    "ColorSolid",
    "Perlin",
    "a",
    "b",
    "formula",
    "operation",
    "Multiply",
    "\"a\"",
    "\"= a + \"",
    "\"= let a = 1; b\"",
    "\"$p\"",
    "\"a.r\"",
    "0.5",
    "-1",
    "material",
    "\n",
    "// x\n",
    "/* y */",
    "note",
    "seed",
    "r#\"= a\"#",
    "é",
    "#",
];

#[test]
fn any_text_is_survived() {
    let mut random = Random::new(7);
    for _ in 0..3000 {
        let mut text = String::new();
        for _ in 0..random.below(60) {
            text += PIECES[random.below(PIECES.len())];
            text.push_str(if random.below(3) == 0 { " " } else { "" });
        }
        drop(migrate(&text, kinds()));
    }
    for _ in 0..1000 {
        let bytes: Vec<u8> = (0..random.below(200)).map(|_| u8::try_from(random.below(256)).unwrap_or(0)).collect();
        drop(migrate(&String::from_utf8_lossy(&bytes), kinds()));
    }
    // Valid graphs with random values.
    let values = [
        "\"a\"",
        "\"b.value\"",
        "2",
        "-0.5",
        "\"= a * b\"",
        "\"$p\"",
        "\"#fff\"",
        "(1, 2, 3)",
        "Perlin()",
        "x",
        "\"c\"",
    ];
    let kinds_of =
        ["Math", "Expression", "SolidMath", "MixSolids", "MaterialChannel", "SplitChannels", "MakeVector", "Constant"];
    let fields = ["a", "b", "c", "mask", "material", "input", "x", "angle", "value", "color", "b_value", "seed"];
    let formulas =
        ["a + b", "a.r * x", "random(a)", "let", "(a", "hash(a + 1, b)", "pi", "a ^ -b", "max(a, max(b, c))"];
    for _ in 0..2000 {
        let mut nodes = String::new();
        for name in ["a", "b", "c", "d", "e"] {
            let kind = kinds_of[random.below(kinds_of.len())];
            let mut call = format!("{kind}(");
            for field in fields {
                if random.below(3) == 0 {
                    call += &format!("{field}: {}, ", values[random.below(values.len())]);
                }
            }
            if kind == "Expression" {
                call += &format!("formula: \"{}\", ", formulas[random.below(formulas.len())]);
            }
            nodes += &format!("\"{name}\": {call}),\n");
        }
        let text = format!("(nodes: {{ {nodes} }}, outputs: {{ \"o\": \"e\" }})");
        let migration = migrate(&text, kinds()).expect("valid RON");
        let tree = Tree::parse(migration.text.as_str());
        assert!(tree.errors().is_empty(), "{text}\n{}", migration.text);
        let again = migrate(&migration.text, kinds()).expect("valid RON");
        assert_eq!(again.text, migration.text, "{text}");
        for node in Tree::parse(text.as_str()).nodes() {
            drop(rewrite_of(node, kinds()));
        }
    }
}

fn quick(text: &str) -> String {
    let start = Instant::now();
    let text = migrate(text, kinds()).map(|migration| migration.text).unwrap_or_default();
    // Far more than it takes, but less than quadratic time would.
    assert!(start.elapsed().as_secs() < 20, "{:?}", start.elapsed());
    text
}

#[test]
fn many_nodes_are_quick() {
    let mut chain = "    \"h0\": Math(a: \"n\", b: 2),\n".to_owned();
    let mut fan = String::new();
    let mut commented = String::new();
    let mut paths = "    \"q0\": MaterialChannel(material: \"m\"),\n".to_owned();
    for i in 1..10_000 {
        chain += &format!("    \"h{i}\": Math(operation: MultiplyAdd, a: \"k\", b: 0.5, c: \"h{}\"),\n", i - 1);
        fan += &format!("    \"h{i}\": Math(a: \"n\", b: {i}),\n");
        commented += &format!("    // {i}\n    \"h{i}\": Math(a: \"n\", b: {i}),\n");
        paths += &format!("    \"e{i}\": Expression(a: \"q{}\", formula: \"a\"),\n", i - 1);
        paths += &format!("    \"q{i}\": SplitChannels(input: \"e{i}\"),\n");
    }
    let sum = (1..10_000).map(|i| format!("h{i}")).collect::<Vec<_>>().join(" + ");
    for nodes in [
        chain.clone(),
        format!("{fan}    \"sum\": \"= {sum}\",\n"),
        format!("{commented}    \"sum\": \"= max({})\",\n", sum.replace(" + ", ", ")),
        paths,
    ] {
        let text = quick(&graph(&nodes, "\"o\": \"n\""));
        assert!(!text.contains("Math(") && !text.contains("Channel(") && !text.contains("Split"));
    }
    let text = quick(&graph(&chain, "\"o\": \"h9999\""));
    assert!(text.lines().count() < 2500, "{}", text.lines().count());
}

#[test]
fn long_formulas_are_quick() {
    for formula in [
        "(".repeat(100_000),
        format!("{}a{}", "(".repeat(250), ")".repeat(250)),
        format!("{}a", "-".repeat(100_000)),
        vec!["a"; 30_000].join(" + "),
        format!("max({})", vec!["a"; 30_000].join(", ")),
        format!("{}a", "a ^ ".repeat(30_000)),
        format!("{}a{}", "max(a, ".repeat(200), ")".repeat(200)),
    ] {
        let inner = "    \"q\": Math(operation: Max, a: \"n\", b: \"k\"),\n";
        let node = format!("{inner}    \"r\": Expression(a: \"q\", formula: \"{formula}\"),\n");
        quick(&graph(&node, "\"o\": \"r\""));
    }
}

#[test]
fn deep_nesting_is_survived() {
    for depth in [50, 120, 5000] {
        let node = format!("{}\"n\"{}", "Math(operation: Power, b: 2, a: ".repeat(depth), ")".repeat(depth));
        quick(&graph(&format!("    \"r\": {node},\n"), "\"o\": \"r\""));
        let node = format!("{}\"n\"{}", "Blur(input: Math(a: ".repeat(depth / 2), "))".repeat(depth / 2));
        quick(&graph(&format!("    \"r\": {node},\n"), "\"o\": \"r\""));
    }
}

#[test]
fn cycles_end() {
    for nodes in [
        "    \"h\": Math(a: \"h\", b: 2),\n",
        "    \"h\": Math(a: \"q\", b: 2),\n    \"q\": Math(a: \"h\", b: 2),\n",
        "    \"h\": SplitChannels(input: \"q\"),\n    \"q\": Expression(a: \"h\", formula: \"a\"),\n",
        "    \"h\": MaterialChannel(material: \"h\"),\n",
        "    \"h\": Constant(value: \"q\"),\n    \"q\": Constant(value: \"h\"),\n",
    ] {
        let text = graph(nodes, "\"o\": \"h\"");
        let migration = migrated(&text);
        assert_eq!(migrated(&migration.text).text, migration.text);
        assert!(migration.text.contains("\"h\": \"= "), "{}", migration.text);
    }
}
