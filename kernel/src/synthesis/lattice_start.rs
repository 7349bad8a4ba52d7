//! Start from the lattice of a near-regular exemplar: the phase is the same everywhere, the content varies from cell to
//! cell.
use super::jacobian::{self, IDENTITY, Jacobian};
use super::lattice::Basis;
use crate::ground::hash::Hash;
use crate::ground::number::narrow;

/// A lattice fitted to the output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fitted {
    /// The vectors by which the exemplar repeats.
    pub basis: Basis,
    /// Map from output pixels to exemplar pixels, by rows: the Jacobian, bent slightly so that sides that wrap in the
    /// output also match in the lattice.
    pub map: [[f64; 2]; 2],
}

/// Fits a lattice to an output of `size` pixels, for the axes that `wrap`, under the Jacobian `j`.
pub fn fit(basis: Basis, j: [[f64; 2]; 2], size: [f64; 2], wrap: [bool; 2]) -> Fitted {
    let image = |v: [f64; 2]| [j[0][0] * v[0] + j[0][1] * v[1], j[1][0] * v[0] + j[1][1] * v[1]];
    // The lattice vector nearest to the image of a side of the output.
    let snap = |v: [f64; 2]| {
        let [i, k] = basis.coordinates(v).map(f64::round);
        let near = (-1..=1).flat_map(|di| (-1..=1).map(move |dk| (f64::from(di), f64::from(dk))));
        let gap = |w: [f64; 2]| (w[0] - v[0]).powi(2) + (w[1] - v[1]).powi(2);
        near.map(|(di, dk)| basis.at(i + di, k + dk))
            .fold(None, |best: Option<[f64; 2]>, w| if best.is_some_and(|b| gap(b) <= gap(w)) { best } else { Some(w) })
            .unwrap_or(v)
    };
    let side = |v: [f64; 2], wrap: bool| if wrap { snap(image(v)) } else { image(v) };
    let (x, y) = (side([size[0], 0.0], wrap[0]), side([0.0, size[1]], wrap[1]));
    let fitted = [[x[0] / size[0], y[0] / size[1]], [x[1] / size[0], y[1] / size[1]]];
    let det = fitted[0][0] * fitted[1][1] - fitted[0][1] * fitted[1][0];
    let plain = j[0][0] * j[1][1] - j[0][1] * j[1][0];
    // An output smaller than a cell would be distorted too much.
    let sane = det.is_finite() && det / plain > 0.5 && det / plain < 2.0;
    Fitted { basis, map: if sane { fitted } else { j } }
}

/// Limit of the stretch or rotation of features that makes a lattice fit.
const BENT: f32 = 0.125;

impl Fitted {
    /// Bends `j` with the lattice, so that all pieces continue in phase. `None` if the distortion is too large.
    pub fn bent(&self, j: &Jacobian) -> Option<Jacobian> {
        let m = self.map;
        let bent = [m[0][0], m[0][1], m[1][0], m[1][1]].map(narrow);
        let change = jacobian::multiply(&bent, &jacobian::inverse(j));
        change.iter().zip(IDENTITY).all(|(a, b)| (a - b).abs() <= BENT).then_some(bent)
    }

    /// Maps output position `p` to the exemplar, by a hashed lattice vector that moves it to within `low..high`.
    pub fn place(&self, p: [f64; 2], low: [f64; 2], high: [f64; 2], hash: Hash) -> [f64; 2] {
        let m = self.map;
        let at = [m[0][0] * p[0] + m[0][1] * p[1], m[1][0] * p[0] + m[1][1] * p[1]];
        let mut last = at;
        for k in 0..24 {
            let wish = [0, 1].map(|d| low[d] + (high[d] - low[d]) * hash.unit(2 * k + d as u64));
            last = self.moved(at, wish);
            if (0..2).all(|d| (low[d]..high[d]).contains(&last[d])) {
                return last;
            }
        }
        [0, 1].map(|d| last[d].clamp(low[d], high[d]))
    }

    /// Moves a position by a lattice vector as near to `wish` as possible.
    pub fn moved(&self, at: [f64; 2], wish: [f64; 2]) -> [f64; 2] {
        let [i, j] = self.basis.coordinates([wish[0] - at[0], wish[1] - at[1]]).map(f64::round);
        let v = self.basis.at(i, j);
        [at[0] + v[0], at[1] + v[1]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wraps_lattice_with_output() {
        let basis = Basis { a: [12.0, 12.2], b: [12.1, -12.0] };
        let fitted = fit(basis, [[1.0, 0.0], [0.0, 1.0]], [512.0, 300.0], [true, true]);
        for side in [[512.0, 0.0], [0.0, 300.0]] {
            let m = fitted.map;
            let v = [m[0][0] * side[0] + m[0][1] * side[1], m[1][0] * side[0] + m[1][1] * side[1]];
            assert!(basis.coordinates(v).iter().all(|c| (c - c.round()).abs() < 1e-9), "{v:?}");
        }
        assert!((fitted.map[0][0] - 1.0).abs() < 0.03);
        let bent = fitted.bent(&IDENTITY).expect("two parts in a hundred");
        assert_eq!(bent[0], narrow(fitted.map[0][0]));
        // Cells of 17 pixels do not fit 30, and are not stretched to fit.
        let small = fit(basis, [[1.0, 0.0], [0.0, 1.0]], [30.0, 30.0], [true, true]);
        assert!(small.map[0][0] != 1.0 && small.bent(&IDENTITY).is_none(), "{small:?}");
        let p = fitted.place([100.0, 70.0], [8.0; 2], [120.0; 2], Hash::new(1));
        assert!(p.iter().all(|c| (8.0..120.0).contains(c)));
    }
}
