//! Magnification: evaluates the coordinates of a coarse map at any position between its pixels.
//!
//! Isometric (5): `Σ w(Δ) E[S[p-Δ] + Δ]`, anisometric (6): `Σ w(Δ) E[S[p-Δ] + JΔ]`, Δ from the centres of the four
//! nearest pixels to p, `w = (1-|Δx|)(1-|Δy|)` (printed as |Δx||Δy|, which would favour the farthest).
use super::plane::Lookup;
use crate::ground::real::Real;
use crate::ground::window::index;

/// The exemplar positions that contribute at `p` (in pixels of the map), and their weights. `jacobian` returns J at
/// each of the four pixels, or at p.
#[inline(always)]
pub fn places<T: Real>(
    map: &[[T; 2]],
    lookup: &impl Lookup,
    p: [T; 2],
    jacobian: impl Fn(usize) -> [T; 4],
) -> [([T; 2], T); 4] {
    let cell = p.map(|v| super::texels::floor(v - T::HALF));
    let rest = [0, 1].map(|d| p[d] - T::HALF - T::of(f64::from(cell[d])));
    [[0, 0], [1, 0], [0, 1], [1, 1]].map(|corner: [usize; 2]| {
        let at = lookup.index(cell[0] + index(corner[0]), cell[1] + index(corner[1]));
        let delta = [0, 1].map(|d| if corner[d] == 0 { rest[d] } else { rest[d] - T::ONE });
        let weight = [0, 1].map(|d| if corner[d] == 0 { T::ONE - rest[d] } else { rest[d] });
        let j = jacobian(at);
        let step = [j[0] * delta[0] + j[1] * delta[1], j[2] * delta[0] + j[3] * delta[1]];
        ([map[at][0] + step[0], map[at][1] + step[1]], weight[0] * weight[1])
    })
}
