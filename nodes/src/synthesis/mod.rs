//! Exemplar synthesis: any amount of texture from a small picture, transformed by a field of Jacobians.
//!
//! Source: JP5149288B2 (anisometric synthesis, rows C1 to C17 and C27 to C34), and the published work on parallel
//! controllable synthesis and appearance space. Synthesis finds coordinates; afterwards they are used to sample any
//! number of aligned pictures.
mod analysis;
mod appearance_space;
mod candidate_sets;
mod coords_from_field;
mod coords_to_field;
mod correct_coords;
mod detect_lattice;
mod exemplar;
mod indirection_map;
mod inputs;
mod jacobian_from_angle_scale;
mod jacobian_from_mesh;
mod jacobian_from_vectors;
mod jacobian_from_warp;
mod jacobian_multiply;
mod jitter_coords;
mod magnify_coords;
mod patent;
mod patent_surface;
mod sample_exemplar;
mod sampled;
mod stages;
mod start_coords;
mod surface_inputs;
mod surface_stages;
#[cfg(test)]
mod surface_tests;
mod synthesize;
mod synthesize_surface;
mod upsample_coords;

pub use appearance_space::AppearanceSpace;
pub use candidate_sets::CandidateSets;
pub use coords_from_field::CoordsFromField;
pub use coords_to_field::CoordsToField;
pub use correct_coords::CorrectCoords;
pub use detect_lattice::DetectLattice;
pub use exemplar::Exemplar;
pub use indirection_map::IndirectionMap;
pub use jacobian_from_angle_scale::JacobianFromAngleScale;
pub use jacobian_from_mesh::JacobianFromMesh;
pub use jacobian_from_vectors::JacobianFromVectors;
pub use jacobian_from_warp::JacobianFromWarp;
pub use jacobian_multiply::JacobianMultiply;
pub use jitter_coords::JitterCoords;
pub use magnify_coords::MagnifyCoords;
pub use sample_exemplar::SampleExemplar;
pub use start_coords::StartCoords;
pub use synthesize::Synthesize;
pub use synthesize_surface::SynthesizeSurface;
pub use upsample_coords::UpsampleCoords;

use shibo_node::registry::{Family, Kind};

/// The nodes of this family.
pub fn family() -> Family {
    Family {
        name: "Exemplar synthesis",
        doc: "From a small picture of anything to any amount of it: exemplars, coordinates, and what they show.",
        kinds: vec![
            Kind::of::<Exemplar>(),
            Kind::of::<AppearanceSpace>(),
            Kind::of::<CandidateSets>(),
            Kind::of::<DetectLattice>(),
            Kind::of::<JacobianFromAngleScale>(),
            Kind::of::<JacobianFromVectors>(),
            Kind::of::<JacobianFromWarp>(),
            Kind::of::<JacobianFromMesh>(),
            Kind::of::<JacobianMultiply>(),
            Kind::of::<StartCoords>(),
            Kind::of::<UpsampleCoords>(),
            Kind::of::<JitterCoords>(),
            Kind::of::<CorrectCoords>(),
            Kind::of::<Synthesize>(),
            Kind::of::<SynthesizeSurface>(),
            Kind::of::<SampleExemplar>(),
            Kind::of::<MagnifyCoords>(),
            Kind::of::<CoordsToField>(),
            Kind::of::<CoordsFromField>(),
            Kind::of::<IndirectionMap>(),
        ],
    }
}
