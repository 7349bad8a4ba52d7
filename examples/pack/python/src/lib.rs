//! The extension module of the Python package `shibo` with the nodes of the pack. Copy the library beside the package's Python
//! files as `shibo/_shibo.abi3.so`, in place of Shibo's own.
use pyo3::prelude::*;

/// The package's extension module.
#[pymodule]
fn _shibo(module: &Bound<'_, PyModule>) -> PyResult<()> {
    shibo_python_binding::fill(module, shibo_example_pack::registry)
}
