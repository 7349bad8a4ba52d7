//! Formulas have the values of the nodes that they replace, bit for bit.
use super::hostile::Random;
use super::{graph, migrated};
use crate::migrate::fold::{Fold, fold};
use crate::migrate::formula::Formula;
use crate::migrate::words::{Base, Word};
use shibo_graph::syntax::{Node, Tree};
use std::collections::HashMap;

/// Values of the nodes that all graphs read.
const LEAVES: [(&str, f64); 4] = [("n", 0.37), ("k", -1.25), ("s", 2.5), ("t", 0.061)];

/// An operation on three operands.
type Operation = fn(f64, f64, f64) -> f64;

/// The old operations, with their names in `Math`.
const OPERATIONS: [(&str, Operation); 17] = [
    ("Add", |a, b, _| a + b),
    ("Subtract", |a, b, _| a - b),
    ("Multiply", |a, b, _| a * b),
    ("Divide", |a, b, _| a / b),
    ("MultiplyAdd", |a, b, c| a * b + c),
    ("Min", |a, b, _| a.min(b)),
    ("Max", |a, b, _| a.max(b)),
    ("Abs", |a, _, _| a.abs()),
    ("Modulo", |a, b, _| a - b * (a / b).floor()),
    ("PingPong", |a, b, _| {
        let t = a / (2.0 * b);
        b * (1.0 - (2.0 * (t - t.floor()) - 1.0).abs())
    }),
    ("Floor", |a, _, _| a.floor()),
    ("Round", |a, _, _| (a + 0.5).floor()),
    ("Snap", |a, b, _| if b == 0.0 { a } else { b * (a / b).floor() }),
    ("Smoothstep", |a, b, c| smoothstep(b, c, a)),
    ("Step", |a, b, _| f64::from(u8::from(a >= b))),
    ("Mix", |a, b, c| a + (b - a) * c),
    ("Less", |a, b, _| f64::from(u8::from(a < b))),
];

fn smoothstep(e0: f64, e1: f64, x: f64) -> f64 {
    let t = ((x - e0) / (e1 - e0)).clamp(0.0, 1.0);
    if e0 == e1 { f64::from(u8::from(x >= e0)) } else { t * t * (3.0 - 2.0 * t) }
}

/// A result at the end of a node.
fn at_node(value: f64) -> f64 {
    if value.is_finite() { value } else { 0.0 }
}

/// Computes a formula with the values of names.
struct Compute<'v>(&'v HashMap<String, f64>);

impl Fold for Compute<'_> {
    type Value = f64;

    fn leaf(&mut self, word: &Word) -> f64 {
        match word {
            Word::Number(number) => number.parse().expect("a number"),
            Word::Name(name) => match &name.base {
                Base::Text(text) => *self.0.get(text).unwrap_or_else(|| panic!("`{text}` is known")),
                other => panic!("{other:?}"),
            },
            other => panic!("{other:?}"),
        }
    }

    fn sign(&mut self, sign: char, value: f64) -> f64 {
        if sign == '-' { -value } else { value }
    }

    fn operator(&mut self, operator: &'static str, a: f64, b: f64) -> f64 {
        match operator {
            "+" => a + b,
            "-" => a - b,
            "*" => a * b,
            "/" => a / b,
            "%" => a - b * (a / b).floor(),
            "==" => f64::from(u8::from(a == b)),
            "<" => f64::from(u8::from(a < b)),
            other => panic!("{other}"),
        }
    }

    fn call(&mut self, function: &str, values: Vec<f64>) -> f64 {
        match (function, &values[..]) {
            ("min", all) => all.iter().copied().reduce(f64::min).expect("a value"),
            ("max", all) => all.iter().copied().reduce(f64::max).expect("a value"),
            ("abs", [x]) => x.abs(),
            ("floor", [x]) => x.floor(),
            ("triangle", [x]) => 1.0 - (2.0 * (x - x.floor()) - 1.0).abs(),
            ("if", [condition, a, b]) => {
                if *condition == 0.0 {
                    *b
                } else {
                    *a
                }
            }
            ("smoothstep", [e0, e1, x]) => smoothstep(*e0, *e1, *x),
            ("step", [edge, x]) => f64::from(u8::from(x >= edge)),
            ("mix", [a, b, t]) => a + (b - a) * t,
            other => panic!("{other:?}"),
        }
    }

    fn vector(&mut self, parts: Vec<f64>) -> f64 {
        panic!("{parts:?}")
    }

    fn part(&mut self, _value: f64, path: &str) -> f64 {
        panic!("{path}")
    }
}

fn value(text: &str, known: &HashMap<String, f64>) -> f64 {
    match text.strip_prefix("= ") {
        Some(formula) => {
            let formula = Formula::read(formula).expect("a formula");
            at_node(fold(&formula.words, &mut Compute(known)).expect("no local names"))
        }
        None => *known.get(text).unwrap_or_else(|| panic!("`{text}` is known: {known:?}")),
    }
}

#[test]
fn formulas_keep_values() {
    let mut random = Random::new(11);
    let literals = ["0", "1", "-1", "0.5", "-0.16", "2", "0.3", "-3"];
    let mut joined = 0;
    for _ in 0..3000 {
        let mut old: HashMap<String, f64> = LEAVES.map(|(name, value)| (name.to_owned(), value)).into();
        let mut nodes = String::new();
        let count = 2 + random.below(7);
        for i in 0..count {
            let (operation, compute) = OPERATIONS[random.below(OPERATIONS.len())];
            let operands = [0, 1, 2].map(|at| match random.below(4) {
                0 if at > 0 => literals[random.below(literals.len())].to_owned(),
                1 => LEAVES[random.below(LEAVES.len())].0.to_owned(),
                _ if i > 0 => format!("v{}", i - 1 - random.below(i.min(3))),
                _ => "n".to_owned(),
            });
            let [a, b, c] = operands.clone().map(|operand| operand.parse().unwrap_or_else(|_| old[&operand]));
            let written = operands.map(|operand: String| match operand.parse::<f64>() {
                Ok(_) => operand,
                Err(_) => format!("\"{operand}\""),
            });
            let [x, y, z] = written;
            nodes += &format!("    \"v{i}\": Math(operation: {operation}, a: {x}, b: {y}, c: {z}),\n");
            old.insert(format!("v{i}"), at_node(compute(a, b, c)));
        }
        let last = format!("v{}", count - 1);
        let text = graph(&nodes, &format!("\"o\": \"{last}\""));
        let new = migrated(&text).text;
        let tree = Tree::parse(new.as_str());
        let top = tree.value().expect("a graph");
        let mut known: HashMap<String, f64> = LEAVES.map(|(name, value)| (name.to_owned(), value)).into();
        let entries = top.entry("nodes").and_then(Node::value).into_iter().flat_map(Node::entries);
        let formulas = entries.filter_map(|entry| Some((entry.key_text()?, entry.value()?.string()?)));
        // Nodes stand after those that they read.
        for (name, formula) in formulas.collect::<Vec<_>>() {
            joined += 1;
            known.insert(name, value(&formula, &known));
        }
        let output =
            top.entry("outputs").and_then(Node::value).and_then(|outputs| outputs.entry("o")?.value()?.string());
        let found = value(&output.expect("an output"), &known);
        assert_eq!(found, old[&last], "{nodes}\n{new}");
    }
    assert!(joined > 1000, "some nodes stay: {joined}");
}
