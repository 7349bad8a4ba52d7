//! Errors and warnings: their message, place and remedy.
//!
//! Code without access to the text returns a [`Problem`]; the graph turns it into a [`Diagnostic`] by adding a
//! [`Span`]. A [`SourceMap`] keeps the texts and converts spans to lines and columns.
mod source;
mod suggest;

pub use source::{FileId, Origin, Position, Source, SourceMap, Span};
pub use suggest::{did_you_mean, shorten, suggest};

use std::fmt;

macro_rules! codes {
    ($($(#[$doc:meta])* $name:ident = $text:literal,)*) => {
        /// A stable kebab-case word that names a class of errors.
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
    /// Marks of a merge that left two versions of one place.
    Conflict = "conflict",
    /// A node kind that does not exist.
    UnknownKind = "unknown-kind",
    /// A field (port or parameter) that the node or section does not have.
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
    /// A value of the wrong type.
    TypeMismatch = "type-mismatch",
    /// A required port that is not connected.
    MissingInput = "missing-input",
    /// A key that occurs twice in one map or node.
    DuplicateKey = "duplicate-key",
    /// Nodes or files that depend on themselves.
    Cycle = "cycle",
    /// A number outside the allowed range.
    OutOfRange = "out-of-range",
    /// A number that is infinite or not a number.
    NotFinite = "not-finite",
    /// A file that does not exist.
    FileNotFound = "file-not-found",
    /// A file that cannot be used: a folder, unreadable, corrupt, of the wrong format.
    BadFile = "bad-file",
    /// A file that the graph may not read, because it is outside of the folders given for it.
    Outside = "outside",
    /// A size beyond a limit or the memory budget.
    TooLarge = "too-large",
    /// A file version that this program does not know.
    UnknownVersion = "unknown-version",
    /// A version of a kind that the program does not have any more.
    ChangedKind = "changed-kind",
    /// A name that is not allowed.
    BadName = "bad-name",
    /// Values that contradict each other.
    BadValue = "bad-value",
    /// A height deeper than a tool or a material allows.
    TooDeep = "too-deep",
    /// A body that needs more triangles than are allowed.
    OverBudget = "over-budget",
    /// A mesh that is not closed where a body is wanted.
    OpenMesh = "open-mesh",
    /// A body with a wall that is too thin.
    ThinWall = "thin-wall",
    /// A field that must repeat and does not.
    DoesNotTile = "does-not-tile",
    /// A simulation or computation that left the range of numbers.
    Diverged = "diverged",
    /// Useful advice, not an error; used by warnings.
    Advice = "advice",
}

impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// An error in a node or a value, reported by code that does not know its place in the text.
#[derive(Clone, Debug, PartialEq)]
pub struct Problem {
    /// The class of the error.
    pub code: Code,
    /// The faulty port or parameter; `None` for the node itself.
    pub field: Option<String>,
    /// The faulty bytes of the field, if it is a text and only a part of it is wrong.
    pub within: Option<std::ops::Range<usize>>,
    /// The fault and the requirement in one line, lower case.
    pub message: String,
    /// How to fix it.
    pub help: Option<String>,
    /// The place in space, in mm: on a mesh or a body, or on the canvas with z = 0.
    pub at_mm: Option<Box<[f64; 3]>>,
}

impl Problem {
    /// A problem of a whole node.
    pub fn new(code: Code, message: impl Into<String>) -> Self {
        Self { code, field: None, within: None, message: message.into(), help: None, at_mm: None }
    }

    /// Sets the port or parameter at fault.
    #[must_use]
    pub fn at(mut self, field: impl Into<String>) -> Self {
        self.field = Some(field.into());
        self
    }

    /// Sets the place in space, in mm.
    #[must_use]
    pub fn at_mm(mut self, at: [f64; 3]) -> Self {
        self.at_mm = Some(Box::new(at));
        self
    }

    /// Sets the faulty bytes of the field's text.
    #[must_use]
    pub fn within(mut self, range: std::ops::Range<usize>) -> Self {
        self.within = Some(range);
        self
    }

    /// Adds advice.
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

/// Another place that belongs to a diagnostic.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Related {
    /// The place.
    pub span: Span,
    /// Note about the place.
    pub message: String,
}

/// An error or a warning with its place.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// The class of the error.
    pub code: Code,
    /// The place; an empty span in an empty text of that name for a file that could not be read at all.
    pub span: Span,
    /// The fault and the requirement.
    pub message: String,
    /// How to fix it.
    pub help: Option<String>,
    /// Other relevant places.
    pub related: Vec<Related>,
    /// True for a warning, which does not fail a run.
    pub warning: bool,
    /// True if the text ends where more must follow, as it does while a file is being written.
    pub unfinished: bool,
}

impl Diagnostic {
    /// An error at `span`.
    pub fn new(code: Code, span: Span, message: impl Into<String>) -> Self {
        let (help, related) = (None, Vec::new());
        Self { code, span, message: message.into(), help, related, warning: false, unfinished: false }
    }

    /// The problem with its place in a text.
    pub fn from_problem(problem: Problem, span: Span) -> Self {
        Self { help: problem.help, ..Self::new(problem.code, span, problem.message) }
    }

    /// Adds advice.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// Adds another place.
    #[must_use]
    pub fn related(mut self, span: Span, message: impl Into<String>) -> Self {
        self.related.push(Related { span, message: message.into() });
        self
    }

    /// Turns the diagnostic into a warning.
    #[must_use]
    pub fn as_warning(mut self) -> Self {
        self.warning = true;
        self
    }
}

/// Diagnostics in the form that other programs read: `{"errors": […], "warnings": […]}`.
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
    fn writes_the_documented_json_form() {
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
