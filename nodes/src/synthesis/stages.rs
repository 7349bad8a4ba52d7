//! Shared by the nodes of single stages.
use super::inputs::checked;
use glam::{DVec2, UVec2};
use shibo_kernel::ground::window::OCTANTS;
use shibo_kernel::synthesis::jacobian::{IDENTITY, Jacobian};
use shibo_kernel::synthesis::{Lookup, Neighbours, PixelPlane};
use shibo_node::Context;
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{CoordMap, Field, Grid, Stop, Tile, Window};

/// Size of a map, and the directions in which its sides join.
pub(super) fn plane(map: &CoordMap) -> PixelPlane {
    PixelPlane { w: map.size.x as usize, h: map.size.y as usize, wrap: [map.periodic.x, map.periodic.y] }
}

/// The coordinates in double precision.
pub(super) fn wide(map: &CoordMap) -> Vec<[f64; 2]> {
    map.coords.iter().map(|c| c.map(f64::from)).collect()
}

/// A field at pixels of `pitch`, the first at the canvas' corner.
pub(super) fn raster(cx: &Context<'_>, field: &Field, size: UVec2, pitch: DVec2) -> Result<Tile, Stop> {
    let fits = (pitch * size.as_dvec2() - cx.size_mm()).abs().max_element() < 1e-9 * cx.size_mm().max_element();
    let grid = Grid { origin: DVec2::ZERO, step: pitch, period: fits.then_some(size), shown: None };
    cx.evaluator.raster(field, &grid, Window::full(size))
}

/// The Jacobian of every pixel, or only one if it is the same everywhere.
pub(super) fn jacobians(
    cx: &Context<'_>,
    field: Option<&Field>,
    size: UVec2,
    pitch: DVec2,
) -> Result<Vec<Jacobian>, Stop> {
    match field {
        None => Ok(vec![IDENTITY]),
        Some(field) => Ok(checked(&raster(cx, field, size, pitch)?)?),
    }
}

/// The Jacobian of a pixel out of [`jacobians`].
pub(super) fn at(list: &[Jacobian], pixel: usize) -> [f64; 4] {
    list.get(pixel).unwrap_or(&list[0]).map(f64::from)
}

/// Refuses coordinates on a surface if the surface is not connected.
pub(super) fn in_the_plane(map: &CoordMap) -> Result<(), Problem> {
    if map.surface.is_none() {
        return Ok(());
    }
    let message = "these coordinates lie on a surface";
    Err(Problem::new(Code::MissingInput, message).at("surface").help("connect the IndirectionMap of StartCoords"))
}

/// Refuses maps that would not fit into memory.
pub(super) fn afford(cx: &Context<'_>, pixels: u64) -> Result<(), Stop> {
    if pixels * 64 <= cx.evaluator.memory() {
        return Ok(());
    }
    let message = format!("{pixels} pixels need {} MiB; {} MiB are allowed", pixels >> 14, cx.evaluator.memory() >> 20);
    Err(Problem::new(Code::TooLarge, message).at("coords").help("start smaller, or raise --memory").into())
}

/// A map without neighbours beyond its sides, unless opposite sides join.
pub(super) struct Ended(pub(super) PixelPlane);

impl Lookup for Ended {
    fn index(&self, x: i32, y: i32) -> usize {
        self.0.index(x, y)
    }
}

impl Neighbours for Ended {
    fn near(&self, (x, y): (i32, i32), octant: usize) -> Option<(usize, [f32; 2])> {
        let PixelPlane { w, h, wrap } = self.0;
        let [dx, dy] = OCTANTS[octant];
        let there = |k: i32, n: usize, wrap: bool| wrap || usize::try_from(k).is_ok_and(|k| k < n);
        let there = there(x + dx, w, wrap[0]) && there(y + dy, h, wrap[1]);
        there.then(|| (self.index(x + dx, y + dy), [0.0; 2]))
    }
}

/// Shifts a map cyclically, in the directions in which opposite sides join, so that the pixel at `origin` becomes the
/// first.
pub(super) fn rolled(coords: Vec<[f32; 2]>, size: UVec2, origin: (i32, i32), wrap: [bool; 2]) -> Vec<[f32; 2]> {
    let by = |k: i32, n: u32, wrap: bool| if wrap { k.rem_euclid(n.cast_signed()).unsigned_abs() as usize } else { 0 };
    let (dx, dy) = (by(origin.0, size.x, wrap[0]), by(origin.1, size.y, wrap[1]));
    if dx == 0 && dy == 0 {
        return coords;
    }
    let (w, h) = (size.x as usize, size.y as usize);
    (0..w * h).map(|p| coords[(p / w + dy) % h * w + (p % w + dx) % w]).collect()
}
