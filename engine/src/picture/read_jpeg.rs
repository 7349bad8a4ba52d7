//! JPEG, decoded by the `image` crate, with the checks it leaves to its callers.
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

/// A block of 64 pixels takes a bit at least, and of three subsampled planes two are a quarter of the size.
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
    Ok(picture(&upright(bytes, &header, orientation)?, header))
}

fn checked(bytes: &[u8], limits: &ReadLimits) -> Result<(Header, Orientation), ReadError> {
    markers::walk(bytes)?;
    let (header, orientation) = guarded(|| look(bytes))?;
    // A progressive file is decoded through 16-bit coefficients.
    limits.check(limited(&header, 3))?;
    let pixels = u64::from(header.width) * u64::from(header.height);
    if pixels > (bytes.len() as u64).saturating_mul(PIXELS_PER_BYTE) {
        return Err(ReadError::implausible(bytes.len() as u64, header.width, header.height));
    }
    Ok((header, orientation))
}

/// The header of the upright picture, and how the stored one becomes upright.
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
