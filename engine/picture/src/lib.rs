//! Picture files: reads files of users and writes results of graphs.
//!
//! **Reading** ([`read`], [`read_bytes`], [`header`]) supports PNG, JPEG, TIFF, OpenEXR and Radiance HDR, detected by
//! content. Files are not trusted. Only regular files are opened. The sizes in the header are compared with [`ReadLimits`] and with
//! the maximum that the file's length can hold before anything is allocated. Then the file is followed to its end,
//! chunk by chunk, marker by marker or block by block, before a sample is decoded; [`check`] does only this. A
//! truncated or corrupt file is an error, never half a picture.
//!
//! **Writing** ([`Writer`]) takes bands of rows from top to bottom and needs memory for a band, not for the picture.
//! Files appear under their name when they are complete ([`AtomicFile`]) and contain no date. Equal input gives equal
//! bytes for any number of threads and any height of the bands.
//!
//! Samples are planar `f32` on both sides: integers are scaled to 0..1, floats are kept. Reading never converts colour
//! spaces; the caller does that ([`Conversion`]) with the statements of the header.
//!
//! **Export** ([`export`]) writes materials in the forms that other programs read.
#![cfg_attr(test, allow(clippy::disallowed_methods, reason = "tests compare with the system's own functions"))]
pub mod export;

mod atomic;
mod color;
mod conversion;
mod curve;
mod encode;
mod foreign;
mod guard;
mod header;
mod icc;
mod levels;
mod limits;
mod lossless;
mod mips;
mod part;
mod primaries;
mod raster;
mod read;
mod read_exr;
mod read_hdr;
mod read_jpeg;
mod read_png;
mod read_tiff;
mod spec;
mod statements;
mod turn;
mod udim;
mod write;
mod write_bilevel;
mod write_exr;
mod write_jpeg;
mod write_png;
mod write_svg;
mod write_tiff;
mod zip;

pub use atomic::{AtomicFile, is_temporary, remove_stale_temporaries, taken_files};
pub use color::{REC709_TO_AP1, SrgbEncoder, linear_sample};
pub use conversion::{ColorSpace, Conversion, divide_by_alpha};
pub use guard::{caught, contain_thread, contained};
pub use header::{FileFormat, Header, HeaderStatements, check, check_bytes, header, header_bytes, header_layer, text};
pub use limits::{FileError, ReadError, ReadLimits};
pub use mips::MipFilter;
pub use part::{
    JoinError, Joined, JoinedFile, JoinedPart, PartHeader, PartOf, PartPicture, PartWriter, is_output_letter, is_whole,
    join,
};
pub use read::{read, read_bytes, read_layer};
pub use spec::{Compression, Depth, Encoding, Format, PictureSpec, Transfer, WriteError, texture_attributes};
pub use udim::{UdimFile, is_udim, udim_file, udim_files};
pub use write::{WriteStats, Writer, encoded_rows, in_memory};
pub use write_svg::{Drawing, svg};
pub use zip::ZipWriter;

use shibo_value as value;

/// The fingerprint of this crate's code and of the libraries that it uses.
pub const CODE: &str = env!("CODE_FINGERPRINT");

/// The stored type of the samples of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SampleKind {
    /// 8-bit integers, scaled to 0..1; also pictures of 1, 2 and 4 bits, which are widened.
    U8,
    /// 16-bit integers, scaled to 0..1.
    U16,
    /// 16-bit floats, unchanged.
    F16,
    /// 32-bit floats, unchanged.
    F32,
    /// 32-bit integers: scaled to 0..1 in TIFF; unchanged in EXR, where they are object ids.
    U32,
    /// Signed 8-bit integers, 127 scaled to 1.
    I8,
    /// Signed 16-bit integers, 32767 scaled to 1.
    I16,
    /// Signed 32-bit integers, the greatest scaled to 1.
    I32,
}

impl SampleKind {
    /// Bytes of one stored sample.
    #[must_use]
    pub fn bytes(self) -> usize {
        match self {
            Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 | Self::F16 => 2,
            Self::F32 | Self::U32 | Self::I32 => 4,
        }
    }

    /// True for signed integers.
    #[must_use]
    pub fn is_signed(self) -> bool {
        matches!(self, Self::I8 | Self::I16 | Self::I32)
    }

    /// True if the samples are floats.
    #[must_use]
    pub fn is_float(self) -> bool {
        matches!(self, Self::F16 | Self::F32)
    }
}

/// A decoded picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Width in pixels, at least 1.
    pub width: u32,
    /// Height in pixels, at least 1.
    pub height: u32,
    /// Number of channels, 1 to 4.
    pub channels: u8,
    /// All samples: channel after channel, each row by row from y = 0.
    pub planes: Vec<f32>,
    /// The stored type of the samples.
    pub source: SampleKind,
    /// Names of the channels in the order of `planes`: those of the file for EXR, else `Y` or `R`, `G`, `B`, and `A`.
    pub names: Vec<String>,
    /// True if the last channel is opacity.
    pub has_alpha: bool,
}

/// A NaN or infinite sample, and its position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NonFinite {
    /// Column, from 0.
    pub x: u32,
    /// Row, from 0.
    pub y: u32,
    /// Channel, from 0.
    pub channel: u8,
    /// The sample.
    pub value: f32,
}

impl Picture {
    /// Number of samples of one channel.
    #[must_use]
    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// The samples of a channel, row by row.
    ///
    /// # Panics
    /// When there is no such channel.
    #[must_use]
    pub fn plane(&self, channel: u8) -> &[f32] {
        let pixels = self.pixels();
        &self.planes[usize::from(channel) * pixels..][..pixels]
    }

    /// Number of channels of colour or data, without opacity.
    #[must_use]
    pub fn data_channels(&self) -> u8 {
        self.channels - u8::from(self.has_alpha)
    }

    /// Number of NaN or infinite samples. Always 0 for pictures stored as integers.
    #[must_use]
    pub fn count_non_finite(&self) -> usize {
        self.planes.iter().filter(|sample| !sample.is_finite()).count()
    }

    /// The first NaN or infinite sample, by channel and then by rows.
    #[must_use]
    pub fn first_non_finite(&self) -> Option<NonFinite> {
        let index = self.planes.iter().position(|sample| !sample.is_finite())?;
        let (channel, pixel) = (index / self.pixels(), index % self.pixels());
        let width = self.width as usize;
        Some(NonFinite {
            x: u32::try_from(pixel % width).ok()?,
            y: u32::try_from(pixel / width).ok()?,
            channel: u8::try_from(channel).ok()?,
            value: self.planes[index],
        })
    }
}

/// Default channel names for formats without names.
fn default_names(channels: u8) -> Vec<String> {
    let names: &[&str] = match channels {
        1 => &["Y"],
        2 => &["Y", "A"],
        3 => &["R", "G", "B"],
        _ => &["R", "G", "B", "A"],
    };
    names.iter().map(ToString::to_string).collect()
}
