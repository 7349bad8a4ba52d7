//! Heights as surfaces: normals, curvature, edges, occlusion, lit relief; and heights from normals.

pub mod combine_normals;
pub mod curvature;
pub mod display;
pub mod envelope;
pub mod environment;
pub mod inflate;
pub mod layers;
pub mod normal;
pub mod occlusion;
pub mod poisson;
pub mod profile;
pub mod relief;
mod shading;
pub mod view;
pub mod wear;
