//! Lattice phases: positions within a cell. A result that starts on a lattice keeps its phase: exemplar positions of
//! another phase cost more.
//!
//! Without this cost, even use and chance let whole pieces slip. The middle of such a piece continues the exemplar and
//! costs nothing, so nothing replaces it, and features around it are torn.
use super::lattice::Basis;
use super::lattice_start::Fitted;
use super::region::Region;
use crate::ground::math::clamp;
use crate::ground::number::narrow;
use rayon::prelude::*;

/// A position in a cell, along both lattice vectors, in 1/65536 of a cell, so that differences wrap around.
pub(super) type Phase = [u16; 2];

/// Phase error without cost, in lengths of the shorter vector: exemplars are never quite regular.
const FREE: f64 = 0.1;

/// Phase error with the full cost, as a multiple of [`FREE`].
const MOST: f32 = 3.0;

/// Cost of a full phase error; 1 is the cost of a random exemplar position.
pub(super) const COST: f32 = 1.0;

/// Measures the distance of two phases.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Metric {
    /// Factors on `x²`, `x y` and `y²` of a difference; the sum is 1 where the cost begins.
    gram: [f32; 3],
}

impl Metric {
    /// The metric of a lattice.
    pub(super) fn new(basis: &Basis) -> Self {
        let (Basis { a, b }, free) = (*basis, FREE * basis.shortest() * 65536.0);
        let dot = |v: [f64; 2], w: [f64; 2]| v[0] * w[0] + v[1] * w[1];
        Self { gram: [dot(a, a), 2.0 * dot(a, b), dot(b, b)].map(|v| narrow(v / (free * free))) }
    }

    /// Phase error of two phases, 0 to 1.
    #[inline(always)]
    pub(super) fn off(&self, a: Phase, b: Phase) -> f32 {
        let [x, y] = [0, 1].map(|d| f32::from(a[d].wrapping_sub(b[d]).cast_signed()));
        let squared = self.gram[0] * (x * x) + self.gram[1] * (x * y) + self.gram[2] * (y * y);
        clamp((squared - 1.0) * (1.0 / (MOST * MOST - 1.0)), 0.0, 1.0)
    }
}

/// The phase of a position of the exemplar.
pub(super) fn phase(basis: &Basis, at: [f64; 2]) -> Phase {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "less than a cell; its end is its start"
    )]
    basis.coordinates(at).map(|v| ((v - v.floor()) * 65536.0) as u32 as u16)
}

impl Fitted {
    /// The target phase of each pixel of a region, at its centre.
    pub(super) fn phases(&self, region: &Region) -> Vec<Phase> {
        let (m, w) = (self.map, region.plane.w);
        let mut out = vec![[0; 2]; w * region.plane.h];
        out.par_chunks_mut(w).with_min_len(16).enumerate().for_each(|(y, row)| {
            for (x, out) in row.iter_mut().enumerate() {
                let p = region.center(x, y);
                *out = phase(&self.basis, [0, 1].map(|d| m[d][0] * p[0] + m[d][1] * p[1]));
            }
        });
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeps_phase_under_lattice_vectors() {
        let basis = Basis { a: [12.0, 0.5], b: [-3.0, 20.0] };
        let metric = Metric::new(&basis);
        let at = |v: [f64; 2]| phase(&basis, v);
        for (i, j) in [(0.0, 0.0), (3.0, -2.0), (-7.0, 5.0)] {
            let [x, y] = basis.at(i, j);
            // A tenth of the shorter vector is free, three tenths cost the most.
            assert!(metric.off(at([5.0, 5.0]), at([5.0 + x + 1.1, y + 5.0])) < 1e-3);
            let half = metric.off(at([5.0, 5.0]), at([5.0 + x - 1.5, y + 3.2]));
            let squared = (1.5f32 * 1.5 + 1.8 * 1.8) / (0.1f32 * 0.1 * 12.010_412f32.powi(2));
            assert!((half - (squared - 1.0) / 8.0).abs() < 1e-3, "{half}");
            assert!(metric.off(at([5.0, 5.0]), at([11.0 + x, y + 5.0])) >= 1.0);
        }
        assert_eq!(metric.off(at([0.0; 2]), at([-1e-12, -1e-12])), 0.0);
    }
}
