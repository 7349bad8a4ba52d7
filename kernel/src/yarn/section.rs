//! The make of a yarn, and its cross-section: plies that wind around each other, and fibres on them.
//!
//! Plies follow r (cos, sin)(2π s / λ + φ). Fibres lie on each ply at an angle, and wander a little across it, as in
//! Zhao, Luan and Bala (2016). They are a pattern on the surface, not single curves: streaks of a length and a width.
use super::noise::torus;
use crate::ground::hash::Hash;
use crate::ground::math;
use crate::ground::number::narrow;
use std::f64::consts::TAU;

/// The make of a yarn; mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Yarn {
    /// Half its width.
    pub width: f64,
    /// Half its thickness.
    pub thickness: f64,
    /// Form of its section without plies: 0 an ellipse, 1 a strip with round edges.
    pub flat: f64,
    /// Number of plies; 1 for none.
    pub plies: u32,
    /// Length of one turn of the twist; negative for the other hand, 0 for none.
    pub twist: f64,
    /// Width of the visible bundles of fibres; 0 for none.
    pub fiber: f64,
    /// Height of the fibres.
    pub relief: f64,
    /// Variation of the thickness along the thread, 0..1.
    pub slub: f64,
    /// Distance of thick places.
    pub slub_length: f64,
}

/// Maximum number of plies.
pub const MOST_PLIES: u32 = 12;
/// Fibres are this many times as long as wide.
const ASPECT: f64 = 26.0;
/// Number of fibres across the surface after which they repeat.
const AROUND: u32 = 16;
/// Size of plies relative to plies that only touch.
const PRESSED: f32 = 1.1;

/// A yarn on a thread of a certain length: twist and fibres close on it.
#[derive(Clone, Copy, Debug)]
pub struct Spun {
    /// The yarn.
    pub yarn: Yarn,
    hash: Hash,
    phase: f32,
    /// Turns per mm, with the sign of the twist.
    turns: f64,
    /// Tangent of the angle between fibres and their ply.
    lean: f64,
    /// Relative radius of a ply.
    radius: f32,
    /// Sine and cosine of the angle from one ply to the next.
    step: (f32, f32),
    /// Cells of the noise along the thread, per mm and in all.
    cells: (f64, u32),
}

/// The surface at a point of the section.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Skin {
    /// Height over the axis, mm.
    pub top: f32,
    /// 1 on the crowns of plies, 0 in the creases between them.
    pub crown: f32,
    /// Place across its ply, -1..1, and the ply's number.
    ply: (f32, u32),
    /// Tangent of the angle between ply and thread, here.
    slant: f32,
}

impl Spun {
    /// The yarn on a thread of `length` mm.
    pub fn new(yarn: Yarn, length: f64, hash: Hash) -> Self {
        let turns = if yarn.twist == 0.0 { 0.0 } else { (length / yarn.twist).clamp(-1e6, 1e6).round() / length };
        let yarn = Yarn { fiber: if yarn.fiber < 1e-6 { 0.0 } else { yarn.fiber }, ..yarn };
        // Without plies fibres follow the twist; in plies they wind the other way, half as steep.
        let share = if yarn.plies > 1 { 0.25 } else { -0.7 };
        let wanted = (share * TAU * yarn.width * turns).clamp(-2.0, 2.0);
        let around = f64::from(AROUND);
        let shift = if yarn.fiber > 0.0 { length * wanted / yarn.fiber / around } else { 0.0 };
        let lean = shift.round() * around * yarn.fiber / length;
        let count = super::noise::cells(length, (yarn.fiber * ASPECT).max(1e-6));
        let phase = narrow(hash.unit(0));
        let plies = yarn.plies.clamp(1, MOST_PLIES) as f32;
        let sine = math::sin_degrees(180.0 / plies);
        let radius = (sine / (1.0 + sine) * PRESSED).min(1.0);
        let step = math::sin_cos(std::f32::consts::TAU / plies);
        Self { yarn, hash: hash.with(1), phase, turns, lean, radius, step, cells: (f64::from(count) / length, count) }
    }

    /// The exact length of a turn, mm; infinite without twist.
    pub fn turn(&self) -> f64 {
        1.0 / self.turns.abs()
    }

    /// Share of the plies that is drawn: they fade into a smooth yarn where they are finer than pixels.
    fn fine(&self, pixel: f32) -> f32 {
        let along = narrow(self.turn() / f64::from(self.yarn.plies));
        let across = narrow(2.0 * self.yarn.width / f64::from(self.yarn.plies.min(3)));
        math::saturate((along.min(across) / pixel - 1.2) / 1.6)
    }

    /// The surface `x` half widths from the axis, -1..1, at `s` mm along the thread.
    #[inline]
    pub fn skin(&self, s: f64, x: f32, pixel: f32) -> Skin {
        let x = math::clamp(x, -1.0, 1.0);
        let thick = narrow(self.yarn.thickness);
        let plain = self.outline(x);
        let smooth = Skin { top: thick * plain, crown: plain, ply: (x, 0), slant: 0.0 };
        let plies = self.yarn.plies.min(MOST_PLIES);
        if plies < 2 {
            return smooth;
        }
        let fine = self.fine(pixel);
        if fine <= 0.0 {
            return smooth;
        }
        let radius = self.radius;
        let off = 1.0 - radius;
        let turns = s * self.turns + f64::from(self.phase);
        let turns = narrow(turns - turns.floor());
        let mut best = Skin { top: f32::NEG_INFINITY, ..smooth };
        // Each ply is the one before, turned.
        let (mut sin, mut cos) = math::sin_cos(turns * std::f32::consts::TAU);
        let (turn_sin, turn_cos) = self.step;
        for n in 0..plies {
            if n > 0 {
                (sin, cos) = (sin * turn_cos + cos * turn_sin, cos * turn_cos - sin * turn_sin);
            }
            let across = (x - off * cos) / radius;
            let round = 1.0 - across * across;
            if round > 0.0 {
                let round = round.sqrt();
                let top = off * sin + radius * round;
                if top > best.top {
                    let slant = -off * sin * narrow(TAU * self.turns * self.yarn.width);
                    best = Skin { top, crown: round, ply: (across, n), slant };
                }
            }
        }
        if best.top == f32::NEG_INFINITY {
            // Beside the plies, under their common outline.
            best = Skin { top: 0.0, crown: 0.0, ..smooth };
        }
        let crown = math::lerp(plain, best.crown, fine);
        Skin { top: thick * math::lerp(plain, best.top, fine), crown, slant: best.slant * fine, ..best }
    }

    /// The outline of the section without plies, 0..1.
    #[inline(always)]
    fn outline(&self, x: f32) -> f32 {
        if self.yarn.flat <= 0.0 || self.yarn.plies > 1 {
            return (1.0 - x * x).max(0.0).sqrt();
        }
        let power = 2.0 + 8.0 * narrow(self.yarn.flat);
        math::pow((1.0 - math::pow(x.abs(), power)).max(0.0), 1.0 / power.min(3.0))
    }

    /// Fibres on a surface: -1 between them, 1 on them, 0 where they are finer than pixels. `s` is the place along the
    /// thread in mm.
    #[inline]
    pub fn fiber(&self, s: f64, skin: &Skin, pixel: f32) -> f32 {
        let width = self.yarn.fiber;
        if width <= 0.0 {
            return 0.0;
        }
        let [coarse, fine] = [1.0, 0.5].map(|f| math::saturate((narrow(width * f) / pixel - 0.5) / 0.8));
        if coarse <= 0.0 {
            return 0.0;
        }
        let (across, ply) = skin.ply;
        let radius = if self.yarn.plies > 1 { 0.5 * self.yarn.width } else { self.yarn.width };
        // The length of the arc from the crown.
        let arc = math::atan2(across, (1.0 - across * across).max(0.0).sqrt());
        let hash = self.hash.with(u64::from(ply));
        let (per_mm, count) = self.cells;
        let (along, around) = (s * per_mm, (f64::from(arc) * radius - s * self.lean) / width);
        // Fibres migrate: slow waves across the ply.
        let waves = torus(hash.with(1), [along, 0.5 * f64::from(arc)], [count, 4]);
        let around = around + 1.3 * waves;
        let at = |factor: u32, n: u64| {
            let f = f64::from(factor);
            let along = along * f + 7.3 * f64::from(hash.unit_f32(n));
            narrow(torus(hash.with(n), [around * f, along], [AROUND * factor, count.saturating_mul(factor)]))
        };
        coarse * (0.75 * at(1, 2) + 0.55 * fine * at(2, 3))
    }

    /// Tangent of the angle between fibres and thread on a surface.
    #[inline]
    pub fn slant(&self, skin: &Skin) -> f32 {
        skin.slant + narrow(self.lean)
    }

    /// Relative width at each place of a thread of `length` mm: 1 without slubs.
    pub fn fat(&self, s: f64, length: f64) -> f64 {
        if self.yarn.slub <= 0.0 {
            return 1.0;
        }
        let count = super::noise::cells(length, self.yarn.slub_length.max(1e-6));
        let hash = self.hash.with(77);
        let ring = |n: u64, factor: u32| {
            let count = count.saturating_mul(factor);
            super::noise::ring(hash.with(n), s / length * f64::from(count), count)
        };
        let thick = (ring(3, 1) - 0.35).max(0.0);
        1.0 + self.yarn.slub * (0.22 * ring(1, 1) + 0.13 * ring(2, 3) + 0.45 * thick)
    }

    /// Largest relative width.
    pub fn fattest(&self) -> f64 {
        1.0 + 0.65 * self.yarn.slub.max(0.0)
    }
}
