//! The ICC profile of a JPEG file, split into pieces of at most 64 KiB (ICC.1, annex B.4).
use super::super::icc;

/// The first bytes of each piece.
const NAME: &[u8] = b"ICC_PROFILE\0";
const APP2: u8 = 0xe2;
const SOS: u8 = 0xda;

/// The profile of a file, `None` if there is none; or the reason why it cannot be assembled, as `is …`.
pub(super) fn find(bytes: &[u8]) -> Result<Option<Vec<u8>>, String> {
    let mut pieces: Vec<(u8, u8, &[u8])> = Vec::new();
    let mut at = 2;
    while let Some(segment) = next(bytes, &mut at) {
        if let Some([number, count, content @ ..]) = segment.strip_prefix(NAME) {
            pieces.push((*number, *count, content));
        }
    }
    if pieces.is_empty() {
        return Ok(None);
    }
    pieces.sort_by_key(|(number, ..)| *number);
    let whole = pieces
        .iter()
        .zip(1..)
        .all(|((number, count, _), expected)| usize::from(*number) == expected && usize::from(*count) == pieces.len());
    if !whole {
        return Err("is not whole: one of its parts is missing or comes twice".into());
    }
    if pieces.iter().map(|(.., content)| content.len()).sum::<usize>() > icc::MOST_BYTES {
        return Err(icc::too_large());
    }
    Ok(Some(pieces.iter().flat_map(|(.., content)| content.iter().copied()).collect()))
}

/// The content of the next `APP2` segment before the first scan.
fn next<'a>(bytes: &'a [u8], at: &mut usize) -> Option<&'a [u8]> {
    loop {
        // A marker may be preceded by any number of bytes 255.
        *at += bytes.get(*at..)?.iter().position(|byte| *byte == 0xff)?;
        *at += bytes[*at..].iter().position(|byte| *byte != 0xff)?;
        let marker = bytes[*at];
        let length = usize::from(u16::from_be_bytes(*bytes.get(*at + 1..)?.first_chunk()?));
        let content = bytes.get(*at + 3..*at + 1 + length.max(2))?;
        *at += 1 + length.max(2);
        match marker {
            SOS => return None,
            APP2 => return Some(content),
            _ => {}
        }
    }
}
