//! Names of formats that cannot be read, for messages.
use super::limits::ReadError;
use std::io::{BufRead, Read, Seek, SeekFrom};

/// First bytes of files, and the format that they indicate.
const STARTS: &[(&[u8], &str)] = &[
    (b"GIF8", "GIF"),
    (b"BM", "BMP"),
    (b"8BPS", "a Photoshop document (PSD or PSB)"),
    (b"DDS ", "DDS"),
    (b"qoif", "QOI"),
    (b"\x00\x00\x01\x00", "an icon (ICO)"),
    (b"gimp xcf", "a GIMP document (XCF)"),
    (b"farbfeld", "farbfeld"),
    (b"\xabKTX ", "KTX"),
    (b"\0\0\0\x0cjP", "JPEG 2000"),
    (b"\xff\x4f\xff\x51", "JPEG 2000"),
    (b"\xff\x0a", "JPEG XL"),
    (b"\0\0\0\x0cJXL", "JPEG XL"),
    (b"%PDF", "PDF"),
    (b"%!PS", "PostScript"),
    (b"PK\x03\x04", "a ZIP archive"),
    (b"\x1f\x8b", "compressed by gzip"),
    (b"7z\xbc\xaf", "a 7z archive"),
    (b"Rar!", "a RAR archive"),
    (b"version https://git-lfs", "a Git LFS pointer, not the file itself"),
];

/// Formats of ISO base media files, by the brand after `ftyp`.
const BRANDS: &[(&[u8], &str)] = &[
    (b"avif", "AVIF"),
    (b"avis", "AVIF"),
    (b"heic", "HEIC"),
    (b"heix", "HEIC"),
    (b"heim", "HEIC"),
    (b"heis", "HEIC"),
    (b"hevc", "HEIC"),
    (b"mif1", "HEIC or AVIF"),
    (b"msf1", "HEIC or AVIF"),
    (b"crx ", "a camera's raw picture (CR3)"),
];

/// The last bytes of a TGA file.
const TGA_END: &[u8] = b"TRUEVISION-XFILE.\0";

/// Name of the format of a file of `length` bytes whose format is not supported.
pub(super) fn name<R: BufRead + Seek>(reader: &mut R, length: u64) -> Result<String, ReadError> {
    let start = reader.fill_buf().map_err(ReadError::Io)?.to_vec();
    let mut end = Vec::new();
    reader.seek(SeekFrom::Start(length.saturating_sub(TGA_END.len() as u64))).map_err(ReadError::Io)?;
    reader.take(TGA_END.len() as u64).read_to_end(&mut end).map_err(ReadError::Io)?;
    Ok(if end == TGA_END { "it is TGA".to_owned() } else { name_of_start(&start) })
}

/// Name of the format that the first bytes of a file indicate.
pub(super) fn name_of_start(start: &[u8]) -> String {
    if let Some((_, name)) = STARTS.iter().find(|(magic, _)| start.starts_with(magic)) {
        return format!("it is {name}");
    }
    match (start, start.get(4..8), start.get(8..12)) {
        ([b'R', b'I', b'F', b'F', ..], _, Some(b"WEBP")) => "it is WebP".into(),
        ([b'R', b'I', b'F', b'F', ..], ..) => "it is a RIFF file, perhaps sound or film".into(),
        (_, Some(b"ftyp"), Some(brand)) => match BRANDS.iter().find(|(known, _)| *known == brand) {
            Some((_, name)) => format!("it is {name}"),
            None => "it is a film, or a picture kept like one".into(),
        },
        ([b'P', b'1'..=b'7' | b'F' | b'f', b'\n' | b'\r' | b' ' | b'\t', ..], ..) => "it is PNM or PFM".into(),
        _ if is_tga(start) => "it looks like TGA".into(),
        _ => name_of_text(start),
    }
}

/// True if a header fits TGA, which has no magic number: a known type, a usual bit depth, and at least one pixel.
fn is_tga(start: &[u8]) -> bool {
    let Some(&[_, map, sort, _, _, _, _, map_bits, _, _, _, _, w0, w1, h0, h1, bits, _]) = start.first_chunk() else {
        return false;
    };
    let colors = match (map, sort) {
        (1, 1 | 9) => matches!(map_bits, 15 | 16 | 24 | 32) && bits == 8,
        (0, 2 | 10) => matches!(bits, 15 | 16 | 24 | 32),
        (0, 3 | 11) => matches!(bits, 8 | 16),
        _ => false,
    };
    colors && [w0, w1] != [0, 0] && [h0, h1] != [0, 0]
}

/// Kind of a text file, if the bytes are text.
fn name_of_text(start: &[u8]) -> String {
    let valid = match std::str::from_utf8(start) {
        Ok(text) => text,
        // The last character may be cut off at the end of the bytes read.
        Err(error) if error.valid_up_to() + 4 > start.len() => {
            std::str::from_utf8(&start[..error.valid_up_to()]).unwrap_or_default()
        }
        Err(_) => "",
    };
    let text = valid.trim_start_matches('\u{feff}').trim_start().to_ascii_lowercase();
    if text.is_empty() || valid.chars().any(|c| c.is_control() && !c.is_whitespace()) {
        return "its format is not known".into();
    }
    if text.starts_with("<svg") || (text.starts_with("<?xml") && text.contains("<svg")) {
        "it is SVG".into()
    } else if text.starts_with("<!doctype html") || text.starts_with("<html") {
        "it is a web page".into()
    } else {
        "it is text, not a picture".into()
    }
}
