//! Pictures from files.
#[expect(clippy::module_inception, reason = "a file is named after its node")]
mod image;
mod pixels;
mod sheet;

pub use image::{ColorSpace, Image, Wrap};

use shibo_node::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family { name: "Image", doc: "Pictures from files, placed on the canvas in mm.", kinds: vec![Kind::of::<Image>()] }
}
