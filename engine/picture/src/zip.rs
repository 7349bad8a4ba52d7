//! ZIP archives. Entries have no dates, so equal content gives equal archives. Source: APPNOTE.TXT of PKWARE, without ZIP64.
use flate2::read::DeflateEncoder;
use flate2::{Compression, Crc};
use std::io::{self, ErrorKind, Read, Seek, SeekFrom, Write};

/// 1980-01-01, the earliest date.
const DATE: u16 = 0x21;
/// The version that readers need: 2.0, for compressed entries.
const VERSION: u16 = 20;
/// Made on Unix, so that the permissions count.
const MADE_BY: u16 = 3 << 8 | VERSION;
/// A regular file that its owner may write and all may read.
const PERMISSIONS: u32 = 0o100_644 << 16;
/// Flag: the name is UTF-8.
const UTF_8: u16 = 1 << 11;
/// The identifier of the extra field that fills up to an alignment; readers ignore it.
const FILLING: u16 = 0x1986;

struct Entry {
    name: String,
    crc: u32,
    /// Bytes in the archive, and of the content.
    stored: u32,
    length: u32,
    start: u32,
    compressed: bool,
}

/// Reads a content and keeps its check sum and its length.
struct Counted<'c> {
    content: &'c mut dyn Read,
    crc: Crc,
    length: u64,
}

impl Read for Counted<'_> {
    fn read(&mut self, piece: &mut [u8]) -> io::Result<usize> {
        let count = self.content.read(piece)?;
        self.crc.update(&piece[..count]);
        self.length += count as u64;
        Ok(count)
    }
}

/// Writes an archive.
pub struct ZipWriter<W> {
    out: W,
    at: u64,
    entries: Vec<Entry>,
}

impl<W: Write + Seek> ZipWriter<W> {
    /// An archive that begins at the current position of `out`, which is the start of the file.
    pub fn new(out: W) -> Self {
        Self { out, at: 0, entries: Vec::new() }
    }

    /// Adds a file as it is. Its content starts at a multiple of `alignment` bytes, at most 4096. Returns its length.
    ///
    /// # Errors
    /// When reading or writing fails; [`ErrorKind::InvalidInput`] if the archive would have more than 4 GiB or 65534 files,
    /// or for a name of more than 65535 bytes.
    pub fn add(&mut self, name: &str, content: &mut dyn Read, alignment: u16) -> io::Result<u64> {
        self.put(name, content, alignment, false)
    }

    /// Adds a compressed file. Returns the length of its content.
    ///
    /// # Errors
    /// As [`add`](Self::add).
    pub fn add_compressed(&mut self, name: &str, content: &mut dyn Read) -> io::Result<u64> {
        self.put(name, content, 1, true)
    }

    fn put(&mut self, name: &str, content: &mut dyn Read, alignment: u16, compressed: bool) -> io::Result<u64> {
        let start = small(self.at)?;
        if self.entries.len() + 1 >= usize::from(u16::MAX) {
            return Err(too_large());
        }
        let entry = Entry { name: name.to_owned(), crc: 0, stored: 0, length: 0, start, compressed };
        let before = self.at + 30 + name.len() as u64;
        let alignment = u64::from(alignment.clamp(1, 4096));
        let mut extra = (alignment - before % alignment) % alignment;
        if (1..4).contains(&extra) {
            extra += alignment * 4_u64.div_ceil(alignment);
        }
        let extra = u16::try_from(extra).map_err(|_| too_large())?;
        self.write(&local(&entry, extra)?)?;
        if let Some(filling) = extra.checked_sub(4) {
            self.write(&[&FILLING.to_le_bytes()[..], &filling.to_le_bytes(), &vec![0; usize::from(filling)]].concat())?;
        }
        let (mut counted, begin) = (Counted { content, crc: Crc::new(), length: 0 }, self.at);
        if compressed {
            self.copy(&mut DeflateEncoder::new(&mut counted, Compression::fast()))?;
        } else {
            self.copy(&mut counted)?;
        }
        let (stored, length) = (small(self.at - begin)?, counted.length);
        let entry = Entry { crc: counted.crc.sum(), stored, length: small(length)?, ..entry };
        // The header is written again with the length and the check sum.
        self.out.seek(SeekFrom::Start(u64::from(start)))?;
        self.out.write_all(&local(&entry, extra)?)?;
        self.out.seek(SeekFrom::Start(self.at))?;
        self.entries.push(entry);
        Ok(length)
    }

    fn copy(&mut self, from: &mut dyn Read) -> io::Result<()> {
        let mut piece = vec![0; 1 << 16];
        loop {
            match from.read(&mut piece) {
                Ok(0) => return Ok(()),
                Ok(count) => self.write(&piece[..count])?,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.at += bytes.len() as u64;
        small(self.at)?;
        self.out.write_all(bytes)
    }

    /// Writes the directory. Returns the file.
    ///
    /// # Errors
    /// As [`add`](Self::add).
    pub fn finish(mut self) -> io::Result<W> {
        let start = self.at;
        for entry in std::mem::take(&mut self.entries) {
            let mut head = 0x0201_4b50_u32.to_le_bytes().to_vec();
            head.extend(MADE_BY.to_le_bytes());
            head.extend(common(&entry)?);
            // Extra field, comment, number of the disk, kind of content.
            head.extend([0; 8]);
            head.extend(PERMISSIONS.to_le_bytes());
            head.extend(entry.start.to_le_bytes());
            head.extend(entry.name.as_bytes());
            self.write(&head)?;
            self.entries.push(entry);
        }
        let count = u16::try_from(self.entries.len()).map_err(|_| too_large())?;
        let mut end = 0x0605_4b50_u32.to_le_bytes().to_vec();
        end.extend([0; 4]);
        end.extend(count.to_le_bytes());
        end.extend(count.to_le_bytes());
        end.extend(small(self.at - start)?.to_le_bytes());
        end.extend(small(start)?.to_le_bytes());
        end.extend([0; 2]);
        self.write(&end)?;
        self.out.flush()?;
        Ok(self.out)
    }
}

/// The fields that both headers of an entry have, without those after the length of the name.
fn common(entry: &Entry) -> io::Result<Vec<u8>> {
    let name = u16::try_from(entry.name.len()).map_err(|_| too_large())?;
    let mut bytes = Vec::new();
    let method = if entry.compressed { 8 } else { 0 };
    for word in [VERSION, if entry.name.is_ascii() { 0 } else { UTF_8 }, method, 0, DATE] {
        bytes.extend(word.to_le_bytes());
    }
    for word in [entry.crc, entry.stored, entry.length] {
        bytes.extend(word.to_le_bytes());
    }
    bytes.extend(name.to_le_bytes());
    Ok(bytes)
}

fn local(entry: &Entry, extra: u16) -> io::Result<Vec<u8>> {
    let mut head = 0x0403_4b50_u32.to_le_bytes().to_vec();
    head.extend(common(entry)?);
    head.extend(extra.to_le_bytes());
    head.extend(entry.name.as_bytes());
    Ok(head)
}

/// A length or a place in 32 bits. The greatest number stands for ZIP64.
fn small(bytes: u64) -> io::Result<u32> {
    u32::try_from(bytes).ok().filter(|bytes| *bytes < u32::MAX).ok_or_else(too_large)
}

fn too_large() -> io::Error {
    io::Error::new(ErrorKind::InvalidInput, "the archive would have more than 4 GiB or 65534 files")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    #[test]
    fn keeps_the_number_that_stands_for_zip64_free() {
        assert_eq!(small(u64::from(u32::MAX) - 1).unwrap(), u32::MAX - 1);
        for bytes in [u64::from(u32::MAX), 1 << 32, u64::MAX] {
            assert_eq!(small(bytes).unwrap_err().kind(), ErrorKind::InvalidInput);
        }
    }

    #[test]
    fn writes_what_other_readers_understand() {
        let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
        for (alignment, name) in [(1, "a.txt"), (64, "b/ü"), (64, "long name"), (2, "c")] {
            assert_eq!(writer.add(name, &mut name.as_bytes(), alignment).unwrap(), name.len() as u64);
        }
        let long = "again ".repeat(50_000);
        assert_eq!(writer.add_compressed("long", &mut long.as_bytes()).unwrap(), long.len() as u64);
        let mut read = zip::ZipArchive::new(writer.finish().unwrap()).unwrap();
        assert_eq!(read.len(), 5);
        let mut text = String::new();
        let mut entry = read.by_name("long").unwrap();
        assert!(entry.compressed_size() < entry.size() / 50);
        entry.read_to_string(&mut text).unwrap();
        assert_eq!(text, long);
        drop(entry);
        for (alignment, name) in [(1, "a.txt"), (64, "b/ü"), (64, "long name"), (2, "c")] {
            let mut entry = read.by_name(name).unwrap();
            assert_eq!(entry.data_start().unwrap() % alignment, 0, "{name}");
            assert_eq!((entry.unix_mode(), entry.compression()), (Some(0o100_644), zip::CompressionMethod::Stored));
            assert_eq!(entry.last_modified(), Some(zip::DateTime::default()));
            let mut text = String::new();
            // Reading to the end checks the sum.
            entry.read_to_string(&mut text).unwrap();
            assert_eq!(text, name);
        }
    }
}
