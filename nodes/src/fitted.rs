//! Messages of patterns that do not fit the canvas.
use crate::bounds::told;
use glam::DVec2;
use shibo_value::diagnostics::{Code, Problem};

/// Relative difference from the wanted size that is accepted without advice.
const SAME: f64 = 2e-3;

/// The error for more pieces than can be numbered.
pub(crate) fn too_many(field: &'static str) -> Problem {
    let message = "there would be more than 16777215 pieces on the canvas";
    Problem::new(Code::TooLarge, message).at(field).help("make them larger, or use a smaller canvas")
}

/// Advice if the size of `things` is not `wanted` but `laid` (mm), or if their rotation is not `angle` but `turned`
/// degrees.
pub(crate) fn advice(
    (field, things): (&'static str, &str),
    [wanted, laid]: [DVec2; 2],
    [angle, turned]: [f64; 2],
    why: &str,
) -> Vec<Problem> {
    let off = (turned - angle + 180.0).rem_euclid(360.0) - 180.0;
    let resized = ((laid - wanted) / wanted).abs().max_element() > SAME;
    if !resized && off.abs() < 0.05 {
        return Vec::new();
    }
    let (x, y) = (told(wanted.x), told(wanted.y));
    let mut message = format!("{things} are {:.4} × {:.4} mm instead of {x} × {y} mm", laid.x, laid.y);
    if off.abs() >= 0.05 {
        message += &format!(", and turned by {:.2}° instead of {angle}°", angle + off);
    }
    message += why;
    vec![Problem::new(Code::Advice, message).at(field)]
}

/// The reason for the difference.
pub(crate) const FITS: &str = ", so that the pattern fits the canvas";
