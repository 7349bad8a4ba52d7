//! Angles in degrees. Sines and cosines come from libm, which gives the same bits on every machine.
use glam::{DMat3, DVec3};

/// The sine and cosine of an angle in degrees, exact at multiples of 90°.
pub(crate) fn sin_cos(degrees: f64) -> (f64, f64) {
    let quarters = degrees / 90.0;
    if quarters.fract() != 0.0 {
        return (libm::sin(degrees.to_radians()), libm::cos(degrees.to_radians()));
    }
    match quarters.rem_euclid(4.0) {
        0.0 => (0.0, 1.0),
        1.0 => (1.0, 0.0),
        2.0 => (0.0, -1.0),
        _ => (-1.0, 0.0),
    }
}

/// The rotation by an angle in degrees about an axis of length 1, in the sense of a right-handed screw.
pub(crate) fn about(axis: DVec3, degrees: f64) -> DMat3 {
    let (sin, cos) = sin_cos(degrees);
    let column = |v: DVec3| cos * v + sin * axis.cross(v) + (1.0 - cos) * axis.dot(v) * axis;
    DMat3::from_cols(column(DVec3::X), column(DVec3::Y), column(DVec3::Z))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotations_match_glam() {
        for (k, degrees) in (0_u8..).zip([-720.0, -133.3, -90.0, -1e-3, 0.0, 0.7, 30.0, 89.9, 90.0, 180.0, 271.0]) {
            let k = f64::from(k);
            for axis in [DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(0.3 * k - 1.0, 1.0, 0.2 - k).normalize()] {
                let want = DMat3::from_axis_angle(axis, f64::to_radians(degrees));
                assert!(about(axis, degrees).abs_diff_eq(want, 1e-12), "{axis} {degrees}");
            }
        }
        assert_eq!(about(DVec3::Z, 90.0) * DVec3::X, DVec3::Y);
    }
}
