//! The chunks of a PNG file about colour spaces and orientation, at any position in the file.
use super::super::{HeaderStatements, icc};
use super::chunks::{Chunk, FIRST, next};
use flate2::read::ZlibDecoder;
use image::metadata::Orientation;
use std::io::{BufRead, Read, Seek};

/// Maximum bytes of EXIF data that are read; the orientation comes early.
const MOST_EXIF: u64 = 64 << 10;

/// The content of these chunks.
pub(super) struct Tags {
    pub(super) icc: Option<Vec<u8>>,
    pub(super) told: HeaderStatements,
    pub(super) orientation: Orientation,
}

/// Scans the chunks of a file of `length` bytes as far as they can be followed. Of two chunks with the same name the
/// first one counts; a chunk that is too short is ignored.
pub(super) fn find<R: BufRead + Seek>(reader: &mut R, length: u64) -> Tags {
    let mut tags = Tags { icc: None, told: HeaderStatements::default(), orientation: Orientation::NoTransforms };
    let mut seen: Vec<[u8; 4]> = Vec::new();
    let mut at = FIRST;
    while let Ok(chunk) = next(reader, at, length) {
        at = chunk.end();
        if matches!(&chunk.name, b"cICP" | b"iCCP" | b"sRGB" | b"gAMA" | b"cHRM" | b"eXIf")
            && !seen.contains(&chunk.name)
        {
            seen.push(chunk.name);
            let _ = tags.take(&chunk, reader);
        }
    }
    tags
}

impl Tags {
    fn take(&mut self, chunk: &Chunk, reader: &mut impl Read) -> Option<()> {
        let mut content = reader.take(u64::from(chunk.length));
        match &chunk.name {
            b"cICP" => self.told.cicp = Some(array(&mut content)?),
            b"sRGB" => self.told.srgb = true,
            b"gAMA" => self.told.gamma = Some(u32::from_be_bytes(array(&mut content)?)),
            b"cHRM" => {
                let stored: [u8; 32] = array(&mut content)?;
                let (numbers, _) = stored.as_chunks::<4>();
                let mut chromaticities = [0.0; 8];
                for (out, number) in chromaticities.iter_mut().zip(numbers) {
                    #[expect(clippy::cast_possible_truncation, reason = "five digits fit")]
                    let number = (f64::from(u32::from_be_bytes(*number)) / 1e5) as f32;
                    *out = number;
                }
                // White comes first.
                chromaticities.rotate_left(2);
                self.told.chromaticities = Some(chromaticities);
            }
            b"iCCP" => match profile(&mut content) {
                Ok(profile) => self.icc = Some(profile),
                Err(why) => self.told.broken_profile = Some(why),
            },
            _ => {
                let mut exif = Vec::new();
                content.take(MOST_EXIF).read_to_end(&mut exif).ok()?;
                self.orientation = Orientation::from_exif_chunk(&exif).unwrap_or(Orientation::NoTransforms);
            }
        }
        Some(())
    }
}

fn array<const N: usize>(reader: &mut impl Read) -> Option<[u8; N]> {
    let mut bytes = [0; N];
    reader.read_exact(&mut bytes).ok().map(|()| bytes)
}

/// A profile: its name, a zero, the method 0 and the compressed bytes. The error is the reason, as `is …`.
fn profile(content: &mut impl Read) -> Result<Vec<u8>, String> {
    let damaged = |_| "is damaged".to_owned();
    let mut packed = Vec::new();
    // Unpacking stops behind the limit.
    let most = icc::MOST_BYTES as u64 + 1;
    content.take(most).read_to_end(&mut packed).map_err(damaged)?;
    let name = packed.iter().take(80).position(|byte| *byte == 0);
    let rest = name.and_then(|end| packed[end + 1..].strip_prefix(&[0])).ok_or("is damaged")?;
    let mut profile = Vec::new();
    let unpacked = ZlibDecoder::new(rest).take(most).read_to_end(&mut profile);
    if profile.len() > icc::MOST_BYTES {
        return Err(icc::too_large());
    }
    unpacked.map_err(damaged).map(|_| profile)
}
