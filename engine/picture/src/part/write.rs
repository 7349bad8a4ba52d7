//! Writes a part.
use super::{CHUNK, Chunk, Index, MAGIC, PartHeader, hash};
use crate::AtomicFile;
use crate::encode::{RowEncoder, Rows, Tally};
use crate::spec::{PictureSpec, WriteError};
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
    spec: PictureSpec,
    /// The encoder for blocks of the given first column and width.
    encoder: (u32, u32, RowEncoder),
    next_row: u32,
    end: u32,
    /// Pixels that are not written yet.
    left: u64,
}

impl Picture {
    fn encoder(&mut self, x: u32, width: u32) -> &RowEncoder {
        if (self.encoder.0, self.encoder.1) != (x, width) {
            self.encoder = (x, width, RowEncoder::new(&block_of(&self.spec, x, width)));
        }
        &self.encoder.2
    }
}

/// The specification of a block of columns as a picture of its own.
pub(super) fn block_of(spec: &PictureSpec, x: u32, width: u32) -> PictureSpec {
    let mut block = PictureSpec { width, ..spec.clone() };
    block.encoding.origin.0 = block.encoding.origin.0.wrapping_add(x);
    block
}

impl PartWriter {
    /// Starts the part `path`.
    ///
    /// # Errors
    /// When the specification of a picture contradicts itself or the folder cannot be written.
    pub fn create(path: &Path, header: &PartHeader) -> Result<Self, WriteError> {
        let at = |error| WriteError::at(path, error);
        let mut pictures = Vec::with_capacity(header.pictures.len());
        for picture in &header.pictures {
            pictures.push(match &picture.spec {
                Some(spec) => {
                    spec.check()?;
                    let [first, rows] = header.rows;
                    let encoder = (0, spec.width, RowEncoder::new(spec));
                    let (next_row, end) = (first, first.saturating_add(rows));
                    let left = u64::from(rows) * u64::from(spec.width);
                    Some(Picture { spec: spec.clone(), encoder, next_row, end, left })
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

    /// Writes the next rows of a picture: for every channel, `rows` times the width samples.
    ///
    /// # Errors
    /// Lengths that do not match, or an error of the system. The writer must be dropped then.
    pub fn write_rows(&mut self, picture: usize, planes: &[&[f32]], rows: u32) -> Result<(), WriteError> {
        let Some(Some(of)) = self.pictures.get_mut(picture) else {
            return Err(WriteError::Rows { first: 0, end: rows, height: 0 });
        };
        let (first, width) = (of.next_row, of.spec.width);
        of.next_row = first.saturating_add(rows);
        self.write_block(picture, planes, [0, first, width, rows])
    }

    /// Writes a block of a picture, `[x, y, width, height]`, with as many samples for every channel. Blocks may come in
    /// any order if blocks side by side have the same rows.
    ///
    /// # Errors
    /// Lengths that do not match, or an error of the system. The writer must be dropped then.
    pub fn write_block(
        &mut self,
        picture: usize,
        planes: &[&[f32]],
        [x, first, width, rows]: [u32; 4],
    ) -> Result<(), WriteError> {
        let Some(Some(of)) = self.pictures.get_mut(picture) else {
            return Err(WriteError::Rows { first: 0, end: rows, height: 0 });
        };
        let (wide, end) = (width as usize, first.saturating_add(rows));
        let samples = rows as usize * wide;
        let inside = x.checked_add(width).is_some_and(|right| right <= of.spec.width) && end <= of.end;
        let pixels = of.left.checked_sub(samples as u64);
        let fits = planes.len() == of.spec.channels.len() && planes.iter().all(|plane| plane.len() == samples);
        let Some(left) = pixels.filter(|_| inside && fits) else {
            return Err(WriteError::Rows { first, end, height: of.end });
        };
        of.left = left;
        // As many rows per chunk as for chunks of whole rows, so that joining needs little memory for a whole row of
        // chunks.
        let step = u32::try_from(CHUNK as u64 / of.spec.row_bytes().max(1)).unwrap_or(u32::MAX).max(1);
        let encoder = of.encoder(x, width);
        let mut row = 0;
        while row < rows {
            let count = step.min(rows - row);
            let part: Vec<&[f32]> =
                planes.iter().map(|plane| &plane[row as usize * wide..][..count as usize * wide]).collect();
            self.bytes.clear();
            let tally = encoder.encode(Rows { planes: &part, first: first + row, count }, &mut self.bytes);
            self.index.tallies[picture] = self.index.tallies[picture].with(tally);
            self.index.chunks.push(chunk(picture, [x, first + row, width, count], self.at, &self.bytes));
            self.file.write_all(&self.bytes).map_err(|error| WriteError::at(&self.path, error))?;
            self.at += self.bytes.len() as u64;
            row += count;
        }
        Ok(())
    }

    /// Stores a file without rows in the part.
    ///
    /// # Errors
    /// Errors of the system.
    pub fn put(&mut self, picture: usize, bytes: &[u8]) -> Result<(), WriteError> {
        for part in bytes.chunks(CHUNK) {
            self.index.chunks.push(chunk(picture, [0; 4], self.at, part));
            self.file.write_all(part).map_err(|error| WriteError::at(&self.path, error))?;
            self.at += part.len() as u64;
        }
        Ok(())
    }

    /// Completes the part and gives it its name.
    ///
    /// # Errors
    /// Missing rows, or errors of the system. No new file exists then.
    pub fn finish(mut self) -> Result<(), WriteError> {
        for picture in self.pictures.iter().flatten() {
            if picture.left > 0 {
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

fn chunk(picture: usize, [x, row, width, rows]: [u32; 4], at: u64, bytes: &[u8]) -> Chunk {
    let hash = hash(&[bytes]).to_hex().to_string();
    Chunk { picture, row, rows, x, width, at, length: bytes.len() as u64, hash }
}
