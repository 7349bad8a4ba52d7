//! Errors and warnings as Python objects.
use pyo3::create_exception;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;
use shibo_engine::session::Failure;
use shibo_value::diagnostics::{self as engine, Origin, SourceMap};
use std::fmt;

create_exception!(shibo, ShiboError, PyException, "A graph with errors, or a request that cannot be met.");

/// An error or a warning, with its place.
#[pyclass(frozen, get_all, module = "shibo", skip_from_py_object)]
#[derive(Clone, Debug)]
pub(crate) struct Diagnostic {
    /// The class of the error, such as `unknown-param`.
    code: String,
    /// The mistake and the valid values.
    message: String,
    /// The remedy.
    help: Option<String>,
    /// The file, or none for a value given by the program.
    file: Option<String>,
    /// The line, counted from 1.
    line: usize,
    /// The column, counted from 1.
    column: usize,
    /// True for a warning: the graph can be rendered.
    warning: bool,
}

#[pymethods]
impl Diagnostic {
    fn __str__(&self) -> String {
        self.to_string()
    }

    fn __repr__(&self) -> String {
        format!("<Diagnostic {}>", self.to_string().replace('\n', " "))
    }
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(file) = &self.file {
            write!(f, "{file}:{}:{}: ", self.line, self.column)?;
        }
        write!(f, "{}: {}", self.code, self.message)?;
        self.help.iter().try_for_each(|help| write!(f, "\n  help: {help}"))
    }
}

/// Converts diagnostics to Python objects.
pub(crate) fn all(diagnostics: &[engine::Diagnostic], sources: &SourceMap) -> Vec<Diagnostic> {
    let one = |diagnostic: &engine::Diagnostic| {
        let (file, span) = (diagnostic.span.file, diagnostic.span);
        let position = sources.position(file, span.start);
        Diagnostic {
            code: diagnostic.code.to_string(),
            message: diagnostic.message.clone(),
            help: diagnostic.help.clone(),
            file: matches!(sources.origin(file), Origin::File).then(|| sources.path(file).display().to_string()),
            line: position.line,
            column: position.column,
            warning: diagnostic.warning,
        }
    };
    diagnostics.iter().map(one).collect()
}

/// The exception for a graph with errors.
pub(crate) fn errors(py: Python<'_>, found: &[engine::Diagnostic], sources: &SourceMap) -> PyErr {
    let found: Vec<Diagnostic> = all(found, sources);
    let errors: Vec<String> = found.iter().filter(|d| !d.warning).map(ToString::to_string).collect();
    exception(py, errors.join("\n"), found)
}

/// An exception with a message and diagnostics.
pub(crate) fn exception(py: Python<'_>, message: String, found: Vec<Diagnostic>) -> PyErr {
    let error = ShiboError::new_err(message);
    match error.value(py).setattr("diagnostics", found) {
        Ok(()) => error,
        Err(other) => other,
    }
}

/// The exception for a failed request.
pub(crate) fn failed(py: Python<'_>, failure: Failure, sources: &SourceMap) -> PyErr {
    match failure {
        Failure::Errors(found) => errors(py, &found, sources),
        Failure::Cancelled => exception(py, "cancelled".to_owned(), Vec::new()),
        Failure::File(message) | Failure::Usage(message) => exception(py, message, Vec::new()),
    }
}
