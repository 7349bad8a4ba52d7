//! New names that would change the meaning of a formula: they hide another name, or are hidden by one.
use super::file::{File, Section};
use super::formula::{HIDDEN, Role, formulas, free_names, local_names};
use super::names::{Symbol, occurrences};
use super::navigate::{Thing, readers};
use super::world::Cx;
use shibo_value::expression::described;
use std::collections::HashSet;
use std::ops::Range;

/// Words of the language that no name in a formula can be.
const RESERVED: [&str; 3] = ["let", "true", "false"];

/// Reason why the new name of a thing would change the meaning of a formula, if it would.
pub(crate) fn captured(cx: Cx<'_>, thing: &Thing, new: &str) -> Option<String> {
    let inner = cx.with(&thing.file);
    match &thing.symbol {
        Symbol::Node(old) => of_node(inner, old, new),
        Symbol::Local(literal, old) => of_local(inner, *literal, old, new),
        Symbol::Output(_) => of_output(cx, thing, new),
        _ => None,
    }
}

fn of_node(cx: Cx<'_>, old: &str, new: &str) -> Option<String> {
    for (text, formula) in formulas(cx).iter().filter(|(text, _)| text.role == Role::Point) {
        let (free, says) = (free_names(formula, &[]), text.says().trim());
        let read = free.contains(&old);
        if read && RESERVED.contains(&new) {
            return Some(format!("`{new}` is a word of formulas"));
        }
        if free.contains(&new) {
            let is_word = described().iter().any(|one| one.name == new) || RESERVED.contains(&new);
            let place = if is_word { "word" } else { "name" };
            return Some(format!("a node called `{new}` would hide the {place} `{new}` in the formula `{says}`"));
        }
        if read && local_names(formula).any(|local| local == new) {
            return Some(format!("the formula `{says}` has a local name `{new}`, which would hide the node"));
        }
    }
    None
}

fn of_local(cx: Cx<'_>, literal: usize, old: &str, new: &str) -> Option<String> {
    let all = formulas(cx);
    let (text, formula) = all.iter().find(|(text, _)| text.literal.start == literal)?;
    if RESERVED.contains(&new) {
        return Some(format!("`{new}` is a word of formulas"));
    }
    let values = text.values(cx);
    if values.contains(&new) || local_names(formula).any(|local| local == new) {
        return Some(format!("there is a local name `{new}` already in the formula `{}`", text.says().trim()));
    }
    let known: Vec<&str> = values.into_iter().filter(|value| *value == old).collect();
    if free_names(formula, &known).contains(&new) {
        return Some(format!("a local name `{new}` would hide `{new}` in the formula `{}`", text.says().trim()));
    }
    None
}

/// A path after a `Use` may name a channel that the output would hide.
fn of_output(cx: Cx<'_>, thing: &Thing, new: &str) -> Option<String> {
    for file in readers(cx, thing) {
        let inner = cx.with(&file);
        for one in occurrences(inner) {
            let Symbol::Part(path) = &one.symbol else { continue };
            let Some((node, first)) = path.split_once('.') else { continue };
            if first == new && inner.used(node).is_some_and(|used| used.is_same(&thing.file)) {
                let place = file.path.display();
                return Some(format!("an output called `{new}` would hide the channel in `{path}` of `{place}`"));
            }
        }
    }
    None
}

/// Nodes and inputs whose name hides a position, the canvas or a constant, and whose name a formula uses: the bytes of the
/// key, and the message.
pub(crate) fn hiding(cx: Cx<'_>) -> Vec<(Range<usize>, String)> {
    let sections = [(Section::Inputs, "an input"), (Section::Nodes, "a node")];
    let of = |(section, kind)| {
        HIDDEN.into_iter().filter_map(move |name| Some((kind, name, declared(cx.file, section, name)?)))
    };
    let mut found: Vec<(&str, &str, Range<usize>)> = sections.into_iter().flat_map(of).collect();
    if found.is_empty() {
        return Vec::new();
    }
    let formulas = formulas(cx);
    let points = formulas.iter().filter(|(text, _)| text.role == Role::Point);
    let used: HashSet<&str> = points.flat_map(|(_, formula)| free_names(formula, &[])).collect();
    found.retain(|(_, name, _)| used.contains(name));
    found.sort_by_key(|(.., range)| range.start);
    let what = |name: &str| match name {
        "pi" => "the constant",
        "canvas" => "the canvas",
        _ => "the position",
    };
    let message = |(kind, name, range)| (range, format!("{kind} called \"{name}\" hides {}", what(name)));
    found.into_iter().map(message).collect()
}

fn declared(file: &File, section: Section, name: &str) -> Option<Range<usize>> {
    Some(file.entry(section, name)?.key.as_ref()?.range.clone())
}
