//! Locations of the samples in a TIFF file, checked without decompressing: every strip or tile must lie within the file
//! and use a known compression, and together they must be long enough for the picture.
use super::super::limits::ReadError;
use super::directory::Tags;
use super::layout::Layout;
use super::{jpeg, unsupported};
use std::io::{Read, Seek};
use tiff::tags::{CompressionMethod, Tag};

/// The best possible ratio: LZW, the densest method, encodes at most 4096 bytes in 12 bits.
const BEST_RATIO: u64 = 4096;

/// Locations of all strips or tiles.
pub(super) struct ChunkLocations {
    /// Width and height of a strip or tile in pixels; only tiles may exceed the picture.
    pub(super) wide: u32,
    pub(super) rows: u32,
    /// Numbers of strips or tiles of a plane.
    pub(super) across: usize,
    pub(super) down: usize,
    /// Bytes of an unpacked row of a strip or tile.
    pub(super) row_bytes: usize,
    /// The height of the picture.
    height: u32,
    /// Offset and length of each strip or tile, plane after plane, row by row.
    parts: Vec<(u64, u64)>,
}

impl ChunkLocations {
    /// Reads the locations of the strips or tiles and checks them for a file of `length` bytes.
    pub(super) fn read<R: Read + Seek>(tags: &mut Tags<R>, layout: &Layout, length: u64) -> Result<Self, ReadError> {
        use CompressionMethod::{Deflate, LZW, ModernJPEG, None, OldDeflate, PackBits};
        if !matches!(layout.method, None | LZW | Deflate | OldDeflate | PackBits | ModernJPEG) {
            return Err(unsupported(format!("it is packed by the method {:?}", layout.method)));
        }
        let tiled = tags.has(Tag::TileOffsets);
        let mut places = Self::sizes(tags, layout, tiled)?;
        let (offsets, counts) =
            if tiled { (Tag::TileOffsets, Tag::TileByteCounts) } else { (Tag::StripOffsets, Tag::StripByteCounts) };
        let mut list = |tag| {
            let values = tags.numbers::<u64>(tag)?;
            values.ok_or_else(|| ReadError::corrupt("it does not say where its samples are"))
        };
        let (offsets, counts) = (list(offsets)?, list(counts)?);
        if offsets.len() != counts.len() {
            return Err(ReadError::corrupt("its strips have not as many places as lengths"));
        }
        let planes = if layout.planes_apart { usize::from(layout.stored) } else { 1 };
        let needed = places.across * places.down * planes;
        if offsets.len() < needed {
            return Err(ReadError::corrupt(format!("it has {} strips or tiles; it needs {needed}", offsets.len())));
        }
        places.parts = offsets.into_iter().zip(counts).take(needed).collect();
        places.check(layout, length, planes as u64)?;
        if layout.method == ModernJPEG {
            places.check_jpeg(tags, layout)?;
        }
        Ok(places)
    }

    /// Reads only the sizes.
    fn sizes<R: Read + Seek>(tags: &mut Tags<R>, layout: &Layout, tiled: bool) -> Result<Self, ReadError> {
        let Layout { width, height, .. } = *layout;
        let (wide, rows) = if tiled {
            (tags.required(Tag::TileWidth)?, tags.required(Tag::TileLength)?)
        } else {
            (width, tags.number(Tag::RowsPerStrip)?.unwrap_or(height).min(height))
        };
        if wide == 0 || rows == 0 {
            return Err(ReadError::corrupt("its strips or tiles have no pixels"));
        }
        let row_bits = u64::from(wide) * layout.together() as u64 * u64::from(layout.bits);
        let whole = |number: u64| usize::try_from(number).map_err(ReadError::corrupt);
        Ok(Self {
            wide,
            rows,
            across: whole(width.div_ceil(wide).into())?,
            down: whole(height.div_ceil(rows).into())?,
            row_bytes: whole(row_bits.div_ceil(8))?,
            height,
            parts: Vec::new(),
        })
    }

    fn check(&mut self, layout: &Layout, length: u64, planes: u64) -> Result<(), ReadError> {
        let (width, height) = (u64::from(layout.width), u64::from(layout.height));
        let row_bits = width * layout.together() as u64 * u64::from(layout.bits);
        let needed = row_bits.div_ceil(8).saturating_mul(height).saturating_mul(planes);
        let most = most_of_a_part(needed);
        let mut total = 0_u64;
        for index in 0..self.parts.len() {
            let unpacked = self.bytes(index) as u64;
            let (offset, count) = &mut self.parts[index];
            if layout.method == CompressionMethod::None {
                // For uncompressed samples the stated length is ignored; the last tile may lack the rows below the
                // picture.
                *count = unpacked;
            }
            if *count == 0 {
                return Err(ReadError::truncated(format!("part {index} of its samples is empty")));
            }
            if offset.saturating_add(*count) > length {
                return Err(ReadError::truncated("it ends within the picture"));
            }
            if *count > most || unpacked > most {
                return Err(ReadError::corrupt("a part of its samples is larger than the picture can be"));
            }
            total = total.saturating_add(*count);
        }
        if needed > total.saturating_mul(BEST_RATIO) {
            return Err(ReadError::implausible(length, layout.width, layout.height));
        }
        Ok(())
    }

    /// Follows the markers of all JPEG strips or tiles.
    fn check_jpeg<R: Read + Seek>(&self, tags: &mut Tags<R>, layout: &Layout) -> Result<(), ReadError> {
        for (index, part) in self.parts.iter().enumerate() {
            jpeg::check_jpeg(&tags.part(*part)?, layout, self.frame(index))?;
        }
        Ok(())
    }

    /// Offset and length of a strip or tile in the file.
    pub(super) fn part(&self, index: usize) -> (u64, u64) {
        self.parts[index]
    }

    /// Width of a strip or tile, and the number of its rows within the picture.
    pub(super) fn frame(&self, index: usize) -> (u32, u32) {
        let row = u32::try_from(index % (self.across * self.down) / self.across).unwrap_or(u32::MAX);
        (self.wide, self.rows.min(self.height.saturating_sub(row.saturating_mul(self.rows))))
    }

    /// Bytes of these rows, unpacked.
    pub(super) fn bytes(&self, index: usize) -> usize {
        self.row_bytes.saturating_mul(self.frame(index).1 as usize)
    }
}

/// Maximum bytes of a strip or tile, for a picture of `needed` bytes. A tile may be larger than the picture,
/// but only to a limit.
fn most_of_a_part(needed: u64) -> u64 {
    needed.max(1 << 20).saturating_mul(2)
}
