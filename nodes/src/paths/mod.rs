//! Paths: curves on the canvas, outlines of fields, parallel, mirrored and filling curves, fields of the distance from
//! paths, and seams along them.
mod flow_from_paths;
mod hatch_path;
mod mirror_path;
mod offset_path;
mod outline;
mod path;
mod sources;
mod stitch;
mod streamlines;

pub use flow_from_paths::FlowFromPaths;
pub use hatch_path::HatchPath;
pub use mirror_path::MirrorPath;
pub use offset_path::OffsetPath;
pub use outline::Outline;
pub use path::Path;
pub use stitch::Stitch;
pub use streamlines::Streamlines;

use shibo_node::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Paths",
        doc: "Curves on the canvas in mm: the place along and across them as fields, parallel and mirrored curves, \
              stitches along them, directions that follow them, lines that follow directions, and outlines of fields.",
        kinds: vec![
            Kind::of::<Path>(),
            Kind::of::<Outline>(),
            Kind::of::<OffsetPath>(),
            Kind::of::<MirrorPath>(),
            Kind::of::<HatchPath>(),
            Kind::of::<Stitch>(),
            Kind::of::<FlowFromPaths>(),
            Kind::of::<Streamlines>(),
        ],
    }
}
