//! Helpers for the decoders of the `image` crate: headers, samples and errors.
use super::guard::guarded;
use super::limits::{Claim, ReadError};
use super::{FileFormat, Header, HeaderStatements, Picture, SampleKind, default_names};
use image::{ColorType, ImageDecoder, ImageError};
use rayon::prelude::*;

pub(super) fn header_of(decoder: &impl ImageDecoder, format: FileFormat) -> Result<Header, ReadError> {
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
    let (names, told) = (default_names(channels), HeaderStatements::default());
    Ok(Header { format, width, height, channels, kind, names, has_alpha, icc: None, associated: false, told })
}

/// Memory needed for decoding, with `sample_bytes` for each sample during decoding.
pub(super) fn limited(header: &Header, sample_bytes: u64) -> Claim {
    let (width, height) = (u64::from(header.width), u64::from(header.height));
    Claim { width, height, channels: u64::from(header.channels), sample_bytes }
}

/// All samples in the order of the file.
pub(super) fn samples<D: ImageDecoder>(decoder: impl FnOnce() -> Result<D, ReadError>) -> Result<Vec<u8>, ReadError> {
    let unpack = || {
        let decoder = decoder()?;
        let size = usize::try_from(decoder.total_bytes()).map_err(ReadError::corrupt)?;
        let mut bytes = vec![0; size];
        decoder.read_image(&mut bytes).map_err(|error| from_image(error).in_data())?;
        Ok(bytes)
    };
    guarded(unpack)
}

/// The picture of a checked header.
pub(super) fn picture(bytes: &[u8], header: Header) -> Picture {
    let Header { width, height, channels, kind, names, has_alpha, .. } = header;
    let channel_count = usize::from(channels);
    let planes = if kind == SampleKind::U8 {
        planar(bytes, channel_count, |sample| f32::from(sample) / 255.0)
    } else {
        let (pairs, _) = bytes.as_chunks::<2>();
        planar(pairs, channel_count, |sample| f32::from(u16::from_ne_bytes(sample)) / 65535.0)
    };
    Picture { width, height, channels, planes, source: kind, names, has_alpha }
}

pub(super) fn from_image(error: ImageError) -> ReadError {
    match error {
        ImageError::IoError(error) => ReadError::from_decoder(&error),
        ImageError::Unsupported(error) => {
            ReadError::Unsupported { what: error.to_string(), instead: "save it in the most common form of its format" }
        }
        ImageError::Limits(error) => {
            ReadError::corrupt(format!("a row, a text or a profile in it is too large ({error})"))
        }
        error => match std::error::Error::source(&error) {
            Some(source) => ReadError::corrupt(source),
            None => ReadError::corrupt(error),
        },
    }
}

/// Converts pixel-interleaved samples to planes.
fn planar<T: Copy + Sync>(samples: &[T], channels: usize, convert: impl Fn(T) -> f32 + Sync) -> Vec<f32> {
    let pixels = samples.len() / channels;
    let mut planes = vec![0.0; pixels * channels];
    const CHUNK: usize = 1 << 16;
    for (channel, plane) in planes.chunks_exact_mut(pixels.max(1)).enumerate() {
        let parts = plane.par_chunks_mut(CHUNK).zip(samples.par_chunks(CHUNK * channels));
        parts.for_each(|(plane, samples)| {
            for (out, pixel) in plane.iter_mut().zip(samples.chunks_exact(channels)) {
                *out = convert(pixel[channel]);
            }
        });
    }
    planes
}
