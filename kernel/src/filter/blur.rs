//! Gaussian blur whose cost hardly depends on its width.
//!
//! Up to 3 px the kernel is applied directly. Wider kernels work on a coarser grid, halved until 1.5 ≤ σ < 3 of its
//! pixels. Variances of successive filters add up exactly: those of the halvings ([1 3 3 1]/8, variance ¾), of the blur
//! on the coarse grid and of the cubic B-spline that enlarges it again (variance ⅓ of a coarse pixel) add up to σ².
//! Coarse pixel I covers pixels I·2^k … of the absolute grid, so the result does not depend on the window. Error
//! against the exact Gaussian: below 0.3 % of the range.
//!
//! Cost: see `benches/texel.rs`; independent of σ apart from the halo.

use crate::ground::simd;
use crate::ground::window::{View, WindowExt, index, offset};
use shibo_value::Buffer;
use shibo_value::Window;

/// One axis of the filter.
struct Axis {
    /// Number of halvings of the grid.
    levels: u32,
    /// Half of the symmetric kernel on the coarse grid, centre first.
    kernel: Vec<f32>,
}

impl Axis {
    fn new(sigma: f64) -> Self {
        let levels = if sigma >= 3.0 { (libm::log2(sigma / 1.5)).floor().clamp(0.0, 20.0) } else { 0.0 };
        let area = libm::exp2(2.0 * levels);
        let rest = if levels > 0.0 { (sigma * sigma - 0.25 * (area - 1.0)) / area - 1.0 / 3.0 } else { sigma * sigma };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "small counts ≥ 0")]
        let (levels, radius) = (levels as u32, if rest > 0.0 { (3.3 * rest.sqrt()).ceil() as u32 } else { 0 });
        let weight = |k: u32| if k == 0 { 1.0 } else { libm::exp(-0.5 * f64::from(k * k) / rest) };
        let sum: f64 = (0..=radius).map(|k| if k == 0 { 1.0 } else { 2.0 * weight(k) }).sum();
        #[expect(clippy::cast_possible_truncation, reason = "weights need no more than f32")]
        let kernel = (0..=radius).map(|k| (weight(k) / sum) as f32).collect();
        Self { levels, kernel }
    }

    fn radius(&self) -> i32 {
        index(self.kernel.len() - 1)
    }

    fn factor(&self) -> i32 {
        1 << self.levels
    }

    /// The first coarse pixel and the number of coarse pixels needed after the coarse blur, for `n` pixels from
    /// `start`.
    fn coarse(&self, start: i32, n: usize) -> (i32, usize) {
        if self.levels == 0 {
            return (start, n);
        }
        let (f, half) = (self.factor(), self.factor() / 2);
        let first = (start - half).div_euclid(f) - 1;
        let last = (start + index(n) - 1 - half).div_euclid(f) + 2;
        (first, offset(last - first + 1))
    }

    /// Like [`coarse`](Self::coarse), before the coarse blur.
    fn padded(&self, start: i32, n: usize) -> (i32, usize) {
        let (first, count) = self.coarse(start, n);
        (first - self.radius(), count + 2 * offset(self.radius()))
    }
}

/// Number of times that [`blur`] halves the grid for this sigma.
pub(crate) fn levels(sigma: f64) -> u32 {
    Axis::new(sigma).levels
}

/// Halo of the blur: the pixels that it reads beyond a window on each side.
pub fn halo(sigma: f64) -> usize {
    let axis = Axis::new(sigma);
    let (f, r) = (offset(axis.factor()), offset(axis.radius()));
    if axis.levels == 0 { r } else { f * (r + 4) }
}

/// Blurs `input` by a Gaussian of `sigma` pixels in x and y into `out`, which covers `rect` without gaps. A sigma of 0
/// leaves that axis unchanged.
///
/// # Panics
/// If `input` does not cover `rect` grown by [`halo`], or `out` is smaller than `rect`.
pub fn blur(input: &View<'_>, rect: Window, sigma: [f64; 2], out: &mut [f32]) {
    assert!(input.window().contains(&rect.with_halo(sigma.map(halo))), "the window lacks its halo");
    let axes = sigma.map(Axis::new);
    simd::dispatch(
        #[inline(always)]
        || blur_axes(input, rect, &axes, out),
    );
}

/// A plane with contiguous rows.
struct Plane {
    data: Buffer,
    w: usize,
}

impl Plane {
    fn new(w: usize, h: usize) -> Self {
        Self { data: Buffer::zeros(w * h), w }
    }

    #[inline(always)]
    fn row(&self, y: usize) -> &[f32] {
        &self.data[y * self.w..(y + 1) * self.w]
    }
}

#[inline(always)]
fn blur_axes(input: &View<'_>, rect: Window, [ax, ay]: &[Axis; 2], out: &mut [f32]) {
    let (x, w) = ax.padded(rect.x, rect.columns());
    let (y, h) = ay.padded(rect.y, rect.rows());
    let (cols, rows) = (source(x, w, ax.levels), source(y, h, ay.levels));
    let narrow = shrink_rows(input, cols, rows, ay.levels);
    let coarse = shrink_columns(narrow, ax.levels, w);
    let (_, wide) = ax.coarse(rect.x, rect.columns());
    let (first_y, tall) = ay.coarse(rect.y, rect.rows());
    let mut blurred = Plane::new(coarse.w, tall);
    for (y, row) in blurred.data.chunks_exact_mut(coarse.w).enumerate() {
        convolve(&ay.kernel, row, |k| {
            (coarse.row(y + ay.kernel.len() - 1 - k), coarse.row(y + ay.kernel.len() - 1 + k))
        });
    }
    let across = |y: usize, row: &mut [f32]| {
        let (source, r) = (blurred.row(y), ax.kernel.len() - 1);
        convolve(&ax.kernel, row, |k| (&source[r - k..r - k + wide], &source[r + k..r + k + wide]));
    };
    let first_x = ax.coarse(rect.x, rect.columns()).0;
    if ay.levels == 0 && ax.levels == 0 {
        out.chunks_exact_mut(rect.columns().max(1)).take(rect.rows()).enumerate().for_each(|(y, row)| across(y, row));
        return;
    }
    let mut full = Plane::new(rect.columns(), tall);
    let mut line = vec![0.0; wide];
    let mut spline = Spline::new(ax, first_x, wide, rect);
    for (y, row) in full.data.chunks_exact_mut(rect.columns().max(1)).enumerate() {
        if ax.levels == 0 {
            across(y, row);
        } else {
            across(y, &mut line);
            spline.stretch(&line, row);
        }
    }
    for (row, y) in out.chunks_exact_mut(rect.columns().max(1)).take(rect.rows()).zip(rect.y..) {
        if ay.levels == 0 {
            row.copy_from_slice(full.row(offset(y - first_y)));
            continue;
        }
        let from = (y - ay.factor() / 2).div_euclid(ay.factor());
        let [a, b, c, d] = bspline(y - ay.factor() / 2 - from * ay.factor(), ay.factor());
        let base = offset(from - 1 - first_y);
        let rows = full.row(base).iter().zip(full.row(base + 1)).zip(full.row(base + 2)).zip(full.row(base + 3));
        for (out, (((p, q), r), s)) in row.iter_mut().zip(rows) {
            *out = (p * a + q * b) + (r * c + s * d);
        }
    }
}

/// The fine pixels from which `n` coarse ones are computed.
fn source(start: i32, n: usize, levels: u32) -> (i32, usize) {
    (0..levels).fold((start, n), |(start, n), _| (2 * start - 1, 2 * n + 2))
}

/// Halves the rows of the input window `levels` times.
#[inline(always)]
fn shrink_rows(input: &View<'_>, (x, w): (i32, usize), (y, h): (i32, usize), levels: u32) -> Plane {
    if levels == 0 {
        let mut plane = Plane::new(w, h);
        for (row, y) in plane.data.chunks_exact_mut(w.max(1)).zip(y..) {
            row.copy_from_slice(input.row(x, y, w));
        }
        return plane;
    }
    let mut plane = Plane::new(w, (h - 2) / 2);
    for (k, row) in plane.data.chunks_exact_mut(w.max(1)).enumerate() {
        let at = |d: i32| input.row(x, y + index(2 * k) + d, w);
        quarter(row, at(0), at(1), at(2), at(3));
    }
    for _ in 1..levels {
        let rows = plane.data.len() / w.max(1);
        let mut next = Plane::new(w, (rows - 2) / 2);
        for (k, row) in next.data.chunks_exact_mut(w.max(1)).enumerate() {
            quarter(row, plane.row(2 * k), plane.row(2 * k + 1), plane.row(2 * k + 2), plane.row(2 * k + 3));
        }
        plane = next;
    }
    plane
}

/// [1 3 3 1]/8 of four rows.
#[inline(always)]
fn quarter(out: &mut [f32], a: &[f32], b: &[f32], c: &[f32], d: &[f32]) {
    for (out, (((a, b), c), d)) in out.iter_mut().zip(a.iter().zip(b).zip(c).zip(d)) {
        *out = (a + d) * 0.125 + (b + c) * 0.375;
    }
}

/// Halves the columns until `w` are left.
#[inline(always)]
fn shrink_columns(mut plane: Plane, levels: u32, w: usize) -> Plane {
    for level in (0..levels).rev() {
        let (_, n) = source(0, w, level);
        let mut next = Plane::new(n, plane.data.len() / plane.w.max(1));
        for (row, out) in plane.data.chunks_exact(plane.w.max(1)).zip(next.data.chunks_exact_mut(n.max(1))) {
            let pairs = row[..2 * n].chunks_exact(2).zip(row[2..].chunks_exact(2));
            for (out, (p, q)) in out.iter_mut().zip(pairs) {
                *out = (p[0] + q[1]) * 0.125 + (p[1] + q[0]) * 0.375;
            }
        }
        plane = next;
    }
    plane
}

/// Number of values summed in registers at a time.
const BLOCK: usize = 32;

/// out = Σ kernel[k]·(before(k) + after(k)), the centre counted once.
#[inline(always)]
fn convolve<'a>(kernel: &[f32], out: &mut [f32], taps: impl Fn(usize) -> (&'a [f32], &'a [f32])) {
    let mut x = 0;
    let mut blocks = out.chunks_exact_mut(BLOCK);
    for out in &mut blocks {
        let mut sum = [0.0; BLOCK];
        for (s, v) in sum.iter_mut().zip(&taps(0).0[x..x + BLOCK]) {
            *s = v * kernel[0];
        }
        for (k, weight) in kernel.iter().enumerate().skip(1) {
            let (a, b) = taps(k);
            for ((s, a), b) in sum.iter_mut().zip(&a[x..x + BLOCK]).zip(&b[x..x + BLOCK]) {
                *s += (a + b) * weight;
            }
        }
        out.copy_from_slice(&sum);
        x += BLOCK;
    }
    for (x, out) in (x..).zip(blocks.into_remainder()) {
        let mut sum = taps(0).0[x] * kernel[0];
        for (k, weight) in kernel.iter().enumerate().skip(1) {
            let (a, b) = taps(k);
            sum += (a[x] + b[x]) * weight;
        }
        *out = sum;
    }
}

/// Weights of the uniform cubic B-spline at (phase + ½)/factor between the second and third of four points.
#[expect(clippy::cast_possible_truncation, reason = "weights need no more than f32")]
pub(crate) fn bspline(phase: i32, factor: i32) -> [f32; 4] {
    let t = (f64::from(phase) + 0.5) / f64::from(factor);
    let u = 1.0 - t;
    let near = |t: f64| (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0;
    [u * u * u / 6.0, near(t), near(u), t * t * t / 6.0].map(|w| w as f32)
}

/// Enlarges rows of coarse pixels to the fine grid.
struct Spline {
    weights: [Vec<f32>; 4],
    /// The fine pixels, with a few extra ones on either side.
    line: Vec<f32>,
    /// Index of the first wanted pixel.
    skip: usize,
}

impl Spline {
    fn new(axis: &Axis, first: i32, count: usize, rect: Window) -> Self {
        let f = axis.factor();
        let mut weights: [Vec<f32>; 4] = Default::default();
        for phase in 0..f {
            bspline(phase, f).into_iter().zip(&mut weights).for_each(|(w, list)| list.push(w));
        }
        let line = vec![0.0; count.saturating_sub(3) * offset(f)];
        let skip = if axis.levels == 0 { 0 } else { offset(rect.x - ((first + 1) * f + f / 2)) };
        Self { weights, line, skip }
    }

    #[inline(always)]
    fn stretch(&mut self, coarse: &[f32], out: &mut [f32]) {
        match self.weights[0].len() {
            2 => self.phases::<2>(coarse),
            4 => self.phases::<4>(coarse),
            f => {
                let [a, b, c, d] = &self.weights;
                for (run, p) in self.line.chunks_exact_mut(f).zip(coarse.windows(4)) {
                    for ((((out, a), b), c), d) in run.iter_mut().zip(a).zip(b).zip(c).zip(d) {
                        *out = (p[0] * a + p[1] * b) + (p[2] * c + p[3] * d);
                    }
                }
            }
        }
        out.copy_from_slice(&self.line[self.skip..self.skip + out.len()]);
    }

    #[inline(always)]
    fn phases<const F: usize>(&mut self, coarse: &[f32]) {
        let mut w = [[0.0; 4]; F];
        for (phase, w) in w.iter_mut().enumerate() {
            *w = [0, 1, 2, 3].map(|k| self.weights[k][phase]);
        }
        for (run, p) in self.line.chunks_exact_mut(F).zip(coarse.windows(4)) {
            for (out, [a, b, c, d]) in run.iter_mut().zip(&w) {
                *out = (p[0] * a + p[1] * b) + (p[2] * c + p[3] * d);
            }
        }
    }
}

#[cfg(test)]
#[expect(clippy::cast_possible_truncation, reason = "small counts")]
mod tests {
    use super::*;
    use crate::ground::hash::Hash;
    use proptest::prelude::*;

    fn picture(rect: Window) -> Vec<f32> {
        let hash = Hash::new(9);
        let bit = |x: i32, y: i32| {
            let cell =
                u64::from((x.div_euclid(37)).cast_unsigned()) << 32 | u64::from((y.div_euclid(23)).cast_unsigned());
            (hash.unit_f32(cell) * 2.0).floor()
        };
        (rect.y..).take(rect.rows()).flat_map(|y| (rect.x..).take(rect.columns()).map(move |x| bit(x, y))).collect()
    }

    fn exact(input: &View<'_>, rect: Window, sigma: [f64; 2]) -> Vec<f64> {
        let weights = |s: f64| -> Vec<f64> {
            let r = if s > 0.0 { i32::try_from((5.0 * s).ceil() as i64).unwrap() } else { 0 };
            let w: Vec<f64> =
                (-r..=r).map(|k| if s > 0.0 { (-0.5 * f64::from(k * k) / (s * s)).exp() } else { 1.0 }).collect();
            let sum: f64 = w.iter().sum();
            w.iter().map(|x| x / sum).collect()
        };
        let (wx, wy) = (weights(sigma[0]), weights(sigma[1]));
        let (rx, ry) = (index(wx.len() / 2), index(wy.len() / 2));
        let columns: Vec<Vec<f64>> = (rect.y..)
            .take(rect.rows())
            .map(|y| {
                (rect.x - rx..)
                    .take(rect.columns() + wx.len() - 1)
                    .map(|x| wy.iter().zip(y - ry..).map(|(w, y)| w * f64::from(input.at(x, y))).sum())
                    .collect()
            })
            .collect();
        columns
            .iter()
            .flat_map(|row| {
                row.windows(wx.len()).map(|r| r.iter().zip(&wx).map(|(a, b)| a * b).sum()).collect::<Vec<f64>>()
            })
            .collect()
    }

    #[test]
    fn matches_the_exact_gaussian() {
        let rect = Window::of(5, -3, 70, 60);
        for sigma in [[0.4, 0.0], [1.0, 2.0], [2.9, 3.1], [4.0, 5.9], [6.0, 11.9], [12.0, 20.0], [40.0, 3.0]] {
            let big = rect.with_halo(sigma.map(|s| halo(s).max((5.0 * s).ceil() as usize)));
            let data = picture(big);
            let view = View::new(&data, big);
            let mut out = vec![0.0; rect.len()];
            blur(&view, rect, sigma, &mut out);
            let worst =
                out.iter().zip(exact(&view, rect, sigma)).map(|(a, b)| (f64::from(*a) - b).abs()).fold(0.0, f64::max);
            assert!(worst < 0.003, "{sigma:?}: {worst}");
        }
    }

    #[test]
    fn zero_sigma_changes_nothing() {
        let rect = Window::of(-3, 2, 33, 5);
        let data = picture(rect);
        let mut out = vec![0.0; rect.len()];
        blur(&View::new(&data, rect), rect, [0.0, 0.0], &mut out);
        assert_eq!(out, data);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn tiles_agree(sx in 0f64..30.0, sy in 0f64..30.0, x in -40i32..40, y in -40i32..40, w in 1usize..90, h in 1usize..50) {
            let sigma = [sx, sy];
            let whole = Window::of(-50, -50, 200, 150);
            let big = whole.with_halo(sigma.map(halo));
            let data = picture(big);
            let view = View::new(&data, big);
            let (mut all, rect) = (vec![0.0; whole.len()], Window::of(x, y, w, h));
            blur(&view, whole, sigma, &mut all);
            let near = rect.with_halo(sigma.map(halo));
            let cut: Vec<f32> = (near.y..).take(near.rows()).flat_map(|y| view.row(near.x, y, near.columns()).to_vec()).collect();
            let mut out = vec![0.0; rect.len()];
            blur(&View::new(&cut, near), rect, sigma, &mut out);
            let all = View::new(&all, whole);
            for j in 0..h {
                prop_assert_eq!(&out[j * w..(j + 1) * w], all.row(x, y + index(j), w));
            }
        }
    }
}
