//! Paths: curves on the canvas, what lies beside them, and seams along them.
mod path;
mod sources;
mod stitch;

pub use path::Path;
pub use stitch::Stitch;

use shibo_engine::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Paths",
        doc: "Curves on the canvas in mm: the place along and across them as fields, and stitches along them.",
        kinds: vec![Kind::of::<Path>(), Kind::of::<Stitch>()],
    }
}
