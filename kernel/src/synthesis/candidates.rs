//! Candidate sets: for each pixel of an exemplar, other pixels that look alike.
//!
//! PatchMatch on neighbourhood vectors (C. Barnes et al., 2009): each pixel starts with a hashed guess, tries the
//! candidates of the pixels before it (propagation, in alternating direction), and searches at random around its best
//! candidate, within a radius that is halved each time.
use super::pca::DIMS;
use super::plane::PixelPlane;
use crate::ground::hash::Hash;
use crate::ground::simd;
use crate::ground::stop::Until;
use crate::ground::window::{index, offset};

const ROUNDS: u64 = 4;

/// Settings of the search.
pub struct SearchSpec<'a> {
    /// Size of the exemplar, and the axes that wrap.
    pub plane: PixelPlane,
    /// Pixels that may be candidates; empty for all.
    pub usable: &'a [bool],
    /// Known candidates of each pixel; new ones keep the same distance from them.
    pub found: &'a [Vec<u32>],
    /// Minimum distance of a candidate, in pixels.
    pub distance: f64,
    /// Spacing of the level; scales the search.
    pub h: usize,
    /// Random numbers.
    pub hash: Hash,
}

/// Finds for each pixel the allowed pixel that looks most like it. Returns nothing if stopped.
pub fn similar(vectors: &[[f32; DIMS]], spec: &SearchSpec<'_>, until: Until<'_>) -> Vec<u32> {
    let &SearchSpec { plane, usable, found, distance, h, hash } = spec;
    #[expect(clippy::cast_possible_truncation, reason = "a number of pixels of an exemplar")]
    let near = distance.ceil().max(1.0) as i32;
    simd::dispatch(
        #[inline(always)]
        || {
            let search = Search { vectors, plane, usable, found, near, step: (h / 4).max(1), hash, until };
            if plane.wrap == [false; 2] && usable.is_empty() && found.is_empty() {
                search.run::<true>()
            } else {
                search.run::<false>()
            }
        },
    )
}

struct Search<'a> {
    vectors: &'a [[f32; DIMS]],
    plane: PixelPlane,
    usable: &'a [bool],
    found: &'a [Vec<u32>],
    near: i32,
    /// Step between searched columns and rows; 1 searches all of them.
    step: usize,
    hash: Hash,
    until: Until<'a>,
}

/// Number of pixels searched between two checks of `until`.
const PIXELS: usize = 1 << 11;

/// Squared distance of two vectors, summed in a fixed order.
#[inline(always)]
pub(super) fn distance(a: &[f32; DIMS], b: &[f32; DIMS]) -> f32 {
    let mut t = [0.0f32; DIMS];
    for ((t, a), b) in t.iter_mut().zip(a).zip(b) {
        let d = a - b;
        *t = d * d;
    }
    ((t[0] + t[4]) + (t[2] + t[6])) + ((t[1] + t[5]) + (t[3] + t[7]))
}

/// The best candidate of a pixel: squared distance of its vector, and its position.
type Found = (f32, [i32; 2]);

impl Search<'_> {
    /// Brings (x, y) inside and returns it if it is allowed as a candidate of (x0, y0). `PLAIN`: no side wraps, all
    /// pixels are usable, and no candidates are known.
    #[inline(always)]
    fn allowed<const PLAIN: bool>(&self, [x, y]: [i32; 2], [x0, y0]: [i32; 2]) -> Option<[i32; 2]> {
        let PixelPlane { w, h, wrap } = self.plane;
        let (w, h) = (index(w), index(h));
        let x = if !PLAIN && wrap[0] { x.rem_euclid(w) } else { x };
        let y = if !PLAIN && wrap[1] { y.rem_euclid(h) } else { y };
        if !(0..w).contains(&x) || !(0..h).contains(&y) {
            return None;
        }
        let span = |a: i32, b: i32, n: i32, wrap: bool| {
            if !PLAIN && wrap { (a - b).abs().min(n - (a - b).abs()) } else { (a - b).abs() }
        };
        let close = |[x0, y0]: [i32; 2]| span(x, x0, w, wrap[0]).max(span(y, y0, h, wrap[1])) < self.near;
        if close([x0, y0]) {
            return None;
        }
        if !PLAIN {
            for found in self.found {
                let other = index(found[self.at([x0, y0])] as usize);
                if close([other % w, other / w]) {
                    return None;
                }
            }
        }
        (PLAIN || self.usable.is_empty() || self.usable[self.at([x, y])]).then_some([x, y])
    }

    /// Index of pixel (x, y).
    #[inline(always)]
    fn at(&self, [x, y]: [i32; 2]) -> usize {
        offset(y) * self.plane.w + offset(x)
    }

    #[inline(always)]
    fn run<const PLAIN: bool>(&self) -> Vec<u32> {
        let (w, h) = (index(self.plane.w), index(self.plane.h));
        let step = index(self.step);
        // A coarse level changes slowly: pixels in between are derived from their neighbour.
        let columns: Vec<i32> = (0..w).step_by(self.step).collect();
        let rows: Vec<i32> = (0..h).step_by(self.step).collect();
        let mut best: Vec<Found> = (0..h).flat_map(|y| (0..w).map(move |x| (f32::INFINITY, [x, y]))).collect();
        let place = |k: usize| [columns[k % columns.len()], rows[k / columns.len()]];
        let count = columns.len() * rows.len();
        for n in 0..count {
            if n.is_multiple_of(PIXELS) && (self.until)() {
                return Vec::new();
            }
            let own = place(n);
            let p = self.at(own);
            for k in 0..8 {
                let word = self.hash.with(k).u64(p as u64);
                let mut mine = best[p];
                self.try_one::<PLAIN>(&mut mine, own, [pick(word, w), pick(word >> 32, h)]);
                best[p] = mine;
                if mine.0.is_finite() {
                    break;
                }
            }
        }
        for round in 0..ROUNDS {
            let hash = self.hash.with(100 + round);
            let back = if round % 2 == 0 { -step } else { step };
            for k in 0..count {
                if k.is_multiple_of(PIXELS) && (self.until)() {
                    return Vec::new();
                }
                let own = place(if round % 2 == 0 { k } else { count - 1 - k });
                let p = self.at(own);
                let mut mine = best[p];
                for [dx, dy] in [[back, 0], [0, back]] {
                    let [qx, qy] = [own[0] + dx, own[1] + dy];
                    if (0..w).contains(&qx) && (0..h).contains(&qy) {
                        let [x, y] = best[self.at([qx, qy])].1;
                        self.try_one::<PLAIN>(&mut mine, own, [x - dx, y - dy]);
                    }
                }
                let mut radius = w.max(h) / 2;
                let mut draw = 0;
                while radius >= step && mine.0 > 0.0 {
                    let word = hash.u64((p as u64) << 5 | draw);
                    let dx = pick(word, 2 * radius + 1) - radius;
                    let dy = pick(word >> 32, 2 * radius + 1) - radius;
                    let [x, y] = mine.1;
                    self.try_one::<PLAIN>(&mut mine, own, [x + dx, y + dy]);
                    radius /= 2;
                    draw += 1;
                }
                best[p] = mine;
            }
        }
        let between = |p: usize| {
            let (x, y) = (index(p) % w, index(p) / w);
            let (dx, dy) = (x % step, y % step);
            let found = best[self.at([x - dx, y - dy])].1;
            narrow(self.at(self.allowed::<PLAIN>([found[0] + dx, found[1] + dy], [x, y]).unwrap_or(found)))
        };
        (0..self.vectors.len()).map(between).collect()
    }

    #[inline(always)]
    fn try_one<const PLAIN: bool>(&self, best: &mut Found, own: [i32; 2], to: [i32; 2]) {
        if let Some(to) = self.allowed::<PLAIN>(to, own)
            && to != best.1
        {
            let d = distance(&self.vectors[self.at(own)], &self.vectors[self.at(to)]);
            if d < best.0 {
                *best = (d, to);
            }
        }
    }
}

/// Maps the lower half of a word to 0..`n`.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "the lower half is meant, and the result is below n")]
fn pick(word: u64, n: i32) -> i32 {
    ((u64::from(word as u32) * u64::from(n.unsigned_abs())) >> 32) as i32
}

/// Converts a pixel index to its stored form.
#[inline(always)]
pub(super) fn narrow(p: usize) -> u32 {
    u32::try_from(p).expect("an exemplar has fewer than 2^32 pixels")
}
