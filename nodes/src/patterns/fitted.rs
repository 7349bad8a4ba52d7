//! What patterns say when they do not fit.
use crate::bounds::told;
use glam::DVec2;
use shibo_engine::diagnostics::{Code, Problem};

/// Sizes may differ from the wanted ones by this share without a word.
const SAME: f64 = 2e-3;

/// The error for more pieces than can be numbered.
pub(super) fn too_many(field: &'static str) -> Problem {
    let message = "there would be more than 16777215 pieces on the canvas";
    Problem::new(Code::TooLarge, message).at(field).help("make them larger, or use a smaller canvas")
}

/// Advice if pieces are not as `wanted` (mm) but as `laid`, or not turned by `angle` but by `turned` degrees.
pub(super) fn advice(
    field: &'static str,
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
    let mut message = format!("pieces are {:.4} × {:.4} mm instead of {x} × {y} mm", laid.x, laid.y);
    if off.abs() >= 0.05 {
        message += &format!(", and turned by {:.2}° instead of {angle}°", angle + off);
    }
    message += why;
    vec![Problem::new(Code::Advice, message).at(field)]
}

/// Why they differ.
pub(super) const FITS: &str = ", so that the pattern fits the canvas";
