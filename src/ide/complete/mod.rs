//! What may be written at a place, the best first.
mod fields;
mod formula;
mod kinds;
mod paths;
mod references;
mod values;

use super::docs;
use super::expect::Expect;
use super::hover::{Pictures, node_text};
use super::types::Types;
use super::view::{Shape, Value};
use super::walk::{Spot, Trail, trail};
use super::world::Cx;
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// The most that is offered at once.
const MOST: usize = 2000;

/// What an offer is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Sort {
    /// A kind of nodes.
    Kind,
    /// A node or an output of one.
    Node,
    /// A field.
    Field,
    /// A word to choose.
    Choice,
    /// A parameter of the graph.
    Param,
    /// A function or a constant of expressions.
    Function,
    /// A file.
    File,
    /// A folder.
    Folder,
    /// A colour.
    Color,
    /// A preset or an import.
    Name,
    /// A value.
    Value,
}

/// Where the manual of an offer is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) enum Topic {
    /// The text itself.
    Text(String),
    /// The manual of a kind.
    Kind(String),
    /// That of a field of a kind.
    Field(String, String),
    /// That of a node of this file.
    Node(String),
}

/// Something that may be written.
#[derive(Clone, Debug)]
pub(crate) struct Completion {
    /// What is shown, and what typed letters are compared with.
    pub(crate) label: String,
    /// What it is.
    pub(crate) sort: Sort,
    /// A few words beside it.
    pub(crate) detail: String,
    /// Where its manual is.
    pub(crate) topic: Topic,
    /// What is written, and in the place of which bytes.
    pub(crate) insert: String,
    /// Whether `insert` has places to fill in, as `$1`.
    pub(crate) snippet: bool,
    /// See `insert`.
    pub(crate) replace: Range<usize>,
    /// Whether it should no longer be used.
    pub(crate) deprecated: bool,
    /// How well it fits; the smallest is the best.
    score: f64,
}

/// The place where something is asked for.
struct Ask<'a> {
    cx: Cx<'a>,
    types: Types<'a>,
    trail: Trail<'a>,
    /// The cursor.
    at: usize,
    /// What is replaced.
    replace: Range<usize>,
    /// Whether that is between quotes.
    quoted: bool,
}

/// What may be written at a place.
pub(crate) fn complete(cx: Cx<'_>, at: usize) -> Vec<Completion> {
    if cx.file.tree.is_comment(at) {
        return Vec::new();
    }
    let trail = trail(cx, at);
    let mut ask = Ask { cx, types: Types::new(cx), trail, at, replace: at..at, quoted: false };
    let found = ask.dispatch();
    ask.finish(found)
}

/// The manual of an offer.
pub(crate) fn manual(cx: Cx<'_>, topic: &Topic, pictures: &dyn Pictures) -> String {
    let found = match topic {
        Topic::Text(text) => Some(text.clone()),
        Topic::Kind(kind) => cx
            .kind(kind)
            .map(|info| docs::kind(info, pictures.kind(kind).as_deref()))
            .or_else(|| crate::nodes::composition_doc(kind).map(|doc| format!("### {kind}\n\n{doc}"))),
        Topic::Field(kind, name) => {
            cx.kind(kind).and_then(|info| info.field(name)).map(|field| docs::field(kind, field))
        }
        Topic::Node(name) => node_text(cx, name, None, pictures),
    };
    found.unwrap_or_default()
}

/// Whether letters occur in a word in their order; how well, the smallest being the best.
fn matches(typed: &str, label: &str) -> Option<u8> {
    let (typed, lower) = (typed.to_lowercase(), label.to_lowercase());
    if lower.starts_with(&typed) {
        return Some(0);
    }
    if lower.split(['_', '.', '$', '/', ':']).any(|part| part.starts_with(&typed)) {
        return Some(1);
    }
    let mut rest = lower.chars();
    typed.chars().all(|c| rest.any(|l| l == c)).then_some(2)
}

impl<'a> Ask<'a> {
    fn dispatch(&mut self) -> Vec<Completion> {
        let last = self.trail.last();
        match self.trail.spot {
            Spot::Value(expect, value) => match &value.shape {
                Shape::Text(_) if value.range.start < self.at => self.in_text(expect, value),
                Shape::Word => self.on_word(expect, value.range.clone()),
                Shape::Call { word, .. } if self.at <= word.end => self.on_word(expect, word.clone()),
                // A kind is missing before its brackets.
                Shape::Body(body) if self.at <= value.range.start && body.bracket == b'(' => self.value(expect),
                Shape::Number(_) | Shape::Other => Vec::new(),
                _ => Vec::new(),
            },
            Spot::Missing(expect) => self.value(expect),
            Spot::Key(item) => {
                let Some((level, key)) = last.zip(item.key.as_ref()) else { return Vec::new() };
                self.replace = key.range.clone();
                self.quoted = self.cx.file.at(&key.range).starts_with('"');
                if self.quoted {
                    self.replace = key.range.start + 1..key.range.end.saturating_sub(1).max(key.range.start + 1);
                }
                self.keys(level.inside, level.body, true)
            }
            Spot::Between => {
                let Some(level) = last else { return Vec::new() };
                if level.body.bracket == b'[' {
                    self.element(level.inside)
                } else {
                    self.keys(level.inside, level.body, false)
                }
            }
        }
    }

    /// At a word that is a value, or the beginning of a key.
    fn on_word(&mut self, expect: Expect<'a>, word: Range<usize>) -> Vec<Completion> {
        self.replace = word;
        let Some(level) = self.trail.last() else { return Vec::new() };
        match level.item {
            Some(item) if item.key.is_none() && level.body.bracket != b'[' => {
                self.keys(level.inside, level.body, false)
            }
            Some(item) if item.key.is_none() => self.element(level.inside),
            _ => self.value(expect),
        }
    }

    /// An element of a list.
    fn element(&mut self, inside: Expect<'a>) -> Vec<Completion> {
        match inside {
            Expect::Port(field, port, _) => self.value(Expect::Port(field, port, true)),
            Expect::Value(_, param) if !param.fields.is_empty() => {
                let names = param.fields.iter().map(|f| f.name.as_str()).collect::<Vec<_>>().join(", ");
                let item = self.offer("( )", Sort::Value, &names, Topic::Text(String::new()), 0.0);
                vec![Completion { insert: "($0)".to_owned(), snippet: true, ..item }]
            }
            _ => self.colors_used(),
        }
    }

    /// Between quotes.
    fn in_text(&mut self, expect: Expect<'a>, value: &'a Value) -> Vec<Completion> {
        let text = &self.cx.file.text;
        let start = value.range.start + 1;
        if !text[value.range.start..].starts_with('"') || self.at < start {
            return Vec::new();
        }
        let closed = value.range.len() > 1 && text[..value.range.end].ends_with('"');
        let end = if closed { value.range.end - 1 } else { value.range.end };
        if self.at > end {
            return Vec::new();
        }
        self.quoted = true;
        let typed = text.get(start..self.at).unwrap_or_default();
        let level = self.trail.last();
        if let (Some(level), false) = (level, matches!(expect, Expect::Note)) {
            let is_key = level.item.is_some_and(|item| item.key.is_none()) && level.body.bracket == b'{';
            if is_key {
                self.replace = start..self.word_end(end);
                return self.keys(level.inside, level.body, false);
            }
        }
        self.text(expect, typed, start..end)
    }

    /// The end of the word that the cursor is in, at most `end`.
    fn word_end(&self, end: usize) -> usize {
        let rest = self.cx.file.text.get(self.at..end).unwrap_or_default();
        self.at + rest.find(|c: char| !(c.is_alphanumeric() || matches!(c, '_' | '.'))).unwrap_or(rest.len())
    }

    /// An offer without places to fill in.
    fn offer(&self, label: &str, sort: Sort, detail: &str, topic: Topic, score: f64) -> Completion {
        Completion {
            label: label.to_owned(),
            sort,
            detail: detail.to_owned(),
            topic,
            insert: label.to_owned(),
            snippet: false,
            replace: self.replace.clone(),
            deprecated: false,
            score,
        }
    }

    /// The same for a text, with quotes if the cursor is not between some.
    fn offer_text(&self, label: &str, sort: Sort, detail: &str, topic: Topic, score: f64) -> Completion {
        let offer = self.offer(label, sort, detail, topic, score);
        let insert = if self.quoted { label.to_owned() } else { super::names::quote(label) };
        Completion { insert, ..offer }
    }

    /// Those that have the letters that are typed, the best first.
    fn finish(&self, found: Vec<Completion>) -> Vec<Completion> {
        let text = &self.cx.file.text;
        let mut ranked: Vec<(u8, Completion)> = found
            .into_iter()
            .filter_map(|one| {
                let typed = text.get(one.replace.start..self.at)?.trim_start_matches('"');
                Some((matches(typed, &one.label)?, one))
            })
            .collect();
        ranked.sort_by(|(a, x), (b, y)| a.cmp(b).then(x.score.total_cmp(&y.score)).then_with(|| x.label.cmp(&y.label)));
        ranked.truncate(MOST);
        let mut seen = std::collections::HashSet::new();
        ranked.into_iter().map(|(_, one)| one).filter(|one| seen.insert(one.label.clone())).collect()
    }
}
