//! Paths: `node`, `node.output`, `material.channel`, `color.r` and longer ones.
use super::file::Section;
use super::world::{Cx, is_use};
use shibo_value::Channel;
use std::ops::Range;

/// The parts of a path, as bytes of its text.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Path {
    /// The name of a node or an input.
    pub node: Range<usize>,
    /// An output, or a name that is neither a channel nor components.
    pub port: Option<Range<usize>>,
    /// A channel of a material.
    pub channel: Option<Range<usize>>,
    /// Components.
    pub components: Option<Range<usize>>,
}

impl Path {
    /// Splits a text.
    pub(crate) fn of(cx: Cx<'_>, text: &str) -> Self {
        let mut parts = parts(text);
        let Some(node) = parts.next() else { return Self::default() };
        let mut path = Self { node: node.clone(), ..Self::default() };
        let mut next = parts.next().filter(|part| !part.is_empty());
        if let Some(part) = &next {
            let name = &text[part.clone()];
            let other = Channel::from_name(name).is_some() || are_components(name);
            if is_output(cx, &text[node], name).unwrap_or(true) || !other {
                path.port = next;
                next = parts.next();
            }
        }
        if let Some(part) = next.clone().filter(|part| Channel::from_name(&text[part.clone()]).is_some()) {
            path.channel = Some(part);
            next = parts.next();
        }
        path.components = next.filter(|part| are_components(&text[part.clone()]));
        path
    }
}

/// The parts of a text between dots.
fn parts(text: &str) -> impl Iterator<Item = Range<usize>> {
    let mut start = 0;
    text.split('.').map(move |part| {
        let range = start..start + part.len();
        start = range.end + 1;
        range
    })
}

/// Returns true for letters that name components.
pub(crate) fn are_components(text: &str) -> bool {
    let all = |set: &str| text.chars().all(|c| set.contains(c));
    (1..=4).contains(&text.len()) && (all("rgba") || all("xyzw"))
}

/// Returns whether a node has an output of this name; `None` if its outputs are not known.
fn is_output(cx: Cx<'_>, node: &str, name: &str) -> Option<bool> {
    if cx.file.entry(Section::Inputs, node).is_some() {
        return Some(false);
    }
    let value = cx.file.entry(Section::Nodes, node)?.value.as_ref()?;
    if value.text().is_some() {
        return Some(false);
    }
    let kind = cx.file.word(value)?;
    if is_use(kind) {
        return Some(cx.used(node)?.entry(Section::Outputs, name).is_some());
    }
    Some(cx.kind(kind)?.outputs.iter().any(|output| output.name == name || output.former == Some(name)))
}
