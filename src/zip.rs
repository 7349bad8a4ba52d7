//! ZIP archives in memory.
use shibo_picture::ZipWriter;
use std::io::Cursor;

/// Error: the archive would be too large.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TooLarge;

/// Archive of these files, names and contents.
pub(crate) fn zip(files: &[(String, Vec<u8>)]) -> Result<Vec<u8>, TooLarge> {
    let stored = || {
        let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
        files.iter().try_for_each(|(name, content)| zip.add(name, &mut content.as_slice(), 1).map(drop))?;
        Ok::<_, std::io::Error>(zip.finish()?.into_inner())
    };
    stored().map_err(|_| TooLarge)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::zip::{CompressionMethod, DateTime};

    #[test]
    fn writes_archive_of_two_files() {
        let files = [("a.txt".to_owned(), b"abc".to_vec()), ("b/ü".to_owned(), Vec::new())];
        let archive = zip(&files).unwrap();
        assert_eq!(archive, zip(&files).unwrap());
        let mut read = ::zip::ZipArchive::new(Cursor::new(archive)).unwrap();
        assert_eq!(read.len(), 2);
        let entry = read.by_name("b/ü").unwrap();
        assert_eq!((entry.size(), entry.compression()), (0, CompressionMethod::Stored));
        assert_eq!(entry.last_modified(), Some(DateTime::default()));
        drop(entry);
        let mut text = String::new();
        std::io::Read::read_to_string(&mut read.by_name("a.txt").unwrap(), &mut text).unwrap();
        assert_eq!(text, "abc");
    }
}
