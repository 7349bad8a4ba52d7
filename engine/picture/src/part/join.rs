//! Joins parts into pictures, a few rows at a time.
use super::read::{PartFile, Unusable};
use super::{CHUNK, Chunk, EXTENSION, PartHeader, PartOf, names};
use crate::spec::{Format, WriteError};
use crate::{AtomicFile, PictureSpec, WriteStats, Writer};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::SystemTime;

/// Memory for joining one picture: twice a band before and after compression.
const PICTURE: u64 = 6 * CHUNK as u64;
/// Maximum number of missing parts that are reported.
const TOLD: usize = 1000;

/// The files that were written.
#[derive(Clone, Debug, PartialEq)]
pub struct Joined {
    /// In the order of the graph's outputs.
    pub files: Vec<JoinedFile>,
    /// The files of the parts.
    pub parts: Vec<JoinedPart>,
}

/// A file that is not needed any more.
#[derive(Clone, Debug, PartialEq)]
pub struct JoinedPart {
    path: PathBuf,
    /// The modification time and the length.
    state: Option<(SystemTime, u64)>,
}

impl JoinedPart {
    /// Removes the file, unless it has been replaced. A failure is ignored.
    pub fn remove(&self) {
        if self.state.is_some() && state(&self.path) == self.state {
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

/// The modification time and length of a file; `None` for a link or a folder.
fn state(path: &Path) -> Option<(SystemTime, u64)> {
    let file = std::fs::symlink_metadata(path).ok().filter(std::fs::Metadata::is_file)?;
    Some((file.modified().ok()?, file.len()))
}

/// A joined file.
#[derive(Clone, Debug, PartialEq)]
pub struct JoinedFile {
    /// Its path.
    pub path: PathBuf,
    /// The statistics of its samples, if it has any.
    pub written: Option<WriteStats>,
    /// Values that the least and the greatest integer stand for.
    pub range: (f32, f32),
}

/// The reason why parts were not joined. In that case nothing was written.
#[derive(Debug, thiserror::Error)]
pub enum JoinError {
    /// The faults of the parts, one line each.
    #[error("{}", .0.join("\n"))]
    Parts(Vec<String>),
    /// The folder of the parts cannot be read.
    #[error("the folder `{dir}` cannot be read: {source}")]
    Folder {
        /// The folder.
        dir: String,
        /// The error of the system.
        source: std::io::Error,
    },
    /// A picture cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// The work was cancelled.
    #[error("cancelled")]
    Cancelled,
}

/// Joins the parts in the folder `from` into pictures in the folder `to`, using about `memory` bytes. `progress` gets
/// the number of bytes read so far and the total; if it returns false, the work is cancelled.
///
/// # Errors
/// Missing, repeated, damaged or foreign parts, and errors of the system. Nothing is written in that case.
pub fn join(
    from: &Path,
    to: &Path,
    memory: u64,
    progress: &(dyn Fn(u64, u64) -> bool + Sync),
) -> Result<Joined, JoinError> {
    let parts = complete(from)?;
    let Some(header) = parts.first().map(|part| part.header.clone()) else { return Err(nothing(from)) };
    let total = parts.iter().flat_map(|part| &part.index.chunks).map(|chunk| chunk.length).sum();
    let all = All { parts: &parts, to, done: AtomicU64::new(0), total, progress };
    let rows = header.pictures.iter().filter_map(|p| p.spec.as_ref()).map(|spec| spec.row_bytes()).max().unwrap_or(0);
    let threads = rayon::current_num_threads() as u64;
    let at_once = usize::try_from(memory / PICTURE.max(rows * 64 * threads)).unwrap_or(usize::MAX).max(1);
    let mut made = Vec::with_capacity(header.pictures.len());
    let numbers: Vec<usize> = (0..header.pictures.len()).collect();
    for group in numbers.chunks(at_once) {
        let group: Vec<Result<Made, Fault>> = group.par_iter().map(|&number| all.picture(&header, number)).collect();
        for one in group {
            made.push(one.map_err(|fault| all.explained(fault))?);
        }
    }
    let mut files = Vec::with_capacity(made.len());
    for Made { file, written, range } in made {
        let path = file.target().to_path_buf();
        file.commit().map_err(|error| WriteError::at(&path, error))?;
        files.push(JoinedFile { path, written, range });
    }
    let parts = parts.iter().map(|part| JoinedPart { path: part.path.clone(), state: part.state });
    Ok(Joined { files, parts: parts.collect() })
}

/// A complete file without its final name.
struct Made {
    file: AtomicFile,
    written: Option<WriteStats>,
    range: (f32, f32),
}

enum Fault {
    /// A faulty part, and the reason.
    Part(String),
    Write(WriteError),
    Cancelled,
}

impl From<WriteError> for Fault {
    fn from(error: WriteError) -> Self {
        Self::Write(error)
    }
}

struct All<'a> {
    parts: &'a [PartFile],
    to: &'a Path,
    done: AtomicU64,
    total: u64,
    progress: &'a (dyn Fn(u64, u64) -> bool + Sync),
}

impl All<'_> {
    fn picture(&self, header: &PartHeader, number: usize) -> Result<Made, Fault> {
        let picture = &header.pictures[number];
        let path = self.to.join(&picture.file);
        match &picture.spec {
            Some(spec) => self.rows(&path, spec, number),
            None => {
                let mut file = AtomicFile::create(&path).map_err(|error| WriteError::at(&path, error))?;
                let mut begun = None;
                self.chunks(number, None, |_, bytes| {
                    begun.get_or_insert_with(|| names::is_drawing(bytes));
                    file.write_all(bytes).map_err(|error| WriteError::at(&path, error))
                })?;
                if begun != Some(true) {
                    let reason = format!("names a file {:?}, whose content is something else", picture.file);
                    return Err(self.parts.first().map_or(Fault::Cancelled, |part| bad(part, &reason)));
                }
                Ok(Made { file, written: None, range: (0.0, 1.0) })
            }
        }
    }

    fn rows(&self, path: &Path, spec: &PictureSpec, number: usize) -> Result<Made, Fault> {
        let mut writer = Writer::create(path, spec)?;
        self.chunks(number, Some(spec), |rows, bytes| writer.write_encoded(bytes, rows))?;
        self.parts.iter().for_each(|part| writer.count(part.index.tallies[number]));
        let (file, written) = writer.finish_unnamed()?;
        Ok(Made { file, written: Some(written), range: spec.encoding.range.unwrap_or((0.0, 1.0)) })
    }

    /// Passes the rows of a picture to `take`, from all parts in order; for a picture without rows, all its bytes.
    fn chunks(
        &self,
        number: usize,
        spec: Option<&PictureSpec>,
        mut take: impl FnMut(u32, &[u8]) -> Result<(), WriteError>,
    ) -> Result<(), Fault> {
        let (mut bytes, mut rows) = (Vec::new(), Vec::new());
        for part in self.parts {
            let mut file = File::open(&part.path).map_err(|e| bad(part, &format!("cannot be read: {e}")))?;
            for beside in part.chunks(number).chunk_by(|a, b| spec.is_some() && a.row == b.row) {
                for chunk in beside {
                    part.read(&mut file, chunk, &mut bytes).map_err(|reason| bad(part, &reason))?;
                    if let Some(spec) = spec.filter(|_| beside.len() > 1) {
                        put(spec, chunk, &bytes, &mut rows);
                    }
                }
                take(beside[0].rows, if beside.len() > 1 { &rows } else { &bytes })?;
                let read: u64 = beside.iter().map(|chunk| chunk.length).sum();
                let done = self.done.fetch_add(read, Ordering::Relaxed) + read;
                if !(self.progress)(done, self.total) {
                    return Err(Fault::Cancelled);
                }
            }
        }
        Ok(())
    }

    /// After the first damaged part: checks all parts and reports every damaged one.
    fn explained(&self, fault: Fault) -> JoinError {
        let first = match fault {
            Fault::Part(first) => first,
            Fault::Write(error) => return JoinError::Write(error),
            Fault::Cancelled => return JoinError::Cancelled,
        };
        let check = |part: &PartFile| {
            let mut file = File::open(&part.path).ok()?;
            let mut bytes = Vec::new();
            let reason = part.index.chunks.iter().find_map(|chunk| part.read(&mut file, chunk, &mut bytes).err())?;
            Some(named(&part.header, &part.path, &reason))
        };
        let found: Vec<String> = self.parts.par_iter().filter_map(check).collect();
        JoinError::Parts(if found.is_empty() { vec![first] } else { found })
    }
}

/// Copies a block of columns into whole rows.
fn put(spec: &PictureSpec, chunk: &Chunk, block: &[u8], rows: &mut Vec<u8>) {
    // Runs of samples that are contiguous in the file: pixels, or one of several planes in a row.
    let planes = if spec.format == Format::Exr { spec.channels.len() } else { 1 };
    let sample = spec.channels.len() * spec.depth.bytes() / planes;
    let (wide, whole) = (chunk.width as usize * sample, spec.width as usize * sample);
    rows.resize(whole * planes * chunk.rows as usize, 0);
    for (to, from) in rows.chunks_exact_mut(whole).zip(block.chunks_exact(wide)) {
        to[chunk.x as usize * sample..][..wide].copy_from_slice(from);
    }
}

fn bad(part: &PartFile, reason: &str) -> Fault {
    Fault::Part(named(&part.header, &part.path, reason))
}

fn named(header: &PartHeader, path: &Path, reason: &str) -> String {
    format!("part {} (`{}`) {reason}", header.part, path.display())
}

fn nothing(dir: &Path) -> JoinError {
    let made = "make some with `shibo render GRAPH --part 1/N -o DIR`";
    JoinError::Parts(vec![format!("there are no parts in `{}`; {made}", dir.display())])
}

/// All parts in a folder, in order, if none is missing or faulty.
fn complete(dir: &Path) -> Result<Vec<PartFile>, JoinError> {
    let failed = |source| JoinError::Folder { dir: dir.display().to_string(), source };
    let mut paths = Vec::new();
    for entry in dir.read_dir().map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let hidden = path.file_name().is_none_or(|name| name.as_encoded_bytes().starts_with(b"."));
        if !hidden && path.extension().is_some_and(|extension| extension == EXTENSION) {
            paths.push(path);
        }
    }
    paths.sort();
    let mut bad = Vec::new();
    let mut seen = Vec::new();
    let mut whole: Vec<PartFile> = Vec::new();
    for path in paths {
        match PartFile::open(&path) {
            Ok(part) => whole.push(part),
            Err(Unusable { reason, header }) => {
                // The header itself may be damaged, so the name of the file takes precedence.
                let part = numbers(&path).or(header.map(|header| header.part));
                let name = part.map_or("the file".to_owned(), |part| format!("part {part}"));
                bad.push(format!("{name} (`{}`) {reason}", path.display()));
                seen.extend(part);
            }
        }
    }
    let Some(usual) = usual(&whole) else {
        return Err(if bad.is_empty() { nothing(dir) } else { JoinError::Parts(bad) });
    };
    let (fitting, others): (Vec<_>, Vec<_>) =
        whole.into_iter().partition(|part| differs(&part.header, &usual).is_none());
    for other in &others {
        let difference = differs(&other.header, &usual).unwrap_or_default();
        bad.push(named(&other.header, &other.path, &difference));
        seen.push(other.header.part);
    }
    let parts = one_each(fitting, &usual, &seen, &mut bad);
    if bad.is_empty() { Ok(parts) } else { Err(JoinError::Parts(bad)) }
}

/// The parts by number; reports parts that are repeated or missing.
fn one_each(fitting: Vec<PartFile>, usual: &PartHeader, seen: &[PartOf], bad: &mut Vec<String>) -> Vec<PartFile> {
    let mut by_number: BTreeMap<u32, PartFile> = BTreeMap::new();
    for part in fitting {
        let of = part.header.part;
        if let Some(other) = by_number.get(&of.number) {
            let both = (other.path.display(), part.path.display());
            bad.push(format!("part {of} is there twice: `{}` and `{}`; remove one of them", both.0, both.1));
        } else {
            by_number.insert(of.number, part);
        }
    }
    let known = |number: &u32| by_number.contains_key(number) || seen.iter().any(|of| of.number == *number);
    let missing: Vec<u32> = (1..=usual.part.count).filter(|number| !known(number)).take(TOLD).collect();
    bad.extend(missing.iter().map(|number| format!("part {number}/{} is missing", usual.part.count)));
    let mut row = 0;
    for part in by_number.values() {
        let [first, rows] = part.header.rows;
        let follows = first == row || !missing.is_empty() || !seen.is_empty();
        if !follows || (part.header.part.number == usual.part.count && first.checked_add(rows) != Some(usual.size[1])) {
            bad.push(named(&part.header, &part.path, "has other rows than its number says"));
        }
        row = first.saturating_add(rows);
    }
    by_number.into_values().collect()
}

/// The header that most parts agree on.
fn usual(parts: &[PartFile]) -> Option<PartHeader> {
    let like = |one: &PartFile| parts.iter().filter(|other| differs(&other.header, &one.header).is_none()).count();
    let mut best: Option<(usize, &PartFile)> = None;
    for part in parts {
        let count = like(part);
        if best.is_none_or(|(most, _)| count > most) {
            best = Some((count, part));
        }
        if count * 2 > parts.len() {
            break;
        }
    }
    best.map(|(_, part)| part.header.clone())
}

/// The difference between a part and the usual header, as the end of a sentence.
fn differs(header: &PartHeader, usual: &PartHeader) -> Option<String> {
    let unless = |same: bool, text: String| if same { None } else { Some(text) };
    let (a, b) = (header, usual);
    let version = || if a.version == b.version { "another build".to_owned() } else { format!("version {}", a.version) };
    unless(a.version == b.version && a.build == b.build, format!("was made by {} of Shibo", version()))
        .or_else(|| unless(a.graph == b.graph, format!("is of another graph: `{}`, not `{}`", a.graph, b.graph)))
        .or_else(|| unless(a.seed == b.seed, format!("is of another seed: {}, not {}", a.seed, b.seed)))
        .or_else(|| {
            let [[w, h], [x, y]] = [a.size, b.size];
            unless(a.size == b.size, format!("is of another size: {w} × {h}, not {x} × {y}"))
        })
        .or_else(|| {
            unless(a.part.count == b.part.count, format!("is one of {}, not of {}", a.part.count, b.part.count))
        })
        .or_else(|| {
            let text = format!("is of other parameters: {}, not {}", a.parameters, b.parameters);
            unless(a.parameters == b.parameters, text)
        })
        .or_else(|| {
            let files = |header: &PartHeader| header.pictures.iter().map(|p| p.file.clone()).collect::<Vec<_>>();
            unless(
                files(a) == files(b),
                format!("is of other outputs: {}, not {}", files(a).join(", "), files(b).join(", ")),
            )
        })
        .or_else(|| {
            let text = "is of the graph as it was at another time, or was encoded in another way; render it again";
            unless(a.pictures == b.pictures, text.into())
        })
}

/// Reads the number of a part from its file name.
fn numbers(path: &Path) -> Option<PartOf> {
    let (_, place) = path.file_stem()?.to_str()?.rsplit_once('.')?;
    let (number, count) = place.split_once("-of-")?;
    Some(PartOf { number: number.parse().ok()?, count: count.parse().ok()? })
}
