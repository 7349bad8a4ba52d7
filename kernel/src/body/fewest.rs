//! Few triangles: samples are inserted into a Delaunay triangulation of each block until no place is over the error.
//!
//! The sides of blocks are simplified first, so both blocks of a side start with the same vertices. If an edge crosses
//! the line between a sample of a side and a vertex beside it, only that sample can help. It is then added to the side,
//! and the block on its other side is triangulated again.
use super::heights::{BLOCK, Heights, cuts};
use super::patch::{Patch, Spot, Tolerance};
use super::scan::{self, Taken, Worst};
use super::sides::{Side, simplify};
use super::table::Table;
use super::tiles::{Mesh, Tiles};
use rayon::prelude::*;
use std::cmp::Ordering;
use std::collections::{BTreeSet, BinaryHeap};

/// Triangulates a height field so that it is within the tolerance at all samples, and wherever an edge crosses a line
/// between neighbouring samples. `None` if `stop` returns true.
pub fn fewest(heights: &Heights, tolerance: Tolerance, stop: &(dyn Fn() -> bool + Sync)) -> Option<Tiles> {
    let [columns, rows] = heights.size().map(|count| cuts(count - 1, BLOCK));
    let mut tiles = Tiles::new(columns, rows, heights.repeats);
    let [across, down] = tiles.count();
    let mut sides = first_sides(heights, tolerance, &tiles);
    let mut waiting: Vec<usize> = (0..across * down).collect();
    while !waiting.is_empty() {
        let made: Vec<Option<Mesh>> = waiting
            .par_iter()
            .map_init(Work::default, |work, block| {
                if stop() {
                    return None;
                }
                let kept = tiles.sides_of(*block).map(|side| sides[side].as_slice());
                Some(work.block(heights, tolerance, tiles.columns(*block), tiles.rows(*block), kept))
            })
            .collect();
        for (block, mesh) in waiting.iter().zip(made) {
            tiles.meshes[*block] = mesh?;
        }
        let mut again = BTreeSet::new();
        for block in &waiting {
            for (side, own) in tiles.sides_of(*block).into_iter().zip(tiles.meshes[*block].on_sides()) {
                if sides[side] != own {
                    sides[side].extend(own);
                    sides[side].sort_unstable();
                    sides[side].dedup();
                }
            }
        }
        for block in 0..across * down {
            let own = tiles.meshes[block].on_sides();
            if tiles.sides_of(block).into_iter().zip(&own).any(|(side, own)| sides[side] != *own) {
                again.insert(block);
            }
        }
        waiting = again.into_iter().collect();
    }
    Some(tiles)
}

/// The vertices of all sides of blocks.
fn first_sides(heights: &Heights, tolerance: Tolerance, tiles: &Tiles) -> Vec<Vec<u8>> {
    let made = |side: usize| {
        let (side, from) = tiles.side(side);
        let count = side.1 - side.0;
        let sample = |index: usize| match from {
            Side::Row(row) => f64::from(heights.at(side.0 + index, row)),
            Side::Column(column) => f64::from(heights.at(column, side.0 + index)),
        };
        let places = match from {
            Side::Row(_) => &heights.across[side.0..=side.1],
            Side::Column(_) => &heights.down[side.0..=side.1],
        };
        let line: Vec<f64> = (0..=count).map(sample).collect();
        simplify(&line, places, tolerance, matches!(from, Side::Row(_)))
    };
    (0..tiles.side_count()).into_par_iter().map(made).collect()
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
    fn block(
        &mut self,
        heights: &Heights,
        tolerance: Tolerance,
        columns: [usize; 2],
        rows: [usize; 2],
        kept: [&[u8]; 4],
    ) -> Mesh {
        let patch = self.patch.get_or_insert_with(|| Box::new(Patch::new(tolerance)));
        patch.load(heights, columns, rows);
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
        let error = |triangle: u32| scan::reached(patch, table.triangle(triangle), self.states[triangle as usize].1);
        let error = (0..table.len()).map(error).fold(0.0, f64::max);
        let size = [patch.width, patch.height].map(|at| u8::try_from(at).unwrap_or(u8::MAX));
        Mesh { spots: table.spots.clone(), triangles, error, size }
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
