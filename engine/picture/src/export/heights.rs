//! Files that are made of a height once all of its rows are known: films, greys for a laser, level lines; and of meshes.
//!
//! The height is held in memory, 4 bytes a sample. For bodies, large heights lie in a temporary file.
use super::bundle::ExportContext;
use super::set;
use super::spool::Spool;
use crate::value::Field;
use crate::value::diagnostics::{Code, Problem};
use crate::{AtomicFile, Compression, WriteError, WriteStats};
use glam::{DVec2, UVec2};
use shibo_kernel::body::Rows;
use std::fmt;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Bytes of buffers of files.
const BUFFER: usize = 1 << 16;

/// Files of a height before its rows are computed.
#[derive(Clone, Debug)]
pub struct Heights {
    /// The height in mm; `None` for files that are made of none.
    pub field: Option<Field>,
    pub(super) place: ExportContext,
    pub(super) maker: Arc<dyn Maker>,
}

/// Returns true if the work is to stop.
pub(super) type Stop<'a> = &'a (dyn Fn() -> bool + Sync);

/// Makes the files of a height.
pub(super) trait Maker: fmt::Debug + Send + Sync {
    /// The names of the files.
    fn names(&self) -> Vec<String>;

    /// True if the heights are to be kept in [`HeightMap::spool`], which takes little memory.
    fn spools(&self) -> bool {
        false
    }

    /// The complete files, without their names. Long work ends soon after `stop` returns true.
    ///
    /// # Errors
    /// The height does not suit the files, the system refuses, or the work was stopped (an interrupted system call).
    fn make(&self, map: &HeightMap, folder: &Path, stop: Stop<'_>) -> Result<Vec<Part>, WriteError>;
}

/// A file without its name.
pub(super) enum Part {
    /// A file that refers to no others.
    File(AtomicFile),
    /// A file that refers to others.
    Document(AtomicFile),
    /// Figures of the main file, for the user.
    Note(String),
    /// A warning about the height.
    Advice(Problem),
}

impl Part {
    /// A document with this text.
    pub(super) fn document(path: &Path, text: &str) -> Result<Self, WriteError> {
        text_file(path, text).map(Self::Document)
    }
}

/// A file with this text, without its name.
fn text_file(path: &Path, text: &str) -> Result<AtomicFile, WriteError> {
    file_of(path, |out| out.write_all(text.as_bytes()))
}

/// A file that `write` fills through a buffer, without its name.
pub(super) fn file_of(
    path: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<AtomicFile, WriteError> {
    let filled = AtomicFile::create(path).and_then(|file| {
        let mut out = BufWriter::with_capacity(BUFFER, file);
        write(&mut out)?;
        out.into_inner().map_err(io::IntoInnerError::into_error)
    });
    filled.map_err(|error| WriteError::at(path, error))
}

/// A height with all of its samples.
#[derive(Debug)]
pub(super) struct HeightMap {
    /// Samples across and down.
    pub size: UVec2,
    /// Size of a sample in mm.
    pub pixel: DVec2,
    /// The canvas in mm.
    pub size_mm: DVec2,
    /// Directions in which the height repeats.
    pub wraps: [bool; 2],
    /// Heights in mm, row by row.
    pub values: Vec<f32>,
    /// The heights instead of `values`, for makers that want them so.
    pub spool: Option<Spool>,
    pub compression: Compression,
    /// Metadata for headers.
    pub metadata: Vec<(String, String)>,
    /// The warnings about the heights, for reports.
    pub findings: Vec<Problem>,
}

impl HeightMap {
    /// A row of samples.
    pub(super) fn row(&self, y: u32) -> &[f32] {
        &self.values[y as usize * self.size.x as usize..][..self.size.x as usize]
    }

    /// The heights, wherever they are kept.
    pub(super) fn rows(&self) -> &dyn Rows {
        self.spool.as_ref().map_or(&self.values, |spool| spool)
    }

    /// The least and the greatest height.
    pub(super) fn range(&self) -> (f64, f64) {
        let (least, greatest) =
            self.values.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
        (f64::from(least), f64::from(greatest))
    }

    /// The middle of the lowest sample in mm, and its height.
    pub(super) fn lowest(&self) -> (DVec2, f64) {
        let (mut at, mut least) = (0, f32::INFINITY);
        for (k, v) in self.values.iter().enumerate() {
            if *v < least {
                (at, least) = (k, *v);
            }
        }
        let width = self.size.x as usize;
        let place = DVec2::new((at % width) as f64 + 0.5, (at / width) as f64 + 0.5) * self.pixel;
        (place, f64::from(least))
    }
}

/// The error of a height that does not suit a file.
pub(super) fn refused(code: Code, message: impl Into<String>, help: impl Into<String>) -> WriteError {
    WriteError::Unfit(Box::new(Problem::new(code, message).help(help)))
}

/// The error of a height that does not suit an option of its output.
pub(super) fn refused_at(option: &str, code: Code, message: impl Into<String>, help: impl Into<String>) -> WriteError {
    WriteError::Unfit(Box::new(Problem::new(code, message).at(option).help(help)))
}

/// A number for messages and names, with at most four digits after the point.
pub(super) fn told(value: f64) -> String {
    let text = format!("{value:.4}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// A place for messages.
pub(super) fn place(at: DVec2) -> String {
    format!("({:.2}, {:.2}) mm", at.x, at.y)
}

/// The files of a height while its rows are computed. Dropping the writer leaves no files.
#[derive(Debug)]
pub struct HeightsWriter {
    maker: Arc<dyn Maker>,
    folder: PathBuf,
    map: HeightMap,
    made: Option<(Vec<AtomicFile>, Vec<AtomicFile>)>,
    told: Told,
}

/// Texts for the user about finished files.
#[derive(Clone, Debug, Default)]
pub struct Told {
    /// Figures of the main file.
    pub note: Option<String>,
    /// Warnings.
    pub advice: Vec<Problem>,
}

impl HeightsWriter {
    /// Starts files of a height of `size` samples in `folder`.
    pub(super) fn new(heights: &Heights, folder: &Path, size: UVec2, compression: Compression) -> Self {
        let place = heights.place.clone();
        let size = if heights.field.is_some() { size } else { UVec2::ZERO };
        let main = heights.maker.names().into_iter().next().unwrap_or_default();
        let spool = heights.maker.spools().then(|| Spool::new(&folder.join(main)));
        let held = if spool.is_some() { 0 } else { size.x as usize * size.y as usize };
        let map = HeightMap {
            size,
            pixel: place.size_mm / size.max(UVec2::ONE).as_dvec2(),
            size_mm: place.size_mm,
            wraps: place.wraps,
            values: Vec::with_capacity(held),
            spool,
            compression,
            metadata: place.metadata,
            findings: Vec::new(),
        };
        Self { maker: Arc::clone(&heights.maker), folder: folder.to_owned(), map, made: None, told: Told::default() }
    }

    /// Adds rows.
    ///
    /// # Errors
    /// The heights lie in a temporary file, and the system refuses.
    pub(super) fn add(&mut self, planes: &[&[f32]]) -> Result<(), WriteError> {
        let heights = planes.first().copied().unwrap_or_default();
        let Some(spool) = &mut self.map.spool else {
            self.map.values.extend_from_slice(heights);
            return Ok(());
        };
        let added = spool.add_heights(heights);
        added.map_err(|error| WriteError::at(&self.folder, error))
    }

    /// Makes the files, without their names; `findings` are the warnings about the heights.
    pub(super) fn complete(&mut self, findings: Vec<Problem>, stop: Stop<'_>) -> Result<(), WriteError> {
        self.map.findings = findings;
        let found = self.map.spool.as_ref().map_or(self.map.values.len(), Spool::heights);
        let size = self.map.size;
        if found != size.x as usize * size.y as usize {
            let end = u32::try_from(found / size.x.max(1) as usize).unwrap_or(u32::MAX);
            return Err(WriteError::Rows { first: 0, end, height: size.y });
        }
        let (mut files, mut documents) = (Vec::new(), Vec::new());
        for part in self.maker.make(&self.map, &self.folder, stop)? {
            match part {
                Part::File(file) => files.push(file),
                Part::Document(file) => documents.push(file),
                Part::Note(note) => self.told.note = Some(note),
                Part::Advice(advice) => self.told.advice.push(advice),
            }
        }
        (self.map.values, self.map.spool) = (Vec::new(), None);
        self.made = Some((files, documents));
        Ok(())
    }

    /// Texts about the files that were made.
    pub(super) fn told(&self) -> Told {
        self.told.clone()
    }

    /// Gives the files their names.
    pub(super) fn finish(mut self) -> Result<Vec<WriteStats>, WriteError> {
        if self.made.is_none() {
            self.complete(Vec::new(), &|| false)?;
        }
        let (files, documents) = self.made.unwrap_or_default();
        set::commit(files, documents).map(|()| Vec::new())
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A height of `width` columns on pixels of 1 mm.
    pub(in super::super) fn map(width: u32, values: &[f32]) -> HeightMap {
        let size = UVec2::new(width, u32::try_from(values.len()).unwrap() / width);
        HeightMap {
            size,
            pixel: DVec2::ONE,
            size_mm: size.as_dvec2(),
            wraps: [false; 2],
            values: values.to_vec(),
            spool: None,
            compression: Compression::Fast,
            metadata: Vec::new(),
            findings: Vec::new(),
        }
    }

    /// The error of files that are refused.
    pub(in super::super) fn problem(made: Result<Vec<Part>, WriteError>) -> Problem {
        match made {
            Err(WriteError::Unfit(problem)) => *problem,
            Err(other) => panic!("{other}"),
            Ok(_) => panic!("it worked"),
        }
    }

    #[test]
    fn numbers_in_messages_are_short() {
        assert_eq!([0.25, -0.000_01, 3.0, 0.123_456].map(told), ["0.25", "0", "3", "0.1235"]);
    }
}
