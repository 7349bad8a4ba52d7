//! Damaged inputs: valid ones with bytes changed, removed, repeated, moved, or taken from another input.
#![allow(dead_code, clippy::unwrap_used, reason = "each test program uses a part of it")]
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The longest time for one input; a slower one counts as a failure.
const LONGEST: Duration = Duration::from_secs(20);

/// Words of all the formats, and edge cases: ends, limits, signs.
const WORDS: [&[u8]; 28] = [
    b"(",
    b")",
    b"[",
    b"]",
    b"{",
    b"}",
    b"\"",
    b"\\",
    b",",
    b":",
    b"=",
    b"$",
    b"//",
    b"/*",
    b"\r\n",
    b"\0",
    b"-",
    b"1e308",
    b"-0",
    b"NaN",
    b"inf",
    b"18446744073709551616",
    b"\xff\xff\xff\xff",
    b"\x7f\xff\xff\xff",
    b"\x80\x00\x00\x00",
    b"\xef\xbb\xbf",
    "\u{1F409}".as_bytes(),
    b"\xc3",
];

/// A pseudo-random generator.
pub(crate) struct Chance(u64);

impl Chance {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x5EED)
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    pub(crate) fn below(&mut self, n: usize) -> usize {
        usize::try_from(self.next() % (n.max(1) as u64)).unwrap_or(0)
    }

    /// One of the inputs, damaged in one to five ways.
    pub(crate) fn damaged(&mut self, seeds: &[Vec<u8>]) -> Vec<u8> {
        let mut out = seeds[self.below(seeds.len())].clone();
        for _ in 0..=self.below(5) {
            // Every second damage lies near the beginning, where headers are.
            let far = if self.below(2) == 0 { out.len().min(400) } else { out.len() };
            let at = self.below(far + 1).min(out.len());
            let to = (at + 1 + self.below(24)).min(out.len());
            match self.below(9) {
                0 if at < out.len() => out[at] = self.next().to_le_bytes()[0],
                1 if at < out.len() => out[at] ^= 1 << self.below(8),
                2 => drop(out.drain(at..to)),
                3 => out.truncate(at),
                4 => drop(out.splice(at..at, WORDS[self.below(WORDS.len())].iter().copied())),
                5 => drop(out.splice(at..to, WORDS[self.below(WORDS.len())].iter().copied())),
                6 => {
                    let piece = out[at..to].to_vec().repeat(1 + self.below(40));
                    out.splice(at..at, piece);
                }
                7 => {
                    let other = &seeds[self.below(seeds.len())];
                    let from = self.below(other.len());
                    let piece = other[from..(from + 1 + self.below(200)).min(other.len())].to_vec();
                    out.splice(at..to, piece);
                }
                _ => {
                    let piece: Vec<u8> = out.drain(at..to).collect();
                    let there = self.below(out.len() + 1);
                    out.splice(there..there, piece);
                }
            }
        }
        out.truncate(1 << 20);
        out
    }
}

/// The folder of kept inputs for a target: those that once failed.
pub(crate) fn corpus(target: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fuzz/corpus").join(target)
}

/// Feeds `target` its corpus, its undamaged seeds, and damaged inputs: `count` of them, or as many as fit in
/// FUZZ_SECONDS. FUZZ_SEED gives other inputs. An input that panics or takes too long is added to the corpus.
pub(crate) fn fuzz(target: &str, seeds: &[Vec<u8>], count: usize, feed: impl Fn(&[u8])) {
    let number = |name: &str| std::env::var(name).ok().and_then(|n| n.parse::<u64>().ok());
    let (seconds, first) = (number("FUZZ_SECONDS"), number("FUZZ_SEED").unwrap_or(0));
    let mut files: Vec<PathBuf> =
        corpus(target).read_dir().into_iter().flatten().flatten().map(|entry| entry.path()).collect();
    files.sort();
    let kept: Vec<Vec<u8>> = files.iter().filter_map(|file| std::fs::read(file).ok()).collect();
    let all: Vec<Vec<u8>> = seeds.iter().chain(&kept).cloned().collect();
    let begun = Instant::now();
    let mut slowest = Duration::ZERO;
    let mut tried = 0;
    let go_on = |tried: usize| match seconds {
        Some(seconds) => begun.elapsed().as_secs() < seconds,
        None => tried < count + all.len(),
    };
    while tried < all.len() || go_on(tried) {
        let input = match all.get(tried) {
            Some(input) => input.clone(),
            None => Chance::new(first.wrapping_mul(1 << 40).wrapping_add(tried as u64)).damaged(&all),
        };
        let start = Instant::now();
        let result = catch_unwind(AssertUnwindSafe(|| feed(&input)));
        let took = start.elapsed();
        slowest = slowest.max(took);
        if result.is_err() || took > LONGEST {
            let file = corpus(target).join(format!("{tried:06}-{first}"));
            let saved = std::fs::create_dir_all(corpus(target)).and_then(|()| std::fs::write(&file, &input));
            panic!("{target}: input {tried} took {took:?}, see above; it is in {} ({saved:?})", file.display());
        }
        tried += 1;
    }
    println!("{target}: {tried} inputs in {:.1?}, no crash, the slowest took {slowest:.1?}", begun.elapsed());
}

/// Checks that a message for users contains no text of a panic.
pub(crate) fn plain(text: &str) {
    for word in ["panicked", "`Option::", "`Result::", "index out of bounds", "overflow", "byte index", "RefCell"] {
        assert!(!text.contains(word), "a message tells of `{word}`: {text}");
    }
}
