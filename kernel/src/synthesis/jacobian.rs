//! 2×2 matrices `J = ∂S/∂p`, from output to exemplar, stored as J00 J01 J10 J11.

/// A Jacobian, by rows.
pub type Jacobian = [f32; 4];

/// `J = 1`.
pub const IDENTITY: Jacobian = [1.0, 0.0, 0.0, 1.0];

pub use crate::ground::window::OCTANTS;

/// `J v`.
#[inline(always)]
pub fn apply(j: &Jacobian, [x, y]: [f32; 2]) -> [f32; 2] {
    [j[0] * x + j[1] * y, j[2] * x + j[3] * y]
}

/// The determinant.
#[inline(always)]
pub fn det(j: &Jacobian) -> f32 {
    j[0] * j[3] - j[1] * j[2]
}

/// The inverse; not finite for a singular matrix.
#[inline(always)]
pub fn inverse(j: &Jacobian) -> Jacobian {
    let scale = 1.0 / det(j);
    [j[3] * scale, -j[1] * scale, -j[2] * scale, j[0] * scale]
}

/// `A B`.
#[inline]
pub fn multiply(a: &Jacobian, b: &Jacobian) -> Jacobian {
    [a[0] * b[0] + a[1] * b[2], a[0] * b[1] + a[1] * b[3], a[2] * b[0] + a[3] * b[2], a[2] * b[1] + a[3] * b[3]]
}

/// Features rotated by `angle` from +x towards +y, scaled by `scale`, and stretched by `stretch` along their own x
/// axis.
#[inline]
pub fn from_angle_scale(angle: f32, scale: f32, stretch: f32) -> Jacobian {
    let (s, c) = (crate::ground::math::sin(angle), crate::ground::math::cos(angle));
    let (x, y) = (1.0 / (scale * stretch), 1.0 / scale);
    [c * x, s * x, -s * y, c * y]
}

/// Maps the exemplar's x axis to `t` and its y axis to `b`.
#[inline]
pub fn from_vectors(t: [f32; 2], b: [f32; 2]) -> Jacobian {
    inverse(&[t[0], b[0], t[1], b[1]])
}

/// Index in [`OCTANTS`] of the neighbour nearest in direction to (x, y); a tie goes to the counter-clockwise one.
#[inline(always)]
pub fn octant(x: f64, y: f64) -> usize {
    // tan 22.5°
    const T: f64 = std::f64::consts::SQRT_2 - 1.0;
    // Use symmetry: only directions within the octants to the right and left of an axis remain.
    let (ax, ay) = (x.abs(), y.abs());
    let (right, down) = (x > 0.0, y > 0.0);
    // Ties go counter-clockwise: a bound belongs to the octant that follows it.
    let along_x = if right == down { ay < T * ax } else { ay <= T * ax };
    let along_y = if right == down { ax <= T * ay } else { ax < T * ay };
    match (along_x, along_y, right, down) {
        (true, _, true, _) => 0,
        (true, _, false, _) => 4,
        (_, true, _, true) => 2,
        (_, true, _, false) => 6,
        (_, _, true, true) => 1,
        (_, _, false, true) => 3,
        (_, _, false, false) => 5,
        (_, _, true, false) => 7,
    }
}

/// Returns why a Jacobian cannot be used: singular, not finite, or a scale beyond 1 : 64.
pub fn fault(j: &Jacobian) -> Option<&'static str> {
    if j.iter().any(|v| !v.is_finite()) {
        return Some("not finite");
    }
    let det = f64::from(j[0]) * f64::from(j[3]) - f64::from(j[1]) * f64::from(j[2]);
    let size: f64 = j.iter().map(|v| f64::from(*v) * f64::from(*v)).sum();
    if det.abs() <= 1e-4 * size || size == 0.0 {
        return Some("singular");
    }
    if det.abs() > 4096.0 {
        return Some("too large: features shrink more than 64 times");
    }
    (det.abs() < 1.0 / 4096.0).then_some("too small: features grow more than 64 times")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_turn_features_towards_y() {
        let j = from_angle_scale(std::f32::consts::FRAC_PI_2, 2.0, 1.0);
        // A step along +y of the output is half a step along +x of the exemplar.
        let along = apply(&j, [0.0, 1.0]);
        assert!((along[0] - 0.5).abs() < 1e-6 && along[1].abs() < 1e-6);
        let product = multiply(&j, &inverse(&j));
        assert!(product.iter().zip(IDENTITY).all(|(a, b)| (a - b).abs() < 1e-6));
        assert_eq!(from_vectors([2.0, 0.0], [0.0, 1.0]), [0.5, 0.0, 0.0, 1.0]);
    }

    #[test]
    fn finds_nearest_octant() {
        for k in 0..720u16 {
            let (y, x) = libm::sincos((f64::from(k) * 0.5).to_radians());
            // Directions between two are exact only up to rounding.
            if k % 90 != 45 {
                assert_eq!(octant(x, y), usize::from((k + 45) / 90 % 8), "{k} half degrees");
            }
        }
    }
}
