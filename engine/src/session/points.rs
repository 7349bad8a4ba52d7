//! Evaluates fields at points of the canvas.
use super::{Failure, Session, located};
use crate::eval::{Caches, CancelToken, Fields, MemoryCache, Observer, Run};
use crate::graph::Graph;
use crate::value::{Field, Grid, TILE, Tile, Window};
use glam::{DVec2, UVec2};
use rayon::prelude::*;

/// A value is computed exactly at a point if it needs at most this many pixels along a side of each field it reads.
const NEAR: u64 = 32;
/// Number of points computed in one run, and the bytes of its cache: the tiles of a point are useless for other points.
const AT_ONCE: usize = 256;
const SCRATCH: u64 = 16 << 20;
/// The farthest allowed pixel, counted from the corner of the canvas.
const FARTHEST: f64 = 16_777_216.0;

/// The window of one pixel of a grid.
const fn pixel(x: i32, y: i32) -> Window {
    Window { x, y, width: 1, height: 1 }
}

/// The channels of the first pixel of a tile.
fn channels(tile: &Tile) -> Vec<f32> {
    (0..tile.channels()).map(|channel| tile.plane(channel)[0]).collect()
}

/// The pixel of a grid that contains a point, unless it is too far away.
#[expect(clippy::cast_possible_truncation, reason = "compared with the farthest first")]
fn holds(grid: &Grid, point: DVec2) -> Option<(i32, i32)> {
    let at = ((point - grid.origin) / grid.step).floor();
    (at.abs().max_element() <= FARTHEST).then_some((at.x as i32, at.y as i32))
}

impl Session {
    /// The values of a field of `graph` at points in mm, one point after another, with the channels of each point
    /// adjacent.
    ///
    /// A point is the centre of a pixel of the canvas' pixel size. If its value depends on whole pictures, or on many
    /// pixels of one, the canvas pixel that contains the point is used instead. Points then share tiles.
    ///
    /// # Errors
    /// Errors of the graph, at their places; points very far from the canvas.
    pub fn at_points(
        &self,
        graph: &Graph,
        field: &Field,
        points: &[DVec2],
        cancel: &CancelToken,
        observer: &dyn Observer,
    ) -> Result<Vec<f32>, Failure> {
        let grid = graph.canvas.grid(graph.canvas.resolution);
        let Some(first) = points.first() else { return Ok(Vec::new()) };
        self.run(graph, cancel, observer, |run| {
            if run.is_near(field, &grid.centered_at(*first), NEAR) {
                let some = |points: &[DVec2]| self.exactly(run, (graph, field, &grid), points, (cancel, observer));
                let parts: Vec<Vec<f32>> = points.par_chunks(AT_ONCE).map(some).collect::<Result<_, _>>()?;
                Ok(parts.concat())
            } else {
                in_picture(run, (graph, field, &grid), points)
            }
        })
    }

    /// The values with each point as the centre of its own pixel. The warnings about them are left to `outer`.
    fn exactly(
        &self,
        outer: &Run<'_>,
        (graph, field, grid): (&Graph, &Field, &Grid),
        points: &[DVec2],
        (cancel, observer): (&CancelToken, &dyn Observer),
    ) -> Result<Vec<f32>, Failure> {
        let caches = Caches::new(MemoryCache::new(SCRATCH), None);
        let run = Run::new(graph, outer.keys(), &caches, self.memory, cancel, observer);
        let value = |point: &DVec2| {
            let grid = grid.centered_at(*point);
            run.prepare(field, &grid)?;
            run.limit_to(&Fields::new(&[field], &grid), Window::full(UVec2::ONE), Vec::new());
            Ok(channels(&run.raster(field, &grid, Window::full(UVec2::ONE))?))
        };
        let values: Result<Vec<Vec<f32>>, _> = points.iter().map(value).collect();
        outer.note_values_of(&run);
        values.map(|values| values.concat()).map_err(|stop| located(&run, graph, stop))
    }
}

/// The values of the canvas pixels that contain the points, tile by tile.
fn in_picture(
    run: &Run<'_>,
    (graph, field, grid): (&Graph, &Field, &Grid),
    points: &[DVec2],
) -> Result<Vec<f32>, Failure> {
    let tile = TILE.cast_signed();
    let place = |(n, point): (usize, &DVec2)| {
        let (x, y) = holds(grid, *point).ok_or_else(|| {
            Failure::Usage(format!("point {} at ({}, {}) mm lies too far from the canvas", n + 1, point.x, point.y))
        })?;
        Ok(((y.div_euclid(tile), x.div_euclid(tile)), (y, x), n))
    };
    let mut places = points.iter().enumerate().map(place).collect::<Result<Vec<_>, Failure>>()?;
    places.sort_unstable();
    run.prepare(field, grid).map_err(|stop| located(run, graph, stop))?;
    let tiles: Vec<_> = places.chunk_by(|a, b| a.0 == b.0).collect();
    let found = tiles.par_iter().map(|places| {
        let value =
            |(_, (y, x), n): &(_, (i32, i32), usize)| Ok((*n, channels(&run.raster(field, grid, pixel(*x, *y))?)));
        places.iter().map(value).collect::<Result<Vec<_>, _>>()
    });
    let mut found: Vec<(usize, Vec<f32>)> =
        found.collect::<Result<Vec<Vec<_>>, _>>().map_err(|stop| located(run, graph, stop))?.concat();
    found.sort_unstable_by_key(|(n, _)| *n);
    Ok(found.into_iter().flat_map(|(_, values)| values).collect())
}
