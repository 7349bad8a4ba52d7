//! Comments: from and to the strings of the JSON form.
use super::read::{Json, Shape};
use super::write::Out;
use shibo_graph::syntax::{Node, Tree};
use std::ops::Range;

/// The field with the comments at the end of an object, or between the items of an array.
pub(super) const END: &str = "//";
/// The name that stands for the whole file, in the fields of the comments above and below it.
pub(super) const FILE: &str = "file";
/// The name that stands for an item of an array.
pub(super) const ITEM: &str = "item";

/// The field with the comments above a thing.
pub(super) fn above(name: &str) -> String {
    format!("// {name}")
}

/// The field with the comments behind a thing.
pub(super) fn behind(name: &str) -> String {
    format!("{name} //")
}

/// Returns true for fields with comments.
pub(super) fn is_comment(name: &str) -> bool {
    name.starts_with("//") || name.ends_with(" //")
}

/// The comments around a thing.
#[derive(Clone, Debug, Default)]
pub(super) struct Around {
    /// Lines above it.
    pub(super) above: Vec<String>,
    /// Comments behind it in its line.
    pub(super) behind: Vec<String>,
}

/// The comments of brackets: around each child, and at the end.
pub(super) fn of_children(tree: &Tree, inside: Range<usize>, children: &[Node<'_>]) -> (Vec<Around>, Vec<String>) {
    let mut around: Vec<Around> = vec![Around::default(); children.len()];
    let mut start = inside.start;
    for (index, child) in children.iter().enumerate() {
        let (behind, above) = of_gap(tree, start..child.range().start, index > 0);
        around[index].above = above;
        if let Some(before) = index.checked_sub(1).and_then(|before| around.get_mut(before)) {
            before.behind = behind;
        }
        start = child.range().end;
    }
    let (behind, end) = of_gap(tree, start..inside.end, !children.is_empty());
    if let Some(last) = around.last_mut() {
        last.behind = behind;
    }
    (around, end)
}

/// The comments between two things: those in the line of the first, and the others with the empty lines among them.
pub(super) fn of_gap(tree: &Tree, gap: Range<usize>, follows: bool) -> (Vec<String>, Vec<String>) {
    let (mut behind, mut lines) = (Vec::new(), Vec::new());
    let (text, mut end) = (tree.text(), gap.start);
    for comment in tree.comments_in(gap.clone()) {
        let between = text[end..comment.start].matches('\n').count();
        let first = lines.is_empty() && behind.is_empty();
        let in_line = follows && lines.is_empty() && !text[gap.start..comment.start].contains('\n');
        end = comment.end;
        if in_line {
            behind.push(plain(&text[comment]));
            continue;
        }
        if between > 1 && (follows || !first) {
            lines.push(String::new());
        }
        lines.push(plain(&text[comment]));
    }
    if !lines.is_empty() && text[end..gap.end].matches('\n').count() > 1 {
        lines.push(String::new());
    }
    (behind, lines)
}

/// The text of a comment, without its slashes where these are understood.
pub(super) fn plain(comment: &str) -> String {
    let inside = comment.strip_prefix("// ").filter(|text| !text.is_empty() && !text.starts_with(['/', ' ']));
    inside.unwrap_or(comment).trim_end().replace("\r\n", "\n")
}

/// Comments as JSON: a string, or an array of lines.
pub(super) fn out(lines: Vec<String>) -> Out {
    match <[String; 1]>::try_from(lines) {
        Ok([line]) => Out::Text(line),
        Err(lines) => Out::List(lines.into_iter().map(Out::Text).collect()),
    }
}

/// Comments from JSON as lines of RON; an empty line stays empty.
pub(super) fn lines(json: &Json) -> Vec<String> {
    match &json.shape {
        Shape::Text(text) => written(text),
        Shape::List(items) => items.iter().flat_map(lines).collect(),
        _ => Vec::new(),
    }
}

fn written(text: &str) -> Vec<String> {
    // A text with slashes stays as it is only if all of it is one comment.
    let tree = Tree::parse(text);
    let whole = tree.comments().eq(std::iter::once(0..text.len())) && tree.tokens().is_empty();
    if whole && !text.ends_with(['\r', '\n']) {
        return vec![text.to_owned()];
    }
    let line = |line: &str| match line.trim_end() {
        "" => String::new(),
        line => format!("// {}", line.replace(|c: char| c.is_control() && c != '\t', " ")),
    };
    text.split('\n').map(line).collect()
}
