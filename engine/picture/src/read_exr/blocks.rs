//! Finds the blocks of an OpenEXR file by its offset tables, without decompressing. Each block must lie within the file
//! and within its part's picture, and none may be missing.
use super::super::limits::ReadError;
use super::{block_size, from_exr};
use exr::block::UncompressedBlock;
use exr::block::chunk::{Chunk, CompressedBlock, CompressedScanLineBlock, CompressedTileBlock, TileCoordinates};
use exr::compression::Compression;
use exr::math::Vec2;
use exr::meta::MetaData;
use exr::meta::header::Header as Layer;
use std::io::{Read, Seek, SeekFrom};

/// A compressed block in the file.
pub(super) struct Block {
    place: Place,
    start: usize,
    pub(super) length: usize,
}

#[derive(Clone, Copy)]
enum Place {
    Rows(i32),
    Tile(TileCoordinates),
}

impl Place {
    /// A block with these bytes at this position.
    fn block(self, compressed_pixels_le: Vec<u8>) -> CompressedBlock {
        match self {
            Self::Rows(y_coordinate) => {
                CompressedBlock::ScanLine(CompressedScanLineBlock { y_coordinate, compressed_pixels_le })
            }
            Self::Tile(coordinates) => CompressedBlock::Tile(CompressedTileBlock { coordinates, compressed_pixels_le }),
        }
    }

    /// True if it belongs to a reduced level, which is not read.
    fn is_reduced(self) -> bool {
        matches!(self, Self::Tile(tile) if tile.level_index != Vec2(0, 0))
    }
}

impl Block {
    /// Unpacks a block of `file`.
    pub(super) fn decompress(
        &self,
        file: &[u8],
        meta: &MetaData,
        layer_index: usize,
    ) -> Result<UncompressedBlock, ReadError> {
        let data = file.get(self.start..self.start + self.length).ok_or_else(end)?;
        let compressed_block = self.place.block(data.to_vec());
        UncompressedBlock::decompress_chunk(Chunk { layer_index, compressed_block }, meta, false).map_err(from_exr)
    }
}

fn end() -> ReadError {
    ReadError::truncated("it ends within the picture")
}

/// A reader for little-endian numbers in a file of known length.
struct Numbers<'r, R> {
    reader: &'r mut R,
    at: u64,
    length: u64,
}

impl<R: Read + Seek> Numbers<'_, R> {
    fn seek(&mut self, offset: u64) -> Result<(), ReadError> {
        self.at = offset;
        self.reader.seek(SeekFrom::Start(offset)).map(|_| ()).map_err(ReadError::Io)
    }

    fn i32(&mut self) -> Result<i32, ReadError> {
        if self.at.saturating_add(4) > self.length {
            return Err(end());
        }
        let mut bytes = [0; 4];
        self.reader.read_exact(&mut bytes).map_err(ReadError::Io)?;
        self.at += 4;
        Ok(i32::from_le_bytes(bytes))
    }

    fn index(&mut self) -> Result<usize, ReadError> {
        usize::try_from(self.i32()?).map_err(|_| ReadError::corrupt("a block has a negative place or length"))
    }

    fn coordinates(&mut self) -> Result<TileCoordinates, ReadError> {
        let tile_index = Vec2(self.index()?, self.index()?);
        Ok(TileCoordinates { tile_index, level_index: Vec2(self.index()?, self.index()?) })
    }

    /// The offsets of the blocks of a part.
    fn table(&mut self, offset: u64, count: usize) -> Result<Vec<u64>, ReadError> {
        let incomplete = || ReadError::truncated("its table of blocks is incomplete");
        let bytes = count.checked_mul(8).ok_or_else(incomplete)?;
        if offset.saturating_add(bytes as u64) > self.length {
            return Err(incomplete());
        }
        self.seek(offset)?;
        let mut table = vec![0; bytes];
        self.reader.read_exact(&mut table).map_err(ReadError::Io)?;
        Ok(table.as_chunks::<8>().0.iter().map(|offset| u64::from_le_bytes(*offset)).collect())
    }
}

/// The full-resolution blocks of every part, in a file of `length` bytes whose offset tables begin at `tables`.
pub(super) fn find<R: Read + Seek>(
    reader: &mut R,
    (tables, length): (u64, u64),
    meta: &MetaData,
) -> Result<Vec<Vec<Block>>, ReadError> {
    let mut numbers = Numbers { reader, at: 0, length };
    let mut offset = tables;
    let mut parts = Vec::with_capacity(meta.headers.len());
    for (index, layer) in meta.headers.iter().enumerate() {
        let table = numbers.table(offset, layer.chunk_count)?;
        offset += table.len() as u64 * 8;
        parts.push(part(&mut numbers, &table, index, meta)?);
    }
    Ok(parts)
}

fn part<R: Read + Seek>(
    numbers: &mut Numbers<'_, R>,
    table: &[u64],
    index: usize,
    meta: &MetaData,
) -> Result<Vec<Block>, ReadError> {
    let layer = &meta.headers[index];
    let mut seen = Seen::new(layer)?;
    let mut blocks = Vec::with_capacity(table.len());
    for offset in table {
        // The table is written last: zeros mean that the writer was interrupted.
        if *offset == 0 {
            return Err(ReadError::truncated("it was not written to its end"));
        }
        numbers.seek(*offset)?;
        if meta.requirements.is_multilayer() && numbers.index()? != index {
            return Err(ReadError::corrupt("a block belongs to another layer"));
        }
        let place = match layer.blocks.has_tiles() {
            true => Place::Tile(numbers.coordinates()?),
            false => Place::Rows(numbers.i32()?),
        };
        let length = numbers.index()?;
        if numbers.at.saturating_add(length as u64) > numbers.length {
            return Err(end());
        }
        if !place.is_reduced() {
            seen.take(layer, place, length)?;
            let start = usize::try_from(numbers.at).map_err(ReadError::corrupt)?;
            blocks.push(Block { place, start, length });
        }
    }
    seen.check_complete()?;
    Ok(blocks)
}

/// The blocks of a part that were found so far.
struct Seen {
    block: Vec2<usize>,
    across: usize,
    found: Vec<bool>,
}

impl Seen {
    fn new(layer: &Layer) -> Result<Self, ReadError> {
        let (Vec2(wide, high), Vec2(width, height)) = (block_size(layer), layer.layer_size);
        let block = Vec2(wide.max(1), high.max(1));
        let across = width.div_ceil(block.width());
        let count = across.saturating_mul(height.div_ceil(block.height()));
        // Each block needs an entry in a table within the file, so a larger count is impossible.
        if count > layer.chunk_count {
            return Err(ReadError::truncated("blocks are missing"));
        }
        Ok(Self { block, across, found: vec![false; count] })
    }

    /// Registers a block, which must not occur twice.
    fn take(&mut self, layer: &Layer, place: Place, length: usize) -> Result<(), ReadError> {
        let at = layer.get_block_data_indices(&place.block(Vec::new())).map_err(from_exr)?;
        let bounds = layer.get_absolute_block_pixel_coordinates(at).map_err(from_exr)?;
        bounds.validate(Some(layer.layer_size)).map_err(from_exr)?;
        let outside = || ReadError::corrupt("a block lies outside of the picture");
        let Vec2(left, top) = bounds.position.to_usize("position").map_err(|_| outside())?;
        let number = top / self.block.height() * self.across + left / self.block.width();
        match self.found.get_mut(number) {
            Some(found) if !*found => *found = true,
            Some(_) => return Err(ReadError::corrupt("a block occurs twice")),
            None => return Err(outside()),
        }
        let raw = bounds.size.area().saturating_mul(layer.channels.bytes_per_pixel);
        if layer.compression == Compression::Uncompressed && length != raw {
            return Err(ReadError::corrupt(format!("a block has {length} bytes; it must have {raw}")));
        }
        Ok(())
    }

    fn check_complete(&self) -> Result<(), ReadError> {
        if self.found.iter().all(|found| *found) { Ok(()) } else { Err(ReadError::truncated("blocks are missing")) }
    }
}
