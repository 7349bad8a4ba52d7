//! Deposits: times that belong to no tree. Layers of sediment or of a stack, fronts that start at walls or seeds,
//! deformations of a solid, and growth on a surface. z points up; lengths in mm, angles in degrees, times in units of a
//! layer.
pub mod bend;
pub mod growth;
pub mod layers;
pub mod seeds;
pub mod sweep;

use glam::{DVec2, DVec3};

/// The sine and cosine of an angle in degrees, with exact values at quarter turns.
pub(crate) fn sin_cos_degrees(angle: f64) -> (f64, f64) {
    let quarter = (angle / 90.0).round();
    let rest = (angle - 90.0 * quarter).to_radians();
    let (s, c) = (libm::sin(rest), libm::cos(rest));
    match quarter.rem_euclid(4.0) {
        0.0 => (s, c),
        1.0 => (c, -s),
        2.0 => (-s, -c),
        _ => (-c, s),
    }
}

/// The unit vector at an angle in degrees from the first axis.
pub(crate) fn heading(angle: f64) -> DVec2 {
    let (s, c) = sin_cos_degrees(angle);
    DVec2::new(c, s)
}

/// Two unit vectors that form a right-handed frame with the unit vector `normal`: the first lies in the plane of
/// `normal` and the x axis, or is the y axis if `normal` points along x.
pub(crate) fn frame_of(normal: DVec3) -> [DVec3; 2] {
    let along = (DVec3::X - normal * normal.x).try_normalize().unwrap_or(DVec3::Y);
    [along, normal.cross(along)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_have_exact_quarter_turns() {
        for (angle, want) in [(0.0, (0.0, 1.0)), (90.0, (1.0, 0.0)), (-90.0, (-1.0, 0.0)), (180.0, (0.0, -1.0))] {
            let (s, c) = sin_cos_degrees(angle);
            assert_eq!((s + 0.0, c + 0.0), want, "{angle}");
        }
        for angle in [-1234.5, -33.0, 17.0, 123.0, 4000.25] {
            let (s, c) = sin_cos_degrees(angle);
            let exact = f64::sin_cos(f64::to_radians(angle));
            assert!((s - exact.0).abs() < 1e-12 && (c - exact.1).abs() < 1e-12, "{angle}");
        }
    }

    #[test]
    fn frames_are_right_handed() {
        for normal in [DVec3::Z, DVec3::X, -DVec3::X, DVec3::new(0.6, 0.0, 0.8), DVec3::new(1.0, 1.0, 1.0).normalize()]
        {
            let [along, across] = frame_of(normal);
            assert!((along.cross(across) - normal).length() < 1e-12, "{normal}");
        }
    }
}
