//! Where a TIFF file keeps its samples, checked without unpacking any: every strip or tile lies within the file, is packed
//! by a known method, and together they can hold the picture. The `tiff` crate accepts every file that passes.
use super::super::SampleKind;
use super::super::limits::ReadError;
use super::{Layout, from_tiff, unsupported};
use std::io::{Read, Seek};
use tiff::ColorType;
use tiff::decoder::Decoder;
use tiff::tags::{CompressionMethod, PhotometricInterpretation, Predictor, Tag};

/// LZW, the densest of the methods, makes at most 4096 bytes of 12 bits.
const BEST_RATIO: u64 = 4096;

/// The most bytes of a strip or tile of a picture of `needed` bytes. A tile may be larger than the picture, but not without
/// end.
pub(super) fn most_of_a_chunk(needed: usize) -> usize {
    needed.max(1 << 20).saturating_mul(2)
}

/// Compares the places of the strips or tiles with a file of `length` bytes.
pub(super) fn check<R: Read + Seek>(
    decoder: &mut Decoder<R>,
    layout: &Layout,
    length: u64,
    needed: u64,
) -> Result<(), ReadError> {
    let method = CompressionMethod::from_u16_exhaustive(number(decoder, Tag::Compression)?.unwrap_or(1));
    check_method(decoder, layout, method)?;
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
    let plain = match method {
        CompressionMethod::None => Some(Plain::of(decoder, layout, tiled)?),
        _ => None,
    };
    let most = usize::try_from(needed).map_or(u64::MAX, |needed| most_of_a_chunk(needed) as u64);
    let mut total = 0_u64;
    for (index, (offset, count)) in offsets.iter().zip(&counts).enumerate() {
        let bytes = plain.as_ref().map_or(*count, |plain| plain.bytes(index as u64).max(*count));
        if bytes == 0 {
            return Err(ReadError::truncated(format!("part {index} of its samples is empty")));
        }
        if offset.saturating_add(bytes) > length {
            return Err(ReadError::truncated("it ends within the picture"));
        }
        if *count > most {
            return Err(ReadError::corrupt("a part of its samples is larger than the picture can be"));
        }
        total = total.saturating_add(bytes);
    }
    if needed > total.saturating_mul(BEST_RATIO) {
        let (width, height) = (layout.header.width, layout.header.height);
        return Err(ReadError::implausible(length, width, height));
    }
    Ok(())
}

fn number<R: Read + Seek>(decoder: &mut Decoder<R>, tag: Tag) -> Result<Option<u16>, ReadError> {
    decoder.find_tag_unsigned::<u16>(tag).map_err(from_tiff)
}

/// Refuses what the decoder would refuse at the first strip.
fn check_method<R: Read + Seek>(
    decoder: &mut Decoder<R>,
    layout: &Layout,
    method: CompressionMethod,
) -> Result<(), ReadError> {
    use CompressionMethod::{Deflate, LZW, ModernJPEG, None, OldDeflate, PackBits};
    if !matches!(method, None | LZW | Deflate | OldDeflate | PackBits | ModernJPEG) {
        return Err(unsupported(format!("it is packed by the method {method:?}")));
    }
    let predictor = number(decoder, Tag::Predictor)?.and_then(Predictor::from_u16);
    if predictor == Some(Predictor::FloatingPoint) && !layout.header.kind.is_float() {
        return Err(unsupported("its whole numbers are packed as if they were floats".into()));
    }
    let white_is_zero = Some(PhotometricInterpretation::WhiteIsZero.to_u16());
    let inverted = number(decoder, Tag::PhotometricInterpretation)? == white_is_zero;
    let plain_gray = matches!(layout.color, ColorType::Gray(_)) && layout.header.kind != SampleKind::F16;
    if inverted && !plain_gray {
        return Err(unsupported("its channels are white where they are 0".into()));
    }
    Ok(())
}

/// Sizes of strips or tiles that are not compressed; the decoder goes by these, not by the stated lengths.
struct Plain {
    row_bytes: u64,
    rows: u64,
    height: u64,
    across: u64,
    /// Strips or tiles of a plane.
    per_plane: u64,
}

impl Plain {
    fn of<R: Read + Seek>(decoder: &mut Decoder<R>, layout: &Layout, tiled: bool) -> Result<Self, ReadError> {
        let (width, height) = (u64::from(layout.header.width), u64::from(layout.header.height));
        let mut tag = |tag| decoder.find_tag_unsigned::<u32>(tag).map_err(from_tiff).map(|found| found.map(u64::from));
        let samples = tag(Tag::SamplesPerPixel)?.unwrap_or(1);
        let (wide, rows) = if tiled {
            (tag(Tag::TileWidth)?.unwrap_or(width), tag(Tag::TileLength)?.unwrap_or(height))
        } else {
            (width, tag(Tag::RowsPerStrip)?.unwrap_or(height))
        };
        let (wide, rows) = (wide.max(1), rows.max(1));
        let stored = if layout.planes_apart { 1 } else { samples };
        let row_bytes = wide.saturating_mul(stored).saturating_mul(layout.header.kind.bytes() as u64);
        let across = width.div_ceil(wide);
        Ok(Self { row_bytes, rows, height, across, per_plane: across * height.div_ceil(rows) })
    }

    /// Bytes that are read of a strip or tile: rows below the picture are not.
    fn bytes(&self, index: u64) -> u64 {
        let row = index % self.per_plane / self.across;
        self.rows.min(self.height.saturating_sub(row * self.rows)).saturating_mul(self.row_bytes)
    }
}
