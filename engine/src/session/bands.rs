//! Computes pictures block by block and writes them.
//!
//! The [`Order`] of the blocks is chosen so that the tiles to be read again fit the memory. Strips of one picture hand
//! over their overlap to each other in temporary files beside the picture.
use super::job::Job;
use super::render::Render;
use super::sink::{Assembler, Sink};
use super::{Failure, located};
use crate::diagnostics::{Code, Diagnostic};
use crate::eval::{Demand, Event, Fields, Gathered, Neighbor, Order, OverlapStore, Pass, Store, Warnings};
use crate::value::{Field, Grid, Tile, Window};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

/// Strips or parts that are at most this many numbers apart hand over their overlap.
const NEAR: usize = 2;

impl Render<'_, '_> {
    /// Computes and writes all pictures together, so that shared fields are still in memory. Returns the warnings about
    /// the values of each.
    pub(super) fn bands(&self, jobs: &[&Job<'_>], sinks: &mut [Sink], grid: &Grid) -> Result<Vec<Warnings>, Failure> {
        let window = self.area;
        let pictures: Vec<&Field> = jobs.iter().flat_map(|job| &job.fields).map(|(_, field)| field).collect();
        let fields = Fields::new(&pictures, grid);
        let mut assemblers: Vec<Assembler<'_>> = Vec::with_capacity(jobs.len());
        for (sink, job) in sinks.iter_mut().zip(jobs) {
            assemblers.push(Assembler::new(sink, &job.planned.path, (*grid, window), job.samples()));
        }
        let frees = self.planner.request.once;
        let order = Order::choose(self.run, &fields, window, frees);
        let passes = order.passes(window);
        let mut stores = BTreeMap::new();
        let mut wanted: Option<Demand> = None;
        let mut free = |rest: Window| {
            let rest = self.run.demand(&fields, rest);
            if let Some(before) = &wanted {
                self.run.free(&fields, before, &rest);
            }
            wanted = Some(rest);
        };
        let mut found = vec![Gathered::default(); jobs.len()];
        let mut pixels = 0;
        for (number, pass) in passes.iter().enumerate() {
            if let Order::Strips(_) = order {
                // At the edges of a strip, compute only its demand instead of whole tiles.
                let neighbors = self.beside(&passes, number, &jobs[0].planned.path, &mut stores);
                self.run.limit_to(&fields, pass.window, neighbors);
            }
            if frees && passes.len() + pass.blocks.len() > 2 {
                free(pass.wanted);
            }
            for block in &pass.blocks {
                for ((job, assembler), found) in jobs.iter().zip(&mut assemblers).zip(&mut found) {
                    assembler.write_block(&self.tiles(job, grid, *block, found)?, *block)?;
                }
                if let Some(rest) = pass.wanted_after(block).filter(|_| frees) {
                    free(rest);
                }
                pixels += block.len() as u64;
                let rows = pixels / u64::from(window.width.max(1));
                self.observer.event(Event::Rows { done: rows, total: u64::from(window.height) });
            }
        }
        assemblers.into_iter().try_for_each(Assembler::finish)?;
        Ok(found.iter().map(Gathered::warnings).collect())
    }

    /// The neighbours of a strip: the strips near it, and the parts of the pictures above and below. `stores` has the
    /// overlap of the strips before, by the number of the strip that writes it.
    fn beside(
        &self,
        strips: &[Pass],
        number: usize,
        picture: &Path,
        stores: &mut BTreeMap<usize, Arc<dyn Store>>,
    ) -> Vec<Neighbor> {
        let (own, count) = (strips[number].window, strips.len());
        let above_and_below = self.neighbors.iter().cloned();
        let mut neighbors: Vec<Neighbor> = above_and_below
            .map(|other| Neighbor { window: Window { x: own.x, width: own.width, ..other.window }, ..other })
            .collect();
        // Drop the files that neither this strip nor a following one reads.
        stores.retain(|other, _| (number..count).any(|following| near(*other, following, count)));
        // If the file cannot be created, both strips compute the overlap.
        if let Ok(store) = OverlapStore::create(picture) {
            stores.insert(number, Arc::new(store));
        }
        for other in (0..count).filter(|other| near(number, *other, count)) {
            let (window, is_pending) = (strips[other].window, other > number);
            let store = stores.get(if is_pending { &number } else { &other }).cloned();
            neighbors.extend(store.map(|store| Neighbor { window, store, is_pending }));
        }
        neighbors
    }

    /// Computes the values of a picture's fields in a band; `found` gets the warnings about them. Values that are not
    /// finite are an error.
    fn tiles(&self, job: &Job<'_>, grid: &Grid, band: Window, found: &mut Gathered) -> Result<Vec<Tile>, Failure> {
        let graph = self.planner.graph;
        let mut tiles: Vec<Tile> = Vec::with_capacity(job.fields.len());
        for (_, field) in &job.fields {
            let (tile, warnings) =
                self.run.picture(field, grid, band).map_err(|stop| located(self.run, graph, stop))?;
            found.add(&warnings);
            // No early exit, so that the loop is vectorized.
            if !tile.data().iter().fold(true, |all, v| all & v.is_finite())
                && let Some(at) = tile.data().iter().position(|v| !v.is_finite())
            {
                return Err(not_finite(job, &tile, at));
            }
            tiles.push(tile);
        }
        Ok(tiles)
    }
}

/// True if two of `count` parts are at most `NEAR` numbers apart. The last part is adjacent to the first, since
/// pictures may repeat.
pub(super) fn near(own: usize, other: usize, count: usize) -> bool {
    let apart = own.abs_diff(other);
    apart > 0 && apart.min(count - apart) <= NEAR
}

fn not_finite(job: &Job<'_>, tile: &Tile, at: usize) -> Failure {
    let at = at % tile.window.len().max(1);
    let (x, y) = (at % tile.width(), at / tile.width());
    let message = format!(
        "`{}` is not a finite number at pixel ({}, {})",
        job.planned.output.name,
        i64::from(tile.window.x) + x as i64,
        i64::from(tile.window.y) + y as i64,
    );
    let help = "look for divisions by zero or overflow in the nodes before it";
    Failure::Errors(vec![Diagnostic::new(Code::NotFinite, job.planned.output.span, message).help(help)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn near_parts_include_those_across_the_ends() {
        let of = |own: usize, count: usize| (0..count).filter(|other| near(own, *other, count)).collect::<Vec<_>>();
        assert_eq!(of(0, 16), [1, 2, 14, 15]);
        assert_eq!(of(7, 16), [5, 6, 8, 9]);
        assert_eq!((of(0, 3), of(1, 2), of(0, 1)), (vec![1, 2], vec![0], vec![]));
    }
}
