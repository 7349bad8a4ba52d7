//! Few triangles: samples are inserted into a Delaunay triangulation of each block until no place is over the error.
//!
//! The sides of blocks are simplified first, so both blocks of a side start with the same vertices. If an edge crosses
//! the line between a sample of a side and a vertex beside it, only that sample can help. It is then added to the side,
//! and the block on its other side is triangulated again.
use super::block::Mesh;
use super::heights::{BLOCK, Band, Heights, cuts};
use super::patch::{Patch, Spot, Tolerance};
use super::scan::{self, Taken, Worst};
use super::sides::{Side, simplify};
use super::table::Table;
use super::tiles::{Room, Tiles};
use rayon::prelude::*;
use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::io;
use std::ops::Range;

/// Triangulates a height field so that it is within the tolerance at all samples, and wherever an edge crosses a line
/// between neighbouring samples. The triangles lie in `store`.
///
/// # Errors
/// Those of the rows of the field and of the store; [`Interrupted`](io::ErrorKind::Interrupted) if `stop` returns true.
pub fn fewest(
    heights: &Heights<'_>,
    tolerance: Tolerance,
    room: Room,
    stop: &(dyn Fn() -> bool + Sync),
) -> io::Result<Tiles> {
    let [columns, rows] = heights.size().map(|count| cuts(count - 1, BLOCK));
    let mut tiles = Tiles::new(columns, rows, heights.repeats, room);
    let [across, down] = tiles.count();
    let mut sides = first_sides(heights, tolerance, &tiles)?;
    let mut waiting: Vec<usize> = (0..across * down).collect();
    while !waiting.is_empty() {
        let mut rest = &waiting[..];
        while let Some(first) = rest.first() {
            let from = first / across;
            let to = heights.part(&tiles.rows, from);
            let (part, later) = rest.split_at(rest.partition_point(|block| *block < to * across));
            let band = heights.band(tiles.rows[from], tiles.rows[to])?;
            let one = |work: &mut Work, block: &usize| {
                if stop() {
                    return Err(io::ErrorKind::Interrupted.into());
                }
                let kept = tiles.sides_of(*block).map(|side| sides[side].as_slice());
                Ok(work.block(heights, &band, tolerance, tiles.columns(*block), tiles.rows(*block), kept))
            };
            let made: Vec<io::Result<(Mesh, f64)>> = part.par_iter().map_init(Work::default, one).collect();
            for (block, made) in part.iter().zip(made) {
                let (mesh, error) = made?;
                tiles.set(*block, &mesh, error)?;
            }
            rest = later;
        }
        for block in &waiting {
            for (side, own) in tiles.sides_of(*block).into_iter().zip(tiles.on_sides(*block)) {
                if sides[side] != own {
                    sides[side].extend(own);
                    sides[side].sort_unstable();
                    sides[side].dedup();
                }
            }
        }
        let changed = |block: &usize| {
            tiles.sides_of(*block).into_iter().zip(tiles.on_sides(*block)).any(|(side, own)| sides[side] != own)
        };
        waiting = (0..across * down).filter(changed).collect();
    }
    Ok(tiles)
}

/// The vertices of all sides of blocks.
fn first_sides(heights: &Heights<'_>, tolerance: Tolerance, tiles: &Tiles) -> io::Result<Vec<Vec<u8>>> {
    let across = tiles.count()[0];
    let mut sides = vec![Vec::new(); tiles.side_count()];
    for Range { start: from, end: to } in heights.parts(&tiles.rows) {
        let band = heights.band(tiles.rows[from], tiles.rows[to])?;
        let made = |side: usize| {
            let (span, line) = tiles.side(side);
            let sample = |index: usize| match line {
                Side::Row(row) => f64::from(band.row(row)[index]),
                Side::Column(column) => f64::from(band.row(index)[column]),
            };
            let places = match line {
                Side::Row(_) => &heights.across[span.0..=span.1],
                Side::Column(_) => &heights.down[span.0..=span.1],
            };
            let line_of: Vec<f64> = (span.0..=span.1).map(sample).collect();
            (side, simplify(&line_of, places, tolerance, matches!(line, Side::Row(_))))
        };
        // The sides of these blocks; those of the lowest row once more with the next part.
        let blocks = from * across..to * across;
        let mut own: Vec<usize> = blocks.flat_map(|block| tiles.sides_of(block)).collect();
        own.sort_unstable();
        own.dedup();
        // Opposite rims that repeat have one side, with the samples of the first row.
        own.retain(|side| !matches!(tiles.side(*side).1, Side::Row(row) if row < tiles.rows[from]));
        let made: Vec<(usize, Vec<u8>)> = own.into_par_iter().map(made).collect();
        made.into_iter().for_each(|(side, kept)| sides[side] = kept);
    }
    Ok(sides)
}

/// A triangle that is over the error.
#[derive(Clone, Copy, Debug)]
struct Waiting {
    worst: Worst,
    triangle: u32,
    /// The number of changes of the triangle when it was measured.
    change: u32,
}

impl Ord for Waiting {
    fn cmp(&self, other: &Self) -> Ordering {
        let place = |waiting: &Self| (waiting.worst.spot[1], waiting.worst.spot[0], waiting.triangle, waiting.change);
        self.worst.share.total_cmp(&other.worst.share).then_with(|| place(other).cmp(&place(self)))
    }
}

impl PartialOrd for Waiting {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Waiting {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Waiting {}

/// Memory for the work on one block after another.
#[derive(Default)]
struct Work {
    patch: Option<Box<Patch>>,
    table: Table,
    heap: BinaryHeap<Waiting>,
    /// Number of changes, and worst share, of each triangle.
    states: Vec<(u32, f64)>,
}

impl Work {
    /// The triangles of a block, and their largest distance to the field.
    fn block(
        &mut self,
        heights: &Heights<'_>,
        band: &Band,
        tolerance: Tolerance,
        columns: [usize; 2],
        rows: [usize; 2],
        kept: [&[u8]; 4],
    ) -> (Mesh, f64) {
        let patch = self.patch.get_or_insert_with(|| Box::new(Patch::new(tolerance)));
        patch.load(heights, band, columns, rows);
        let patch: &Patch = patch;
        let table = &mut self.table;
        table.start(patch);
        self.heap.clear();
        self.states.clear();
        for (side, kept) in kept.into_iter().enumerate() {
            for at in kept {
                table.insert(patch, on_side(patch, side, *at), table.len() - 1);
            }
        }
        loop {
            let mut changed = std::mem::take(&mut table.changed);
            self.states.resize(table.len() as usize, (0, 0.0));
            for triangle in &changed {
                self.states[*triangle as usize].0 += 1;
            }
            changed.sort_unstable();
            changed.dedup();
            for triangle in changed.drain(..) {
                let worst = scan::worst(patch, table, table.triangle(triangle));
                let state = &mut self.states[triangle as usize];
                state.1 = worst.share;
                if worst.share > 1.0 {
                    self.heap.push(Waiting { worst, triangle, change: state.0 });
                }
            }
            table.changed = changed;
            let next = loop {
                match self.heap.pop() {
                    Some(next) if self.states[next.triangle as usize].0 == next.change => break Some(next),
                    Some(_) => {}
                    None => break None,
                }
            };
            let Some(next) = next else { break };
            // The sample beside a crossing may lie in another triangle. It may then be a vertex by now, and this triangle
            // may stay as it is, so it is measured again in any case.
            let [column, row] = next.worst.spot.map(usize::from);
            if !table.taken(column, row) {
                table.insert(patch, next.worst.spot, next.triangle);
            }
            table.changed.push(next.triangle);
        }
        let triangles: Vec<[u16; 3]> = (0..table.len()).map(|triangle| table.numbers(triangle)).collect();
        // For a roll, an upper bound: a share may be that of the bow alone.
        let share = (0..table.len()).map(|triangle| self.states[triangle as usize].1).fold(0.0, f64::max);
        let error = share * tolerance.error;
        let size = [patch.width, patch.height].map(|at| u8::try_from(at).unwrap_or(u8::MAX));
        let spots = table.spots.clone();
        (Mesh { heights: patch.heights(&spots), spots, triangles, size }, error)
    }
}

/// The sample of a side: top, bottom, left, right.
fn on_side(patch: &Patch, side: usize, at: u8) -> Spot {
    let [right, bottom] = [patch.width, patch.height].map(|at| u8::try_from(at).unwrap_or(u8::MAX));
    match side {
        0 => [at, 0],
        1 => [at, bottom],
        2 => [0, at],
        _ => [right, at],
    }
}
