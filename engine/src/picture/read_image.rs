//! PNG and JPEG, decoded by the `image` crate, with the checks it leaves to its callers.

use super::limits::{Claim, ReadError, ReadLimits};
use super::read::planar;
use super::{FileFormat, Header, Picture, SampleKind, default_names};
use image::codecs::{jpeg::JpegDecoder, png::PngDecoder};
use image::{ColorType, ImageDecoder, ImageError};
use std::io::{BufRead, Cursor, Seek};

/// DEFLATE makes at most 258 bytes of 2 bits; no PNG holds more than this many bytes for each of its own.
const DEFLATE_RATIO: u64 = 1032;
/// A block of 64 pixels takes a bit at least, and of three subsampled planes two are a quarter of the size.
const JPEG_PIXELS_PER_BYTE: u64 = 8 * 64 * 2;

pub(super) fn png_header<R: BufRead + Seek>(reader: R) -> Result<Header, ReadError> {
    let decoder = PngDecoder::with_limits(reader, decoder_limits()).map_err(from_image)?;
    header_of(&decoder, FileFormat::Png)
}

pub(super) fn jpeg_header<R: BufRead + Seek>(reader: R) -> Result<Header, ReadError> {
    header_of(&JpegDecoder::new(reader).map_err(from_image)?, FileFormat::Jpeg)
}

pub(super) fn read_png(bytes: &[u8], limits: &ReadLimits) -> Result<Picture, ReadError> {
    let data = png_data_length(bytes)?;
    let decoder = PngDecoder::with_limits(Cursor::new(bytes), decoder_limits()).map_err(from_image)?;
    let header = header_of(&decoder, FileFormat::Png)?;
    // Judged by the stored depth: a picture of 1 bit takes an eighth of what it decodes to.
    let stored_bits = u64::from(decoder.original_color_type().bits_per_pixel());
    check(&header, limits, u64::try_from(header.kind.bytes()).unwrap_or(4))?;
    let needed = (u64::from(header.width) * stored_bits).div_ceil(8) * u64::from(header.height);
    if needed > data.saturating_mul(DEFLATE_RATIO) {
        return Err(implausible(&header, bytes.len()));
    }
    decode(decoder, header)
}

pub(super) fn read_jpeg(bytes: &[u8], limits: &ReadLimits) -> Result<Picture, ReadError> {
    check_jpeg_end(bytes)?;
    let decoder = JpegDecoder::new(Cursor::new(bytes)).map_err(from_image)?;
    let header = header_of(&decoder, FileFormat::Jpeg)?;
    // A progressive file is decoded by way of 16-bit coefficients.
    check(&header, limits, 3)?;
    let pixels = u64::from(header.width) * u64::from(header.height);
    if pixels > (bytes.len() as u64).saturating_mul(JPEG_PIXELS_PER_BYTE) {
        return Err(implausible(&header, bytes.len()));
    }
    decode(decoder, header)
}

/// Bounds what the decoder itself keeps (text, profiles); the samples go to our own buffer.
fn decoder_limits() -> image::Limits {
    let mut limits = image::Limits::no_limits();
    limits.max_alloc = Some(64 << 20);
    limits
}

fn check(header: &Header, limits: &ReadLimits, sample_bytes: u64) -> Result<(), ReadError> {
    let (width, height) = (u64::from(header.width), u64::from(header.height));
    limits.check(Claim { width, height, channels: u64::from(header.channels), sample_bytes })
}

fn implausible(header: &Header, length: usize) -> ReadError {
    let Header { width, height, .. } = header;
    ReadError::corrupt(format!("{length} bytes cannot hold the `{width}x{height}` pixels of its header"))
}

fn header_of(decoder: &impl ImageDecoder, format: FileFormat) -> Result<Header, ReadError> {
    let (width, height) = decoder.dimensions();
    let (channels, kind) = match decoder.color_type() {
        ColorType::L8 => (1, SampleKind::U8),
        ColorType::La8 => (2, SampleKind::U8),
        ColorType::Rgb8 => (3, SampleKind::U8),
        ColorType::Rgba8 => (4, SampleKind::U8),
        ColorType::L16 => (1, SampleKind::U16),
        ColorType::La16 => (2, SampleKind::U16),
        ColorType::Rgb16 => (3, SampleKind::U16),
        ColorType::Rgba16 => (4, SampleKind::U16),
        other => {
            let what = format!("its samples are {other:?}");
            return Err(ReadError::Unsupported { what, instead: "save it with 8 or 16 bits a channel" });
        }
    };
    let has_alpha = channels % 2 == 0;
    Ok(Header { format, width, height, channels, kind, names: default_names(channels), has_alpha })
}

fn decode(decoder: impl ImageDecoder, header: Header) -> Result<Picture, ReadError> {
    let Header { width, height, channels, kind, names, has_alpha, .. } = header;
    let size = usize::try_from(decoder.total_bytes()).map_err(ReadError::corrupt)?;
    let mut bytes = vec![0; size];
    decoder.read_image(&mut bytes).map_err(from_image)?;
    let channel_count = usize::from(channels);
    let planes = if kind == SampleKind::U8 {
        planar(&bytes, channel_count, |sample| f32::from(sample) / 255.0)
    } else {
        let (pairs, _) = bytes.as_chunks::<2>();
        planar(pairs, channel_count, |sample| f32::from(u16::from_ne_bytes(sample)) / 65535.0)
    };
    Ok(Picture { width, height, channels, planes, source: kind, names, has_alpha })
}

/// Walks over the chunks of a PNG up to its end and gives the bytes of compressed samples.
fn png_data_length(bytes: &[u8]) -> Result<u64, ReadError> {
    let mut rest = bytes.get(8..).ok_or_else(|| ReadError::truncated("it ends within its signature"))?;
    let mut data = 0;
    loop {
        let Some(([l0, l1, l2, l3, k0, k1, k2, k3], content)) = rest.split_first_chunk::<8>() else {
            return Err(ReadError::truncated("the end chunk `IEND` is missing"));
        };
        let length = u32::from_be_bytes([*l0, *l1, *l2, *l3]);
        let kind = [*k0, *k1, *k2, *k3];
        if !kind.iter().all(u8::is_ascii_alphabetic) {
            return Err(ReadError::corrupt("a chunk has no proper name"));
        }
        let after = usize::try_from(length).ok().and_then(|length| content.get(length.checked_add(4)?..));
        rest = after.ok_or_else(|| ReadError::truncated("it ends within a chunk"))?;
        match &kind {
            b"IDAT" => data += u64::from(length),
            b"IEND" => return Ok(data),
            _ => {}
        }
    }
}

/// Decoders fill what is missing of a JPEG with grey; so the marker of its end is looked for here.
fn check_jpeg_end(bytes: &[u8]) -> Result<(), ReadError> {
    let missing = || ReadError::truncated("the end marker is missing");
    let mut at = 2;
    loop {
        // Within compressed data, bytes of 255 are followed by 0 or by the number of a restart.
        let found = bytes.get(at..).and_then(|rest| rest.iter().position(|byte| *byte == 0xff)).ok_or_else(missing)?;
        let marker = *bytes.get(at + found + 1).ok_or_else(missing)?;
        at += found + 2;
        match marker {
            0xd9 => return Ok(()),
            // Fill bytes: the marker may begin with the next one.
            0xff => at -= 1,
            0 | 1 | 0xd0..=0xd8 => {}
            _ => {
                let length = bytes.get(at..at + 2).ok_or_else(missing)?;
                at += usize::from(u16::from_be_bytes([length[0], length[1]])).max(2);
            }
        }
    }
}

fn from_image(error: ImageError) -> ReadError {
    match error {
        ImageError::IoError(error) => ReadError::from_decoder(&error),
        ImageError::Unsupported(error) => {
            ReadError::Unsupported { what: error.to_string(), instead: "save it in the most common form of its format" }
        }
        ImageError::Limits(error) => {
            ReadError::corrupt(format!("a row, a text or a profile in it is too large ({error})"))
        }
        error => match std::error::Error::source(&error) {
            Some(source) if source.to_string().contains("end of file") => ReadError::truncated(source),
            Some(source) => ReadError::corrupt(source),
            None => ReadError::corrupt(error),
        },
    }
}
