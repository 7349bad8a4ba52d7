//! Sewing thread: stitches of twisted thread that comes out of the ground and goes in again, the holes, and the depth
//! to which the ground is pulled down.
//!
//! The thread consists of round strands that wind around each other. The height at a point is that of the highest
//! strand; each strand is a circle in the thread's cross-section. Strands finer than pixels are replaced by a smooth
//! round thread. The coverage of a pixel is exact across the thread. O(pixels of stitches near).
use super::index::{Index, Near, each};
use super::seam::{Sewn, Stitch};
use crate::ground::math;
use crate::ground::number::narrow;
use crate::ground::window::Frame;
use glam::DVec2;
use shibo_value::Tiling;
use std::f32::consts::TAU;

/// The thread and its effect on the ground; mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thread {
    /// Half its width.
    pub radius: f32,
    /// Number of strands, 1 to 8.
    pub strands: u32,
    /// Length of one winding of a strand; 0 for straight strands, negative for the other winding direction.
    pub lay: f32,
    /// Half the width of a hole.
    pub hole: f32,
    /// Depth to which it pulls the ground down at the holes.
    pub pull: f32,
    /// Distance from the thread up to which the ground is pulled.
    pub spread: f32,
}

/// Maximum number of strands.
pub const MOST_STRANDS: u32 = 8;

/// Height of the thread's axis over the ground in the middle of a stitch, as a fraction of the radius.
const CROWN: f32 = 0.45;
/// Depth of the axis in the holes, likewise.
const SINK: f32 = 1.5;
/// Fraction of the pull along the whole stitch; the rest is at the holes only.
const ALONG: f32 = 0.6;
/// Size of strands relative to strands that only touch, because they press against each other.
const PRESSED: f32 = 1.12;

/// A seam prepared for drawing.
#[derive(Clone, Debug)]
pub struct Drawn {
    sewn: Sewn,
    thread: Thread,
    stitches: Index,
    holes: Index,
}

/// The part of the thread in a pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bit {
    /// Its height, mm; 0 where there is no thread.
    pub height: f32,
    /// Its coverage of the pixel, 0..1.
    pub mask: f32,
    /// 1 on the crowns of strands, 0 in the creases between them.
    pub crown: f32,
    /// Number of the stitch, from 1; 0 where there is no thread.
    pub id: u32,
}

/// One copy of a stitch.
struct Placed<'a> {
    stitch: &'a Stitch,
    middle: DVec2,
    way: DVec2,
    half: f64,
}

impl Placed<'_> {
    /// The coordinates of a point relative to the stitch, mm: along it from its middle, and across it.
    #[inline(always)]
    fn local(&self, p: DVec2) -> (f32, f32) {
        let to = p - self.middle;
        (narrow(to.dot(self.way)), narrow(self.way.perp_dot(to)))
    }
}

impl Drawn {
    /// Sorts stitches and holes into bins, on a canvas of `size` mm. O(stitches).
    pub fn new(sewn: Sewn, thread: Thread, canvas: (DVec2, Tiling)) -> Self {
        let stitches: Vec<[DVec2; 2]> = sewn.stitches.iter().map(|s| [s.from, s.to]).collect();
        let (stitches, holes) = (Index::new(&stitches, canvas), Index::new(&sewn.holes, canvas));
        Self { sewn, thread, stitches, holes }
    }

    /// Number of stitches.
    pub fn count(&self) -> usize {
        self.sewn.stitches.len()
    }

    /// Approximate memory in bytes.
    pub fn bytes(&self) -> usize {
        self.sewn.stitches.len() * (size_of::<Stitch>() + 24) + self.sewn.holes.len() * 56
    }

    fn placed(&self, near: Near) -> Placed<'_> {
        let stitch = &self.sewn.stitches[near.id as usize];
        let way = stitch.to - stitch.from;
        let middle = 0.5 * (stitch.from + stitch.to) + near.shift;
        Placed { stitch, middle, way: way.normalize_or(DVec2::X), half: 0.5 * way.length() }
    }

    /// Draws the thread into a window, row by row, and overwrites `out`. Where stitches overlap, the highest is
    /// visible.
    ///
    /// # Panics
    /// If `out` is shorter than the window.
    pub fn fill(&self, stop: &dyn Fn() -> bool, frame: &Frame, out: &mut [Bit]) {
        out.fill(Bit::default());
        let pixel = narrow((frame.step[0] * frame.step[1]).sqrt());
        let around = f64::from(self.thread.radius + pixel);
        for near in self.stitches.near_window(frame, around) {
            if stop() {
                return;
            }
            let placed = self.placed(near);
            let reach = DVec2::splat(around) + placed.way.abs() * placed.half;
            each(frame, placed.middle - reach, placed.middle + reach, &mut |k, p| {
                let (u, v) = placed.local(p);
                let half = narrow(placed.half);
                let mut bit = self.thread.bit((u, v), half, pixel, placed.stitch);
                let old = &mut out[k];
                if bit.mask > 0.0 && (old.id == 0 || bit.height > old.height) {
                    bit.id = near.id + 1;
                    bit.mask = bit.mask.max(old.mask);
                    *old = bit;
                } else {
                    old.mask = old.mask.max(bit.mask);
                }
            });
        }
    }

    /// Fills a window with the holes: 1 in them, 0 on the ground.
    ///
    /// # Panics
    /// If `out` is shorter than the window.
    pub fn holes(&self, stop: &dyn Fn() -> bool, frame: &Frame, out: &mut [f32]) {
        out.fill(0.0);
        let pixel = narrow((frame.step[0] * frame.step[1]).sqrt());
        let radius = self.thread.hole;
        if radius <= 0.0 {
            return;
        }
        let around = f64::from(radius + pixel);
        for near in self.holes.near_window(frame, around) {
            if stop() {
                return;
            }
            let [a, b] = self.sewn.holes[near.id as usize].map(|end| end + near.shift);
            each(frame, a.min(b) - around, a.max(b) + around, &mut |k, p| {
                let d = narrow(to_line(p, a, b));
                // Holes smaller than a pixel fade.
                let most = (2.0 * radius / pixel).min(1.0);
                out[k] = out[k].max(math::saturate((radius - d) / pixel + 0.5) * most);
            });
        }
    }

    /// Fills a window with the depth to which the ground is pulled down, mm.
    ///
    /// # Panics
    /// If `out` is shorter than the window.
    pub fn pull(&self, stop: &dyn Fn() -> bool, frame: &Frame, out: &mut [f32]) {
        out.fill(0.0);
        let Thread { radius, pull, spread, .. } = self.thread;
        if pull <= 0.0 || spread <= 0.0 {
            return;
        }
        let draw = |[a, b]: [DVec2; 2], spread: f32, out: &mut [f32]| {
            let around = f64::from(spread);
            let scale = 1.0 / (hypot(spread, radius) - radius);
            each(frame, a.min(b) - around, a.max(b) + around, &mut |k, p| {
                // The hypotenuse rounds the ground under the thread.
                let x = (hypot(narrow(to_line(p, a, b)), radius) - radius) * scale;
                join(&mut out[k], falloff(x));
            });
        };
        let mut at_holes = vec![0.0; out.len()];
        for near in self.stitches.near_window(frame, f64::from(spread)) {
            if stop() {
                return;
            }
            let stitch = &self.sewn.stitches[near.id as usize];
            draw([stitch.from + near.shift, stitch.to + near.shift], spread, out);
        }
        for near in self.holes.near_window(frame, f64::from(spread)) {
            if stop() {
                return;
            }
            let ends = self.sewn.holes[near.id as usize].map(|end| end + near.shift);
            draw(ends, spread, out);
            draw(ends, 0.6 * spread, &mut at_holes);
        }
        for (out, hole) in out.iter_mut().zip(at_holes) {
            *out = pull * (ALONG * out.sqrt().sqrt() + (1.0 - ALONG) * hole.sqrt().sqrt());
        }
    }
}

/// A smooth union of pulls at a point: a dominant pull keeps its value, and equal pulls meet without a crease. `joined`
/// is the fourth power of the union so far, 0..1.
#[inline(always)]
fn join(joined: &mut f32, pulls: f32) {
    let square = pulls * pulls;
    *joined += square * square * (1.0 - *joined);
}

#[inline(always)]
fn hypot(a: f32, b: f32) -> f32 {
    (a * a + b * b).sqrt()
}

/// 1 on the thread, 0 at the end of the spread; steepest near the thread, like a stretched skin.
#[inline(always)]
fn falloff(x: f32) -> f32 {
    let rest = math::saturate(1.0 - x);
    rest * rest
}

/// Distance of a point from the line segment between two points.
#[inline(always)]
fn to_line(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let (way, to) = (b - a, p - a);
    let t = (to.dot(way) / way.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    (to - way * t).length()
}

impl Thread {
    /// The thread at a point of a stitch that is `half` mm long on each side of its middle.
    fn bit(&self, (u, v): (f32, f32), half: f32, pixel: f32, stitch: &Stitch) -> Bit {
        let radius = self.radius;
        // Ends are half circles; a stitch shorter than its width is a circle.
        let cap = ((u.abs() - (half - radius).max(0.0)) / radius).max(0.0);
        let round = (1.0 - cap * cap).max(0.0).sqrt();
        let share = (u.abs() / half.max(1e-9)).min(1.0);
        let bend = share * share * share;
        let lift = radius * (CROWN + 0.12 * narrow(stitch.lift));
        let axis = lift - bend * (lift + SINK * radius) - self.pull * (ALONG + (1.0 - ALONG) * bend);
        let (low, high, strand) = self.section(u, v / round.max(1e-6), pixel, narrow(stitch.phase));
        let covered = ((v + 0.5 * pixel).min(high * round) - (v - 0.5 * pixel).max(low * round)) / pixel;
        let inside = math::saturate((half - u.abs()) / pixel + 0.5);
        let mask = math::saturate(covered) * if half < radius { inside } else { 1.0 };
        if mask <= 0.0 || round <= 0.0 {
            return Bit::default();
        }
        // Near the ground, strands are drawn together.
        let (tight, plain) = (bend * bend, (radius * radius - v * v / (round * round).max(1e-12)).max(0.0).sqrt());
        let top = strand.0 + (plain - strand.0) * tight;
        Bit { height: axis + round * top, mask, crown: strand.1, id: 0 }
    }

    /// The thread's edges in its cross-section, and at one point its height over the axis and its nearness to the crown
    /// of a strand.
    fn section(&self, u: f32, v: f32, pixel: f32, phase: f32) -> (f32, f32, (f32, f32)) {
        let radius = self.radius;
        let plain = |v: f32| (radius * radius - v * v).max(0.0).sqrt();
        // The apparent width of one strand along the thread.
        let seen = if self.lay == 0.0 { f32::INFINITY } else { self.lay.abs() / self.strands as f32 };
        let fine = math::saturate((seen.min(radius) / pixel - 1.2) / 1.5);
        if self.strands < 2 || fine <= 0.0 {
            return (-radius, radius, (plain(v), 1.0));
        }
        let sine = math::sin_degrees(180.0 / self.strands as f32);
        let strand = (radius * sine / (1.0 + sine) * PRESSED).min(radius);
        let off = radius - strand;
        let turns = if self.lay == 0.0 { 0.0 } else { u / self.lay };
        let (mut low, mut high, mut best) = (radius, -radius, (f32::NEG_INFINITY, 0.0));
        for n in 0..self.strands {
            let turn = turns + phase + n as f32 / self.strands as f32;
            let (sin, cos) = math::sin_cos((turn - turn.floor()) * TAU);
            let across = v - off * cos;
            (low, high) = (low.min(off * cos - strand), high.max(off * cos + strand));
            let inside = (1.0 - (across / strand) * (across / strand)).max(0.0).sqrt();
            let height = off * sin + strand * inside;
            if height > best.0 && (inside > 0.0 || best.0 == f32::NEG_INFINITY) {
                best = (height, inside);
            }
        }
        let mix = |a: f32, b: f32| a + (b - a) * fine;
        (mix(-radius, low), mix(radius, high), (mix(plain(v), best.0.max(-radius)), mix(1.0, best.1)))
    }
}
