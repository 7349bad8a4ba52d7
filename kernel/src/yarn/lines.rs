//! The middle lines of threads, and the smooth displacement of all of them.
use super::noise::{cells, torus};
use crate::ground::hash::Hash;
use glam::{DVec2, DVec3};

/// The middle of a thread as a line that repeats: after the last point follows the first one, shifted by `period`.
#[derive(Clone, Debug, PartialEq)]
pub struct Line {
    /// Its points; x and y on the canvas, z up; mm. At least two.
    pub points: Vec<DVec3>,
    /// For each point the part of the thread that begins there: the number of a stitch, or of a float.
    pub parts: Vec<u32>,
    /// From the first point to its first repeat.
    pub period: DVec2,
    /// Index of its yarn.
    pub yarn: usize,
}

/// Maximum number of segments of all lines.
pub const MOST_SEGMENTS: usize = 1_000_000;

/// The multiple of `repeat` whose equal parts of `length` are nearest to `pitch`; at least `repeat`.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
pub fn fit(length: f64, pitch: f64, repeat: u32) -> u32 {
    let repeats = (length / (pitch * f64::from(repeat))).round().clamp(1.0, 1e6);
    (repeats as u32).saturating_mul(repeat)
}

/// A smooth displacement of the plane that repeats with the canvas. Threads that touch stay together, because all of
/// them are moved by it.
#[derive(Clone, Copy, Debug)]
pub struct Sway {
    hash: Hash,
    size: DVec2,
    counts: [u32; 2],
    amount: f64,
}

impl Sway {
    /// Places are moved by up to `amount` mm, alike within about `scale` mm.
    pub fn new(hash: Hash, size: DVec2, scale: f64, amount: f64) -> Self {
        Self { hash, size, counts: [cells(size.x, scale), cells(size.y, scale)], amount }
    }

    /// The displacement at a place.
    pub fn at(&self, p: DVec2) -> DVec2 {
        if self.amount <= 0.0 {
            return DVec2::ZERO;
        }
        let at = [0, 1].map(|k| p[k] / self.size[k] * f64::from(self.counts[k]));
        let of = |n: u64| torus(self.hash.with(n), at, self.counts);
        self.amount * DVec2::new(of(1), of(2))
    }
}

/// The smooth step from 0 to 1.
pub(super) fn smooth(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
