//! Layers: the time at which sediment, or the next sheet of a stack, reached a point.
//!
//! The history is undone from its end: faults shift a point back, folds lower it along the normal of the layers, and
//! the height above the first layer gives the time. Folds are similar folds: the displacement depends only on the
//! position along the layers, so every layer has the shape of the first one. Dunes replace the layers by sets of
//! inclined laminae: saw-tooth dunes travel over each other, and each removes the top of the one before (D. Rubin,
//! *Cross-bedding, bedforms, and paleocurrents*, 1987).
use super::{frame_of, heading, sin_cos_degrees};
use crate::ground::hash::Hash;
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// A row of similar folds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fold {
    /// mm from trough to crest.
    pub height: f64,
    /// mm from crest to crest.
    pub wavelength: f64,
    /// The direction in the layers in which crests follow each other, in degrees.
    pub direction: f64,
    /// The place of the first crest, as a share of the wavelength.
    pub phase: f64,
    /// Deviation from a sine, 0..1.
    pub irregular: f64,
}

/// A plane along which the rock above it slid down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fault {
    /// A point of the plane.
    pub at: DVec3,
    /// Direction of the plane's horizontal line, in degrees from x to y.
    pub strike: f64,
    /// Steepness of the plane in degrees; it descends to the right of the strike.
    pub dip: f64,
    /// mm by which the side above the plane slid down; negative if it was pushed up.
    pub throw: f64,
}

/// Dunes that travelled over each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dunes {
    /// Thickness of a set of laminae in mm.
    pub height: f64,
    /// mm from dune to dune.
    pub length: f64,
    /// Steepness of the lee sides in degrees.
    pub angle: f64,
    /// The direction in which dunes travelled, in degrees.
    pub direction: f64,
    /// Variation from set to set, 0..1.
    pub irregular: f64,
}

/// Layers and their history.
#[derive(Clone, Debug)]
pub struct Layers {
    origin: DVec3,
    normal: DVec3,
    /// The directions in the layers at 0° and at 90°.
    axes: [DVec3; 2],
    folds: Vec<Bent>,
    slips: Vec<Slip>,
}

#[derive(Clone, Debug)]
struct Bent {
    half: f64,
    frequency: f64,
    way: DVec2,
    phase: f64,
    irregular: f64,
    waves: [Waver; 2],
}

#[derive(Clone, Copy, Debug)]
struct Slip {
    at: DVec3,
    /// Normal of the plane, on its upper side.
    up: DVec3,
    /// The way back.
    back: DVec3,
}

/// A smooth function of two coordinates without a visible period, of unit size.
#[derive(Clone, Copy, Debug)]
struct Waver([[f64; 3]; 3]);

impl Waver {
    fn new(hash: Hash) -> Self {
        const FREQUENCIES: [[f64; 2]; 3] = [[0.31, 0.13], [0.19, -0.29], [0.53, 0.37]];
        Self(std::array::from_fn(|k| {
            let [a, b] = FREQUENCIES[k];
            // A different frequency for each seed: even two waves of one graph never keep step.
            let vary = |n: u64| 0.85 + 0.3 * hash.unit(3 * k as u64 + n);
            [TAU * a * vary(0), TAU * b * vary(1), TAU * hash.unit(3 * k as u64 + 2)]
        }))
    }

    fn at(&self, u: f64, v: f64) -> f64 {
        let [a, b, c] = self.0.map(|[a, b, c]| libm::sin(a * u + b * v + c));
        0.5 * (a + b) + 0.35 * c
    }
}

impl Bent {
    fn new(fold: &Fold, hash: Hash) -> Self {
        Self {
            half: 0.5 * fold.height,
            frequency: 1.0 / fold.wavelength,
            way: heading(fold.direction),
            phase: fold.phase,
            irregular: fold.irregular,
            waves: [Waver::new(hash.with(1)), Waver::new(hash.with(2))],
        }
    }

    fn at(&self, place: DVec2) -> f64 {
        let (u, v) = (place.dot(self.way) * self.frequency, self.way.perp_dot(place) * self.frequency);
        if self.irregular == 0.0 {
            return self.half * libm::cos(TAU * (u - self.phase));
        }
        let turn = 0.4 * self.irregular * self.waves[0].at(u, v);
        let size = 1.0 + 0.6 * self.irregular * self.waves[1].at(u, v);
        self.half * size * libm::cos(TAU * (u - self.phase + turn))
    }
}

impl Slip {
    fn new(fault: &Fault) -> Self {
        let (dip_sin, dip_cos) = sin_cos_degrees(fault.dip.clamp(1.0, 90.0));
        let right = heading(fault.strike - 90.0);
        let down = DVec3::new(right.x * dip_cos, right.y * dip_cos, -dip_sin);
        let up = DVec3::new(right.x * dip_sin, right.y * dip_sin, dip_cos);
        Self { at: fault.at, up, back: -down * (fault.throw / dip_sin) }
    }
}

impl Layers {
    /// Layers perpendicular to `normal`, the first one through `origin`. Folds come before faults; the last one of a
    /// list is the youngest.
    pub fn new(origin: DVec3, normal: DVec3, folds: &[Fold], faults: &[Fault], hash: Hash) -> Self {
        let normal = normal.try_normalize().unwrap_or(DVec3::Z);
        let bent = |(n, fold): (usize, &Fold)| Bent::new(fold, hash.with(n as u64));
        Self {
            origin,
            normal,
            axes: frame_of(normal),
            folds: folds.iter().enumerate().map(bent).collect(),
            slips: faults.iter().map(Slip::new).collect(),
        }
    }

    /// The position of a point before all faults and folds, in the layers: across the direction of 0°, height above the
    /// first layer, and along 0°.
    pub fn place(&self, point: DVec3) -> DVec3 {
        let mut p = point;
        for slip in self.slips.iter().rev() {
            if (p - slip.at).dot(slip.up) > 0.0 {
                p += slip.back;
            }
        }
        let p = p - self.origin;
        let flat = DVec2::new(p.dot(self.axes[0]), p.dot(self.axes[1]));
        let lifted: f64 = self.folds.iter().map(|fold| fold.at(flat)).sum();
        DVec3::new(flat.y, p.dot(self.normal) - lifted, flat.x)
    }

    /// The point in space before all faults and folds, from its [`place`](Self::place).
    pub fn original(&self, place: DVec3) -> DVec3 {
        self.origin + self.axes[0] * place.z + self.axes[1] * place.x + self.normal * place.y
    }
}

/// Sets of laminae that dunes left.
#[derive(Clone, Debug)]
pub struct Sets {
    dunes: Dunes,
    way: DVec2,
    waver: Waver,
    hash: Hash,
}

/// A point of a set of laminae.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InSet {
    /// Number of the set.
    pub set: f64,
    /// mm that the dunes travelled until they reached the point.
    pub travelled: f64,
}

impl Sets {
    /// The sets of some dunes.
    pub fn new(dunes: Dunes, hash: Hash) -> Self {
        Self { way: heading(dunes.direction), waver: Waver::new(hash.with(1)), hash: hash.with(2), dunes }
    }

    /// Lower border of a set, in sets.
    fn border(&self, set: f64) -> f64 {
        set + 0.7 * self.dunes.irregular * (self.draw(set, 0) - 0.5)
    }

    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "bits of a whole number")]
    fn draw(&self, set: f64, counter: u64) -> f64 {
        self.hash.with(set as i64 as u64).unit(counter)
    }

    /// The set of a point, by its place in the layers.
    pub fn at(&self, place: DVec3) -> InSet {
        let Dunes { height, length, angle, irregular, .. } = self.dunes;
        let flat = DVec2::new(place.z, place.x);
        let (u, v) = (flat.dot(self.way), self.way.perp_dot(flat));
        // The borders rise by one set from dune to dune, and undulate.
        let mut level = (place.y - u * height / length) / height;
        if irregular > 0.0 {
            level += 0.5 * irregular * self.waver.at(u / length, v / length);
        }
        let mut set = level.floor();
        if level < self.border(set) {
            set -= 1.0;
        } else if level >= self.border(set + 1.0) {
            set += 1.0;
        }
        let (low, high) = (self.border(set), self.border(set + 1.0));
        let share = ((level - low) / (high - low)).clamp(0.0, 1.0);
        let vary = |counter: u64, by: f64| by * irregular * (2.0 * self.draw(set, counter) - 1.0);
        let (s, c) = sin_cos_degrees((angle * (1.0 + vary(1, 0.3))).clamp(1.0, 80.0));
        let u = if irregular > 0.0 { flat.dot(heading(self.dunes.direction + vary(2, 25.0))) } else { u };
        // Lee sides flatten towards their toes.
        let run = (high - low) * height * c / s * 0.5 * (share + share.sqrt());
        InSet { set, travelled: u + run + (set + vary(3, 0.5)) * length }
    }

    /// mm that dunes travel while a lamina of a thickness forms.
    pub fn step(&self, thickness: f64) -> f64 {
        thickness / sin_cos_degrees(self.dunes.angle.clamp(1.0, 80.0)).0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hash() -> Hash {
        Hash::new(5)
    }

    fn random(n: u64) -> DVec3 {
        let unit = |k| 200.0 * (hash().with(99).unit(3 * n + k) - 0.5);
        DVec3::new(unit(0), unit(1), unit(2))
    }

    fn fold(irregular: f64) -> Fold {
        Fold { height: 8.0, wavelength: 30.0, direction: 20.0, phase: 0.1, irregular }
    }

    #[test]
    fn even_layers_have_the_height_along_their_normal() {
        let normal = DVec3::new(1.0, 2.0, 2.0);
        let layers = Layers::new(DVec3::new(1.0, 2.0, 3.0), normal, &[], &[], hash());
        for n in 0..100 {
            let p = random(n);
            let place = layers.place(p);
            assert!((place.y - (p - DVec3::new(1.0, 2.0, 3.0)).dot(normal) / 3.0).abs() < 1e-9);
            assert!(layers.original(place).distance(p) < 1e-9);
        }
    }

    #[test]
    fn folds_keep_the_distance_of_layers_along_the_normal() {
        for irregular in [0.0, 1.0] {
            let layers = Layers::new(DVec3::ZERO, DVec3::Z, &[fold(irregular), fold(0.5)], &[], hash());
            for n in 0..100 {
                let p = random(n);
                let rise = layers.place(p + DVec3::Z * 7.0).y - layers.place(p).y;
                assert!((rise - 7.0).abs() < 1e-9);
            }
        }
        // A crest is `height` above a trough.
        let layers =
            Layers::new(DVec3::ZERO, DVec3::Z, &[Fold { direction: 0.0, phase: 0.0, ..fold(0.0) }], &[], hash());
        let at = |x: f64| -layers.place(DVec3::new(x, 9.0, 0.0)).y;
        assert!((at(0.0) - 4.0).abs() < 1e-12 && (at(15.0) + 4.0).abs() < 1e-12);
    }

    #[test]
    fn faults_lower_the_side_above_them_by_their_throw() {
        let fault = Fault { at: DVec3::ZERO, strike: 90.0, dip: 60.0, throw: 5.0 };
        let layers = Layers::new(DVec3::ZERO, DVec3::Z, &[], &[fault], hash());
        // The strike points along y, so the plane descends along x, and the upper side lies at x > 0.
        assert!((layers.place(DVec3::new(40.0, 3.0, 0.0)).y - 5.0).abs() < 1e-9);
        assert!(layers.place(DVec3::new(-40.0, 3.0, 0.0)).y.abs() < 1e-9);
        // A shift along the plane itself changes nothing else: the slip runs down the dip.
        let moved = layers.original(layers.place(DVec3::new(40.0, 3.0, 0.0)));
        assert!((moved - DVec3::new(40.0 - 5.0 / f64::tan(60f64.to_radians()), 3.0, 5.0)).length() < 1e-9);
    }

    #[test]
    fn younger_faults_shift_older_ones() {
        let old = Fault { at: DVec3::ZERO, strike: 90.0, dip: 90.0, throw: 4.0 };
        let young = Fault { at: DVec3::ZERO, strike: 0.0, dip: 45.0, throw: 6.0 };
        let layers = Layers::new(DVec3::ZERO, DVec3::Z, &[], &[old, young], hash());
        let only = |f: Fault| Layers::new(DVec3::ZERO, DVec3::Z, &[], &[f], hash());
        for n in 0..200 {
            let p = random(n);
            let back = only(young).original(only(young).place(p));
            assert!(layers.place(p).distance(only(old).place(back)) < 1e-9);
        }
    }

    fn dunes(irregular: f64) -> Dunes {
        Dunes { height: 20.0, length: 90.0, angle: 25.0, direction: 0.0, irregular }
    }

    #[test]
    fn sets_rise_upwards_and_fill_space() {
        let sets = Sets::new(dunes(0.0), hash());
        for n in 0..200 {
            let p = random(n);
            let (mut before, mut total) = (sets.at(p), 0.0);
            for k in 1..200 {
                let now = sets.at(p + DVec3::Y * f64::from(k) * 0.5);
                assert!(now.travelled >= before.travelled - 1e-9, "{p} {k}: {before:?} {now:?}");
                assert!(now.set == before.set || now.set == before.set + 1.0);
                total += now.travelled - before.travelled;
                before = now;
            }
            // A set every 20 mm, and a dune's length from set to set.
            assert!((total / 99.5 - 90.0 / 20.0).abs() < 1.0, "{total}");
        }
        let sets = Sets::new(dunes(1.0), hash());
        let mut seen = 0;
        for n in 0..200 {
            let p = random(n);
            let borders = |set: f64| sets.border(set + 1.0) - sets.border(set);
            let at = sets.at(p);
            assert!(at.travelled.is_finite() && borders(at.set) > 0.2);
            seen += usize::from(at.set != sets.at(p + DVec3::Y * 20.0).set);
        }
        assert!(seen > 180);
    }

    #[test]
    fn laminae_dip_in_the_direction_of_travel() {
        let sets = Sets::new(dunes(0.0), hash());
        let p = DVec3::new(0.0, 9.0, 3.0);
        let at = |dz: f64, dy: f64| sets.at(p + DVec3::new(0.0, dy, dz)).travelled - sets.at(p).travelled;
        assert!(at(0.1, 0.0) > 0.0 && at(0.0, 0.1) > 0.0);
        // Steeper than half of the angle, less steep than twice.
        let slope = at(0.1, 0.0) / at(0.0, 0.1);
        assert!(slope > 0.5 * 25f64.to_radians().tan() && slope < 2.0 * 25f64.to_radians().tan(), "{slope}");
        assert!((sets.step(1.0) - 1.0 / 25f64.to_radians().sin()).abs() < 1e-9);
    }
}
