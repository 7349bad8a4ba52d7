//! What went wrong, where, and what to do about it.
//!
//! Code that does not know the text returns a [`Problem`]; the graph, which does, turns it into a [`Diagnostic`] by
//! adding a [`Span`]. A [`SourceMap`] keeps the texts and turns spans into lines and columns.
mod source;
mod suggest;

pub use source::{FileId, Origin, Position, Source, SourceMap, Span};
pub use suggest::{did_you_mean, suggest};

use std::fmt;

macro_rules! codes {
    ($($(#[$doc:meta])* $name:ident = $text:literal,)*) => {
        /// The stable, kebab-case word that names a class of errors.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        #[non_exhaustive]
        pub enum Code { $($(#[$doc])* $name,)* }

        impl Code {
            /// All codes, in the order of their declaration.
            pub const ALL: &'static [Code] = &[$(Code::$name,)*];

            /// The word as printed.
            pub const fn as_str(self) -> &'static str {
                match self { $(Code::$name => $text,)* }
            }
        }
    };
}

codes! {
    /// The text is not RON.
    Syntax = "syntax",
    /// A node kind that does not exist.
    UnknownKind = "unknown-kind",
    /// A field (port or parameter) that its owner does not have.
    UnknownField = "unknown-field",
    /// A reference to a node that does not exist.
    UnknownNode = "unknown-node",
    /// A reference to an output that the node does not have.
    UnknownPort = "unknown-port",
    /// A choice that is not among those offered.
    UnknownVariant = "unknown-variant",
    /// A parameter that is not declared.
    UnknownParam = "unknown-param",
    /// An expression that cannot be evaluated.
    BadExpression = "bad-expression",
    /// A value of another type than wanted.
    TypeMismatch = "type-mismatch",
    /// A port that must be connected is not.
    MissingInput = "missing-input",
    /// The same key twice in one map or node.
    DuplicateKey = "duplicate-key",
    /// Nodes, or files, that need themselves.
    Cycle = "cycle",
    /// A number outside what is allowed.
    OutOfRange = "out-of-range",
    /// A number that is infinite or not a number.
    NotFinite = "not-finite",
    /// A file that does not exist.
    FileNotFound = "file-not-found",
    /// A file that cannot be used: a folder, unreadable, corrupt, of the wrong format.
    BadFile = "bad-file",
    /// More than a limit or the memory budget allows.
    TooLarge = "too-large",
    /// A file version that this program does not know.
    UnknownVersion = "unknown-version",
    /// A name that is not allowed.
    BadName = "bad-name",
    /// Values that contradict each other.
    BadValue = "bad-value",
    /// A simulation or computation that left the range of numbers.
    Diverged = "diverged",
    /// Worth knowing, not an error: used by warnings.
    Advice = "advice",
}

impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// Something wrong in a node or a value, reported by code that does not know its place in the text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// The class of the error.
    pub code: Code,
    /// The port or parameter at fault; the node itself if `None`.
    pub field: Option<String>,
    /// Which bytes of the field, if that is a text and a part of it is at fault.
    pub within: Option<std::ops::Range<usize>>,
    /// What is wrong and what must be, one line, lower case.
    pub message: String,
    /// What to do about it.
    pub help: Option<String>,
}

impl Problem {
    /// A problem of a whole node.
    pub fn new(code: Code, message: impl Into<String>) -> Self {
        Self { code, field: None, within: None, message: message.into(), help: None }
    }

    /// The same at the port or parameter `field`.
    #[must_use]
    pub fn at(mut self, field: impl Into<String>) -> Self {
        self.field = Some(field.into());
        self
    }

    /// The same at these bytes of the text that is its field.
    #[must_use]
    pub fn within(mut self, range: std::ops::Range<usize>) -> Self {
        self.within = Some(range);
        self
    }

    /// The same with advice.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Problem {}

/// A second place that belongs to a diagnostic.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Related {
    /// Where.
    pub span: Span,
    /// What is there.
    pub message: String,
}

/// An error, or a warning, at its place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// The class of the error.
    pub code: Code,
    /// Where; for a file that could not be read at all, an empty span in an empty text of that name.
    pub span: Span,
    /// What is wrong and what must be.
    pub message: String,
    /// What to do about it.
    pub help: Option<String>,
    /// Other places that matter.
    pub related: Vec<Related>,
    /// A warning does not fail a run.
    pub warning: bool,
    /// Whether the text ends where more should follow, as it does while a file is being written.
    pub unfinished: bool,
}

impl Diagnostic {
    /// An error at `span`.
    pub fn new(code: Code, span: Span, message: impl Into<String>) -> Self {
        let (help, related) = (None, Vec::new());
        Self { code, span, message: message.into(), help, related, warning: false, unfinished: false }
    }

    /// The located form of a problem.
    pub fn from_problem(problem: Problem, span: Span) -> Self {
        Self { help: problem.help, ..Self::new(problem.code, span, problem.message) }
    }

    /// The same with advice.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// The same with a second place.
    #[must_use]
    pub fn related(mut self, span: Span, message: impl Into<String>) -> Self {
        self.related.push(Related { span, message: message.into() });
        self
    }

    /// The same as a warning.
    #[must_use]
    pub fn as_warning(mut self) -> Self {
        self.warning = true;
        self
    }
}

/// Diagnostics as other programs read them: `{"errors": […], "warnings": […]}`.
pub fn to_json(diagnostics: &[Diagnostic], sources: &SourceMap) -> serde_json::Value {
    let entry = |diagnostic: &Diagnostic| {
        let span = diagnostic.span;
        let (start, end) = (sources.position(span.file, span.start), sources.position(span.file, span.end));
        let related = diagnostic.related.iter().map(|related| {
            let start = sources.position(related.span.file, related.span.start);
            serde_json::json!({
                "file": sources.path(related.span.file).to_string_lossy(),
                "line": start.line,
                "column": start.column,
                "message": related.message,
            })
        });
        serde_json::json!({
            "file": sources.path(span.file).to_string_lossy(),
            "line": start.line,
            "column": start.column,
            "end_line": end.line,
            "end_column": end.column,
            "code": diagnostic.code.as_str(),
            "message": diagnostic.message,
            "help": diagnostic.help,
            "related": related.collect::<Vec<_>>(),
        })
    };
    let of = |warning: bool| diagnostics.iter().filter(|d| d.warning == warning).map(entry).collect::<Vec<_>>();
    serde_json::json!({ "errors": of(false), "warnings": of(true) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn json_has_the_contract_form() {
        let mut map = SourceMap::default();
        let file = map.add("a.ron", "(a: 1,\n b: 2)");
        let span = |start, end| Span { file, start, end };
        let diagnostics = [
            Diagnostic::new(Code::DuplicateKey, span(8, 9), "twice").related(span(1, 2), "first"),
            Diagnostic::new(Code::Advice, span(0, 1), "hm").help("do").as_warning(),
        ];
        let json = to_json(&diagnostics, &map);
        let expected = serde_json::json!({
            "errors": [{
                "file": "a.ron", "line": 2, "column": 2, "end_line": 2, "end_column": 3, "code": "duplicate-key",
                "message": "twice", "help": null,
                "related": [{"file": "a.ron", "line": 1, "column": 2, "message": "first"}],
            }],
            "warnings": [{
                "file": "a.ron", "line": 1, "column": 1, "end_line": 1, "end_column": 2, "code": "advice",
                "message": "hm", "help": "do", "related": [],
            }],
        });
        assert_eq!(json, expected);
    }

    #[test]
    fn codes_are_unique() {
        let mut words: Vec<_> = Code::ALL.iter().map(|c| c.as_str()).collect();
        words.sort_unstable();
        words.dedup();
        assert_eq!(words.len(), Code::ALL.len());
    }
}
