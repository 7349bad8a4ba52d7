//! TIFF. The `tiff` crate reads the directories. Strips and tiles are unpacked here, because the crate refuses valid
//! ones: tiles of separate planes, LZW tiles, palettes, signed numbers.
mod directory;
mod jpeg;
mod layout;
mod places;
mod samples;
mod unpack;

use super::guard::guarded;
use super::limits::{Claim, ReadError, ReadLimits};
use super::turn::upright;
use super::{Header, Picture};
use directory::Tags;
use layout::Layout;
use places::ChunkLocations;
use std::io::{Cursor, Read, Seek};
use tiff::TiffError;

pub(super) fn header<R: Read + Seek>(reader: R) -> Result<Header, ReadError> {
    guarded(|| Ok(Layout::read(&mut Tags::open(reader)?)?.header))
}

pub(super) fn check<R: Read + Seek>(reader: R, length: u64, limits: &ReadLimits) -> Result<Header, ReadError> {
    open(reader, length, limits).map(|(layout, _)| layout.header)
}

pub(super) fn read(bytes: &[u8], limits: &ReadLimits) -> Result<Picture, ReadError> {
    let (layout, places) = open(Cursor::new(bytes), bytes.len() as u64, limits)?;
    let planes = samples::planes(bytes, &layout, &places)?;
    let Header { width, height, channels, kind, names, has_alpha, .. } = layout.header;
    upright(Picture { width, height, channels, planes, source: kind, names, has_alpha }, layout.orientation)
}

/// The checked header and the checked locations of the samples, in a file of `length` bytes.
fn open<R: Read + Seek>(reader: R, length: u64, limits: &ReadLimits) -> Result<(Layout, ChunkLocations), ReadError> {
    guarded(|| {
        let mut tags = Tags::open(reader)?;
        let layout = Layout::read(&mut tags)?;
        let (width, height) = (u64::from(layout.width), u64::from(layout.height));
        let Header { channels, kind, .. } = layout.header;
        let (channels, sample_bytes) = (u64::from(channels), kind.bytes() as u64);
        limits.check(Claim { width, height, channels, sample_bytes })?;
        let places = ChunkLocations::read(&mut tags, &layout, length)?;
        Ok((layout, places))
    })
}

fn unsupported(what: String) -> ReadError {
    ReadError::Unsupported { what, instead: "save it as grey or RGB with 8 or 16 bits or 32-bit floats" }
}

fn from_tiff(error: TiffError) -> ReadError {
    match error {
        TiffError::IoError(error) => ReadError::from_decoder(&error),
        TiffError::UnsupportedError(error) => unsupported(error.to_string()),
        TiffError::LimitsExceeded | TiffError::IntSizeError => {
            ReadError::corrupt("a size in its header is larger than the file allows")
        }
        error => ReadError::corrupt(error),
    }
}
