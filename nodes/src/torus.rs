//! A field on the canvas, repeated.
use shibo_value::{Field, FieldSource, Given, Grid, Read, Stop, Tile, Tiling, Window};

/// A field on the canvas, repeated in some directions. Its values beyond the edge of the canvas are not read there.
pub(crate) struct Torus {
    pub(crate) input: Field,
    /// The canvas, mm.
    pub(crate) size: glam::DVec2,
    /// Directions in which it repeats.
    pub(crate) wrap: Tiling,
}

/// One direction of a grid on the canvas.
#[derive(Clone, Copy)]
struct Axis {
    origin: f64,
    step: f64,
    size: f64,
    /// Pixels per canvas.
    pixels: i32,
    wrap: bool,
}

impl Axis {
    /// The pixel of the canvas that shows at pixel `at`.
    #[expect(clippy::cast_possible_truncation, reason = "the cast saturates; windows are small")]
    fn on_canvas(self, at: i32) -> i32 {
        if !self.wrap {
            return at;
        }
        let place = (self.origin + (f64::from(at) + 0.5) * self.step) / self.size;
        at.wrapping_sub(self.pixels.wrapping_mul(place.floor() as i32))
    }

    /// The pixels to read for `count` pixels from `start` on: the first, and their number.
    #[expect(clippy::cast_possible_truncation, reason = "the cast saturates; windows are small")]
    fn reads(self, start: i32, count: u32) -> (i32, u32) {
        let (first, last) = (self.on_canvas(start), self.on_canvas(start + count.cast_signed() - 1));
        if first.wrapping_add(count.cast_signed() - 1) == last && count.cast_signed() <= self.pixels || !self.wrap {
            return (first, count);
        }
        // All of the canvas, plus one pixel for rounding.
        let edge = (-self.origin / self.step - 0.5).ceil() as i32;
        (edge - 1, self.pixels.unsigned_abs() + 2)
    }
}

impl Torus {
    /// Number of pixels of a grid per canvas.
    #[expect(clippy::cast_possible_truncation, reason = "limited to the pixels of a canvas")]
    pub(crate) fn pixels(size: glam::DVec2, grid: &Grid) -> [i32; 2] {
        (size / grid.step).round().to_array().map(|n| n.clamp(1.0, 1e9) as i32)
    }

    fn axes(&self, grid: &Grid) -> [Axis; 2] {
        let pixels = Self::pixels(self.size, grid);
        let axis = |k: usize, wrap: bool| Axis {
            origin: grid.origin[k],
            step: grid.step[k],
            size: self.size[k],
            pixels: pixels[k],
            wrap,
        };
        [axis(0, self.wrap.x), axis(1, self.wrap.y)]
    }
}

impl FieldSource for Torus {
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        let [across, down] = self.axes(grid);
        let ((x, width), (y, height)) = (across.reads(window.x, window.width), down.reads(window.y, window.height));
        vec![Read::new(&self.input, grid, Window { x, y, width, height })]
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let (input, window, [across, down]) = (given.tile(0), out.window, self.axes(&out.grid));
        let place = |at: i32, first: i32| at.abs_diff(first) as usize;
        let column = |x: i32| place(across.on_canvas(x), input.window.x).min(input.width() - 1);
        let columns: Vec<usize> = (window.x..window.right()).map(column).collect();
        for channel in 0..out.channels() {
            for (row, y) in (window.y..window.bottom()).enumerate() {
                let from = place(down.on_canvas(y), input.window.y).min(input.height() - 1);
                let line = input.row(channel, from);
                out.row_mut(channel, row).iter_mut().zip(&columns).for_each(|(out, column)| *out = line[*column]);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{canvas, crop};
    use shibo_value::Type;

    #[test]
    fn repeats_the_canvas() {
        let ramp = Field::generate(Type::Gray, Tiling::NONE, |out, _| {
            let (window, width) = (out.window, out.window.width.cast_signed());
            for (k, v) in (0..).zip(out.plane_mut(0)) {
                let (x, y) = (window.x + k % width, window.y + k / width);
                *v = i16::try_from(x * 100 + y).map_or(0.0, f32::from);
            }
            Ok(())
        });
        let wrap = Tiling { x: true, y: false };
        let torus = Field::new(Type::Gray, wrap, Torus { input: ramp, size: canvas().size_mm, wrap });
        for (x, y, width, height) in [(0, 0, 64, 64), (-70, -9, 200, 3), (130, 5, 8, 8), (60, 0, 8, 1)] {
            let tile = crop(&torus, &canvas(), Window { x, y, width, height });
            for (row, y) in (y..).take(height as usize).enumerate() {
                for (value, x) in tile.row(0, row).iter().zip(x..) {
                    assert_eq!(*value, (x.rem_euclid(64) * 100 + y) as f32, "{x} {y}");
                }
            }
        }
    }
}
