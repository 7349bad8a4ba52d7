//! Follows the chunks of a PNG file to the last one without decompressing.
use super::super::limits::ReadError;
use std::io::{BufRead, Seek, SeekFrom};

const SIGNATURE: [u8; 8] = *b"\x89PNG\r\n\x1a\n";
/// Offset of the first chunk.
pub(super) const FIRST: u64 = 8;
/// Maximum bytes of a chunk.
const MOST: u32 = (1 << 31) - 1;
/// Bytes of length, name and checksum of a chunk.
const FRAME: u64 = 12;
/// The colour type of indexed pictures.
const INDEXED: u8 = 3;

/// The facts about the chunks that decoding needs.
#[derive(Debug, Default)]
pub(super) struct Chunks {
    /// Bytes of compressed samples.
    pub(super) data: u64,
    /// Number of palette entries, if it is less than the samples could index.
    pub(super) short_palette: Option<usize>,
}

/// A chunk: offset and length of its content.
pub(super) struct Chunk {
    pub(super) name: [u8; 4],
    pub(super) start: u64,
    pub(super) length: u32,
}

impl Chunk {
    /// Offset of the next chunk.
    pub(super) fn end(&self) -> u64 {
        self.start + u64::from(self.length) + 4
    }

    fn shown(&self) -> String {
        String::from_utf8_lossy(&self.name).into_owned()
    }

    /// Critical chunks, whose name begins with a capital letter, are needed to show the picture.
    fn is_critical(&self) -> bool {
        self.name[0].is_ascii_uppercase()
    }
}

/// Follows the chunks of a file of `length` bytes and checks that they are complete and in order.
pub(super) fn walk<R: BufRead + Seek>(reader: &mut R, length: u64) -> Result<Chunks, ReadError> {
    let mut signature = [0; 8];
    reader.read_exact(&mut signature).map_err(|_| ReadError::truncated("it ends within its signature"))?;
    if signature != SIGNATURE {
        let message = "its first 8 bytes are not those of a PNG, as after a transfer that changed line ends";
        return Err(ReadError::corrupt(message));
    }
    let mut state = State::default();
    let mut at = FIRST;
    loop {
        let chunk = next(reader, at, length)?;
        if !state.take(&chunk, reader)? {
            return state.finish();
        }
        at = chunk.end();
    }
}

/// The chunk at an offset. Leaves the reader at its content.
pub(super) fn next<R: BufRead + Seek>(reader: &mut R, at: u64, length: u64) -> Result<Chunk, ReadError> {
    if at + FRAME > length {
        return Err(ReadError::truncated("its last chunk, `IEND`, is missing"));
    }
    let mut head = [0; 8];
    reader.seek(SeekFrom::Start(at)).and_then(|_| reader.read_exact(&mut head)).map_err(ReadError::Io)?;
    let [l0, l1, l2, l3, name @ ..] = head;
    let chunk = Chunk { name, start: at + 8, length: u32::from_be_bytes([l0, l1, l2, l3]) };
    if !name.iter().all(u8::is_ascii_alphabetic) || chunk.length > MOST {
        return Err(ReadError::corrupt(format!("there is no chunk at byte {at}, where one must begin")));
    }
    if chunk.end() > length {
        return Err(ReadError::truncated(format!("it ends within the chunk `{}`", chunk.shown())));
    }
    Ok(chunk)
}

/// The chunks seen so far.
#[derive(Default)]
struct State {
    /// Bit depth and colour type from the first chunk.
    header: Option<(u8, u8)>,
    palette: Option<usize>,
    data: Option<u64>,
    /// True if another chunk followed the compressed samples.
    data_ended: bool,
}

impl State {
    /// Processes a chunk; returns `false` for the last one.
    fn take<R: BufRead + Seek>(&mut self, chunk: &Chunk, reader: &mut R) -> Result<bool, ReadError> {
        let corrupt = |message: String| Err(ReadError::corrupt(message));
        if self.header.is_none() != (chunk.name == *b"IHDR") {
            return corrupt("its first chunk, and no other, must be `IHDR`".into());
        }
        if chunk.name != *b"IDAT" && self.data.is_some() {
            self.data_ended = true;
        }
        match &chunk.name {
            b"IHDR" if chunk.length != 13 => {
                return corrupt(format!("its `IHDR` has {} bytes; it must have 13", chunk.length));
            }
            b"IHDR" => {
                let mut fields = [0; 13];
                reader.read_exact(&mut fields).map_err(ReadError::Io)?;
                self.header = Some((fields[8], fields[9]));
            }
            b"PLTE" => self.palette(chunk)?,
            b"tRNS" => self.transparency(chunk)?,
            b"IDAT" if self.data_ended => return corrupt("its `IDAT` chunks do not follow one another".into()),
            b"IDAT" if self.is_indexed() && self.palette.is_none() => {
                return corrupt("it has no palette, `PLTE`, before its samples, which are numbers of one".into());
            }
            b"IDAT" => self.data = Some(self.data.unwrap_or(0) + u64::from(chunk.length)),
            b"IEND" => return Ok(false),
            _ if chunk.is_critical() => {
                let what = format!("it cannot be shown without its chunk `{}`, which is not known", chunk.shown());
                return Err(ReadError::Unsupported { what, instead: "save it as a plain PNG" });
            }
            _ => {}
        }
        Ok(true)
    }

    fn is_indexed(&self) -> bool {
        self.header.is_some_and(|(_, color)| color == INDEXED)
    }

    /// Number of entries that samples can index. Invalid bit depths are refused with the header.
    fn nameable(&self) -> usize {
        1 << self.header.map_or(8, |(bits, _)| bits.min(8))
    }

    /// Palettes of pictures that are not indexed are only suggestions, and are ignored.
    fn palette(&mut self, chunk: &Chunk) -> Result<(), ReadError> {
        if !self.is_indexed() {
            return Ok(());
        }
        let (bytes, most) = (chunk.length as usize, self.nameable());
        if self.palette.is_some() || self.data.is_some() {
            return Err(ReadError::corrupt("it must have one palette, `PLTE`, before its samples"));
        }
        if bytes == 0 || !bytes.is_multiple_of(3) || bytes / 3 > most {
            let message =
                format!("its palette, `PLTE`, has {bytes} bytes; it must have 3 for each of 1 to {most} colours");
            return Err(ReadError::corrupt(message));
        }
        self.palette = Some(bytes / 3);
        Ok(())
    }

    /// Checks the opacity of palette entries; for other pictures the decoder handles it.
    fn transparency(&self, chunk: &Chunk) -> Result<(), ReadError> {
        if !self.is_indexed() {
            return Ok(());
        }
        let Some(colors) = self.palette.filter(|_| self.data.is_none()) else {
            return Err(ReadError::corrupt("its opacities, `tRNS`, do not lie between its palette and its samples"));
        };
        if chunk.length as usize > colors {
            let message = format!("it has opacities, `tRNS`, for {} colours, but only {colors} colours", chunk.length);
            return Err(ReadError::corrupt(message));
        }
        Ok(())
    }

    fn finish(self) -> Result<Chunks, ReadError> {
        let Some(data) = self.data else {
            return Err(ReadError::corrupt("it has no samples: there is no chunk `IDAT`"));
        };
        let most = self.nameable();
        Ok(Chunks { data, short_palette: self.palette.filter(|colors| *colors < most) })
    }
}
