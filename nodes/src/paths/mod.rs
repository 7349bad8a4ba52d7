//! Paths: curves on the canvas, fields of the distance from them, and seams along them.
mod flow_from_paths;
mod path;
mod sources;
mod stitch;
mod streamlines;

pub use flow_from_paths::FlowFromPaths;
pub use path::Path;
pub use stitch::Stitch;
pub use streamlines::Streamlines;

use shibo_node::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Paths",
        doc: "Curves on the canvas in mm: the place along and across them as fields, stitches along them, \
              directions that follow them, and lines that follow directions.",
        kinds: vec![Kind::of::<Path>(), Kind::of::<Stitch>(), Kind::of::<FlowFromPaths>(), Kind::of::<Streamlines>()],
    }
}
