//! The numbers of formulas, which the page can drag.
use shibo_graph::syntax::formula::{Formula, WordKind, begins, content};
use std::ops::Range;

/// The most numbers of a formula that can be dragged.
const MOST: usize = 64;

/// The numbers in a literal of a graph file that is a formula, by their bytes in the literal. A text that is no formula,
/// or that has mistakes, has none.
pub fn places(literal: &str) -> Vec<Range<usize>> {
    let inside = content(literal).unwrap_or(0..0);
    let text = literal.get(inside.clone()).unwrap_or_default();
    let Some(begin) = begins(text) else { return Vec::new() };
    let formula = Formula::parse(&text[begin..]);
    if formula.is_faulty() {
        return Vec::new();
    }
    let start = inside.start + begin;
    let numbers = formula.words().iter().filter(|word| word.kind == WordKind::Number).take(MOST);
    numbers.map(|word| start + word.range.start..start + word.range.end).collect()
}

/// The formula in a literal, cut at its numbers: every second piece is one. `None` if it has none.
pub fn pieces(literal: &str) -> Option<Vec<&str>> {
    let places = places(literal);
    let inside = content(literal)?;
    if places.is_empty() {
        return None;
    }
    let mut at = inside.start;
    let mut pieces = Vec::with_capacity(2 * places.len() + 1);
    for place in places {
        pieces.extend([&literal[at..place.start], &literal[place.clone()]]);
        at = place.end;
    }
    pieces.push(&literal[at..inside.end]);
    Some(pieces)
}

/// Returns true for the text of a number that can replace another one in a formula: it has no sign, because a sign may
/// bind in another way than the number does.
pub fn is_plain(value: &str) -> bool {
    let digits = value.starts_with(|c: char| c.is_ascii_digit());
    let whole = pieces(&format!("\"={value}\"")).is_some_and(|pieces| pieces == ["=", value, ""]);
    digits && whole && value.parse::<f64>().is_ok_and(f64::is_finite)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_numbers_of_formulas() {
        assert_eq!(pieces("\"= 0.5 * a - 2\"").unwrap(), ["= ", "0.5", " * a - ", "2", ""]);
        assert_eq!(pieces("r#\"= a2 +\n  1e-3\"#").unwrap(), ["= a2 +\n  ", "1e-3", ""]);
        assert_eq!(pieces("\"= #7a4526 * 3\"").unwrap(), ["= #7a4526 * ", "3", ""]);
        for none in ["\"= a\"", "\"0.5\"", "0.5", "\"= 0.5 *\"", "\"== 1\"", "\"= \\u{31}\"", "", "\""] {
            assert_eq!(pieces(none), None, "{none}");
        }
        let many = format!("\"= 1{}\"", " + 1".repeat(MOST + 9));
        assert_eq!(places(&many).len(), MOST);
    }

    #[test]
    fn accepts_plain_numbers() {
        assert!(["0", "2", "0.25", "1e-3"].into_iter().all(is_plain));
        let others = ["", "-1", "+1", "1 + 1", "a", "inf", "1)", "1e999", "\"", ".", "0x1"];
        assert!(others.into_iter().all(|other| !is_plain(other)));
    }
}
