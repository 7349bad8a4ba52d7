//! Parts of pictures: rows of all pictures of a render in one file, to be joined with the other parts.
//!
//! A part holds rows as the format's encoder takes them: already rounded to integers or halves, not yet compressed. So
//! joining is reading, compressing and writing, and the file is that of a single run, byte for byte.
//!
//! ```text
//! MAGIC, length of the header, header (JSON)
//! rows of the pictures, in whole or in blocks of columns, as they were computed; at most 8 MiB at once
//! index (JSON): what lies where, and the hash of each
//! MAGIC, place of the index, hash of header and index
//! ```
//!
//! A file that was cut has no end, and one that was altered another hash. Numbers are little-endian.
mod join;
mod names;
mod read;
mod write;

pub(crate) use join::is_overlap;
pub use join::{JoinError, Joined, JoinedFile, JoinedPart, join};
pub use names::is_output_letter;
pub use read::is_whole;
pub use write::PartWriter;

use super::encode::Tally;
use super::spec::PictureSpec;
use serde::{Deserialize, Serialize};

/// How a part begins and ends.
const MAGIC: &[u8; 8] = b"ShiboP2\n";
/// Bytes that are read and checked at once.
const CHUNK: usize = 8 << 20;
/// The most bytes of a header or an index.
const MOST: u64 = 64 << 20;
/// How the names of parts end.
pub(crate) const EXTENSION: &str = "part";

/// One of several parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PartOf {
    /// Which, from 1.
    pub number: u32,
    /// Of how many.
    pub count: u32,
}

impl std::fmt::Display for PartOf {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.number, self.count)
    }
}

impl PartOf {
    /// Which of `pieces` pieces belong to it: as many as to any other, or one more.
    #[must_use]
    pub fn of(self, pieces: u32) -> std::ops::Range<u32> {
        let edge = |number: u32| u64::from(pieces) * u64::from(number) / u64::from(self.count.max(1));
        let edge = |number: u32| u32::try_from(edge(number)).unwrap_or(pieces);
        edge(self.number.saturating_sub(1))..edge(self.number)
    }

    /// The name of its file, `stem` being that of the graph.
    #[must_use]
    pub fn file_name(self, stem: &str) -> String {
        let digits = self.count.to_string().len();
        format!("{stem}.{:0digits$}-of-{}.{EXTENSION}", self.number, self.count)
    }

    /// The name of the file that this part leaves for those beside it.
    pub(crate) fn overlap_name(self, stem: &str) -> String {
        let [begin, end] = OVERLAP;
        format!("{begin}{stem}.{}-of-{}.{end}", self.number, self.count)
    }

    /// Whether a file of this name was left by a part of a graph for those beside it.
    pub(crate) fn is_overlap_name(name: &str, stem: &str) -> bool {
        let [begin, end] = OVERLAP;
        let rest = name.strip_prefix(begin).and_then(|name| name.strip_prefix(stem)?.strip_prefix('.'));
        let middle = rest.and_then(|rest| rest.strip_suffix(end)?.strip_suffix('.'));
        middle.is_some_and(|middle| middle.contains("-of-") && !middle.contains('.'))
    }
}

/// How files begin that parts leave for each other; changes when their form does.
pub(crate) const OVERLAP_MAGIC: [u8; 8] = *b"ShiboO2\n";

/// How the names of files begin and end that parts leave for each other.
const OVERLAP: [&str; 2] = [".", "overlap"];

/// What a part is of.
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
    /// Which part.
    pub part: PartOf,
    /// The first row in it, and how many there are.
    pub rows: [u32; 2],
    /// The pictures, in the order of the graph's outputs.
    pub pictures: Vec<PartPicture>,
}

/// A picture of which a part has rows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PartPicture {
    /// The name of its file.
    pub file: String,
    /// Names everything that its bytes depend on.
    pub key: String,
    /// How it is encoded; none for a file without rows, which the first part holds whole.
    pub spec: Option<PictureSpec>,
}

/// Where something lies in a part.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Chunk {
    /// The number of the picture.
    picture: usize,
    /// The first row in the picture, and how many; 0 of a file without rows.
    row: u32,
    rows: u32,
    /// The first column, and how many.
    x: u32,
    width: u32,
    at: u64,
    length: u64,
    hash: String,
}

/// What follows the rows.
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
    fn parts_share_pieces_evenly_and_leave_none_out() {
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
