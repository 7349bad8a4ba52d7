//! The rows of all levels of a picture in tiles, until they make rows of tiles.
use super::encode::{Rows, Tally};
use super::mips::{Pyramid, sizes};
use super::spec::PictureSpec;
use std::io;

/// The side of a tile in pixels.
pub(super) const SIDE: u32 = 64;

/// A picture with all its levels under construction: they grow together while the rows of the picture come.
pub(super) struct Levels {
    pyramid: Pyramid,
    levels: Vec<Level>,
    /// The channels of the picture; what else comes is for smaller levels only.
    channels: usize,
}

/// Rows of a level that do not make a row of tiles yet.
pub(super) struct Level {
    pub(super) width: u32,
    pub(super) height: u32,
    /// The number of its first tile among those of all levels.
    pub(super) first: usize,
    /// Rows of tiles that are complete.
    pub(super) done: u32,
    /// Per channel.
    pub(super) rows: Vec<Vec<f32>>,
}

impl Level {
    /// Tiles in a row of them.
    pub(super) fn across(&self) -> u32 {
        self.width.div_ceil(SIDE)
    }

    fn waiting(&self) -> u32 {
        let samples = self.rows.first().map_or(0, Vec::len) / self.width as usize;
        u32::try_from(samples).unwrap_or(u32::MAX)
    }

    /// How many of the rows that wait make a row of tiles, if they do.
    fn due(&self) -> Option<u32> {
        let (waiting, missing) = (self.waiting(), self.height - self.done * SIDE);
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

    /// The tiles of all levels.
    pub(super) fn tiles(&self) -> usize {
        self.levels.last().map_or(0, |level| level.first + (level.across() * level.height.div_ceil(SIDE)) as usize)
    }

    /// Takes rows of the picture. What makes a row of tiles is packed, tile by tile, and then written: with the number of its
    /// level and that level. Nothing depends on how many rows come at once.
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
            // The smaller levels follow from the rows of the picture, not from their tiles.
            let (packed, ()) = rayon::join(|| due.map(|count| (count, pack(0, whole, count))), shrink);
            if let Some((count, (tiles, found))) = packed {
                write(0, whole, tiles)?;
                whole.take(count);
                tally = tally.with(found);
            }
            for (index, level) in (1..).zip(smaller) {
                while let Some(count) = level.due() {
                    // What they hold follows from the picture.
                    let (tiles, _) = pack(index, level, count);
                    write(index, level, tiles)?;
                    level.take(count);
                }
            }
        }
        Ok(tally)
    }
}
