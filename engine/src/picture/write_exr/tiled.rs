//! OpenEXR in tiles with mip levels, as renderers read textures piece by piece.
//!
//! All levels grow together while the rows of the picture come, so tiles lie in the file in the order in which they are
//! complete; the table at the beginning tells where.
use super::super::encode::{Rows, Tally, halves, range_of};
use super::super::lossless::Zlib;
use super::super::mips::{Pyramid, sizes};
use super::super::spec::{Depth, PictureSpec};
use super::{attributes, channels, chromaticities, header_bytes, packed};
use exr::compression::Compression as Method;
use exr::math::{RoundingMode, Vec2};
use exr::meta::BlockDescription;
use exr::meta::attribute::{LevelMode, LineOrder, Text, TileDescription};
use exr::meta::header::Header;
use half::slice::HalfFloatSliceExt;
use rayon::prelude::*;
use std::io::{self, Seek, SeekFrom, Write};

/// The side of a tile in pixels.
const SIDE: u32 = 64;

/// A picture with all its levels under construction.
pub(in crate::picture) struct TiledSink<W> {
    output: W,
    depth: Depth,
    zlib: Zlib,
    pyramid: Pyramid,
    /// Indices of the channels in the order of the file.
    order: Vec<usize>,
    levels: Vec<Level>,
    /// Where the table of tiles begins.
    table: u64,
    position: u64,
    /// Place of each tile.
    places: Vec<u64>,
}

/// Rows of a level that do not make a row of tiles yet.
struct Level {
    width: u32,
    height: u32,
    /// The number of its first tile in the table.
    first: usize,
    /// Rows of tiles that are written.
    written: u32,
    /// Per channel.
    rows: Vec<Vec<f32>>,
}

impl Level {
    fn waiting(&self) -> u32 {
        let samples = self.rows.first().map_or(0, Vec::len) / self.width as usize;
        u32::try_from(samples).unwrap_or(u32::MAX)
    }

    /// Whether a row of tiles is complete.
    fn is_due(&self) -> bool {
        let waiting = self.waiting();
        waiting == SIDE || (waiting > 0 && self.written * SIDE + waiting == self.height)
    }
}

impl<W: Write + Seek> TiledSink<W> {
    pub(in crate::picture) fn new(mut output: W, spec: &PictureSpec) -> io::Result<Self> {
        let size = (spec.width as usize, spec.height as usize);
        let mut header = Header::new(Text::default(), size, channels(spec));
        header.own_attributes.layer_name = None;
        header.shared_attributes.chromaticities = spec.chromaticities.map(chromaticities);
        let side = SIDE as usize;
        let tiles = TileDescription {
            tile_size: Vec2(side, side),
            level_mode: LevelMode::MipMap,
            rounding_mode: RoundingMode::Down,
        };
        let header = header.with_encoding(Method::ZIP16, BlockDescription::Tiles(tiles), LineOrder::Unspecified);
        let mut start = header_bytes(&header).map_err(io::Error::other)?;
        attributes(&mut start, &spec.metadata)?;
        let table = start.len() as u64;
        // Zeros until the end: a reader knows that the file is incomplete.
        start.resize(start.len() + header.chunk_count * 8, 0);
        output.write_all(&start)?;
        let mut first = 0;
        let mut levels = Vec::new();
        for (width, height) in sizes(spec.width, spec.height) {
            let rows = vec![Vec::new(); spec.channels.len()];
            levels.push(Level { width, height, first, written: 0, rows });
            first += (width.div_ceil(SIDE) * height.div_ceil(SIDE)) as usize;
        }
        let mut order: Vec<usize> = (0..spec.channels.len()).collect();
        order.sort_by_key(|index| &spec.channels[*index]);
        Ok(Self {
            output,
            depth: spec.depth,
            zlib: Zlib::new(spec.compression),
            pyramid: Pyramid::new(&spec.mips, spec.width, spec.height),
            order,
            levels,
            table,
            position: start.len() as u64,
            places: vec![0; first],
        })
    }

    pub(in crate::picture) fn write(&mut self, rows: Rows<'_>) -> io::Result<Tally> {
        let width = self.levels[0].width as usize;
        let mut tally = Tally::default();
        for row in 0..rows.count as usize {
            let planes: Vec<&[f32]> = rows.planes.iter().map(|plane| &plane[row * width..][..width]).collect();
            for (waiting, plane) in self.levels[0].rows.iter_mut().zip(&planes) {
                waiting.extend_from_slice(plane);
            }
            let levels = &mut self.levels;
            self.pyramid.push(&planes, |level, channels| {
                levels[level].rows.iter_mut().zip(channels).for_each(|(waiting, row)| waiting.extend_from_slice(row));
            });
            for level in 0..self.levels.len() {
                if self.levels[level].is_due() {
                    let found = self.write_tiles(level)?;
                    // What the smaller levels hold follows from the picture.
                    tally = if level == 0 { tally.with(found) } else { tally };
                }
            }
        }
        Ok(tally)
    }

    /// Compresses and writes the rows of a level that wait.
    fn write_tiles(&mut self, index: usize) -> io::Result<Tally> {
        let count = self.levels[index].waiting();
        let level = &self.levels[index];
        let across = level.width.div_ceil(SIDE);
        let (zlib, order, depth) = (&self.zlib, &self.order, self.depth);
        let made = |x| {
            let (bytes, tally) = tile(level, (x, count), order, depth);
            (packed(&bytes, zlib), tally)
        };
        let tiles: Vec<(Vec<u8>, Tally)> = (0..across).into_par_iter().map(made).collect();
        let mut tally = Tally::default();
        let (y, first) = (level.written, level.first + (level.written * across) as usize);
        for (x, (tile, found)) in (0..across).zip(tiles) {
            tally = tally.with(found);
            let level = u32::try_from(index).map_err(io::Error::other)?;
            let length = u32::try_from(tile.len()).map_err(io::Error::other)?;
            self.output.write_all(&[x, y, level, level, length].map(u32::to_le_bytes).concat())?;
            self.output.write_all(&tile)?;
            self.places[first + x as usize] = self.position;
            self.position += 20 + tile.len() as u64;
        }
        let level = &mut self.levels[index];
        level.written += 1;
        level.rows.iter_mut().for_each(Vec::clear);
        Ok(tally)
    }

    pub(in crate::picture) fn finish(mut self) -> io::Result<()> {
        let table: Vec<u8> = self.places.iter().flat_map(|place| place.to_le_bytes()).collect();
        self.output.seek(SeekFrom::Start(self.table))?;
        self.output.write_all(&table)?;
        self.output.flush()
    }
}

/// The bytes of a tile, row by row and within it channel by channel, and what became of the samples.
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
