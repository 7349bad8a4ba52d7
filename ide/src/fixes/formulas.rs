//! Fixes of lost or extra brackets in formulas: each place where one may stand is tried.
use super::super::diagnose::Finding;
use super::super::rename::Edit;
use super::super::world::Cx;
use super::budget::Budget;
use super::{Applies, Fix};
use shibo_graph::syntax::TokenKind;
use shibo_graph::syntax::formula::{Formula, PartKind, WordKind, begins, content};
use shibo_value::expression::described;
use std::ops::Range;

/// Longest formula in bytes whose places are tried; each is read as a whole.
const LONGEST: usize = 2000;
/// Most fixes for one finding.
const TRIED: usize = 12;

/// Inserts or removes a bracket in the formula of a finding.
pub(super) fn fixes(cx: Cx<'_>, finding: &Finding, budget: &mut Budget) -> Vec<Fix> {
    let Some(place) = formula_at(cx, finding.range.start) else { return Vec::new() };
    let text = cx.file.at(&place);
    let formula = Formula::parse(text);
    let count = |kind: WordKind| formula.words().iter().filter(|word| word.kind == kind).count();
    let (open, close) = (count(WordKind::Open), count(WordKind::Close));
    if text.len() > LONGEST || open == close {
        return Vec::new();
    }
    let (sign, good) = places(text, open > close, budget);
    let mut found: Vec<Edit> =
        good.into_iter().map(|at| Edit { range: place.start + at..place.start + at, text: sign.to_owned() }).collect();
    let extra = if open > close { WordKind::Open } else { WordKind::Close };
    let without = |range: &Range<usize>| format!("{}{}", &text[..range.start], &text[range.end..]);
    let removed = formula.words().iter().filter(|word| word.kind == extra).map(|word| word.range.clone());
    let helps = |range: &Range<usize>| budget.parse(text.len()) && !Formula::parse(&without(range)).is_faulty();
    let removed: Vec<Range<usize>> = removed.filter(helps).collect();
    let is_sole = found.len() == 1;
    // Without a place for the lost one, the other one is too much.
    let edits =
        removed.into_iter().map(|r| Edit { range: place.start + r.start..place.start + r.end, text: String::new() });
    found.extend(edits);
    let level = |index: usize| if index == 0 && is_sole { Applies::Sure } else { Applies::Likely };
    let fix = |(index, edit): (usize, Edit)| {
        let title = if edit.text.is_empty() {
            format!("Remove `{}`", cx.file.at(&edit.range))
        } else {
            format!("Insert `{sign}`")
        };
        Fix::new(title, level(index), vec![edit])
    };
    found.into_iter().take(TRIED).enumerate().map(fix).collect()
}

/// The bytes of the formula that contains a position, without its equals sign.
fn formula_at(cx: Cx<'_>, at: usize) -> Option<Range<usize>> {
    let tokens = cx.file.tree.tokens();
    let token = tokens.get(tokens.partition_point(|token| token.end() <= at)).filter(|token| token.start() <= at)?;
    let literal = Some(token.range()).filter(|_| token.kind() == TokenKind::Str)?;
    let inside = content(cx.file.at(&literal))?;
    let inside = literal.start + inside.start..literal.start + inside.end;
    // The body of a function has no equals sign.
    let begin = begins(cx.file.at(&inside)).unwrap_or(0);
    Some(inside.start + begin..inside.end)
}

/// The places for a closing bracket, the last one first.
fn ends(formula: &Formula) -> Vec<usize> {
    let is_value = |kind: WordKind| {
        use WordKind as W;
        matches!(kind, W::Number | W::Color | W::Param | W::Name | W::Letters | W::Close)
    };
    let first = formula.words().iter().position(|word| word.kind == WordKind::Open).unwrap_or(0);
    let values = formula.words()[first..].iter().filter(|word| is_value(word.kind));
    let mut places: Vec<usize> = values.map(|word| word.range.end).collect();
    places.reverse();
    places
}

/// The places for an opening bracket: behind the names of functions, and before values.
fn starts(formula: &Formula) -> Vec<usize> {
    let is_function = |name: &str| described().iter().any(|function| function.name == name);
    let (mut calls, mut values) = (Vec::new(), Vec::new());
    for (index, word) in formula.words().iter().enumerate() {
        let says = formula.word(index);
        let begins_value = match word.kind {
            WordKind::Name => {
                // `clamp a, 0, 1)`, `clampa, 0, 1)` and `clampmix(a, b, c), 0, 1)`; `clamp(` has its bracket.
                let has_own = formula.words().get(index + 1).is_some_and(|next| next.kind == WordKind::Open);
                let parts = (1..says.len() + usize::from(!has_own))
                    .filter(|end| says.is_char_boundary(*end) && is_function(&says[..*end]));
                let longest_first: Vec<usize> = parts.map(|end| word.range.start + end).collect();
                calls.extend(longest_first.into_iter().rev());
                true
            }
            // Brackets that begin a value, not those of a call.
            WordKind::Open => index == 0 || formula.words()[index - 1].kind != WordKind::Name,
            WordKind::Number | WordKind::Color | WordKind::Param | WordKind::Not => true,
            WordKind::Operator => says == "-",
            _ => false,
        };
        if begins_value {
            values.push(word.range.start);
        }
    }
    calls.extend(values);
    calls
}

/// Returns true if a formula can be read and the bracket at a byte changes its meaning.
fn is_needed(text: &str, at: usize) -> bool {
    let formula = Formula::parse(text);
    if formula.is_faulty() {
        return false;
    }
    let is_it = |range: &Range<usize>| range.start == at || range.end == at + 1;
    let bracket = formula.parts().iter().find(|part| part.kind == PartKind::Bracket && is_it(&part.range));
    let Some(Range { start, end }) = bracket.map(|part| part.range.clone()) else { return true };
    let without = format!("{} {} {}", &text[..start], &text[start + 1..end - 1], &text[end..]);
    steps(&formula) != steps(&Formula::parse(&without))
}

/// The sign that a formula lacks, and the places where it may stand, the most likely ones first.
fn places(text: &str, closing: bool, budget: &mut Budget) -> (&'static str, Vec<usize>) {
    let formula = Formula::parse(text);
    let (sign, places) = if closing { (")", ends(&formula)) } else { ("(", starts(&formula)) };
    let inserted = |at: usize| format!("{}{sign}{}", &text[..at], &text[at..]);
    // A place takes three readings.
    let is_good = |at: &usize| budget.parse(3 * text.len()) && is_needed(&inserted(*at), *at);
    let mut places: Vec<usize> = places.into_iter().filter(is_good).collect();
    // Of brackets around a sum, the shortest are the most likely: `2 * (a + b) + c`. A lost `(` more likely belongs to a
    // call, and least likely to a tuple.
    let is_call = |at: usize| !closing && text[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_');
    let of_others = |at: usize| if is_call(at) { 0 } else { usize::MAX };
    places.sort_by_cached_key(|at| length(&inserted(*at), *at).unwrap_or(of_others(*at)));
    (sign, places)
}

/// The length of the pair of brackets of which one is at a byte; `None` if they are those of a call or a tuple.
fn length(text: &str, at: usize) -> Option<usize> {
    let formula = Formula::parse(text);
    let is_it = |range: &Range<usize>| range.start == at || range.end == at + 1;
    let bracket = formula.parts().iter().find(|part| part.kind == PartKind::Bracket && is_it(&part.range))?;
    Some(bracket.range.len())
}

/// The steps of a formula, each after those that it needs. Brackets are no steps.
fn steps(formula: &Formula) -> Vec<(PartKind, String, usize)> {
    let parts = formula.parts().iter().filter(|part| part.kind != PartKind::Bracket);
    parts.map(|part| (part.kind, part.word.map_or("", |word| formula.word(word)).to_owned(), part.operands)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn repaired(text: &str) -> Vec<String> {
        let closing = text.matches('(').count() > text.matches(')').count();
        let (sign, places) = places(text, closing, &mut Budget::default());
        places.into_iter().map(|at| format!("{}{sign}{}", &text[..at], &text[at..])).collect()
    }

    #[test]
    fn finds_the_places_of_a_lost_bracket() {
        assert_eq!(repaired("0.1 * (a + b"), ["0.1 * (a + b)"]);
        assert_eq!(repaired("0.1 * a + b)"), ["0.1 * (a + b)"]);
        assert_eq!(repaired("clampa, 0, 1)"), ["clamp(a, 0, 1)", "(clampa, 0, 1)"]);
        assert_eq!(repaired("(a + b * c"), ["(a + b) * c"]);
        assert_eq!(repaired("c * (a - 1 + d")[0], "c * (a - 1) + d");
        assert_eq!(repaired("2 + c * 1 - a) + d")[0], "2 + c * (1 - a) + d");
        assert_eq!(repaired("sqrt(a + b"), ["sqrt(a + b)", "sqrt(a) + b"]);
        let of_sum = repaired("clamp(0.7 * s + 0.9 * t - 0.5) + 0.1, 0, 1)");
        assert_eq!(of_sum[0], "clamp(0.7 * s + 0.9 * (t - 0.5) + 0.1, 0, 1)");
        assert_eq!(repaired("clampmix(a, b, c), 0, 1)")[0], "clamp(mix(a, b, c), 0, 1)");
    }
}
