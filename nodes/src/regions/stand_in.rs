//! Numbers of pieces for tests.
use shibo_value::{Field, Tiling, Type};

/// Pieces on the canvas of tests, 32 × 32 mm: number 1 is 16 × 4 mm at the upper left, number 2 is 4 × 16 mm from (0,
/// 12) on, number 3 crosses the border at the right from y = 4 to y = 8 mm, and the rest is number 0.
pub(super) fn slabs() -> Field {
    Field::generate(Type::Ids, Tiling::BOTH, |out, _| {
        let (grid, window, width) = (out.grid, out.window, out.window.width.cast_signed());
        for (k, v) in (0..).zip(out.plane_mut(0)) {
            let at = grid.center(window.x + k % width, window.y + k / width).rem_euclid(glam::DVec2::splat(32.0));
            *v = if at.x < 16.0 && at.y < 4.0 {
                1.0
            } else if at.x < 4.0 && (12.0..28.0).contains(&at.y) {
                2.0
            } else if (at.x < 2.0 || at.x > 26.0) && (4.0..8.0).contains(&at.y) {
                3.0
            } else {
                0.0
            };
        }
        Ok(())
    })
}
