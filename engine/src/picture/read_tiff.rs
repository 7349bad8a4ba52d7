//! TIFF, decoded by the `tiff` crate.
mod places;

use super::guard::guarded;
use super::limits::{Claim, ReadError, ReadLimits};
use super::read::planar;
use super::{FileFormat, Header, Picture, SampleKind, Told, default_names};
use half::f16;
use std::io::{Cursor, Read, Seek};
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::tags::{SampleFormat, Tag};
use tiff::{ColorType, TiffError};

const INSTEAD: &str = "save it as grey or RGB with 8 or 16 bits or 32-bit floats";

/// What the tags say.
struct Layout {
    header: Header,
    color: ColorType,
    /// Whether the file stores a plane after the other.
    planes_apart: bool,
}

pub(super) fn header<R: Read + Seek>(reader: R) -> Result<Header, ReadError> {
    guarded(|| {
        let mut decoder = Decoder::new(reader).map_err(from_tiff)?;
        Ok(layout(&mut decoder)?.header)
    })
}

pub(super) fn check<R: Read + Seek>(reader: R, length: u64, limits: &ReadLimits) -> Result<Header, ReadError> {
    open(reader, length, limits).map(|(_, layout)| layout.header)
}

pub(super) fn read(bytes: &[u8], limits: &ReadLimits) -> Result<Picture, ReadError> {
    let (mut decoder, layout) = open(Cursor::new(bytes), bytes.len() as u64, limits)?;
    let samples = guarded(|| {
        let mut samples = DecodingResult::U8(Vec::new());
        let stored = decoder.read_image_to_buffer(&mut samples).map_err(|error| from_tiff(error).in_data())?;
        if samples.as_buffer(0).as_bytes().len() < stored.complete_len {
            return Err(ReadError::corrupt("its planes do not fit its header"));
        }
        Ok(samples)
    })?;
    let planes = planes_of(&samples, &layout)?;
    let Header { width, height, channels, kind, names, has_alpha, .. } = layout.header;
    if planes.len() != usize::from(channels) * (width as usize) * (height as usize) {
        return Err(ReadError::corrupt("it holds another number of samples than its header says"));
    }
    Ok(Picture { width, height, channels, planes, source: kind, names, has_alpha })
}

/// A decoder of a file of `length` bytes whose header and places were checked.
fn open<R: Read + Seek>(reader: R, length: u64, limits: &ReadLimits) -> Result<(Decoder<R>, Layout), ReadError> {
    guarded(|| {
        let mut decoder = Decoder::new(reader).map_err(from_tiff)?;
        let layout = layout(&mut decoder)?;
        let Header { width, height, channels, kind, .. } = layout.header;
        let (wide, high) = (u64::from(width), u64::from(height));
        let sample_bytes = kind.bytes() as u64;
        let channels = u64::from(channels);
        limits.check(Claim { width: wide, height: high, channels, sample_bytes })?;
        let needed = wide * high * channels * sample_bytes;
        places::check(&mut decoder, &layout, length, needed)?;
        let whole = |bytes: u64| usize::try_from(bytes).map_err(ReadError::corrupt);
        Ok((decoder.with_limits(decoder_limits(whole(needed)?, whole(length)?)), layout))
    })
}

fn decoder_limits(needed: usize, length: usize) -> Limits {
    let mut limits = Limits::default();
    limits.decoding_buffer_size = needed;
    // A tile may be larger than the picture, but not without end.
    limits.intermediate_buffer_size = places::most_of_a_chunk(needed);
    limits.ifd_value_size = length;
    limits
}

fn layout<R: Read + Seek>(decoder: &mut Decoder<R>) -> Result<Layout, ReadError> {
    let (width, height) = decoder.dimensions().map_err(from_tiff)?;
    let color = decoder.colortype().map_err(from_tiff)?;
    let channels = match color {
        ColorType::Gray(_) => 1,
        ColorType::GrayA(_) => 2,
        ColorType::RGB(_) => 3,
        ColorType::RGBA(_) => 4,
        ColorType::Multiband { num_samples: n @ 1..=4, .. } => n.to_le_bytes()[0],
        other => return Err(unsupported(format!("its colours are {other:?}"))),
    };
    let format = decoder.find_tag_unsigned_vec::<u16>(Tag::SampleFormat).map_err(from_tiff)?;
    let format = format
        .and_then(|formats| formats.first().copied())
        .map_or(SampleFormat::Uint, SampleFormat::from_u16_exhaustive);
    let kind = match (format, color.bit_depth()) {
        (SampleFormat::IEEEFP, 16) => SampleKind::F16,
        (SampleFormat::IEEEFP, 32) => SampleKind::F32,
        (SampleFormat::Uint, 8) => SampleKind::U8,
        (SampleFormat::Uint, 16) => SampleKind::U16,
        (SampleFormat::Uint, 32) => SampleKind::U32,
        (format, bits) => return Err(unsupported(format!("its samples are {format:?} of {bits} bits"))),
    };
    let planar = decoder.find_tag_unsigned::<u16>(Tag::PlanarConfiguration).map_err(from_tiff)?;
    let names = default_names(channels);
    let has_alpha = matches!(channels, 2 | 4);
    let icc = decoder.find_tag(Tag::IccProfile).ok().flatten().and_then(|tag| tag.into_u8_vec().ok());
    let (associated, told) = (false, Told::default());
    let format = FileFormat::Tiff;
    let header = Header { format, width, height, channels, kind, names, has_alpha, icc, associated, told };
    Ok(Layout { header, color, planes_apart: planar == Some(2) && channels > 1 })
}

fn planes_of(samples: &DecodingResult, layout: &Layout) -> Result<Vec<f32>, ReadError> {
    // Planes that are stored one after the other are read as one channel with more pixels.
    let channels = if layout.planes_apart { 1 } else { usize::from(layout.header.channels) };
    Ok(match samples {
        DecodingResult::U8(samples) => planar(samples, channels, |sample| f32::from(sample) / 255.0),
        DecodingResult::U16(samples) => planar(samples, channels, |sample| f32::from(sample) / 65535.0),
        DecodingResult::U32(samples) => planar(samples, channels, scaled_u32),
        DecodingResult::F16(samples) => planar(samples, channels, f16::to_f32),
        DecodingResult::F32(samples) => planar(samples, channels, |sample| sample),
        _ => return Err(unsupported("its samples are of an unusual kind".into())),
    })
}

#[expect(clippy::cast_possible_truncation, reason = "rounding to the precision of a sample is meant")]
fn scaled_u32(sample: u32) -> f32 {
    (f64::from(sample) / f64::from(u32::MAX)) as f32
}

fn unsupported(what: String) -> ReadError {
    ReadError::Unsupported { what, instead: INSTEAD }
}

fn from_tiff(error: TiffError) -> ReadError {
    match error {
        TiffError::IoError(error) => ReadError::from_decoder(&error),
        TiffError::UnsupportedError(error) => unsupported(error.to_string()),
        TiffError::LimitsExceeded | TiffError::IntSizeError => {
            ReadError::corrupt("a size in its header is larger than the file allows")
        }
        error => ReadError::corrupt(error),
    }
}
