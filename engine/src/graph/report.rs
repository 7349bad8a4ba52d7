//! Where diagnostics are gathered.
use crate::diagnostics::{Code, Diagnostic, Span};
use std::collections::{BTreeMap, BTreeSet};

/// The diagnostics of a run. What a sub-graph that is used several times says several times is kept once.
#[derive(Default)]
pub(super) struct Report {
    diagnostics: Vec<Diagnostic>,
    said: BTreeSet<(Code, Span, String)>,
    /// Which instance of a graph was the first to say something of a place.
    first: BTreeMap<(Code, Span), usize>,
    instance: usize,
    /// Where the current sub-graph is used.
    used: Option<Span>,
    errors: usize,
}

impl Report {
    /// What follows is about instance number `instance` of a graph, which is used at `used`.
    pub(super) fn enter(&mut self, instance: usize, used: Option<Span>) {
        self.instance = instance;
        self.used = used;
    }

    /// Adds a diagnostic unless it was said before.
    pub(super) fn push(&mut self, mut diagnostic: Diagnostic) {
        // What is wrong must count even where it was said before.
        self.errors += usize::from(!diagnostic.warning);
        let place = (diagnostic.code, diagnostic.span);
        let first = *self.first.entry(place).or_insert(self.instance);
        if first != self.instance || !self.said.insert((place.0, place.1, diagnostic.message.clone())) {
            return;
        }
        if let Some(used) = self.used.filter(|used| used.file != diagnostic.span.file) {
            diagnostic = diagnostic.related(used, "the graph is used here");
        }
        self.diagnostics.push(diagnostic);
    }

    /// How many errors there were so far, repeated ones included.
    pub(super) fn errors(&self) -> usize {
        self.errors
    }

    /// All diagnostics in the order of the text.
    pub(super) fn finish(mut self) -> Vec<Diagnostic> {
        self.diagnostics.sort_by_key(|d| (d.span.file, d.span.start, d.span.end, d.code));
        self.diagnostics
    }
}
