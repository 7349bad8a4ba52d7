//! The pictures that a render computes, and the files made of them.
use super::plan::Planned;
use crate::export::Files;
use crate::picture::MipFilter;
use crate::value::{Field, Segments};
use std::path::PathBuf;
use std::sync::Arc;

/// A picture to be computed.
pub(super) struct Job<'g> {
    pub(super) planned: Planned<'g>,
    /// Names of the file's channels, and their fields.
    pub(super) fields: Vec<(String, Field)>,
    /// The segments to write as lines instead of pixels.
    pub(super) lines: Option<Arc<Segments>>,
    /// Number of trailing `fields` that are needed only for the mip levels and are not channels of the file.
    pub(super) beyond: usize,
    /// The mip filters; empty without mip levels.
    pub(super) mips: Vec<MipFilter>,
    /// The files for another program whose textures are `fields`.
    pub(super) files: Option<Files>,
}

impl Job<'_> {
    /// Samples of a pixel.
    pub(super) fn samples(&self) -> usize {
        self.fields.iter().map(|(_, field)| field.channels()).sum()
    }

    /// True if the range of the picture is that of its values.
    pub(super) fn is_fitted(&self) -> bool {
        self.files.is_none() && self.planned.output.storage.fit && self.planned.depth.is_integer()
    }

    /// True if all values are held in memory before files are made of them.
    pub(super) fn is_held(&self) -> bool {
        self.is_fitted() || matches!(&self.files, Some(Files::Heights(heights)) if heights.is_held())
    }
}

/// Paths of the files that jobs write or that are copied from the cache, in planned order.
pub(super) fn files(planned: &[PathBuf], jobs: &[Job<'_>]) -> Vec<PathBuf> {
    let made = |path: &PathBuf| {
        let job = jobs.iter().find(|job| job.planned.path == *path);
        let names = job.and_then(|job| job.files.as_ref()).map(Files::names).unwrap_or_default();
        match names.is_empty() {
            true => vec![path.clone()],
            false => names.into_iter().map(|file| path.with_file_name(file)).collect::<Vec<_>>(),
        }
    };
    planned.iter().flat_map(made).collect()
}
