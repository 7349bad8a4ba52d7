//! Spots from which a pattern grows, at places that the seed alone determines.
use crate::ground::hash::Hash;
use glam::{DVec2, IVec2};

/// Distance of spots, in waves. Closer ones take the food from each other, and everything dies.
const APART: f64 = 1.2;

/// Spots on an area that repeats: one in each cell of a grid, somewhere in the cell.
pub(super) struct Start {
    counts: IVec2,
    cell: DVec2,
    wave: f64,
    hash: Hash,
}

impl Start {
    /// Spots for waves of `wave` mm on an area of `size` mm.
    pub(super) fn new(size: DVec2, wave: f64, hash: Hash) -> Self {
        let counts = (size / (APART * wave)).round().clamp(DVec2::ONE, DVec2::splat(1e6)).as_ivec2();
        Self { counts, cell: size / counts.as_dvec2(), wave, hash }
    }

    /// The dose at a place in mm, 0..1. `sown` tells whether the spot at a place exists.
    pub(super) fn at(&self, p: DVec2, sown: impl Fn(DVec2) -> bool) -> f64 {
        let (own, size) = ((p / self.cell).floor().as_ivec2(), self.cell * self.counts.as_dvec2());
        let mut dose: f64 = 0.0;
        for k in 0..9 {
            let cell = own + IVec2::new(k % 3 - 1, k / 3 - 1);
            let name = cell.rem_euclid(self.counts);
            let hash = self.hash.with(u64::from(name.x.cast_unsigned()) << 32 | u64::from(name.y.cast_unsigned()));
            let spot = (cell.as_dvec2() + DVec2::new(hash.unit(0), hash.unit(1))) * self.cell;
            let radius = self.wave * (0.25 + 0.15 * hash.unit(2));
            let near = 2.0 - 2.0 * spot.distance_squared(p) / (radius * radius);
            if near > dose && sown(spot.rem_euclid(size)) {
                dose = near;
            }
        }
        dose.min(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spots_repeat_and_are_sown() {
        let start = Start::new(DVec2::new(20.0, 11.0), 2.0, Hash::new(3));
        let mut most: f64 = 0.0;
        for k in 0..400 {
            let p = DVec2::new(f64::from(k % 20), f64::from(k / 20) * 0.5);
            let here = start.at(p, |_| true);
            most = most.max(here);
            assert!((here - start.at(p + DVec2::new(20.0, -11.0), |_| true)).abs() < 1e-9);
            assert_eq!(start.at(p, |_| false), 0.0);
        }
        assert_eq!(most, 1.0);
    }
}
