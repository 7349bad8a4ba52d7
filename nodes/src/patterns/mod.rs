//! Patterns: bricks, tiles, hexagons, cloth; each piece has a number, a place and an angle.
mod brick;
mod hex;
mod pieces;
mod truchet;
mod weave;

pub use brick::Brick;
pub use hex::Hex;
pub use truchet::Truchet;
pub use weave::Weave;

use shibo_node::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Patterns",
        doc: "Pieces that repeat with the canvas. Each has a height, a mask of its gaps or bands, and for every piece its number (`ids`), \
              the place within it in mm (`local`) and the angle of its long side.",
        kinds: vec![Kind::of::<Brick>(), Kind::of::<Hex>(), Kind::of::<Weave>(), Kind::of::<Truchet>()],
    }
}
