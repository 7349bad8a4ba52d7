//! Combine: point-wise operations on several fields.
mod blend;
mod choose;
mod height_blend;
mod switch;

pub use blend::Blend;
pub use choose::{Choose, ChooseMaterial};
pub use height_blend::HeightBlend;
pub use switch::{Switch, SwitchMaterial};

use shibo_node::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Combine",
        doc: "Point-wise operations on several fields; where one is a colour, grey counts as a colour too.",
        kinds: vec![Kind::of::<Blend>(), Kind::of::<HeightBlend>(), Kind::of::<Switch>(), Kind::of::<SwitchMaterial>()],
    }
}
