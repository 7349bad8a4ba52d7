//! The classes and functions behind the Python package `shibo`, which documents them (`package/shibo/_shibo.pyi`). The crate of an
//! extension module has a few lines: Shibo's own (`python/`), and that of a pack of nodes (`examples/pack/python`).
mod compare;
mod diagnostics;
mod fit;
mod graph;
mod photo;
mod session;
mod values;
mod wait;

use pyo3::prelude::*;
use shibo_node::registry::Registry;
use std::path::PathBuf;
use std::sync::OnceLock;

/// Makes the registry of the sessions. A process loads one extension module of this name and so has one registry.
static REGISTRY: OnceLock<fn() -> Registry> = OnceLock::new();

/// Fills the extension module `_shibo`. `registry` makes the kinds of nodes. Modules with nodes of other crates call it
/// (`examples/pack/python`).
///
/// # Errors
///
/// Fails if Python cannot add a member.
pub fn fill(module: &Bound<'_, PyModule>, registry: fn() -> Registry) -> PyResult<()> {
    REGISTRY.get_or_init(|| registry);
    module.add("ShiboError", module.py().get_type::<diagnostics::ShiboError>())?;
    module.add_class::<diagnostics::Diagnostic>()?;
    module.add_class::<fit::Fit>()?;
    module.add_class::<graph::Graph>()?;
    module.add_class::<session::Session>()?;
    module.add_function(wrap_pyfunction!(check, module)?)?;
    module.add_function(wrap_pyfunction!(compare::compare, module)?)?;
    module.add_function(wrap_pyfunction!(graphs, module)?)?;
    module.add("VERSION", env!("CARGO_PKG_VERSION"))
}

/// The kinds of nodes of this process.
fn registry() -> Registry {
    REGISTRY.get_or_init(|| shibo_library::registry)()
}

/// Names of the shipped graphs, which load as `shibo:NAME`, without parts for other graphs.
#[pyfunction]
fn graphs() -> Vec<&'static str> {
    shibo_library::graphs().iter().filter(|graph| !graph.is_part()).map(|graph| graph.name).collect()
}

/// Errors and warnings of a graph file, without computing anything.
#[pyfunction]
fn check(path: PathBuf, session: &Bound<'_, session::Session>) -> Vec<diagnostics::Diagnostic> {
    let options = shibo_graph::LoadOptions {
        working_dir: std::env::current_dir().unwrap_or_default(),
        import_paths: session.get().tools.import_paths.clone(),
        ..shibo_graph::LoadOptions::default()
    };
    let loaded = session.get().inner.load(&path, &options);
    let mut found = loaded.diagnostics;
    found.extend(loaded.graph.iter().flat_map(|graph| graph.advice()));
    diagnostics::all(&found, &loaded.sources)
}
