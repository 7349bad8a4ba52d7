//! PNG, encoded row by row by the `png` crate.

use super::encode::{RowEncoder, Rows, Tally};
use super::spec::{Compression, Depth, PictureSpec, Transfer};
use png::{BitDepth, ColorType, DeflateCompression, Encoder, EncodingError, Filter, SrgbRenderingIntent, StreamWriter};
use std::io::{self, Write};

/// Compressed bytes of a chunk.
const CHUNK_BYTES: usize = 1 << 18;

pub(super) struct PngSink<W: Write + 'static> {
    stream: StreamWriter<'static, W>,
    bytes: Vec<u8>,
}

impl<W: Write + 'static> PngSink<W> {
    pub(super) fn new(output: W, spec: &PictureSpec) -> io::Result<Self> {
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
                encoder.set_deflate_compression(DeflateCompression::Level(7));
                encoder.set_filter(Filter::Adaptive);
            }
        }
        if spec.encoding.transfer == Transfer::Srgb {
            encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
        }
        for (name, text) in &spec.metadata {
            let (name, text) = (keyword(name), text.replace('\0', " "));
            // The plain form is Latin-1; what is not ASCII goes into the UTF-8 form.
            let added =
                if text.is_ascii() { encoder.add_text_chunk(name, text) } else { encoder.add_itxt_chunk(name, text) };
            added.map_err(to_io)?;
        }
        let writer = encoder.write_header().map_err(to_io)?;
        let stream = writer.into_stream_writer_with_size(CHUNK_BYTES).map_err(to_io)?;
        Ok(Self { stream, bytes: Vec::new() })
    }

    pub(super) fn write(&mut self, encoder: &RowEncoder, rows: Rows<'_>) -> io::Result<Tally> {
        self.bytes.clear();
        let tally = encoder.encode(rows, &mut self.bytes);
        self.stream.write_all(&self.bytes)?;
        Ok(tally)
    }

    pub(super) fn finish(self) -> io::Result<()> {
        self.stream.finish().map_err(to_io)
    }
}

/// A name as the format takes it: 1 to 79 characters of printable ASCII.
fn keyword(name: &str) -> String {
    let printable = name.chars().map(|c| if c.is_ascii_graphic() || c == ' ' { c } else { '_' });
    let word: String = printable.take(79).collect();
    let word = word.trim();
    if word.is_empty() { "Comment".into() } else { word.into() }
}

fn to_io(error: EncodingError) -> io::Error {
    match error {
        EncodingError::IoError(error) => error,
        error => io::Error::other(error),
    }
}
