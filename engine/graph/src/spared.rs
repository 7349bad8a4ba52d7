//! Errors that are suppressed because they are consequences of syntax errors in the file.
use crate::diagnostics::{Code, Diagnostic};
use crate::syntax::{Node, NodeKind, Tree};
use std::collections::BTreeSet;
use std::ops::Range;

/// The sections of a graph whose names can be referenced, and the error for a missing name.
const NAMES: [(&str, Code); 4] = [
    ("nodes", Code::UnknownNode),
    ("inputs", Code::UnknownNode),
    ("params", Code::UnknownParam),
    ("imports", Code::UnknownVariant),
];

/// The consequences of syntax errors in a file.
#[derive(Debug, Default)]
pub(super) struct Spared {
    /// Unreadable places, in order: any error within them is suppressed.
    places: Vec<Range<usize>>,
    /// Values with unreadable parts: errors at exactly these places are suppressed.
    wholes: BTreeSet<(usize, usize)>,
    /// Lines with a syntax error, clipped to the entry that contains it, in order: any error within them is suppressed.
    lines: Vec<Range<usize>>,
    /// Errors about names that may be defined in unreadable text.
    codes: Vec<Code>,
}

impl Spared {
    /// Finds the consequences of the syntax errors in a tree.
    pub(super) fn by(tree: &Tree) -> Self {
        let mut spared = Self::default();
        let lost = |node: &Node<'_>| matches!(node.kind(), NodeKind::Error | NodeKind::Missing);
        for node in tree.nodes().filter(lost) {
            if spared.places.last().is_none_or(|last| last.end < node.range().end) {
                spared.places.push(node.range());
            }
            // Nodes in a wrong place are not read as nodes.
            let known = spared.codes.contains(&Code::UnknownNode);
            if !known && node.entries().any(|entry| entry.key().is_some_and(|key| key.kind() == NodeKind::Text)) {
                spared.codes.push(Code::UnknownNode);
            }
            for outer in node.ancestors().skip(1).take_while(|outer| outer.kind() != NodeKind::Entry) {
                let range = outer.range();
                spared.wholes.insert((range.start, range.end));
                // A missing field is reported at the word of a call, or at the beginning of a file.
                if let Some(first) = outer.tokens().first() {
                    spared.wholes.insert((first.start(), first.end()));
                }
            }
        }
        spared.add_lines(tree);
        let top = tree.value();
        let torn = |node: Node<'_>| node.is_torn() || lost(&node);
        for (section, code) in NAMES {
            let part = top.and_then(|top| top.entry(section)).and_then(Node::value);
            // A missing section may be part of the unreadable text.
            let unread = |top: Node<'_>| top.children().any(|child| lost(&child) && !child.tokens().is_empty());
            if part.map_or(top.is_some_and(unread), torn) {
                spared.codes.push(code);
            }
        }
        spared
    }

    fn add_lines(&mut self, tree: &Tree) {
        let text = tree.text();
        let breaks: Vec<usize> = text.match_indices('\n').map(|(at, _)| at).collect();
        let places = tree.errors().iter().flat_map(|error| [Some(&error.range), error.bracket.as_ref()]);
        for place in places.flatten() {
            let of_map = |entry: &Node<'_>| {
                entry.kind() == NodeKind::Entry && entry.parent().is_some_and(|map| map.kind() == NodeKind::Map)
            };
            let Some(entry) = tree.covering(place.clone()).ancestors().find(of_map) else { continue };
            let map = entry.parent().map_or(entry.range(), Node::range);
            let line = breaks.partition_point(|&newline| newline < place.start);
            let start = line.checked_sub(1).map_or(0, |before| breaks[before]);
            let end = breaks.get(line).copied().unwrap_or(text.len());
            // An error at the first token of a line is about something missing before it.
            if !text[start..place.start].trim().is_empty() {
                self.lines.push(start.max(entry.range().start)..end.min(map.end));
            }
        }
        self.lines.sort_by_key(|line| line.start);
    }

    /// Returns true if an error is a consequence of a syntax error.
    pub(super) fn spares(&self, diagnostic: &Diagnostic) -> bool {
        let (start, end) = (diagnostic.span.start, diagnostic.span.end);
        if diagnostic.code == Code::Syntax {
            return false;
        }
        let whole = diagnostic.code != Code::UnknownKind && self.wholes.contains(&(start, end));
        let inside = |places: &[Range<usize>]| {
            let before = places.partition_point(|place| place.start <= start);
            places[..before].last().is_some_and(|place| end <= place.end)
        };
        inside(&self.places) || inside(&self.lines) || whole || self.codes.contains(&diagnostic.code)
    }
}
