//! Puts one formula into another, with brackets where the order of operations needs them.
use super::super::paths::are_components;
use super::{free_names, local_names};
use shibo_graph::syntax::formula::{Formula, PartKind, binding};

/// Binding of a value that is no operation.
const ATOM: u8 = 8;
/// Binding of a sign.
const SIGN: u8 = 6;

/// A formula that is put into another one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Put {
    /// Definitions for the beginning of the outer formula.
    pub definitions: String,
    /// Text for the place of the name.
    pub text: String,
}

/// Puts `inner` in the place of a name of `outer`, whose first `base` bytes mean the value of `inner`. `None` if a name in
/// one formula hides a name of the other, or if a formula has mistakes.
pub(crate) fn put(outer: &Formula, word: usize, base: usize, inner: &str) -> Option<Put> {
    let inner = Formula::parse(inner);
    let (root, place) = (inner.root()?, outer.part_of(word)?);
    let rest = outer.word(word).get(base..)?;
    let letters = rest.strip_prefix('.').unwrap_or_default();
    let good = rest.is_empty() || letters.split('.').all(are_components);
    let (inner_free, outer_free) = (free_names(&inner, &[]), free_names(outer, &[]));
    let hides = local_names(outer).any(|local| inner_free.contains(&local) || local_names(&inner).any(|l| l == local))
        || local_names(&inner).any(|local| outer_free.contains(&local));
    if inner.is_faulty() || outer.is_faulty() || !good || hides {
        return None;
    }
    let range = inner.parts()[root].range.clone();
    let one_line = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let value = one_line(inner.at(&range));
    let in_brackets = matches!(inner.parts()[root].kind, PartKind::Call | PartKind::Bracket | PartKind::Vector);
    let brackets = if rest.is_empty() { needs_brackets(outer, place, &inner) } else { !in_brackets };
    let mut definitions = one_line(inner.at(&(0..range.start)));
    if !definitions.is_empty() {
        definitions.push(' ');
    }
    Some(Put { definitions, text: if brackets { format!("({value}){rest}") } else { format!("{value}{rest}") } })
}

/// Returns whether a formula needs brackets in the place of a part of another one.
fn needs_brackets(outer: &Formula, place: usize, inner: &Formula) -> bool {
    let Some(parent) = outer.parts()[place].parent else { return false };
    let binds = inner.root().map_or(ATOM, |root| binds(inner, root));
    let operator = outer.parts()[parent].word.map_or("", |word| outer.word(word));
    match outer.parts()[parent].kind {
        PartKind::Sign => binds <= SIGN,
        PartKind::Letters => true,
        PartKind::Binary => {
            let own = binding(operator);
            let is_left = outer.operands(parent).first() == Some(&place);
            // Powers group from the right, and comparisons do not chain.
            let same = match operator {
                "^" => !is_left,
                "<" | "<=" | ">" | ">=" | "==" | "!=" => false,
                _ => is_left,
            };
            binds < own || (binds == own && !same)
        }
        _ => false,
    }
}

/// How tightly a part binds.
fn binds(formula: &Formula, part: usize) -> u8 {
    let part = &formula.parts()[part];
    match (part.kind, part.word) {
        (PartKind::Sign, _) => SIGN,
        (PartKind::Binary, Some(word)) => binding(formula.word(word)),
        (PartKind::Binary, None) => 0,
        _ => ATOM,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(outer: &str, inner: &str) -> Option<String> {
        let formula = Formula::parse(outer);
        let word = formula.words().iter().position(|word| formula.at(&word.range).starts_with("hole"))?;
        let put = put(&formula, word, "hole".len(), inner)?;
        let mut text = outer.to_owned();
        text.replace_range(formula.words()[word].range.clone(), &put.text);
        Some(put.definitions + &text)
    }

    #[test]
    fn puts_brackets_only_where_needed() {
        for (outer, inner, expected) in [
            ("hole", "a + b", "a + b"),
            ("hole + 1", "a + b", "a + b + 1"),
            ("1 + hole", "a + b", "1 + (a + b)"),
            ("1 - hole", "a * b", "1 - a * b"),
            ("2 * hole", "a + b", "2 * (a + b)"),
            ("hole ^ 2", "a ^ b", "(a ^ b) ^ 2"),
            ("2 ^ hole", "a ^ b", "2 ^ a ^ b"),
            ("hole ^ 2", "-a", "(-a) ^ 2"),
            ("2 * hole", "-a", "2 * -a"),
            ("-hole", "a * b", "-(a * b)"),
            ("-hole", "a ^ b", "-a ^ b"),
            ("hole < 1", "a < b", "(a < b) < 1"),
            ("max(hole, 1)", "a + b", "max(a + b, 1)"),
            ("(hole) * 2", "a + b", "(a + b) * 2"),
            ("hole.x", "flow", "(flow).x"),
            ("hole.x", "rotate(v, 30)", "rotate(v, 30).x"),
            ("hole.yx + 1", "(a, b)", "(a, b).yx + 1"),
            ("2 * hole", "let r = x; r + 1", "let r = x; 2 * (r + 1)"),
            ("let q = hole; q", "let r = x; r", "let r = x; let q = r; q"),
        ] {
            assert_eq!(of(outer, inner).as_deref(), Some(expected), "{outer} with {inner}");
        }
    }

    #[test]
    fn refuses_names_that_hide_others() {
        for (outer, inner) in [
            ("let a = 1; hole * a", "a + 1"),
            ("hole * r", "let r = x; r"),
            ("let r = 1; hole * r", "let r = x; r"),
            ("hole.height", "a"),
            ("hole *", "a"),
            ("hole", "a +"),
        ] {
            assert_eq!(of(outer, inner), None, "{outer} with {inner}");
        }
    }
}
