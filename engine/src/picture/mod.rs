//! Reading and writing pictures.
mod atomic;

pub use atomic::{AtomicFile, remove_stale_temporaries};

/// A file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub enum Format {
    /// Portable Network Graphics.
    Png,
    /// Tagged Image File Format.
    Tiff,
    /// OpenEXR.
    Exr,
}

/// The type of a sample in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
pub enum Depth {
    /// 8-bit integers.
    U8,
    /// 16-bit integers.
    U16,
    /// 16-bit floats.
    F16,
    /// 32-bit floats.
    F32,
}
