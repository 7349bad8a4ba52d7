//! Analysis of an exemplar before synthesis. For each level: appearance vectors, neighbourhood vectors, and for each
//! pixel another pixel that looks alike.
//!
//! Appearance: 5×5 colours at spacing h under a Gaussian of σ 1.41, reduced to their principal components.
//! Neighbourhood: the appearance of the neighbours at spacing h, reduced in the same way, without their mean, since
//! only differences count.
use super::candidates::{self, SearchSpec};
use super::pca::{DIMS, Projection, principal};
use super::plane::PixelPlane;
use super::texels::{Texels, mirrored};
use crate::ground::hash::Hash;
use crate::ground::simd;
use crate::ground::stop::{NEVER, Until};
use crate::ground::window::index;
use rayon::prelude::*;
pub use shibo_value::{ExemplarLevel as Level, Neighborhood as Hood};

/// Settings of the analysis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AnalysisSpec {
    /// Neighbourhood of the levels with `h ≥ switch`.
    pub coarse: Hood,
    /// Neighbourhood of the finer levels.
    pub fine: Hood,
    /// Spacing from which [`AnalysisSpec::coarse`] is used.
    pub switch: usize,
    /// Numbers per pixel, at most [`DIMS`].
    pub dims: usize,
}

impl Default for AnalysisSpec {
    fn default() -> Self {
        Self { coarse: Hood::Square5, fine: Hood::Diagonal4, switch: 4, dims: DIMS }
    }
}

/// Spacings of an exemplar's levels, from the finest: powers of two up to a quarter of its shorter side, `side`.
pub fn spacings(side: usize) -> Vec<usize> {
    let most = (side / 4).max(1);
    std::iter::successors(Some(1usize), |h| Some(h * 2)).take_while(|h| *h <= most && *h <= 256).collect()
}

/// Analyses all levels. `image` returns the picture of a level; `usable` marks the pixels that may be shown (empty:
/// all).
pub fn analyse(
    levels: &[usize],
    image: impl Fn(usize) -> Texels<f32> + Sync,
    usable: &[bool],
    spec: &AnalysisSpec,
    hash: Hash,
) -> Vec<Level> {
    analyse_until(levels, image, usable, spec, hash, NEVER)
}

/// Like [`analyse`], but can be stopped: then the result has fewer levels and must not be used.
pub fn analyse_until(
    levels: &[usize],
    image: impl Fn(usize) -> Texels<f32> + Sync,
    usable: &[bool],
    spec: &AnalysisSpec,
    hash: Hash,
    until: Until<'_>,
) -> Vec<Level> {
    let analysed = |&h: &usize| (!until()).then(|| level(h, &image(h), usable, spec, hash.with(h as u64), until));
    levels.par_iter().filter_map(analysed).collect()
}

fn level(h: usize, image: &Texels<f32>, usable: &[bool], spec: &AnalysisSpec, hash: Hash, until: Until<'_>) -> Level {
    let picked = |most: u64, hash: Hash| -> Vec<usize> {
        let good: Vec<usize> = (0..image.plane.w * image.plane.h).filter(|&p| usable.is_empty() || usable[p]).collect();
        if good.len() as u64 <= most {
            return good;
        }
        #[expect(clippy::cast_possible_truncation, reason = "below the length of the list")]
        (0..most).map(|n| good[(hash.u64(n) % good.len() as u64) as usize]).collect()
    };
    let disc: Vec<([i32; 2], f32)> = (-2i32..=2)
        .flat_map(|y| (-2i32..=2).map(move |x| [x, y]))
        .map(|[x, y]| ([x, y], crate::ground::math::exp(-((x * x + y * y) as f32) / 4.0)))
        .collect();
    let disc = Around::new(image.plane, h, &disc);
    let matrix = disc.principal(&image.data, image.channels, &picked(2048, hash.with(1)), spec.dims);
    let appearance = disc.project(&image.data, image.channels, &matrix, until);
    let hood = if h >= spec.switch { spec.coarse } else { spec.fine };
    let around: Vec<([i32; 2], f32)> = hood.offsets().into_iter().map(|o| (o, 1.0)).collect();
    let around = Around::new(image.plane, h, &around);
    let flat = appearance.as_flattened();
    let matrix = around.principal(flat, DIMS, &picked(1024, hash.with(2)), spec.dims);
    let neighborhoods = around.project(flat, DIMS, &matrix, until);
    Level { h, hood, appearance, matrix, neighborhoods, second: Vec::new() }
}

/// Finds for each pixel of each level another pixel that looks alike, at least `distance` pixels away.
pub fn find_seconds(levels: &mut [Level], plane: PixelPlane, usable: &[bool], distance: f64, hash: Hash) {
    find_alike(levels, plane, usable, distance, 2, hash, NEVER);
}

/// Finds for each pixel of each level `k - 1` other pixels that look alike, at least `distance` pixels away from the
/// pixel and from each other. With `k` = 1, the pixel itself. If stopped, the result must not be used.
pub fn find_alike(
    levels: &mut [Level],
    plane: PixelPlane,
    usable: &[bool],
    distance: f64,
    k: usize,
    hash: Hash,
    until: Until<'_>,
) {
    levels.par_iter_mut().for_each(|level| {
        let hoods = &level.neighborhoods;
        let hash = hash.with(level.h as u64);
        let mut found: Vec<Vec<u32>> = Vec::new();
        for n in 1..k as u64 {
            let hash = if n == 1 { hash } else { hash.with(n) };
            let search = SearchSpec { plane, usable, found: &found, distance, h: level.h, hash };
            let others = candidates::similar(hoods, &search, until);
            if others.len() < hoods.len() {
                return;
            }
            found.push(others);
        }
        level.second = if k < 2 { (0..hoods.len()).map(candidates::narrow).collect() } else { found.concat() };
    });
}

/// Marks the pixels whose neighbourhood can be compared: at least `margin` finest pixels away from sides that do not
/// wrap and from unusable pixels. If none is left, returns the usable ones.
pub fn valid(plane: PixelPlane, usable: &[bool], margin: usize) -> Vec<bool> {
    let PixelPlane { w, h, wrap } = plane;
    let inside = |k: usize, n: usize, wrap: bool| wrap || (k >= margin && k + margin < n);
    let mut valid: Vec<bool> = (0..w * h).map(|p| inside(p % w, w, wrap[0]) && inside(p / w, h, wrap[1])).collect();
    if !usable.is_empty() {
        let r = index(margin);
        for p in (0..w * h).filter(|&p| !usable[p]) {
            for y in -r..=r {
                for x in -r..=r {
                    let (x, y) = (index(p % w) + x, index(p / w) + y);
                    valid[PixelPlane::bring(y, h, wrap[1]) * w + PixelPlane::bring(x, w, wrap[0])] = false;
                }
            }
        }
    }
    if valid.contains(&true) {
        return valid;
    }
    if usable.is_empty() { vec![true; w * h] } else { usable.to_vec() }
}

/// Reads around every pixel of a picture, at multiples of a spacing; mirrored at sides that do not wrap.
struct Around {
    plane: PixelPlane,
    h: usize,
    /// For each offset: its column and row, both counted from -2 spacings, and its weight.
    taps: Vec<(usize, usize, f32)>,
    /// Source columns, starting two spacings before column 0.
    columns: Vec<usize>,
    rows: Vec<usize>,
}

impl Around {
    fn new(plane: PixelPlane, h: usize, offsets: &[([i32; 2], f32)]) -> Self {
        let line = |n: usize, wrap: bool| -> Vec<usize> {
            (-2 * index(h)..index(n + 2 * h)).map(|k| mirrored(k, n, wrap)).collect()
        };
        let tap = |d: i32| crate::ground::window::offset(d + 2);
        Self {
            plane,
            h,
            taps: offsets.iter().map(|&([x, y], weight)| (tap(x), tap(y), weight)).collect(),
            columns: line(plane.w, plane.wrap[0]),
            rows: line(plane.h, plane.wrap[1]),
        }
    }

    fn principal(&self, data: &[f32], channels: usize, pixels: &[usize], dims: usize) -> Projection {
        let mut samples = Vec::with_capacity(pixels.len() * self.taps.len() * channels);
        let w = self.plane.w;
        for &p in pixels {
            for &(i, j, weight) in &self.taps {
                let from = (self.rows[p / w + j * self.h] * w + self.columns[p % w + i * self.h]) * channels;
                samples.extend(data[from..from + channels].iter().map(|v| v * weight));
            }
        }
        principal(&samples, self.taps.len() * channels, dims)
    }

    fn project(&self, data: &[f32], channels: usize, matrix: &Projection, until: Until<'_>) -> Vec<[f32; DIMS]> {
        let PixelPlane { w, h, .. } = self.plane;
        // Fold the weights into the matrix.
        let weighted = |(k, row): (usize, &[f32; DIMS])| row.map(|v| v * self.taps[k / channels].2);
        let matrix: Projection = matrix.iter().enumerate().map(weighted).collect();
        // Start of each matrix row's values within the planes of a row.
        let length = self.columns.len();
        let starts: Vec<usize> = self
            .taps
            .iter()
            .flat_map(|&(i, j, _)| (0..channels).map(move |c| (j * channels + c) * length + i * self.h))
            .collect();
        let mut out = vec![[0.0; DIMS]; w * h];
        let rows = out.par_chunks_mut(w).enumerate().filter(|_| !until());
        rows.for_each_init(
            || (vec![0.0f32; 5 * channels * length], vec![0.0f32; DIMS * w]),
            |(planes, sums), (y, out)| {
                for j in (0..5).filter(|j| self.taps.iter().any(|tap| tap.1 == *j)) {
                    let row = &data[self.rows[y + j * self.h] * w * channels..][..w * channels];
                    for (c, plane) in planes.chunks_exact_mut(length).skip(j * channels).take(channels).enumerate() {
                        plane.iter_mut().zip(&self.columns).for_each(|(v, from)| *v = row[from * channels + c]);
                    }
                }
                simd::dispatch(
                    #[inline(always)]
                    || project_row(planes, &starts, &matrix, sums),
                );
                for (x, out) in out.iter_mut().enumerate() {
                    out.iter_mut().enumerate().for_each(|(d, out)| *out = sums[d * w + x]);
                }
            },
        );
        out
    }
}

/// Projects a row of pixels plane by plane, so that neighbouring pixels are summed side by side (vectorises).
#[inline(always)]
fn project_row(planes: &[f32], starts: &[usize], matrix: &Projection, sums: &mut [f32]) {
    let w = sums.len() / DIMS;
    sums.fill(0.0);
    let (fours, rest) = starts.as_chunks::<4>();
    let (matrices, last) = matrix.as_chunks::<4>();
    for (four, m) in fours.iter().zip(matrices) {
        let [p, q, r, s] = four.map(|start| &planes[start..start + w]);
        for (d, sums) in sums.chunks_exact_mut(w).enumerate() {
            for ((((sum, p), q), r), s) in sums.iter_mut().zip(p).zip(q).zip(r).zip(s) {
                *sum = (((*sum + p * m[0][d]) + q * m[1][d]) + r * m[2][d]) + s * m[3][d];
            }
        }
    }
    for (start, m) in rest.iter().zip(last) {
        for (d, sums) in sums.chunks_exact_mut(w).enumerate() {
            sums.iter_mut().zip(&planes[*start..]).for_each(|(sum, v)| *sum += v * m[d]);
        }
    }
}
