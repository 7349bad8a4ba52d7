//! Exact Euclidean distance to the region where a field exceeds a threshold, limited to a radius.
//!
//! The region's edge is known to fractions of a pixel: where the field crosses the threshold between two neighbouring
//! pixels, linear interpolation gives the crossing. Distances are measured to these crossings, so there is no
//! staircase. Crossings on rows and those on columns have a separable transform each (T. Saito, J. Toriwaki, 1994):
//! crossings on rows are found by scanning the rows, and then by searching up and down the columns; crossings on
//! columns the other way round. The search along the second axis stops when no nearer crossing can follow, so the cost
//! depends on the distances that occur rather than on the radius: O(pixels · min(distance, radius)), eight pixels at a
//! time.
//!
//! Units: mm, with pixels of any aspect. Distances are limited to the radius, so results do not depend on the window.

use crate::ground::math::{max, min};
use crate::ground::simd;
use crate::ground::window::{View, WindowExt, index};
use shibo_value::Window;

/// Parameters of a distance transform.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DistanceSpec {
    /// The region is where the field is above this threshold.
    pub threshold: f32,
    /// Largest distance of interest, mm.
    pub radius: f64,
    /// Size of a pixel, mm.
    pub step: [f64; 2],
}

impl DistanceSpec {
    /// Halo: the pixels read beyond a window, in x and y.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a radius in pixels")]
    pub fn halo(&self) -> [usize; 2] {
        self.step.map(|step| ((self.radius / step).ceil().max(0.0) as usize).saturating_add(1))
    }
}

/// Distance in mm from each pixel of `rect` to the region, 0 inside it, at most the radius.
///
/// # Panics
/// If `input` does not cover `rect` grown by the halo, or `out` is smaller than `rect`.
pub fn distance(input: &View<'_>, rect: Window, spec: &DistanceSpec, out: &mut [f32]) {
    assert!(input.window().contains(&rect.with_halo(spec.halo())), "the window lacks its halo");
    let [hx, hy] = spec.halo();
    let (tall, wide) = (rect.with_halo([0, hy]), rect.with_halo([hx, 0]));
    let (mut rows, mut columns) = (vec![0.0; tall.len()], vec![0.0; wide.len()]);
    row_squares(input, tall, spec, &mut rows);
    column_squares(input, wide, spec, &mut columns);
    combine(&View::new(&rows, tall), &View::new(&columns, wide), rect, spec, out);
}

/// First half of [`distance`]: squared distance in mm² along the row from each pixel of `rect` to the region.
///
/// # Panics
/// If `input` does not cover `rect` grown by the halo in x, or `out` is smaller than `rect`.
pub fn row_squares(input: &View<'_>, rect: Window, spec: &DistanceSpec, out: &mut [f32]) {
    simd::dispatch(
        #[inline(always)]
        || along_rows(input, rect, spec, &mut out[..rect.len()]),
    );
}

/// The same as [`row_squares`], along the column.
///
/// # Panics
/// If `input` does not cover `rect` grown by the halo in y, or `out` is smaller than `rect`.
pub fn column_squares(input: &View<'_>, rect: Window, spec: &DistanceSpec, out: &mut [f32]) {
    simd::dispatch(
        #[inline(always)]
        || along_columns(input, rect, spec, &mut out[..rect.len()]),
    );
}

/// Second half of [`distance`]: the distances from the squares along rows and along columns.
///
/// # Panics
/// If `rows` does not cover `rect` grown by the halo in y, `columns` in x, or `out` is smaller than `rect`.
pub fn combine(rows: &View<'_>, columns: &View<'_>, rect: Window, spec: &DistanceSpec, out: &mut [f32]) {
    let out = &mut out[..rect.len()];
    if out.is_empty() {
        return;
    }
    let [hx, hy] = spec.halo();
    simd::dispatch(
        #[inline(always)]
        || {
            let limit = single(spec.radius);
            out.fill(limit * limit);
            for (out, y) in out.chunks_exact_mut(rect.columns()).zip(rect.y..) {
                look(out, hy, spec.step[1], |k, up| {
                    let k = index(k);
                    rows.row(rect.x, if up { y - k } else { y + k }, rect.columns())
                });
                let row = columns.row(rect.x - index(hx), y, rect.columns() + 2 * hx);
                look(out, hx, spec.step[0], |k, up| {
                    let x = if up { hx - k } else { hx + k };
                    &row[x..x + rect.columns()]
                });
                for d in out {
                    *d = d.sqrt();
                }
            }
        },
    );
}

/// The profile 1 - (1 - min(d/radius, 1))²: 0 and steep at the edge, flat at the radius.
pub fn dome(distances: &mut [f32], radius: f32) {
    let scale = 1.0 / radius;
    simd::dispatch(
        #[inline(always)]
        || {
            for d in distances {
                let rest = 1.0 - min(*d * scale, 1.0);
                *d = 1.0 - rest * rest;
            }
        },
    );
}

#[expect(clippy::cast_possible_truncation, reason = "lengths need no more than f32")]
fn single(x: f64) -> f32 {
    x as f32
}

/// A distance in pixels beyond any pixel, with a finite square.
const FAR: f32 = 1e9;

/// Distance in pixels from a pixel with value `v` to the region on the line through its neighbours `a` and `b`.
#[inline(always)]
fn seed(v: f32, a: f32, b: f32, threshold: f32) -> f32 {
    let reach = |n: f32| {
        let t = (threshold - v) / (n - v);
        if n > threshold { t } else { FAR }
    };
    let edge = min(reach(a), reach(b));
    if v > threshold { 0.0 } else { edge }
}

/// Crossings on rows: scan each row.
#[inline(always)]
fn along_rows(input: &View<'_>, rect: Window, spec: &DistanceSpec, out: &mut [f32]) {
    let [hx, _] = spec.halo();
    let (w, reach) = (rect.columns() + 2 * hx - 2, hx - 1);
    let (mut line, mut next) = (vec![FAR; w], vec![FAR; w]);
    for (y, square) in (rect.y..).zip(out.chunks_exact_mut(rect.columns().max(1))) {
        let v = input.row(rect.x - index(hx), y, w + 2);
        for (((d, &a), &v), &b) in line.iter_mut().zip(v).zip(&v[1..]).zip(&v[2..]) {
            *d = seed(v, a, b, spec.threshold);
        }
        let mut jump = 1;
        while jump <= reach {
            spread(&line, &mut next, jump, jump as f32);
            std::mem::swap(&mut line, &mut next);
            jump *= 2;
        }
        for (s, d) in square.iter_mut().zip(&line[reach..]) {
            let d = d * single(spec.step[0]);
            *s = d * d;
        }
    }
}

/// next[i] = the least of line[i] and of its neighbours at distance `jump` plus `step`. With jumps 1, 2, 4 … every
/// distance is a sum of the same terms in the same order, for any window.
#[inline(always)]
fn spread(line: &[f32], next: &mut [f32], jump: usize, step: f32) {
    let n = line.len();
    if n < 2 * jump {
        for i in 0..n {
            let before = if i >= jump { line[i - jump] } else { FAR };
            let after = if i + jump < n { line[i + jump] } else { FAR };
            next[i] = min(line[i], min(before, after) + step);
        }
        return;
    }
    for ((next, d), after) in next[..jump].iter_mut().zip(line).zip(&line[jump..]) {
        *next = min(*d, after + step);
    }
    let middle = line.iter().zip(&line[jump..]).zip(&line[2 * jump..]);
    for (next, ((before, d), after)) in next[jump..].iter_mut().zip(middle) {
        *next = min(*d, min(*before, *after) + step);
    }
    for i in n - jump..n {
        next[i] = min(line[i], line[i - jump] + step);
    }
}

/// Crossings on columns: scan the columns, one row at a time.
#[inline(always)]
fn along_columns(input: &View<'_>, rect: Window, spec: &DistanceSpec, out: &mut [f32]) {
    let [_, hy] = spec.halo();
    let (w, h, reach) = (rect.columns(), rect.rows() + 2 * hy - 2, hy - 1);
    let (mut plane, mut next) = (vec![FAR; w * h], vec![FAR; w * h]);
    for (row, y) in plane.chunks_exact_mut(w.max(1)).zip(rect.y - index(hy) + 1..) {
        let at = |y: i32| input.row(rect.x, y, w);
        for (((d, &a), &v), &b) in row.iter_mut().zip(at(y - 1)).zip(at(y)).zip(at(y + 1)) {
            *d = seed(v, a, b, spec.threshold);
        }
    }
    let mut jump = 1;
    while jump <= reach {
        spread(&plane, &mut next, jump * w, jump as f32);
        std::mem::swap(&mut plane, &mut next);
        jump *= 2;
    }
    for (s, d) in out.iter_mut().zip(&plane[reach * w..]) {
        let mm = *d * single(spec.step[1]);
        *s = mm * mm;
    }
}

/// Pixels that are searched together, in registers, until all of them stop.
const BLOCK: usize = 64;

/// out = min over k of squares(±k) + (k·step)², for k up to `reach`.
#[inline(always)]
fn look<'a>(out: &mut [f32], reach: usize, step: f64, squares: impl Fn(usize, bool) -> &'a [f32]) {
    let step = single(step);
    let mut x = 0;
    let mut blocks = out.chunks_exact_mut(BLOCK);
    for out in &mut blocks {
        let part = |k, up| -> &[f32; BLOCK] { squares(k, up)[x..x + BLOCK].try_into().expect("a block is a block") };
        let mut best = [0.0; BLOCK];
        for ((best, d), s) in best.iter_mut().zip(&*out).zip(part(0, true)) {
            *best = min(*d, *s);
        }
        for k in 1..=reach {
            let away = k as f32 * step;
            let away = away * away;
            if k % 4 == 1 && furthest(&best) <= away {
                break;
            }
            let (a, b) = (part(k, true), part(k, false));
            for i in 0..BLOCK {
                best[i] = min(best[i], min(a[i], b[i]) + away);
            }
        }
        out.copy_from_slice(&best);
        x += BLOCK;
    }
    for (x, d) in (x..).zip(blocks.into_remainder()) {
        *d = min(*d, squares(0, true)[x]);
        for k in 1..=reach {
            let away = k as f32 * step;
            *d = min(*d, min(squares(k, true)[x], squares(k, false)[x]) + away * away);
        }
    }
}

/// Largest value of a block, computed in eight lanes.
#[inline(always)]
fn furthest(block: &[f32; BLOCK]) -> f32 {
    let mut lanes = [0.0; 8];
    for part in block.chunks_exact(8) {
        for (lane, d) in lanes.iter_mut().zip(part) {
            *lane = max(*lane, *d);
        }
    }
    let [a, b, c, d, e, f, g, h] = lanes;
    max(max(max(a, b), max(c, d)), max(max(e, f), max(g, h)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A disc with a slope of one pixel across its edge.
    fn disc(rect: Window, r: f32) -> Vec<f32> {
        let value = |x: i32, y: i32| {
            0.5 + 0.5 * (r - ((x as f32 - 3.3).powi(2) + (y as f32 - 1.7).powi(2)).sqrt()).clamp(-1.0, 1.0)
        };
        (rect.y..).take(rect.rows()).flat_map(|y| (rect.x..).take(rect.columns()).map(move |x| value(x, y))).collect()
    }

    #[test]
    fn a_disc_has_no_staircase() {
        let (rect, spec) =
            (Window::of(-60, -60, 120, 120), DistanceSpec { threshold: 0.5, radius: 20.0, step: [1.0, 1.0] });
        let big = rect.with_halo(spec.halo());
        let data = disc(big, 25.2);
        let mut out = vec![0.0; rect.len()];
        distance(&View::new(&data, big), rect, &spec, &mut out);
        let (mut worst, mut square) = (0.0f32, 0.0);
        for (k, d) in out.iter().enumerate() {
            let (x, y) = ((k % 120) as f32 - 60.0, (k / 120) as f32 - 60.0);
            let want = (((x - 3.3).powi(2) + (y - 1.7).powi(2)).sqrt() - 25.2).clamp(0.0, 20.0);
            worst = worst.max((d - want).abs());
            square += (d - want).powi(2);
        }
        assert!(
            worst < 0.3 && (square / out.len() as f32).sqrt() < 0.03,
            "{worst} {}",
            (square / out.len() as f32).sqrt()
        );
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn tiles_agree_and_brute_force_too(radius in 0.5f64..12.0, sx in 0.5f64..2.0, x in -20i32..20, y in -20i32..20, w in 1usize..50, h in 1usize..30, r in 2f32..20.0) {
            let spec = DistanceSpec { threshold: 0.4, radius, step: [sx, 1.0] };
            let whole = Window::of(-30, -30, 110, 80);
            let big = whole.with_halo(spec.halo());
            let data = disc(big, r);
            let view = View::new(&data, big);
            let (mut all, rect) = (vec![0.0; whole.len()], Window::of(x, y, w, h));
            distance(&view, whole, &spec, &mut all);
            let mut out = vec![0.0; rect.len()];
            let near = rect.with_halo(spec.halo());
            let cut: Vec<f32> = (near.y..).take(near.rows()).flat_map(|y| view.row(near.x, y, near.columns()).to_vec()).collect();
            distance(&View::new(&cut, near), rect, &spec, &mut out);
            let all = View::new(&all, whole);
            for j in 0..h {
                prop_assert_eq!(&out[j * w..(j + 1) * w], all.row(x, y + index(j), w));
            }
            let [hx, hy] = spec.halo().map(index);
            let mut best = radius * radius;
            for dy in -hy + 1..hy {
                for dx in -hx + 1..hx {
                    let v = |a: i32, b: i32| f64::from(view.at(x + dx + a, y + dy + b));
                    let t = 0.4f32.into();
                    for (a, b) in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
                        let s = if v(0, 0) > t { 0.0 } else if v(a, b) > t { (t - v(0, 0)) / (v(a, b) - v(0, 0)) } else { continue };
                        let p = (f64::from(dx) + f64::from(a) * s) * sx;
                        let q = f64::from(dy) + f64::from(b) * s;
                        best = best.min(p * p + q * q);
                    }
                }
            }
            prop_assert!((f64::from(out[0]) - best.sqrt()).abs() < 1e-4, "{} {}", out[0], best.sqrt());
        }
    }
}
