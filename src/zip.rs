//! ZIP archives with uncompressed entries, since texts are small and pictures compressed already. Entries have no
//! dates, so equal content gives equal archives.
use std::io::{Cursor, Write};
use zip::result::ZipResult;
use zip::{CompressionMethod, DateTime, ZipWriter, write::SimpleFileOptions};

/// Error: the archive would be too large.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TooLarge;

/// Archive of these files, names and contents.
pub(crate) fn zip(files: &[(String, Vec<u8>)]) -> Result<Vec<u8>, TooLarge> {
    let headers = files.iter().map(|(name, content)| 128 + 2 * name.len() + content.len());
    if headers.sum::<usize>() > u32::MAX as usize || files.len() >= usize::from(u16::MAX) {
        return Err(TooLarge);
    }
    stored(files).map_err(|_| TooLarge)
}

fn stored(files: &[(String, Vec<u8>)]) -> ZipResult<Vec<u8>> {
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Stored)
        .last_modified_time(DateTime::default());
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, content) in files {
        zip.start_file(name.as_str(), options)?;
        zip.write_all(content)?;
    }
    Ok(zip.finish()?.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn writes_archive_of_two_files() {
        let files = [("a.txt".to_owned(), b"abc".to_vec()), ("b/ü".to_owned(), Vec::new())];
        let archive = zip(&files).unwrap();
        assert_eq!(archive, zip(&files).unwrap());
        let mut read = zip::ZipArchive::new(Cursor::new(archive)).unwrap();
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
