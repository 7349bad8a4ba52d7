//! Signature help: the values of the function at the cursor, or the fields of the node there.
use super::docs;
use super::expect::Expect;
use super::formula::FormulaText;
use super::functions::{self, Head};
use super::names::quote;
use super::walk::{Spot, Trail, trail};
use super::world::Cx;
use std::ops::Range;

/// Stands between the options of a choice.
const OR: &str = " | ";
/// Most options that are listed for a field without the cursor.
const FEW: usize = 3;

/// Fields of a node or other brackets.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Signature {
    /// All fields in one line.
    pub label: String,
    /// Description, one sentence.
    pub doc: String,
    /// Byte range of each field in the line, and its description.
    pub fields: Vec<(Range<usize>, String)>,
    /// Index of the field at the cursor.
    pub active: Option<usize>,
}

/// Signature of the brackets around a position.
pub fn signature(cx: Cx<'_>, at: usize) -> Option<Signature> {
    let file = cx.file.scope_at(at);
    let cx = cx.with(&file);
    let trail = trail(cx, at);
    if let Some(call) = call(cx, &trail, at) {
        return Some(call);
    }
    let level = trail.levels.iter().rev().find(|level| !describe(level.inside).is_empty())?;
    let fields = describe(level.inside);
    let word = level.value.word().map(|word| cx.file.at(&word)).unwrap_or_default();
    let name = level.item.and_then(|item| {
        let bare = || item.value.as_ref().map(|value| cx.file.at(&value.range));
        item.name().or_else(bare)
    });
    let active = name.and_then(|name| {
        let exact = fields.iter().position(|(field, ..)| field == name || quote(field) == name);
        exact.or_else(|| fields.iter().position(|(field, ..)| field.starts_with(name)))
    });
    // Before the next field is named, the first missing one is active.
    let free = || fields.iter().position(|(field, ..)| level.body.get(field).is_none());
    let active = active.or_else(free);
    let mut label = format!("{word}(");
    let mut places = Vec::new();
    for (i, (name, takes, doc)) in fields.iter().enumerate() {
        if i > 0 {
            label.push_str(", ");
        }
        let start = label.len();
        label.push_str(name);
        let takes = if active == Some(i) { takes.clone() } else { few(takes) };
        if !takes.is_empty() {
            label.push_str(": ");
            label.push_str(&takes);
        }
        places.push((start..label.len(), doc.clone()));
    }
    label.push(')');
    let doc = docs::first_sentence(word, cx.kind(word));
    Some(Signature { label, doc, fields: places, active })
}

/// Signature of the function in a formula whose brackets contain a position.
fn call(cx: Cx<'_>, trail: &Trail<'_>, at: usize) -> Option<Signature> {
    let Spot::Value(expect, value) = trail.spot else { return None };
    let text = FormulaText::of(cx, expect, value)?;
    let formula = text.parse();
    let call = formula.call_at(text.offset(at)?)?;
    let functions = functions::called(cx, formula.at(&call.name));
    let endless = |head: &Head, call: &str| head.params.last().is_some_and(|last| &call[last.clone()] == "…");
    let takes = |call: &str, values: usize| {
        let head = Head::of(call);
        head.params.len() >= values || endless(&head, call)
    };
    // Functions of one name differ in the number of values.
    let found = functions.iter().find(|one| takes(&one.call, call.argument + 1)).or(functions.last())?;
    let head = Head::of(&found.call);
    let last = head.params.len().checked_sub(1)?;
    let active = if endless(&head, &found.call) { Some(call.argument.min(last)) } else { Some(call.argument) };
    Some(Signature {
        label: found.call.clone(),
        doc: found.doc.clone(),
        active: active.filter(|index| *index <= last),
        fields: head.params.into_iter().map(|range| (range, String::new())).collect(),
    })
}

/// The first options of a list.
fn few(takes: &str) -> String {
    let options: Vec<&str> = takes.split(OR).collect();
    match options.get(FEW) {
        Some(_) => format!("{}{OR}…", options[..FEW].join(OR)),
        None => takes.to_owned(),
    }
}

/// Names, types and manuals of the fields of brackets. The type of a choice is the list of its options.
fn describe(inside: Expect<'_>) -> Vec<(String, String, String)> {
    let fields = docs::fields(inside);
    if fields.is_empty() {
        let plain = inside.fields().into_iter();
        return plain.map(|field| (field.name.to_owned(), String::new(), field.doc.to_owned())).collect();
    }
    let short = |field: &shibo_node::FieldInfo| match &field.role {
        shibo_node::Role::Port(port) if port.list => format!("[{}]", port.ty),
        shibo_node::Role::Port(port) => port.ty.to_string(),
        shibo_node::Role::Param(param) if !param.choices.is_empty() => {
            param.choices.iter().map(|choice| choice.name.as_str()).collect::<Vec<_>>().join(OR)
        }
        shibo_node::Role::Param(param) => param.ty.to_string(),
    };
    let of = |field: &shibo_node::FieldInfo| {
        (field.name.clone(), short(field), format!("{}: {}", docs::takes(field), field.doc))
    };
    fields.iter().map(of).collect()
}
