//! TIFF with tiles and mip levels. Each level has its own directory, after that of the level before, as `maketx` writes
//! them.
use super::super::encode::{RowEncoder, Rows, Tally};
use super::super::levels::{Level, Levels, SIDE};
use super::super::lossless::Zlib;
use super::super::spec::PictureSpec;
use super::{Blocks, begin, compress, directory, end};
use rayon::prelude::*;
use std::io::{self, Seek, Write};

/// A picture and its mip levels under construction.
pub(crate) struct TiledSink<W> {
    output: W,
    spec: PictureSpec,
    zlib: Zlib,
    /// True if offsets have 64 bits.
    big: bool,
    levels: Levels,
    /// One encoder for each level.
    encoders: Vec<RowEncoder>,
    position: u64,
    /// Offset and length of each tile.
    tiles: Vec<(u64, u64)>,
}

impl<W: Write + Seek> TiledSink<W> {
    pub(crate) fn new(mut output: W, spec: &PictureSpec) -> io::Result<Self> {
        let levels = Levels::new(spec);
        let tile = u64::from(SIDE * SIDE) * (spec.channels.len() * spec.depth.bytes()) as u64;
        let (big, position) = begin(&mut output, tile * levels.tiles() as u64)?;
        let encoder = |level: &Level| RowEncoder::new(&PictureSpec { width: level.width, ..spec.clone() });
        let (encoders, tiles) = (levels.iter().map(encoder).collect(), vec![(0, 0); levels.tiles()]);
        Ok(Self {
            output,
            spec: spec.clone(),
            zlib: Zlib::new(spec.compression),
            big,
            levels,
            encoders,
            position,
            tiles,
        })
    }

    pub(crate) fn write(&mut self, rows: Rows<'_>) -> io::Result<Tally> {
        let Self { output, spec, zlib, levels, encoders, position, tiles: places, .. } = self;
        let (spec, zlib, encoders) = (&*spec, &*zlib, &*encoders);
        let pixel = spec.channels.len() * spec.depth.bytes();
        let pack = |index: usize, level: &Level, count| {
            let planes: Vec<&[f32]> = level.rows.iter().map(|plane| &plane[..(count * level.width) as usize]).collect();
            let mut bytes = Vec::new();
            let tally = encoders[index].encode(Rows { planes: &planes, first: level.done * SIDE, count }, &mut bytes);
            let made =
                |x| compress(&mut tile(&bytes, level.width as usize * pixel, x, pixel), row_bytes(pixel), spec, zlib);
            ((0..level.across() as usize).into_par_iter().map(made).collect(), tally)
        };
        levels.push(rows, pack, |_, level, tiles| {
            let first = level.first + (level.done * level.across()) as usize;
            for (tile, place) in tiles.into_iter().zip(&mut places[first..]) {
                output.write_all(&tile)?;
                *place = (*position, tile.len() as u64);
                *position += tile.len() as u64;
            }
            Ok(())
        })
    }

    pub(crate) fn finish(mut self) -> io::Result<()> {
        let directories = self.levels.iter().map(|level| {
            let count = (level.across() * level.height.div_ceil(SIDE)) as usize;
            let blocks = Blocks::Tiles { reduced: level.first > 0, places: &self.tiles[level.first..][..count] };
            directory(&self.spec, self.big, (level.width, level.height), &blocks)
        });
        let directories: Vec<_> = directories.collect();
        end(&mut self.output, self.big, self.position, &directories)
    }
}

/// The bytes of a row of a tile.
fn row_bytes(pixel: usize) -> usize {
    SIDE as usize * pixel
}

/// A tile from a row of tiles. Pixels beyond the picture repeat its edge, which compresses best.
fn tile(rows: &[u8], line: usize, x: usize, pixel: usize) -> Vec<u8> {
    let (side, start) = (SIDE as usize, x * row_bytes(pixel));
    let mut bytes = Vec::with_capacity(side * row_bytes(pixel));
    for row in rows.chunks_exact(line) {
        let own = &row[start..(start + row_bytes(pixel)).min(line)];
        bytes.extend_from_slice(own);
        let missing = side - own.len() / pixel;
        bytes.extend(own[own.len() - pixel..].iter().copied().cycle().take(missing * pixel));
    }
    while bytes.len() < side * row_bytes(pixel) {
        bytes.extend_from_within(bytes.len() - row_bytes(pixel)..);
    }
    bytes
}
