//! ZIP archives with uncompressed entries: pictures are compressed already, and texts are small. Entries have no dates, so equal
//! content gives equal archives. Source: APPNOTE.TXT of PKWARE, without ZIP64.
use flate2::Crc;
use std::io::{self, ErrorKind, Read, Seek, SeekFrom, Write};

/// 1980-01-01, the earliest date.
const DATE: u16 = 0x21;
/// The version that readers need: 1.0.
const VERSION: u16 = 10;
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
    length: u32,
    start: u32,
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

    /// Adds a file, whose content starts at a multiple of `alignment` bytes, at most 4096. Returns its length.
    ///
    /// # Errors
    /// When reading or writing fails; [`ErrorKind::InvalidInput`] if the archive would have more than 4 GiB or 65534 files,
    /// or for a name of more than 65535 bytes.
    pub fn add(&mut self, name: &str, content: &mut dyn Read, alignment: u16) -> io::Result<u64> {
        let start = small(self.at)?;
        if self.entries.len() + 1 >= usize::from(u16::MAX) {
            return Err(too_large());
        }
        let entry = Entry { name: name.to_owned(), crc: 0, length: 0, start };
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
        let (mut crc, mut piece, begin) = (Crc::new(), vec![0; 1 << 16], self.at);
        loop {
            let count = match content.read(&mut piece) {
                Ok(0) => break,
                Ok(count) => count,
                Err(error) if error.kind() == ErrorKind::Interrupted => continue,
                Err(error) => return Err(error),
            };
            crc.update(&piece[..count]);
            self.write(&piece[..count])?;
        }
        let length = self.at - begin;
        let entry = Entry { crc: crc.sum(), length: small(length)?, ..entry };
        // The header is written again with the length and the check sum.
        self.out.seek(SeekFrom::Start(u64::from(start)))?;
        self.out.write_all(&local(&entry, extra)?)?;
        self.out.seek(SeekFrom::Start(self.at))?;
        self.entries.push(entry);
        Ok(length)
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
    for word in [VERSION, if entry.name.is_ascii() { 0 } else { UTF_8 }, 0, 0, DATE] {
        bytes.extend(word.to_le_bytes());
    }
    for word in [entry.crc, entry.length, entry.length] {
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

fn small(bytes: u64) -> io::Result<u32> {
    u32::try_from(bytes).map_err(|_| too_large())
}

fn too_large() -> io::Error {
    io::Error::new(ErrorKind::InvalidInput, "the archive would have more than 4 GiB or 65534 files")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    #[test]
    fn writes_what_other_readers_understand() {
        let mut writer = ZipWriter::new(Cursor::new(Vec::new()));
        for (alignment, name) in [(1, "a.txt"), (64, "b/ü"), (64, "long name"), (2, "c")] {
            assert_eq!(writer.add(name, &mut name.as_bytes(), alignment).unwrap(), name.len() as u64);
        }
        let mut read = zip::ZipArchive::new(writer.finish().unwrap()).unwrap();
        assert_eq!(read.len(), 4);
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
