//! Calls of functions that shipped graphs define. Pins mean these functions as they were, like graphs in a `Use`. Source: LASTING §1.
use super::files::Doc;
use super::formula_names::Functions;
use super::formula_text::FormulaText;
use super::functions::Call;
use super::imports;
use crate::diagnostics::Span;
use crate::expression::{self, UseKind};
use crate::syntax::TokenKind;
use std::collections::BTreeSet;

/// A call to follow.
struct Step {
    name: String,
    place: Span,
    /// The file of the call, and the one whose pins count.
    doc: usize,
    pinned_by: Option<usize>,
}

/// The calls of each document, at most one of each function.
pub(super) fn of_all(docs: &[Doc]) -> Vec<Vec<Call>> {
    let has_functions = |doc: &Doc| is_shipped(doc) && !doc.document.functions.is_empty();
    if !docs.iter().any(has_functions) {
        return vec![Vec::new(); docs.len()];
    }
    (0..docs.len()).map(|doc| of(docs, doc)).collect()
}

fn of(docs: &[Doc], doc: usize) -> Vec<Call> {
    let (mut found, mut seen) = (Vec::new(), BTreeSet::new());
    let words = docs[doc].document.values.iter().flat_map(|value| value.words());
    let texts = words.filter(|(kind, _)| *kind == TokenKind::Str).filter_map(|(_, word)| FormulaText::of(&word));
    for text in texts {
        for (name, place) in called(&text) {
            let mut waiting = vec![Step { name, place, doc, pinned_by: None }];
            while let Some(step) = waiting.pop() {
                // A name in a function means one of the function's own file first.
                let find = |doc| Functions::of(docs, doc).find(&step.name);
                let Some((at, decl)) = find(step.doc).or_else(|| find(doc)) else { continue };
                if !seen.insert((at, &decl.function.name, step.pinned_by)) {
                    continue;
                }
                let Step { place, pinned_by, .. } = step;
                if is_shipped(&docs[at]) && docs[at].path != docs[step.doc].path {
                    found.push(Call { from: text.part.span(), place, doc: at, pinned_by });
                }
                let pinned_by = if docs[at].document.pins.is_some() { Some(at) } else { pinned_by };
                let inner = called(&decl.text()).into_iter().map(|(name, inside)| Step {
                    name,
                    place: if is_shipped(&docs[at]) { place } else { inside },
                    doc: at,
                    pinned_by,
                });
                waiting.extend(inner);
            }
        }
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
