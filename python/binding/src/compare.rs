//! The differences between two pictures.
use crate::diagnostics::exception;
use crate::photo::Photo;
use crate::wait;
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use shibo_bridge::compare as bridge;
use shibo_engine::session::Failure;

/// The differences of `a` from `b`, as JSON.
#[pyfunction]
#[pyo3(signature = (a, b, *, width_mm=None, width_mm_b=None))]
pub(crate) fn compare(
    py: Python<'_>,
    a: Photo<'_>,
    b: Photo<'_>,
    width_mm: Option<f64>,
    width_mm_b: Option<f64>,
) -> PyResult<String> {
    let request = bridge::CompareRequest { width_mm_a: width_mm, width_mm_b };
    let ((a, _), (b, _)) = (a.picture(py)?, b.picture(py)?);
    let (found, _) = wait::for_result(py, None, |_, _| bridge::compare(&a, &b, &request).map_err(Failure::Usage))?;
    let found = found.map_err(|failure| exception(py, failure.to_string(), Vec::new()))?;
    serde_json::to_string(&found).map_err(|error| PyRuntimeError::new_err(error.to_string()))
}
