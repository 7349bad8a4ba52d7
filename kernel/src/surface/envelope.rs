//! The lower envelope of a height under copies of a shape: out(x) = min over y of h(y) + t(|x − y|), where t rises from
//! 0. A cone gives the largest height under h whose steps between any two samples keep a slope; the tip of a tool gives
//! the surface that it leaves.
//!
//! The result is exact. It is the least of the same sums for any window: sums that are left out are never less.
//!
//! Blocks of 8 × 8 samples visit the blocks around them, ring by ring, as long as the lowest sample of a block can still
//! lower one of their own. For a cone, two sweeps over the window that carry the source of each value (after P.-E.
//! Danielsson, "Euclidean distance mapping", 1980) give a bound near the result. Samples above that bound are left out,
//! because the cone of another sample lies below theirs everywhere. The sweeps alone are not exact.
//!
//! Cost for a cone: about 0.1 µs a pixel of the window with its halo.

#[cfg(test)]
mod tests;

use crate::ground::math::{max, min};
use crate::ground::number::narrow;
use crate::ground::simd;
use crate::ground::window::{View, WindowExt, index, offset};
use shibo_value::Window;

/// Samples along the side of a block.
const SIDE: usize = 8;

/// The shape whose copies form the envelope, by the distance from its lowest point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Profile {
    /// A cone that rises by this much per length, without an end: its reach bounds only the heights.
    Cone(f64),
    /// A cone that rises by this much per length and ends at the reach.
    Tip(f64),
    /// The lower half of a ball of this radius.
    Ball(f64),
    /// A flat disc.
    Flat,
}

impl Profile {
    /// The height at a distance from the lowest point, mm.
    pub fn at(self, distance: f64) -> f64 {
        match self {
            Self::Cone(slope) | Self::Tip(slope) => slope * distance,
            // The same as r − √(r² − d²), without cancellation.
            Self::Ball(r) => distance * distance / (r + (r * r - distance * distance).max(0.0).sqrt()),
            Self::Flat => 0.0,
        }
    }
}

/// A profile on a grid: its height for each offset in pixels, infinite beyond its reach.
#[derive(Clone, Debug)]
pub struct Foot {
    cone: bool,
    /// Pixels to its edge.
    reach: [usize; 2],
    /// Rows dy = 0, 1, …; each has the columns from −`reach[0]` − `SIDE` on.
    heights: Vec<f32>,
}

/// The tolerance for pixels at the edge, as a share of the reach, so that rounding does not decide.
const ROUNDING: f64 = 1e-9;

impl Foot {
    /// The profile up to the distance `reach` in mm, for pixels of `step` mm.
    pub fn new(profile: Profile, reach: f64, step: [f64; 2]) -> Self {
        let most = reach * (1.0 + ROUNDING);
        let reach = Self::reach(reach, step);
        let (columns, rows) = (2 * (reach[0] + SIDE), reach[1] + SIDE);
        let mut heights = Vec::with_capacity(columns * rows);
        for dy in 0..rows {
            for column in 0..columns {
                let dx = column.abs_diff(reach[0] + SIDE);
                let distance = libm::hypot(dx as f64 * step[0], dy as f64 * step[1]);
                heights.push(if distance <= most { narrow(profile.at(distance)) } else { f32::INFINITY });
            }
        }
        Self { cone: matches!(profile, Profile::Cone(_)), reach, heights }
    }

    /// Halo in pixels, in x and y, of a profile with this reach in mm.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number of pixels")]
    pub fn reach(reach: f64, step: [f64; 2]) -> [usize; 2] {
        step.map(|step| (reach / step * (1.0 + ROUNDING)).floor().clamp(0.0, 1e6) as usize)
    }

    /// The row of heights at this distance in y; the height for dx = 0 has the index `reach[0] + SIDE`.
    #[inline(always)]
    fn row(&self, dy: usize) -> &[f32] {
        let columns = 2 * (self.reach[0] + SIDE);
        &self.heights[dy * columns..][..columns]
    }

    #[inline(always)]
    fn at(&self, dx: usize, dy: usize) -> f32 {
        if dx > self.reach[0] || dy > self.reach[1] {
            return f32::INFINITY;
        }
        self.row(dy)[self.reach[0] + SIDE + dx]
    }

    /// Offsets in x and in y up to which it is at most `height` high.
    fn within(&self, height: f32) -> [usize; 2] {
        let x = (0..=self.reach[0]).take_while(|dx| self.at(*dx, 0) <= height).count();
        let y = (0..=self.reach[1]).take_while(|dy| self.at(0, *dy) <= height).count();
        [x.saturating_sub(1), y.saturating_sub(1)]
    }
}

/// The least and the greatest value in a window; both NaN if a value is not finite.
///
/// # Panics
/// If `input` does not cover the window.
pub fn range(input: &View<'_>, window: Window) -> (f32, f32) {
    let (mut least, mut greatest, mut finite) = (f32::INFINITY, f32::NEG_INFINITY, true);
    for y in window.y..window.bottom() {
        for v in input.row(window.x, y, window.columns()) {
            least = min(least, *v);
            greatest = max(greatest, *v);
            finite &= v.is_finite();
        }
    }
    if finite { (least, greatest) } else { (f32::NAN, f32::NAN) }
}

/// The lower envelope in `rect`. `bounds` are the least and the greatest value of `rect` with its halo, both finite. For a
/// cone, they must not be farther apart than the cone is high at its edge.
///
/// # Panics
/// If `input` does not cover `rect` grown by the reach of `foot`, or `out` is smaller than `rect`.
pub fn lower(input: &View<'_>, rect: Window, foot: &Foot, (least, greatest): (f32, f32), out: &mut [f32]) {
    assert!(input.window().contains(&rect.with_halo(foot.reach)), "the window lacks its halo");
    let out = &mut out[..rect.len()];
    if out.is_empty() {
        return;
    }
    // Sums differ from their exact values by less than this.
    let rounding = 4.0 * f32::EPSILON * (max(least.abs(), greatest.abs()) + (greatest - least));
    // Copies farther away are above the greatest value.
    let halo = foot.within(greatest - least + rounding);
    let blocks = halo.map(|n| n.div_ceil(SIDE));
    let near = Near {
        window: rect.with_halo(halo),
        corner: [rect.x - index(SIDE * blocks[0]), rect.y - index(SIDE * blocks[1])],
        columns: 2 * blocks[0] + rect.columns().div_ceil(SIDE),
        rows: 2 * blocks[1] + rect.rows().div_ceil(SIDE),
        blocks,
    };
    let bound = foot.cone.then(|| sweep(input, near.window, foot, halo));
    let samples = Samples::new(input, &near, bound.as_deref(), rounding);
    simd::dispatch(
        #[inline(always)]
        || {
            for y in 0..rect.rows().div_ceil(SIDE) {
                for x in 0..rect.columns().div_ceil(SIDE) {
                    let own = Window::of(rect.x + index(SIDE * x), rect.y + index(SIDE * y), SIDE, SIDE);
                    let (w, h) = (offset(rect.right() - own.x).min(SIDE), offset(rect.bottom() - own.y).min(SIDE));
                    let mut best = [f32::NEG_INFINITY; SIDE * SIDE];
                    for j in 0..h {
                        let y = own.y + index(j);
                        let from = match &bound {
                            Some(bound) => View::new(bound, near.window).row(own.x, y, w),
                            None => input.row(own.x, y, w),
                        };
                        best[j * SIDE..][..w].copy_from_slice(from);
                    }
                    search(&mut best, own, [x + blocks[0], y + blocks[1]], &samples, &near, foot);
                    for (j, row) in out.chunks_exact_mut(rect.columns()).skip(SIDE * y).take(h).enumerate() {
                        row[SIDE * x..][..w].copy_from_slice(&best[j * SIDE..][..w]);
                    }
                }
            }
        },
    );
}

/// The samples that can matter, and their blocks.
struct Near {
    window: Window,
    /// The first sample of the first block; may lie before the window.
    corner: [i32; 2],
    columns: usize,
    rows: usize,
    /// Blocks around the rectangle on each side.
    blocks: [usize; 2],
}

/// Samples whose copies may form the envelope, block by block.
struct Samples {
    /// Value and place.
    list: Vec<(f32, i32, i32)>,
    /// Index of each block's first sample; one more at the end.
    starts: Vec<usize>,
    /// Lowest sample of each block; infinite without samples.
    lowest: Vec<f32>,
    least: f32,
}

impl Samples {
    fn new(input: &View<'_>, near: &Near, bound: Option<&[f32]>, rounding: f32) -> Self {
        let bound = bound.map(|bound| View::new(bound, near.window));
        let (mut list, mut starts, mut lowest) = (Vec::new(), vec![0], Vec::new());
        let span = |first: i32, low: i32, high: i32| first.max(low)..(first + index(SIDE)).min(high);
        for row in 0..near.rows {
            for column in 0..near.columns {
                let (first, mut least) = (list.len(), f32::INFINITY);
                let [x, y] = [near.corner[0] + index(SIDE * column), near.corner[1] + index(SIDE * row)];
                let columns = span(x, near.window.x, near.window.right());
                for y in span(y, near.window.y, near.window.bottom()) {
                    for x in columns.clone() {
                        let v = input.at(x, y);
                        if bound.is_none_or(|bound| v <= bound.at(x, y) + rounding) {
                            list.push((v, x, y));
                            least = min(least, v);
                        }
                    }
                }
                // Low samples first, because they leave the least to the others.
                list[first..].sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
                starts.push(list.len());
                lowest.push(least);
            }
        }
        let least = lowest.iter().fold(f32::INFINITY, |a, b| min(a, *b));
        Self { list, starts, lowest, least }
    }
}

/// Least offset in samples between two blocks that are `blocks` apart.
#[inline(always)]
fn apart(blocks: usize) -> usize {
    (SIDE * blocks).saturating_sub(SIDE - 1)
}

/// Lowers the values of a block at the place `at` among the blocks.
#[inline(always)]
fn search(best: &mut [f32; SIDE * SIDE], own: Window, at: [usize; 2], samples: &Samples, near: &Near, foot: &Foot) {
    let mut top = highest(best);
    for ring in 0..=near.blocks[0].max(near.blocks[1]) {
        let [x, y] = [foot.at(apart(ring), 0), foot.at(0, apart(ring))];
        if samples.least + min(x, y) >= top {
            break;
        }
        let (low, high) = (at[1].saturating_sub(ring), (at[1] + ring).min(near.rows - 1));
        for row in low..=high {
            let dy = row.abs_diff(at[1]);
            if dy > near.blocks[1] {
                continue;
            }
            // Whole rows at the upper and lower end of the ring, else its two sides.
            let step = if dy == ring { 1 } else { 2 * ring };
            let mut column = at[0].wrapping_sub(ring).cast_signed();
            let last = (at[0] + ring).cast_signed();
            while column <= last {
                let here = column.cast_unsigned();
                column += step.max(1).cast_signed();
                if here >= near.columns || here.abs_diff(at[0]) > near.blocks[0] {
                    continue;
                }
                let block = row * near.columns + here;
                let lift = foot.at(apart(here.abs_diff(at[0])), apart(dy));
                if samples.lowest[block] + lift < top {
                    visit(best, own, &samples.list[samples.starts[block]..samples.starts[block + 1]], top, foot);
                }
            }
        }
        top = highest(best);
    }
}

/// Lowers the values of a block by copies at some samples, of which the lowest come first.
#[inline(always)]
fn visit(best: &mut [f32; SIDE * SIDE], own: Window, samples: &[(f32, i32, i32)], top: f32, foot: &Foot) {
    let last = index(SIDE) - 1;
    for &(v, x, y) in samples {
        // The nearest place of the block.
        let dx = x.clamp(own.x, own.x + last).abs_diff(x) as usize;
        let dy = y.clamp(own.y, own.y + last).abs_diff(y) as usize;
        if v + foot.at(dx, dy) >= top {
            continue;
        }
        let first = offset(own.x - x + index(foot.reach[0] + SIDE));
        for (j, best) in best.as_chunks_mut::<SIDE>().0.iter_mut().enumerate() {
            let dy = (own.y + index(j)).abs_diff(y) as usize;
            if dy > foot.reach[1] {
                continue;
            }
            let Some(lift) = foot.row(dy)[first..].first_chunk::<SIDE>() else { continue };
            for (best, lift) in best.iter_mut().zip(lift) {
                let sum = v + *lift;
                *best = if sum < *best { sum } else { *best };
            }
        }
    }
}

#[inline(always)]
fn highest(block: &[f32; SIDE * SIDE]) -> f32 {
    let mut lanes = [f32::NEG_INFINITY; SIDE];
    for row in block.as_chunks::<SIDE>().0 {
        for (lane, v) in lanes.iter_mut().zip(row) {
            *lane = max(*lane, *v);
        }
    }
    lanes.iter().fold(f32::NEG_INFINITY, |a, b| max(a, *b))
}

/// A bound of the envelope in a window: at each pixel the sum for one sample, which the sweeps pass on.
fn sweep(input: &View<'_>, window: Window, foot: &Foot, halo: [usize; 2]) -> Vec<f32> {
    let (w, h) = (window.columns(), window.rows());
    let mut sweep = Sweep { foot, halo, width: w, bound: Vec::with_capacity(w * h), from: Vec::new() };
    for y in window.y..window.bottom() {
        for v in input.row(window.x, y, w) {
            sweep.bound.push(*v);
            sweep.from.push((*v, [0, 0]));
        }
    }
    for y in 0..h {
        for x in 0..w {
            let at = y * w + x;
            if y > 0 {
                sweep.pass(at, x > 0, [-1, -1]);
                sweep.pass(at, true, [0, -1]);
                sweep.pass(at, x + 1 < w, [1, -1]);
            }
            sweep.pass(at, x > 0, [-1, 0]);
        }
        (0..w).rev().for_each(|x| sweep.pass(y * w + x, x + 1 < w, [1, 0]));
    }
    for y in (0..h).rev() {
        for x in (0..w).rev() {
            let at = y * w + x;
            if y + 1 < h {
                sweep.pass(at, x > 0, [-1, 1]);
                sweep.pass(at, true, [0, 1]);
                sweep.pass(at, x + 1 < w, [1, 1]);
            }
            sweep.pass(at, x + 1 < w, [1, 0]);
        }
        (0..w).for_each(|x| sweep.pass(y * w + x, x > 0, [-1, 0]));
    }
    sweep.bound
}

struct Sweep<'a> {
    foot: &'a Foot,
    halo: [usize; 2],
    width: usize,
    bound: Vec<f32>,
    /// The value of the sample that gives the bound, and the offset to it.
    from: Vec<(f32, [i32; 2])>,
}

impl Sweep<'_> {
    /// Takes over the source of the neighbour at an offset, if there is one and its sum is less.
    #[inline(always)]
    fn pass(&mut self, at: usize, exists: bool, [x, y]: [i32; 2]) {
        if !exists {
            return;
        }
        let (v, [dx, dy]) = self.from[at.wrapping_add_signed(y as isize * self.width as isize + x as isize)];
        if v >= self.bound[at] {
            return;
        }
        let (dx, dy) = (dx + x, dy + y);
        let (across, down) = (dx.unsigned_abs() as usize, dy.unsigned_abs() as usize);
        if across > self.halo[0] || down > self.halo[1] {
            return;
        }
        let sum = v + self.foot.at(across, down);
        if sum < self.bound[at] {
            self.bound[at] = sum;
            self.from[at] = (v, [dx, dy]);
        }
    }
}

/// The lower envelope under half of the shape: only samples on one side count. `way` is the direction in which they lie,
/// along a row or a column. `bounds` are the least and the greatest value of `rect` with its halo.
///
/// # Panics
/// If `input` does not cover `rect` grown by the reach of `foot` in that direction, or `out` is smaller than `rect`.
pub fn lower_along(input: &View<'_>, rect: Window, foot: &Foot, way: [i32; 2], bounds: (f32, f32), out: &mut [f32]) {
    let lift = |k: usize| if way[0] == 0 { foot.at(0, k) } else { foot.at(k, 0) };
    let reach = (1..).take_while(|k| lift(*k) <= bounds.1 - bounds.0).count();
    for (out, y) in out[..rect.len()].chunks_exact_mut(rect.columns().max(1)).zip(rect.y..) {
        out.copy_from_slice(input.row(rect.x, y, rect.columns()));
        simd::dispatch(
            #[inline(always)]
            || {
                for k in 1..=reach {
                    let (lift, far) = (lift(k), index(k));
                    let row = input.row(rect.x + way[0] * far, y + way[1] * far, rect.columns());
                    for (out, v) in out.iter_mut().zip(row) {
                        *out = min(*out, *v + lift);
                    }
                }
            },
        );
    }
}
