//! Stores files with a report about them: warnings, and the number of clipped samples.
//!
//! A file with an empty report lies under its own key. Any other report lies under a second key, and its file under a
//! third key, which is made of the report. If one of the two is lost, the file counts as missing, so no file is found
//! without its warnings.
use crate::eval::{Shelf, Store, Warnings, append_warnings, split_warnings};
use crate::picture::WriteStats;
use crate::value::Key;
use std::io;
use std::path::Path;
use std::time::Duration;

/// The report about a file.
#[derive(Clone, Debug, Default)]
pub(super) struct FileReport {
    /// Warnings of nodes, and of values in tiles.
    pub(super) found: Warnings,
    /// Figures of the pictures in the file.
    pub(super) written: Vec<WriteStats>,
}

impl FileReport {
    /// The report as bytes; none for a report without warnings and clipped samples.
    fn to_bytes(&self) -> Vec<u8> {
        let clipped: Vec<(u64, (f32, f32))> =
            self.written.iter().filter(|stats| stats.clipped > 0).map(|stats| (stats.clipped, stats.range)).collect();
        if clipped.is_empty() && self.found.is_empty() {
            return Vec::new();
        }
        let mut bytes = postcard::to_allocvec(&clipped).unwrap_or_default();
        append_warnings(&mut bytes, &self.found);
        bytes
    }

    /// `None` for bytes that [`Self::to_bytes`] did not make.
    fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (bytes, found) = split_warnings(bytes)?;
        let (clipped, rest) = postcard::take_from_bytes::<Vec<(u64, (f32, f32))>>(bytes).ok()?;
        let stats = |(clipped, range)| WriteStats { clipped, range, non_finite: 0, bytes: 0 };
        rest.is_empty().then(|| Self { found, written: clipped.into_iter().map(stats).collect() })
    }
}

/// The key of the report about a file.
fn of_report(file: Key) -> Key {
    Key::of("report about file", &[file.as_bytes()])
}

/// The key of a file with this report.
fn of_reported(file: Key, report: &[u8]) -> Key {
    Key::of("reported file", &[file.as_bytes(), report])
}

/// Stores the file at `from` with its report under the key `file`; making it again takes `spared` of CPU time.
pub(super) fn put(store: &dyn Store, file: Key, from: &Path, report: &FileReport, spared: Duration) {
    let bytes = report.to_bytes();
    if bytes.is_empty() {
        return store.put_file(file, from, spared);
    }
    store.put(Shelf::Files, of_report(file), &bytes, spared, &|| false);
    store.put_file(of_reported(file, &bytes), from, spared);
}

/// Writes the file under the key `file` to `to`, and returns its report. `None` if something is missing or
/// damaged; `to` is then unchanged.
///
/// # Errors
/// `to` cannot be written.
pub(super) fn get(store: &dyn Store, file: Key, to: &Path) -> io::Result<Option<FileReport>> {
    if store.get_file(file, to)? {
        return Ok(Some(FileReport::default()));
    }
    let Some(bytes) = store.get(Shelf::Files, of_report(file)) else { return Ok(None) };
    let Some(report) = FileReport::from_bytes(&bytes) else { return Ok(None) };
    Ok(store.get_file(of_reported(file, &bytes), to)?.then_some(report))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_back_reports() {
        let stats = |clipped, range| WriteStats { clipped, range, non_finite: 3, bytes: 7 };
        let report =
            FileReport { found: Warnings::default(), written: vec![stats(0, (0.0, 1.0)), stats(5, (-1.5, 2.0))] };
        let bytes = report.to_bytes();
        let read = FileReport::from_bytes(&bytes).unwrap();
        assert_eq!((read.written[0].clipped, read.written[0].range, read.written.len()), (5, (-1.5, 2.0), 1));
        for end in 0..bytes.len() {
            assert!(FileReport::from_bytes(&bytes[..end]).is_none(), "{end}");
        }
        let nothing = FileReport { found: Warnings::default(), written: vec![stats(0, (0.0, 1.0))] };
        assert!(nothing.to_bytes().is_empty());
    }
}
