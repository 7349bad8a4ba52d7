//! Ramps between two points: linear, radial, angular, diamond and square.
//!
//! With d = to - from, a point p becomes (u, v) = ((p - from)·d, (p - from)×d) / |d|², so `from` is (0, 0) and `to` is
//! (1, 0) for every shape. Positions are computed in f64 from absolute pixel indices. Cost: about half a nanosecond per
//! pixel, for angles 3 ns.

use crate::ground::math::{atan2, max, saturate};
use crate::ground::simd;
use crate::ground::window::{Frame, WindowExt};
use shibo_macros::choice;
use std::f32::consts::TAU;

/// The lines of equal value.
#[choice]
pub enum GradientShape {
    /// Straight lines, perpendicular to the direction from `from` to `to`.
    #[default]
    Linear,
    /// Circles around `from`.
    // √(u² + v²): circles around the first point.
    Radial,
    /// Rays from `from`; the value grows with the angle, once around from the direction of `to`.
    Angular,
    /// Squares around `from`, with a corner at `to`.
    // |u| + |v|: squares around the first point, standing on a corner.
    Diamond,
    /// Squares around `from`, with the middle of a side at `to`.
    // max(|u|, |v|): squares around the first point.
    Square,
}

/// The continuation beyond the end of a ramp.
#[choice]
pub enum Repeat {
    /// The value stays 0 before the ramp and 1 after it.
    #[default]
    Once,
    /// The ramp starts again at 0.
    Repeat,
    /// The ramp runs back to 0, then up again, and so on.
    Mirror,
}

/// Parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GradientSpec {
    /// The lines of equal value.
    pub shape: GradientShape,
    /// Position of value 0, mm.
    pub from: [f64; 2],
    /// Position of value 1, mm; must differ from `from`.
    pub to: [f64; 2],
    /// Number of ramps from 0 to 1 (and back) between the points.
    pub times: f64,
    /// The continuation beyond the end.
    pub repeat: Repeat,
    /// Period around `from` in x and y, mm; `None` in directions without one.
    pub period: [Option<f64>; 2],
}

impl GradientSpec {
    /// Number of ramps across a side of `size` mm in x and in y, for the linear shape.
    pub fn runs(&self, size: [f64; 2]) -> [f64; 2] {
        let [a, _] = self.axes();
        [0, 1].map(|k| size[k] * a[k] * self.times)
    }

    /// The map from mm relative to `from` to u and v.
    fn axes(&self) -> [[f64; 2]; 2] {
        let d = [self.to[0] - self.from[0], self.to[1] - self.from[1]];
        let square = d[0] * d[0] + d[1] * d[1];
        [[d[0] / square, d[1] / square], [-d[1] / square, d[0] / square]]
    }

    /// Offset in mm from `from`, or from its nearest copy.
    #[inline(always)]
    fn beside(&self, axis: usize, p: f64) -> f64 {
        let d = p - self.from[axis];
        match self.period[axis] {
            Some(period) => d - period * (d / period + 0.5).floor(),
            None => d,
        }
    }
}

/// Fills `out`, contiguous rows of the frame's window, with values 0..1.
pub fn gradient(spec: &GradientSpec, frame: &Frame, out: &mut [f32]) {
    simd::dispatch(
        #[inline(always)]
        || match spec.shape {
            GradientShape::Linear => fill(spec, frame, out, |u, _| u),
            GradientShape::Radial => fill(spec, frame, out, |u, v| (u * u + v * v).sqrt()),
            GradientShape::Angular => fill(spec, frame, out, |u, v| {
                let turns = atan2(v, u) / TAU;
                if turns < 0.0 { turns + 1.0 } else { turns }
            }),
            GradientShape::Diamond => fill(spec, frame, out, |u, v| u.abs() + v.abs()),
            GradientShape::Square => fill(spec, frame, out, |u, v| max(u.abs(), v.abs())),
        },
    );
}

#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "shares need no more than f32")]
fn fill(spec: &GradientSpec, frame: &Frame, out: &mut [f32], shape: impl Fn(f32, f32) -> f32) {
    let (rect, [a, b], times) = (frame.window, spec.axes(), spec.times as f32);
    let columns: Vec<f64> = (rect.x..).take(rect.columns()).map(|x| spec.beside(0, frame.center(x, 0)[0])).collect();
    for (row, y) in out.chunks_exact_mut(rect.columns().max(1)).take(rect.rows()).zip(rect.y..) {
        let dy = spec.beside(1, frame.center(0, y)[1]);
        for (out, dx) in row.iter_mut().zip(&columns) {
            *out = shape((dx * a[0] + dy * a[1]) as f32, (dx * b[0] + dy * b[1]) as f32);
        }
        match spec.repeat {
            Repeat::Once => row.iter_mut().for_each(|t| *t = saturate(*t)),
            Repeat::Repeat => row.iter_mut().for_each(|t| {
                let runs = *t * times;
                *t = runs - runs.floor();
            }),
            Repeat::Mirror => row.iter_mut().for_each(|t| {
                let pairs = *t * times * 0.5;
                *t = 1.0 - (2.0 * (pairs - pairs.floor()) - 1.0).abs();
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shibo_value::Window;

    const SPEC: GradientSpec = GradientSpec {
        shape: GradientShape::Linear,
        from: [2.0, 2.0],
        to: [6.0, 2.0],
        times: 1.0,
        repeat: Repeat::Once,
        period: [None; 2],
    };

    /// The value at (x, y) mm.
    fn at(spec: &GradientSpec, x: i32, y: i32) -> f32 {
        let mut out = [9.0];
        let frame = Frame { window: Window::of(x, y, 1, 1), origin: [-0.5; 2], step: [1.0; 2] };
        gradient(spec, &frame, &mut out);
        out[0]
    }

    #[test]
    fn shapes_have_their_values() {
        let of = |shape| GradientSpec { shape, ..SPEC };
        assert_eq!([0, 2, 3, 6, 9].map(|x| at(&SPEC, x, 7)), [0.0, 0.0, 0.25, 1.0, 1.0]);
        assert_eq!(at(&of(GradientShape::Radial), 2, 4), 0.5);
        assert!((at(&of(GradientShape::Angular), 2, 4) - 0.25).abs() < 1e-6);
        assert!((at(&of(GradientShape::Angular), 2, 1) - 0.75).abs() < 1e-6);
        assert_eq!(at(&of(GradientShape::Diamond), 3, 1), 0.5);
        assert_eq!(at(&of(GradientShape::Square), 3, 4), 0.5);
    }

    #[test]
    fn repeats_and_mirrors() {
        let of = |repeat| GradientSpec { repeat, times: 2.0, ..SPEC };
        assert_eq!([1, 2, 3, 4, 5].map(|x| at(&of(Repeat::Repeat), x, 0)), [0.5, 0.0, 0.5, 0.0, 0.5]);
        assert_eq!([1, 2, 3, 4, 5, 6].map(|x| at(&of(Repeat::Mirror), x, 0)), [0.5, 0.0, 0.5, 1.0, 0.5, 0.0]);
        let wrapped = GradientSpec { shape: GradientShape::Radial, period: [Some(5.0), None], ..SPEC };
        assert_eq!(at(&wrapped, 6, 2), at(&wrapped, 1, 2));
    }
}
