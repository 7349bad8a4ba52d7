//! OpenEXR in blocks of rows.
//!
//! The `exr` crate writes the header's attributes and implements PIZ. The container is written here, because the
//! crate's writers need all blocks in one call, and write custom attributes in an order that differs from run to run.

mod tiled;

pub(super) use tiled::TiledSink;

use super::encode::{RowEncoder, Rows, Tally};
use super::lossless::{Zlib, exr_predict};
use super::spec::{Compression, Depth, PictureSpec};
use exr::compression::Compression as Method;
use exr::math::Vec2;
use exr::meta::attribute::{ChannelDescription, Chromaticities, IntegerBounds, LineOrder, SampleType, Text};
use exr::meta::header::Header;
use exr::meta::{BlockDescription, MetaData, magic_number};
use exr::prelude::SmallVec;
use rayon::prelude::*;
use std::io::{self, Seek, SeekFrom, Write};

pub(super) struct ExrSink<W> {
    output: W,
    header: Header,
    zlib: Zlib,
    row_bytes: usize,
    /// Buffered bytes of an incomplete block.
    pending: Vec<u8>,
    /// Offset of the block table.
    table: u64,
    position: u64,
    /// Offset of each block.
    places: Vec<u64>,
}

impl<W: Write + Seek> ExrSink<W> {
    pub(super) fn new(mut output: W, spec: &PictureSpec) -> io::Result<Self> {
        let header = header(spec);
        let mut start = header_bytes(&header).map_err(io::Error::other)?;
        attributes(&mut start, &spec.metadata)?;
        let table = start.len() as u64;
        // Zeros until the end, by which readers recognise an incomplete file.
        start.resize(start.len() + header.chunk_count * 8, 0);
        output.write_all(&start)?;
        let row_bytes = spec.width as usize * header.channels.bytes_per_pixel;
        let (zlib, position) = (Zlib::new(spec.compression), start.len() as u64);
        Ok(Self { output, header, zlib, row_bytes, pending: Vec::new(), table, position, places: Vec::new() })
    }

    pub(super) fn rows_per_block(&self) -> usize {
        self.header.compression.scan_lines_per_block()
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
        let block_bytes = self.rows_per_block() * self.row_bytes;
        self.write_blocks(self.pending.len() / block_bytes * block_bytes)
    }

    /// Compresses and writes the first bytes of `pending`.
    fn write_blocks(&mut self, bytes: usize) -> io::Result<()> {
        let rows = self.rows_per_block();
        let blocks = self.pending[..bytes].par_chunks(rows * self.row_bytes).enumerate();
        let (header, zlib, first) = (&self.header, &self.zlib, self.places.len());
        let compressed: exr::error::Result<Vec<(usize, Vec<u8>)>> = blocks
            .map(|(index, block)| {
                let y = (first + index) * rows;
                Ok((y, compress(block, y, header, zlib)?))
            })
            .collect();
        let compressed = compressed.map_err(io::Error::other)?;
        self.pending.drain(..bytes);
        for (y, block) in compressed {
            let number = |value: usize| i32::try_from(value).map(i32::to_le_bytes).map_err(io::Error::other);
            self.output.write_all(&[number(y)?, number(block.len())?].concat())?;
            self.output.write_all(&block)?;
            self.places.push(self.position);
            self.position += 8 + block.len() as u64;
        }
        Ok(())
    }

    pub(super) fn finish(mut self) -> io::Result<()> {
        self.write_blocks(self.pending.len())?;
        let table: Vec<u8> = self.places.iter().flat_map(|place| place.to_le_bytes()).collect();
        self.output.seek(SeekFrom::Start(self.table))?;
        self.output.write_all(&table)?;
        self.output.flush()
    }
}

/// The channels in the order that the format requires.
fn channels(spec: &PictureSpec) -> SmallVec<[ChannelDescription; 5]> {
    let sample_type = if spec.depth == Depth::F16 { SampleType::F16 } else { SampleType::F32 };
    let mut names: Vec<&String> = spec.channels.iter().collect();
    names.sort();
    names.into_iter().map(|name| ChannelDescription::new(name.as_str(), sample_type, false)).collect()
}

fn header(spec: &PictureSpec) -> Header {
    // Wavelets compress noise better than DEFLATE, but take more time.
    let method = match spec.compression {
        Compression::Fast => Method::ZIP16,
        Compression::Best => Method::PIZ,
    };
    attributed(spec).with_encoding(method, BlockDescription::ScanLines, LineOrder::Increasing)
}

/// A header with everything except the storage of samples.
fn attributed(spec: &PictureSpec) -> Header {
    let size = (spec.width as usize, spec.height as usize);
    let mut header = Header::new(Text::default(), size, channels(spec));
    header.own_attributes.layer_name = None;
    header.shared_attributes.chromaticities = spec.chromaticities.map(chromaticities);
    if let Some([x, y]) = spec.pixel_mm {
        // Pixels per inch, and the aspect ratio of a pixel.
        header.own_attributes.horizontal_density = Some(25.4 / x);
        if (x / y - 1.0).abs() > 1e-5 {
            header.shared_attributes.pixel_aspect = (x / y).clamp(1e-5, 1e5);
        }
    }
    header
}

fn header_bytes(header: &Header) -> exr::error::Result<Vec<u8>> {
    let headers = std::slice::from_ref(header);
    let mut bytes = Vec::new();
    let requirements = MetaData::validate(headers, true)?;
    magic_number::write(&mut bytes)?;
    requirements.write(&mut bytes)?;
    Header::write_all(headers, &mut bytes, false)?;
    Ok(bytes)
}

fn chromaticities([rx, ry, gx, gy, bx, by, wx, wy]: [f32; 8]) -> Chromaticities {
    Chromaticities { red: Vec2(rx, ry), green: Vec2(gx, gy), blue: Vec2(bx, by), white: Vec2(wx, wy) }
}

/// Adds text attributes to the bytes of a header, before the zero at the end.
fn attributes(header: &mut Vec<u8>, metadata: &[(String, String)]) -> io::Result<()> {
    let end = header.pop();
    for (name, text) in named(metadata) {
        header.extend(name.bytes().chain(*b"\0string\0"));
        let length = i32::try_from(text.len()).map_err(io::Error::other)?;
        header.extend(length.to_le_bytes().iter().chain(text.as_bytes()));
    }
    header.extend(end);
    Ok(())
}

/// Attributes that other programs know: those of OpenImageIO for textures, and the writing program.
const KNOWN: [&str; 3] = ["software", "wrapmodes", "textureformat"];

/// Turns a name into an attribute name.
pub(super) fn text_name(name: &str) -> String {
    // Other names might equal a standard attribute of another type.
    let known = KNOWN.iter().find(|known| known.eq_ignore_ascii_case(name));
    let name = known.map_or_else(|| format!("shibo.{name}"), ToString::to_string);
    name.chars().map(|c| if c.is_ascii_graphic() { c } else { '_' }).take(31).collect()
}

/// Names and texts as the format allows them: names of 1 to 31 printable ASCII characters that do not equal a standard
/// attribute.
fn named(metadata: &[(String, String)]) -> Vec<(String, String)> {
    let mut attributes: Vec<(String, String)> = Vec::new();
    for (name, text) in metadata {
        let name = text_name(name);
        if attributes.iter().all(|(other, _)| *other != name) {
            attributes.push((name, text.clone()));
        }
    }
    attributes
}

fn compress(block: &[u8], y: usize, header: &Header, zlib: &Zlib) -> exr::error::Result<Vec<u8>> {
    if header.compression == Method::PIZ {
        let rows = block.len() / (header.layer_size.width() * header.channels.bytes_per_pixel);
        let place = IntegerBounds::new((0, i32::try_from(y)?), (header.layer_size.width(), rows));
        return header.compression.compress_image_section_to_le(header, to_native(block.to_vec(), header), place);
    }
    Ok(packed(block, zlib))
}

/// Bytes of a ZIP block, compressed if that is worthwhile.
fn packed(block: &[u8], zlib: &Zlib) -> Vec<u8> {
    if dense(block, zlib) { block.to_vec() } else { shrunk(block, zlib) }
}

/// Bytes of a ZIP block that is worth compressing.
fn shrunk(block: &[u8], zlib: &Zlib) -> Vec<u8> {
    let packed = zlib.stream(&exr_predict(block));
    // A block that does not shrink is stored uncompressed; readers recognise it by its length.
    if packed.len() < block.len() { packed } else { block.to_vec() }
}

/// True if a block is not worth compressing. Tries a sixteenth of it, or at least two KiB: the noise of fine surfaces
/// in 32 bits shrinks by one percent and takes the longest. For blocks below 16 KiB the trial would cost too much.
fn dense(block: &[u8], zlib: &Zlib) -> bool {
    let part = (block.len() / 32).max(1 << 10);
    if part > block.len() / 16 {
        return false;
    }
    // Even bytes, then odd ones, which compress differently.
    let bytes = exr_predict(&block[..2 * part]);
    bytes.chunks(part).map(|half| zlib.stream(half).len()).sum::<usize>() > part * 2 / 100 * 97
}

/// The crate takes samples in native byte order.
fn to_native(mut bytes: Vec<u8>, header: &Header) -> Vec<u8> {
    if cfg!(target_endian = "big") {
        let sample = header.channels.list.first().map_or(1, |channel| channel.sample_type.bytes_per_sample());
        bytes.chunks_exact_mut(sample).for_each(<[u8]>::reverse);
    }
    bytes
}
