//! OpenEXR: headers and blocks are taken apart here, with every size checked; the `exr` crate decompresses.

use super::limits::{Claim, ReadError, ReadLimits};
use super::{FileFormat, Header, Picture, SampleKind};
use exr::block::UncompressedBlock;
use exr::block::chunk::{Chunk, CompressedBlock, CompressedScanLineBlock, CompressedTileBlock, TileCoordinates};
use exr::compression::Compression;
use exr::io::{PeekRead, Tracking};
use exr::math::Vec2;
use exr::meta::attribute::SampleType;
use exr::meta::header::Header as Layer;
use exr::meta::{BlockDescription, MetaData, Requirements, magic_number};
use half::f16;
use rayon::prelude::*;
use std::io::Read;

mod select;
use select::{Selection, all_names, select};

/// No method but the lossy DWA packs denser: DEFLATE makes at most 258 bytes of 2 bits.
const BEST_RATIO: u64 = 1032;
/// Blocks that are decompressed at once, in bytes; one at least.
const BATCH_BYTES: usize = 32 << 20;

pub(super) fn header<R: Read>(reader: R, wanted: Option<&str>) -> Result<Header, ReadError> {
    let (meta, _) = read_meta(reader)?;
    let selection = select(&meta, wanted)?;
    let (width, height) = size_of(&meta.headers[selection.layer])?;
    Ok(Header {
        format: FileFormat::Exr,
        width,
        height,
        channels: selection.count(),
        kind: kind_of(&meta, &selection),
        names: all_names(&meta),
        has_alpha: selection.has_alpha,
    })
}

pub(super) fn read(bytes: &[u8], limits: &ReadLimits, wanted: Option<&str>) -> Result<Picture, ReadError> {
    let (meta, tables) = read_meta(bytes)?;
    let selection = select(&meta, wanted)?;
    let layer = &meta.headers[selection.layer];
    let (width, height) = size_of(layer)?;
    let (wide, high) = (u64::from(width), u64::from(height));
    limits.check(Claim { width: wide, height: high, channels: u64::from(selection.count()), sample_bytes: 0 })?;
    let blocks = find_blocks(bytes, tables, &meta, selection.layer)?;
    check_plausible(layer, &blocks, bytes.len())?;

    let mut target = Target::new(width, height, layer, &selection);
    let block_bytes = block_size(layer).area().saturating_mul(layer.channels.bytes_per_pixel);
    if block_bytes as u64 > limits.max_bytes_decoded {
        return Err(ReadError::TooLarge {
            width: wide,
            height: high,
            bytes: block_bytes as u64,
            limit: limits.max_bytes_decoded,
        });
    }
    let batch = (BATCH_BYTES / block_bytes.max(1)).clamp(1, 4096);
    for blocks in blocks.chunks(batch) {
        let decompressed: Result<Vec<_>, _> =
            blocks.par_iter().map(|block| block.decompress(&meta, selection.layer)).collect();
        for block in decompressed? {
            target.put(&block)?;
        }
    }
    target.check_complete()?;
    Ok(Picture {
        width,
        height,
        channels: selection.count(),
        planes: target.planes,
        source: kind_of(&meta, &selection),
        names: selection.names.clone(),
        has_alpha: selection.has_alpha,
    })
}

/// The headers, and where the tables of block offsets begin.
fn read_meta<R: Read>(reader: R) -> Result<(MetaData, usize), ReadError> {
    let mut reader = PeekRead::new(Tracking::new(reader));
    magic_number::validate_exr(&mut reader).map_err(from_exr)?;
    let requirements = Requirements::read(&mut reader).map_err(from_exr)?;
    requirements.validate().map_err(from_exr)?;
    let headers = Layer::read_all(&mut reader, &requirements, false).map_err(from_exr)?;
    MetaData::validate(&headers, false).map_err(from_exr)?;
    for channel in headers.iter().flat_map(|layer| &layer.channels.list) {
        if channel.sampling != Vec2(1, 1) {
            return Err(ReadError::Unsupported {
                what: format!("channel `{}` has a lower resolution than the picture", channel.name),
                instead: "save it as RGB, without chroma subsampling",
            });
        }
    }
    Ok((MetaData { requirements, headers }, reader.byte_position()))
}

fn size_of(layer: &Layer) -> Result<(u32, u32), ReadError> {
    let side = |pixels: usize| u32::try_from(pixels).map_err(ReadError::corrupt);
    Ok((side(layer.layer_size.width())?, side(layer.layer_size.height())?))
}

fn kind_of(meta: &MetaData, selection: &Selection) -> SampleKind {
    let channels = &meta.headers[selection.layer].channels.list;
    let kinds = selection.channels.iter().map(|index| match channels[*index].sample_type {
        SampleType::F16 => SampleKind::F16,
        SampleType::F32 => SampleKind::F32,
        SampleType::U32 => SampleKind::U32,
    });
    // Of mixed channels the one that says most.
    kinds.max_by_key(|kind| kind.bytes()).unwrap_or(SampleKind::F32)
}

/// Size of a block within the layer.
fn block_size(layer: &Layer) -> Vec2<usize> {
    let Vec2(width, height) = layer.layer_size;
    match layer.blocks {
        BlockDescription::ScanLines => Vec2(width, layer.compression.scan_lines_per_block().min(height)),
        BlockDescription::Tiles(tiles) => {
            Vec2(tiles.tile_size.width().min(width), tiles.tile_size.height().min(height))
        }
    }
}

/// A compressed block in the file.
struct Block<'a> {
    place: Place,
    data: &'a [u8],
}

enum Place {
    Rows(i32),
    Tile(TileCoordinates),
}

impl Block<'_> {
    fn decompress(&self, meta: &MetaData, layer_index: usize) -> Result<UncompressedBlock, ReadError> {
        let compressed_pixels_le = self.data.to_vec();
        let compressed_block = match self.place {
            Place::Rows(y_coordinate) => {
                CompressedBlock::ScanLine(CompressedScanLineBlock { y_coordinate, compressed_pixels_le })
            }
            Place::Tile(coordinates) => {
                CompressedBlock::Tile(CompressedTileBlock { coordinates, compressed_pixels_le })
            }
        };
        UncompressedBlock::decompress_chunk(Chunk { layer_index, compressed_block }, meta, false).map_err(from_exr)
    }
}

/// A reader of little-endian numbers that knows the end.
struct Numbers<'a>(&'a [u8]);

impl<'a> Numbers<'a> {
    fn at(bytes: &'a [u8], offset: u64) -> Result<Self, ReadError> {
        let rest = usize::try_from(offset).ok().and_then(|offset| bytes.get(offset..));
        rest.map(Self).ok_or_else(Self::end)
    }

    fn end() -> ReadError {
        ReadError::truncated("it ends within the picture")
    }

    fn i32(&mut self) -> Result<i32, ReadError> {
        let (number, rest) = self.0.split_first_chunk().ok_or_else(Self::end)?;
        self.0 = rest;
        Ok(i32::from_le_bytes(*number))
    }

    fn index(&mut self) -> Result<usize, ReadError> {
        usize::try_from(self.i32()?).map_err(|_| ReadError::corrupt("a block has a negative place or length"))
    }

    fn take(&self, length: usize) -> Result<&'a [u8], ReadError> {
        self.0.get(..length).ok_or_else(Self::end)
    }
}

/// The blocks of a layer at its full resolution.
fn find_blocks<'a>(bytes: &'a [u8], tables: usize, meta: &MetaData, layer: usize) -> Result<Vec<Block<'a>>, ReadError> {
    let before: usize = meta.headers[..layer].iter().map(|layer| layer.chunk_count).fold(0, usize::saturating_add);
    let count = meta.headers[layer].chunk_count;
    let start = before.saturating_mul(8).saturating_add(tables);
    let table = start.checked_add(count.saturating_mul(8)).and_then(|end| bytes.get(start..end));
    let (table, _) = table.ok_or_else(|| ReadError::truncated("its table of blocks is incomplete"))?.as_chunks::<8>();
    let tiled = meta.headers[layer].blocks.has_tiles();
    let mut blocks = Vec::with_capacity(table.len());
    for offset in table {
        // The table is written last: zeros are the trace of a program that was interrupted.
        let offset = match u64::from_le_bytes(*offset) {
            0 => return Err(ReadError::truncated("it was not written to its end")),
            offset => offset,
        };
        let mut numbers = Numbers::at(bytes, offset)?;
        if meta.requirements.is_multilayer() && numbers.index()? != layer {
            return Err(ReadError::corrupt("a block belongs to another layer"));
        }
        let place = if tiled {
            let tile_index = Vec2(numbers.index()?, numbers.index()?);
            let level_index = Vec2(numbers.index()?, numbers.index()?);
            Place::Tile(TileCoordinates { tile_index, level_index })
        } else {
            Place::Rows(numbers.i32()?)
        };
        let length = numbers.index()?;
        let data = numbers.take(length)?;
        // The smaller copies of the picture are of no use here.
        if !matches!(place, Place::Tile(tile) if tile.level_index != Vec2(0, 0)) {
            blocks.push(Block { place, data });
        }
    }
    Ok(blocks)
}

fn check_plausible(layer: &Layer, blocks: &[Block<'_>], length: usize) -> Result<(), ReadError> {
    let stored: u64 = blocks.iter().map(|block| block.data.len() as u64).fold(0, u64::saturating_add);
    let Vec2(width, height) = layer.layer_size;
    let raw = (width as u64).saturating_mul(height as u64).saturating_mul(layer.channels.bytes_per_pixel as u64);
    let ratio = match layer.compression {
        Compression::DWAA(_) | Compression::DWAB(_) => return Ok(()),
        Compression::Uncompressed => 1,
        _ => BEST_RATIO,
    };
    if raw > stored.saturating_mul(ratio) {
        let message = format!("{length} bytes cannot hold the `{width}x{height}` pixels of its header");
        return Err(ReadError::corrupt(message));
    }
    Ok(())
}

/// The picture that blocks are put into.
struct Target {
    width: usize,
    pixels: usize,
    block: Vec2<usize>,
    blocks_across: usize,
    seen: Vec<bool>,
    /// Per stored channel: its type, and the plane it goes to.
    channels: Vec<(SampleType, Option<usize>)>,
    planes: Vec<f32>,
}

impl Target {
    fn new(width: u32, height: u32, layer: &Layer, selection: &Selection) -> Self {
        let (width, height) = (width as usize, height as usize);
        let block = block_size(layer);
        let blocks_across = width.div_ceil(block.width());
        let kinds = layer.channels.list.iter().enumerate().map(|(index, channel)| {
            (channel.sample_type, selection.channels.iter().position(|chosen| *chosen == index))
        });
        Self {
            width,
            pixels: width * height,
            block,
            blocks_across,
            seen: vec![false; blocks_across * height.div_ceil(block.height())],
            channels: kinds.collect(),
            planes: vec![0.0; width * height * selection.channels.len()],
        }
    }

    fn put(&mut self, block: &UncompressedBlock) -> Result<(), ReadError> {
        let (Vec2(left, top), Vec2(width, height)) = (block.index.pixel_position, block.index.pixel_size);
        let number = top / self.block.height() * self.blocks_across + left / self.block.width();
        match self.seen.get_mut(number) {
            Some(seen) if !*seen => *seen = true,
            _ => return Err(ReadError::corrupt("a block occurs twice")),
        }
        let mut data = block.data.as_slice();
        for y in top..top + height {
            for (kind, plane) in &self.channels {
                let (line, rest) = data
                    .split_at_checked(width * kind.bytes_per_sample())
                    .ok_or_else(|| ReadError::corrupt("a block is too short"))?;
                data = rest;
                if let Some(plane) = plane {
                    let start = plane * self.pixels + y * self.width + left;
                    convert(*kind, line, &mut self.planes[start..start + width]);
                }
            }
        }
        Ok(())
    }

    fn check_complete(&self) -> Result<(), ReadError> {
        if self.seen.iter().all(|seen| *seen) { Ok(()) } else { Err(ReadError::truncated("blocks are missing")) }
    }
}

fn convert(kind: SampleType, line: &[u8], out: &mut [f32]) {
    let halves = line.as_chunks::<2>().0;
    let words = line.as_chunks::<4>().0;
    match kind {
        SampleType::F16 => out.iter_mut().zip(halves).for_each(|(out, half)| *out = f16::from_ne_bytes(*half).to_f32()),
        SampleType::F32 => out.iter_mut().zip(words).for_each(|(out, word)| *out = f32::from_ne_bytes(*word)),
        #[expect(clippy::cast_precision_loss, reason = "numbers of objects beyond 2^24 cannot be told apart as floats")]
        SampleType::U32 => out.iter_mut().zip(words).for_each(|(out, word)| *out = u32::from_ne_bytes(*word) as f32),
    }
}

fn from_exr(error: exr::error::Error) -> ReadError {
    match error {
        exr::error::Error::NotSupported(what) => ReadError::Unsupported {
            what: format!("it uses an EXR feature that is not read ({what})"),
            instead: "save it as a flat EXR with ZIP or PIZ compression",
        },
        exr::error::Error::Invalid(what) if what.contains("reached the end") => {
            ReadError::truncated("it ends within the picture")
        }
        exr::error::Error::Invalid(what) => ReadError::corrupt(what),
        exr::error::Error::Io(error) => ReadError::from_decoder(&error),
        exr::error::Error::Aborted => ReadError::corrupt("its decoder gave up"),
    }
}
