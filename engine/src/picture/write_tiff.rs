//! TIFF, written here: the `tiff` crate's encoder borrows itself and compresses on one thread.
//!
//! Strips of DEFLATE with a predictor, little endian, then the directory (TIFF 6.0; Adobe's technical notes for DEFLATE,
//! predictor 3 and BigTIFF).

use super::encode::{RowEncoder, Rows, Tally};
use super::lossless::{Zlib, tiff_predict_f32, tiff_predict_u8, tiff_predict_u16};
use super::spec::{Depth, PictureSpec, described};
use rayon::prelude::*;
use std::io::{self, Seek, SeekFrom, Write};

mod directory;
use directory::Directory;

/// Uncompressed bytes of a strip.
const STRIP_BYTES: usize = 1 << 19;

pub(super) struct TiffSink<W> {
    output: W,
    spec: PictureSpec,
    zlib: Zlib,
    /// Whether places take 64 bits.
    big: bool,
    rows_per_strip: usize,
    row_bytes: usize,
    /// Bytes of rows that do not make a strip yet.
    pending: Vec<u8>,
    position: u64,
    /// Place and length of each strip.
    strips: Vec<(u64, u64)>,
}

impl<W: Write + Seek> TiffSink<W> {
    pub(super) fn new(mut output: W, spec: &PictureSpec) -> io::Result<Self> {
        let row_bytes = spec.width as usize * spec.channels.len() * spec.depth.bytes();
        let rows_per_strip = (STRIP_BYTES / row_bytes).max(1);
        // Decided by the size without compression, which DEFLATE never exceeds by as much as is left here.
        let big = row_bytes as u64 * u64::from(spec.height) > u64::from(u32::MAX) / 16 * 15;
        let header: &[u8] = if big { b"II\x2b\0\x08\0\0\0\0\0\0\0\0\0\0\0" } else { b"II\x2a\0\0\0\0\0" };
        output.write_all(header)?;
        let (zlib, position) = (Zlib::new(spec.compression), header.len() as u64);
        let (spec, pending, strips) = (spec.clone(), Vec::new(), Vec::new());
        Ok(Self { output, spec, zlib, big, rows_per_strip, row_bytes, pending, position, strips })
    }

    pub(super) fn rows_per_block(&self) -> usize {
        self.rows_per_strip
    }

    pub(super) fn write(&mut self, encoder: &RowEncoder, rows: Rows<'_>) -> io::Result<Tally> {
        let tally = encoder.encode(rows, &mut self.pending);
        self.write_whole()?;
        Ok(tally)
    }

    pub(super) fn write_encoded(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.pending.extend_from_slice(bytes);
        self.write_whole()
    }

    fn write_whole(&mut self) -> io::Result<()> {
        let strip_bytes = self.rows_per_strip * self.row_bytes;
        self.write_strips(self.pending.len() / strip_bytes * strip_bytes)
    }

    /// Compresses and writes the first bytes of `pending`.
    fn write_strips(&mut self, bytes: usize) -> io::Result<()> {
        let strips = self.pending[..bytes].par_chunks_mut(self.rows_per_strip * self.row_bytes);
        let (spec, row_bytes) = (&self.spec, self.row_bytes);
        let compressed: Vec<Vec<u8>> = strips.map(|strip| compress(strip, row_bytes, spec, &self.zlib)).collect();
        self.pending.drain(..bytes);
        for strip in compressed {
            self.output.write_all(&strip)?;
            self.strips.push((self.position, strip.len() as u64));
            self.position += strip.len() as u64;
        }
        Ok(())
    }

    pub(super) fn finish(mut self) -> io::Result<()> {
        self.write_strips(self.pending.len())?;
        // Directories begin at even places.
        if self.position % 2 == 1 {
            self.output.write_all(&[0])?;
            self.position += 1;
        }
        let place = self.position;
        let bytes = self.directory().bytes(place)?;
        self.output.write_all(&bytes)?;
        if self.big {
            self.output.seek(SeekFrom::Start(8))?;
            self.output.write_all(&place.to_le_bytes())?;
        } else {
            let place = u32::try_from(place).map_err(|_| io::Error::other("the file is too large for TIFF"))?;
            self.output.seek(SeekFrom::Start(4))?;
            self.output.write_all(&place.to_le_bytes())?;
        }
        self.output.flush()
    }

    fn directory(&self) -> Directory {
        let spec = &self.spec;
        let channels = spec.channels.len();
        let per_channel = |value: u16| vec![value; channels];
        let bits: u16 = if spec.depth == Depth::U8 {
            8
        } else if spec.depth == Depth::U16 {
            16
        } else {
            32
        };
        let is_float = spec.depth == Depth::F32;
        let rows = u32::try_from(self.rows_per_strip).unwrap_or(u32::MAX).min(spec.height);
        let (places, lengths): (Vec<u64>, Vec<u64>) = self.strips.iter().copied().unzip();
        let mut directory = Directory::new(self.big);
        directory.longs(256, &[spec.width]);
        directory.longs(257, &[spec.height]);
        directory.shorts(258, &per_channel(bits));
        directory.shorts(259, &[8]); // DEFLATE
        directory.shorts(262, &[if channels < 3 { 1 } else { 2 }]); // grey or RGB
        if !spec.metadata.is_empty() {
            directory.text(270, &described(&spec.metadata));
        }
        directory.places(273, &places);
        directory.shorts(277, &[u16::try_from(channels).unwrap_or(u16::MAX)]);
        directory.longs(278, &[rows]);
        directory.places(279, &lengths);
        directory.shorts(284, &[1]); // pixel after pixel
        if let Some((_, software)) = spec.metadata.iter().find(|(name, _)| name == "Software") {
            directory.text(305, software);
        }
        directory.shorts(317, &[if is_float { 3 } else { 2 }]); // predictor
        if spec.alpha().is_some() {
            directory.shorts(338, &[2]); // opacity, colours not multiplied by it
        }
        directory.shorts(339, &per_channel(if is_float { 3 } else { 1 }));
        directory
    }
}

fn compress(strip: &mut [u8], row_bytes: usize, spec: &PictureSpec, zlib: &Zlib) -> Vec<u8> {
    let channels = spec.channels.len();
    for row in strip.chunks_exact_mut(row_bytes) {
        match spec.depth {
            Depth::U8 => tiff_predict_u8(row, channels),
            Depth::U16 | Depth::F16 => tiff_predict_u16(row, channels),
            Depth::F32 => tiff_predict_f32(row, channels),
        }
    }
    zlib.stream(strip)
}
