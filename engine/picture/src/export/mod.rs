//! Export to files that hold more than one picture: materials on a mesh as glTF, OBJ or USD, MaterialX documents, and
//! picture sets for a program.
mod archive;
mod body;
mod bundle;
mod colors;
mod contours;
mod decl;
mod directions;
mod engrave;
mod films;
mod glb;
mod gltf;
mod gltf_target;
mod heights;
mod lines;
mod materialx;
mod model;
mod names;
mod network;
mod obj;
mod pack;
mod plate;
mod preset;
mod roll;
mod set;
mod shape;
mod solids;
mod spool;
mod target;
mod usd;

pub use bundle::{Bundle, BundleWriter, ExportContext, Map};
pub use colors::Colors;
pub use decl::{FieldDecl, NumberForm, Numbers, Takes, names};
pub use glb::GlbWriter;
pub use gltf::{Exported, Texture};
pub use heights::{Heights, Told};
pub use preset::y_down;
pub use shape::Shape;
pub use solids::SimpleShape;
pub use target::{
    Chosen, ExportTarget, Files, FilesWriter, OptionValue, Options, Plan, Source, TargetInfo, Variant, target_named,
};

/// All targets.
pub const TARGETS: &[&dyn ExportTarget] = &[
    &gltf_target::Gltf,
    &obj::Obj,
    &materialx::MaterialX,
    &usd::Usd,
    &preset::Preset,
    &pack::Pack,
    &films::Films,
    &engrave::Engrave,
    &contours::Contours,
    &plate::Plate,
    &roll::Roll,
    &model::Model,
];
