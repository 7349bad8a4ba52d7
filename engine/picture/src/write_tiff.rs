//! TIFF, written here because the encoder of the `tiff` crate borrows from itself and compresses on one thread.
//!
//! Strips of DEFLATE with a predictor, little-endian, then the directory (TIFF 6.0; Adobe's technical notes for
//! DEFLATE, predictor 3 and BigTIFF).

use super::encode::{RowEncoder, Rows, Tally};
use super::levels::SIDE;
use super::lossless::{Zlib, tiff_predict_f32, tiff_predict_u8, tiff_predict_u16};
use super::spec::{Depth, PictureSpec, described};
use rayon::prelude::*;
use std::io::{self, Seek, SeekFrom, Write};

mod directory;
mod tiled;
pub(super) use directory::Directory;
pub(super) use tiled::TiledSink;

/// The uncompressed bytes of a strip.
const STRIP_BYTES: usize = 1 << 19;

pub(super) struct TiffSink<W> {
    output: W,
    spec: PictureSpec,
    zlib: Zlib,
    /// True if offsets have 64 bits.
    big: bool,
    rows_per_strip: usize,
    row_bytes: usize,
    /// Buffered bytes of an incomplete strip.
    pending: Vec<u8>,
    position: u64,
    /// Offset and length of each strip.
    strips: Vec<(u64, u64)>,
}

impl<W: Write + Seek> TiffSink<W> {
    pub(super) fn new(mut output: W, spec: &PictureSpec) -> io::Result<Self> {
        let row_bytes = spec.width as usize * spec.channels.len() * spec.depth.bytes();
        let rows_per_strip = (STRIP_BYTES / row_bytes).max(1);
        let (big, position) = begin(&mut output, row_bytes as u64 * u64::from(spec.height))?;
        let zlib = Zlib::new(spec.compression);
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
        let spec = &self.spec;
        let rows = u32::try_from(self.rows_per_strip).unwrap_or(u32::MAX).min(spec.height);
        let strips = Blocks::Strips { rows, places: &self.strips };
        let directory = directory(spec, self.big, (spec.width, spec.height), &strips);
        end(&mut self.output, self.big, self.position, &[directory])
    }
}

/// Writes the beginning of a file for `samples` bytes of samples; returns whether offsets have 64 bits, and the length
/// written.
pub(super) fn begin(output: &mut impl Write, samples: u64) -> io::Result<(bool, u64)> {
    // Decided by the uncompressed size. The margin of 1/16 is larger than any overhead of DEFLATE.
    let big = samples > u64::from(u32::MAX) / 16 * 15;
    let header: &[u8] = if big { b"II\x2b\0\x08\0\0\0\0\0\0\0\0\0\0\0" } else { b"II\x2a\0\0\0\0\0" };
    output.write_all(header)?;
    Ok((big, header.len() as u64))
}

/// Writes the directories at the end of a file, and the offset of the first directory at the beginning.
pub(super) fn end<W: Write + Seek>(
    output: &mut W,
    big: bool,
    mut position: u64,
    directories: &[Directory],
) -> io::Result<()> {
    // Directories begin at even offsets.
    if position % 2 == 1 {
        output.write_all(&[0])?;
        position += 1;
    }
    let place = position;
    for (index, directory) in directories.iter().enumerate() {
        let bytes = directory.bytes(position, index + 1 < directories.len())?;
        output.write_all(&bytes)?;
        position += bytes.len() as u64;
    }
    if big {
        output.seek(SeekFrom::Start(8))?;
        output.write_all(&place.to_le_bytes())?;
    } else {
        let place = u32::try_from(place).map_err(|_| io::Error::other("the file is too large for TIFF"))?;
        output.seek(SeekFrom::Start(4))?;
        output.write_all(&place.to_le_bytes())?;
    }
    output.flush()
}

/// Locations of the samples: offsets and lengths.
enum Blocks<'a> {
    Strips { rows: u32, places: &'a [(u64, u64)] },
    Tiles { reduced: bool, places: &'a [(u64, u64)] },
}

fn directory(spec: &PictureSpec, big: bool, (width, height): (u32, u32), blocks: &Blocks<'_>) -> Directory {
    let channels = spec.channels.len();
    let per_channel = |value: u16| vec![value; channels];
    let bits: u16 = match spec.depth {
        Depth::U8 => 8,
        Depth::U16 | Depth::F16 => 16,
        Depth::F32 => 32,
    };
    let is_float = spec.depth == Depth::F32;
    let told = |wanted: &str| spec.metadata.iter().find(|(name, _)| name == wanted).map(|(_, text)| text);
    let (Blocks::Strips { places, .. } | Blocks::Tiles { places, .. }) = blocks;
    let (places, lengths): (Vec<u64>, Vec<u64>) = places.iter().copied().unzip();
    let reduced = matches!(blocks, Blocks::Tiles { reduced: true, .. });
    let mut directory = Directory::new(big);
    if reduced {
        directory.longs(254, &[1]); // reduced version of another picture
    }
    directory.longs(256, &[width]);
    directory.longs(257, &[height]);
    directory.shorts(258, &per_channel(bits));
    directory.shorts(259, &[8]); // DEFLATE
    directory.shorts(262, &[if channels < 3 { 1 } else { 2 }]); // grey or RGB
    if !spec.metadata.is_empty() && !reduced {
        directory.text(270, &described(&spec.metadata));
    }
    if let Blocks::Strips { .. } = blocks {
        directory.places(273, &places);
    }
    directory.shorts(277, &[u16::try_from(channels).unwrap_or(u16::MAX)]);
    if let Blocks::Strips { rows, .. } = blocks {
        directory.longs(278, &[*rows]);
        directory.places(279, &lengths);
    }
    let density = spec.pixel_mm.filter(|_| !reduced);
    if let Some([x, y]) = density {
        directory.ratio(282, ratio(10.0 / x));
        directory.ratio(283, ratio(10.0 / y));
    }
    directory.shorts(284, &[1]); // pixel-interleaved
    if density.is_some() {
        directory.shorts(296, &[3]); // pixels per centimetre
    }
    if let Some(software) = told("Software") {
        directory.text(305, software);
    }
    directory.shorts(317, &[if is_float { 3 } else { 2 }]); // predictor
    if let Blocks::Tiles { .. } = blocks {
        directory.longs(322, &[SIDE]);
        directory.longs(323, &[SIDE]);
        directory.places(324, &places);
        directory.places(325, &lengths);
    }
    if spec.alpha().is_some() {
        directory.shorts(338, &[2]); // opacity, colours not premultiplied
    }
    directory.shorts(339, &per_channel(if is_float { 3 } else { 1 }));
    // Pixar's texture tags, which OpenImageIO writes too.
    for (tag, name) in [(33302, "textureformat"), (33303, "wrapmodes")] {
        if let Some(text) = told(name) {
            directory.text(tag, text);
        }
    }
    directory
}

/// A number as the quotient of two integers, as exact as an `f32`.
pub(super) fn ratio(number: f32) -> [u32; 2] {
    // More digits would only show the rounding to `f32`.
    let most = 4e6;
    let scale = [10_000_u32, 1000, 100, 10, 1].into_iter().find(|scale| number * *scale as f32 <= most).unwrap_or(1);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a conversion that stops at the ends")]
    let [mut above, mut below] = [(number * scale as f32).round().max(1.0) as u32, scale];
    while above.is_multiple_of(10) && below.is_multiple_of(10) {
        (above, below) = (above / 10, below / 10);
    }
    [above, below]
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
