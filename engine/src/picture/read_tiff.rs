//! TIFF, decoded by the `tiff` crate.

use super::limits::{Claim, ReadError, ReadLimits};
use super::read::planar;
use super::{FileFormat, Header, Picture, SampleKind, default_names};
use half::f16;
use std::io::{Cursor, Read, Seek};
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::tags::{SampleFormat, Tag};
use tiff::{ColorType, TiffError};

/// LZW, the densest of the methods, makes at most 4096 bytes of 12 bits.
const BEST_RATIO: u64 = 4096;

const INSTEAD: &str = "save it as grey or RGB with 8 or 16 bits or 32-bit floats";

/// What the tags say.
struct Layout {
    header: Header,
    color: ColorType,
    /// Channels in the file, before a palette is applied.
    stored_channels: u64,
    /// Whether the file stores a plane after the other.
    planes_apart: bool,
}

pub(super) fn header<R: Read + Seek>(reader: R) -> Result<Header, ReadError> {
    let mut decoder = Decoder::new(reader).map_err(from_tiff)?;
    Ok(layout(&mut decoder)?.header)
}

pub(super) fn read(bytes: &[u8], limits: &ReadLimits) -> Result<Picture, ReadError> {
    let mut decoder = Decoder::new(Cursor::new(bytes)).map_err(from_tiff)?;
    let layout = layout(&mut decoder)?;
    let Header { width, height, channels, kind, .. } = layout.header;
    let (wide, high) = (u64::from(width), u64::from(height));
    let sample_bytes = kind.bytes() as u64;
    let decoded = layout.stored_channels.max(u64::from(channels));
    limits.check(Claim { width: wide, height: high, channels: decoded, sample_bytes })?;
    let needed = wide * high * layout.stored_channels * sample_bytes;
    check_strips(&mut decoder, bytes.len() as u64, needed)?;

    let needed = usize::try_from(needed).map_err(ReadError::corrupt)?;
    let mut decoder = decoder.with_limits(decoder_limits(needed, bytes.len()));
    let mut samples = DecodingResult::U8(Vec::new());
    let stored = decoder.read_image_to_buffer(&mut samples).map_err(from_tiff)?;
    if samples.as_buffer(0).as_bytes().len() < stored.complete_len {
        return Err(ReadError::corrupt("its planes do not fit its header"));
    }
    let planes = match layout.color {
        ColorType::Palette(_) => from_palette(&mut decoder, &samples)?,
        _ => planes_of(&samples, &layout)?,
    };
    let expected = usize::from(channels) * (width as usize) * (height as usize);
    if planes.len() != expected {
        return Err(ReadError::corrupt("it holds another number of samples than its header says"));
    }
    let Header { names, has_alpha, .. } = layout.header;
    Ok(Picture { width, height, channels, planes, source: kind, names, has_alpha })
}

fn decoder_limits(needed: usize, length: usize) -> Limits {
    let mut limits = Limits::default();
    limits.decoding_buffer_size = needed;
    // A tile may be larger than the picture, but not without end.
    limits.intermediate_buffer_size = needed.max(1 << 20).saturating_mul(2);
    limits.ifd_value_size = length;
    limits
}

fn layout<R: Read + Seek>(decoder: &mut Decoder<R>) -> Result<Layout, ReadError> {
    let (width, height) = decoder.dimensions().map_err(from_tiff)?;
    let color = decoder.colortype().map_err(from_tiff)?;
    let (stored_channels, channels) = match color {
        ColorType::Gray(_) => (1, 1),
        ColorType::GrayA(_) => (2, 2),
        ColorType::RGB(_) => (3, 3),
        ColorType::RGBA(_) => (4, 4),
        ColorType::YCbCr(_) => (3, 3),
        ColorType::Palette(8) => (1, 3),
        ColorType::Multiband { num_samples: n @ 1..=4, .. } => (u64::from(n), n.to_le_bytes()[0]),
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
    let header = Header { format: FileFormat::Tiff, width, height, channels, kind, names, has_alpha };
    Ok(Layout { header, color, stored_channels, planes_apart: planar == Some(2) && stored_channels > 1 })
}

/// Compares the places of the strips or tiles with the file: all of it must be there, and it must be enough.
fn check_strips(decoder: &mut Decoder<Cursor<&[u8]>>, length: u64, needed: u64) -> Result<(), ReadError> {
    let tiled = decoder.find_tag(Tag::TileOffsets).map_err(from_tiff)?.is_some();
    let (offsets, counts) =
        if tiled { (Tag::TileOffsets, Tag::TileByteCounts) } else { (Tag::StripOffsets, Tag::StripByteCounts) };
    let mut list = |tag| {
        let values = decoder.find_tag_unsigned_vec::<u64>(tag).map_err(from_tiff)?;
        values.ok_or_else(|| ReadError::corrupt("it does not say where its samples are"))
    };
    let (offsets, counts) = (list(offsets)?, list(counts)?);
    if offsets.len() != counts.len() {
        return Err(ReadError::corrupt("its strips have not as many places as lengths"));
    }
    let mut total = 0_u64;
    for (offset, count) in offsets.iter().zip(&counts) {
        if offset.saturating_add(*count) > length {
            return Err(ReadError::truncated("it ends within the picture"));
        }
        total = total.saturating_add(*count);
    }
    if needed > total.saturating_mul(BEST_RATIO) {
        return Err(ReadError::corrupt(format!("{length} bytes cannot hold the pixels of its header")));
    }
    Ok(())
}

fn planes_of(samples: &DecodingResult, layout: &Layout) -> Result<Vec<f32>, ReadError> {
    // Planes that are stored one after the other are one channel of so many more pixels.
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

fn from_palette(decoder: &mut Decoder<Cursor<&[u8]>>, samples: &DecodingResult) -> Result<Vec<f32>, ReadError> {
    let map = decoder.get_tag_u16_vec(Tag::ColorMap).map_err(from_tiff)?;
    let (DecodingResult::U8(indices), true) = (samples, map.len() >= 3 * 256) else {
        return Err(ReadError::corrupt("its palette is too short"));
    };
    // The map has 16 bits, but holds the 8 of the colours in its upper half.
    let color = |channel: usize, index: u8| f32::from(map[channel * 256 + usize::from(index)] >> 8) / 255.0;
    Ok((0..3).flat_map(|channel| indices.iter().map(move |index| color(channel, *index))).collect())
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
