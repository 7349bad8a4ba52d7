//! Yarn: knitting, braids, rope, and cloth of yarns. All of them draw the threads of
//! [`kernel::yarn`](shibo_kernel::yarn).
mod braid;
mod cloth;
mod knit;
mod parts;

pub use braid::Braid;
pub use cloth::Cloth;
pub use knit::Knit;

use shibo_node::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Yarn",
        doc: "Knitting, braids, rope and cloth of one model of threads: each has plies, a twist and fibres, and its direction at every place.",
        kinds: vec![Kind::of::<Knit>(), Kind::of::<Braid>(), Kind::of::<Cloth>()],
    }
}
