//! JPEG, decoded by the `image` crate, with the checks it leaves to its callers.
mod markers;
mod tables;

use super::guard::guarded;
use super::limits::{ReadError, ReadLimits};
use super::raster::{from_image, header_of, limited, picture, samples, swaps_sides, upright};
use super::{FileFormat, Header, Picture};
use image::ImageDecoder;
use image::codecs::jpeg::JpegDecoder;
use image::metadata::Orientation;
use std::io::{BufRead, Cursor, Seek};

/// A block of 64 pixels takes a bit at least, and of three subsampled planes two are a quarter of the size.
const PIXELS_PER_BYTE: u64 = 8 * 64 * 2;

pub(super) fn header<R: BufRead + Seek>(reader: R) -> Result<Header, ReadError> {
    guarded(|| look(reader)).map(|(header, _)| header)
}

pub(super) fn check(bytes: &[u8], limits: &ReadLimits) -> Result<Header, ReadError> {
    checked(bytes, limits).map(|(header, _)| header)
}

pub(super) fn read(bytes: &[u8], limits: &ReadLimits) -> Result<Picture, ReadError> {
    let (header, orientation) = checked(bytes, limits)?;
    let bytes = samples(|| JpegDecoder::new(Cursor::new(bytes)).map_err(from_image))?;
    let picture = picture(&bytes, header);
    let (width, height) = (picture.width, picture.height);
    let stored = if swaps_sides(orientation) { (height, width) } else { (width, height) };
    Ok(Picture { planes: upright(picture.planes, stored, orientation)?, ..picture })
}

/// Checks a JPEG that is a part of a picture of another format: so wide, of so many rows at least, and of so many channels.
pub(super) fn check_part(bytes: &[u8], frame: (u32, u32), channels: usize) -> Result<(), ReadError> {
    markers::walk(bytes)?;
    guarded(|| part(bytes, frame, channels).map(|_| ()))
}

/// The samples of a JPEG that [`check_part`] takes; there may be more rows.
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
    let (header, orientation) = guarded(|| look(Cursor::new(bytes)))?;
    // A progressive file is decoded through 16-bit coefficients.
    limits.check(limited(&header, 3))?;
    check_size(&header, bytes)?;
    Ok((header, orientation))
}

/// Compares the pixels of a header with those that the file can hold.
fn check_size(header: &Header, bytes: &[u8]) -> Result<(), ReadError> {
    let pixels = u64::from(header.width) * u64::from(header.height);
    if pixels > (bytes.len() as u64).saturating_mul(PIXELS_PER_BYTE) {
        return Err(ReadError::implausible(bytes.len() as u64, header.width, header.height));
    }
    Ok(())
}

/// The header of the upright picture, and how the stored one becomes upright.
fn look<R: BufRead + Seek>(reader: R) -> Result<(Header, Orientation), ReadError> {
    let mut decoder = JpegDecoder::new(reader).map_err(from_image)?;
    let header = header_of(&decoder, FileFormat::Jpeg)?;
    let orientation = decoder.orientation().map_err(from_image)?;
    let (width, height) = (header.width, header.height);
    Ok(match swaps_sides(orientation) {
        true => (Header { width: height, height: width, ..header }, orientation),
        false => (header, orientation),
    })
}
