//! Computes the pixels of pictures and writes them, block by block.
//!
//! The [`Order`] keeps the tiles at hand within the memory. What strips of one picture both read they leave for each other in temporary
//! files beside it.
use super::job::Job;
use super::render::Render;
use super::sink::{Assembler, Sink};
use super::{Failure, located};
use crate::diagnostics::{Code, Diagnostic};
use crate::eval::{Demand, Event, FEW, Fields, Neighbor, Order, OverlapStore, Pass, Seal, code};
use crate::value::{Field, Grid, Tile, Window};
use std::collections::BTreeMap;
use std::sync::Arc;

/// What is read beyond the edges of a strip, or of a part of a picture, may reach over so many others.
const NEAR: usize = 2;

impl Render<'_, '_> {
    /// Computes and writes the pictures together, so that what they share is still in memory.
    pub(super) fn bands(&self, jobs: &[&Job<'_>], sinks: &mut [Sink], grid: &Grid) -> Result<(), Failure> {
        let window = self.area;
        let pictures: Vec<&Field> = jobs.iter().flat_map(|job| &job.fields).map(|(_, field)| field).collect();
        let fields = Fields::new(&pictures, grid);
        let channels = |job: &Job<'_>| job.fields.iter().map(|(_, field)| field.channels()).sum::<usize>();
        let pixel = 4 * pictures.iter().map(|field| field.channels() as u64).sum::<u64>();
        let in_memory = window.len() as u64 * pixel <= self.run.tile_bytes() / FEW;
        let mut assemblers: Vec<Assembler<'_>> = Vec::with_capacity(jobs.len());
        for (sink, job) in sinks.iter_mut().zip(jobs) {
            assemblers.push(Assembler::new(sink, &job.planned.path, (*grid, window), channels(job), in_memory));
        }
        let frees = self.planner.request.once;
        let order = Order::choose(self.run, &fields, window, frees);
        let passes = order.passes(window);
        let mut overlaps = Overlaps::default();
        let mut wanted: Option<Demand> = None;
        let mut free = |rest: Window| {
            let rest = self.run.demand(&fields, rest);
            if let Some(before) = &wanted {
                self.run.free(&fields, before, &rest);
            }
            wanted = Some(rest);
        };
        let mut pixels = 0;
        for (number, pass) in passes.iter().enumerate() {
            if let Order::Strips(_) = order {
                // At its edges no more than what it reads.
                self.run.limit_to(&fields, pass.window, self.beside(&passes, number, jobs, &mut overlaps));
            }
            if frees && passes.len() + pass.blocks.len() > 2 {
                free(pass.wanted);
            }
            for block in &pass.blocks {
                for (job, assembler) in jobs.iter().zip(&mut assemblers) {
                    assembler.write_block(&self.tiles(job, grid, *block)?, *block)?;
                }
                if let Some(rest) = pass.wanted_after(block).filter(|_| frees) {
                    free(rest);
                }
                pixels += block.len() as u64;
                let rows = pixels / u64::from(window.width.max(1));
                self.observer.event(Event::Rows { done: rows, total: u64::from(window.height) });
            }
        }
        assemblers.into_iter().try_for_each(Assembler::finish)
    }

    /// The other parts of the pictures that read some of what a strip reads: the strips near it, and what is above and below.
    fn beside(
        &self,
        strips: &[Pass],
        number: usize,
        jobs: &[&Job<'_>],
        Overlaps(stores): &mut Overlaps,
    ) -> Vec<Neighbor> {
        let (own, count) = (strips[number].window, strips.len());
        let above_and_below = self.neighbors.iter().cloned();
        let mut neighbors: Vec<Neighbor> = above_and_below
            .map(|other| Neighbor { window: Window { x: own.x, width: own.width, ..other.window }, ..other })
            .collect();
        // Those near which no strip follows are done with.
        stores.retain(|other, _| (number..count).any(|following| near(*other, following, count)));
        let seal = Seal::new(code(&self.session.registry));
        let path = jobs.first().map(|job| &job.planned.path);
        // Without a file, both compute what they need.
        let store = path.and_then(|path| OverlapStore::create(path, seal, u64::MAX).ok());
        stores.extend(store.map(|store| (number, Arc::new(store))));
        for other in (0..count).filter(|other| near(number, *other, count)) {
            let waits = other > number;
            let store = stores.get(if waits { &number } else { &other });
            neighbors.extend(store.map(|store| Neighbor { window: strips[other].window, store: store.clone(), waits }));
        }
        neighbors
    }

    /// The values of a picture's fields.
    fn tiles(&self, job: &Job<'_>, grid: &Grid, band: Window) -> Result<Vec<Tile>, Failure> {
        let graph = self.planner.graph;
        let mut tiles: Vec<Tile> = Vec::with_capacity(job.fields.len());
        for (_, field) in &job.fields {
            let tile = self.run.raster(field, grid, band).map_err(|stop| located(self.run, graph, stop))?;
            // Without an early end, so that many are looked at together.
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

/// What the strips of a picture leave for each other, by their numbers.
#[derive(Default)]
struct Overlaps(BTreeMap<usize, Arc<OverlapStore>>);

/// Whether two of `count` parts lie side by side, or nearly so; the last one is beside the first, since pictures may repeat.
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
    fn parts_are_near_across_the_ends() {
        let of = |own: usize, count: usize| (0..count).filter(|other| near(own, *other, count)).collect::<Vec<_>>();
        assert_eq!(of(0, 16), [1, 2, 14, 15]);
        assert_eq!(of(7, 16), [5, 6, 8, 9]);
        assert_eq!((of(0, 3), of(1, 2), of(0, 1)), (vec![1, 2], vec![0], vec![]));
    }
}
