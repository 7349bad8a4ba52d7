//! Angles in degrees as several families take them.

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
