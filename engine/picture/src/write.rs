//! Writing pictures band by band.

use super::atomic::AtomicFile;
use super::encode::{RowEncoder, Rows, Tally};
use super::spec::{Format, PictureSpec, WriteError};
use super::write_exr::{self, ExrSink};
use super::write_jpeg::JpegSink;
use super::write_png::PngSink;
use super::write_tiff::{self, TiffSink};
use std::io::{self, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// Number of encoded bytes that a format gets at once. This bounds the memory, including that of compression.
const BAND_BYTES: usize = 8 << 20;

/// Statistics of a written picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WriteStats {
    /// Number of samples beyond the range of the depth, which were clipped to the nearest value: for integers, samples
    /// outside by more than half a step, and NaN; for 16-bit floats, finite values beyond ±65504.
    pub clipped: u64,
    /// Number of NaN and infinite samples. Floats store them; integers are clipped, NaN to 0.
    pub non_finite: u64,
    /// The least and greatest sample, without NaN: a range that clips nothing.
    pub range: (f32, f32),
    /// Bytes of the file.
    pub bytes: u64,
}

impl WriteStats {
    /// A message about clipped samples, if there are any: `path` is the file, `range` the values of its least and
    /// greatest integer.
    #[must_use]
    pub fn loss(&self, path: &Path, (low, high): (f64, f64)) -> Option<String> {
        let (Self { clipped, range: (least, greatest), .. }, path) = (self, path.display());
        let what = match clipped {
            1 => format!("1 sample of `{path}` lies outside {low}..{high} and was clipped"),
            _ => format!("{clipped} samples of `{path}` lie outside {low}..{high} and were clipped"),
        };
        let message = format!("{what}; its values are {least}..{greatest}");
        (*clipped > 0).then_some(message)
    }
}

/// A picture file under construction.
///
/// Rows come in bands of any height from y = 0 down. The file appears under its name at [`Writer::finish`]; dropping
/// the writer before leaves no file. Memory is bounded by some 32 MiB, or a few times the 16 or 32 rows that EXR
/// compresses together if these are more.
pub struct Writer {
    spec: PictureSpec,
    path: PathBuf,
    encoder: RowEncoder,
    // Declared before `output`, because a dropped sink may still write to it.
    sink: Sink,
    output: Output,
    next_row: u32,
    tally: Tally,
}

impl std::fmt::Debug for Writer {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter
            .debug_struct("Writer")
            .field("path", &self.path)
            .field("next_row", &self.next_row)
            .finish_non_exhaustive()
    }
}

enum Sink {
    Png(Box<PngSink<Output>>),
    Tiff(Box<TiffSink<Output>>),
    Exr(Box<ExrSink<Output>>),
    Jpeg(Box<JpegSink<Output>>),
    TiledExr(Box<write_exr::TiledSink<Output>>),
    TiledTiff(Box<write_tiff::TiledSink<Output>>),
}

impl Writer {
    /// Starts a file and writes its header.
    ///
    /// # Errors
    /// When the specification contradicts itself ([`PictureSpec::check`]) or the folder cannot be written.
    pub fn create(path: &Path, spec: &PictureSpec) -> Result<Self, WriteError> {
        spec.check()?;
        Self::new(AtomicFile::create(path).map_err(|error| WriteError::at(path, error))?, path, spec)
    }

    /// Writes the header into a new file. The specification is checked.
    fn new(file: AtomicFile, path: &Path, spec: &PictureSpec) -> Result<Self, WriteError> {
        let at = |error| WriteError::at(path, error);
        let output = Output(Arc::new(Mutex::new(Counted { file, position: 0, length: 0 })));
        let sink = match spec.format {
            Format::Png => Sink::Png(Box::new(PngSink::new(output.clone(), spec).map_err(at)?)),
            Format::Tiff if !spec.mips.is_empty() => {
                Sink::TiledTiff(Box::new(write_tiff::TiledSink::new(output.clone(), spec).map_err(at)?))
            }
            Format::Tiff => Sink::Tiff(Box::new(TiffSink::new(output.clone(), spec).map_err(at)?)),
            Format::Exr if !spec.mips.is_empty() => {
                Sink::TiledExr(Box::new(write_exr::TiledSink::new(output.clone(), spec).map_err(at)?))
            }
            Format::Exr => Sink::Exr(Box::new(ExrSink::new(output.clone(), spec).map_err(at)?)),
            Format::Jpeg(quality) => Sink::Jpeg(Box::new(JpegSink::new(output.clone(), spec, quality))),
            // SVG holds no samples; the check has refused it.
            Format::Svg => {
                return Err(WriteError::Depth { format: spec.format, depth: spec.depth, allowed: String::new() });
            }
        };
        let encoder = RowEncoder::new(spec);
        let (spec, path) = (spec.clone(), path.to_path_buf());
        Ok(Self { spec, path, encoder, sink, output, next_row: 0, tally: Tally::default() })
    }

    /// The path that the file will have.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The next expected row.
    #[must_use]
    pub fn next_row(&self) -> u32 {
        self.next_row
    }

    /// Writes the next rows: for every plane ([`PictureSpec::planes`]: the channels of the specification, then planes
    /// for mip filters), `rows` times the width samples.
    ///
    /// # Errors
    /// When the lengths do not fit or the system refuses. Drop the writer then.
    pub fn write_rows(&mut self, planes: &[&[f32]], rows: u32) -> Result<(), WriteError> {
        let (first, height) = (self.next_row, self.spec.height);
        let end = first.saturating_add(rows);
        let samples = rows as usize * self.spec.width as usize;
        if planes.len() != self.spec.planes() || planes.iter().any(|plane| plane.len() != samples) || end > height {
            return Err(WriteError::Rows { first, end, height });
        }
        let step = u32::try_from(self.rows_at_once()).unwrap_or(u32::MAX);
        let mut row = 0;
        while row < rows {
            let count = step.min(rows - row);
            let start = row as usize * self.spec.width as usize;
            let length = count as usize * self.spec.width as usize;
            let part: Vec<&[f32]> = planes.iter().map(|plane| &plane[start..][..length]).collect();
            self.write_part(Rows { planes: &part, first: first + row, count })?;
            row += count;
        }
        self.next_row = end;
        Ok(())
    }

    fn rows_at_once(&self) -> usize {
        // Blocks are compressed in parallel, so there should be one for every thread.
        let block_rows = match &self.sink {
            Sink::Png(_) => 1,
            Sink::Tiff(sink) => sink.rows_per_block() * rayon::current_num_threads(),
            Sink::Exr(sink) => sink.rows_per_block() * rayon::current_num_threads(),
            Sink::Jpeg(sink) => sink.rows_per_block() * rayon::current_num_threads(),
            Sink::TiledExr(_) | Sink::TiledTiff(_) => 1,
        };
        (BAND_BYTES / self.encoder.row_bytes()).max(block_rows)
    }

    fn write_part(&mut self, rows: Rows<'_>) -> Result<(), WriteError> {
        let tally = match &mut self.sink {
            Sink::Png(sink) => sink.write(&self.encoder, rows),
            Sink::Tiff(sink) => sink.write(&self.encoder, rows),
            Sink::Exr(sink) => sink.write(&self.encoder, rows),
            Sink::Jpeg(sink) => sink.write(&self.encoder, rows),
            Sink::TiledExr(sink) => sink.write(rows),
            Sink::TiledTiff(sink) => sink.write(rows),
        };
        self.tally = self.tally.with(tally.map_err(|error| WriteError::at(&self.path, error))?);
        Ok(())
    }

    /// Writes the next rows, already encoded; the caller has counted their samples.
    pub(super) fn write_encoded(&mut self, bytes: &[u8], rows: u32) -> Result<(), WriteError> {
        let (first, end, height) = (self.next_row, self.next_row.saturating_add(rows), self.spec.height);
        if bytes.len() != self.encoder.row_bytes() * rows as usize || end > height {
            return Err(WriteError::Rows { first, end, height });
        }
        let written = match &mut self.sink {
            Sink::Png(sink) => sink.write_encoded(bytes),
            Sink::Tiff(sink) => sink.write_encoded(bytes),
            Sink::Exr(sink) => sink.write_encoded(bytes),
            Sink::Jpeg(sink) => sink.write_encoded(bytes),
            // Smaller levels need samples, which encoded rows do not have.
            Sink::TiledExr(_) | Sink::TiledTiff(_) => Err(io::ErrorKind::Unsupported.into()),
        };
        self.next_row = end;
        written.map_err(|error| WriteError::at(&self.path, error))
    }

    /// Adds to the statistics of the picture.
    pub(super) fn count(&mut self, tally: Tally) {
        self.tally = self.tally.with(tally);
    }

    /// Completes the file and gives it its name.
    ///
    /// # Errors
    /// When rows are missing or the system refuses. Then an existing file is unchanged.
    pub fn finish(self) -> Result<WriteStats, WriteError> {
        let path = self.path.clone();
        let (file, written) = self.finish_unnamed()?;
        file.commit().map_err(|error| WriteError::at(&path, error))?;
        Ok(written)
    }

    /// Completes the file without its final name. Dropping the returned file removes it.
    ///
    /// # Errors
    /// As [`finish`](Self::finish).
    pub(crate) fn finish_unnamed(self) -> Result<(AtomicFile, WriteStats), WriteError> {
        let Self { spec, path, sink, output, next_row, tally, .. } = self;
        if next_row != spec.height {
            return Err(WriteError::Rows { first: 0, end: next_row, height: spec.height });
        }
        let at = |error| WriteError::at(&path, error);
        match sink {
            Sink::Png(sink) => sink.finish().map_err(at)?,
            Sink::Tiff(sink) => sink.finish().map_err(at)?,
            Sink::Exr(sink) => sink.finish().map_err(at)?,
            Sink::Jpeg(sink) => sink.finish().map_err(at)?,
            Sink::TiledExr(sink) => sink.finish().map_err(at)?,
            Sink::TiledTiff(sink) => sink.finish().map_err(at)?,
        }
        let Counted { file, length, .. } = output.into_inner();
        let range = (tally.least, tally.greatest);
        Ok((file, WriteStats { clipped: tally.clipped, non_finite: tally.non_finite, range, bytes: length }))
    }
}

/// A whole picture file in memory. `planes` has the samples of each channel, row by row.
///
/// # Errors
/// When the specification contradicts itself, or the lengths do not fit.
pub fn in_memory(spec: &PictureSpec, planes: &[&[f32]]) -> Result<Vec<u8>, WriteError> {
    spec.check()?;
    let path = Path::new("memory");
    let mut writer = Writer::new(AtomicFile::in_memory(path), path, spec)?;
    writer.write_rows(planes, spec.height)?;
    Ok(writer.finish_unnamed()?.0.into_bytes())
}

/// The samples of a picture as its file stores them, without header and compression.
///
/// # Errors
/// As [`in_memory`].
pub fn encoded_rows(spec: &PictureSpec, planes: &[&[f32]]) -> Result<Vec<u8>, WriteError> {
    spec.check()?;
    let samples = spec.width as usize * spec.height as usize;
    if planes.len() != spec.planes() || planes.iter().any(|plane| plane.len() != samples) {
        return Err(WriteError::Rows { first: 0, end: spec.height, height: spec.height });
    }
    let mut bytes = Vec::new();
    RowEncoder::new(spec).encode(Rows { planes, first: 0, count: spec.height }, &mut bytes);
    Ok(bytes)
}

/// The file, shared between the writer, which commits it, and an encoder that does not return its output.
#[derive(Clone)]
struct Output(Arc<Mutex<Counted>>);

struct Counted {
    file: AtomicFile,
    position: u64,
    length: u64,
}

impl Output {
    fn with<T>(&self, act: impl FnOnce(&mut Counted) -> T) -> T {
        act(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn into_inner(self) -> Counted {
        let mutex = Arc::into_inner(self.0).expect("the sink, the only other owner, is finished");
        mutex.into_inner().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.with(|inner| {
            let written = inner.file.write(bytes)?;
            inner.position += written as u64;
            inner.length = inner.length.max(inner.position);
            Ok(written)
        })
    }

    fn flush(&mut self) -> io::Result<()> {
        self.with(|inner| inner.file.flush())
    }
}

impl Seek for Output {
    fn seek(&mut self, position: SeekFrom) -> io::Result<u64> {
        self.with(|inner| {
            inner.position = inner.file.seek(position)?;
            Ok(inner.position)
        })
    }
}
