//! OpenEXR with tiles and mip levels, so that renderers can read parts of a texture.
//!
//! Tiles lie in the file in the order of completion; the table at the beginning has their offsets.
use super::super::encode::{Rows, Tally, halves, range_of};
use super::super::levels::{Level, Levels, SIDE};
use super::super::lossless::Zlib;
use super::super::spec::{Depth, PictureSpec};
use super::{attributed, attributes, dense, header_bytes, shrunk};
use exr::compression::Compression as Method;
use exr::math::{RoundingMode, Vec2};
use exr::meta::BlockDescription;
use exr::meta::attribute::{LevelMode, LineOrder, TileDescription};
use half::slice::HalfFloatSliceExt;
use rayon::prelude::*;
use std::io::{self, Seek, SeekFrom, Write};

/// Number of neighbouring tiles that share one trial of compression: a trial takes as long as writing a small tile.
const TOGETHER: u32 = 4;

/// A picture and its mip levels under construction.
pub(crate) struct TiledSink<W> {
    output: W,
    depth: Depth,
    zlib: Zlib,
    levels: Levels,
    /// Channel indices in the order of the file.
    order: Vec<usize>,
    /// Offset of the tile table.
    table: u64,
    position: u64,
    /// Offset of each tile.
    places: Vec<u64>,
}

impl<W: Write + Seek> TiledSink<W> {
    pub(crate) fn new(mut output: W, spec: &PictureSpec) -> io::Result<Self> {
        let side = SIDE as usize;
        let tiles = TileDescription {
            tile_size: Vec2(side, side),
            level_mode: LevelMode::MipMap,
            rounding_mode: RoundingMode::Down,
        };
        let header =
            attributed(spec).with_encoding(Method::ZIP16, BlockDescription::Tiles(tiles), LineOrder::Unspecified);
        let mut start = header_bytes(&header).map_err(io::Error::other)?;
        attributes(&mut start, &spec.metadata)?;
        let table = start.len() as u64;
        // Zeros until the end, by which readers recognise an incomplete file.
        start.resize(start.len() + header.chunk_count * 8, 0);
        output.write_all(&start)?;
        let mut order: Vec<usize> = (0..spec.channels.len()).collect();
        order.sort_by_key(|index| &spec.channels[*index]);
        let levels = Levels::new(spec);
        let places = vec![0; levels.tiles()];
        let (depth, zlib, position) = (spec.depth, Zlib::new(spec.compression), start.len() as u64);
        Ok(Self { output, depth, zlib, levels, order, table, position, places })
    }

    pub(crate) fn write(&mut self, rows: Rows<'_>) -> io::Result<Tally> {
        let Self { output, depth, zlib, levels, order, position, places, .. } = self;
        let (zlib, order, depth) = (&*zlib, &*order, *depth);
        let pack = |_, level: &Level, count| {
            let across = level.across();
            let made = |group: u32| -> Vec<(Vec<u8>, Tally)> {
                let tiles = group * TOGETHER..((group + 1) * TOGETHER).min(across);
                let mut tiles: Vec<_> = tiles.map(|x| tile(level, (x, count), order, depth)).collect();
                if !tiles.first().is_some_and(|(first, _)| dense(first, zlib)) {
                    tiles.iter_mut().for_each(|(bytes, _)| *bytes = shrunk(bytes, zlib));
                }
                tiles
            };
            let groups = (0..across.div_ceil(TOGETHER)).into_par_iter();
            let (tiles, tallies): (Vec<_>, Vec<_>) = groups.flat_map_iter(made).unzip();
            (tiles, tallies.into_iter().fold(Tally::default(), Tally::with))
        };
        levels.push(rows, pack, |index, level, tiles| {
            let first = level.first + (level.done * level.across()) as usize;
            for ((x, tile), place) in (0..).zip(tiles).zip(&mut places[first..]) {
                let index = u32::try_from(index).map_err(io::Error::other)?;
                let length = u32::try_from(tile.len()).map_err(io::Error::other)?;
                output.write_all(&[x, level.done, index, index, length].map(u32::to_le_bytes).concat())?;
                output.write_all(&tile)?;
                *place = *position;
                *position += 20 + tile.len() as u64;
            }
            Ok(())
        })
    }

    pub(crate) fn finish(mut self) -> io::Result<()> {
        let table: Vec<u8> = self.places.iter().flat_map(|place| place.to_le_bytes()).collect();
        self.output.seek(SeekFrom::Start(self.table))?;
        self.output.write_all(&table)?;
        self.output.flush()
    }
}

/// Bytes of a tile, row by row and within a row channel by channel, and the statistics of the samples.
fn tile(level: &Level, (x, rows): (u32, u32), order: &[usize], depth: Depth) -> (Vec<u8>, Tally) {
    let (left, width) = ((x * SIDE) as usize, level.width as usize);
    let right = (left + SIDE as usize).min(width);
    let mut bytes = Vec::with_capacity((right - left) * rows as usize * order.len() * depth.bytes());
    let (mut row_of_halves, mut values, mut tally) = (Vec::new(), Vec::new(), Tally::default());
    for row in 0..rows as usize {
        for channel in order {
            let samples = &level.rows[*channel][row * width..][left..right];
            if depth == Depth::F16 {
                tally = tally.with(halves(samples, &mut row_of_halves, &mut values));
                bytes.extend_from_slice(bytemuck::cast_slice(row_of_halves.reinterpret_cast()));
            } else {
                tally = tally.with(range_of(samples));
                bytes.extend_from_slice(bytemuck::cast_slice(samples));
            }
        }
    }
    if cfg!(target_endian = "big") {
        bytes.chunks_exact_mut(depth.bytes()).for_each(<[u8]>::reverse);
    }
    (bytes, tally)
}
