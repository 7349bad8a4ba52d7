//! Graphs as JSON, for programs.
//!
//! A node is `{"Perlin": {"size": 3}}`, a pair is an array, and words such as `Multiply` are strings where the place takes words.
//! Elsewhere a word is `{"Word": null}`. Arguments in brackets are `{"Word": 2}`, or `{"Word": [1, 2]}` where there are several.
//! `None` is `null` and infinity is `"inf"`. Comments are strings, or arrays of lines. The field `"// NAME"` has the comments above a
//! thing, `"NAME //"` has the comments behind it, and `"//"` has the last comments of an object.
//!
//! [`to_json`] loses nothing but layout, so [`to_ron`] gives the same graph back. Both need the kinds of nodes, because `(1, 2)`
//! and `[1, 2]` are both arrays.
mod comments;
mod decode;
mod encode;
mod form;
mod read;
#[cfg(test)]
mod tests;
mod write;

pub use decode::to_ron;
pub use encode::to_json;

use crate::{GraphText, Tools};
use form::Form;
use serde::{Deserialize, Serialize};
use shibo_graph::syntax::SyntaxError;
use shibo_ide::{Cx, Workspace, forms};
use std::collections::BTreeMap;
use std::ops::Range;

/// A mistake in a text.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TextFault {
    /// The bytes of the text.
    pub range: Range<usize>,
    /// The message, in lower case.
    pub message: String,
    /// The remedy, if one is known.
    pub help: Option<String>,
}

impl From<&SyntaxError> for TextFault {
    fn from(error: &SyntaxError) -> Self {
        Self { range: error.range.clone(), message: error.message.to_string(), help: error.help.map(str::to_owned) }
    }
}

/// The forms of the values of a graph, by their ranges. A value that is not listed is [`Form::Plain`].
type Forms = BTreeMap<(usize, usize), Form<'static>>;

/// The forms of the values of a graph.
fn forms_of(tools: &Tools, graph: &GraphText) -> Forms {
    let mut world = Workspace::new(tools.registry.clone(), Vec::new());
    let file = world.open(&graph.path, graph.text.as_str());
    let mut found = Forms::new();
    forms::forms(Cx { world: &world, file: &file }, |range, form| {
        if let Some(form) = Form::of(form) {
            found.insert((range.start, range.end), form);
        }
    });
    found
}
