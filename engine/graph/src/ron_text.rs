//! Values as RON.
use std::ops::Range;

/// The range of numbers that fit into the largest integers of parameters.
const INTEGERS: Range<f64> = -9.2e18..1.84e19;

/// A number as RON; whole numbers without a decimal point, so that they also serve as counts.
pub(super) fn number_text(value: f64) -> String {
    if value.fract() == 0.0 && INTEGERS.contains(&value) { format!("{value:.0}") } else { format!("{value:?}") }
}

/// A text as a RON string.
pub(super) fn ron_string(text: &str) -> String {
    let mut out = String::with_capacity(text.len() + 2);
    out.push('"');
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            c if c.is_control() => out.extend(c.escape_unicode()),
            c => out.push(c),
        }
    }
    out.push('"');
    out
}
