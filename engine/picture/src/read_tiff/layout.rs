//! The tags of a TIFF file that describe its samples.
use super::super::limits::ReadError;
use super::super::turn::upright_header;
use super::super::{FileFormat, Header, HeaderStatements, SampleKind, default_names};
use super::directory::Tags;
use super::unsupported;
use image::metadata::Orientation;
use std::io::{Read, Seek};
use tiff::tags::{CompressionMethod, PhotometricInterpretation as Meaning, Predictor, SampleFormat, Tag};

/// Maximum number of samples per pixel in a file; some may be unused.
const MOST_STORED: u16 = 64;

/// Maximum size of a colour profile in bytes. Profiles of printers have a few million.
const MOST_PROFILE: u64 = 16 << 20;

/// Maximum size in bytes of the tables of JPEG strips.
const MOST_TABLES: u64 = 1 << 16;

/// `ExtraSamples`: opacity with premultiplied colours, and opacity without.
const ASSOCIATED: u16 = 1;
const UNASSOCIATED: u16 = 2;

/// Layout of the samples.
pub(super) struct Layout {
    /// The header of the upright picture.
    pub(super) header: Header,
    /// Width and height before turning.
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) orientation: Orientation,
    pub(super) method: CompressionMethod,
    pub(super) predictor: Predictor,
    /// The bits of a sample.
    pub(super) bits: u16,
    /// Number of samples of a pixel; the first ones are the channels.
    pub(super) stored: u16,
    /// True if the planes are stored separately.
    pub(super) planes_apart: bool,
    /// True if 0 is white in a grey picture.
    pub(super) white_is_zero: bool,
    /// The colours of an indexed picture.
    pub(super) palette: Option<Vec<[f32; 3]>>,
    pub(super) is_big_endian: bool,
    /// True if the first pixel is in the lowest bit of a byte.
    pub(super) reversed: bool,
    /// True if JPEG samples are YCbCr.
    pub(super) is_ycbcr: bool,
    /// The tables shared by all JPEG strips or tiles.
    pub(super) tables: Option<Vec<u8>>,
}

impl Layout {
    pub(super) fn read<R: Read + Seek>(tags: &mut Tags<R>) -> Result<Self, ReadError> {
        let (width, height) = (tags.required::<u32>(Tag::ImageWidth)?, tags.required::<u32>(Tag::ImageLength)?);
        let method = CompressionMethod::from_u16_exhaustive(tags.number(Tag::Compression)?.unwrap_or(1));
        let stored: u16 = tags.number(Tag::SamplesPerPixel)?.unwrap_or(1);
        if stored == 0 || stored > MOST_STORED {
            return Err(unsupported(format!("it has {stored} channels")));
        }
        let meaning = tags.required::<u16>(Tag::PhotometricInterpretation)?;
        let meaning =
            Meaning::from_u16(meaning).ok_or_else(|| unsupported(format!("its colours are of the kind {meaning}")))?;
        let (kind, bits) = samples(tags)?;
        let planes_apart = tags.number::<u16>(Tag::PlanarConfiguration)? == Some(2) && stored > 1;
        let palette = if meaning == Meaning::RGBPalette { Some(palette(tags, (kind, bits, stored))?) } else { None };
        let is_jpeg = method == CompressionMethod::ModernJPEG;
        let is_ycbcr = meaning == Meaning::YCbCr;
        if is_ycbcr && (!is_jpeg || planes_apart || stored != 3) {
            return Err(unsupported("its colours are YCbCr and not packed as JPEG".into()));
        }
        let together = if planes_apart { 1 } else { stored };
        if is_jpeg && ((bits, kind) != (8, SampleKind::U8) || palette.is_some() || !matches!(together, 1 | 3)) {
            return Err(unsupported(format!("it is packed as JPEG with {stored} channels of {bits} bits")));
        }
        let extra: Vec<u16> = tags.numbers(Tag::ExtraSamples)?.unwrap_or_default();
        let (channels, has_alpha) = channels(meaning, stored, &extra)?;
        let white_is_zero = meaning == Meaning::WhiteIsZero;
        if white_is_zero && kind.is_signed() {
            return Err(unsupported("its channels are signed and white where they are 0".into()));
        }
        let orientation: Option<u8> = tags.number(Tag::Orientation)?;
        let orientation = orientation.and_then(Orientation::from_exif).unwrap_or(Orientation::NoTransforms);
        let stored_header = Header {
            format: FileFormat::Tiff,
            width,
            height,
            channels,
            kind,
            names: default_names(channels),
            has_alpha,
            icc: tags.bytes(Tag::IccProfile, MOST_PROFILE)?,
            associated: has_alpha && extra.first() == Some(&ASSOCIATED),
            told: HeaderStatements::default(),
        };
        Ok(Self {
            header: upright_header(stored_header, orientation),
            width,
            height,
            orientation,
            method,
            predictor: predictor(tags, method, (kind, bits))?,
            bits,
            stored,
            planes_apart,
            white_is_zero,
            palette,
            is_big_endian: tags.is_big_endian(),
            reversed: tags.number::<u16>(Tag::FillOrder)? == Some(2),
            is_ycbcr,
            tables: if is_jpeg { tags.bytes(Tag::JPEGTables, MOST_TABLES)? } else { None },
        })
    }

    /// Number of interleaved samples of a pixel in one strip or tile.
    pub(super) fn together(&self) -> usize {
        if self.planes_apart { 1 } else { usize::from(self.stored) }
    }
}

/// Type of the samples, and their bits.
fn samples<R: Read + Seek>(tags: &mut Tags<R>) -> Result<(SampleKind, u16), ReadError> {
    let bits: Vec<u16> = tags.numbers(Tag::BitsPerSample)?.unwrap_or_default();
    let formats: Vec<u16> = tags.numbers(Tag::SampleFormat)?.unwrap_or_default();
    let differ = |values: &[u16]| values.iter().any(|value| *value != values[0]);
    if differ(&bits) || differ(&formats) {
        return Err(unsupported("its channels are stored in different ways".into()));
    }
    let bits = bits.first().copied().unwrap_or(1);
    let format = formats.first().map_or(SampleFormat::Uint, |format| SampleFormat::from_u16_exhaustive(*format));
    let kind = match (format, bits) {
        (SampleFormat::Uint, 1 | 2 | 4 | 8) => SampleKind::U8,
        (SampleFormat::Uint, 16) => SampleKind::U16,
        (SampleFormat::Uint, 32) => SampleKind::U32,
        (SampleFormat::Int, 8) => SampleKind::I8,
        (SampleFormat::Int, 16) => SampleKind::I16,
        (SampleFormat::Int, 32) => SampleKind::I32,
        (SampleFormat::IEEEFP, 16) => SampleKind::F16,
        (SampleFormat::IEEEFP, 32) => SampleKind::F32,
        (format, bits) => return Err(unsupported(format!("its samples are {format:?} of {bits} bits"))),
    };
    Ok((kind, bits))
}

/// Number of channels that are read, and whether the last is opacity.
fn channels(meaning: Meaning, stored: u16, extra: &[u16]) -> Result<(u8, bool), ReadError> {
    let few = || ReadError::corrupt("it has fewer channels than its colours need");
    match meaning {
        Meaning::WhiteIsZero | Meaning::BlackIsZero => match stored.to_le_bytes() {
            [channels @ 1..=4, 0] => Ok((channels, matches!(channels, 2 | 4))),
            _ => Err(unsupported(format!("it has {stored} channels of grey"))),
        },
        Meaning::RGB => match (stored, extra) {
            (..=2, _) => Err(few()),
            (4.., [ASSOCIATED | UNASSOCIATED, ..]) | (4, []) => Ok((4, true)),
            (5.., []) => Err(unsupported(format!("it has {stored} channels"))),
            _ => Ok((3, false)),
        },
        Meaning::RGBPalette | Meaning::YCbCr => Ok((3, false)),
        other => Err(unsupported(format!("its colours are {other:?}"))),
    }
}

/// The colours of a palette for samples of this depth.
fn palette<R: Read + Seek>(
    tags: &mut Tags<R>,
    (kind, bits, stored): (SampleKind, u16, u16),
) -> Result<Vec<[f32; 3]>, ReadError> {
    if kind != SampleKind::U8 || stored != 1 {
        return Err(unsupported(format!("its palette has {stored} numbers of {bits} bits for a pixel")));
    }
    let codes: Vec<u16> = tags.numbers(Tag::ColorMap)?.ok_or_else(|| ReadError::corrupt("it has no palette"))?;
    let count = 1_usize << bits;
    if codes.len() != 3 * count {
        return Err(ReadError::corrupt(format!("its palette has {} numbers; it must have {}", codes.len(), 3 * count)));
    }
    // Some programs write bytes where the format requires words.
    let most = if codes.iter().all(|code| *code < 256) { 255.0 } else { 65535.0 };
    let color = |index: usize| [0, 1, 2].map(|channel| f32::from(codes[channel * count + index]) / most);
    Ok((0..count).map(color).collect())
}

/// The predictor, which is allowed only for LZW and DEFLATE.
fn predictor<R: Read + Seek>(
    tags: &mut Tags<R>,
    method: CompressionMethod,
    (kind, bits): (SampleKind, u16),
) -> Result<Predictor, ReadError> {
    use CompressionMethod::{Deflate, LZW, OldDeflate};
    if !matches!(method, LZW | Deflate | OldDeflate) {
        return Ok(Predictor::None);
    }
    let number = tags.number::<u16>(Tag::Predictor)?.unwrap_or(1);
    match Predictor::from_u16(number) {
        None => Err(ReadError::corrupt(format!("its predictor is {number}; it must be 1, 2 or 3"))),
        Some(Predictor::FloatingPoint) if !kind.is_float() => {
            Err(unsupported("its whole numbers are packed as if they were floats".into()))
        }
        Some(Predictor::Horizontal) if bits < 8 => {
            Err(unsupported(format!("its samples of {bits} bits are stored as differences")))
        }
        Some(predictor) => Ok(predictor),
    }
}
