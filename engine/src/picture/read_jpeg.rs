//! JPEG, decoded by the `image` crate, with the checks it leaves to its callers.
mod markers;
mod tables;

use super::guard::guarded;
use super::limits::{ReadError, ReadLimits};
use super::raster::{from_image, header_of, limited, picture, samples};
use super::{FileFormat, Header, Picture};
use image::codecs::jpeg::JpegDecoder;
use image::metadata::Orientation;
use image::{DynamicImage, GrayImage, ImageDecoder, RgbImage};
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
    Ok(picture(&upright(bytes, &header, orientation)?, header))
}

fn checked(bytes: &[u8], limits: &ReadLimits) -> Result<(Header, Orientation), ReadError> {
    markers::walk(bytes)?;
    let (header, orientation) = guarded(|| look(Cursor::new(bytes)))?;
    // A progressive file is decoded through 16-bit coefficients.
    limits.check(limited(&header, 3))?;
    let pixels = u64::from(header.width) * u64::from(header.height);
    if pixels > (bytes.len() as u64).saturating_mul(PIXELS_PER_BYTE) {
        return Err(ReadError::implausible(bytes.len() as u64, header.width, header.height));
    }
    Ok((header, orientation))
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

fn swaps_sides(orientation: Orientation) -> bool {
    use Orientation::{Rotate90, Rotate90FlipH, Rotate270, Rotate270FlipH};
    matches!(orientation, Rotate90 | Rotate270 | Rotate90FlipH | Rotate270FlipH)
}

/// Turns stored samples as the camera was held: EXIF tells which corner of the stored picture is the upper left one.
fn upright(bytes: Vec<u8>, header: &Header, orientation: Orientation) -> Result<Vec<u8>, ReadError> {
    if orientation == Orientation::NoTransforms {
        return Ok(bytes);
    }
    let (width, height) =
        if swaps_sides(orientation) { (header.height, header.width) } else { (header.width, header.height) };
    let stored = match header.channels {
        1 => GrayImage::from_raw(width, height, bytes).map(DynamicImage::ImageLuma8),
        _ => RgbImage::from_raw(width, height, bytes).map(DynamicImage::ImageRgb8),
    };
    let mut picture =
        stored.ok_or_else(|| ReadError::corrupt("it holds another number of samples than its header says"))?;
    picture.apply_orientation(orientation);
    Ok(picture.into_bytes())
}
