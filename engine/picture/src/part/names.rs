//! Checks the file names in a part. A part may come from anywhere, so only names that an output can have are allowed.
use super::PartHeader;
use crate::spec::Format;

/// Maximum bytes of a file name.
const MOST: usize = 255;
/// Number of characters of a bad name that are shown.
const SHOWN: usize = 40;
/// The first bytes of a file without rows.
const SVG: &[u8] = b"<?xml ";

/// Returns true if the name of an output, and so the name of its file, may contain this character.
#[must_use]
pub fn is_output_letter(c: char) -> bool {
    c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.')
}

/// Checks the names in a header. An error is the end of a sentence.
pub(super) fn check(header: &PartHeader) -> Result<(), String> {
    let mut names: Vec<String> = Vec::with_capacity(header.pictures.len());
    for picture in &header.pictures {
        let name = &picture.file;
        let shown: String = name.chars().take(SHOWN).collect();
        let format = picture.spec.as_ref().map_or(Format::Svg, |spec| spec.format);
        let (stem, extension) = name.rsplit_once('.').unwrap_or((name, ""));
        let plain =
            name.len() <= MOST && !stem.is_empty() && !name.starts_with('.') && name.chars().all(is_output_letter);
        if !plain {
            return Err(format!("names a file {shown:?}, which no output is called"));
        }
        if !Format::ALL.contains(&format) || format.extension() != extension {
            return Err(format!("names a file {shown:?}, which is not what {format} is called"));
        }
        names.push(name.to_ascii_lowercase());
    }
    names.sort_unstable();
    match names.windows(2).find(|pair| pair[0] == pair[1]) {
        Some(pair) => Err(format!("names the file {:?} twice", pair[0])),
        None => Ok(()),
    }
}

/// Returns true if these are the first bytes of a file without rows.
pub(super) fn is_drawing(start: &[u8]) -> bool {
    start.starts_with(SVG)
}
