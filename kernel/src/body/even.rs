//! Even triangles: right triangles whose longest edge is halved until no place is over the error (right-triangulated
//! irregular network, Evans, Kirkpatrick and Townsend 1997).
//!
//! The error of a post is the largest one of the triangles halved there and of all smaller ones below them. One pass
//! over all sizes of triangles therefore gives the triangles for any error.
use super::block::Mesh;
use super::heights::{BLOCK, Band, Heights, cuts};
use super::patch::Tolerance;
use super::posts::Block;
use super::store::Store;
use super::tiles::{Room, Tiles};
use rayon::prelude::*;
use std::io;
use std::ops::Range;

/// The errors of all posts of a height field.
#[derive(Debug)]
pub struct Even {
    tiles: Tiles,
    /// Number of intervals between posts of a block.
    posts: usize,
    /// For each block, the least error at which a post is no vertex, row by row.
    errors: Box<dyn Store>,
    /// Errors of the middles of sides, which blocks do not have yet.
    pending: Option<Joined>,
}

/// The larger errors of both blocks of a side, for the middles of sides with `size` posts.
#[derive(Debug)]
struct Joined {
    size: usize,
    errors: Vec<f32>,
    /// True if the blocks of a side have different errors.
    differ: bool,
}

/// Makes stores for triangles and errors.
pub type Stores<'a> = &'a (dyn Fn() -> Box<dyn Store> + Sync);

impl Even {
    /// Measures all triangles. The tolerance states whether the field is bent; its error does not matter.
    ///
    /// # Errors
    /// Those of the rows of the field and of the stores; [`Interrupted`](io::ErrorKind::Interrupted) if `stop` returns
    /// true.
    pub fn new(
        heights: &Heights<'_>,
        tolerance: Tolerance,
        stores: Stores<'_>,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> io::Result<Self> {
        // Shares of an error of 1 mm are errors in mm.
        let tolerance = Tolerance { error: 1.0, ..tolerance };
        let intervals = heights.size().map(|count| count - 1);
        let mut posts = BLOCK;
        while posts > 2 && intervals.iter().any(|count| posts / 2 >= *count) {
            posts /= 2;
        }
        let [columns, rows] = intervals.map(|count| cuts(count, posts));
        let tiles = Tiles::new(columns, rows, heights.repeats, (stores(), 0));
        let mut even = Self { tiles, posts, errors: stores(), pending: None };
        let [across, down] = even.tiles.count();
        let none = vec![0_u8; across * even.count() * size_of::<f32>()];
        for _ in 0..down {
            even.errors.add(&none)?;
        }
        let mut each = |join: Option<usize>, work: Work<'_>| {
            let changed = even.each(heights, tolerance, join, stop, work)?;
            Ok::<_, io::Error>(changed || even.pending.as_ref().is_some_and(|joined| joined.differ))
        };
        each(Some(2), &|block, errors| {
            block.sides(errors, 2);
            false
        })?;
        // Blocks change each other until none changes.
        let mut first = true;
        while each(Some(2), &|block, errors| {
            if first {
                block.halves(errors, 2);
            } else {
                block.depend(errors, 2);
            }
            let changed = block.share(errors);
            block.depend(errors, 2);
            changed
        })? {
            first = false;
        }
        // Squares need what both blocks know of their sides, so each size is a pass.
        let mut size = 4;
        while size <= 2 * posts && posts > 2 {
            let is_last = size > posts;
            each((!is_last).then_some(size), &|block, errors| {
                if size > 4 {
                    block.halves(errors, size / 2);
                }
                if !is_last {
                    block.sides(errors, size);
                }
                false
            })?;
            size *= 2;
        }
        Ok(even)
    }

    /// Number of posts of a block.
    fn count(&self) -> usize {
        (self.posts + 1) * (self.posts + 1)
    }

    /// Does the same with all blocks. Returns true if it does so for one of them. With `join`, the blocks of a side get
    /// the larger error of both at the middles of sides with so many posts, before the next work.
    fn each(
        &mut self,
        heights: &Heights<'_>,
        tolerance: Tolerance,
        join: Option<usize>,
        stop: &(dyn Fn() -> bool + Sync),
        work: Work<'_>,
    ) -> io::Result<bool> {
        let pending = self.pending.take();
        let posts = self.posts;
        let mut joined = join.map(|size| Joined {
            size,
            errors: vec![f32::NAN; self.tiles.side_count() * (posts / size)],
            differ: false,
        });
        let mut any = false;
        for part in heights.parts(&self.tiles.rows) {
            let (blocks, band, mut errors) = self.load(heights, part)?;
            if stop() {
                return Err(io::ErrorKind::Interrupted.into());
            }
            let tiles = &self.tiles;
            let one = |(index, errors): (usize, &mut [f32])| {
                let block = blocks.start + index;
                if let Some(pending) = &pending {
                    pending.give(tiles.sides_of(block), errors, posts);
                }
                work(&Block::new(heights, &band, tolerance, (tiles, block), posts), errors)
            };
            let done: Vec<bool> = errors.par_chunks_mut(self.count()).enumerate().map(one).collect();
            any |= done.contains(&true);
            if let Some(joined) = &mut joined {
                for (block, errors) in blocks.clone().zip(errors.chunks(self.count())) {
                    joined.take(tiles.sides_of(block), errors, posts);
                }
            }
            self.errors.replace(self.place(blocks.start), bytemuck::cast_slice(&errors))?;
        }
        self.pending = joined;
        Ok(any)
    }

    /// The blocks of some rows of blocks, their samples, and their errors.
    fn load(&self, heights: &Heights<'_>, part: Range<usize>) -> io::Result<(Range<usize>, Band, Vec<f32>)> {
        let across = self.tiles.count()[0];
        let blocks = part.start * across..part.end * across;
        let band = heights.band(self.tiles.rows[part.start], self.tiles.rows[part.end])?;
        let mut errors = vec![0.0_f32; blocks.len() * self.count()];
        self.errors.read(self.place(blocks.start), bytemuck::cast_slice_mut(&mut errors))?;
        Ok((blocks, band, errors))
    }

    /// The place of the errors of a block.
    fn place(&self, block: usize) -> u64 {
        (block * self.count() * size_of::<f32>()) as u64
    }

    /// The triangles at an error in mm.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn mesh(
        &self,
        heights: &Heights<'_>,
        tolerance: Tolerance,
        room: Room,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> io::Result<Tiles> {
        let (columns, rows) = (self.tiles.columns.clone(), self.tiles.rows.clone());
        let mut tiles = Tiles::new(columns, rows, heights.repeats, room);
        for part in heights.parts(&self.tiles.rows) {
            let (blocks, band, errors) = self.load(heights, part)?;
            if stop() {
                return Err(io::ErrorKind::Interrupted.into());
            }
            let one = |(index, errors): (usize, &[f32])| {
                let of = (&self.tiles, blocks.start + index);
                Block::new(heights, &band, tolerance, of, self.posts).mesh(errors, tolerance.error)
            };
            let made: Vec<(Mesh, f64)> = errors.par_chunks(self.count()).enumerate().map(one).collect();
            for (block, (mesh, error)) in blocks.zip(made) {
                tiles.set(block, &mesh, error)?;
            }
        }
        Ok(tiles)
    }
}

/// Work on the errors of a block.
type Work<'a> = &'a (dyn Fn(&Block, &mut [f32]) -> bool + Sync);

impl Joined {
    /// The post at the middle of each piece of a side: top, bottom, left, right.
    fn middles(&self, side: usize, posts: usize) -> impl Iterator<Item = usize> + use<> {
        let (from, step) = match side {
            0 => (0, 1),
            1 => (posts * (posts + 1), 1),
            2 => (0, posts + 1),
            _ => (posts, posts + 1),
        };
        (self.size / 2..posts).step_by(self.size).map(move |at| from + at * step)
    }

    /// Takes the errors of a block, if they are larger.
    fn take(&mut self, sides: [usize; 4], errors: &[f32], posts: usize) {
        let count = posts / self.size;
        for (own, side) in sides.into_iter().enumerate() {
            for (index, post) in self.middles(own, posts).enumerate() {
                let known = &mut self.errors[side * count + index];
                self.differ |= !known.is_nan() && *known != errors[post];
                *known = known.max(errors[post]);
            }
        }
    }

    /// Gives the larger errors to a block.
    fn give(&self, sides: [usize; 4], errors: &mut [f32], posts: usize) {
        let count = posts / self.size;
        for (own, side) in sides.into_iter().enumerate() {
            for (known, post) in self.errors[side * count..].iter().zip(self.middles(own, posts)) {
                errors[post] = errors[post].max(*known);
            }
        }
    }
}
