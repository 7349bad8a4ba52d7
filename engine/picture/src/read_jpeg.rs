//! JPEG, decoded by the `image` crate, with the checks that the crate leaves to its callers.
mod markers;
mod profile;
mod tables;

use super::guard::guarded;
use super::limits::{ReadError, ReadLimits};
use super::raster::{from_image, header_of, limited, picture, samples};
use super::turn::{upright, upright_header};
use super::{FileFormat, Header, Picture};
use image::ImageDecoder;
use image::codecs::jpeg::JpegDecoder;
use image::metadata::Orientation;
use std::io::{BufRead, Cursor, Seek};

/// A block of 64 pixels takes at least one bit, and with three subsampled planes two planes are a quarter of the size.
const PIXELS_PER_BYTE: u64 = 8 * 64 * 2;

pub(super) fn header<R: BufRead + Seek>(mut reader: R) -> Result<Header, ReadError> {
    let mut bytes = Vec::new();
    reader.read_to_end(&mut bytes).map_err(ReadError::Io)?;
    guarded(|| look(&bytes)).map(|(header, _)| header)
}

pub(super) fn check(bytes: &[u8], limits: &ReadLimits) -> Result<Header, ReadError> {
    checked(bytes, limits).map(|(header, _)| header)
}

pub(super) fn read(bytes: &[u8], limits: &ReadLimits) -> Result<Picture, ReadError> {
    let (header, orientation) = checked(bytes, limits)?;
    let bytes = samples(|| JpegDecoder::new(Cursor::new(bytes)).map_err(from_image))?;
    upright(picture(&bytes, header), orientation)
}

/// Checks a JPEG embedded in a picture of another format: its width, its minimum height and its number of channels must
/// match.
pub(super) fn check_part(bytes: &[u8], frame: (u32, u32), channels: usize) -> Result<(), ReadError> {
    markers::walk(bytes)?;
    guarded(|| part(bytes, frame, channels).map(|_| ()))
}

/// The samples of a JPEG that passed [`check_part`]; there may be extra rows.
pub(super) fn read_part(bytes: &[u8], frame: (u32, u32), channels: usize) -> Result<Vec<u8>, ReadError> {
    samples(|| part(bytes, frame, channels))
}

fn part(bytes: &[u8], (wide, rows): (u32, u32), channels: usize) -> Result<JpegDecoder<Cursor<&[u8]>>, ReadError> {
    let decoder = JpegDecoder::new(Cursor::new(bytes)).map_err(from_image)?;
    let header = header_of(&decoder, FileFormat::Jpeg)?;
    check_size(&header, bytes)?;
    let Header { width, height, channels: found, .. } = header;
    if width != wide || height < rows || usize::from(found) != channels {
        let message = format!(
            "a part of it has `{width}x{height}` pixels and {found} channels; it must have `{wide}x{rows}` and {channels}"
        );
        return Err(ReadError::corrupt(message));
    }
    Ok(decoder)
}

fn checked(bytes: &[u8], limits: &ReadLimits) -> Result<(Header, Orientation), ReadError> {
    markers::walk(bytes)?;
    let (header, orientation) = guarded(|| look(bytes))?;
    // A progressive file is decoded through 16-bit coefficients.
    limits.check(limited(&header, 3))?;
    check_size(&header, bytes)?;
    Ok((header, orientation))
}

/// Compares the number of pixels in a header with the maximum that the file can hold.
fn check_size(header: &Header, bytes: &[u8]) -> Result<(), ReadError> {
    let pixels = u64::from(header.width) * u64::from(header.height);
    if pixels > (bytes.len() as u64).saturating_mul(PIXELS_PER_BYTE) {
        return Err(ReadError::implausible(bytes.len() as u64, header.width, header.height));
    }
    Ok(())
}

/// The header of the upright picture, and the orientation of the stored one.
fn look(bytes: &[u8]) -> Result<(Header, Orientation), ReadError> {
    let mut decoder = JpegDecoder::new(Cursor::new(bytes)).map_err(from_image)?;
    let mut header = header_of(&decoder, FileFormat::Jpeg)?;
    let orientation = decoder.orientation().map_err(from_image)?;
    match profile::find(bytes) {
        Ok(profile) => header.icc = profile,
        Err(why) => header.told.broken_profile = Some(why),
    }
    Ok((upright_header(header, orientation), orientation))
}
