//! Specifications of pictures to write, and the errors of writing.

use super::mips::MipFilter;
use crate::value::diagnostics::Problem;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::{Path, PathBuf};

/// The formats that can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Format {
    /// PNG with 8 or 16 bits.
    Png,
    /// TIFF with 8 or 16 bits or 32-bit floats; BigTIFF when 4 GiB do not suffice.
    Tiff,
    /// OpenEXR with 16 or 32-bit floats.
    Exr,
    /// JPEG with 8 bits and this quality, 1 to 100: only for colours of materials for other programs.
    Jpeg(u8),
    /// SVG: lines, for plotters and laser engravers. Holds `Segments` and no pixels; see [`svg`](super::svg).
    Svg,
}

impl Format {
    /// All formats of outputs.
    pub const ALL: [Self; 4] = [Self::Png, Self::Tiff, Self::Exr, Self::Svg];

    /// Name in graph files and messages.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Png => "Png",
            Self::Tiff => "Tiff",
            Self::Exr => "Exr",
            Self::Jpeg(_) => "Jpeg",
            Self::Svg => "Svg",
        }
    }

    /// The supported depths of the format, the default first.
    #[must_use]
    pub fn depths(self) -> &'static [Depth] {
        match self {
            Self::Png => &[Depth::U8, Depth::U16],
            Self::Tiff => &[Depth::U16, Depth::U8, Depth::F32],
            Self::Exr => &[Depth::F16, Depth::F32],
            Self::Jpeg(_) => &[Depth::U8],
            Self::Svg => &[],
        }
    }

    /// The format for a file extension in lower case.
    #[must_use]
    pub fn from_extension(extension: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|format| format.extension() == extension)
    }

    /// True if the format can have mip levels.
    #[must_use]
    pub const fn has_mips(self) -> bool {
        matches!(self, Self::Exr | Self::Tiff)
    }

    /// The file extension, without dot.
    #[must_use]
    pub fn extension(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Tiff => "tiff",
            Self::Exr => "exr",
            Self::Jpeg(_) => "jpg",
            Self::Svg => "svg",
        }
    }

    /// Maximum number of channels.
    #[must_use]
    pub fn max_channels(self) -> usize {
        match self {
            Self::Png | Self::Tiff => 4,
            Self::Exr => 64,
            Self::Jpeg(_) => 3,
            Self::Svg => 0,
        }
    }
}

impl fmt::Display for Format {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}

/// The stored type of samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Depth {
    /// 8-bit integers.
    U8,
    /// 16-bit integers.
    U16,
    /// 16-bit floats.
    F16,
    /// 32-bit floats.
    F32,
}

impl Depth {
    /// All depths.
    pub const ALL: [Self; 4] = [Self::U8, Self::U16, Self::F16, Self::F32];

    /// Name in graph files and messages.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::U8 => "U8",
            Self::U16 => "U16",
            Self::F16 => "F16",
            Self::F32 => "F32",
        }
    }

    /// Bytes of a sample.
    #[must_use]
    pub fn bytes(self) -> usize {
        match self {
            Self::U8 => 1,
            Self::U16 | Self::F16 => 2,
            Self::F32 => 4,
        }
    }

    /// True if samples are integers.
    #[must_use]
    pub fn is_integer(self) -> bool {
        matches!(self, Self::U8 | Self::U16)
    }
}

impl fmt::Display for Depth {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}

/// The curve between values and integers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Transfer {
    /// None: data.
    #[default]
    Raw,
    /// The sRGB curve: encodes linear colour for screens.
    Srgb,
}

/// The mapping from values to integers. Float depths keep the values and ignore all of this.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Encoding {
    /// The curve, applied after `range`. Opacity (the last of 2 or 4 channels) is always raw.
    pub transfer: Transfer,
    /// The values that become the least and the greatest integer; 0 and 1 by default. Not for opacity.
    pub range: Option<(f32, f32)>,
    /// Dithers by ±½ step with a fixed pattern of positions (the R2 sequence, which has the even spacing of blue
    /// noise).
    pub dither: bool,
    /// Position of the picture's first pixel in the dither pattern, so that a part of a picture is dithered as in the
    /// whole.
    pub origin: (u32, u32),
}

/// The effort for small files. It never changes samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Compression {
    /// As fast as disks are.
    #[default]
    Fast,
    /// Smaller files that take several times as long.
    Best,
}

/// The specification of a picture: everything except its samples.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PictureSpec {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Names of the channels, in the order of the given planes. PNG and TIFF use only their number (1 grey, 2 grey and
    /// opacity, 3 RGB, 4 RGB and opacity); EXR stores the names, such as `R` or `base_color.R`.
    pub channels: Vec<String>,
    /// The format.
    pub format: Format,
    /// The depth, one for all channels.
    pub depth: Depth,
    /// The mapping from values to integers.
    pub encoding: Encoding,
    /// The compression effort.
    pub compression: Compression,
    /// For an EXR or TIFF with tiles and mip levels: the filters of the mip levels, channel after channel. Empty for a
    /// file of rows without mip levels.
    pub mips: Vec<MipFilter>,
    /// The primaries and the white in the header of an EXR: x and y of red, green, blue and white.
    pub chromaticities: Option<[f32; 8]>,
    /// Width and height of a pixel in mm, if known: for the header of all formats.
    pub pixel_mm: Option<[f32; 2]>,
    /// Pairs of a name and a text for the header. `Software` has its own field in every format.
    pub metadata: Vec<(String, String)>,
}

impl PictureSpec {
    /// A grey picture of data without metadata, for [`write_bilevel`](super::write_bilevel).
    pub(crate) fn bilevel((width, height): (u32, u32), format: Format, pixel_mm: [f32; 2]) -> Self {
        Self {
            width,
            height,
            channels: vec!["Y".to_owned()],
            format,
            depth: Depth::U8,
            encoding: Encoding::default(),
            compression: Compression::Fast,
            mips: Vec::new(),
            chromaticities: None,
            pixel_mm: Some(pixel_mm),
            metadata: Vec::new(),
        }
    }

    /// Checks that the file can be written.
    ///
    /// # Errors
    /// For unsupported depths and numbers of channels, empty pictures, empty ranges, and names of EXR channels that are
    /// empty or not unique.
    pub fn check(&self) -> Result<(), WriteError> {
        let Self { width, height, format, depth, .. } = *self;
        if !format.depths().contains(&depth) {
            return Err(WriteError::Depth { format, depth, allowed: list(format.depths()) });
        }
        let (count, most) = (self.channels.len(), format.max_channels());
        let jpeg = matches!(format, Format::Jpeg(_));
        if count == 0 || count > most || (jpeg && count == 2) {
            return Err(WriteError::Channels { format, count, most });
        }
        // EXR and PNG have 31 bits for width and height.
        if width == 0 || height == 0 || width.max(height) > i32::MAX.unsigned_abs() {
            return Err(WriteError::Size { width, height });
        }
        if jpeg && width.max(height) > u32::from(u16::MAX) {
            return Err(WriteError::JpegSize { width, height });
        }
        if let Format::Jpeg(quality @ (0 | 101..)) = format {
            return Err(WriteError::Quality(quality));
        }
        match self.encoding.range {
            Some((low, high)) if !(low.is_finite() && high.is_finite() && low != high) => {
                return Err(WriteError::Range { low, high });
            }
            _ => {}
        }
        let made: usize = self.mips.iter().map(|filter| filter.channels()).sum();
        if !self.mips.is_empty() && (!format.has_mips() || made != count) {
            return Err(WriteError::Mips { format });
        }
        if format == Format::Exr { self.check_names() } else { Ok(()) }
    }

    /// Number of planes in the rows given to the writer: the channels, and planes that only mip filters read.
    #[must_use]
    pub fn planes(&self) -> usize {
        let beyond = self.mips.iter().map(|filter| match filter {
            MipFilter::Roughness { normal } => normal + 3,
            MipFilter::Mean | MipFilter::Normal => 0,
        });
        beyond.max().unwrap_or(0).max(self.channels.len())
    }

    /// Number of pixels across and down in `mm` millimetres, rounded, if it is known and lies in 1 to `most`.
    pub(super) fn density(&self, mm: f32, most: u32) -> Option<[u32; 2]> {
        let counts = self.pixel_mm?.map(|size| (mm / size).round());
        let fits = |count: f32| count >= 1.0 && f64::from(count) <= f64::from(most);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "they fit, as was seen")]
        counts.iter().all(|count| fits(*count)).then(|| counts.map(|count| count as u32))
    }

    fn check_names(&self) -> Result<(), WriteError> {
        for (index, name) in self.channels.iter().enumerate() {
            let fits = (1..=255).contains(&name.len()) && name.bytes().all(|byte| byte.is_ascii_graphic());
            if !fits || self.channels[..index].contains(name) {
                return Err(WriteError::ChannelName(name.clone()));
            }
        }
        Ok(())
    }

    /// Bytes of an uncompressed row.
    #[must_use]
    pub fn row_bytes(&self) -> u64 {
        u64::from(self.width) * (self.channels.len() * self.depth.bytes()) as u64
    }

    /// Index of the opacity channel.
    #[must_use]
    pub fn alpha(&self) -> Option<usize> {
        match (self.format, self.channels.len()) {
            (Format::Exr, _) => None,
            (_, count @ (2 | 4)) => Some(count - 1),
            _ => None,
        }
    }
}

fn list(depths: &[Depth]) -> String {
    depths.iter().map(|depth| format!("`{depth}`")).collect::<Vec<_>>().join(" or ")
}

/// The reason why a picture cannot be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// An unsupported combination of format and depth.
    #[error("depth is `{depth}`; for format `{format}` it must be {allowed}")]
    Depth {
        /// The format.
        format: Format,
        /// The depth.
        depth: Depth,
        /// The supported depths.
        allowed: String,
    },
    /// Too many channels, or none.
    #[error("the picture has `{count}` channels; for format `{format}` it must have 1 to {most}: write several files")]
    Channels {
        /// The format.
        format: Format,
        /// The number.
        count: usize,
        /// The greatest number.
        most: usize,
    },
    /// No pixels, or too many pixels.
    #[error("the picture has `{width}x{height}` pixels; each side must be between 1 and 2147483647")]
    Size {
        /// Width.
        width: u32,
        /// Height.
        height: u32,
    },
    /// More pixels than JPEG supports.
    #[error("the picture has `{width}x{height}` pixels; a JPEG has at most 65535 a side: write colours as PNG")]
    JpegSize {
        /// Width.
        width: u32,
        /// Height.
        height: u32,
    },
    /// A quality that JPEG does not support.
    #[error("quality is `{0}`; it must be a number from 1 to 100")]
    Quality(u8),
    /// Mip levels in a format without them, or not for all channels.
    #[error("mip levels of all channels can be written to `Exr` and `Tiff`, not to `{format}`")]
    Mips {
        /// The format.
        format: Format,
    },
    /// A range that is empty or not finite.
    #[error("range is `({low}, {high})`; it must be two different, finite numbers")]
    Range {
        /// Value of the least integer.
        low: f32,
        /// Value of the greatest integer.
        high: f32,
    },
    /// A channel name that EXR does not allow.
    #[error("a channel is called `{}`; it must have a unique name of 1 to 255 letters, digits and signs", .0.escape_debug())]
    ChannelName(String),
    /// The given rows do not fit the picture.
    #[error("rows `{first}` to `{end}` were handed over; they must be whole rows of all channels, at most `{height}`")]
    Rows {
        /// The first row.
        first: u32,
        /// The row behind the last.
        end: u32,
        /// Rows of the picture.
        height: u32,
    },
    /// The values do not suit the file.
    #[error("{0}")]
    Unfit(Box<Problem>),
    /// The disk is full.
    #[error("`{}` cannot be written: the disk is full; make room or write elsewhere", .path.display())]
    DiskFull {
        /// The file.
        path: PathBuf,
    },
    /// The system refuses.
    #[error("`{}` cannot be written: {source}; check the folder and its permissions", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The error of the system.
        source: std::io::Error,
    },
}

impl WriteError {
    /// Adds the path to an error of the system.
    #[must_use]
    pub fn at(path: &Path, source: std::io::Error) -> Self {
        let path = path.to_path_buf();
        match source.kind() {
            std::io::ErrorKind::StorageFull | std::io::ErrorKind::QuotaExceeded => Self::DiskFull { path },
            _ => Self::Io { path, source },
        }
    }
}

/// Metadata as one text.
pub(super) fn described(metadata: &[(String, String)]) -> String {
    metadata.iter().map(|(name, text)| format!("{name}: {text}")).collect::<Vec<_>>().join("\n")
}

/// Header attributes that tell renderers, with the names of OpenImageIO, that the file is a texture and whether it
/// repeats.
#[must_use]
pub fn texture_attributes(wraps: [bool; 2]) -> Vec<(String, String)> {
    let mode = |wraps: bool| if wraps { "periodic" } else { "clamp" };
    let modes = format!("{},{}", mode(wraps[0]), mode(wraps[1]));
    vec![("textureformat".to_owned(), "Plain Texture".to_owned()), ("wrapmodes".to_owned(), modes)]
}
