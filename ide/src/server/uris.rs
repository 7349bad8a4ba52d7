//! Addresses of files.
use lsp_types::Uri;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Path of a `file:` address; for other addresses a path that does not exist, so that texts without a file can be
/// edited too.
pub fn path(uri: &Uri) -> PathBuf {
    let text = uri.as_str();
    let Some(rest) = text.strip_prefix("file://") else { return PathBuf::from(decode(text)) };
    // After the host, as in `file://host/path`.
    let path = decode(&rest[rest.find('/').unwrap_or(0)..]);
    // On Windows `/c:/x` means `c:/x`.
    let drive = path.strip_prefix('/').filter(|path| path.as_bytes().get(1) == Some(&b':'));
    PathBuf::from(drive.unwrap_or(&path))
}

/// Address of a file; `None` for a library graph.
pub fn uri(path: &Path) -> Option<Uri> {
    let text = path.to_str()?;
    if text.starts_with("shibo:") {
        return None;
    }
    let slash = if text.starts_with('/') { "" } else { "/" };
    Uri::from_str(&format!("file://{slash}{}", encode(&text.replace('\\', "/")))).ok()
}

fn decode(text: &str) -> String {
    let bytes = text.as_bytes();
    let mut out = Vec::with_capacity(bytes.len());
    let mut i = 0;
    while i < bytes.len() {
        let hex = |b: u8| char::from(b).to_digit(16).and_then(|d| u8::try_from(d).ok());
        let pair = bytes.get(i + 1).copied().and_then(hex).zip(bytes.get(i + 2).copied().and_then(hex));
        match (bytes[i], pair) {
            (b'%', Some((high, low))) => {
                out.push(high << 4 | low);
                i += 3;
            }
            (byte, _) => {
                out.push(byte);
                i += 1;
            }
        }
    }
    String::from_utf8_lossy(&out).into_owned()
}

fn encode(path: &str) -> String {
    let mut out = String::with_capacity(path.len());
    for byte in path.bytes() {
        if byte.is_ascii_alphanumeric() || b"/-._~:".contains(&byte) {
            out.push(char::from(byte));
        } else {
            out.push_str(&format!("%{byte:02X}"));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_round_trip() {
        for text in ["/a/b.ron", "/a b/シ%20.ron", "/x/#1?.ron"] {
            assert_eq!(path(&uri(Path::new(text)).unwrap()), PathBuf::from(text));
        }
        assert_eq!(path(&Uri::from_str("file:///c%3A/x.ron").unwrap()), PathBuf::from("c:/x.ron"));
        assert_eq!(path(&Uri::from_str("untitled:Untitled-1").unwrap()), PathBuf::from("untitled:Untitled-1"));
        assert!(uri(Path::new("shibo:/calf.ron")).is_none());
    }
}
