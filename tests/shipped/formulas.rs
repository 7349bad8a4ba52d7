//! The chapter *Formulas* of docs/graph-file.md matches the language: its list of functions, and the values of examples.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use shibo_value::expression::{Meaning, Names, Value, described, evaluate};

/// No names, and seeds.
struct Nothing;

impl Names for Nothing {
    fn param(&mut self, _name: &str) -> Meaning {
        Meaning::Broken
    }

    fn name(&mut self, _name: &str) -> Option<Meaning> {
        None
    }

    fn all(&self) -> Vec<String> {
        Vec::new()
    }

    fn has_words(&self) -> bool {
        false
    }

    fn seed(&mut self) -> Option<u64> {
        Some(0)
    }

    fn seed_of(&mut self, seed: u64) -> Option<u64> {
        Some(seed)
    }
}

/// The numbers of a constant formula.
fn numbers(formula: &str) -> Vec<f64> {
    match evaluate(formula, &mut Nothing).unwrap_or_else(|faults| panic!("{formula}: {faults:?}")) {
        Value::Number(number) => vec![number],
        Value::Bool(yes) => vec![f64::from(u8::from(yes))],
        Value::Vector(numbers) => numbers,
        Value::Word(word) => panic!("{formula} is {word}"),
    }
}

#[test]
fn lists_every_function_with_an_example() {
    let page = include_str!("../../docs/graph-file.md");
    let chapter = page.split("### Functions of the language").nth(1).unwrap().split("\n## ").next().unwrap();
    let mut calls = Vec::new();
    for row in chapter.lines().filter(|line| line.starts_with("| `")) {
        let cells: Vec<&str> = row.trim_matches('|').split(" | ").map(str::trim).collect();
        let [call, doc, example] = cells[..] else { panic!("{row}") };
        let call = call.trim_matches('`');
        let known = described().iter().find(|known| known.call == call).unwrap_or_else(|| panic!("{call} is unknown"));
        assert_eq!(doc, known.doc.trim_end_matches('.'), "{call}");
        let (formula, value) = example.rsplit_once(" is ").unwrap();
        let formula = formula.trim_matches('`');
        assert!(formula.contains(known.name), "{call}: {formula}");
        let (found, told) = (numbers(formula), numbers(value));
        let near = found.len() == told.len() && found.iter().zip(&told).all(|(a, b)| (a - b).abs() < 1e-3);
        assert!(near, "{formula} is {found:?}");
        calls.push(call.to_owned());
    }
    let mut all: Vec<String> = described().iter().map(|known| known.call.to_owned()).collect();
    all.sort();
    calls.sort();
    assert_eq!(calls, all);
}
