//! Parts of pictures: one file with some rows of all pictures of a render, to be joined with the other parts.
//!
//! A part holds rows in the form that the format's encoder takes: already rounded to integers or halves, not yet
//! compressed. So joining only reads, compresses and writes, and the file equals that of a single run byte for byte.
//!
//! ```text
//! MAGIC, length of the header, header (JSON)
//! chunks: whole rows of pictures or blocks of columns, in order of computation; at most 8 MiB each
//! index (JSON): the location and the hash of each chunk
//! MAGIC, location of the index, hash of header and index
//! ```
//!
//! A truncated file lacks the last line, and a modified file has another hash. Numbers are little-endian.
mod join;
mod names;
mod read;
mod write;

pub use join::{JoinError, Joined, JoinedFile, JoinedPart, join};
pub use names::is_output_letter;
pub use read::is_whole;
pub use write::PartWriter;

use super::encode::Tally;
use super::spec::PictureSpec;
use serde::{Deserialize, Serialize};

/// The first and last bytes of a part.
const MAGIC: &[u8; 8] = b"ShiboP2\n";
/// Maximum bytes of a chunk, which is read and checked at once.
const CHUNK: usize = 8 << 20;
/// Maximum bytes of a header or an index.
const MOST: u64 = 64 << 20;
/// The file extension of parts.
pub(crate) const EXTENSION: &str = "part";

/// Number of a part among all parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PartOf {
    /// Number of the part, from 1.
    pub number: u32,
    /// Number of parts.
    pub count: u32,
}

impl std::fmt::Display for PartOf {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.number, self.count)
    }
}

impl PartOf {
    /// The range of this part when `pieces` pieces are divided evenly among the parts.
    #[must_use]
    pub fn of(self, pieces: u32) -> std::ops::Range<u32> {
        let edge = |number: u32| u64::from(pieces) * u64::from(number) / u64::from(self.count.max(1));
        let edge = |number: u32| u32::try_from(edge(number)).unwrap_or(pieces);
        edge(self.number.saturating_sub(1))..edge(self.number)
    }

    /// The file name of the part; `stem` is the name of the graph.
    #[must_use]
    pub fn file_name(self, stem: &str) -> String {
        let digits = self.count.to_string().len();
        format!("{stem}.{:0digits$}-of-{}.{EXTENSION}", self.number, self.count)
    }
}

/// The header of a part: the render that it belongs to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PartHeader {
    /// The version of the program.
    pub version: String,
    /// The fingerprint of its code.
    pub build: String,
    /// The name of the graph.
    pub graph: String,
    /// The values of its parameters.
    pub parameters: String,
    /// The seed of its canvas.
    pub seed: u64,
    /// Width and height of the whole pictures in pixels.
    pub size: [u32; 2],
    /// Number of this part.
    pub part: PartOf,
    /// Index of its first row, and the number of its rows.
    pub rows: [u32; 2],
    /// The pictures, in the order of the graph's outputs.
    pub pictures: Vec<PartPicture>,
}

/// A picture of the render.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PartPicture {
    /// The name of its file.
    pub file: String,
    /// A key of everything that the bytes of the picture depend on.
    pub key: String,
    /// The encoding; `None` for a file without rows, which the first part holds whole.
    pub spec: Option<PictureSpec>,
}

/// Location of a block of samples in a part.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Chunk {
    /// Index of the picture.
    picture: usize,
    /// The first row in the picture, and the number of rows; 0 for a file without rows.
    row: u32,
    rows: u32,
    /// The first column, and the number of columns.
    x: u32,
    width: u32,
    at: u64,
    length: u64,
    hash: String,
}

/// Index behind the rows.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Index {
    chunks: Vec<Chunk>,
    tallies: Vec<Tally>,
}

fn hash(parts: &[&[u8]]) -> blake3::Hash {
    let mut hasher = blake3::Hasher::new();
    parts.iter().for_each(|part| {
        hasher.update(part);
    });
    hasher.finalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn divides_all_pieces_evenly_among_parts() {
        for (pieces, count) in [(32, 16), (33, 16), (1, 1), (7, 7), (256, 3)] {
            let mut at = 0;
            for number in 1..=count {
                let own = PartOf { number, count }.of(pieces);
                assert_eq!(own.start, at);
                assert!((pieces / count..=pieces / count + 1).contains(&(own.end - own.start)));
                at = own.end;
            }
            assert_eq!(at, pieces);
        }
        assert_eq!(PartOf { number: 3, count: 64 }.file_name("calf"), "calf.03-of-64.part");
    }
}
