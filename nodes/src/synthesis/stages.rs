//! What the nodes of single stages have in common.
use super::inputs::checked;
use glam::{DVec2, UVec2};
use shibo_engine::diagnostics::{Code, Problem};
use shibo_engine::node::Context;
use shibo_engine::value::{CoordMap, Field, Grid, Stop, Tile, Window};
use shibo_kernel::synthesis::Plane;
use shibo_kernel::synthesis::jacobian::{IDENTITY, Jacobian};

/// Size of a map, and where its sides join.
pub(super) fn plane(map: &CoordMap) -> Plane {
    Plane { w: map.size.x as usize, h: map.size.y as usize, wrap: [map.periodic.x, map.periodic.y] }
}

/// The coordinates in double precision.
pub(super) fn wide(map: &CoordMap) -> Vec<[f64; 2]> {
    map.coords.iter().map(|c| c.map(f64::from)).collect()
}

/// A field at pixels of `pitch`, the first at the canvas' corner.
pub(super) fn raster(cx: &Context<'_>, field: &Field, size: UVec2, pitch: DVec2) -> Result<Tile, Stop> {
    let fits = (pitch * size.as_dvec2() - cx.size_mm()).abs().max_element() < 1e-9 * cx.size_mm().max_element();
    let grid = Grid { origin: DVec2::ZERO, step: pitch, period: fits.then_some(size) };
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

/// Refuses maps that would not fit into memory.
pub(super) fn afford(cx: &Context<'_>, pixels: u64) -> Result<(), Stop> {
    if pixels * 64 <= cx.evaluator.memory() {
        return Ok(());
    }
    let message = format!("{pixels} pixels need {} MiB; {} MiB are allowed", pixels >> 14, cx.evaluator.memory() >> 20);
    Err(Problem::new(Code::TooLarge, message).at("coords").help("start smaller, or raise --memory").into())
}
