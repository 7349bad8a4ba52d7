//! The extension module of the Python package `shibo`, with the nodes of Shibo.
use pyo3::prelude::*;

/// The package's extension module.
#[pymodule]
fn _shibo(module: &Bound<'_, PyModule>) -> PyResult<()> {
    shibo_python_binding::fill(module, shibo_library::registry)
}
