//! Bounds that parameters of several families have in common.
use shibo_engine::diagnostics::{Code, Problem};
use shibo_engine::node::CanvasFacts;

/// Refuses a length that is more than half of the canvas' longer side: on a canvas that tiles, the same place would be
/// read twice.
pub(crate) fn at_most_half(name: &'static str, mm: f64, canvas: &CanvasFacts) -> Vec<Problem> {
    let most = 0.5 * canvas.size_mm().max_element();
    if mm <= most {
        return Vec::new();
    }
    let message = format!("{name} is `{mm}` mm; it must be at most half the canvas' longer side, {most} mm");
    vec![Problem::new(Code::OutOfRange, message).at(name)]
}
