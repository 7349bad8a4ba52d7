//! Collects diagnostics.
use super::part::SyntaxValue;
use super::spared::Spared;
use crate::diagnostics::{Code, Diagnostic, FileId, Span, suggest};
use crate::syntax::Tree;
use std::cell::Cell;
use std::collections::{BTreeMap, BTreeSet};
use std::hash::{DefaultHasher, Hash, Hasher};

/// The most diagnostics of one file. More would not be read, and each one takes time.
const MOST: usize = 1000;
/// The most candidates compared with unknown words in one run; later words get no suggestion.
const COMPARED: usize = 500_000;

/// Reading the documentation of all kinds takes as long as this many comparisons of names.
const DOCUMENTATION: usize = 5_000;

/// The diagnostics of a run. A diagnostic repeated for every use of a sub-graph is kept once.
#[derive(Default)]
pub(super) struct Report {
    diagnostics: Vec<Diagnostic>,
    said: BTreeSet<(Code, Span, u64)>,
    /// The first instance of a graph that reported something at a place.
    first: BTreeMap<(Code, Span), usize>,
    /// The outside values for which an error was reported.
    values: BTreeSet<(Code, Span)>,
    files: BTreeMap<FileId, Count>,
    /// The consequences of syntax errors in a file.
    spared: BTreeMap<FileId, Spared>,
    instance: usize,
    /// The place where the current sub-graph is used.
    used: Option<Span>,
    errors: usize,
    compared: Cell<usize>,
    /// True to make no suggestions. The comparisons count as made, because some errors depend on their number.
    brief: bool,
}

/// The number of diagnostics of a file.
#[derive(Clone, Copy, Default)]
struct Count {
    errors: usize,
    warnings: usize,
    /// The number of omitted diagnostics; the place of the first, and whether errors are among them.
    left_out: usize,
    first: Option<Span>,
    has_errors: bool,
}

impl Count {
    fn leave_out(&mut self, diagnostic: &Diagnostic) {
        self.left_out += 1;
        self.first = Some(self.first.map_or(diagnostic.span, |first| first.min(diagnostic.span)));
        self.has_errors |= !diagnostic.warning;
    }
}

impl Report {
    /// An empty report; a brief one has no suggestions.
    pub(super) fn new(brief: bool) -> Self {
        Self { brief, ..Self::default() }
    }

    /// Sets the graph instance, used at `used`, that the following diagnostics are about.
    pub(super) fn enter(&mut self, instance: usize, used: Option<Span>) {
        self.instance = instance;
        self.used = used;
    }

    /// Suppresses the consequences of syntax errors in `file` from now on.
    pub(super) fn spare(&mut self, file: FileId, tree: &Tree) {
        if !tree.errors().is_empty() {
            self.spared.insert(file, Spared::by(tree));
        }
    }

    /// Adds a diagnostic unless it was reported before.
    pub(super) fn push(&mut self, mut diagnostic: Diagnostic) {
        // Count errors even if they were reported before.
        self.errors += usize::from(!diagnostic.warning);
        if self.spared.get(&diagnostic.span.file).is_some_and(|spared| spared.spares(&diagnostic)) {
            return;
        }
        let place = (diagnostic.code, diagnostic.span);
        let first = *self.first.entry(place).or_insert(self.instance);
        if first != self.instance || !self.said.insert((place.0, place.1, hash(&diagnostic.message))) {
            return;
        }
        let count = self.files.entry(diagnostic.span.file).or_default();
        let of_its_sort = if diagnostic.warning { &mut count.warnings } else { &mut count.errors };
        if *of_its_sort >= MOST {
            count.leave_out(&diagnostic);
            return;
        }
        *of_its_sort += 1;
        if let Some(used) = self.used.filter(|used| used.file != diagnostic.span.file) {
            diagnostic = diagnostic.related(used, "the graph is used here");
        }
        self.diagnostics.push(diagnostic);
    }

    /// Adds an error about the value at `part`. A value given from outside may be wrong in many places, but is reported
    /// once.
    pub(super) fn push_value(&mut self, part: &SyntaxValue, error: Diagnostic) {
        if part.is_given() && !self.values.insert((error.code, error.span)) {
            self.errors += 1;
            return;
        }
        self.push(error);
    }

    /// Adds an error about `word`, which is not one of `names`, with a suggestion.
    pub(super) fn unknown<'n>(
        &mut self,
        error: Diagnostic,
        word: &str,
        what: &str,
        names: impl IntoIterator<Item = &'n str>,
    ) {
        let error = self.with_suggestion(error, word, what, names);
        self.push(error);
    }

    /// Adds a suggestion to an error without reporting it.
    pub(super) fn with_suggestion<'n>(
        &self,
        error: Diagnostic,
        word: &str,
        what: &str,
        names: impl IntoIterator<Item = &'n str>,
    ) -> Diagnostic {
        match self.suggest(word, what, names) {
            Some(help) => error.help(help),
            None => error,
        }
    }

    /// The suggestion for a word that is not one of `names`. After many such words there are no more suggestions,
    /// because comparing every word with every name would take longer than everything else.
    pub(super) fn suggest<'n>(
        &self,
        word: &str,
        what: &str,
        names: impl IntoIterator<Item = &'n str>,
    ) -> Option<String> {
        if !self.may_compare(0) {
            return None;
        }
        let names: Vec<_> = names.into_iter().collect();
        self.may_compare(names.len());
        (!self.brief).then(|| suggest(word, what, &names))
    }

    /// Returns true if this many more comparisons are allowed, and counts them as made.
    pub(super) fn may_compare(&self, comparisons: usize) -> bool {
        let may = self.compared.get() < COMPARED;
        self.compared.set(self.compared.get() + if may { comparisons } else { 0 });
        may
    }

    /// Returns true if the documentation of all kinds may be read for a suggestion.
    pub(super) fn may_read(&self) -> bool {
        self.may_compare(DOCUMENTATION) && !self.brief
    }

    /// The number of errors so far, including repeated ones.
    pub(super) fn errors(&self) -> usize {
        self.errors
    }

    /// All diagnostics in the order of the text. If a file has too many, the last one states how many were left out.
    pub(super) fn finish(mut self) -> Vec<Diagnostic> {
        self.diagnostics.sort_by_key(|d| (d.span.file, d.span.start, d.span.end, d.code));
        let mut kept = Vec::with_capacity(self.diagnostics.len());
        for of_file in self.diagnostics.chunk_by(|a, b| a.span.file == b.span.file) {
            let count = of_file.first().and_then(|d| self.files.get(&d.span.file)).copied();
            keep(of_file, count.unwrap_or_default(), &mut kept);
        }
        kept
    }
}

/// Keeps the diagnostics of a file; if there are too many, errors before warnings.
fn keep(of_file: &[Diagnostic], mut count: Count, kept: &mut Vec<Diagnostic>) {
    if count.left_out == 0 && of_file.len() <= MOST {
        kept.extend_from_slice(of_file);
        return;
    }
    let mut room = (MOST - 1).saturating_sub(count.errors);
    let mut errors = MOST - 1;
    for diagnostic in of_file {
        let place = if diagnostic.warning { &mut room } else { &mut errors };
        if *place > 0 {
            *place -= 1;
            kept.push(diagnostic.clone());
        } else {
            count.leave_out(diagnostic);
        }
    }
    let Some(first) = count.first else { return };
    let message = format!("{} more of this file are not reported; the first of them is here", count.left_out);
    let mut rest = Diagnostic::new(Code::TooLarge, first, message).help("mend the others first");
    rest.warning = !count.has_errors;
    kept.push(rest);
}

fn hash(message: &str) -> u64 {
    let mut hasher = DefaultHasher::new();
    message.hash(&mut hasher);
    hasher.finish()
}
