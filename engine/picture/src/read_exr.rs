//! OpenEXR: headers and blocks are parsed here, with every size checked; the `exr` crate decompresses.

use super::guard::guarded;
use super::limits::{Claim, DEFLATE_RATIO, ReadError, ReadLimits};
use super::{FileFormat, Header, HeaderStatements, Picture, SampleKind};
use exr::compression::Compression;
use exr::io::{PeekRead, Tracking};
use exr::math::Vec2;
use exr::meta::attribute::{AttributeValue, SampleType};
use exr::meta::header::Header as Layer;
use exr::meta::{BlockDescription, MetaData, Requirements, magic_number};
use rayon::prelude::*;
use std::cell::Cell;
use std::io::{self, Cursor, Read, Seek};

mod blocks;
mod frame;
mod select;
use blocks::Block;
use frame::{Frame, Target};
use select::{Selection, all_names, select};

/// Bytes that are decompressed at once; at least one block.
const BATCH_BYTES: usize = 32 << 20;

pub(super) fn header<R: Read>(reader: R, wanted: Option<&str>) -> Result<Header, ReadError> {
    let (meta, _) = guarded(|| read_meta(reader))?;
    let selection = select(&meta, wanted)?;
    header_of(&meta, &selection)
}

/// A text in the first part of a file, by the name that the writer gave it.
pub(super) fn text<R: Read>(reader: R, name: &str) -> Result<Option<String>, ReadError> {
    let (meta, _) = guarded(|| read_meta(reader))?;
    let stored = super::write_exr::text_name(name);
    let of = |layer: &Layer| {
        let mut texts = layer.own_attributes.other.iter().chain(&layer.shared_attributes.other);
        texts.find_map(|(known, value)| match value {
            AttributeValue::Text(text) if known.to_string() == stored => Some(text.to_string()),
            _ => None,
        })
    };
    Ok(meta.headers.first().and_then(of))
}

/// Checks all parts of a file, and that the selected one can be read.
pub(super) fn check<R: Read + Seek>(
    mut reader: R,
    length: u64,
    limits: &ReadLimits,
    wanted: Option<&str>,
) -> Result<Header, ReadError> {
    let (meta, selection, _) = open(&mut reader, length, limits, wanted)?;
    header_of(&meta, &selection)
}

pub(super) fn read(bytes: &[u8], limits: &ReadLimits, wanted: Option<&str>) -> Result<Picture, ReadError> {
    let (meta, selection, blocks) = open(&mut Cursor::new(bytes), bytes.len() as u64, limits, wanted)?;
    let Header { width, height, channels, kind, has_alpha, .. } = header_of(&meta, &selection)?;
    let layer = &meta.headers[selection.layer];
    let mut target = Target::new(Frame::of(layer)?, layer, &selection);
    let batch = (BATCH_BYTES / block_bytes(layer).max(1)).clamp(1, 4096);
    for blocks in blocks.chunks(batch) {
        let unpack = |block: &Block| guarded(|| block.decompress(bytes, &meta, selection.layer));
        let decompressed: Result<Vec<_>, _> = blocks.par_iter().map(unpack).collect();
        for block in decompressed.map_err(ReadError::in_data)? {
            target.put(&block)?;
        }
    }
    Ok(Picture { width, height, channels, planes: target.planes, source: kind, names: selection.names, has_alpha })
}

/// The metadata of a file, the selection, and the blocks of the selected part. Performs all checks that need no
/// decompression.
fn open<R: Read + Seek>(
    reader: &mut R,
    length: u64,
    limits: &ReadLimits,
    wanted: Option<&str>,
) -> Result<(MetaData, Selection, Vec<Block>), ReadError> {
    let (meta, tables) = guarded(|| read_meta(&mut *reader))?;
    let selection = select(&meta, wanted)?;
    let layer = &meta.headers[selection.layer];
    let frame = Frame::of(layer)?;
    let Vec2(stored_width, stored_height) = layer.layer_size;
    // Either the data window or the display window may be the larger one.
    for (width, height) in
        [(u64::from(frame.width), u64::from(frame.height)), (stored_width as u64, stored_height as u64)]
    {
        limits.check(Claim { width, height, channels: u64::from(selection.count()), sample_bytes: 0 })?;
    }
    if block_bytes(layer) as u64 > limits.max_bytes_decoded {
        let (bytes, limit) = (block_bytes(layer) as u64, limits.max_bytes_decoded);
        return Err(ReadError::TooLarge { width: stored_width as u64, height: stored_height as u64, bytes, limit });
    }
    if matches!(layer.compression, Compression::HTJ2K32 | Compression::HTJ2K256) {
        return Err(unsupported(&layer.compression.to_string()));
    }
    let mut blocks = guarded(|| blocks::find(reader, (tables as u64, length), &meta))?;
    let blocks = blocks.swap_remove(selection.layer);
    check_plausible(layer, &blocks, length)?;
    Ok((meta, selection, blocks))
}

fn header_of(meta: &MetaData, selection: &Selection) -> Result<Header, ReadError> {
    let layer = &meta.headers[selection.layer];
    let frame = Frame::of(layer)?;
    let stated = layer.shared_attributes.chromaticities.filter(|_| selection.is_color);
    let chromaticities = stated.map(|stated| {
        let [red, green, blue, white] = [stated.red, stated.green, stated.blue, stated.white];
        [red.0, red.1, green.0, green.1, blue.0, blue.1, white.0, white.1]
    });
    let empty = || "its data window lies outside of its display window, so the picture is empty".to_owned();
    let assumed = if frame.is_empty(layer) { Some(empty()) } else { selection.assumed.clone() };
    Ok(Header {
        format: FileFormat::Exr,
        width: frame.width,
        height: frame.height,
        channels: selection.count(),
        kind: kind_of(meta, selection),
        names: all_names(meta),
        has_alpha: selection.has_alpha,
        icc: None,
        associated: selection.has_alpha,
        told: HeaderStatements { chromaticities, assumed, ..HeaderStatements::default() },
    })
}

/// A reader that records attempts to read beyond the end: the error of the `exr` crate does not distinguish a truncated
/// file from a corrupt one.
struct NotesEnd<'e, R> {
    reader: R,
    ended: &'e Cell<bool>,
}

impl<R: Read> Read for NotesEnd<'_, R> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let count = self.reader.read(bytes)?;
        if count == 0 && !bytes.is_empty() {
            self.ended.set(true);
        }
        Ok(count)
    }
}

/// The headers, and the offset of the tables of block offsets.
fn read_meta<R: Read>(reader: R) -> Result<(MetaData, usize), ReadError> {
    let ended = Cell::new(false);
    let found = read_headers(NotesEnd { reader, ended: &ended });
    found.map_err(|error| if ended.get() { ReadError::truncated("it ends within its header") } else { error })
}

fn read_headers<R: Read>(reader: R) -> Result<(MetaData, usize), ReadError> {
    let mut reader = PeekRead::new(Tracking::new(reader));
    magic_number::validate_exr(&mut reader).map_err(from_exr)?;
    let requirements = Requirements::read(&mut reader).map_err(from_exr)?;
    requirements.validate().map_err(from_exr)?;
    let headers = Layer::read_all(&mut reader, &requirements, false).map_err(from_exr)?;
    MetaData::validate(&headers, false).map_err(from_exr)?;
    for channel in headers.iter().flat_map(|layer| &layer.channels.list) {
        if channel.sampling != Vec2(1, 1) {
            return Err(ReadError::Unsupported {
                what: format!("channel `{}` has a lower resolution than the picture", channel.name),
                instead: "save it as RGB, without chroma subsampling",
            });
        }
    }
    Ok((MetaData { requirements, headers }, reader.byte_position()))
}

fn kind_of(meta: &MetaData, selection: &Selection) -> SampleKind {
    let channels = &meta.headers[selection.layer].channels.list;
    let kinds = selection.channels.iter().map(|index| match channels[*index].sample_type {
        SampleType::F16 => SampleKind::F16,
        SampleType::F32 => SampleKind::F32,
        SampleType::U32 => SampleKind::U32,
    });
    // If the channels have different types, use the largest one.
    kinds.max_by_key(|kind| kind.bytes()).unwrap_or(SampleKind::F32)
}

/// Size of a block within the layer.
fn block_size(layer: &Layer) -> Vec2<usize> {
    let Vec2(width, height) = layer.layer_size;
    match layer.blocks {
        BlockDescription::ScanLines => Vec2(width, layer.compression.scan_lines_per_block().min(height)),
        BlockDescription::Tiles(tiles) => {
            Vec2(tiles.tile_size.width().min(width), tiles.tile_size.height().min(height))
        }
    }
}

/// Bytes of an unpacked block.
fn block_bytes(layer: &Layer) -> usize {
    block_size(layer).area().saturating_mul(layer.channels.bytes_per_pixel)
}

fn check_plausible(layer: &Layer, blocks: &[Block], length: u64) -> Result<(), ReadError> {
    let stored: u64 = blocks.iter().map(|block| block.length as u64).fold(0, u64::saturating_add);
    let Vec2(width, height) = layer.layer_size;
    let raw = (width as u64).saturating_mul(height as u64).saturating_mul(layer.channels.bytes_per_pixel as u64);
    let ratio = match layer.compression {
        Compression::DWAA(_) | Compression::DWAB(_) => return Ok(()),
        Compression::Uncompressed => 1,
        // Only the lossy DWA compresses better than DEFLATE.
        _ => DEFLATE_RATIO,
    };
    if raw > stored.saturating_mul(ratio) {
        return Err(ReadError::implausible(length, width as u64, height as u64));
    }
    Ok(())
}

fn unsupported(what: &str) -> ReadError {
    ReadError::Unsupported {
        what: format!("it uses an EXR feature that is not read ({what})"),
        instead: "save it as a flat EXR with ZIP or PIZ compression",
    }
}

fn from_exr(error: exr::error::Error) -> ReadError {
    match error {
        exr::error::Error::NotSupported(what) => unsupported(&what),
        exr::error::Error::Invalid(what) => ReadError::corrupt(what),
        exr::error::Error::Io(error) => ReadError::from_decoder(&error),
        exr::error::Error::Aborted => ReadError::corrupt("its decoder gave up"),
    }
}
