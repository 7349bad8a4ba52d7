//! Heights as surfaces: normals, occlusion, lit relief.

pub mod normal;
pub mod occlusion;
pub mod relief;
