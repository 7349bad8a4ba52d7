//! PNG, decoded by the `image` crate, with the checks that the crate leaves to its callers.
mod chunks;
mod tags;

use super::guard::guarded;
use super::limits::{DEFLATE_RATIO, ReadError, ReadLimits};
use super::raster::{from_image, header_of, limited, picture, samples};
use super::turn::{upright, upright_header};
use super::{FileFormat, Header, Picture};
use chunks::Chunks;
use image::codecs::png::PngDecoder;
use image::metadata::Orientation;
use image::{ImageDecoder, Limits};
use std::io::{BufRead, Cursor, Seek, SeekFrom};

pub(super) fn header<R: BufRead + Seek>(mut reader: R) -> Result<Header, ReadError> {
    let header = guarded(|| header_of(&decoder(&mut reader)?, FileFormat::Png))?;
    let length = reader.seek(SeekFrom::End(0)).map_err(ReadError::Io)?;
    Ok(told(header, &mut reader, length).0)
}

pub(super) fn check<R: BufRead + Seek>(reader: &mut R, length: u64, limits: &ReadLimits) -> Result<Header, ReadError> {
    checked(reader, length, limits).map(|(header, _)| header)
}

pub(super) fn read(bytes: &[u8], limits: &ReadLimits) -> Result<Picture, ReadError> {
    let (header, orientation) = checked(&mut Cursor::new(bytes), bytes.len() as u64, limits)?;
    let bytes = samples(|| decoder(Cursor::new(bytes)))?;
    upright(picture(&bytes, header), orientation)
}

fn checked<R: BufRead + Seek>(
    reader: &mut R,
    length: u64,
    limits: &ReadLimits,
) -> Result<(Header, Orientation), ReadError> {
    let chunks = chunks::walk(reader, length)?;
    let header = look(reader, &chunks, length, limits)?;
    if let Some(colors) = chunks.short_palette {
        reader.rewind().map_err(ReadError::Io)?;
        guarded(|| check_indices(&mut *reader, colors))?;
    }
    Ok(told(header, reader, length))
}

/// Adds the colour statements of the chunks to the header of the upright picture; returns the orientation of the stored
/// picture too.
fn told<R: BufRead + Seek>(header: Header, reader: &mut R, length: u64) -> (Header, Orientation) {
    let tags = tags::find(reader, length);
    let header = Header { icc: tags.icc, told: tags.told, ..header };
    (upright_header(header, tags.orientation), tags.orientation)
}

fn decoder<R: BufRead + Seek>(reader: R) -> Result<PngDecoder<R>, ReadError> {
    // Limits only the decoder's own memory (texts, profiles); the samples go to our own buffer.
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(64 << 20);
    PngDecoder::with_limits(reader, limits).map_err(from_image)
}

/// The header, after comparing it with the limits and with the maximum that the compressed samples can hold.
fn look<R: BufRead + Seek>(
    reader: &mut R,
    chunks: &Chunks,
    length: u64,
    limits: &ReadLimits,
) -> Result<Header, ReadError> {
    reader.rewind().map_err(ReadError::Io)?;
    let (header, stored_bits) = guarded(|| {
        let decoder = decoder(reader)?;
        // Uses the stored depth: a picture of 1 bit is stored in an eighth of the decoded size.
        let stored_bits = u64::from(decoder.original_color_type().bits_per_pixel());
        Ok((header_of(&decoder, FileFormat::Png)?, stored_bits))
    })?;
    limits.check(limited(&header, header.kind.bytes() as u64))?;
    let needed = (u64::from(header.width) * stored_bits).div_ceil(8) * u64::from(header.height);
    if needed > chunks.data.saturating_mul(DEFLATE_RATIO) {
        return Err(ReadError::implausible(length, header.width, header.height));
    }
    Ok(header)
}

/// Refuses samples with an index beyond the palette; the decoder would show them as black.
fn check_indices<R: BufRead + Seek>(reader: R, colors: usize) -> Result<(), ReadError> {
    let broken = |error: png::DecodingError| ReadError::damaged(error);
    let mut reader = png::Decoder::new(reader).read_info().map_err(broken)?;
    let info = reader.info();
    let (width, bits, interlaced) = (info.width as usize, info.bit_depth as usize, info.interlaced);
    let mut y = 0;
    let mut check_row = |row: &[u8]| {
        let found =
            (0..width).map(|x| (x, packed_sample(row, x, bits))).find(|(_, index)| usize::from(*index) >= colors);
        if let Some((x, index)) = found {
            let message = format!(
                "the pixel in column {x} of row {y} has colour {index} of the palette, which ends with colour {}",
                colors - 1
            );
            return Err(ReadError::corrupt(message));
        }
        y += 1;
        Ok(())
    };
    if !interlaced {
        while let Some(row) = reader.next_row().map_err(broken)? {
            check_row(row.data())?;
        }
        return Ok(());
    }
    // The rows of interlaced pictures are complete only after all passes.
    let size = reader.output_buffer_size().ok_or_else(|| ReadError::corrupt("it is too large"))?;
    let mut bytes = vec![0; size];
    let rows = reader.next_frame(&mut bytes).map_err(broken)?.line_size;
    bytes.chunks_exact(rows).try_for_each(check_row)
}

/// A sample of 1, 2, 4 or 8 bits in a packed row; the first sample is in the highest bits.
pub(super) fn packed_sample(row: &[u8], x: usize, bits: usize) -> u8 {
    let at = x * bits;
    let shift = 8 - bits - at % 8;
    u8::try_from((u32::from(row[at / 8]) >> shift) & ((1 << bits) - 1)).unwrap_or(u8::MAX)
}
