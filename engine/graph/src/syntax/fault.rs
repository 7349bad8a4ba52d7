//! Mistakes in a text that is not valid RON.
use crate::diagnostics::{Code, Diagnostic, FileId, Span};
use std::borrow::Cow;
use std::ops::Range;

/// A mistake in a text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SyntaxError {
    /// The place where it was noticed; an empty range at the end of the text.
    pub range: Range<usize>,
    /// [`Code::Syntax`], [`Code::TooLarge`] where brackets are nested too deep, or [`Code::Conflict`] at the marks of a
    /// merge.
    pub code: Code,
    /// The message, lower case.
    pub message: Cow<'static, str>,
    /// How to fix it.
    pub help: Option<&'static str>,
    /// The bracket that the mistake is about.
    pub bracket: Option<Range<usize>>,
    /// True if the text ends where more must follow, as it does while a file is being written.
    pub unfinished: bool,
    /// True if the closing quote of a string is missing.
    pub(super) torn: bool,
    /// True if it is a consequence of a preceding mistake in the same line, if there is one.
    pub(super) weak: bool,
}

impl SyntaxError {
    /// A mistake at `range`.
    pub(super) fn new(range: Range<usize>, message: impl Into<Cow<'static, str>>) -> Self {
        let (code, message) = (Code::Syntax, message.into());
        Self { range, code, message, help: None, bracket: None, unfinished: false, torn: false, weak: false }
    }

    /// The diagnostic of the mistake in a file.
    pub fn located(&self, file: FileId) -> Diagnostic {
        let span = |range: &Range<usize>| Span { file, start: range.start, end: range.end };
        let mut diagnostic = Diagnostic::new(self.code, span(&self.range), self.message.clone());
        diagnostic.help = self.help.map(str::to_owned);
        diagnostic.unfinished = self.unfinished;
        match &self.bracket {
            Some(bracket) => diagnostic.related(span(bracket), "this is the bracket"),
            None => diagnostic,
        }
    }

    /// Adds advice.
    pub(super) fn help(self, help: &'static str) -> Self {
        Self { help: Some(help), ..self }
    }

    /// Sets the bracket that the mistake is about.
    pub(super) fn bracket(self, range: Range<usize>) -> Self {
        Self { bracket: Some(range), ..self }
    }
}

/// Sorts the mistakes by position and drops consequences of other mistakes: a line with a missing quote is reported
/// once.
pub(super) fn settle(text: &str, mut faults: Vec<SyntaxError>) -> Vec<SyntaxError> {
    faults.sort_by_key(|fault| fault.range.start);
    // Of several mistakes at one place, the first causes the others.
    faults.dedup_by_key(|fault| fault.range.start);
    if faults.len() < 2 && !faults.iter().any(|fault| fault.torn) {
        return faults;
    }
    let breaks: Vec<usize> = text.match_indices('\n').map(|(at, _)| at).collect();
    let line = |at: usize| breaks.partition_point(|&newline| newline < at);
    if faults.iter().any(|fault| fault.torn) {
        faults = one_of_each_torn_line(text, &line, faults);
    }
    // The lines of the mistakes so far, in order.
    let mut told: Vec<usize> = Vec::new();
    faults.retain(|fault| {
        let at = line(fault.range.start);
        let bracket = fault.bracket.as_ref().filter(|_| !fault.unfinished).map(|bracket| line(bracket.start));
        let follows = (fault.weak && told.last() == Some(&at))
            || bracket.is_some_and(|line| line != at && told.binary_search(&line).is_ok());
        told.extend((told.last() != Some(&at)).then_some(at));
        !follows
    });
    // At the end of an unfinished text, the last incomplete item is not a separate mistake.
    if let [.., before, last] = &faults[..]
        && last.unfinished
        && before.range.end >= text.trim_end().len()
    {
        faults.remove(faults.len() - 2);
    }
    faults
}

fn one_of_each_torn_line(text: &str, line: &dyn Fn(usize) -> usize, faults: Vec<SyntaxError>) -> Vec<SyntaxError> {
    // Sorted like the mistakes.
    let mut torn: Vec<usize> = faults.iter().filter(|fault| fault.torn).map(|fault| line(fault.range.start)).collect();
    torn.dedup();
    let is_torn = |line: usize| torn.binary_search(&line).is_ok();
    let mut told = None;
    let mut kept = Vec::with_capacity(faults.len());
    for fault in faults {
        let at = line(fault.range.start);
        // The bracket's partner may be inside the string.
        let inside = fault.bracket.as_ref().is_some_and(|bracket| is_torn(line(bracket.start)));
        if inside && !fault.unfinished {
            continue;
        }
        if !is_torn(at) {
            kept.push(fault);
        } else if told != Some(at) {
            told = Some(at);
            let unfinished = text[fault.range.start..].find('\n').is_none();
            let missing = SyntaxError::new(fault.range, "a quote is missing in this line");
            let help = "a text begins and ends with `\"`, in the same line";
            kept.push(SyntaxError { torn: true, unfinished, ..missing.help(help) });
        }
    }
    kept
}
