//! ZIP archives. Entries have no dates, so the same content gives the same bytes.
//!
//! USD packages have uncompressed files, each aligned to 64 bytes, so that readers can use them in place; the stage comes
//! first. 3MF packages are compressed.
use crate::AtomicFile;
use crate::zip::ZipWriter;
use std::io::{self, BufWriter, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::Path;

/// Alignment of contents in bytes.
const ALIGNMENT: u16 = 64;
/// An upper bound for the bytes of an entry's headers, without its name.
const OVERHEAD: u64 = 256;

/// Writes the documents, then the pictures (with their lengths), into a file that gets its name when it is complete.
pub(super) fn archive(
    path: &Path,
    documents: &[(String, String)],
    mut pictures: Vec<(&str, &mut AtomicFile, u64)>,
) -> io::Result<()> {
    let texts = documents.iter().map(|(name, text)| (name.len(), text.len() as u64));
    let entries = texts.chain(pictures.iter().map(|(name, _, length)| (name.len(), *length)));
    if entries.map(|(name, length)| length + 2 * name as u64 + OVERHEAD).sum::<u64>() > u64::from(u32::MAX) {
        let message = "the file would have more than 4 GiB, which USDZ does not allow; lower the resolution";
        return Err(io::Error::new(ErrorKind::InvalidInput, message));
    }
    let mut file = AtomicFile::create(path)?;
    let mut zip = ZipWriter::new(BufWriter::with_capacity(1 << 20, &mut file));
    fill(&mut zip, documents, &mut pictures)?;
    zip.finish()?.into_inner().map_err(io::IntoInnerError::into_error)?;
    file.commit()
}

/// Writes a compressed package of some texts and one file, whose content is read from its start. The package has no
/// name yet.
///
/// # Errors
/// If the system refuses, or the package would have more than 4 GiB.
pub(super) fn package(
    path: &Path,
    texts: &[(&str, &str)],
    (name, content): (&str, &mut AtomicFile),
) -> io::Result<AtomicFile> {
    content.seek(SeekFrom::Start(0))?;
    let mut file = AtomicFile::create(path)?;
    let mut zip = ZipWriter::new(BufWriter::with_capacity(1 << 20, &mut file));
    for (name, text) in texts {
        zip.add_compressed(name, &mut text.as_bytes())?;
    }
    zip.add_compressed(name, content)?;
    zip.finish()?.into_inner().map_err(io::IntoInnerError::into_error)?;
    Ok(file)
}

fn fill<W: Write + Seek>(
    zip: &mut ZipWriter<W>,
    documents: &[(String, String)],
    pictures: &mut [(&str, &mut AtomicFile, u64)],
) -> io::Result<()> {
    for (name, text) in documents {
        zip.add(name, &mut text.as_bytes(), ALIGNMENT)?;
    }
    for (name, picture, length) in pictures {
        picture.seek(SeekFrom::Start(0))?;
        if zip.add(name, &mut picture.take(*length), ALIGNMENT)? != *length {
            return Err(ErrorKind::UnexpectedEof.into());
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn aligns_contents_to_64_bytes_and_gives_the_same_bytes_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.usdz");
        let make = || {
            let mut picture = AtomicFile::create(folder.path().join("a.usdz")).unwrap();
            picture.write_all(b"0123456789").unwrap();
            let documents = [("a.usda".to_owned(), "#usda 1.0".to_owned()), ("long name".repeat(9), String::new())];
            archive(&path, &documents, vec![("a_color.png", &mut picture, 10)]).unwrap();
            std::fs::read(&path).unwrap()
        };
        let bytes = make();
        assert_eq!(bytes, make());
        let mut read = zip::ZipArchive::new(io::Cursor::new(&bytes)).unwrap();
        let mut names = Vec::new();
        for index in 0..read.len() {
            let entry = read.by_index(index).unwrap();
            assert_eq!(entry.compression(), zip::CompressionMethod::Stored);
            let start = entry.data_start().unwrap();
            let name = entry.name().unwrap().into_owned();
            assert_eq!(start % 64, 0, "{name}");
            names.push((name, start, entry.size()));
        }
        assert_eq!((names[0].0.as_str(), names[2].0.as_str()), ("a.usda", "a_color.png"));
        let at = usize::try_from(names[2].1).unwrap();
        assert_eq!(&bytes[at..at + 10], b"0123456789");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "nothing else is left");
    }

    #[test]
    fn keeps_the_old_archive_if_a_picture_is_too_short() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.usdz");
        std::fs::write(&path, "before").unwrap();
        let mut picture = AtomicFile::create(&path).unwrap();
        picture.write_all(b"short").unwrap();
        let error = archive(&path, &[], vec![("a.png", &mut picture, 10)]).unwrap_err();
        assert_eq!(error.kind(), ErrorKind::UnexpectedEof);
        drop(picture);
        assert_eq!(std::fs::read(&path).unwrap(), b"before");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
        let mut picture = AtomicFile::create(&path).unwrap();
        let error = archive(&path, &[], vec![("a.png", &mut picture, 1 << 32)]).unwrap_err();
        assert!(error.to_string().contains("more than 4 GiB"), "{error}");
    }
}
