//! Converts Python values to values of parameters.
use glam::UVec2;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyString};
use shibo_value::Resolution;

/// Names and values in the notation of the command line: RON, or bare text.
pub(crate) fn given(values: &Bound<'_, PyDict>) -> PyResult<Vec<(String, String)>> {
    values.iter().map(|(name, value)| Ok((name.extract()?, text(&value)?))).collect()
}

/// A value as RON; a string stays unquoted.
fn text(value: &Bound<'_, PyAny>) -> PyResult<String> {
    if let Ok(text) = value.cast::<PyString>() {
        return Ok(text.to_string());
    }
    // Tested before numbers, because a Python bool is a number too. NumPy bools are no `bool`, but extract as one.
    if value.is_instance_of::<PyBool>() || value.get_type().name()?.to_string().starts_with("bool") {
        return Ok(value.extract::<bool>()?.to_string());
    }
    if let Ok(path) = value.extract::<std::path::PathBuf>() {
        return Ok(path.to_string_lossy().into_owned());
    }
    if let Ok(whole) = value.extract::<i128>() {
        return Ok(whole.to_string());
    }
    if let Ok(number) = value.extract::<f64>() {
        return if number.is_finite() {
            Ok(format!("{number:?}"))
        } else {
            Err(PyValueError::new_err(format!("{number} is not a finite number")))
        };
    }
    if let Ok(items) = value.extract::<Vec<Bound<'_, PyAny>>>() {
        let items = items.iter().map(text).collect::<PyResult<Vec<_>>>()?;
        return Ok(format!("({})", items.join(", ")));
    }
    let found = value.get_type().name()?;
    Err(PyTypeError::new_err(format!(
        "a value is a number, a bool, a text, a path or a sequence of numbers, not {found}"
    )))
}

/// A number for the longer side, or width and height.
#[derive(FromPyObject)]
pub(crate) enum Pixels {
    Longer(u32),
    Exact((u32, u32)),
}

impl From<Pixels> for Resolution {
    fn from(pixels: Pixels) -> Self {
        match pixels {
            Pixels::Longer(longer) => Self::Longer(longer),
            Pixels::Exact((width, height)) => Self::Exact(UVec2::new(width, height)),
        }
    }
}
