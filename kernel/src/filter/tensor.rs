//! The structure tensor: the direction of the features of a field, and how clear it is.
//!
//! Source: J. Bigün, G. Granlund, "Optimal orientation detection of linear symmetry" (1987). The products of the
//! gradient's components are averaged over a neighbourhood. The eigenvector of the smaller eigenvalue gives the
//! direction of the features, and the coherence is the difference of both eigenvalues divided by their sum.

use crate::ground::math::{atan2_degrees, clamp, max, min};
use crate::ground::simd;

/// Steeper slopes are clamped to this value, whose square is finite.
const STEEPEST: f32 = 1e12;

/// Fills the tensor (xx, yy, xy) from the gradient.
///
/// # Panics
/// If a plane is smaller than the gradient's.
pub fn products(gx: &[f32], gy: &[f32], [xx, yy, xy]: [&mut [f32]; 3]) {
    let n = gx.len();
    let (gy, xx, yy, xy) = (&gy[..n], &mut xx[..n], &mut yy[..n], &mut xy[..n]);
    simd::dispatch(
        #[inline(always)]
        || {
            for i in 0..n {
                let (x, y) = (clamp(gx[i], -STEEPEST, STEEPEST), clamp(gy[i], -STEEPEST, STEEPEST));
                (xx[i], yy[i], xy[i]) = (x * x, y * y, x * y);
            }
        },
    );
}

/// Direction of the features in degrees, -90..90 from +x towards +y, from a tensor (xx, yy, xy); 0 if there is none.
#[inline(always)]
pub fn angle([xx, yy, xy]: [f32; 3]) -> f32 {
    // The gradient has half of that angle, and features are perpendicular to it.
    0.5 * atan2_degrees(-2.0 * xy, yy - xx)
}

/// The clarity of that direction: 0 if there is none, 1 if all gradients are parallel.
#[inline(always)]
pub fn coherence([xx, yy, xy]: [f32; 3]) -> f32 {
    let (sum, difference) = (xx + yy, xx - yy);
    let most = max(sum, 1e-30);
    let (d, p) = (difference / most, 2.0 * xy / most);
    min((d * d + p * p).sqrt(), 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_direction_of_one_gradient_but_not_of_two() {
        for degrees in [-80.0f32, -45.0, 0.0, 10.0, 60.0, 89.0] {
            // Features along `degrees`: the gradient is perpendicular to them.
            let (x, y) = (-degrees.to_radians().sin() * 3.0, degrees.to_radians().cos() * 3.0);
            let mut t = [[0.0]; 3];
            let [xx, yy, xy] = &mut t;
            products(&[x], &[y], [xx, yy, xy]);
            let t = t.map(|t| t[0]);
            assert!((angle(t) - degrees).abs() < 0.01, "{degrees}: {}", angle(t));
            assert!((coherence(t) - 1.0).abs() < 1e-5);
            // Features in two perpendicular directions of equal strength have no direction.
            let both = [t[0] + t[1], t[1] + t[0], 0.0];
            assert!(coherence(both) < 1e-5);
            // Twice as much in one direction as across: (2 - 1) / 3.
            let some = [2.0 * t[0] + t[1], 2.0 * t[1] + t[0], t[2]];
            assert!((coherence(some) - 1.0 / 3.0).abs() < 1e-5 && (angle(some) - degrees).abs() < 0.01);
        }
        assert_eq!((angle([0.0; 3]), coherence([0.0; 3])), (0.0, 0.0));
        let huge = [f32::MAX, f32::MAX, 0.0].map(|v| v.min(1e24));
        assert!(coherence(huge).is_finite());
    }
}
