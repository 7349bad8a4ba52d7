//! The versions of kinds and of shipped graphs that a pinned graph has. Source: LASTING §1.
use super::imports::{self, LIBRARY};
use super::linked::{Graph, GraphNode};
use super::linker::Linker;
use super::params::Params;
use super::part::{Entry, SyntaxValue};
use crate::diagnostics::{Code, Diagnostic, Span};
use crate::node::changes::{Change, Look, Thing, Touches};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

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
        let (version, held) = pins.version(changes, &info.kind, info.version);
        let later = |line: &&Change| line.thing() == Thing::Kind(&info.kind) && line.version > version;
        let altering: Vec<&Change> =
            changes.since(0).filter(later).filter(|line| self.is_touched(flat, &line.touches)).collect();
        let error = gone(self.place(node.scope, &node.kind), (&info.kind, version, info.version), &altering, held)?;
        if self.registry.has_kept(&info.kind, version) {
            return Some(version);
        }
        self.report.push(error);
        self.flats[flat].good = false;
        None
    }

    /// Returns true if the text of a document that is used in a scope is the one that the pins there mean; reports an error
    /// if not. The program has only the newest texts of shipped graphs. `kind` is the word `Use` or `Each`; the last
    /// argument holds the values that the graph is given.
    pub(super) fn is_as_pinned(
        &mut self,
        scope: usize,
        kind: &SyntaxValue,
        doc: usize,
        (with, params): (&[Entry], &Params),
    ) -> bool {
        let docs = self.docs;
        let user = &self.scopes[scope];
        // A graph that is defined in a shipped file has the version of that file.
        if docs[user.doc].path == docs[doc].path {
            return true;
        }
        let written = |field: &str| match params.is_given(field).then(|| params.get(field).flatten()) {
            Some(Some(value)) => Some(value.text.as_str()),
            // An error hides the value: it may be any.
            Some(None) => Some("$"),
            None => with.iter().find(|entry| entry.name == field).map(|entry| entry.value.str()),
        };
        let error = self.later(user.pinned_by, doc, self.place(scope, kind), written);
        let is_kept = error.is_none();
        error.into_iter().for_each(|error| self.report.push(error));
        is_kept
    }

    /// Reports the functions of shipped graphs that a scope calls and that changed after the pins there.
    pub(super) fn check_calls(&mut self, scope: usize) {
        let docs = self.docs;
        for call in &docs[self.scopes[scope].doc].calls {
            let user = &self.scopes[scope];
            let (pins, place) = (call.pinned_by.or(user.pinned_by), user.own_place.unwrap_or(call.place));
            let error = self.later(pins, call.doc, place, |_| None);
            error.into_iter().for_each(|error| self.report.push(error));
        }
    }

    /// The error at `place` if the text of a shipped graph is later than the one that the pins of a file mean. `written` gives the
    /// text of each value that the graph is given.
    fn later<'t>(
        &self,
        pinned_by: Option<usize>,
        doc: usize,
        place: Span,
        written: impl Fn(&str) -> Option<&'t str>,
    ) -> Option<Diagnostic> {
        let pins = self.docs[pinned_by?].document.pins.as_ref()?;
        let inside = imports::within(&self.docs[doc].path)?;
        let inside = Path::new(&inside).with_extension("");
        let is_later = |line: &&Change| matches!(line.thing(), Thing::Graph(name) if inside == Path::new(name));
        let later: Vec<&Change> = self.registry.changes().since(pins.change()).filter(is_later).collect();
        let versions = (later.first()?.version.saturating_sub(1), later.last()?.version);
        let altering: Vec<&Change> = later.into_iter().filter(|line| line.touches.includes(&written)).collect();
        let name = inside.file_name().unwrap_or_default().to_string_lossy();
        gone(place, (&format!("{LIBRARY}{name}"), versions.0, versions.1), &altering, None)
    }

    /// The formulas in use that call a function of a shipped graph, and that graph.
    pub(super) fn calls(&self) -> Vec<(Span, PathBuf)> {
        let used: BTreeSet<usize> = self.scopes.iter().map(|scope| scope.doc).collect();
        let calls = used.into_iter().flat_map(|doc| &self.docs[doc].calls);
        calls.map(|call| (call.from, self.docs[call.doc].path.clone())).collect()
    }

    /// The place for an error about the pins: that of a word, or for a word in a shipped graph, the use of that graph.
    fn place(&self, scope: usize, word: &SyntaxValue) -> Span {
        self.scopes[scope].own_place.unwrap_or_else(|| word.span())
    }

    /// True if a node is among the uses that a change can alter.
    fn is_touched(&self, flat: usize, touches: &Touches) -> bool {
        let node = &self.flats[flat];
        touches.includes(|field| node.field(field).map(|part| part.str()))
    }
}

impl Graph {
    /// The nodes that a change alters. A changed kind alters its nodes, unless they have an earlier version or the change
    /// does not touch them. A changed shipped graph alters the nodes in it, and those with a formula that calls its functions; all
    /// nodes if that formula is a value of no node, such as the default of a parameter.
    pub fn altered_by<'g>(&'g self, change: &'g Change) -> impl Iterator<Item = &'g GraphNode> {
        let is_changed = move |path: &Path| {
            let inside = path.strip_prefix(LIBRARY).map(|inside| inside.with_extension(""));
            matches!((change.thing(), inside), (Thing::Graph(name), Ok(inside)) if inside == Path::new(name))
        };
        let calls = self.calls.iter().filter(move |(_, path)| is_changed(path)).map(|(place, _)| *place);
        let calls: Vec<Span> = calls.collect();
        let has = |node: &GraphNode, call: &Span| {
            node.span == *call || node.fields.iter().any(|(_, field)| holds(field, call))
        };
        let is_of_none = |call: &Span| !self.nodes.node_weights().any(|node| has(node, call));
        let alters_all = calls.iter().any(is_of_none);
        self.nodes.node_weights().filter(move |node| match change.thing() {
            Thing::Kind(_) => node.node.version() >= change.version && self.is_of(node, change),
            Thing::Graph(_) => {
                let is_inside = is_changed(self.sources.path(node.span.file));
                is_inside || alters_all || calls.iter().any(|call| has(node, call))
            }
            Thing::All => true,
        })
    }

    /// The nodes that a change of their kind would alter if they did not have an earlier version.
    pub fn kept_from<'g>(&'g self, change: &'g Change) -> impl Iterator<Item = &'g GraphNode> {
        let is_kept = move |node: &&GraphNode| node.node.version() < change.version && self.is_of(node, change);
        self.nodes.node_weights().filter(is_kept)
    }

    /// True if a change is about the kind of a node, and touches the node.
    fn is_of(&self, node: &GraphNode, change: &Change) -> bool {
        let text = |span: Span| self.sources.sources()[span.file.0].text.get(span.start..span.end);
        let written = |field: &str| node.fields.iter().find(|(name, _)| name == field);
        change.thing() == Thing::Kind(&node.kind)
            && change.touches.includes(|field| written(field).map(|(_, span)| text(*span).unwrap_or_default()))
    }
}

/// True if a place lies in another one.
fn holds(outer: &Span, inner: &Span) -> bool {
    outer.file == inner.file && outer.start <= inner.start && inner.end <= outer.end
}

/// The error for a version of a thing that the program does not have. `None` if no change since then alters the look.
fn gone(
    place: Span,
    (thing, version, now): (&str, u32, u32),
    altering: &[&Change],
    held: Option<Span>,
) -> Option<Diagnostic> {
    let new = altering.iter().find(|line| line.look == Look::Look)?;
    let difference = new.difference(altering.iter().map(|line| line.worst).fold(0.0, f64::max));
    let message = format!("`{thing}` of version {version} is not in this program any more");
    let error = Diagnostic::new(Code::ChangedKind, place, message);
    Some(match held {
        Some(hold) => error
            .help(format!("remove `{thing}` from `hold` of the pins to take version {now}: {difference}"))
            .related(hold, "the version is held here"),
        None => error.help(format!("`shibo migrate FILE` takes version {now}: {difference}")),
    })
}
