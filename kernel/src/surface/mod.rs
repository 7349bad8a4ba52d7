//! Heights as surfaces: normals, occlusion, lit relief.

pub mod layers;
pub mod normal;
pub mod occlusion;
pub mod relief;
pub mod wear;
