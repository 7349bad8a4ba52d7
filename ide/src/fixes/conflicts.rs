//! Fixes of conflict marks: one of the versions stays.
use super::super::diagnose::Finding;
use super::super::rename::Edit;
use super::super::world::Cx;
use super::{Applies, Fix};
use shibo_graph::syntax::Marks;
use std::ops::Range;

/// Keeps ours, theirs, or the base, if the marks have one. `marks` are all conflicts of the text.
pub(super) fn fixes(cx: Cx<'_>, marks: &[Marks], finding: &Finding) -> Vec<Fix> {
    let text = &cx.file.text;
    let Some(conflict) = marks.iter().find(|marks| marks.first == finding.range) else { return Vec::new() };
    let next = |at: usize| text[at..].find('\n').map_or(text.len(), |newline| at + newline + 1);
    let end = next(conflict.rest.end);
    // The lines that begin versions, and the last mark.
    let mut bounds = vec![(conflict.first.start, next(conflict.first.end))];
    let mut at = conflict.rest.start;
    let sign = |at: usize| text[at..].chars().next();
    let length = text[conflict.first.clone()].chars().take_while(|c| *c == '<').count();
    let is_mark = |at: usize, mark: char| {
        let line = text[at..next(at)].trim_end();
        let signs = line.chars().take_while(|c| *c == mark).count();
        signs == length && line[signs..].chars().next().is_none_or(|c| c == ' ')
    };
    while at < end {
        if sign(at).is_some_and(|mark| "|=>".contains(mark) && is_mark(at, mark)) {
            bounds.push((at, next(at)));
        }
        at = next(at);
    }
    let version = |index: usize| -> Range<usize> {
        let start = bounds[index].1;
        start..bounds.get(index + 1).map_or(end, |bound| bound.0)
    };
    let keep = |name: &str, version: Range<usize>| {
        let edits = [conflict.first.start..version.start, version.end..end];
        let edits = edits.into_iter().map(|range| Edit { range, text: String::new() });
        Fix::new(format!("Keep {name}"), Applies::Choice, edits.collect())
    };
    match bounds.len() {
        3 => vec![keep("ours", version(0)), keep("theirs", version(1))],
        4 => vec![keep("ours", version(0)), keep("theirs", version(2)), keep("base", version(1))],
        _ => Vec::new(),
    }
}
