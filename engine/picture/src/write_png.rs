//! PNG, encoded row by row by the `png` crate.

use super::encode::{RowEncoder, Rows, Tally};
use super::spec::{Compression, Depth, PictureSpec, Transfer};
use png::{
    BitDepth, ColorType, DeflateCompression, Encoder, EncodingError, Filter, PixelDimensions, SrgbRenderingIntent,
    StreamWriter, Unit,
};
use std::io::{self, Write};
use std::sync::{Arc, Mutex, PoisonError};

/// Number of compressed bytes of a chunk.
const CHUNK_BYTES: usize = 1 << 18;

pub(super) struct PngSink<W: Write + 'static> {
    stream: StreamWriter<'static, Watched<W>>,
    bytes: Vec<u8>,
    failure: Failure,
}

/// The first error of an output.
type Failure = Arc<Mutex<Option<io::Error>>>;

/// An output that keeps its error: the crate writes the last chunks in `drop` and ignores failures.
struct Watched<W> {
    output: W,
    failure: Failure,
}

impl<W: Write> Write for Watched<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.output.write(bytes).inspect_err(|error| {
            let mut failure = self.failure.lock().unwrap_or_else(PoisonError::into_inner);
            if error.kind() != io::ErrorKind::Interrupted {
                failure.get_or_insert_with(|| io::Error::new(error.kind(), error.to_string()));
            }
        })
    }

    fn flush(&mut self) -> io::Result<()> {
        self.output.flush()
    }
}

impl<W: Write + 'static> PngSink<W> {
    pub(super) fn new(output: W, spec: &PictureSpec) -> io::Result<Self> {
        let failure = Failure::default();
        let output = Watched { output, failure: Arc::clone(&failure) };
        let mut encoder = Encoder::new(output, spec.width, spec.height);
        encoder.set_color(match spec.channels.len() {
            1 => ColorType::Grayscale,
            2 => ColorType::GrayscaleAlpha,
            3 => ColorType::Rgb,
            _ => ColorType::Rgba,
        });
        encoder.set_depth(if spec.depth == Depth::U8 { BitDepth::Eight } else { BitDepth::Sixteen });
        match spec.compression {
            Compression::Fast => {
                encoder.set_deflate_compression(DeflateCompression::FdeflateUltraFast);
                encoder.set_filter(Filter::Up);
            }
            Compression::Best => {
                encoder.set_deflate_compression(DeflateCompression::Level(6));
                encoder.set_filter(Filter::Adaptive);
            }
        }
        if spec.encoding.transfer == Transfer::Srgb {
            encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
        }
        describe(&mut encoder, spec)?;
        let writer = encoder.write_header().map_err(to_io)?;
        let stream = writer.into_stream_writer_with_size(CHUNK_BYTES).map_err(to_io)?;
        Ok(Self { stream, bytes: Vec::new(), failure })
    }

    pub(super) fn write(&mut self, encoder: &RowEncoder, rows: Rows<'_>) -> io::Result<Tally> {
        let mut bytes = std::mem::take(&mut self.bytes);
        bytes.clear();
        let tally = encoder.encode(rows, &mut bytes);
        self.write_encoded(&bytes)?;
        self.bytes = bytes;
        Ok(tally)
    }

    pub(super) fn write_encoded(&mut self, bytes: &[u8]) -> io::Result<()> {
        // The crate turns the error into text, which loses the information that the disk is full.
        self.stream.write_all(bytes).map_err(|error| taken(&self.failure).unwrap_or(error))
    }

    pub(super) fn finish(self) -> io::Result<()> {
        let finished = self.stream.finish().map_err(to_io);
        taken(&self.failure).map_or(finished, Err)
    }
}

/// Sets the size of pixels and the texts of a header.
pub(super) fn describe<W: Write>(encoder: &mut Encoder<'_, W>, spec: &PictureSpec) -> io::Result<()> {
    if let Some([xppu, yppu]) = spec.density(1000.0, i32::MAX.unsigned_abs()) {
        encoder.set_pixel_dims(Some(PixelDimensions { xppu, yppu, unit: Unit::Meter }));
    }
    for (name, text) in &spec.metadata {
        let (name, text) = (keyword(name), text.replace('\0', " "));
        // A `tEXt` chunk is Latin-1; other text goes into a UTF-8 `iTXt` chunk.
        let added =
            if text.is_ascii() { encoder.add_text_chunk(name, text) } else { encoder.add_itxt_chunk(name, text) };
        added.map_err(to_io)?;
    }
    Ok(())
}

/// The first error.
fn taken(failure: &Failure) -> Option<io::Error> {
    failure.lock().unwrap_or_else(PoisonError::into_inner).take()
}

/// A keyword that the format allows: 1 to 79 characters of printable ASCII.
fn keyword(name: &str) -> String {
    let printable = name.chars().map(|c| if c.is_ascii_graphic() || c == ' ' { c } else { '_' });
    let word: String = printable.take(79).collect();
    let word = word.trim();
    if word.is_empty() { "Comment".into() } else { word.into() }
}

pub(super) fn to_io(error: EncodingError) -> io::Error {
    match error {
        EncodingError::IoError(error) => error,
        error => io::Error::other(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::write_exr::ExrSink;
    use crate::write_tiff::TiffSink;
    use crate::{Encoding, Format, WriteError};
    use std::io::{Seek, SeekFrom};

    /// A disk with room for so many bytes.
    struct Disk(usize);

    impl Write for Disk {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0 = self.0.checked_sub(bytes.len()).ok_or(io::ErrorKind::StorageFull)?;
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    impl Seek for Disk {
        fn seek(&mut self, _: SeekFrom) -> io::Result<u64> {
            Ok(0)
        }
    }

    fn attempt(format: Format, disk: Disk) -> io::Result<()> {
        let (width, height) = (512, 1024);
        let spec = PictureSpec {
            width,
            height,
            channels: vec!["Y".into()],
            format,
            depth: format.depths()[0],
            encoding: Encoding::default(),
            compression: Compression::Fast,
            mips: Vec::new(),
            chromaticities: None,
            pixel_mm: None,
            metadata: Vec::new(),
        };
        let plane: Vec<f32> = (0..width * height)
            .map(|index| (index.wrapping_mul(index).wrapping_mul(2_654_435_761) >> 16) as f32 / 65536.0)
            .collect();
        let (encoder, rows) = (RowEncoder::new(&spec), Rows { planes: &[&plane], first: 0, count: height });
        match format {
            Format::Png => {
                let mut sink = PngSink::new(disk, &spec)?;
                sink.write(&encoder, rows)?;
                sink.finish()
            }
            Format::Tiff => {
                let mut sink = TiffSink::new(disk, &spec)?;
                sink.write(&encoder, rows)?;
                sink.finish()
            }
            Format::Exr => {
                let mut sink = ExrSink::new(disk, &spec)?;
                sink.write(&encoder, rows)?;
                sink.finish()
            }
            Format::Jpeg(_) | Format::Svg => Ok(()),
        }
    }

    #[test]
    fn reports_a_full_disk_at_any_time() {
        for format in [Format::Png, Format::Tiff, Format::Exr] {
            attempt(format, Disk(1 << 22)).unwrap();
            for bytes in [0, 4, 100, 1000, 20_000, 300_000] {
                let error = WriteError::at(
                    "a.png".as_ref(),
                    attempt(format, Disk(bytes)).expect_err(&format!("{format} {bytes}")),
                );
                let message = error.to_string();
                assert!(matches!(error, WriteError::DiskFull { .. }), "{format}, {bytes}: {message}");
                assert_eq!(message, "`a.png` cannot be written: the disk is full; make room or write elsewhere");
            }
        }
    }
}
