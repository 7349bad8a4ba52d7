//! The text of a formula in a graph file, and its program.
use super::part::{Shape, SyntaxValue};
use crate::expression::{self, Compiled, NameUse, UseKind};
use std::ops::Range;
use std::sync::Arc;

/// The text of a formula.
#[derive(Clone, Debug)]
pub(super) struct FormulaText {
    /// The literal that contains it.
    pub(super) part: SyntaxValue,
    /// The text after the equals sign.
    pub(super) text: String,
    /// The offset of the text in the literal; `None` for a literal with escapes.
    pub(super) offset: Option<usize>,
}

impl FormulaText {
    /// The formula in a text that begins with one equals sign.
    pub(super) fn of(part: &SyntaxValue) -> Option<Self> {
        let Shape::Text(whole) = part.shape() else { return None };
        let text = whole.strip_prefix('=').filter(|text| !text.starts_with('='))?.to_owned();
        Some(Self { part: part.clone(), text, offset: Self::offset(part).map(|offset| offset + 1) })
    }

    /// The offset of a text in its literal; `None` for a literal with escapes.
    pub(super) fn offset(part: &SyntaxValue) -> Option<usize> {
        let Shape::Text(text) = part.shape() else { return None };
        let offset = part.str().find('"')? + 1;
        (part.str().get(offset..offset + text.len()) == Some(&text)).then_some(offset)
    }

    /// The components of the value `path`, as a formula that errors refer to as a whole.
    pub(super) fn made(part: &SyntaxValue, path: &str, components: &str) -> Self {
        Self { part: part.clone(), text: format!("{path}.{components}"), offset: None }
    }

    /// The literal, whose errors refer to bytes of the formula.
    pub(super) fn place(&self, range: &Range<usize>) -> SyntaxValue {
        match self.offset {
            // A place past the last character becomes the closing quote.
            Some(offset) => self.part.at(offset + range.start, offset + range.end.max(range.start + 1)),
            None => self.part.clone(),
        }
    }

    /// The names that may refer to nodes or to the position.
    pub(super) fn names(&self) -> Vec<NameUse> {
        let uses = expression::names_in(&self.text).into_iter();
        uses.filter(|name| name.kind == UseKind::Name && !name.name.starts_with("canvas.")).collect()
    }
}

/// A formula in a graph.
pub(super) struct Formula {
    pub(super) text: FormulaText,
    /// The names of values: the path without components, and the slot.
    pub(super) values: Vec<(String, usize)>,
    /// The program, once the types of its values are known.
    pub(super) program: Option<Arc<Compiled>>,
    /// True if one formula alone reads it.
    pub(super) inner: bool,
}

impl Formula {
    /// The formula that takes components of its only slot, which it calls `path`.
    pub(super) fn of_components(text: FormulaText, path: &str) -> Self {
        Self { text, values: vec![(path.to_owned(), 0)], program: None, inner: false }
    }
}
