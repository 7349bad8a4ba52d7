//! Bounds that parameters of several families share.
use shibo_node::CanvasFacts;
use shibo_value::diagnostics::{Code, Problem};

/// Rounding error that is tolerated in computed numbers and bounds, as a share of the bound.
const ROUNDING: f64 = 1e-9;

/// True if `value` exceeds the bound `most` by more than rounding; either may be computed.
pub(crate) fn exceeds(value: f64, most: f64) -> bool {
    value > most * (1.0 + ROUNDING)
}

/// Rounds a computed number to six digits, for messages.
pub(crate) fn told(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounds_numbers_in_messages_to_six_digits() {
        assert_eq!(told(1.5 * 0.7), 1.05);
        assert_eq!(told(-1.0 / 3.0).to_string(), "-0.333333");
        assert_eq!((told(0.0), told(123_456_789.0)), (0.0, 123_457_000.0));
        assert!(!exceeds(1.05 / 0.7, 1.5) && exceeds(1.5001, 1.5));
    }
}
