//! JPEG in bands of rows.
//!
//! The encoder of the `image` crate needs a whole picture, so each band is encoded as a picture. The coded samples of
//! the bands are joined by restart markers, at which decoders reset their state. So the file equals one that was
//! encoded as a whole.

use super::encode::{RowEncoder, Rows, Tally};
use super::spec::PictureSpec;
use image::ExtendedColorType;
use image::codecs::jpeg::{JpegEncoder, PixelDensity, PixelDensityUnit};
use rayon::prelude::*;
use std::io::{self, Write};

/// The side of a block of samples.
const BLOCK: u32 = 8;
/// Maximum number of block rows in a band.
const MOST: u32 = 16;

pub(super) struct JpegSink<W> {
    output: W,
    width: u32,
    height: u32,
    color: ExtendedColorType,
    quality: u8,
    /// Pixels per inch, across and down.
    density: Option<(u16, u16)>,
    row_bytes: usize,
    /// Buffered bytes of an incomplete band.
    pending: Vec<u8>,
    /// Number of bands written.
    bands: u32,
}

impl<W: Write> JpegSink<W> {
    pub(super) fn new(output: W, spec: &PictureSpec, quality: u8) -> Self {
        let color = if spec.channels.len() == 1 { ExtendedColorType::L8 } else { ExtendedColorType::Rgb8 };
        let row_bytes = spec.width as usize * spec.channels.len();
        let (width, height) = (spec.width, spec.height);
        let count = |count: u32| u16::try_from(count).unwrap_or(u16::MAX);
        let density = spec.density(25.4, u16::MAX.into()).map(|[x, y]| (count(x), count(y)));
        Self { output, width, height, color, quality, density, row_bytes, pending: Vec::new(), bands: 0 }
    }

    /// Number of block rows in a band. The format counts the blocks between two markers with 16 bits.
    fn blocks_down(&self) -> u32 {
        (u32::from(u16::MAX) / self.width.div_ceil(BLOCK)).clamp(1, MOST)
    }

    pub(super) fn rows_per_block(&self) -> usize {
        (self.blocks_down() * BLOCK) as usize
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
        let band = self.rows_per_block() * self.row_bytes;
        self.write_bands(self.pending.len() / band * band)
    }

    /// Encodes and writes the first bytes of `pending`.
    fn write_bands(&mut self, bytes: usize) -> io::Result<()> {
        let bands = self.pending[..bytes].par_chunks(self.rows_per_block() * self.row_bytes);
        let (row_bytes, how) = (self.row_bytes, (self.width, self.color, self.quality, self.density));
        let made: Vec<Vec<u8>> = bands.map(|band| encoded(band, row_bytes, how)).collect::<io::Result<_>>()?;
        self.pending.drain(..bytes);
        for band in made {
            let (head, samples) = parts(&band).ok_or_else(|| io::Error::other("the encoder's JPEG has no samples"))?;
            if self.bands == 0 {
                let start = self.start(head)?;
                self.output.write_all(&start)?;
            } else {
                let number = self.bands.wrapping_sub(1) % 8;
                self.output.write_all(&[0xFF, 0xD0 + number.to_le_bytes()[0]])?;
            }
            self.output.write_all(samples)?;
            self.bands += 1;
        }
        Ok(())
    }

    /// The file up to its samples, from the head of the first band, with the height of the picture and the restart
    /// interval.
    fn start(&self, head: Head<'_>) -> io::Result<Vec<u8>> {
        let height = u16::try_from(self.height).map_err(io::Error::other)?;
        let every = self.width.div_ceil(BLOCK) * self.blocks_down();
        let every = u16::try_from(every).map_err(io::Error::other)?;
        let mut start = head.before.to_vec();
        start[head.height..head.height + 2].copy_from_slice(&height.to_be_bytes());
        start.extend([0xFF, 0xDD, 0, 4]);
        start.extend(every.to_be_bytes());
        start.extend(head.scan);
        Ok(start)
    }

    pub(super) fn finish(mut self) -> io::Result<()> {
        self.write_bands(self.pending.len())?;
        self.output.write_all(&[0xFF, 0xD9])?;
        self.output.flush()
    }
}

/// Encodes a band as a picture.
fn encoded(
    band: &[u8],
    row_bytes: usize,
    (width, color, quality, density): (u32, ExtendedColorType, u8, Option<(u16, u16)>),
) -> io::Result<Vec<u8>> {
    let mut jpeg = Vec::with_capacity(band.len() / 4);
    let rows = u32::try_from(band.len() / row_bytes).map_err(io::Error::other)?;
    let mut encoder = JpegEncoder::new_with_quality(&mut jpeg, quality);
    if let Some(density) = density {
        encoder.set_pixel_density(PixelDensity { density, unit: PixelDensityUnit::Inches });
    }
    encoder.encode(band, width, rows, color).map_err(io::Error::other)?;
    Ok(jpeg)
}

/// The head of a JPEG: everything before the samples.
#[derive(Clone, Copy)]
struct Head<'a> {
    before: &'a [u8],
    /// Offset of the height.
    height: usize,
    /// The scan header.
    scan: &'a [u8],
}

/// Splits a JPEG into its head and the coded samples. `None` unless it has exactly one scan.
fn parts(jpeg: &[u8]) -> Option<(Head<'_>, &[u8])> {
    let (mut at, mut height) = (2, None);
    loop {
        let [0xFF, marker, high, low] = *jpeg.get(at..at + 4)? else { return None };
        let end = at + 2 + usize::from(u16::from_be_bytes([high, low]));
        match marker {
            // The bit depth comes before the height.
            0xC0 => height = Some(at + 5),
            0xDA => {
                let samples = jpeg.get(end..)?.strip_suffix(&[0xFF, 0xD9])?;
                return Some((Head { before: &jpeg[..at], height: height?, scan: &jpeg[at..end] }, samples));
            }
            _ => {}
        }
        at = end;
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Compression, ReadLimits};
    use super::super::{Depth, Encoding, Format, PictureSpec, WriteError, Writer, read};

    fn spec(width: u32, height: u32, channels: usize, quality: u8) -> PictureSpec {
        PictureSpec {
            width,
            height,
            channels: ["R", "G", "B", "A"].iter().take(channels).map(ToString::to_string).collect(),
            format: Format::Jpeg(quality),
            depth: Depth::U8,
            encoding: Encoding::default(),
            compression: Compression::Fast,
            mips: Vec::new(),
            chromaticities: None,
            pixel_mm: None,
            metadata: Vec::new(),
        }
    }

    /// Writes a smooth picture; returns the largest error after reading it back, and the bytes of the file.
    fn written(spec: &PictureSpec, rows_at_once: u32) -> (f32, Vec<u8>) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.jpg");
        let (width, height) = (spec.width, spec.height);
        let value =
            |c: u32, x: u32, y: u32| 0.5 + 0.4 * ((x as f32 * 0.02 + c as f32).sin() * (y as f32 * 0.013).cos());
        let mut writer = Writer::create(&path, spec).unwrap();
        let mut row = 0;
        while row < height {
            let count = rows_at_once.min(height - row);
            let plane = |c| (0..count * width).map(|i| value(c, i % width, row + i / width)).collect::<Vec<f32>>();
            let planes: Vec<Vec<f32>> = (0..u32::try_from(spec.channels.len()).unwrap()).map(plane).collect();
            writer.write_rows(&planes.iter().map(Vec::as_slice).collect::<Vec<_>>(), count).unwrap();
            row += count;
        }
        writer.finish().unwrap();
        let picture = read(&path, &ReadLimits::default()).unwrap();
        assert_eq!(
            (picture.width, picture.height, usize::from(picture.channels)),
            (width, height, spec.channels.len())
        );
        let mut worst = 0.0_f32;
        for c in 0..picture.channels {
            for (i, got) in (0..).zip(picture.plane(c)) {
                worst = worst.max((got - value(u32::from(c), i % width, i / width)).abs());
            }
        }
        (worst, std::fs::read(&path).unwrap())
    }

    #[test]
    fn bands_make_one_picture() {
        // Sizes that are not multiples of a block, several bands, and more bands than there are marker numbers.
        for (width, height, channels) in [(5, 3, 3), (130, 300, 3), (24, 128 * 9 + 1, 1), (7, 129, 3)] {
            let (worst, bytes) = written(&spec(width, height, channels, 95), 64);
            assert!(worst < 0.03, "{width}x{height}: {worst}");
            assert_eq!(
                bytes,
                written(&spec(width, height, channels, 95), 1000).1,
                "the height of bands changes nothing"
            );
        }
    }

    #[test]
    fn higher_quality_gives_smaller_errors_and_larger_files() {
        let (low, small) = written(&spec(300, 200, 3, 20), 64);
        let (high, large) = written(&spec(300, 200, 3, 98), 64);
        assert!(low > high && small.len() < large.len(), "{low} {high} {} {}", small.len(), large.len());
    }

    #[test]
    fn refuses_pictures_that_jpeg_cannot_hold() {
        let refused = |spec: &PictureSpec| spec.check().unwrap_err().to_string();
        assert!(refused(&spec(65_536, 1, 3, 90)).contains("65535"));
        assert!(refused(&spec(8, 8, 4, 90)).contains("channels"));
        assert!(refused(&spec(8, 8, 2, 90)).contains("channels"));
        assert!(matches!(spec(8, 8, 3, 0).check(), Err(WriteError::Quality(0))));
        assert!(refused(&spec(8, 8, 3, 101)).contains("from 1 to 100"));
    }
}
