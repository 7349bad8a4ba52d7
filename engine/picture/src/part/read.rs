//! Reads a part. All content is verified by hashes.
use super::write::block_of;
use super::{CHUNK, Chunk, Index, MAGIC, MOST, PartHeader, hash, names};
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// Number of bytes behind the index.
const END: u64 = 8 + 8 + 32;

/// A part with a valid header and index.
pub(super) struct PartFile {
    pub(super) path: PathBuf,
    pub(super) header: PartHeader,
    pub(super) index: Index,
    /// The modification time and the length of the file.
    pub(super) state: Option<(SystemTime, u64)>,
}

/// The reason why a file is not a part, as the end of a sentence; and its header, if that could be read.
pub(super) struct Unusable {
    pub(super) reason: String,
    pub(super) header: Option<Box<PartHeader>>,
}

impl PartFile {
    /// Reads header and index.
    pub(super) fn open(path: &Path) -> Result<Self, Unusable> {
        let failed = |error: &io::Error| Unusable { reason: format!("cannot be read: {error}"), header: None };
        if !std::fs::metadata(path).map_err(|e| failed(&e))?.is_file() {
            return Err(Unusable { reason: "is no file".into(), header: None });
        }
        let mut file = File::open(path).map_err(|e| failed(&e))?;
        let metadata = file.metadata().map_err(|e| failed(&e))?;
        let (length, state) = (metadata.len(), metadata.modified().ok().map(|time| (time, metadata.len())));
        let (json, start) = read_header(&mut file, length).map_err(|reason| Unusable { reason, header: None })?;
        let header: PartHeader = serde_json::from_slice(&json)
            .map_err(|_| Unusable { reason: "is damaged: its header cannot be read".into(), header: None })?;
        match read_index(&mut file, (start, length), &json, &header) {
            Ok(index) => Ok(Self { path: path.to_path_buf(), header, index, state }),
            Err(reason) => Err(Unusable { reason, header: Some(Box::new(header)) }),
        }
    }

    /// The chunks of a picture, sorted by row, then by column.
    pub(super) fn chunks(&self, picture: usize) -> &[Chunk] {
        chunks_of(&self.index, picture)
    }

    /// Reads a chunk into `bytes`.
    pub(super) fn read(&self, file: &mut File, chunk: &Chunk, bytes: &mut Vec<u8>) -> Result<(), String> {
        bytes.resize(usize::try_from(chunk.length).unwrap_or(usize::MAX), 0);
        let read = file.seek(SeekFrom::Start(chunk.at)).and_then(|_| file.read_exact(bytes));
        read.map_err(|error| format!("cannot be read: {error}"))?;
        if hash(&[bytes]).to_hex().as_str() == chunk.hash {
            Ok(())
        } else {
            Err("is damaged: its content is not what was written".into())
        }
    }
}

/// True if the file `path` is the complete part that `header` describes. The encodings of pictures are not compared,
/// because they follow from the keys.
#[must_use]
pub fn is_whole(path: &Path, header: &PartHeader) -> bool {
    let Ok(part) = PartFile::open(path) else { return false };
    let bare = |header: &PartHeader| {
        let mut header = header.clone();
        header.pictures.iter_mut().for_each(|picture| picture.spec = None);
        header
    };
    let (Ok(mut file), mut bytes) = (File::open(path), Vec::new()) else { return false };
    bare(&part.header) == bare(header)
        && part.index.chunks.iter().all(|chunk| part.read(&mut file, chunk, &mut bytes).is_ok())
}

fn read_header(file: &mut File, length: u64) -> Result<(Vec<u8>, u64), String> {
    let cut = |_: io::Error| "is truncated".to_owned();
    let mut start = [0; 16];
    if length < 16 {
        return Err(if length == 0 { "is empty".into() } else { "is truncated".into() });
    }
    file.read_exact(&mut start).map_err(cut)?;
    if start[..8] != MAGIC[..] {
        return Err("is no part of a picture, or of another version of Shibo".into());
    }
    let json = u64::from_le_bytes(start[8..].try_into().unwrap_or_default());
    if json > MOST || 16 + json > length {
        return Err("is truncated".into());
    }
    let mut bytes = vec![0; usize::try_from(json).unwrap_or(0)];
    file.read_exact(&mut bytes).map_err(cut)?;
    Ok((bytes, 16 + json))
}

fn read_index(file: &mut File, (start, length): (u64, u64), json: &[u8], header: &PartHeader) -> Result<Index, String> {
    let cut = |_: io::Error| "is truncated".to_owned();
    let end = length.checked_sub(END).filter(|end| *end >= start).ok_or("is truncated")?;
    let mut tail = [0; 48];
    file.seek(SeekFrom::Start(end)).and_then(|_| file.read_exact(&mut tail)).map_err(cut)?;
    let at = u64::from_le_bytes(tail[8..16].try_into().unwrap_or_default());
    if tail[..8] != MAGIC[..] || at < start || at > end || end - at > MOST {
        return Err("is truncated".into());
    }
    let mut bytes = vec![0; usize::try_from(end - at).unwrap_or(0)];
    file.seek(SeekFrom::Start(at)).and_then(|_| file.read_exact(&mut bytes)).map_err(cut)?;
    let damaged = || "is damaged: its header or its index is not what was written".to_owned();
    if hash(&[json, &bytes]).as_bytes() != &tail[16..] {
        return Err(damaged());
    }
    let mut index: Index = serde_json::from_slice(&bytes).map_err(|_| damaged())?;
    // Blocks lie in the order in which they were computed. The stable sort keeps the order of chunks without rows.
    index.chunks.sort_by_key(|chunk| (chunk.picture, chunk.row, chunk.x));
    if !fits(header, &index, (start, at)) {
        return Err(damaged());
    }
    names::check(header).map(|()| index)
}

/// The chunks of a picture in a sorted index.
fn chunks_of(index: &Index, picture: usize) -> &[Chunk] {
    let start = index.chunks.partition_point(|chunk| chunk.picture < picture);
    let rest = &index.chunks[start..];
    &rest[..rest.partition_point(|chunk| chunk.picture == picture)]
}

/// True if sorted chunks cover the rows of a picture of this width, each pixel once. Chunks side by side must have the
/// same rows.
fn covers(chunks: &[Chunk], width: u32, [first, rows]: [u32; 2]) -> bool {
    let mut row = first;
    for beside in chunks.chunk_by(|a, b| a.row == b.row) {
        let mut x = 0;
        for chunk in beside {
            if chunk.row != row || chunk.rows != beside[0].rows || chunk.rows == 0 || chunk.x != x || chunk.width == 0 {
                return false;
            }
            x = x.saturating_add(chunk.width);
        }
        if x != width {
            return false;
        }
        row = row.saturating_add(beside[0].rows);
    }
    first.checked_add(rows) == Some(row)
}

/// True if an index is consistent with its header.
fn fits(header: &PartHeader, index: &Index, (start, end): (u64, u64)) -> bool {
    let part = header.part;
    let shape = part.number >= 1 && part.number <= part.count && index.tallies.len() == header.pictures.len();
    let placed = index.chunks.iter().all(|chunk| {
        let Some(picture) = header.pictures.get(chunk.picture) else { return false };
        let inside = chunk.at >= start && chunk.at.checked_add(chunk.length).is_some_and(|to| to <= end);
        // The length must match the rows, and chunks side by side must not exceed the size of one row or of `CHUNK`.
        inside
            && match &picture.spec {
                Some(spec) => {
                    let (own, whole) = (block_of(spec, chunk.x, chunk.width).row_bytes(), spec.row_bytes());
                    let rows = u64::from(chunk.rows);
                    own.checked_mul(rows) == Some(chunk.length)
                        && whole.checked_mul(rows).is_some_and(|all| all <= whole.max(CHUNK as u64))
                }
                None => chunk.rows == 0 && chunk.length <= CHUNK as u64,
            }
    });
    let complete = header.pictures.iter().enumerate().all(|(number, picture)| {
        picture.spec.as_ref().is_none_or(|spec| covers(chunks_of(index, number), spec.width, header.rows))
    });
    let sized = header
        .pictures
        .iter()
        .flat_map(|p| &p.spec)
        .all(|spec| [spec.width, spec.height] == header.size && spec.mips.is_empty() && spec.check().is_ok());
    shape && placed && complete && sized
}
