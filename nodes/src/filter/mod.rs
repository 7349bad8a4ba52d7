//! Filters: fields made from a field and its surroundings.
mod blur;
mod distance_field;
#[cfg(test)]
mod wide_tests;

pub use blur::Blur;
pub use distance_field::{DistanceField, Side};

use shibo_engine::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Filters",
        doc: "Fields made from a field and its surroundings; widths in mm, so the picture is the same at every resolution.",
        kinds: vec![Kind::of::<Blur>(), Kind::of::<DistanceField>()],
    }
}
