//! Finds the two vectors by which a near-regular exemplar repeats.
//!
//! *Lattice* has the meaning of crystallography here: all integer combinations of two period vectors. It has nothing to
//! do with the lattice of points and springs in leather.
//!
//! The exemplar without its shading is correlated with itself. A basis is a pair of short shifts of high correlation,
//! all of whose sums also have a high correlation. Least squares over the peaks at those sums refine the basis to
//! fractions of a pixel, so that it does not drift over a large output.
use super::pca::principal;
use super::texels::Texels;
use crate::ground::window::{index, offset};

/// Two vectors by which a texture repeats, in exemplar pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Basis {
    /// The shorter.
    pub a: [f64; 2],
    /// The longer.
    pub b: [f64; 2],
}

/// A detected lattice basis, and the strength of the repetition.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FoundLattice {
    /// The vectors.
    pub basis: Basis,
    /// Mean correlation at the sums of the basis.
    pub mean: f64,
    /// Smallest of these correlations.
    pub least: f64,
    /// True if only few sums could be tested, because little more than one period is visible.
    pub few: bool,
}

impl FoundLattice {
    /// Returns whether the exemplar is near-regular. If few sums were tested, higher correlations are required, since
    /// chance contributes more.
    pub fn is_regular(&self) -> bool {
        if self.few { self.mean >= 0.70 && self.least >= 0.60 } else { self.mean >= 0.40 && self.least >= 0.30 }
    }
}

impl Basis {
    /// The signed area of a cell.
    pub fn det(&self) -> f64 {
        self.a[0] * self.b[1] - self.a[1] * self.b[0]
    }

    /// The vector `i a + j b`.
    pub fn at(&self, i: f64, j: f64) -> [f64; 2] {
        [i * self.a[0] + j * self.b[0], i * self.a[1] + j * self.b[1]]
    }

    /// The coefficients (i, j) of a vector.
    pub fn coordinates(&self, v: [f64; 2]) -> [f64; 2] {
        let det = self.det();
        [(v[0] * self.b[1] - v[1] * self.b[0]) / det, (self.a[0] * v[1] - self.a[1] * v[0]) / det]
    }

    /// The length of the shorter vector.
    pub fn shortest(&self) -> f64 {
        length(self.a).min(length(self.b))
    }
}

fn length(v: [f64; 2]) -> f64 {
    (v[0] * v[0] + v[1] * v[1]).sqrt()
}

/// Detects the vectors by which a picture repeats; `None` if there is no candidate.
pub fn detect(picture: &Texels<f32>) -> Option<FoundLattice> {
    let (w, h) = (picture.plane.w, picture.plane.h);
    if w.min(h) < 16 || w.max(h) > 4096 {
        return None;
    }
    let map = Correlation::new(&flattened(picture), w, h);
    let mut peaks = map.peaks();
    let strongest = peaks.iter().map(|p| p.1).fold(0.0, f64::max);
    peaks.retain(|p| p.1 >= 0.75 * strongest);
    peaks.sort_by(|a, b| length(wide(a.0)).total_cmp(&length(wide(b.0))).then(a.0.cmp(&b.0)));
    peaks.truncate(16);
    let best = [false, true].map(|few| best(&map, &peaks, few));
    let [usual, few] = best;
    let found = if usual.is_some_and(|found| found.is_regular()) {
        usual
    } else {
        few.filter(FoundLattice::is_regular).or(usual)
    };
    found.map(|found| FoundLattice { basis: map.refine(found.basis, found.few), ..found })
}

/// The best basis made of two peaks.
fn best(map: &Correlation, peaks: &[([i32; 2], f64)], few: bool) -> Option<FoundLattice> {
    let mut best: Option<(f64, FoundLattice)> = None;
    for (k, first) in peaks.iter().enumerate() {
        for second in &peaks[k + 1..] {
            let basis = Basis { a: wide(first.0), b: wide(second.0) };
            if basis.det().abs() < f64::max(25.0, 0.5 * length(basis.a) * length(basis.b)) {
                continue;
            }
            let Some((mean, least)) = map.strength(&basis, few) else { continue };
            let score = mean - 0.02 * libm::log2(basis.det().abs() / 100.0);
            if best.as_ref().is_none_or(|b| score > b.0) {
                best = Some((score, FoundLattice { basis, mean, least, few }));
            }
        }
    }
    best.map(|best| best.1)
}

fn wide(v: [i32; 2]) -> [f64; 2] {
    v.map(f64::from)
}

/// Two planes with the main colours of a picture, without shading and noise.
fn flattened(picture: &Texels<f32>) -> [Vec<f64>; 2] {
    let side = picture.plane.w.max(picture.plane.h);
    let (fine, shading) = (picture.blurred(2), picture.blurred((side / 4).max(4)));
    let flat: Vec<f32> = fine.data.iter().zip(&shading.data).map(|(a, b)| a - b).collect();
    let map = principal(&flat, picture.channels, 2);
    [0, 1].map(|d| {
        let dot = |v: &[f32]| v.iter().zip(&map).map(|(v, row)| f64::from(v * row[d])).sum();
        flat.chunks_exact(picture.channels).map(dot).collect()
    })
}

/// Normalised autocorrelation of a picture at shifts (x, y), |x| ≤ 3/4 w, 0 ≤ y ≤ 3/4 h.
struct Correlation {
    reach: [i32; 2],
    half: [f64; 2],
    values: Vec<f64>,
}

impl Correlation {
    fn new(planes: &[Vec<f64>; 2], w: usize, h: usize) -> Self {
        let (fw, fh) = ((2 * w).next_power_of_two(), (2 * h).next_power_of_two());
        let mut data = vec![[0.0; 2]; fw * fh];
        for y in 0..h {
            for x in 0..w {
                data[y * fw + x] = [planes[0][y * w + x], planes[1][y * w + x]];
            }
        }
        fft2(&mut data, fw, fh);
        // Square the spectrum of a + ib: the real part of its transform is the sum of both correlations.
        data.iter_mut().for_each(|v| *v = [v[0] * v[0] + v[1] * v[1], 0.0]);
        fft2(&mut data, fw, fh);
        let scale = 1.0 / (fw * fh) as f64;
        let energy = Sums::new(planes, w, h);
        let reach = [index(w * 3 / 4), index(h * 3 / 4)];
        let mut map = Self { reach, half: [w as f64 / 2.0, h as f64 / 2.0], values: Vec::new() };
        for y in 0..=reach[1] {
            for x in -reach[0]..=reach[0] {
                let wrapped = offset(x.rem_euclid(index(fw)));
                let product = data[offset(y) * fw + wrapped][0] * scale;
                let overlap = f64::from(index(w) - x.abs()) * f64::from(index(h) - y);
                let norm = energy.shifted(x, y, w, h).max(0.0).sqrt();
                let enough = overlap >= 0.25 * (w * h) as f64 && norm > 1e-12;
                map.values.push(if enough { product / norm } else { 0.0 });
            }
        }
        map
    }

    fn at(&self, x: i32, y: i32) -> f64 {
        let (x, y) = if y < 0 { (-x, -y) } else { (x, y) };
        if x.abs() > self.reach[0] || y > self.reach[1] {
            return 0.0;
        }
        self.values[offset(y * (2 * self.reach[0] + 1) + x + self.reach[0])]
    }

    /// Local maxima; each also represents the opposite shift.
    fn peaks(&self) -> Vec<([i32; 2], f64)> {
        let mut peaks = Vec::new();
        for y in 0..=self.reach[1] {
            for x in -self.reach[0]..=self.reach[0] {
                let v = self.at(x, y);
                if v <= 0.1 || x * x + y * y < 25 || (y == 0 && x < 0) {
                    continue;
                }
                let around = (-3..=3).flat_map(|dy| (-3..=3).map(move |dx| (dx, dy)));
                if around.into_iter().all(|(dx, dy)| self.at(x + dx, y + dy) <= v) {
                    peaks.push(([x, y], v));
                }
            }
        }
        peaks
    }

    /// The largest value within a pixel of a shift, and its position.
    fn near(&self, [x, y]: [f64; 2]) -> (f64, i32, i32) {
        #[expect(clippy::cast_possible_truncation, reason = "within the picture")]
        let (x, y) = (x.round() as i32, y.round() as i32);
        let around = (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| (x + dx, y + dy)));
        around.map(|(x, y)| (self.at(x, y), x, y)).fold((f64::MIN, 0, 0), |a, b| if b.0 > a.0 { b } else { a })
    }

    /// Coefficients of the sums of a basis, one of each pair of opposites: within half the picture or, if those are
    /// few, wherever a third of it overlaps.
    fn sums(&self, basis: &Basis, few: bool) -> Vec<[f64; 2]> {
        let inside = |i: i32, j: i32| {
            let [x, y] = basis.at(f64::from(i), f64::from(j)).map(f64::abs);
            if few {
                let share = |v: f64, half: f64| (1.0 - 0.5 * v / half).max(0.0);
                return share(x, self.half[0]) * share(y, self.half[1]) >= 1.0 / 3.0;
            }
            x <= self.half[0] && y <= self.half[1]
        };
        let all = (-40..=40).flat_map(|i| (0..=40).map(move |j| (i, j)));
        let one = all.filter(|&(i, j)| (j > 0 || i > 0) && inside(i, j));
        one.map(|(i, j)| [f64::from(i), f64::from(j)]).collect()
    }

    /// Mean and smallest correlation at the sums of a basis; `None` with fewer than four sums (two if `few`).
    fn strength(&self, basis: &Basis, few: bool) -> Option<(f64, f64)> {
        let values: Vec<f64> = self.sums(basis, few).into_iter().map(|[i, j]| self.near(basis.at(i, j)).0).collect();
        let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
        (values.len() >= if few { 2 } else { 4 }).then(|| (mean, values.iter().copied().fold(f64::MAX, f64::min)))
    }

    /// The basis that fits the peaks at its sums best.
    fn refine(&self, basis: Basis, few: bool) -> Basis {
        let (mut m, mut r) = ([0.0; 3], [[0.0; 2]; 2]);
        for [i, j] in self.sums(&basis, few) {
            let (v, x, y) = self.near(basis.at(i, j));
            let weight = v.max(0.0);
            let top = |before: f64, after: f64| {
                let bend = before - 2.0 * v + after;
                if bend < -1e-9 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 }
            };
            let at = [
                f64::from(x) + top(self.at(x - 1, y), self.at(x + 1, y)),
                f64::from(y) + top(self.at(x, y - 1), self.at(x, y + 1)),
            ];
            m[0] += weight * i * i;
            m[1] += weight * i * j;
            m[2] += weight * j * j;
            for axis in 0..2 {
                r[0][axis] += weight * i * at[axis];
                r[1][axis] += weight * j * at[axis];
            }
        }
        let det = m[0] * m[2] - m[1] * m[1];
        if det.abs() < 1e-9 {
            return basis;
        }
        let solve = |axis: usize| {
            [(r[0][axis] * m[2] - r[1][axis] * m[1]) / det, (r[1][axis] * m[0] - r[0][axis] * m[1]) / det]
        };
        let ([ax, bx], [ay, by]) = (solve(0), solve(1));
        let better = Basis { a: [ax, ay], b: [bx, by] };
        let close = |a: [f64; 2], b: [f64; 2]| length([a[0] - b[0], a[1] - b[1]]) <= 1.5;
        if close(better.a, basis.a) && close(better.b, basis.b) { better } else { basis }
    }
}

/// Sums of squares over rectangles (an integral image).
struct Sums {
    table: Vec<f64>,
    stride: usize,
}

impl Sums {
    fn new(planes: &[Vec<f64>; 2], w: usize, h: usize) -> Self {
        let stride = w + 1;
        let mut table = vec![0.0; stride * (h + 1)];
        for y in 0..h {
            let mut row = 0.0;
            for x in 0..w {
                row += planes[0][y * w + x] * planes[0][y * w + x] + planes[1][y * w + x] * planes[1][y * w + x];
                table[(y + 1) * stride + x + 1] = table[y * stride + x + 1] + row;
            }
        }
        Self { table, stride }
    }

    fn between(&self, x0: usize, y0: usize, x1: usize, y1: usize) -> f64 {
        let at = |x: usize, y: usize| self.table[y * self.stride + x];
        at(x1, y1) - at(x0, y1) - at(x1, y0) + at(x0, y0)
    }

    /// Product of the energies of the two parts that overlap at the shift (x, y).
    fn shifted(&self, x: i32, y: i32, w: usize, h: usize) -> f64 {
        let (left, right) = (offset(x.max(0)), offset((-x).max(0)));
        let there = self.between(left, offset(y), w - right, h);
        let here = self.between(right, 0, w - left, h - offset(y));
        there * here
    }
}

/// The discrete Fourier transform of rows and columns; both counts are powers of two.
fn fft2(data: &mut [[f64; 2]], w: usize, h: usize) {
    use rayon::prelude::*;
    let twiddles = |n: usize| -> Vec<[f64; 2]> {
        let angle = |k: usize| -std::f64::consts::TAU * k as f64 / n as f64;
        (0..n / 2).map(|k| [libm::cos(angle(k)), libm::sin(angle(k))]).collect()
    };
    let (across, down) = (twiddles(w), twiddles(h));
    data.par_chunks_mut(w).for_each(|row| fft(row, &across));
    let mut columns = vec![[0.0; 2]; w * h];
    columns.par_chunks_mut(h).enumerate().for_each(|(x, column)| {
        column.iter_mut().enumerate().for_each(|(y, v)| *v = data[y * w + x]);
        fft(column, &down);
    });
    data.par_chunks_mut(w).enumerate().for_each(|(y, row)| {
        row.iter_mut().enumerate().for_each(|(x, v)| *v = columns[x * h + y]);
    });
}

fn fft(data: &mut [[f64; 2]], twiddles: &[[f64; 2]]) {
    let n = data.len();
    let bits = n.trailing_zeros();
    for i in 0..n {
        let j = if bits == 0 { 0 } else { i.reverse_bits() >> (usize::BITS - bits) };
        if i < j {
            data.swap(i, j);
        }
    }
    let mut size = 2;
    while size <= n {
        let step = n / size;
        for block in data.chunks_exact_mut(size) {
            let (even, odd) = block.split_at_mut(size / 2);
            for (k, (a, b)) in even.iter_mut().zip(odd).enumerate() {
                let t = twiddles[k * step];
                let p = [b[0] * t[0] - b[1] * t[1], b[0] * t[1] + b[1] * t[0]];
                *b = [a[0] - p[0], a[1] - p[1]];
                *a = [a[0] + p[0], a[1] + p[1]];
            }
        }
        size *= 2;
    }
}
