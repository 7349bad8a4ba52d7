//! For every pixel of an exemplar others that look alike: candidate sets.
//!
//! PatchMatch on neighbourhood vectors: every pixel starts with a hashed guess, learns from the pixels before it (in
//! alternating direction), and searches around what it has in rings that shrink by half.
use super::Plane;
use super::pca::DIMS;
use crate::kernel::hash::Hash;
use crate::kernel::simd;
use crate::kernel::stop::Until;
use crate::kernel::window::{index, offset};

const ROUNDS: u64 = 4;

/// What is sought.
pub struct Sought<'a> {
    /// Size of the exemplar, and where it joins.
    pub plane: Plane,
    /// Pixels that may be found; empty for all.
    pub usable: &'a [bool],
    /// Others of each pixel that are known already, from which it keeps away as well.
    pub found: &'a [Vec<u32>],
    /// How far away, in pixels.
    pub distance: f64,
    /// The spacing of the level, to which the search is scaled.
    pub h: usize,
    /// Random numbers.
    pub hash: Hash,
}

/// The pixel that looks most like each one, of those that may be found. Stopped, it gives nothing.
pub fn similar(vectors: &[[f32; DIMS]], sought: &Sought<'_>, until: Until<'_>) -> Vec<u32> {
    let &Sought { plane, usable, found, distance, h, hash } = sought;
    #[expect(clippy::cast_possible_truncation, reason = "a number of pixels of an exemplar")]
    let near = distance.ceil().max(1.0) as i32;
    simd::dispatch(
        #[inline(always)]
        || Search { vectors, plane, usable, found, near, step: (h / 4).max(1), hash, until }.run(),
    )
}

struct Search<'a> {
    vectors: &'a [[f32; DIMS]],
    plane: Plane,
    usable: &'a [bool],
    found: &'a [Vec<u32>],
    near: i32,
    /// Only every so many columns and rows are searched for.
    step: usize,
    hash: Hash,
    until: Until<'a>,
}

/// How many pixels are searched between two questions whether to go on.
const PIXELS: usize = 1 << 11;

/// The squared distance of two vectors, summed in a fixed order.
#[inline(always)]
pub(super) fn distance(a: &[f32; DIMS], b: &[f32; DIMS]) -> f32 {
    let mut t = [0.0f32; DIMS];
    for ((t, a), b) in t.iter_mut().zip(a).zip(b) {
        let d = a - b;
        *t = d * d;
    }
    ((t[0] + t[4]) + (t[2] + t[6])) + ((t[1] + t[5]) + (t[3] + t[7]))
}

impl Search<'_> {
    /// The pixel at (x, y), if it may stand for one at (x0, y0).
    #[inline(always)]
    fn allowed(&self, x: i32, y: i32, x0: i32, y0: i32) -> Option<usize> {
        let Plane { w, h, wrap } = self.plane;
        let (w, h) = (index(w), index(h));
        let x = if wrap[0] { x.rem_euclid(w) } else { x };
        let y = if wrap[1] { y.rem_euclid(h) } else { y };
        if !(0..w).contains(&x) || !(0..h).contains(&y) {
            return None;
        }
        let span = |a: i32, b: i32, n: i32, wrap: bool| {
            if wrap { (a - b).abs().min(n - (a - b).abs()) } else { (a - b).abs() }
        };
        let close = |x0: i32, y0: i32| span(x, x0, w, wrap[0]).max(span(y, y0, h, wrap[1])) < self.near;
        if close(x0, y0) {
            return None;
        }
        for found in self.found {
            let other = index(found[offset(y0 * w + x0)] as usize);
            if close(other % w, other / w) {
                return None;
            }
        }
        let p = offset(y * w + x);
        (self.usable.is_empty() || self.usable[p]).then_some(p)
    }

    #[inline(always)]
    fn run(&self) -> Vec<u32> {
        let (w, h) = (index(self.plane.w), index(self.plane.h));
        let step = index(self.step);
        // A coarse level changes slowly: what lies between takes after its neighbour.
        let pixels: Vec<usize> = (0..self.plane.h)
            .step_by(self.step)
            .flat_map(|y| (0..self.plane.w).step_by(self.step).map(move |x| y * self.plane.w + x))
            .collect();
        let mut best: Vec<(f32, u32)> = (0..self.vectors.len()).map(|p| (f32::INFINITY, narrow(p))).collect();
        for (n, &p) in pixels.iter().enumerate() {
            if n.is_multiple_of(PIXELS) && (self.until)() {
                return Vec::new();
            }
            for k in 0..8 {
                let word = self.hash.with(k).u64(p as u64);
                let mut mine = best[p];
                self.try_one(&mut mine, p, pick(word, w), pick(word >> 32, h));
                best[p] = mine;
                if mine.0.is_finite() {
                    break;
                }
            }
        }
        for round in 0..ROUNDS {
            let hash = self.hash.with(100 + round);
            let back = if round % 2 == 0 { -step } else { step };
            for k in 0..pixels.len() {
                if k.is_multiple_of(PIXELS) && (self.until)() {
                    return Vec::new();
                }
                let p = pixels[if round % 2 == 0 { k } else { pixels.len() - 1 - k }];
                let (x, y) = (index(p) % w, index(p) / w);
                let mut mine = best[p];
                for (dx, dy) in [(back, 0), (0, back)] {
                    let (qx, qy) = (x + dx, y + dy);
                    if (0..w).contains(&qx) && (0..h).contains(&qy) {
                        let other = best[offset(qy * w + qx)].1 as usize;
                        self.try_one(&mut mine, p, index(other) % w - dx, index(other) / w - dy);
                    }
                }
                let mut radius = w.max(h) / 2;
                let mut draw = 0;
                while radius >= step && mine.0 > 0.0 {
                    let word = hash.u64((p as u64) << 5 | draw);
                    let at = (index(mine.1 as usize) % w, index(mine.1 as usize) / w);
                    let dx = pick(word, 2 * radius + 1) - radius;
                    let dy = pick(word >> 32, 2 * radius + 1) - radius;
                    self.try_one(&mut mine, p, at.0 + dx, at.1 + dy);
                    radius /= 2;
                    draw += 1;
                }
                best[p] = mine;
            }
        }
        let between = |p: usize| {
            let (x, y) = (index(p) % w, index(p) / w);
            let (dx, dy) = (x % step, y % step);
            let found = best[offset((y - dy) * w + x - dx)].1;
            let to = (index(found as usize) % w + dx, index(found as usize) / w + dy);
            self.allowed(to.0, to.1, x, y).map_or(found, narrow)
        };
        (0..self.vectors.len()).map(between).collect()
    }

    #[inline(always)]
    fn try_one(&self, best: &mut (f32, u32), p: usize, x: i32, y: i32) {
        let w = index(self.plane.w);
        if let Some(q) = self.allowed(x, y, index(p) % w, index(p) / w)
            && narrow(q) != best.1
        {
            let d = distance(&self.vectors[p], &self.vectors[q]);
            if d < best.0 {
                *best = (d, narrow(q));
            }
        }
    }
}

/// A number below `n` from the lower half of a word.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "the lower half is meant, and the result is below n")]
fn pick(word: u64, n: i32) -> i32 {
    ((u64::from(word as u32) * u64::from(n.unsigned_abs())) >> 32) as i32
}

/// A pixel's number as it is kept.
#[inline(always)]
pub(super) fn narrow(p: usize) -> u32 {
    u32::try_from(p).expect("an exemplar has fewer than 2^32 pixels")
}
