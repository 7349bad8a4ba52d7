//! Simplex noise: slopes at the corners of equilateral triangles.
//!
//! Source: K. Perlin, "Noise hardware" (2001). Differs in its gradients, uniform in a square, and in its triangles, the
//! halves of rhombic cells that repeat with the canvas. Each corner contributes within its own triangles, with the
//! weight (¾ - d²)⁴, d in sides. So the third derivative is continuous too, and a point needs three corners where
//! gradient noise needs four.

use super::cells::{LANES, RAMP, Run, key, slope};
use crate::ground::math;

/// Sine of 60°.
const SIN: f32 = 0.866_025_4;

/// Scales the noise to about ±1.
const SCALE: f32 = 14.0;

/// The contribution of the corner with this random word at (x, y) from it, in coordinates along the sides of its cell.
#[inline(always)]
fn corner(word: u32, x: f32, y: f32) -> f32 {
    let (x, y) = (x + 0.5 * y, SIN * y);
    let near = math::max(0.75 - (x * x + y * y), 0.0);
    let square = near * near;
    square * square * slope(word, x, y)
}

/// Converts a position among square cells of area 1 to coordinates among rhombic cells.
pub(super) fn rhombic([x, y]: [f64; 2]) -> [f64; 2] {
    let [[a, b], [c, d]] = super::cells::RHOMBIC;
    [a * x + b * y, c * x + d * y]
}

/// The noise identified by a word, at a position among its rhombic cells.
#[inline(always)]
pub(super) fn at(word: u32, x: f32, y: f32) -> f32 {
    let ((fx, u), (fy, v)) = (math::floor_int(x), math::floor_int(y));
    let (x, y) = (x - fx, y - fy);
    let far = i32::from(x + y > 1.0);
    let side = far as f32;
    let a = corner(key(word, u + far, v + far), x - side, y - side);
    SCALE * (a + corner(key(word, u + 1, v), x - 1.0, y) + corner(key(word, u, v + 1), x, y - 1.0))
}

/// The noise on a run of a [triangular](super::cells::CellGrid::triangular) grid.
#[inline(always)]
pub(super) fn simplex<const WRAP: u8>(run: &Run, out: &mut [f32; LANES]) {
    for (out, &k) in out.iter_mut().zip(&RAMP) {
        let (x, y, u, v) = run.place(k);
        // The diagonal between the other two corners divides the cell.
        let far = i32::from(x + y > 1.0);
        let side = far as f32;
        let a = corner(run.word::<WRAP>(u + far, v + far), x - side, y - side);
        let b = corner(run.word::<WRAP>(u + 1, v), x - 1.0, y);
        let c = corner(run.word::<WRAP>(u, v + 1), x, y - 1.0);
        *out = SCALE * (a + b + c);
    }
}

#[cfg(test)]
mod tests {
    use crate::ground::hash::Hash;
    use crate::ground::window::{Frame, WindowExt};
    use crate::noise::cells::{CellGrid, CellShape};
    use crate::noise::fractal::{Basis, Noise, NoiseSpec};
    use glam::DVec2;
    use shibo_value::{Tiling, Window};

    const CANVAS: (DVec2, Tiling) = (DVec2::new(60.0, 60.0), Tiling::BOTH);

    #[test]
    fn cells_are_pairs_of_equilateral_triangles() {
        let grid = CellGrid::triangular(CANVAS, &CellShape::round(0.5), 0.0, Hash::new(1)).unwrap();
        let [[a, b], [c, d]] = grid.to_cell();
        let det = a * d - b * c;
        // The sides of a cell in mm: the columns of the inverse.
        let (p, q) = (DVec2::new(d, -c) / det, DVec2::new(-b, a) / det);
        assert!((p.length() / q.length() - 1.0).abs() < 0.03 && ((p - q).length() / p.length() - 1.0).abs() < 0.03);
        assert!((1.0 / det / 0.25 - 1.0).abs() < 0.03, "of the area wanted");
    }

    #[test]
    fn is_smooth_and_isotropic() {
        let spec = NoiseSpec { basis: Basis::Simplex, ..NoiseSpec::fbm(2.0, 1) };
        let noise = Noise::new(&spec, CANVAS, Hash::new(3));
        let (window, step) = (Window::of(0, 0, 600, 600), 0.1);
        let mut out = vec![0.0; window.len()];
        noise.fill(&Frame::new(window, [step; 2]), &mut out);
        let at = |x: usize, y: usize| f64::from(out[y * 600 + x]);
        // Mean squared difference at equal distances in several directions: those of a right triangle of 3, 4 and 5 and
        // its mirror images.
        let unlike = |dx: usize, dy: usize, back: bool| {
            let pairs = (0..580).flat_map(|y| (10..580).map(move |x| (x, y)));
            let sum: f64 = pairs
                .map(|(x, y)| if back { at(x + dx, y) - at(x, y + dy) } else { at(x, y) - at(x + dx, y + dy) })
                .map(|d| d * d)
                .sum();
            sum / (580.0 * 570.0)
        };
        let all =
            [unlike(10, 0, false), unlike(6, 8, false), unlike(8, 6, false), unlike(0, 10, false), unlike(6, 8, true)];
        let (low, high) = all.iter().fold((f64::MAX, 0.0), |(low, high): (f64, f64), v| (low.min(*v), high.max(*v)));
        assert!(high / low < 1.12, "{all:?}");
        // The noise is continuous: with pixels ten times smaller, differences are about a tenth.
        noise.fill(&Frame::new(window, [0.1 * step; 2]), &mut out);
        let pairs = (0..599 * 599).map(|k| (out[k / 599 * 600 + k % 599 + 1] - out[k / 599 * 600 + k % 599]).abs());
        assert!(pairs.clone().fold(0.0, f32::max) < 0.0125 && pairs.sum::<f32>() > 1.0);
    }
}
