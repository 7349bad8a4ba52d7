//! Export to files that hold more than one picture: materials on a mesh as glTF, OBJ or USD, MaterialX documents, and
//! picture sets for a program.
mod archive;
mod bundle;
mod colors;
mod directions;
mod glb;
mod gltf;
mod materialx;
mod names;
mod network;
mod obj;
mod preset;
mod set;
mod shape;
mod solids;
mod usd;

pub use bundle::{Bundle, BundleWriter, ExportContext, Map};
pub use colors::Colors;
pub use glb::GlbWriter;
pub use gltf::{Exported, Texture};
pub use materialx::materialx;
pub use network::Shading;
pub use obj::obj;
pub use preset::{Program, preset, y_down};
pub use shape::Shape;
pub use solids::SimpleShape;
pub use usd::usd;

use crate::value::Field;

/// A bundle of one picture from up to four fields of numbers from 0 to 1: red, green, blue and opacity. Missing colours
/// are 0.
pub fn pack(fields: [Option<Field>; 4], place: &ExportContext) -> Bundle {
    let [r, g, b, a] = fields;
    let colors = [r, g, b].map(|field| field.unwrap_or_else(|| Field::constant(crate::value::Type::Gray, &[0.0])));
    bundle::packed(colors.into_iter().chain(a).collect(), place)
}
