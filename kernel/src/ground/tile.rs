//! Access to the engine's tiles for kernels.
use super::window::{Frame, View};
use shibo_value::{Field, Grid, Tile, Type};

/// The window and position of a tile.
#[inline]
pub fn frame(tile: &Tile) -> Frame {
    Frame { window: tile.window, origin: tile.grid.origin.to_array(), step: tile.grid.step.to_array() }
}

/// A channel of a tile.
#[inline]
pub fn view(tile: &Tile, channel: usize) -> View<'_> {
    View::new(tile.plane(channel), tile.window)
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

/// A channel of a tile; the only channel if there is just one.
#[inline]
pub fn channel(tile: &Tile, channel: usize) -> &[f32] {
    tile.plane(channel.min(tile.channels() - 1))
}

/// Type of a channel-wise result of these fields: the widest of their types. Vectors, matrices and numbers of pieces go
/// only with their own type.
pub fn widest<'a>(fields: impl IntoIterator<Item = &'a Field>) -> Type {
    fields.into_iter().fold(Type::Gray, |widest, field| match (widest, field.ty()) {
        (alone @ (Type::Vec2 | Type::Ids | Type::Jacobian), _)
        | (_, alone @ (Type::Vec2 | Type::Ids | Type::Jacobian)) => alone,
        (Type::Normal, _) | (_, Type::Normal) => Type::Normal,
        (Type::Rgb, _) | (_, Type::Rgb) => Type::Rgb,
        _ => Type::Gray,
    })
}
