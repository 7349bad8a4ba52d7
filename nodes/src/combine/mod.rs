//! Combine: point-wise operations on several fields.
mod blend;
mod choose;
mod math;

pub use blend::Blend;
pub use choose::{Choose, ChooseMaterial};
pub use math::Math;

use shibo_engine::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Combine",
        doc: "Point-wise operations on several fields; where one is a colour, grey counts as a colour too.",
        kinds: vec![Kind::of::<Blend>(), Kind::of::<Math>()],
    }
}
