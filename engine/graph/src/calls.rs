//! Calls of functions that shipped graphs define. Pins mean these functions as they were, like graphs in a `Use`. Source: LASTING §1.
use super::files::Doc;
use super::formula_names::Functions;
use super::formula_text::FormulaText;
use super::functions::Call;
use super::imports;
use crate::diagnostics::Span;
use crate::expression::{self, UseKind};
use crate::syntax::TokenKind;
use std::collections::{BTreeMap, BTreeSet};

/// A call to follow.
struct Step {
    name: String,
    reached: Reached,
}

/// A call that a formula makes, directly or by way of other functions.
#[derive(Clone, Copy)]
struct Reached {
    /// The place of the call in a function of another file; `None` for the call in the formula.
    place: Option<Span>,
    /// The file of the call; for a result, the file of the shipped function.
    doc: usize,
    /// The file whose pins count.
    pinned_by: Option<usize>,
}

/// The calls of each document. Each function in a formula gives one call for each shipped file that it reaches.
pub(super) fn of_all(docs: &[Doc]) -> Vec<Vec<Call>> {
    let has_functions = |doc: &Doc| is_shipped(doc) && !doc.document.functions.is_empty();
    if !docs.iter().any(has_functions) {
        return vec![Vec::new(); docs.len()];
    }
    (0..docs.len()).map(|doc| of(docs, doc)).collect()
}

fn of(docs: &[Doc], doc: usize) -> Vec<Call> {
    let (mut found, mut known) = (Vec::new(), BTreeMap::new());
    let words = docs[doc].document.values.iter().flat_map(|value| value.words());
    let texts = words.filter(|(kind, _)| *kind == TokenKind::Str).filter_map(|(_, word)| FormulaText::of(&word));
    for text in texts {
        let mut names = BTreeSet::new();
        for (name, place) in called(&text) {
            if !names.insert(name.clone()) {
                continue;
            }
            let reached = known.entry(name).or_insert_with_key(|name| reached(docs, doc, name));
            let call = |it: &Reached| Call {
                from: text.part.span(),
                place: it.place.unwrap_or(place),
                doc: it.doc,
                pinned_by: it.pinned_by,
            };
            found.extend(reached.iter().map(call));
        }
    }
    found
}

/// The shipped files whose functions a call of `name` in a formula of a document reaches, each with the first call found.
fn reached(docs: &[Doc], doc: usize, name: &str) -> Vec<Reached> {
    let (mut found, mut files, mut seen) = (Vec::new(), BTreeSet::new(), BTreeSet::new());
    let mut waiting = vec![Step { name: name.to_owned(), reached: Reached { place: None, doc, pinned_by: None } }];
    while let Some(Step { name, reached }) = waiting.pop() {
        let Reached { place, pinned_by, .. } = reached;
        // A name in a function means one of the function's own file first.
        let find = |doc| Functions::of(docs, doc).find(&name);
        let Some((at, decl)) = find(reached.doc).or_else(|| find(doc)) else { continue };
        if !seen.insert((at, &decl.function.name, pinned_by)) {
            continue;
        }
        if is_shipped(&docs[at]) && docs[at].path != docs[reached.doc].path && files.insert((at, pinned_by)) {
            found.push(Reached { doc: at, ..reached });
        }
        let pinned_by = if docs[at].document.pins.is_some() { Some(at) } else { pinned_by };
        let inner = called(&decl.text()).into_iter().map(|(name, inside)| {
            let place = if is_shipped(&docs[at]) { place } else { Some(inside) };
            Step { name, reached: Reached { place, doc: at, pinned_by } }
        });
        waiting.extend(inner);
    }
    found
}

/// The functions that a formula calls, with the places.
fn called(text: &FormulaText) -> Vec<(String, Span)> {
    let uses = expression::names_in(&text.text).into_iter().filter(|one| one.kind == UseKind::Function);
    uses.map(|one| (one.name, text.place(&one.range).span())).collect()
}

fn is_shipped(doc: &Doc) -> bool {
    imports::within(&doc.path).is_some()
}
