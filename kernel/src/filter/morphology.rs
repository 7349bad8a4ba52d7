//! Dilation and erosion by a disk of pixels.
//!
//! The disk is split into its rows. The extreme of a run of n pixels is that of two overlapping runs of 2^k ≤ n (after
//! M. van Herk, 1992, in a form without branches), and runs of 2^k are computed from runs of half the length. So a row
//! of the disk costs three comparisons per pixel for any length, eight pixels at a time.
//!
//! Cost: O(pixels · radius in pixels), see `benches/texel.rs`.

use super::disk::Disk;
use crate::ground::math::{max, min};
use crate::ground::simd;
use crate::ground::window::{View, WindowExt, index, offset};
use shibo_value::Window;

/// The maximum over `disk` around each pixel of `rect`; the minimum if `erode`.
///
/// # Panics
/// If `input` does not cover `rect` grown by the disk's halo, or `out` is smaller than `rect`.
pub fn extreme(input: &View<'_>, rect: Window, disk: &Disk, erode: bool, out: &mut [f32]) {
    assert!(input.window().contains(&rect.with_halo(disk.halo())), "the window lacks its halo");
    let out = &mut out[..rect.len()];
    if out.is_empty() {
        return;
    }
    simd::dispatch(
        #[inline(always)]
        || if erode { fill::<true>(input, rect, disk, out) } else { fill::<false>(input, rect, disk, out) },
    );
}

#[inline(always)]
fn pick<const LEAST: bool>(a: f32, b: f32) -> f32 {
    if LEAST { min(a, b) } else { max(a, b) }
}

#[inline(always)]
fn fill<const LEAST: bool>(input: &View<'_>, rect: Window, disk: &Disk, out: &mut [f32]) {
    let [hx, hy] = disk.halo();
    let (w, wide) = (rect.columns(), rect.columns() + 2 * hx);
    let levels = (2 * hx + 1).ilog2() as usize + 1;
    // Runs of 2^k pixels, for each k.
    let mut runs = vec![vec![0.0; wide]; levels];
    let mut line = vec![0.0; w];
    out.fill(if LEAST { f32::MAX } else { f32::MIN });
    for row in 0..rect.rows() + 2 * hy {
        let y = rect.y - index(hy) + index(row);
        runs[0].copy_from_slice(input.row(rect.x - index(hx), y, wide));
        for level in 1..levels {
            let (shorter, longer) = runs.split_at_mut(level);
            let (shorter, step) = (&shorter[level - 1], 1 << (level - 1));
            let n = wide + 1 - (1 << level);
            for ((out, a), b) in longer[0][..n].iter_mut().zip(&shorter[..n]).zip(&shorter[step..step + n]) {
                *out = pick::<LEAST>(*a, *b);
            }
        }
        for (dy, half) in disk.halves().iter().enumerate() {
            // Rows of the result for which this row has the offset -dy and dy in the disk; `row` starts `hy` above the
            // first one.
            let below = (row + dy).checked_sub(hy).filter(|j| *j < rect.rows());
            let above = row.checked_sub(hy + dy).filter(|j| *j < rect.rows() && dy > 0);
            if below.is_none() && above.is_none() {
                continue;
            }
            let (half, length) = (offset(*half), 2 * offset(*half) + 1);
            let (level, start) = (length.ilog2() as usize, hx - half);
            let second = start + length - (1 << level);
            let (a, b) = (&runs[level][start..start + w], &runs[level][second..second + w]);
            for ((out, a), b) in line.iter_mut().zip(a).zip(b) {
                *out = pick::<LEAST>(*a, *b);
            }
            for j in below.into_iter().chain(above) {
                for (out, v) in out[j * w..(j + 1) * w].iter_mut().zip(&line) {
                    *out = pick::<LEAST>(*out, *v);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::hash::Hash;

    #[test]
    fn is_the_extreme_of_all_pixels_in_the_disk() {
        let rect = Window::of(-3, 5, 37, 17);
        let hash = Hash::new(5);
        for (radius, step) in
            [(0.3, [1.0, 1.0]), (1.0, [1.0, 1.0]), (2.5, [1.0, 1.0]), (8.0, [1.0, 1.0]), (7.0, [0.9, 2.0])]
        {
            let disk = Disk::new(radius, step);
            let big = rect.with_halo(disk.halo());
            let data: Vec<f32> = (0..big.len() as u64).map(|k| hash.unit_f32(k)).collect();
            let view = View::new(&data, big);
            for erode in [false, true] {
                let mut out = vec![0.0; rect.len()];
                extreme(&view, rect, &disk, erode, &mut out);
                for (k, got) in (0..).zip(&out) {
                    let (x, y) = (rect.x + k % 37, rect.y + k / 37);
                    let all = (-20..=20).flat_map(|dy| (-20..=20).map(move |dx| (dx, dy))).filter(|(dx, dy)| {
                        f64::hypot(f64::from(*dx) * step[0], f64::from(*dy) * step[1]) <= radius + 1e-9
                    });
                    let values = all.map(|(dx, dy)| view.at(x + dx, y + dy));
                    let want = if erode { values.fold(f32::MAX, f32::min) } else { values.fold(f32::MIN, f32::max) };
                    assert_eq!(*got, want, "{radius} at {x} {y}");
                }
            }
        }
    }
}
