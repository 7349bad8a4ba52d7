//! Pictures of integers whose range is that of their values: the least becomes 0, the greatest the highest integer.
use super::plan::Planned;
use crate::picture::{PictureSpec, WriteError, WriteStats, Writer};
use std::path::PathBuf;

/// A picture that is encoded when all of its values are known. Until then they are held in memory.
pub(super) struct Fitted {
    path: PathBuf,
    spec: PictureSpec,
    is_height: bool,
    planes: Vec<Vec<f32>>,
    writer: Option<Writer>,
}

impl Fitted {
    pub(super) fn new(planned: &Planned<'_>, spec: PictureSpec) -> Self {
        let planes = vec![Vec::new(); spec.planes()];
        Self { path: planned.path.clone(), spec, is_height: planned.is_height, planes, writer: None }
    }

    /// Adds rows.
    pub(super) fn add(&mut self, planes: &[&[f32]]) {
        self.planes.iter_mut().zip(planes).for_each(|(all, rows)| all.extend_from_slice(rows));
    }

    /// Writes the file, without its name.
    ///
    /// # Errors
    /// If the system refuses.
    pub(super) fn complete(&mut self) -> Result<(), WriteError> {
        let values = self.planes.iter().flatten();
        let (least, greatest) = values.fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
        // A field with one value has no range; any other end gives the least integer.
        let greatest = if least < greatest { greatest } else { least + least.abs().max(1.0) };
        self.spec.encoding.range = Some((least, greatest));
        if self.is_height {
            self.spec.metadata.push(("shibo:height_mm".to_owned(), format!("{least} {greatest}")));
        }
        let mut writer = Writer::create(&self.path, &self.spec)?;
        let planes: Vec<&[f32]> = self.planes.iter().map(Vec::as_slice).collect();
        writer.write_rows(&planes, self.spec.height)?;
        self.planes = Vec::new();
        self.writer = Some(writer);
        Ok(())
    }

    /// Gives the file its name.
    ///
    /// # Errors
    /// If rows are missing or the system refuses.
    pub(super) fn finish(mut self) -> Result<Vec<WriteStats>, WriteError> {
        if self.writer.is_none() {
            self.complete()?;
        }
        self.writer.map_or(Ok(Vec::new()), |writer| writer.finish().map(|written| vec![written]))
    }
}
