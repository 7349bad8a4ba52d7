//! Distances to the edge of a shape, shared by several families.
use crate::values::each;
use shibo_kernel::filter::fields;
use shibo_kernel::ground::number::narrow;
use shibo_value::{Field, Key};

/// Distance in mm, up to `radius`, to the edge of the shape where `input` is above `threshold`: measured outside the
/// shape and 0 inside, or inside and 0 outside if `inside`.
pub(crate) fn to_edge(input: &Field, threshold: f64, radius: f64, inside: bool) -> Field {
    let threshold = narrow(threshold);
    if !inside {
        return fields::distances(input, threshold, radius);
    }
    let negative = each(input, |v| -v);
    let negative = match input.key() {
        Some(key) => negative.keyed(Key::of("negative", &[key.as_bytes()])),
        None => negative,
    };
    fields::distances(&negative, -threshold, radius)
}
