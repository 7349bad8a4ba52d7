//! Directions of anisotropy, from the convention of materials to those of other programs.
//!
//! `anisotropy_angle` is the direction of brush lines or fibres in degrees, from +x towards +y on the canvas, where y
//! points down. Highlights are narrow along it and wide across it. Other programs ask for the direction in which
//! highlights are long, and v points up there.
use crate::value::{Field, Halo, Tile, Type};

/// The direction in which highlights are long, in degrees counter-clockwise from +u where v is up.
pub(super) fn elongated(angle: f64) -> f64 {
    90.0 - angle
}

/// The same direction in turns, from 0 up to 1.
pub(super) fn turns(angle: f64) -> f64 {
    (elongated(angle) / 360.0).rem_euclid(1.0)
}

/// The same direction in degrees clockwise from +u where v is up, for `rotate3d` of MaterialX: -(90° - angle) plus half
/// a turn.
pub(super) fn clockwise(angle: f64) -> f64 {
    angle + 90.0
}

/// Direction in which highlights are long as a vector: ½ + ½ of its components along +u and up, and `third`.
pub(super) fn vectors(angle: &Field, third: &Field) -> Field {
    Field::map(Type::Rgb, [angle.clone(), third.clone()], Halo::NONE, |out: &mut Tile, [angle, third]: [&Tile; 2]| {
        for (i, (angle, third)) in angle.plane(0).iter().zip(third.plane(0)).enumerate() {
            // The sine of 90° - angle is the cosine of the angle, and vice versa.
            let (sin, cos) = libm::sincosf(angle.to_radians());
            for (plane, value) in out.planes_mut().into_iter().zip([0.5 + 0.5 * sin, 0.5 + 0.5 * cos, *third]) {
                plane[i] = value;
            }
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Brush lines along x give highlights along y; lines that fall to the right give highlights that rise to the
    /// right.
    #[test]
    fn turns_lines_into_highlights() {
        assert_eq!([0.0, 90.0, 30.0, -45.0].map(elongated), [90.0, 0.0, 60.0, 135.0]);
        assert_eq!([0.0, 90.0, -90.0, 135.0].map(turns), [0.25, 0.0, 0.5, 0.875]);
        assert_eq!([0.0, 90.0, -90.0].map(clockwise), [90.0, 180.0, 0.0]);
        // Opposite directions are the same line.
        for angle in [-80.0, 0.0, 12.5, 170.0] {
            assert!((elongated(angle) + clockwise(angle)).rem_euclid(180.0).abs() < 1e-9, "{angle}");
        }
    }
}
