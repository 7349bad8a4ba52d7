//! Completion at a position, best first.
mod behind;
mod fields;
mod formula;
mod kinds;
mod paths;
pub(crate) mod ranks;
mod references;
mod uses;
mod values;

use super::docs;
use super::expect::Expect;
use super::formula::FormulaText;
use super::hover::{Pictures, node_text};
use super::types::Types;
use super::view::{Shape, Value};
use super::walk::{Spot, Trail, trail};
use super::world::Cx;
use serde::{Deserialize, Serialize};
use shibo_graph::syntax::formula::content;
use std::ops::Range;

/// Maximum number of completions.
const MOST: usize = 2000;

/// Category of a completion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sort {
    /// A kind of nodes.
    Kind,
    /// A node or one of its outputs.
    Node,
    /// A field.
    Field,
    /// An option of a choice.
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

/// Source of a completion's manual.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Topic {
    /// The manual itself.
    Text(String),
    /// Manual of a kind.
    Kind(String),
    /// Manual of a field of a kind.
    Field(String, String),
    /// Documentation of a node of this file.
    Node(String),
}

/// A completion.
#[derive(Clone, Debug)]
pub struct Completion {
    /// Text that is shown and compared with typed letters.
    pub label: String,
    /// Category.
    pub sort: Sort,
    /// A few words shown beside the label.
    pub detail: String,
    /// Source of the manual.
    pub topic: Topic,
    /// Text to insert.
    pub insert: String,
    /// True if `insert` has placeholders like `$1`.
    pub snippet: bool,
    /// Bytes that `insert` replaces.
    pub replace: Range<usize>,
    /// True if the item is deprecated.
    pub deprecated: bool,
    /// Name in another program that the typed letters begin, if the item is offered for that reason.
    pub elsewhere: Option<String>,
    /// Rank; lower is better.
    score: f64,
}

/// Context of a completion request.
struct Ask<'a> {
    cx: Cx<'a>,
    types: Types<'a>,
    trail: Trail<'a>,
    /// Position of the cursor.
    at: usize,
    /// Range to replace.
    replace: Range<usize>,
    /// True if the range is between quotes.
    quoted: bool,
    /// The names that were ranked by facts.
    #[cfg(test)]
    ranked: Vec<ranks::Ranked>,
}

/// Completions at a position.
pub fn complete(cx: Cx<'_>, at: usize) -> Vec<Completion> {
    if cx.file.tree.is_comment(at) {
        return Vec::new();
    }
    let file = cx.file.scope_at(at);
    let mut ask = Ask::new(cx.with(&file), at);
    let found = ask.dispatch();
    ask.finish(found)
}

/// The names that are ranked by facts at a position in a formula.
#[cfg(test)]
pub(crate) fn ranked(cx: Cx<'_>, at: usize) -> Vec<ranks::Ranked> {
    let file = cx.file.scope_at(at);
    let mut ask = Ask::new(cx.with(&file), at);
    ask.dispatch();
    ask.ranked
}

/// Manual of a completion.
pub fn manual(cx: Cx<'_>, topic: &Topic, pictures: &dyn Pictures) -> String {
    let found = match topic {
        Topic::Text(text) => Some(text.clone()),
        Topic::Kind(kind) => cx
            .kind(kind)
            .map(|info| docs::kind(info, pictures.kind(kind).as_deref()))
            .or_else(|| crate::manual::words::doc(kind).map(|doc| format!("### {kind}\n\n{doc}"))),
        Topic::Field(kind, name) => {
            cx.kind(kind).and_then(|info| info.field(name)).map(|field| docs::field(kind, field))
        }
        Topic::Node(name) => node_text(cx, name, None, pictures),
    };
    found.unwrap_or_default()
}

/// Matches typed letters as a subsequence of a label; returns the rank, lower is better, or `None`.
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
    fn new(cx: Cx<'a>, at: usize) -> Self {
        let (types, trail) = (Types::new(cx), trail(cx, at));
        Self {
            cx,
            types,
            trail,
            at,
            replace: at..at,
            quoted: false,
            #[cfg(test)]
            ranked: Vec::new(),
        }
    }

    fn dispatch(&mut self) -> Vec<Completion> {
        let last = self.trail.last();
        match self.trail.spot {
            Spot::Value(expect, value) => match &value.shape {
                Shape::Text(_) if value.range.start < self.at => self.in_text(expect, value),
                Shape::Word => self.on_word(expect, value.range.clone()),
                Shape::Call { word, .. } if self.at <= word.end => self.on_word(expect, word.clone()),
                // The kind is missing before its brackets.
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
                let Some(level) = last else { return self.graph() };
                if level.body.bracket == b'[' {
                    self.element(level.inside)
                } else {
                    self.keys(level.inside, level.body, false)
                }
            }
        }
    }

    /// Completes a word that is a value or the beginning of a key.
    fn on_word(&mut self, expect: Expect<'a>, word: Range<usize>) -> Vec<Completion> {
        self.replace = word;
        let Some(level) = self.trail.last() else { return self.graph() };
        match level.item {
            Some(item) if item.key.is_none() && level.body.bracket != b'[' => {
                self.keys(level.inside, level.body, false)
            }
            Some(item) if item.key.is_none() => self.element(level.inside),
            _ => self.value(expect),
        }
    }

    /// A new graph, for a file without one.
    fn graph(&self) -> Vec<Completion> {
        if self.cx.file.body().is_some() {
            return Vec::new();
        }
        let nodes = "  nodes: {\n    \"${2:noise}\": ${3:Perlin(size: 4)},\n  },\n  outputs: { \"${4:height}\": \"${2:noise}\" },\n)\n";
        let whole = "(\n  version: 1,\n  canvas: (size_mm: ${1:40}),\n";
        let form = |(index, (label, detail, text)): (usize, (&str, &str, String))| {
            let offer = self.offer(label, Sort::Value, detail, Topic::Text(detail.to_owned()), index as f64);
            Completion { insert: text, snippet: true, ..offer }
        };
        let forms = [
            ("graph", "A graph with a canvas, nodes and outputs.", format!("{whole}{nodes}")),
            ("nodes", "A graph with nodes and outputs, on the usual canvas.", format!("(\n{nodes}")),
        ];
        forms.into_iter().enumerate().map(form).collect()
    }

    /// Completes an element of a list.
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

    /// Completes between quotes.
    fn in_text(&mut self, expect: Expect<'a>, value: &'a Value) -> Vec<Completion> {
        let text = &self.cx.file.text;
        let literal = self.cx.file.at(&value.range);
        let closed = literal.len() > 1 && literal.ends_with('"');
        // A text with escapes.
        let whole = || literal.starts_with('"').then(|| 1..literal.len() - usize::from(closed));
        let Some(inside) = content(literal).or_else(whole) else { return Vec::new() };
        let (start, end) = (value.range.start + inside.start, value.range.start + inside.end);
        if self.at < start || self.at > end {
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
        match FormulaText::of(self.cx, expect, value) {
            Some(formula) => self.formula(expect, &formula),
            None => self.text(expect, typed, start..end),
        }
    }

    /// End of the word at the cursor, at most `end`.
    fn word_end(&self, end: usize) -> usize {
        let rest = self.cx.file.text.get(self.at..end).unwrap_or_default();
        self.at + rest.find(|c: char| !(c.is_alphanumeric() || matches!(c, '_' | '.'))).unwrap_or(rest.len())
    }

    /// A completion without placeholders.
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
            elsewhere: None,
            score,
        }
    }

    /// A completion for a text; adds quotes unless the cursor is between quotes.
    fn offer_text(&self, label: &str, sort: Sort, detail: &str, topic: Topic, score: f64) -> Completion {
        let offer = self.offer(label, sort, detail, topic, score);
        let insert = if self.quoted { label.to_owned() } else { super::names::quote(label) };
        Completion { insert, ..offer }
    }

    /// Keeps the completions that match the typed letters, best first.
    fn finish(&self, found: Vec<Completion>) -> Vec<Completion> {
        let text = &self.cx.file.text;
        let mut ranked: Vec<(u8, Completion)> = found
            .into_iter()
            .filter_map(|one| {
                let typed = text.get(one.replace.start..self.at)?.trim_start_matches('"');
                let rank = if one.elsewhere.is_some() { Some(1) } else { matches(typed, &one.label) };
                Some((rank?, one))
            })
            .collect();
        ranked.sort_by(|(a, x), (b, y)| a.cmp(b).then(x.score.total_cmp(&y.score)).then_with(|| x.label.cmp(&y.label)));
        ranked.truncate(MOST);
        let mut seen = std::collections::HashSet::new();
        ranked.into_iter().map(|(_, one)| one).filter(|one| seen.insert(one.label.clone())).collect()
    }
}
