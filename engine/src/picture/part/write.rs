//! Writes a part.
use super::{CHUNK, Chunk, Index, MAGIC, PartHeader, hash};
use crate::picture::AtomicFile;
use crate::picture::encode::{RowEncoder, Rows, Tally};
use crate::picture::spec::WriteError;
use std::io::Write;
use std::path::{Path, PathBuf};

/// A part under construction. Its file appears when it is complete.
pub struct PartWriter {
    path: PathBuf,
    file: AtomicFile,
    header: Vec<u8>,
    at: u64,
    pictures: Vec<Option<Picture>>,
    index: Index,
    bytes: Vec<u8>,
}

struct Picture {
    encoder: RowEncoder,
    width: usize,
    channels: usize,
    next_row: u32,
    end: u32,
}

impl PartWriter {
    /// Starts the part `path`.
    ///
    /// # Errors
    /// When a picture contradicts itself or the folder cannot be written.
    pub fn create(path: &Path, header: &PartHeader) -> Result<Self, WriteError> {
        let at = |error| WriteError::at(path, error);
        let mut pictures = Vec::with_capacity(header.pictures.len());
        for picture in &header.pictures {
            pictures.push(match &picture.spec {
                Some(spec) => {
                    spec.check()?;
                    let [first, rows] = header.rows;
                    let (width, channels) = (spec.width as usize, spec.channels.len());
                    let (next_row, end) = (first, first.saturating_add(rows));
                    Some(Picture { encoder: RowEncoder::new(spec), width, channels, next_row, end })
                }
                None => None,
            });
        }
        let mut file = AtomicFile::create(path).map_err(at)?;
        let json = serde_json::to_vec(header).map_err(|error| at(error.into()))?;
        let start = [MAGIC.as_slice(), &(json.len() as u64).to_le_bytes(), &json].concat();
        file.write_all(&start).map_err(at)?;
        let index = Index { chunks: Vec::new(), tallies: vec![Tally::default(); pictures.len()] };
        let (path, at) = (path.to_path_buf(), start.len() as u64);
        Ok(Self { path, file, header: json, at, pictures, index, bytes: Vec::new() })
    }

    /// Writes the next rows of a picture: of every channel `rows` times the width samples.
    ///
    /// # Errors
    /// When the lengths do not fit, or the system refuses; then the writer should be dropped.
    pub fn write_rows(&mut self, picture: usize, planes: &[&[f32]], rows: u32) -> Result<(), WriteError> {
        let Some(Some(of)) = self.pictures.get_mut(picture) else {
            return Err(WriteError::Rows { first: 0, end: rows, height: 0 });
        };
        let (first, end) = (of.next_row, of.next_row.saturating_add(rows));
        let samples = rows as usize * of.width;
        if planes.len() != of.channels || planes.iter().any(|plane| plane.len() != samples) || end > of.end {
            return Err(WriteError::Rows { first, end, height: of.end });
        }
        let step = u32::try_from(CHUNK / of.encoder.row_bytes().max(1)).unwrap_or(u32::MAX).max(1);
        let mut row = 0;
        while row < rows {
            let count = step.min(rows - row);
            let part: Vec<&[f32]> =
                planes.iter().map(|plane| &plane[row as usize * of.width..][..count as usize * of.width]).collect();
            self.bytes.clear();
            let tally = of.encoder.encode(Rows { planes: &part, first: first + row, count }, &mut self.bytes);
            self.index.tallies[picture] = self.index.tallies[picture].with(tally);
            self.index.chunks.push(chunk(picture, count, self.at, &self.bytes));
            self.file.write_all(&self.bytes).map_err(|error| WriteError::at(&self.path, error))?;
            self.at += self.bytes.len() as u64;
            row += count;
        }
        of.next_row = end;
        Ok(())
    }

    /// Puts a file without rows into the part.
    ///
    /// # Errors
    /// The system refuses.
    pub fn put(&mut self, picture: usize, bytes: &[u8]) -> Result<(), WriteError> {
        for part in bytes.chunks(CHUNK) {
            self.index.chunks.push(chunk(picture, 0, self.at, part));
            self.file.write_all(part).map_err(|error| WriteError::at(&self.path, error))?;
            self.at += part.len() as u64;
        }
        Ok(())
    }

    /// Completes the part and gives it its name.
    ///
    /// # Errors
    /// When rows are missing or the system refuses; then there is no new file.
    pub fn finish(mut self) -> Result<(), WriteError> {
        for picture in self.pictures.iter().flatten() {
            if picture.next_row != picture.end {
                return Err(WriteError::Rows { first: 0, end: picture.next_row, height: picture.end });
            }
        }
        let path = self.path;
        let at = |error| WriteError::at(&path, error);
        let index = serde_json::to_vec(&self.index).map_err(|error| at(error.into()))?;
        let hash = hash(&[&self.header, &index]);
        let end = [&index[..], MAGIC, &self.at.to_le_bytes(), hash.as_bytes()].concat();
        self.file.write_all(&end).and_then(|()| self.file.commit()).map_err(at)
    }
}

fn chunk(picture: usize, rows: u32, at: u64, bytes: &[u8]) -> Chunk {
    Chunk { picture, rows, at, length: bytes.len() as u64, hash: hash(&[bytes]).to_hex().to_string() }
}
