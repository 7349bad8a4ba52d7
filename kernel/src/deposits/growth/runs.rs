//! Run-off: water that has touched a colony runs down, wanders a little, and leaves a stain that fades.
use super::{Law, Plan};
use crate::ground::hash::Hash;
use crate::ground::number::narrow;
use crate::ground::stop::Until;
use glam::{DVec2, I64Vec2};

/// Side, in grains, of the square of growth that has one start.
const RARE: f64 = 2.0;

/// Grains after which a stain is as strong as it gets.
const STRONG: f64 = 2.5;

/// Length, in grains, over which the way changes.
const BEND: f64 = 9.0;

/// The largest slope of the way.
const SLOPE: f64 = 0.35;

/// Share of a distance from the margin that is certain.
const SURE: f64 = 0.85;

/// The strength of stains by cell, 0..1, from the times and the distances from the margin. Stains deep within the
/// growth are left out. Outside of the growth, a later moment has stains at least as strong. `None` if stopped.
pub fn runs(
    plan: &Plan,
    law: &Law,
    (times, edges): (&[f32], &[f32]),
    hash: Hash,
    until: Until<'_>,
) -> Option<Vec<f32>> {
    let mut all = vec![0.0; plan.len()];
    if law.drip <= 0.0 {
        return Some(all);
    }
    let chance = plan.cell.element_product() / (RARE * RARE * law.grain * law.grain);
    let hashes = [hash.with(0), hash.with(1)];
    for cell in 0..plan.len() {
        if cell % 1024 == 0 && until() {
            return None;
        }
        let age = law.amount - f64::from(times[cell]);
        let draw = |n: u64| hashes[0].with(cell as u64).unit(n);
        if age <= 0.0 || draw(0) >= chance {
            continue;
        }
        // Few runs are long.
        let length = law.drip * (0.06 + 0.94 * draw(1) * draw(2));
        let strength = (0.35 + 0.65 * draw(3)) * (age / (STRONG * law.grain)).min(1.0);
        let radius = law.grain * (0.4 + 1.1 * draw(4) * draw(4));
        let hidden = SURE * f64::from(edges[cell]) - radius - 2.0 * plan.cell.max_element();
        if hidden < length {
            let run = Run { plan, law, hidden, length, strength, radius };
            run.draw(plan.centre(cell), hashes[1], &mut all);
        }
    }
    Some(all)
}

/// One run.
struct Run<'a> {
    plan: &'a Plan,
    law: &'a Law,
    /// The length, in mm, within which it does not leave the growth.
    hidden: f64,
    length: f64,
    strength: f64,
    radius: f64,
}

impl Run<'_> {
    fn draw(&self, from: DVec2, hash: Hash, all: &mut [f32]) {
        let step = 0.7 * self.plan.cell.min_element();
        let (mut place, mut gone) = (from, 0.0);
        while gone < self.length {
            let rest = 1.0 - gone / self.length;
            if gone >= self.hidden {
                let strength = self.strength * rest.sqrt() * (0.4 + 0.6 * rest);
                self.stamp(place, (0.35 + 0.65 * rest) * self.radius, strength, all);
            }
            let way = self.law.down + self.law.down.perp() * (SLOPE * self.slope(place, hash));
            place += way * step;
            gone += step;
        }
    }

    /// The slope of the way at a place, -1..1: the same for all runs, so that they join. It repeats with the canvas.
    fn slope(&self, place: DVec2, hash: Hash) -> f64 {
        let size = self.plan.counts.as_dvec2() * self.plan.cell;
        let counts = (size / (BEND * self.law.grain)).round().max(DVec2::ONE);
        let at = place / size * counts;
        let base = at.floor();
        let share = at - base;
        let t = share * share * (3.0 - 2.0 * share);
        let draw = |by: DVec2| {
            let square = base + by - ((base + by) / counts).floor() * counts;
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a whole number from 0 on")]
            let n = (square.y * counts.x + square.x) as u64;
            2.0 * hash.unit(n) - 1.0
        };
        let row = |y: f64| draw(DVec2::new(0.0, y)) * (1.0 - t.x) + draw(DVec2::new(1.0, y)) * t.x;
        row(0.0) * (1.0 - t.y) + row(1.0) * t.y
    }

    fn stamp(&self, place: DVec2, radius: f64, strength: f64, all: &mut [f32]) {
        let radius = radius.max(0.71 * self.plan.cell.max_element());
        let low = ((place - radius) / self.plan.cell).floor().as_i64vec2();
        let high = ((place + radius) / self.plan.cell).floor().as_i64vec2();
        for (x, y) in (low.y..=high.y).flat_map(|y| (low.x..=high.x).map(move |x| (x, y))) {
            let away = (DVec2::new(x as f64, y as f64) + 0.5) * self.plan.cell - place;
            let rest = 1.0 - away.length_squared() / (radius * radius);
            if let Some(cell) = self.plan.index(I64Vec2::new(x, y)).filter(|_| rest > 0.0) {
                all[cell] = all[cell].max(narrow(strength * rest));
            }
        }
    }
}
