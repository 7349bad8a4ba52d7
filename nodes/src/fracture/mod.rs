//! Fracture: layers that shrink on a substrate and crack.
#[expect(clippy::module_inception, reason = "the family has the name of its node")]
mod fracture;

pub use fracture::Fracture;

use shibo_node::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Fracture",
        doc: "Layers that shrink on a substrate and crack: mud, glaze, varnish, paint, asphalt.",
        kinds: vec![Kind::of::<Fracture>()],
    }
}
