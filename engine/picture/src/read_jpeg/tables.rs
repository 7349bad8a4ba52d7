//! Tracks the tables that a JPEG file defines between its scans.
use super::super::limits::ReadError;

/// Number of tables of each kind.
const PLACES: usize = 4;
/// Maximum number of code words of a Huffman table.
const MOST_WORDS: usize = 256;
/// Largest value of a code word for the first coefficient of a block.
const MOST_BITS: u8 = 15;

/// The tables that are defined.
#[derive(Debug, Default)]
pub(super) struct Tables {
    pub(super) quantization: [bool; PLACES],
    /// Huffman tables for the first coefficient of a block.
    pub(super) dc: [bool; PLACES],
    /// Huffman tables for the other coefficients.
    pub(super) ac: [bool; PLACES],
}

impl Tables {
    /// True if table number `place` of a kind is defined.
    pub(super) fn has(sort: &[bool; PLACES], place: u8) -> bool {
        sort.get(usize::from(place)).is_some_and(|defined| *defined)
    }

    /// Defines the standard Huffman tables, which Motion JPEG may omit.
    pub(super) fn add_usual(&mut self) {
        [&mut self.dc, &mut self.ac].into_iter().for_each(|sort| sort[..2].fill(true));
    }

    /// Processes a `DQT` segment.
    pub(super) fn define_quantization(&mut self, mut content: &[u8]) -> Result<(), ReadError> {
        while let Some((info, rest)) = content.split_first() {
            let (precision, place) = (info >> 4, usize::from(info & 15));
            let size = match precision {
                0 => 64,
                1 => 128,
                _ => return Err(wrong("a quantization table has another precision than 8 or 16 bits")),
            };
            let defined = self.quantization.get_mut(place).ok_or_else(|| wrong("a quantization table has no place"))?;
            content = rest.get(size..).ok_or_else(|| wrong("a quantization table is too short"))?;
            *defined = true;
        }
        Ok(())
    }

    /// Processes a `DHT` segment.
    pub(super) fn define_huffman(&mut self, mut content: &[u8]) -> Result<(), ReadError> {
        while let Some((info, rest)) = content.split_first() {
            let (class, place) = (info >> 4, usize::from(info & 15));
            let (counts, rest) = rest.split_first_chunk::<16>().ok_or_else(|| wrong("a Huffman table is too short"))?;
            let words: usize = counts.iter().map(|count| usize::from(*count)).sum();
            let values = rest.get(..words).filter(|_| words <= MOST_WORDS);
            let values = values.ok_or_else(|| wrong("a Huffman table has more code words than room for them"))?;
            if !is_code(counts) || (class == 0 && values.iter().any(|value| *value > MOST_BITS)) {
                return Err(wrong("a Huffman table is none"));
            }
            let sort = match class {
                0 => &mut self.dc,
                1 => &mut self.ac,
                _ => return Err(wrong("a Huffman table is of an unknown sort")),
            };
            *sort.get_mut(place).ok_or_else(|| wrong("a Huffman table has no place"))? = true;
            content = &rest[words..];
        }
        Ok(())
    }
}

/// True if these lengths form a prefix code in which no code word consists of ones only.
fn is_code(counts: &[u8; 16]) -> bool {
    let mut next = 0_u32;
    (1..).zip(counts).all(|(length, count)| {
        next = 2 * next + u32::from(*count);
        *count == 0 || next < 1 << length
    })
}

fn wrong(reason: &str) -> ReadError {
    ReadError::corrupt(reason)
}
