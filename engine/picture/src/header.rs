//! Format detection and reading of headers, without decoding.

use super::limits::{FileError, ReadError, ReadLimits, list};
use super::value::files::{Content, FileHandle, FileKind};
use super::{SampleKind, foreign, read_exr, read_hdr, read_jpeg, read_png, read_tiff};
use std::io::{BufRead, BufReader, Cursor, Read, Seek};

/// The formats that can be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FileFormat {
    /// Portable Network Graphics.
    Png,
    /// JPEG.
    Jpeg,
    /// TIFF and BigTIFF.
    Tiff,
    /// OpenEXR.
    Exr,
    /// Radiance HDR.
    Hdr,
}

/// The header of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Header {
    /// The format, by content.
    pub format: FileFormat,
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Number of channels that [`read`](super::read) gives, 1 to 4.
    pub channels: u8,
    /// The stored type of these channels.
    pub kind: SampleKind,
    /// Names of all channels in the file, for EXR with their layer; more than `channels` if there are layers.
    pub names: Vec<String>,
    /// True if the last of the channels is opacity.
    pub has_alpha: bool,
    /// The ICC profile as stored.
    pub icc: Option<Vec<u8>>,
    /// True if the file declares that its colours are premultiplied by opacity.
    pub associated: bool,
    /// Its other statements about colours and channels.
    pub told: HeaderStatements,
}

/// Statements of a header about colours and channels, without the ICC profile.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HeaderStatements {
    /// Code points for primaries, curve, matrix and range (ITU-T H.273): the chunk `cICP` of PNG.
    pub cicp: Option<[u8; 4]>,
    /// The reason why the ICC profile cannot be extracted, as `is …`.
    pub broken_profile: Option<String>,
    /// True if the file is marked as sRGB.
    pub srgb: bool,
    /// The encoding gamma times 100,000: the chunk `gAMA` of PNG.
    pub gamma: Option<u32>,
    /// The chromaticities x and y of red, green, blue and white.
    pub chromaticities: Option<[f32; 8]>,
    /// The assumption made because the names or positions of the channels are ambiguous.
    pub assumed: Option<String>,
}

/// Reads the header of a file. Limits are not applied, so that a caller can report the size.
///
/// # Errors
/// When the file cannot be opened or is not a picture that [`read`](super::read) supports.
pub fn header(file: impl Into<FileHandle>) -> Result<Header, FileError> {
    of_file(&file.into(), None)
}

/// Like [`header`], for the channels that [`read_layer`](super::read_layer) gives for this name.
///
/// # Errors
/// See [`header`]; also when there is no such layer or channel.
pub fn header_layer(file: impl Into<FileHandle>, layer: &str) -> Result<Header, FileError> {
    of_file(&file.into(), Some(layer))
}

/// A text in the metadata of an EXR file, by its name in [`PictureSpec::metadata`](super::PictureSpec); `None` for
/// other formats.
///
/// # Errors
/// See [`header`].
pub fn text(file: impl Into<FileHandle>, name: &str) -> Result<Option<String>, FileError> {
    let file = file.into();
    let reading = open(&file, u64::MAX).and_then(|(content, _)| {
        let mut reader = BufReader::new(content);
        let start = reader.fill_buf().map_err(ReadError::Io)?;
        if sniff(start)? == FileFormat::Exr { read_exr::text(reader, name) } else { Ok(None) }
    });
    reading.map_err(|reason| FileError::of(&file, reason))
}

fn of_file(file: &FileHandle, layer: Option<&str>) -> Result<Header, FileError> {
    let at = |reason| FileError::of(file, reason);
    let (content, _) = open(file, u64::MAX).map_err(at)?;
    of_reader(BufReader::new(content), layer).map_err(at)
}

/// Reads the header of a file in memory.
///
/// # Errors
/// When it is not a picture that [`read`](super::read) supports.
pub fn header_bytes(bytes: &[u8]) -> Result<Header, ReadError> {
    of_reader(Cursor::new(bytes), None)
}

fn of_reader<R: BufRead + Seek>(mut reader: R, layer: Option<&str>) -> Result<Header, ReadError> {
    let start = reader.fill_buf().map_err(ReadError::Io)?;
    let format = sniff(start)?;
    let header = match format {
        FileFormat::Png => read_png::header(reader),
        FileFormat::Jpeg => read_jpeg::header(reader),
        FileFormat::Tiff => read_tiff::header(reader),
        FileFormat::Exr => read_exr::header(reader, layer),
        FileFormat::Hdr => read_hdr::header(reader),
    }?;
    of_layer(header, layer)
}

/// Checks a file to its end without decoding it. Finds everything that [`read`](super::read) would refuse, except
/// damage in the compressed samples. Returns the header; with a layer, that of [`read_layer`](super::read_layer).
///
/// # Errors
/// See [`ReadError`]; includes the path of the file.
pub fn check(file: impl Into<FileHandle>, layer: Option<&str>, limits: &ReadLimits) -> Result<Header, FileError> {
    let file = file.into();
    let at = |reason| FileError::of(&file, reason);
    let (content, length) = open(&file, limits.max_file_bytes).map_err(at)?;
    checked(&mut BufReader::new(content), length, layer, limits).map_err(at)
}

/// Like [`check`], for a file in memory.
///
/// # Errors
/// See [`ReadError`].
pub fn check_bytes(bytes: &[u8], limits: &ReadLimits) -> Result<Header, ReadError> {
    checked(&mut Cursor::new(bytes), bytes.len() as u64, None, limits)
}

fn checked<R: BufRead + Seek>(
    reader: &mut R,
    length: u64,
    layer: Option<&str>,
    limits: &ReadLimits,
) -> Result<Header, ReadError> {
    let format = match sniff(reader.fill_buf().map_err(ReadError::Io)?) {
        Err(ReadError::UnknownFormat(_)) => return Err(ReadError::UnknownFormat(foreign::name(reader, length)?)),
        found => found?,
    };
    let header = match format {
        FileFormat::Png => read_png::check(reader, length, limits),
        FileFormat::Jpeg => {
            let mut bytes = Vec::new();
            reader.take(length).read_to_end(&mut bytes).map_err(ReadError::Io)?;
            read_jpeg::check(&bytes, limits)
        }
        FileFormat::Tiff => read_tiff::check(reader, length, limits),
        FileFormat::Exr => read_exr::check(reader, length, limits, layer),
        FileFormat::Hdr => read_hdr::check(reader, length, limits),
    }?;
    of_layer(header, layer)
}

/// The header of one channel, in a format without layers.
fn of_layer(header: Header, layer: Option<&str>) -> Result<Header, ReadError> {
    match layer {
        Some(layer) if header.format != FileFormat::Exr => {
            position(&header.names, layer)?;
            Ok(Header { channels: 1, has_alpha: false, ..header })
        }
        _ => Ok(header),
    }
}

/// Index of a channel in a file without layers.
pub(super) fn position(names: &[String], wanted: &str) -> Result<usize, ReadError> {
    let missing = || ReadError::NoSuchLayer { wanted: wanted.to_owned(), existing: list(names) };
    names.iter().position(|own| own == wanted).ok_or_else(missing)
}

/// Opens a regular file of at most `limit` bytes; returns its length too.
fn open(file: &FileHandle, limit: u64) -> Result<(Box<dyn Content>, u64), ReadError> {
    let facts = file.facts().map_err(ReadError::Io)?;
    match (facts.kind, facts.length) {
        (FileKind::Regular, 0) => Err(ReadError::Empty),
        (FileKind::Regular, bytes) if bytes > limit => Err(ReadError::FileTooLarge { bytes, limit }),
        (FileKind::Regular, bytes) => Ok((file.open().map_err(ReadError::Io)?, bytes)),
        (other, _) => Err(ReadError::NotAFile(other.name())),
    }
}

/// The whole content of a regular file.
pub(super) fn load(file: &FileHandle, limits: &ReadLimits) -> Result<Vec<u8>, ReadError> {
    let (content, length) = open(file, limits.max_file_bytes)?;
    let mut bytes = Vec::new();
    let capacity = usize::try_from(length).map_err(ReadError::corrupt)?;
    bytes.try_reserve_exact(capacity).map_err(|error| ReadError::Io(std::io::Error::other(error)))?;
    // If the file grows meanwhile, read only the first `length` bytes.
    content.take(length).read_to_end(&mut bytes).map_err(ReadError::Io)?;
    Ok(bytes)
}

/// Detects the format by the first bytes.
pub(super) fn sniff(start: &[u8]) -> Result<FileFormat, ReadError> {
    match start {
        [] => Err(ReadError::Empty),
        [0x89, b'P', b'N', b'G', ..] => Ok(FileFormat::Png),
        [0xff, 0xd8, 0xff, ..] => Ok(FileFormat::Jpeg),
        [b'I', b'I', 42 | 43, 0, ..] | [b'M', b'M', 0, 42 | 43, ..] => Ok(FileFormat::Tiff),
        [0x76, 0x2f, 0x31, 0x01, ..] => Ok(FileFormat::Exr),
        _ if start.starts_with(b"#?RADIANCE") || start.starts_with(b"#?RGBE") => Ok(FileFormat::Hdr),
        _ => Err(ReadError::UnknownFormat(foreign::name_of_start(start))),
    }
}
