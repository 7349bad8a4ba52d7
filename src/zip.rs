//! ZIP archives whose entries are stored as they are. Texts and pictures are small or compressed already, and the same
//! content gives the same archive: entries have no dates.

/// The first day that the format knows: 1 January 1980.
const DATE: u16 = 0x21;
/// Names are UTF-8.
const FLAGS: u16 = 1 << 11;
const VERSION: u16 = 20;

/// Why there is no archive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TooLarge;

/// The archive of these files, names and contents.
pub(crate) fn zip(files: &[(String, Vec<u8>)]) -> Result<Vec<u8>, TooLarge> {
    let count = u16::try_from(files.len()).map_err(|_| TooLarge)?;
    let mut archive = Vec::new();
    let mut directory = Vec::new();
    for (name, content) in files {
        let at = u32::try_from(archive.len()).map_err(|_| TooLarge)?;
        let size = u32::try_from(content.len()).map_err(|_| TooLarge)?;
        let length = u16::try_from(name.len()).map_err(|_| TooLarge)?;
        // What both headers of an entry have in common.
        let mut common = Vec::with_capacity(26);
        for word in [VERSION, FLAGS, 0, 0, DATE] {
            common.extend(word.to_le_bytes());
        }
        for word in [crc32(content), size, size] {
            common.extend(word.to_le_bytes());
        }
        common.extend(length.to_le_bytes());
        common.extend(0_u16.to_le_bytes());
        archive.extend(b"PK\x03\x04");
        archive.extend(&common);
        archive.extend(name.as_bytes());
        archive.extend(content);
        directory.extend(b"PK\x01\x02");
        directory.extend(VERSION.to_le_bytes());
        directory.extend(&common);
        // No comment, the first disk, no attributes.
        directory.extend([0; 10]);
        directory.extend(at.to_le_bytes());
        directory.extend(name.as_bytes());
    }
    let at = u32::try_from(archive.len()).map_err(|_| TooLarge)?;
    let size = u32::try_from(directory.len()).map_err(|_| TooLarge)?;
    archive.extend(&directory);
    archive.extend(b"PK\x05\x06\0\0\0\0");
    archive.extend(count.to_le_bytes());
    archive.extend(count.to_le_bytes());
    archive.extend(size.to_le_bytes());
    archive.extend(at.to_le_bytes());
    archive.extend([0; 2]);
    Ok(archive)
}

/// The checksum of the format, bit by bit: a graph and its pictures are a few megabytes.
fn crc32(bytes: &[u8]) -> u32 {
    let table: [u32; 256] = std::array::from_fn(|i| {
        (0..8)
            .fold(u32::try_from(i).unwrap_or_default(), |c, _| if c & 1 == 1 { 0xEDB8_8320 ^ (c >> 1) } else { c >> 1 })
    });
    !bytes.iter().fold(u32::MAX, |crc, byte| table[((crc ^ u32::from(*byte)) & 0xFF) as usize] ^ (crc >> 8))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checksum_is_that_of_the_standard() {
        assert_eq!(crc32(b"123456789"), 0xCBF4_3926);
        assert_eq!(crc32(b""), 0);
    }

    #[test]
    fn an_archive_of_two_files() {
        let archive = zip(&[("a.txt".into(), b"abc".to_vec()), ("b/ü".into(), Vec::new())]).unwrap();
        assert_eq!(&archive[..4], b"PK\x03\x04");
        // The header of the first entry has 30 bytes, then come its name and its content.
        assert_eq!((&archive[30..35], &archive[35..38]), (&b"a.txt"[..], &b"abc"[..]));
        assert_eq!(u32::from_le_bytes(archive[14..18].try_into().unwrap()), crc32(b"abc"));
        let end = archive.len() - 22;
        let number = |at: usize| u32::from_le_bytes(archive[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!(&archive[end..end + 4], b"PK\x05\x06");
        // The directory begins where it says, ends where the end begins, and points to the second entry.
        let (size, at) = (number(end + 12), number(end + 16));
        assert_eq!((&archive[at..at + 4], at + size), (&b"PK\x01\x02"[..], end));
        let second = at + 46 + "a.txt".len();
        assert_eq!(number(second + 42), 38);
        assert_eq!(&archive[38..42], b"PK\x03\x04");
    }
}
