//! The meanings of names and of their components.
use super::{Meaning, Names, Value, shorten};
use crate::diagnostics::{Code, suggest};

/// The meaning of a parameter or of a component of one.
pub(super) fn param(name: &str, names: &mut dyn Names) -> Option<Meaning> {
    Some(match name.rsplit_once('.') {
        Some((whole, component)) => part_of(names.param(whole), &format!("${whole}"), component),
        None => names.param(name),
    })
}

/// The meaning of a name or of a component of one; `None` if the name could be a word.
pub(super) fn name(name: &str, names: &mut dyn Names) -> Option<Meaning> {
    if let Some(meaning) = names.name(name) {
        return Some(meaning);
    }
    if let Some((whole, component)) = name.rsplit_once('.')
        && let Some(meaning) = names.name(whole)
    {
        return Some(part_of(meaning, whole, component));
    }
    if names.has_words() && !name.contains('.') {
        return None;
    }
    if let Some((message, help)) = names.instead(name) {
        return Some(Meaning::Wrong(Code::BadExpression, message, Some(help)));
    }
    let all = names.all();
    let known: Vec<&str> = all.iter().map(String::as_str).collect();
    let message = format!("there is no name `{}`", shorten(name));
    Some(Meaning::Wrong(Code::BadExpression, message, Some(suggest(name, "name", &known))))
}

/// A component of a vector.
fn part_of(whole: Meaning, name: &str, component: &str) -> Meaning {
    let count = match &whole {
        Meaning::Planes { count, .. } => *count,
        Meaning::Known(Value::Vector(values)) => values.len(),
        Meaning::Wrong(..) | Meaning::Broken => return whole,
        Meaning::Known(_) | Meaning::Choice(..) => 1,
    };
    let letters: &[&[&str]] = match count {
        1 => &[],
        2 => &[&["x", "y"]],
        3 => &[&["r", "g", "b"], &["x", "y", "z"]],
        _ => &[&["xx", "xy", "yx", "yy"]],
    };
    let index = letters.iter().find_map(|letters| letters.iter().position(|letter| *letter == component));
    match (index, whole) {
        (Some(index), Meaning::Planes { first, .. }) => Meaning::Planes { first: first + index, count: 1 },
        (Some(index), Meaning::Known(Value::Vector(values))) => Meaning::Known(Value::Number(values[index])),
        _ => {
            let message = format!("`{}` has no component `{}`", shorten(name), shorten(component));
            let help = match letters {
                [] => format!("it is a single number; write `{}`", shorten(name)),
                _ => format!("components: `{}`", letters.concat().join("`, `")),
            };
            Meaning::Wrong(Code::BadExpression, message, Some(help))
        }
    }
}
