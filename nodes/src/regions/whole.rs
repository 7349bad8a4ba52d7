//! The canvas as one picture.
use glam::DVec2;
use shibo_kernel::region::axes::Picture;
use shibo_value::{Canvas, Grid, Resolution, Tiling, Window};

/// The grid of a canvas of `size` mm, and the window of all its pixels: `longer` pixels along the longer side, by
/// default the pixels of `grid`.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "limited to the pixels of a canvas")]
pub(super) fn whole(size: DVec2, grid: &Grid, longer: Option<u32>) -> (Grid, Window) {
    let side = |n: f64| n.round().clamp(1.0, f64::from(Canvas::MAX_RESOLUTION)) as u32;
    let pixels = match (longer, grid.period) {
        (Some(longer), _) => Resolution::Longer(longer).of(size),
        (None, Some(pixels)) => pixels,
        (None, None) => (size / grid.step).to_array().map(side).into(),
    };
    (
        Grid { origin: DVec2::ZERO, step: size / pixels.as_dvec2(), period: Some(pixels), shown: None },
        Window::full(pixels),
    )
}

/// A picture of numbers.
pub(super) fn picture<'a>(ids: &'a [f32], grid: &Grid, wrap: Tiling) -> Picture<'a> {
    let width = grid.period.map_or(1, |pixels| pixels.x as usize);
    Picture { ids, width, step: grid.step, wrap: [wrap.x, wrap.y] }
}
