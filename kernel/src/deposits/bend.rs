//! Deformations: the point of an undeformed solid that work on it, such as twisting or forging, moved to a place.
//!
//! Work is undone from its end, each step by a formula, so a deformed solid is exact at every point.
use super::{frame_of, sin_cos_degrees};
use crate::ground::hash::Hash;
use glam::{DVec2, DVec3};

/// A step of work on a solid, at a point and in a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// A point of the step.
    pub at: DVec3,
    /// Its unit direction.
    pub way: DVec3,
    /// The work itself.
    pub work: Work,
    /// Random numbers of the step.
    pub hash: Hash,
}

/// Work on a solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Work {
    /// Turns about the axis by this many degrees per mm along it.
    Twist(f64),
    /// Bars beside each other, each twisted about its own axis: degrees per mm, width of a bar in mm, and the direction
    /// in which they follow each other. Every second bar turns the other way.
    Bars(f64, f64, DVec3),
    /// Dimples are drilled into a face and ground or forged flat, so that deeper material comes to the face.
    Drill(Dimples),
    /// Grooves, perpendicular to the direction of `groove`, are cut into a face and forged flat.
    Groove(Dimples, DVec3),
    /// Squeezed by this factor along the direction; the sides give way.
    Press(f64),
    /// Folded onto itself: thickness of the stack in mm, number of layers of it.
    Fold(f64, f64),
    /// Pushed by a vector (in mm), less with the distance from the point, up to a radius.
    Push(DVec3, f64),
}

/// Dimples or grooves in a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dimples {
    /// mm from one to the next.
    pub pitch: f64,
    /// Radius, or half the width of a groove, in mm.
    pub radius: f64,
    /// mm.
    pub depth: f64,
    /// Depth below the face, in mm, at which the material is no longer displaced.
    pub reach: f64,
    /// Deviation from a regular layout, 0..1.
    pub jitter: f64,
}

impl Dimples {
    /// Depth at a distance from the middle: a round bottom and a soft rim.
    fn at(&self, distance: f64, vary: f64) -> f64 {
        let share = distance / self.radius;
        let t = 1.0 - share * share;
        if t <= 0.0 { 0.0 } else { self.depth * vary * t * t * (3.0 - 2.0 * t) }
    }

    /// Depth at a place of a face, in a hexagonal layout.
    fn dimples(&self, place: DVec2, hash: Hash) -> f64 {
        let step = DVec2::new(self.pitch, self.pitch * 0.866_025_403_784_438_6);
        let row = (place.y / step.y).round();
        let mut deepest: f64 = 0.0;
        for j in -1..=1 {
            let y = row + f64::from(j);
            let shift = if y.rem_euclid(2.0) == 1.0 { 0.5 } else { 0.0 };
            let column = (place.x / step.x - shift).round();
            for i in -1..=1 {
                let x = column + f64::from(i);
                let cell = hash.with(bits(x)).with(bits(y));
                let off = DVec2::new(cell.unit(0), cell.unit(1)) - 0.5;
                let middle = DVec2::new((x + shift) * step.x, y * step.y) + off * (0.6 * self.jitter * self.pitch);
                let vary = 1.0 - 0.5 * self.jitter * cell.unit(2);
                deepest = deepest.max(self.at(middle.distance(place), vary));
            }
        }
        deepest
    }

    fn grooves(&self, along: f64, hash: Hash) -> f64 {
        let number = (along / self.pitch).round();
        let depth = |n: f64| {
            let cell = hash.with(bits(n));
            let middle = (n + 0.6 * self.jitter * (cell.unit(0) - 0.5)) * self.pitch;
            self.at((along - middle).abs(), 1.0 - 0.5 * self.jitter * cell.unit(1))
        };
        depth(number - 1.0).max(depth(number)).max(depth(number + 1.0))
    }

    /// The material that came to a depth below the face: `pit` deeper at the face itself, less and less below it.
    fn risen(&self, depth: f64, pit: f64) -> f64 {
        let reach = self.reach.max(1.01 * pit);
        let below = (depth / reach).clamp(0.0, 1.0);
        // The slope of this is less than 1, so material keeps its order.
        pit * (1.0 - below)
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "bits of a whole number")]
const fn bits(n: f64) -> u64 {
    n as i64 as u64
}

impl Step {
    /// Undoes the step for a point.
    pub fn undo(&self, p: DVec3) -> DVec3 {
        let to = p - self.at;
        let along = to.dot(self.way);
        match self.work {
            Work::Twist(rate) => {
                let (s, c) = sin_cos_degrees(-rate * along);
                let aside = to - self.way * along;
                self.at + self.way * along + aside * c + self.way.cross(aside) * s
            }
            Work::Bars(rate, width, across) => {
                let number = (to.dot(across) / width).round();
                let middle = self.at + across * (number * width);
                let turns = if number.rem_euclid(2.0) == 1.0 { -rate } else { rate };
                // Each bar shows another part of the stack.
                let along = along + 1000.0 * self.hash.unit(bits(number));
                let twist = Self { at: middle, work: Work::Twist(turns), ..*self };
                twist.undo(middle + (to - across * (number * width)) + self.way * (along - to.dot(self.way)))
            }
            Work::Drill(dimples) => {
                let [x, y] = frame_of(self.way);
                let pit = dimples.dimples(DVec2::new(to.dot(x), to.dot(y)), self.hash);
                p - self.way * dimples.risen(-along, pit)
            }
            Work::Groove(dimples, across) => {
                p - self.way * dimples.risen(-along, dimples.grooves(to.dot(across), self.hash))
            }
            Work::Press(factor) => {
                let aside = to - self.way * along;
                self.at + self.way * (along / factor) + aside * factor.sqrt()
            }
            Work::Fold(thickness, layers) => {
                let sheet = along * layers / thickness;
                let turn = sheet - 2.0 * (0.5 * sheet).floor();
                let inside = if turn > 1.0 { 2.0 - turn } else { turn };
                p + self.way * (inside * thickness - along)
            }
            Work::Push(by, radius) => {
                let t = 1.0 - to.length_squared() / (radius * radius);
                if t <= 0.0 { p } else { p - by * (t * t) }
            }
        }
    }
}

/// Undoes steps, the last one first.
pub fn undo(steps: &[Step], point: DVec3) -> DVec3 {
    steps.iter().rev().fold(point, |p, step| step.undo(p))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(work: Work) -> Step {
        Step { at: DVec3::new(1.0, -2.0, 3.0), way: DVec3::Z, work, hash: Hash::new(3) }
    }

    const DIMPLES: Dimples = Dimples { pitch: 6.0, radius: 2.5, depth: 1.5, reach: 4.0, jitter: 0.5 };

    fn random(n: u64) -> DVec3 {
        let unit = |k| 40.0 * (Hash::new(8).unit(3 * n + k) - 0.5);
        DVec3::new(unit(0), unit(1), unit(2))
    }

    /// The volume that a small cube had before, relative to that after.
    fn volume(steps: &[Step], p: DVec3) -> f64 {
        let h = 1e-5;
        let slope = |axis: DVec3| (undo(steps, p + axis * h) - undo(steps, p - axis * h)) / (2.0 * h);
        slope(DVec3::X).cross(slope(DVec3::Y)).dot(slope(DVec3::Z))
    }

    #[test]
    fn twists_and_presses_keep_the_volume() {
        for work in [Work::Twist(12.0), Work::Press(0.4), Work::Press(2.5)] {
            for n in 0..100 {
                assert!((volume(&[step(work)], random(n)) - 1.0).abs() < 1e-6, "{work:?}");
            }
        }
    }

    #[test]
    fn a_twist_keeps_the_distance_from_the_axis_and_turns_evenly() {
        let twist = step(Work::Twist(9.0));
        let p = DVec3::new(4.0, -2.0, 13.0);
        let before = twist.undo(p);
        assert!((before - DVec3::new(1.0, -5.0, 13.0)).length() < 1e-9, "{before}");
    }

    #[test]
    fn bars_turn_about_their_own_axes() {
        let bars = step(Work::Bars(9.0, 10.0, DVec3::X));
        for n in 0..100 {
            let p = random(n);
            let middle = 1.0 + ((p.x - 1.0) / 10.0).round() * 10.0;
            let away = |p: DVec3| (p - DVec3::new(middle, -2.0, 0.0)).truncate().length();
            assert!((away(bars.undo(p)) - away(p)).abs() < 1e-9, "{p}");
            assert!((volume(&[bars], p) - 1.0).abs() < 1e-4);
        }
    }

    #[test]
    fn drilled_material_keeps_its_order() {
        for work in [Work::Drill(DIMPLES), Work::Groove(DIMPLES, DVec3::X)] {
            let drill = step(work);
            for n in 0..400 {
                let p = random(n);
                assert!(volume(&[drill], p) > 0.0, "{work:?} {p}");
                // Nothing moves deep below the face; on it, material comes from at most `depth` below.
                let deep = DVec3::new(p.x, p.y, -1.5);
                assert_eq!(drill.undo(deep), deep);
                let face = DVec3::new(p.x, p.y, 3.0);
                let depth = face.z - drill.undo(face).z;
                assert!((0.0..=1.5 + 1e-12).contains(&depth), "{depth}");
            }
        }
    }

    #[test]
    fn dimples_cover_their_share_of_the_face() {
        let drill = step(Work::Drill(Dimples { jitter: 0.0, ..DIMPLES }));
        let inside = (0..40_000).filter(|n| {
            let row = 60.0 * 0.75f64.sqrt();
            let p = DVec3::new(f64::from(n % 200) * 0.3, f64::from(n / 200) * row / 200.0, 3.0);
            drill.undo(p).z < 3.0
        });
        let share = inside.count() as f64 / 40_000.0;
        let want = std::f64::consts::PI * 2.5 * 2.5 / (6.0 * 6.0 * 0.75f64.sqrt());
        assert!((share - want).abs() < 0.01, "{share} instead of {want}");
    }

    #[test]
    fn folds_show_each_part_of_the_stack_in_each_layer() {
        let fold = step(Work::Fold(8.0, 4.0));
        for n in 0..100 {
            let p = random(n);
            let to = fold.undo(p).z - 3.0;
            assert!((0.0..=8.0).contains(&to), "{to}");
            // Mirrored about each fold, 2 mm apart.
            let mirrored = DVec3::new(p.x, p.y, 2.0 * 5.0 - p.z);
            assert!((fold.undo(mirrored).z - fold.undo(p).z).abs() < 1e-9);
        }
    }

    #[test]
    fn pushes_end_at_their_radius_and_steps_are_undone_in_order() {
        let push = step(Work::Push(DVec3::new(2.0, 0.0, 0.0), 5.0));
        assert_eq!(push.undo(push.at), push.at - DVec3::X * 2.0);
        assert_eq!(push.undo(push.at + DVec3::Y * 5.0), push.at + DVec3::Y * 5.0);
        let twist = step(Work::Twist(30.0));
        let p = DVec3::new(3.0, 1.0, 4.0);
        assert_eq!(undo(&[push, twist], p), push.undo(twist.undo(p)));
    }
}
