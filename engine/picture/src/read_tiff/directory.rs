//! The directory of the picture, and the values of its tags.
use super::super::limits::ReadError;
use super::from_tiff;
use std::io::{Read, Seek};
use tiff::Directory;
use tiff::decoder::Decoder;
use tiff::tags::{ByteOrder, IfdPointer, Tag};

/// Maximum number of directories that are searched for the picture.
const MOST_DIRECTORIES: usize = 64;

/// Bits of `NewSubfileType`: a reduced version of another picture, and an opacity mask.
const NOT_THE_PICTURE: u32 = 1 | 4;

/// `SubfileType` of a reduced version, in old files.
const REDUCED: u16 = 2;

/// The tags of the picture.
pub(super) struct Tags<R: Read + Seek> {
    decoder: Decoder<R>,
    directory: Directory,
}

impl<R: Read + Seek> Tags<R> {
    /// Finds the picture: the first directory, including subdirectories, that is neither a reduced version nor a mask.
    /// If there is none, the first directory.
    pub(super) fn open(reader: R) -> Result<Self, ReadError> {
        let mut decoder = Decoder::new(reader).map_err(from_tiff)?;
        let mut next = decoder.ifd_pointer();
        let (mut first, mut seen) = (None, Vec::new());
        while let Some(place) = next.filter(|place| !seen.contains(&place.0) && seen.len() < MOST_DIRECTORIES) {
            seen.push(place.0);
            let directory = decoder.read_directory(place).map_err(from_tiff)?;
            next = directory.next();
            let mut tags = Self { decoder, directory };
            if tags.is_the_picture()? {
                return Ok(tags);
            }
            let below: Vec<u64> = tags.numbers(Tag::SubIfd)?.unwrap_or_default();
            Self { decoder, directory: _ } = tags;
            first = first.or(Some(place));
            for place in below {
                if seen.contains(&place) || seen.len() >= MOST_DIRECTORIES {
                    continue;
                }
                seen.push(place);
                let directory = decoder.read_directory(IfdPointer(place)).map_err(from_tiff)?;
                let mut tags = Self { decoder, directory };
                if tags.is_the_picture()? {
                    return Ok(tags);
                }
                decoder = tags.decoder;
            }
        }
        let first = first.ok_or_else(|| ReadError::corrupt("it has no directory"))?;
        let directory = decoder.read_directory(first).map_err(from_tiff)?;
        Ok(Self { decoder, directory })
    }

    fn is_the_picture(&mut self) -> Result<bool, ReadError> {
        let new = self.number::<u32>(Tag::NewSubfileType)?.unwrap_or(0);
        let old = self.number::<u16>(Tag::SubfileType)?;
        Ok(new & NOT_THE_PICTURE == 0 && old != Some(REDUCED))
    }

    /// The value of a tag.
    pub(super) fn number<T: TryFrom<u64>>(&mut self, tag: Tag) -> Result<Option<T>, ReadError> {
        self.decoder.read_directory_tags(&self.directory).find_tag_unsigned(tag).map_err(from_tiff)
    }

    /// Value of a required tag.
    pub(super) fn required<T: TryFrom<u64>>(&mut self, tag: Tag) -> Result<T, ReadError> {
        self.number(tag)?.ok_or_else(|| ReadError::corrupt(format!("its tag {tag:?} is missing")))
    }

    /// The values of a tag.
    pub(super) fn numbers<T: TryFrom<u64>>(&mut self, tag: Tag) -> Result<Option<Vec<T>>, ReadError> {
        self.decoder.read_directory_tags(&self.directory).find_tag_unsigned_vec(tag).map_err(from_tiff)
    }

    /// Bytes of a tag; at most `most`.
    pub(super) fn bytes(&mut self, tag: Tag, most: u64) -> Result<Option<Vec<u8>>, ReadError> {
        let Some(count) = self.directory.get(tag).map(tiff::decoder::ifd::Entry::count) else { return Ok(None) };
        if count > most {
            return Err(ReadError::corrupt(format!("its tag {tag:?} has {count} bytes; it must have at most {most}")));
        }
        let mut bytes = vec![0; usize::try_from(count).map_err(ReadError::corrupt)?];
        let mut tags = self.decoder.read_directory_tags(&self.directory);
        tags.find_tag_bytes(tag, &mut bytes, 0).map_err(from_tiff)?;
        Ok(Some(bytes))
    }

    pub(super) fn has(&self, tag: Tag) -> bool {
        self.directory.contains(tag)
    }

    pub(super) fn is_big_endian(&self) -> bool {
        self.decoder.byte_order() == ByteOrder::BigEndian
    }

    /// Reads bytes that were checked to lie within the file.
    pub(super) fn part(&mut self, (place, length): (u64, u64)) -> Result<Vec<u8>, ReadError> {
        let io = |error: std::io::Error| ReadError::from_decoder(&error);
        self.decoder.goto_offset_u64(place).map_err(io)?;
        let mut bytes = vec![0; usize::try_from(length).map_err(ReadError::corrupt)?];
        self.decoder.inner().read_exact(&mut bytes).map_err(io)?;
        Ok(bytes)
    }
}
