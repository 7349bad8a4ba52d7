//! Fixes of the structure of a graph: cycles, names that occur twice, and kinds of earlier versions.
use super::super::diagnose::Finding;
use super::super::insert::remove;
use super::super::migrate::rewrite_of;
use super::super::rename::Edit;
use super::super::view::{Body, Item};
use super::super::walk::trail;
use super::super::world::Cx;
use super::{Applies, Fix};
use shibo_graph::syntax::format;

/// Cuts a cycle at each of its wires.
pub(super) fn cuts(cx: Cx<'_>, finding: &Finding) -> Vec<Fix> {
    let own = |path: &std::path::Path| path == cx.file.path || super::super::identity(path) == cx.file.path;
    let related = finding.related.iter().filter(|(path, ..)| own(path)).map(|(_, range, _)| range);
    let cut = |range: &std::ops::Range<usize>| {
        let (body, item) = item_at(cx, range.start)?;
        let says: String = cx.file.at(range).chars().take(60).collect();
        let title = format!("Cut the wire `{}` of `{}`", says.trim_matches('"'), item.name().unwrap_or_default());
        Some(Fix::new(title, Applies::Choice, vec![remove(cx.file, body, item)]))
    };
    std::iter::once(&finding.range).chain(related).filter_map(cut).collect()
}

/// The innermost item with a key at a position, and the brackets that contain it.
fn item_at(cx: Cx<'_>, at: usize) -> Option<(&Body, &Item)> {
    let found = trail(cx, at);
    let level = found.levels.iter().rev().find(|level| level.item.is_some_and(|item| item.key.is_some()))?;
    Some((level.body, level.item?))
}

/// Removes one of two things of the same name: surely if they are equal.
pub(super) fn duplicates(cx: Cx<'_>, finding: &Finding) -> Vec<Fix> {
    let Some((body, second)) = item_at(cx, finding.range.start) else { return Vec::new() };
    let same = |item: &&Item| item.name() == second.name() && item.range != second.range;
    let Some(first) = body.items.iter().find(same) else { return Vec::new() };
    let says = |item: &Item| item.value.as_ref().map(|value| plain(cx.file.at(&value.range)));
    let without =
        |title: &str, applies: Applies, item: &Item| Fix::new(title, applies, vec![remove(cx.file, body, item)]);
    if says(first) == says(second) && !has_comment(cx, second) {
        return vec![without("Remove the copy", Applies::Sure, second)];
    }
    vec![
        without("Keep the first, remove the second", Applies::Choice, second),
        without("Keep the second, remove the first", Applies::Choice, first),
    ]
}

fn has_comment(cx: Cx<'_>, item: &Item) -> bool {
    cx.file.tree.comments_in(item.range.clone()).next().is_some()
}

/// A text in the usual layout, if it can be read.
fn plain(text: &str) -> String {
    format(text).unwrap_or_else(|_| text.to_owned())
}

/// Replaces a kind of an earlier version.
pub(super) fn successor(cx: Cx<'_>, finding: &Finding) -> Vec<Fix> {
    let node = cx.file.tree.covering(finding.range.clone());
    let Some(text) = rewrite_of(node, cx.registry()) else { return Vec::new() };
    let new = match text.split('(').next() {
        Some(kind) if !text.starts_with('"') => format!("`{kind}`"),
        _ => "a formula".to_owned(),
    };
    let title = format!("Replace `{}` by {new}", cx.file.at(&finding.range));
    vec![Fix::new(title, Applies::Likely, vec![Edit { range: node.range(), text }])]
}
