//! Buffers the rows of all mip levels until they fill rows of tiles.
use super::encode::{Rows, Tally};
use super::mips::{Pyramid, sizes};
use super::spec::PictureSpec;
use std::io;

/// The side of a tile in pixels.
pub(super) const SIDE: u32 = 64;

/// A picture and its mip levels under construction: all levels grow while the rows of the picture arrive.
pub(super) struct Levels {
    pyramid: Pyramid,
    levels: Vec<Level>,
    /// Number of channels of the picture. Further planes are used only by the smaller levels.
    channels: usize,
}

/// Buffered rows of a level that do not fill a row of tiles yet.
pub(super) struct Level {
    pub(super) width: u32,
    pub(super) height: u32,
    /// Index of its first tile among the tiles of all levels.
    pub(super) first: usize,
    /// Number of complete rows of tiles.
    pub(super) done: u32,
    /// The buffered rows, per channel.
    pub(super) rows: Vec<Vec<f32>>,
}

impl Level {
    /// Number of tiles in a row.
    pub(super) fn across(&self) -> u32 {
        self.width.div_ceil(SIDE)
    }

    fn waiting(&self) -> u32 {
        let samples = self.rows.first().map_or(0, Vec::len) / self.width as usize;
        u32::try_from(samples).unwrap_or(u32::MAX)
    }

    /// Number of buffered rows that form the next row of tiles, if it is complete.
    fn due(&self) -> Option<u32> {
        let (waiting, missing) = (self.waiting(), self.height.saturating_sub(self.done * SIDE));
        let wanted = missing.min(SIDE);
        (wanted > 0 && waiting >= wanted).then_some(wanted)
    }

    fn take(&mut self, rows: u32) {
        let samples = rows as usize * self.width as usize;
        self.rows.iter_mut().for_each(|plane| drop(plane.drain(..samples)));
        self.done += 1;
    }
}

impl Levels {
    pub(super) fn new(spec: &PictureSpec) -> Self {
        let mut first = 0;
        let mut levels = Vec::new();
        for (width, height) in sizes(spec.width, spec.height) {
            let rows = vec![Vec::new(); spec.channels.len()];
            let level = Level { width, height, first, done: 0, rows };
            first += (level.across() * height.div_ceil(SIDE)) as usize;
            levels.push(level);
        }
        let pyramid = Pyramid::new(&spec.mips, spec.width, spec.height);
        Self { pyramid, levels, channels: spec.channels.len() }
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &Level> {
        self.levels.iter()
    }

    /// Number of tiles of all levels.
    pub(super) fn tiles(&self) -> usize {
        self.levels.last().map_or(0, |level| level.first + (level.across() * level.height.div_ceil(SIDE)) as usize)
    }

    /// Takes rows of the picture. A complete row of tiles is packed tile by tile, and then written: `write` gets the
    /// index of the level, the level and the tiles. The result does not depend on how many rows come at once.
    pub(super) fn push(
        &mut self,
        rows: Rows<'_>,
        pack: impl Fn(usize, &Level, u32) -> (Vec<Vec<u8>>, Tally) + Sync,
        mut write: impl FnMut(usize, &Level, Vec<Vec<u8>>) -> io::Result<()>,
    ) -> io::Result<Tally> {
        let width = self.levels[0].width as usize;
        let mut tally = Tally::default();
        let mut from = 0;
        while from < rows.count {
            let count = (SIDE - (rows.first + from) % SIDE).min(rows.count - from);
            let [start, end] = [from, from + count].map(|row| row as usize * width);
            let planes: Vec<&[f32]> = rows.planes.iter().map(|plane| &plane[start..end]).collect();
            from += count;
            let Some((whole, smaller)) = self.levels.split_first_mut() else { break };
            whole.rows.iter_mut().zip(&planes[..self.channels]).for_each(|(own, plane)| own.extend_from_slice(plane));
            let (due, pyramid) = (whole.due(), &mut self.pyramid);
            let shrink = || {
                for row in 0..count as usize {
                    let planes: Vec<&[f32]> = planes.iter().map(|plane| &plane[row * width..][..width]).collect();
                    pyramid.push(&planes, |level, channels| {
                        let own = smaller[level - 1].rows.iter_mut().zip(channels);
                        own.for_each(|(own, row)| own.extend_from_slice(row));
                    });
                }
            };
            // The smaller levels are computed from the rows of the picture, so packing can run in parallel.
            let (packed, ()) = rayon::join(|| due.map(|count| (count, pack(0, whole, count))), shrink);
            if let Some((count, (tiles, found))) = packed {
                write(0, whole, tiles)?;
                whole.take(count);
                tally = tally.with(found);
            }
            for (index, level) in (1..).zip(smaller) {
                while let Some(count) = level.due() {
                    // The statistics of smaller levels are not counted.
                    let (tiles, _) = pack(index, level, count);
                    write(index, level, tiles)?;
                    level.take(count);
                }
            }
        }
        Ok(tally)
    }
}
