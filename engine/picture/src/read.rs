//! Reading whole pictures.

use super::header::{FileFormat, load, position, sniff};
use super::limits::{FileError, ReadError, ReadLimits};
use super::{Picture, read_exr, read_hdr, read_jpeg, read_png, read_tiff};
use crate::value::files::FileHandle;

/// Reads a picture. Needs memory for the file, the stored samples and the `f32` samples at the same time.
///
/// From an EXR file with many channels, the best match is read: the first layer with colours (`R`, `G`, `B`, with `A`),
/// else a vector (`X`, `Y`, `Z`), else luminance (`Y`), else the only channel, else the first channels, up to four.
///
/// # Errors
/// See [`ReadError`]; includes the path of the file.
pub fn read(file: impl Into<FileHandle>, limits: &ReadLimits) -> Result<Picture, FileError> {
    let file = file.into();
    let reading = load(&file, limits).and_then(|bytes| read_bytes(&bytes, limits));
    reading.map_err(|reason| FileError::of(&file, reason))
}

/// Like [`read`], but reads the named layer (`base_color` of `base_color.R` …) or the named channel (`height.Y`, `Z`)
/// of an EXR file. In other formats only the names of [`Picture::names`] exist; each selects one channel.
///
/// # Errors
/// See [`ReadError`]; includes the path of the file.
pub fn read_layer(file: impl Into<FileHandle>, layer: &str, limits: &ReadLimits) -> Result<Picture, FileError> {
    let file = file.into();
    let reading = load(&file, limits).and_then(|bytes| {
        if sniff(&bytes)? == FileFormat::Exr {
            return read_exr::read(&bytes, limits, Some(layer));
        }
        one_channel(read_bytes(&bytes, limits)?, layer)
    });
    reading.map_err(|reason| FileError::of(&file, reason))
}

/// Reads a picture from a file in memory.
///
/// # Errors
/// See [`ReadError`].
pub fn read_bytes(bytes: &[u8], limits: &ReadLimits) -> Result<Picture, ReadError> {
    match sniff(bytes)? {
        FileFormat::Png => read_png::read(bytes, limits),
        FileFormat::Jpeg => read_jpeg::read(bytes, limits),
        FileFormat::Tiff => read_tiff::read(bytes, limits),
        FileFormat::Exr => read_exr::read(bytes, limits, None),
        FileFormat::Hdr => read_hdr::read(bytes, limits),
    }
}

fn one_channel(mut picture: Picture, name: &str) -> Result<Picture, ReadError> {
    let channel = u8::try_from(position(&picture.names, name)?).expect("a picture has at most 4 channels");
    picture.planes = picture.plane(channel).to_vec();
    Ok(Picture { channels: 1, names: vec![name.to_owned()], has_alpha: false, ..picture })
}
