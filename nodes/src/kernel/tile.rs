//! Tiles of the engine as the kernels see them.
use super::cells::Canvas;
use super::window::{Frame, Rect, View};
use shibo_engine::value::{Grid, Tile, Tiling, Window};

/// The pixels of a window.
pub fn rect(window: Window) -> Rect {
    Rect::new(window.x, window.y, window.width as usize, window.height as usize)
}

/// Where a tile lies.
pub fn frame(tile: &Tile) -> Frame {
    Frame { rect: rect(tile.window), origin: tile.grid.origin.to_array(), step: tile.grid.step.to_array() }
}

/// A channel of a tile.
pub fn view(tile: &Tile, channel: usize) -> View<'_> {
    View::new(tile.plane(channel), rect(tile.window))
}

/// All channels of a tile with three or more.
///
/// # Panics
/// If there are fewer than three.
pub fn planes3(tile: &mut Tile) -> [&mut [f32]; 3] {
    let mut planes = tile.planes_mut().into_iter();
    std::array::from_fn(|_| planes.next().expect("a tile of a colour has three channels"))
}

/// The size of a pixel in mm.
pub fn step(grid: &Grid) -> [f64; 2] {
    grid.step.to_array()
}

/// The canvas that noise repeats on.
pub fn canvas(size_mm: glam::DVec2, tiling: Tiling) -> Canvas {
    Canvas { size: size_mm.to_array(), tiles: [tiling.x, tiling.y] }
}
