//! Code lenses: actions shown above the line of an output or node.
use super::file::Section;
use super::structure::LISTED;
use super::world::Cx;
use std::ops::Range;

/// Action of a lens.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Act {
    /// Writes the pictures of an output.
    Render,
    /// Opens the page at an output.
    Preview,
    /// Shows a node on the page.
    Show,
}

/// A code lens.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Lens {
    /// Range of the name.
    pub range: Range<usize>,
    /// Action.
    pub act: Act,
    /// Name of the output or node.
    pub name: String,
}

/// The lenses of a file. Nodes of local graphs have none, because the page shows them where they are used.
pub fn lenses(cx: Cx<'_>) -> Vec<Lens> {
    let of = |section: Section, acts: &'static [Act]| {
        let keys = cx.file.entries(section).iter().filter_map(|item| item.key.as_ref());
        keys.take(LISTED).flat_map(move |key| {
            acts.iter().map(move |act| Lens { range: key.range.clone(), act: *act, name: key.name.clone() })
        })
    };
    of(Section::Nodes, &[Act::Show]).chain(of(Section::Outputs, &[Act::Render, Act::Preview])).collect()
}

/// Node of the entry at a position; for an output, the node that it shows.
pub fn node_at(cx: Cx<'_>, at: usize) -> Option<String> {
    match super::walk::trail(cx, at).entry()? {
        (Section::Nodes, item) => item.name().map(str::to_owned),
        (Section::Outputs, item) => {
            let value = item.value.as_ref()?;
            let from = value.text().or_else(|| cx.file.text_of(value, "from"))?;
            from.split('.').next().filter(|name| !name.starts_with('=')).map(str::to_owned)
        }
        _ => None,
    }
}
