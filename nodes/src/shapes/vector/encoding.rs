//! Decodes the text of an SVG file: unpacks gzip, and converts other encodings to UTF-8.
use super::MOST_BYTES;
use flate2::read::MultiGzDecoder;
use shibo_value::diagnostics::Code;
use std::io::Read;

/// Names, in lower case, of encodings whose bytes are the first characters of Unicode. Windows-1252 differs only in
/// punctuation, which only texts contain.
const LATIN: &[&str] = &["iso-8859-1", "latin1", "latin-1", "l1", "iso8859-1", "iso_8859-1", "windows-1252", "cp1252"];

/// The text of a file.
pub(super) fn text(bytes: Vec<u8>) -> Result<String, (Code, String)> {
    let bytes = if bytes.starts_with(&[0x1f, 0x8b]) { unpacked(&bytes)? } else { bytes };
    match bytes.as_slice() {
        [0xff, 0xfe, rest @ ..] => return wide(rest, u16::from_le_bytes),
        [0xfe, 0xff, rest @ ..] => return wide(rest, u16::from_be_bytes),
        _ => {}
    }
    let declared = declared(&bytes);
    if declared.as_deref().is_some_and(|name| LATIN.contains(&name)) {
        return Ok(bytes.iter().map(|byte| char::from(*byte)).collect());
    }
    String::from_utf8(bytes).map_err(|error| {
        let (at, bytes) = (error.utf8_error().valid_up_to(), error.as_bytes());
        let line = 1 + bytes[..at].iter().filter(|byte| **byte == b'\n').count();
        let found = match declared {
            Some(name) if name != "utf-8" => {
                format!("its encoding is `{name}`, and byte {at} in line {line} is no UTF-8")
            }
            _ => format!("byte {at} in line {line} is no UTF-8 text"),
        };
        (Code::BadFile, format!("{found}; it must be UTF-8, UTF-16 or Latin-1 that says so: save it as UTF-8"))
    })
}

/// The content of a `.svgz` file.
fn unpacked(bytes: &[u8]) -> Result<Vec<u8>, (Code, String)> {
    let mut text = Vec::new();
    let read = MultiGzDecoder::new(bytes).take(MOST_BYTES + 1).read_to_end(&mut text);
    read.map_err(|error| (Code::BadFile, format!("it is packed by gzip and damaged: {error}; save it again")))?;
    if text.len() as u64 > MOST_BYTES {
        let message = format!("unpacked it has more than {} MiB, the most that is read", MOST_BYTES >> 20);
        return Err((Code::TooLarge, message));
    }
    Ok(text)
}

/// Decodes UTF-16.
fn wide(bytes: &[u8], unit: fn([u8; 2]) -> u16) -> Result<String, (Code, String)> {
    let (pairs, rest) = bytes.as_chunks::<2>();
    let units: Vec<u16> = pairs.iter().map(|pair| unit(*pair)).collect();
    let text = String::from_utf16(&units).ok().filter(|_| rest.is_empty());
    text.ok_or_else(|| (Code::BadFile, "it begins as UTF-16 and is none; save it as UTF-8".to_owned()))
}

/// The name of the encoding in the first line, in lower case.
fn declared(bytes: &[u8]) -> Option<String> {
    let bytes = bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(bytes);
    let head = &bytes[..bytes.len().min(200)];
    let head: String = head.iter().map(|byte| char::from(*byte)).collect();
    let (declaration, _) = head.strip_prefix("<?xml")?.split_once("?>")?;
    let (_, after) = declaration.split_once("encoding")?;
    let value = after.trim_start().strip_prefix('=')?.trim_start();
    let quote = value.chars().next().filter(|c| matches!(c, '"' | '\''))?;
    Some(value[1..].split(quote).next()?.to_ascii_lowercase())
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::Compression;
    use flate2::write::GzEncoder;
    use std::io::Write;

    fn packed(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    }

    #[test]
    fn reads_packed_and_wide_text() {
        assert_eq!(text(packed("<svg id='é'/>".as_bytes())).unwrap(), "<svg id='é'/>");
        let wide = |order: fn(u16) -> [u8; 2]| -> Vec<u8> { "\u{feff}<é/>".encode_utf16().flat_map(order).collect() };
        assert_eq!(text(wide(u16::to_le_bytes)).unwrap(), "<é/>");
        assert_eq!(text(wide(u16::to_be_bytes)).unwrap(), "<é/>");
        assert_eq!(
            text(b"<?xml version='1.0' encoding = 'ISO-8859-1'?><a>\xe9</a>".to_vec()).unwrap().chars().nth(48),
            Some('é')
        );
    }

    #[test]
    fn refuses_damage_and_size_before_memory_is_taken() {
        let (code, message) = text(packed(&vec![b' '; usize::try_from(MOST_BYTES).unwrap() + 1])).unwrap_err();
        assert_eq!((code, message.contains("more than 16 MiB")), (Code::TooLarge, true), "{message}");
        let whole = packed(b"<svg/>");
        assert!(text(whole[..whole.len() - 9].to_vec()).unwrap_err().1.contains("damaged"));
        let said = text(b"<?xml version='1.0' encoding='Shift_JIS'?>\n<a>\x83\x65</a>".to_vec()).unwrap_err().1;
        assert!(said.contains("its encoding is `shift_jis`, and byte 46 in line 2 is no UTF-8"), "{said}");
        assert!(text(b"<a>\xe9</a>".to_vec()).unwrap_err().1.starts_with("byte 3 in line 1 is no UTF-8 text"));
    }
}
