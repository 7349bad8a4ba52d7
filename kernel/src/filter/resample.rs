//! Catmull-Rom sampling of planes at positions that vary from pixel to pixel, for warps and rotations.
//!
//! A position is stored as the pixel whose centre lies before it, plus a fraction, 0..1. So it is as exact at column 60
//! 000 as at column 0, and does not depend on the window. At a pixel's centre the value is exactly the pixel's own.
//! Four rows of four values are summed four at a time; weights and positions are shared by all channels. Cost: see
//! `benches/texel.rs`.
//!
//! Between pixels a value can overshoot the values around it a little. A chain of thousands of warps that read the same
//! positions could let values grow by up to a hundredth each time, to infinity. So values beyond ±10⁶ are clamped to
//! the range of the 16 pixels that they are computed from.

use crate::ground::cubic::catmull_rom_in_step;
use crate::ground::simd;
use crate::ground::window::{View, WindowExt, index};
use shibo_value::Window;

/// Number of pixels whose positions are computed at a time.
pub const BLOCK: usize = 64;

/// Halo: pixels read beyond the smallest and largest positions, on each side.
pub const HALO: usize = 2;

/// Values beyond ± this are clamped to the range of the pixels that they are computed from.
const LARGE: f32 = 1e6;

/// Positions that a run of pixels reads.
#[derive(Clone, Debug)]
pub struct SamplePositions {
    /// Columns: the pixel whose centre lies at or before the position.
    pub i: [i32; BLOCK],
    /// Rows.
    pub j: [i32; BLOCK],
    /// Distance of the position from that centre, 0..1, in x.
    pub u: [f32; BLOCK],
    /// The same in y.
    pub v: [f32; BLOCK],
}

impl SamplePositions {
    const ZERO: Self = Self { i: [0; BLOCK], j: [0; BLOCK], u: [0.0; BLOCK], v: [0.0; BLOCK] };
}

/// Fills `out`, planes over `rect` without gaps, from `sources`, which cover the same window. `place(x, y, places)`
/// gives the positions that pixel (x, y) and the pixels to its right read. Positions too near the window's border are
/// moved inwards.
///
/// # Panics
/// If the window is smaller than 4 × 4 pixels, sources differ in size, or a plane of `out` is smaller than `rect`.
pub fn resample(
    sources: &[View<'_>],
    rect: Window,
    out: &mut [&mut [f32]],
    mut place: impl FnMut(i32, i32, &mut SamplePositions),
) {
    let Some(window) = sources.first().map(View::window) else { return };
    assert!(window.columns() >= 4 && window.rows() >= 4, "four rows of four are read");
    assert!(sources.iter().all(|s| s.window() == window), "channels cover the same window");
    simd::dispatch(
        #[inline(always)]
        || {
            let mut places = SamplePositions::ZERO;
            for (row, y) in (0..rect.rows()).zip(rect.y..) {
                for start in (0..rect.columns()).step_by(BLOCK) {
                    place(rect.x + index(start), y, &mut places);
                    let from = row * rect.columns() + start;
                    let n = BLOCK.min(rect.columns() - start);
                    for (source, out) in sources.iter().zip(out.iter_mut()) {
                        read(source, window, &places, &mut out[from..from + n]);
                    }
                }
            }
        },
    );
}

#[inline(always)]
#[expect(clippy::cast_sign_loss, reason = "clamped into the window just before")]
fn read(source: &View<'_>, window: Window, places: &SamplePositions, out: &mut [f32]) {
    let (data, stride) = source.raw();
    let (right, bottom) = (index(window.columns()) - 4, index(window.rows()) - 4);
    let step = index(stride);
    let mut base = [0; BLOCK];
    for ((base, i), j) in base.iter_mut().zip(&places.i).zip(&places.j) {
        let column = (i - window.x - 1).max(0).min(right);
        let row = (j - window.y - 1).max(0).min(bottom);
        *base = (row * step + column) as u32;
    }
    for (((out, base), u), v) in out.iter_mut().zip(&base).zip(&places.u).zip(&places.v) {
        let block = &data[*base as usize..];
        let (a, rest) = block.split_at(stride);
        let (b, rest) = rest.split_at(stride);
        let (c, d) = rest.split_at(stride);
        let (a, b, c, d) = (&a[..4], &b[..4], &c[..4], &d[..4]);
        let (x, y) = (catmull_rom_in_step(*u), catmull_rom_in_step(*v));
        let mut sum = [0.0; 4];
        for k in 0..4 {
            sum[k] = (a[k] * y[0] + b[k] * y[1]) + (c[k] * y[2] + d[k] * y[3]);
        }
        *out = (sum[0] * x[0] + sum[1] * x[1]) + (sum[2] * x[2] + sum[3] * x[3]);
    }
    if !out.iter().fold(true, |small, v| small & (v.abs() <= LARGE)) {
        limit(data, stride, &base, out);
    }
}

/// Clamps large values to the range of the 16 pixels from `base` on. NaN stays NaN.
#[cold]
#[inline(never)]
fn limit(data: &[f32], stride: usize, base: &[u32; BLOCK], out: &mut [f32]) {
    for (out, base) in out.iter_mut().zip(base).filter(|(out, _)| out.abs() > LARGE) {
        let rows = (0..4).map(|row| &data[*base as usize + row * stride..][..4]);
        let range = |(low, high): (f32, f32), v: &f32| (v.min(low), v.max(high));
        let (low, high) = rows.flatten().fold((f32::INFINITY, f32::NEG_INFINITY), range);
        *out = if *out > high {
            high
        } else if *out < low {
            low
        } else {
            *out
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::sample::{Filter, Outside, Sampler};

    #[test]
    fn agrees_with_the_plain_sampler() {
        let window = Window::of(-7, 3, 90, 12);
        let data: Vec<f32> = (0..window.len()).map(|k| (k * k % 101) as f32).collect();
        let view = View::new(&data, window);
        let sampler = Sampler::new(view, Filter::CatmullRom, [Outside::Clamp; 2]);
        let rect = Window::of(-3, 6, 80, 4);
        let mut out = vec![0.0; rect.len()];
        let u = |x: i32| (x.rem_euclid(5)) as f32 * 0.25;
        resample(&[view], rect, &mut [&mut out], |x, y, places| {
            for (k, x) in (0..BLOCK).zip(x..) {
                (places.i[k], places.j[k], places.u[k], places.v[k]) = (x, y, u(x), u(x + y));
            }
        });
        for (k, v) in (0..).zip(&out) {
            let (x, y) = (k % 80 - 3, k / 80 + 6);
            let want = sampler.at(x as f32 + 0.5 + u(x), y as f32 + 0.5 + u(x + y));
            assert!((v - want).abs() < 1e-3, "{x} {y}: {v} {want}");
            if u(x) == 0.0 && u(x + y) == 0.0 {
                assert_eq!(*v, view.at(x, y));
            }
        }
    }

    #[test]
    fn clamps_positions_to_the_window() {
        let window = Window::of(0, 0, 4, 4);
        let data: Vec<f32> = (0..16u8).map(f32::from).collect();
        let mut out = vec![0.0; 2];
        resample(&[View::new(&data, window)], Window::of(0, 0, 2, 1), &mut [&mut out], |_, _, places| {
            (places.i, places.j) = ([-1_000_000_000; BLOCK], [1_000_000_000; BLOCK]);
        });
        assert_eq!(out, [5.0, 5.0]);
    }

    #[test]
    #[expect(clippy::cast_possible_truncation, reason = "displacements by a pixel")]
    fn stays_finite_after_many_repeats() {
        // The same displacements by up to a pixel, 20,000 times, on a periodic picture of 16 × 16.
        let (window, rect) = (Window::of(-3, -3, 22, 22), Window::of(0, 0, 16, 16));
        let hash = crate::ground::hash::Hash::new(2);
        let mut picture: Vec<f32> = (0..256).map(|p| hash.unit_f32(p)).collect();
        let place = |x: i32, y: i32, places: &mut SamplePositions| {
            for (k, x) in (0..BLOCK).zip(x..) {
                let word = hash.with((y * 16 + x.rem_euclid(16)).unsigned_abs().into());
                let [dx, dy] = [word.unit_f32(0), word.unit_f32(1)].map(|d| 2.0 * d - 1.0);
                (places.i[k], places.j[k]) = (x + dx.floor() as i32, y + dy.floor() as i32);
                (places.u[k], places.v[k]) = (dx - dx.floor(), dy - dy.floor());
            }
        };
        for _ in 0..20_000 {
            let padded: Vec<f32> =
                (0..22 * 22).map(|p| picture[(p / 22 + 13) % 16 * 16 + (p % 22 + 13) % 16]).collect();
            resample(&[View::new(&padded, window)], rect, &mut [&mut picture], place);
        }
        assert!(picture.iter().all(|v| v.is_finite()));
        // NaN stays NaN.
        let broken = vec![f32::NAN; 22 * 22];
        resample(&[View::new(&broken, window)], rect, &mut [&mut picture], place);
        assert!(picture.iter().all(|v| v.is_nan()));
    }
}
