//! What can be done with an output or a node, above its line.
use super::file::Section;
use super::world::Cx;
use std::ops::Range;

/// What a lens does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Act {
    /// Writes the pictures of an output.
    Render,
    /// Opens the page at an output.
    Preview,
    /// Shows a node on the page.
    Show,
}

/// A lens.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Lens {
    /// Where the name is.
    pub(crate) range: Range<usize>,
    /// What it does.
    pub(crate) act: Act,
    /// The name of the output or of the node.
    pub(crate) name: String,
}

/// The lenses of a file.
pub(crate) fn lenses(cx: Cx<'_>) -> Vec<Lens> {
    let of = |section: Section, acts: &'static [Act]| {
        cx.file.entries(section).iter().filter_map(|item| item.key.as_ref()).flat_map(move |key| {
            acts.iter().map(move |act| Lens { range: key.range.clone(), act: *act, name: key.name.clone() })
        })
    };
    of(Section::Nodes, &[Act::Show]).chain(of(Section::Outputs, &[Act::Render, Act::Preview])).collect()
}

/// The node of the entry that a place is in; of an output, the one that it shows.
pub(crate) fn node_at(cx: Cx<'_>, at: usize) -> Option<String> {
    match super::walk::trail(cx, at).entry()? {
        (Section::Nodes, item) => item.name().map(str::to_owned),
        (Section::Outputs, item) => {
            let value = item.value.as_ref()?;
            let from = value.text().or_else(|| cx.file.text_of(value, "from"))?;
            from.split('.').next().map(str::to_owned)
        }
        _ => None,
    }
}
