//! Combine: point-wise operations on several fields.
mod blend;
mod choose;
mod expression;
mod formula;
mod height_blend;
mod make_vector;
mod math;
mod pack_channels;
mod split_channels;
mod switch;

pub use blend::Blend;
pub use choose::{Choose, ChooseMaterial};
pub use expression::Expression;
pub use height_blend::HeightBlend;
pub use make_vector::MakeVector;
pub use math::Math;
pub use pack_channels::PackChannels;
pub use split_channels::SplitChannels;
pub use switch::{Switch, SwitchMaterial};

use shibo_node::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Combine",
        doc: "Point-wise operations on several fields; where one is a colour, grey counts as a colour too.",
        kinds: vec![
            Kind::of::<Blend>(),
            Kind::of::<HeightBlend>(),
            Kind::of::<Math>(),
            Kind::of::<Expression>(),
            Kind::of::<SplitChannels>(),
            Kind::of::<PackChannels>(),
            Kind::of::<MakeVector>(),
            Kind::of::<Switch>(),
            Kind::of::<SwitchMaterial>(),
        ],
    }
}
