//! The pictures that a render computes, and the files that it makes of them.
use super::plan::Planned;
use crate::export::{Bundle, Exported, Shape};
use crate::picture::MipFilter;
use crate::value::{Field, Segments};
use std::path::PathBuf;
use std::sync::Arc;

/// A picture that must be computed.
pub(super) struct Job<'g> {
    pub(super) planned: Planned<'g>,
    /// Names of the file's channels, and the fields that they come from.
    pub(super) fields: Vec<(String, Field)>,
    /// What is written as lines instead.
    pub(super) lines: Option<Arc<Segments>>,
    /// How many of the fields, the last ones, are no channels of the file but needed for its mip levels.
    pub(super) beyond: usize,
    /// What makes the mip levels; empty without.
    pub(super) mips: Vec<MipFilter>,
    /// What is made for another program, whose textures are the fields.
    pub(super) files: Option<Files>,
}

/// What a job makes besides a picture of its fields.
pub(super) enum Files {
    /// A glTF file: the material and the mesh.
    Glb(Box<(Exported, Shape)>),
    /// Several files.
    Bundle(Bundle),
}

/// The files that jobs and copies from the cache make, in the order in which they were planned.
pub(super) fn files(planned: &[PathBuf], jobs: &[Job<'_>]) -> Vec<PathBuf> {
    let made = |path: &PathBuf| {
        let job = jobs.iter().find(|job| job.planned.path == *path);
        match job.and_then(|job| job.files.as_ref()) {
            Some(Files::Bundle(bundle)) => bundle.files().map(|file| path.with_file_name(file)).collect(),
            Some(Files::Glb(export)) if export.0.apart.is_some() => {
                export.0.files().map(|file| path.with_file_name(file)).collect()
            }
            _ => vec![path.clone()],
        }
    };
    planned.iter().flat_map(made).collect()
}
