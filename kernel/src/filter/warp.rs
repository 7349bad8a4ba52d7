//! Displacement of planes by two planes of offsets.

use super::resample::{BLOCK, HALO, SamplePositions, resample};
use crate::ground::math::{clamp, floor_int, max, min};
use crate::ground::simd;
use crate::ground::window::{View, WindowExt, offset};
use shibo_value::Window;

/// Parameters of a displacement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WarpSpec {
    /// Size of a pixel, mm.
    pub step: [f64; 2],
    /// The maximum displacement in x and y, mm; longer ones are clamped.
    pub limit: [f64; 2],
}

/// The maximum displacement in pixels; positions farther away would lose their fractions.
const FARTHEST: f64 = (1 << 20) as f64;

impl WarpSpec {
    #[expect(clippy::cast_possible_truncation, reason = "displacements need no more than f32")]
    fn axis(&self, k: usize) -> Axis {
        let pixels = 1.0 / self.step[k];
        Axis { scale: pixels as f32, limit: (self.limit[k] * pixels).min(FARTHEST) as f32 }
    }

    /// Pixels that may be read for `rect` with any displacements.
    pub fn reach(&self, rect: Window) -> Window {
        let far = |k| offset(floor_int(self.axis(k).limit).1.max(0)) + 1 + HALO;
        rect.with_halo([far(0), far(1)])
    }

    /// The pixels that are read for `rect` with these displacements.
    pub fn reads(&self, rect: Window, [dx, dy]: [&[f32]; 2]) -> Window {
        let span = |axis: Axis, d: &[f32]| {
            let (low, high) = simd::dispatch(
                #[inline(always)]
                || axis.span(d),
            );
            (floor_int(low).1, floor_int(high).1)
        };
        let ((left, right), (up, down)) = (span(self.axis(0), dx), span(self.axis(1), dy));
        let read = Window::of(
            rect.x + left,
            rect.y + up,
            rect.columns() + offset(right - left),
            rect.rows() + offset(down - up),
        );
        read.with_halo([HALO; 2])
    }
}

#[derive(Clone, Copy)]
struct Axis {
    scale: f32,
    limit: f32,
}

impl Axis {
    #[inline(always)]
    fn pixels(self, d: f32) -> f32 {
        clamp(d * self.scale, -self.limit, self.limit)
    }

    /// The smallest and the largest displacement, computed in lanes.
    #[inline(always)]
    fn span(self, d: &[f32]) -> (f32, f32) {
        const LANES: usize = 32;
        let (mut low, mut high) = ([f32::MAX; LANES], [f32::MIN; LANES]);
        for d in d.chunks(LANES) {
            for ((low, high), d) in low.iter_mut().zip(&mut high).zip(d) {
                let t = self.pixels(*d);
                (*low, *high) = (min(t, *low), max(t, *high));
            }
        }
        (low.into_iter().fold(f32::MAX, min), high.into_iter().fold(f32::MIN, max))
    }

    #[inline(always)]
    fn place(self, d: &[f32], cells: &mut [i32; BLOCK], rest: &mut [f32; BLOCK]) {
        for ((cell, rest), d) in cells.iter_mut().zip(rest).zip(d) {
            let t = self.pixels(*d);
            let (floor, int) = floor_int(t);
            (*cell, *rest) = (int, t - floor);
        }
    }
}

/// out(p) = source(p + (dx, dy)) for each channel, with displacements in mm over `rect` without gaps. NaN counts as the
/// largest negative displacement.
///
/// # Panics
/// If the sources do not cover [`WarpSpec::reads`], or a plane is smaller than `rect`.
pub fn warp(sources: &[View<'_>], rect: Window, [dx, dy]: [&[f32]; 2], spec: &WarpSpec, out: &mut [&mut [f32]]) {
    let (ax, ay) = (spec.axis(0), spec.axis(1));
    resample(
        sources,
        rect,
        out,
        #[inline(always)]
        |x, y, places: &mut SamplePositions| {
            let from = offset(y - rect.y) * rect.columns() + offset(x - rect.x);
            let to = from + BLOCK.min(rect.columns() - offset(x - rect.x));
            ax.place(&dx[from..to], &mut places.i, &mut places.u);
            ay.place(&dy[from..to], &mut places.j, &mut places.v);
            for (i, x) in places.i.iter_mut().zip(x..) {
                *i += x;
            }
            for j in &mut places.j {
                *j += y;
            }
        },
    );
}

/// Like [`warp`], but takes the nearest pixel, for numbers that must not be interpolated.
///
/// # Panics
/// If the source does not cover [`WarpSpec::reads`], or a plane is smaller than `rect`.
pub fn warp_nearest(source: &View<'_>, rect: Window, [dx, dy]: [&[f32]; 2], spec: &WarpSpec, out: &mut [f32]) {
    let (ax, ay) = (spec.axis(0), spec.axis(1));
    let shift = |axis: Axis, d: f32| floor_int(axis.pixels(d) + 0.5).1;
    let columns = rect.columns().max(1);
    let rows = out.chunks_exact_mut(columns).zip(dx.chunks_exact(columns).zip(dy.chunks_exact(columns)));
    for ((row, (dx, dy)), y) in rows.zip(rect.y..) {
        for ((out, (dx, dy)), x) in row.iter_mut().zip(dx.iter().zip(dy)).zip(rect.x..) {
            *out = source.at(x + shift(ax, *dx), y + shift(ay, *dy));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_pixels_shift() {
        let rect = Window::of(0, 0, 6, 5);
        let spec = WarpSpec { step: [0.5, 0.25], limit: [1.0, 0.5] };
        let offsets = [&[1.0; 30][..], &[-0.25; 30][..]];
        let big = spec.reads(rect, offsets);
        assert_eq!(big, Window::of(0, -3, 10, 9));
        let data: Vec<f32> = (0..big.len()).map(|k| (k * k % 17) as f32).collect();
        let view = View::new(&data, big);
        let mut out = vec![0.0; 30];
        warp(&[view], rect, offsets, &spec, &mut [&mut out]);
        for (k, v) in (0..).zip(&out) {
            assert_eq!(*v, view.at(k % 6 + 2, k / 6 - 1));
        }
        // Less than half a pixel more or less changes nothing.
        for by in [0.7, 1.2] {
            let offsets = [&[by; 30][..], &[-0.25; 30][..]];
            let mut nearest = vec![0.0; 30];
            warp_nearest(&view, rect, offsets, &spec, &mut nearest);
            let shift = if by < 1.0 { 1 } else { 2 };
            for (k, v) in (0..).zip(&nearest) {
                assert_eq!(*v, view.at(k % 6 + shift, k / 6 - 1), "{by}");
            }
        }
    }

    #[test]
    fn long_displacements_are_cut() {
        let rect = Window::of(5, 5, 2, 1);
        let spec = WarpSpec { step: [1.0, 1.0], limit: [3.0, 3.0] };
        assert_eq!(spec.reads(rect, [&[1e30, f32::NAN], &[0.0; 2]]), Window::of(0, 3, 12, 5));
    }
}
