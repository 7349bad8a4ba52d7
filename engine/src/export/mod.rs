//! Files for other programs that hold more than a picture: materials on a mesh as glTF.
mod glb;
mod gltf;
mod shape;

pub use glb::GlbWriter;
pub use gltf::{Exported, Texture};
pub use shape::Shape;
