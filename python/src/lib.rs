//! The extension module behind the Python package `shibo`, which documents it (`package/shibo/__init__.pyi`).
mod diagnostics;
mod graph;
mod session;
mod values;
mod wait;

use pyo3::prelude::*;
use std::path::PathBuf;

/// The contents of the module.
#[pymodule]
mod _shibo {
    #[pymodule_export]
    use crate::diagnostics::{Diagnostic, ShiboError};
    #[pymodule_export]
    use crate::graph::Graph;
    #[pymodule_export]
    use crate::session::Session;
    #[pymodule_export]
    use crate::{check, graphs};

    #[pymodule_export]
    const VERSION: &str = env!("CARGO_PKG_VERSION");
}

/// Names of the shipped graphs, which load as `shibo:NAME`, without parts for other graphs.
#[pyfunction]
fn graphs() -> Vec<&'static str> {
    shibo_library::graphs().iter().filter(|graph| !graph.is_part()).map(|graph| graph.name).collect()
}

/// Errors and warnings of a graph file, without computing anything.
#[pyfunction]
fn check(path: PathBuf, session: &Bound<'_, session::Session>) -> Vec<diagnostics::Diagnostic> {
    let options = shibo_engine::graph::LoadOptions {
        working_dir: std::env::current_dir().unwrap_or_default(),
        import_paths: session.get().import_paths.clone(),
        ..shibo_engine::graph::LoadOptions::default()
    };
    let loaded = session.get().inner.load(&path, &options);
    let mut found = loaded.diagnostics;
    found.extend(loaded.graph.iter().flat_map(|graph| graph.advice()));
    diagnostics::all(&found, &loaded.sources)
}
