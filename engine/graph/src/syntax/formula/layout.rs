//! Lays out formulas: one space round operators and after commas, none inside brackets.
//!
//! A formula that does not fit into its line breaks before its loosest operators, or after commas if these are looser, and
//! becomes a raw text. Definitions of local names stand one per line if the formula has several lines. Formulas with
//! mistakes stay as they are. Only blanks change, so the meaning never does.
use super::parts::{Formula, PartKind};
use super::words::{WordKind, binding};
use super::{begins, content};
use crate::syntax::nodes::NodeKind;
use crate::syntax::tree::{Node, Tree};
use std::collections::BTreeMap;

/// Entries whose texts are for readers.
const NOTES: [&str; 4] = ["note", "doc", "unit", "group"];
/// The section with the bodies of functions, which have no equals sign.
const FUNCTIONS: &str = "functions";

/// A place where a formula may break.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Break {
    /// The first byte of the next line.
    at: usize,
    /// Depth of brackets and binding of the operator; smaller ones are looser.
    level: (usize, u8),
}

/// The layout of a formula.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::syntax) struct Laid {
    /// The formula on one line, with the equals sign if it has one.
    flat: String,
    /// Number of characters of the literal on one line.
    pub(in crate::syntax) width: usize,
    /// True if it always has several lines.
    pub(in crate::syntax) is_tall: bool,
    /// The places where statements begin, except the first.
    statements: Vec<usize>,
    breaks: Vec<Break>,
}

/// The formulas of a graph, by the index of their token.
pub(in crate::syntax) fn formulas(tree: &Tree) -> BTreeMap<usize, Laid> {
    let mut found = BTreeMap::new();
    for node in tree.nodes().filter(|node| node.kind() == NodeKind::Text) {
        let Some(entry) = node.ancestors().find(|node| node.kind() == NodeKind::Entry) else { continue };
        let is_key = entry.key() == Some(node);
        let is_note = entry.key_text().is_some_and(|key| NOTES.contains(&key.as_str()));
        if is_key || is_note || node.token_range().len() != 1 {
            continue;
        }
        if let Some(laid) = Laid::of(node.text(), is_body(tree, node)) {
            found.insert(node.token_range().start, laid);
        }
    }
    found
}

/// Returns true for the body of a function.
fn is_body(tree: &Tree, node: Node<'_>) -> bool {
    let section = node.ancestors().skip(1).filter(|outer| outer.kind() == NodeKind::Entry).nth(1);
    section.is_some_and(|section| section.key_text().as_deref() == Some(FUNCTIONS) && section.parent() == tree.value())
}

impl Laid {
    /// The layout of a literal; `None` if it is no formula, or stays as it is. The body of a function needs no equals
    /// sign.
    pub(in crate::syntax) fn of(literal: &str, is_body: bool) -> Option<Self> {
        let inside = &literal[content(literal)?];
        let start = match begins(inside) {
            Some(start) => start,
            None if is_body && !inside.starts_with('=') => 0,
            None => return None,
        };
        let formula = Formula::parse(&inside[start..]);
        if formula.is_faulty() {
            return None;
        }
        let mut laid = Self {
            flat: if start > 0 { "= ".to_owned() } else { String::new() },
            width: 0,
            is_tall: inside.contains('\n') && !formula.locals().is_empty(),
            statements: Vec::new(),
            breaks: Vec::new(),
        };
        laid.write(&formula);
        laid.width = laid.flat.len() + 2;
        Some(laid)
    }

    /// Writes the words on one line.
    fn write(&mut self, formula: &Formula) {
        let mut depth = 0_usize;
        let mut before: Option<(WordKind, bool)> = None;
        for (index, word) in formula.words().iter().enumerate() {
            let part = formula.part_of(index).and_then(|part| formula.parts().get(part));
            let is_sign = part.is_some_and(|part| part.kind == PartKind::Sign && part.word == Some(index));
            let is_call = before.is_some_and(|(kind, _)| kind == WordKind::Name) && word.kind == WordKind::Open;
            // Behind a name, a blank keeps letters apart: without it they are a part of the name.
            let are_letters = word.kind == WordKind::Letters && before.is_some_and(|(kind, _)| kind.joins_letters());
            let joins =
                matches!(word.kind, WordKind::Close | WordKind::Comma | WordKind::Semicolon) || is_call || are_letters;
            let joined = before.is_none_or(|(kind, is_sign)| kind == WordKind::Open || is_sign);
            if !joins && !joined {
                self.flat.push(' ');
            }
            let operator = matches!(word.kind, WordKind::Operator) && !is_sign;
            if operator {
                self.breaks.push(Break { at: self.flat.len(), level: (depth, binding(formula.at(&word.range))) });
            }
            match before.map(|(kind, _)| kind) {
                Some(WordKind::Semicolon) => self.statements.push(self.flat.len()),
                Some(WordKind::Comma) => self.breaks.push(Break { at: self.flat.len(), level: (depth, 0) }),
                _ => {}
            }
            match word.kind {
                WordKind::Open => depth += 1,
                WordKind::Close => depth = depth.saturating_sub(1),
                _ => {}
            }
            self.flat.push_str(formula.at(&word.range));
            before = Some((word.kind, is_sign));
        }
    }

    /// The literal in a line of at most `width` characters that has `column` characters before it; other lines begin with
    /// `indent` spaces.
    pub(in crate::syntax) fn literal(&self, column: usize, indent: usize, width: usize, newline: &str) -> String {
        // A comma follows.
        if !self.is_tall && column + self.width < width {
            return format!("\"{}\"", self.flat);
        }
        let lines = self.lines(column + "r#\"".len(), indent, width);
        if lines.len() == 1 {
            return format!("\"{}\"", self.flat);
        }
        let mut out = String::from("r#\"");
        for (number, (line, deeper)) in lines.iter().enumerate() {
            if number > 0 {
                out.push_str(newline);
                out.extend(std::iter::repeat_n(' ', indent + deeper));
            }
            out.push_str(line);
        }
        out.push_str("\"#");
        out
    }

    /// The lines, each with the spaces before it beyond those of all lines.
    fn lines(&self, column: usize, indent: usize, width: usize) -> Vec<(&str, usize)> {
        const DEEPER: usize = 2;
        let mut lines = Vec::new();
        let starts = std::iter::once(0).chain(self.statements.iter().copied());
        let ends = self.statements.iter().copied().chain([self.flat.len()]);
        for (start, end) in starts.zip(ends) {
            let is_last = end == self.flat.len();
            let (mut at, mut deeper) = (start, 0);
            loop {
                let before = if lines.is_empty() { column } else { indent + deeper };
                // A quote, a `#` and a comma follow the last line.
                let room = width.saturating_sub(before + if is_last { 3 } else { 0 });
                let next = self.next_line(at, end, room, width.saturating_sub(before));
                lines.push((self.flat[at..next].trim_end(), deeper));
                if next == end {
                    break;
                }
                at = next;
                deeper = if self.statements.is_empty() { 0 } else { DEEPER };
            }
        }
        lines
    }

    /// The end of the line that begins at `at`: all of a statement if it fits into `room`, else the loosest place to break
    /// within `width`, and the last of these.
    fn next_line(&self, at: usize, end: usize, room: usize, width: usize) -> usize {
        // The words of a formula without mistakes are ASCII.
        if end - at <= room {
            return end;
        }
        let first = self.breaks.partition_point(|place| place.at <= at);
        let inside = || self.breaks[first..].iter().take_while(|place| place.at < end);
        // A blank before the place is left out.
        let fitting = inside().take_while(|place| place.at - at <= width + 1);
        let loosest = fitting.min_by_key(|place| (place.level, usize::MAX - place.at));
        loosest.or(inside().next()).map_or(end, |place| place.at)
    }
}
