//! Reaction: substances that diffuse and react, and the patterns that they grow.
mod react;

pub use react::React;

use shibo_node::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Reaction",
        doc: "Substances that diffuse and react, and grow spots, worms and mazes: coral, hides, fingertips.",
        kinds: vec![Kind::of::<React>()],
    }
}
