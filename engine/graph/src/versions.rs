//! The version of its kind that a pinned node has. Source: LASTING §1.
use super::imports::LIBRARY;
use super::linked::{Graph, GraphNode};
use super::linker::Linker;
use super::part::SyntaxValue;
use crate::diagnostics::{Code, Diagnostic, Span};
use crate::node::changes::{Change, Look, Thing, Touches};
use std::path::Path;

impl Linker<'_> {
    /// The file whose pins count for the nodes of a new scope: its own, or that of the scope that uses it.
    pub(super) fn pinned_by(&self, doc: usize, user: Option<usize>) -> Option<usize> {
        if self.docs[doc].document.pins.is_some() { Some(doc) } else { self.scopes[user?].pinned_by }
    }

    /// The earlier version of its kind that a node must have. `None` for the newest, and after an error.
    pub(super) fn earlier_version(&mut self, flat: usize) -> Option<u32> {
        let node = &self.flats[flat];
        let (docs, info) = (self.docs, node.info?);
        let pins = docs[self.scopes[node.scope].pinned_by?].document.pins.as_ref()?;
        let changes = self.registry.changes();
        let version = pins.version(changes, &info.kind, info.version);
        let later = |line: &&Change| line.thing() == Thing::Kind(&info.kind) && line.version > version;
        let altering: Vec<&Change> =
            changes.since(0).filter(later).filter(|line| self.is_touched(flat, &line.touches)).collect();
        let new = altering.iter().find(|line| line.look == Look::Look)?;
        if self.registry.has_kept(&info.kind, version) {
            return Some(version);
        }
        let worst = altering.iter().map(|line| line.worst).fold(0.0, f64::max);
        let error = gone(&node.kind, (&info.kind, version, info.version), new, worst);
        self.report.push(error);
        self.flats[flat].good = false;
        None
    }

    /// True if a node is among the uses that a change can alter.
    fn is_touched(&self, flat: usize, touches: &Touches) -> bool {
        let node = &self.flats[flat];
        touches.includes(|field| node.field(field).map(|part| part.str()))
    }
}

impl Graph {
    /// The nodes that a change alters. A changed kind alters its nodes, unless they have an earlier version or the change
    /// does not touch them. A changed shipped graph alters the nodes in it.
    pub fn altered_by<'g>(&'g self, change: &'g Change) -> impl Iterator<Item = &'g GraphNode> {
        self.nodes.node_weights().filter(move |node| match change.thing() {
            Thing::Kind(kind) => {
                let text = |span: Span| self.sources.sources()[span.file.0].text.get(span.start..span.end);
                let written = |field: &str| node.fields.iter().find(|(name, _)| name == field);
                node.kind == kind
                    && node.node.version() >= change.version
                    && change.touches.includes(|field| written(field).map(|(_, span)| text(*span).unwrap_or_default()))
            }
            Thing::Graph(name) => {
                let inside = self.sources.path(node.span.file).strip_prefix(LIBRARY);
                inside.is_ok_and(|inside| inside.with_extension("") == Path::new(name))
            }
            Thing::All => true,
        })
    }
}

/// The error for a version that the program does not have.
fn gone(place: &SyntaxValue, (kind, version, now): (&str, u32, u32), new: &Change, worst: f64) -> Diagnostic {
    let message = format!("`{kind}` of version {version} is not in this program any more");
    let help =
        format!("`shibo migrate FILE` takes version {now}: {} (up to {:.0} % of full scale)", new.what, worst * 100.0);
    place.error(Code::ChangedKind, message).help(help)
}
