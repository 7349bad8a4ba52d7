//! Pictures that Python gives: files and arrays.
use crate::diagnostics::exception;
use numpy::{PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use shibo_picture::{Picture, ReadLimits, SampleKind, read};
use std::path::{Path, PathBuf};

/// A picture file, or an array (height, width) or (height, width, channels): bytes as shown on a screen, or floats as
/// `Graph.render` makes them.
#[derive(FromPyObject)]
pub(crate) enum Photo<'py> {
    Bytes(PyReadonlyArrayDyn<'py, u8>),
    Floats(PyReadonlyArrayDyn<'py, f32>),
    File(PathBuf),
}

impl Photo<'_> {
    /// The file.
    pub(crate) fn path(&self) -> Option<&Path> {
        match self {
            Self::File(path) => Some(path),
            _ => None,
        }
    }

    /// The picture, and how messages call it.
    pub(crate) fn picture(&self, py: Python<'_>) -> PyResult<(Picture, String)> {
        let made = match self {
            Self::File(path) => {
                let picture = py.detach(|| read(path, &ReadLimits::default()));
                let picture = picture.map_err(|error| exception(py, error.to_string(), Vec::new()))?;
                return Ok((picture, path.display().to_string()));
            }
            Self::Bytes(array) => {
                let bytes = array.as_array();
                picture(array.shape(), SampleKind::U8, bytes.iter().map(|byte| f32::from(*byte) / 255.0))?
            }
            Self::Floats(array) => {
                // A height or another number counts as it is; colours are linear.
                let kind = if array.shape().get(2).is_some_and(|count| *count >= 3) {
                    SampleKind::F32
                } else {
                    SampleKind::U16
                };
                picture(array.shape(), kind, array.as_array().iter().copied())?
            }
        };
        Ok((made, "the array".to_owned()))
    }
}

/// A picture of samples in the order of rows, columns and channels.
fn picture(shape: &[usize], source: SampleKind, samples: impl Iterator<Item = f32>) -> PyResult<Picture> {
    let wrong = || {
        let message = format!(
            "an array of shape {shape:?} is no picture; it must be (height, width), or (height, width, 1, 3 or 4)"
        );
        PyValueError::new_err(message)
    };
    let (height, width, channels) = match *shape {
        [height, width] => (height, width, 1),
        [height, width, channels @ (1 | 3 | 4)] => (height, width, channels),
        _ => return Err(wrong()),
    };
    let sizes = [u32::try_from(width), u32::try_from(height)];
    let ([Ok(width @ 1..), Ok(height @ 1..)], Ok(count)) = (sizes, u8::try_from(channels)) else { return Err(wrong()) };
    let mut planes = vec![Vec::with_capacity(width as usize * height as usize); channels];
    for (at, sample) in samples.enumerate() {
        planes[at % channels].push(sample);
    }
    let names = if channels == 1 { vec!["Y"] } else { ["R", "G", "B", "A"][..channels].to_vec() };
    Ok(Picture {
        width,
        height,
        channels: count,
        planes: planes.concat(),
        source,
        names: names.into_iter().map(ToOwned::to_owned).collect(),
        has_alpha: channels == 4,
    })
}
