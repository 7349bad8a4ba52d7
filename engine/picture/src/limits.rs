//! Limits of reading, and its errors.

use super::value::files::FileHandle;
use std::path::PathBuf;

/// Limits for a picture. They are compared with the header before samples are allocated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReadLimits {
    /// Bytes of the file.
    pub max_file_bytes: u64,
    /// Pixels, for any number of channels.
    pub max_pixels: u64,
    /// Bytes of all samples as `f32` plus those of the decoder's own copy in the stored depth.
    pub max_bytes_decoded: u64,
}

impl Default for ReadLimits {
    /// A file of 2 GiB, 16384² pixels, and 2 GiB decoded.
    fn default() -> Self {
        Self { max_file_bytes: 2 << 30, max_pixels: 1 << 28, max_bytes_decoded: 2 << 30 }
    }
}

/// The maximum compression ratio of DEFLATE: 2 bits can encode 258 bytes.
pub(super) const DEFLATE_RATIO: u64 = 1032;

/// The sizes of a picture as stated in its header.
#[derive(Clone, Copy, Debug)]
pub(super) struct Claim {
    pub(super) width: u64,
    pub(super) height: u64,
    /// Number of channels that are decoded; for EXR all channels, selected or not.
    pub(super) channels: u64,
    /// Bytes of a decoded sample before it becomes `f32`.
    pub(super) sample_bytes: u64,
}

impl ReadLimits {
    /// Compares a header with the limits.
    pub(super) fn check(&self, claim: Claim) -> Result<(), ReadError> {
        let Claim { width, height, channels, sample_bytes } = claim;
        if width == 0 || height == 0 {
            return Err(ReadError::corrupt("its header says it has no pixels"));
        }
        let pixels = width.saturating_mul(height);
        if pixels > self.max_pixels {
            return Err(ReadError::TooManyPixels { width, height, limit: self.max_pixels });
        }
        let bytes = pixels.saturating_mul(channels).saturating_mul(4 + sample_bytes);
        if bytes > self.max_bytes_decoded {
            return Err(ReadError::TooLarge { width, height, bytes, limit: self.max_bytes_decoded });
        }
        Ok(())
    }
}

/// The reason why a picture cannot be read. [`FileError`] adds the path of the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The system refuses, for instance because there is no such file.
    #[error("{}; {}", reason(.0), hint(.0))]
    Io(#[source] std::io::Error),
    /// A folder, pipe, socket or device.
    #[error("it is {0}; it must be a regular file")]
    NotAFile(&'static str),
    /// The file has no bytes.
    #[error("the file is empty; save the picture again")]
    Empty,
    /// A format that is not supported.
    #[error("{0}; it must be PNG, JPEG, TIFF, OpenEXR or Radiance HDR: convert it to PNG, TIFF, JPEG or EXR")]
    UnknownFormat(String),
    /// The file ends before the picture does.
    #[error("the file is truncated: {0}; copy or save it again")]
    Truncated(String),
    /// The content contradicts itself or the format.
    #[error("the file is corrupt: {0}; copy or save it again")]
    Corrupt(String),
    /// The structure is valid, but the compressed samples cannot be unpacked. Only decoding finds this error.
    #[error("the compressed data is damaged: {0}; copy or save it again")]
    Damaged(String),
    /// A valid file with a feature that is not supported.
    #[error("{what}; {instead}")]
    Unsupported {
        /// The feature.
        what: String,
        /// A remedy.
        instead: &'static str,
    },
    /// The file has no such layer or channel.
    #[error("there is no layer or channel `{wanted}`; it must be one of {existing}")]
    NoSuchLayer {
        /// The name asked for.
        wanted: String,
        /// The channels in the file.
        existing: String,
    },
    /// More bytes in the file than allowed.
    #[error("the file has {bytes} bytes; it must have at most {limit}: make the picture smaller")]
    FileTooLarge {
        /// Bytes of the file.
        bytes: u64,
        /// The limit.
        limit: u64,
    },
    /// More pixels than allowed.
    #[error("the picture has `{width}x{height}` pixels; it must have at most {limit}: scale it down")]
    TooManyPixels {
        /// Width in the header.
        width: u64,
        /// Height in the header.
        height: u64,
        /// The limit.
        limit: u64,
    },
    /// More memory needed than allowed.
    #[error(
        "the picture of `{width}x{height}` pixels needs {} MiB to decode; it must need at most {} MiB: scale it down or \
         raise the limit", .bytes.div_ceil(1 << 20), .limit >> 20
    )]
    TooLarge {
        /// Width in the header.
        width: u64,
        /// Height in the header.
        height: u64,
        /// Bytes it would take.
        bytes: u64,
        /// The limit.
        limit: u64,
    },
}

impl ReadError {
    pub(super) fn corrupt(reason: impl ToString) -> Self {
        Self::Corrupt(clean(&reason.to_string()))
    }

    pub(super) fn truncated(reason: impl ToString) -> Self {
        Self::Truncated(clean(&reason.to_string()))
    }

    pub(super) fn damaged(reason: impl ToString) -> Self {
        Self::Damaged(clean(&reason.to_string()))
    }

    /// Attributes an error of a decoder to the compressed samples.
    pub(super) fn in_data(self) -> Self {
        match self {
            Self::Truncated(reason) | Self::Corrupt(reason) => Self::Damaged(reason),
            other => other,
        }
    }

    /// The error for a file of `bytes` bytes, which is too short for its pixels.
    pub(super) fn implausible(bytes: u64, width: impl Into<u64>, height: impl Into<u64>) -> Self {
        let (width, height) = (width.into(), height.into());
        Self::Corrupt(format!("{bytes} bytes cannot hold the `{width}x{height}` pixels of its header"))
    }

    /// Classifies errors of streams in memory: an early end means a truncated file.
    pub(super) fn from_decoder(error: &std::io::Error) -> Self {
        if error.kind() == std::io::ErrorKind::UnexpectedEof {
            Self::truncated("it ends within the picture")
        } else {
            Self::corrupt(error)
        }
    }

    /// True if there is no such file.
    #[must_use]
    pub fn is_not_found(&self) -> bool {
        matches!(self, Self::Io(error) if error.kind() == std::io::ErrorKind::NotFound)
    }

    /// True if a limit was exceeded.
    #[must_use]
    pub fn is_too_large(&self) -> bool {
        matches!(self, Self::FileTooLarge { .. } | Self::TooManyPixels { .. } | Self::TooLarge { .. })
    }
}

/// Decoders quote the file in their messages: replaces control characters and cuts long messages.
fn clean(message: &str) -> String {
    let message = message.trim_end_matches('.');
    message.chars().map(|c| if c.is_control() { ' ' } else { c }).take(200).collect()
}

fn reason(error: &std::io::Error) -> String {
    match error.kind() {
        std::io::ErrorKind::NotFound => "there is no such file".into(),
        std::io::ErrorKind::PermissionDenied => "it may not be read".into(),
        _ => format!("it cannot be read: {error}"),
    }
}

fn hint(error: &std::io::Error) -> &'static str {
    match error.kind() {
        std::io::ErrorKind::NotFound => "check the path",
        std::io::ErrorKind::PermissionDenied => "change its permissions",
        _ => "check the disk and try again",
    }
}

/// A [`ReadError`] with the file it concerns.
#[derive(Debug, thiserror::Error)]
#[error("`{}`: {reason}", .path.display())]
pub struct FileError {
    /// The file.
    pub path: PathBuf,
    /// The error.
    #[source]
    pub reason: ReadError,
}

impl FileError {
    pub(super) fn of(file: &FileHandle, reason: ReadError) -> Self {
        Self { path: file.path().to_path_buf(), reason }
    }
}

/// Names in backticks, for messages; long lists are cut.
pub(super) fn list(names: &[String]) -> String {
    const MOST: usize = 40;
    let mut quoted: Vec<String> = names.iter().take(MOST).map(|name| format!("`{}`", name.escape_debug())).collect();
    if names.len() > MOST {
        quoted.push("…".into());
    }
    quoted.join(", ")
}
