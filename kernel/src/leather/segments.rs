//! Wrinkle segments: for each link the segment across it.
//!
//! Source: JP4905282B2 §7, claim 1: perpendicular to the link, with its midpoint and its length.

use super::links::Links;
use glam::Vec2;
use rayon::prelude::*;
use shibo_value::clip_line;

/// Settings for placing segments.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SegmentSpec {
    /// Size of the canvas in mm, for links that wrap.
    pub size: Vec2,
    /// Length of the segment over that of the link; 1 is the source's.
    pub length_scale: f32,
    /// Links longer than this multiple of the median give no segment; infinity keeps all.
    pub max_length: f32,
}

/// A straight piece of a wrinkle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Segment {
    /// Its two ends in mm.
    pub ends: [Vec2; 2],
    /// The link that it comes from.
    pub link: u32,
}

/// The segments of all links that `keep` accepts, in the order of the links. From end 0 to end 1 is the link's
/// direction rotated by 90° from +x towards +y. O(links).
pub fn place(points: &[Vec2], links: &Links, spec: &SegmentSpec, keep: impl Fn(usize) -> bool + Sync) -> Vec<Segment> {
    let longest = if spec.max_length.is_finite() {
        spec.max_length * median(&links.lengths(points, spec.size))
    } else {
        f32::INFINITY
    };
    let segment = |(l, link): (usize, u32)| {
        let [a, b] = links.ends(l, points, spec.size);
        let half = (b - a).perp() * (0.5 * spec.length_scale);
        let middle = a + (b - a) * 0.5;
        let fits = keep(l) && (b - a).length() <= longest;
        fits.then_some(Segment { ends: [middle - half, middle + half], link })
    };
    let count = crate::ground::number::index_u32(links.pairs.len());
    (0..count).into_par_iter().filter_map(|l| segment((l as usize, l))).collect()
}

/// The median of `values`, 0 if there are none.
pub fn median(values: &[f32]) -> f32 {
    let mut sorted = values.to_vec();
    let middle = sorted.len() / 2;
    if sorted.is_empty() { 0.0 } else { *sorted.select_nth_unstable_by(middle, f32::total_cmp).1 }
}

/// Clips segments to the rectangle from `low` to `high` and drops those outside. O(n).
pub fn clip(segments: &[Segment], low: Vec2, high: Vec2) -> Vec<Segment> {
    let cut = |s: &Segment| clip_line(s.ends, low, high).map(|ends| Segment { ends, ..*s });
    segments.iter().filter_map(cut).collect()
}
