//! The form of a kept result: its content, then a seal that says what it is the content of.
//!
//! The seal is a magic word, the content's length, and a tag over the build, the shelf, the key, the length and the content.
//! An entry that was cut, altered, moved to another key or shelf, or made by another build does not match and is not used.
//! The tag is computed from the hash of the content, so a content whose hash is known can be sealed without reading it.
use crate::value::Key;

/// Changes when the form of entries does, and tells byte orders apart.
const MAGIC: u64 = 0x5348_4942_4f00_0002;

/// A kind of results. In a folder each has a folder of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Shelf {
    /// Objects.
    Objects,
    /// Tiles of fields.
    Tiles,
    /// Encoded pictures.
    Files,
    /// Which channels materials have, and their keys.
    Channels,
    /// What fields prepared of whole pictures.
    Wholes,
}

impl Shelf {
    /// All shelves.
    pub const ALL: [Self; 5] = [Self::Objects, Self::Tiles, Self::Files, Self::Channels, Self::Wholes];

    /// The name of its folder.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Objects => "objects",
            Self::Tiles => "tiles",
            Self::Files => "files",
            Self::Channels => "channels",
            Self::Wholes => "wholes",
        }
    }

    /// The letters of the folder of an entry, and of its own name in that.
    pub(super) const LETTERS: [usize; 2] = [2, 30];

    /// Returns true if `SHELF/xx/NAME` is the place of an entry. Nothing else is removed from a store.
    pub fn is_entry(place: &str) -> bool {
        let mut parts = place.split('/');
        let shelf = parts.next().is_some_and(|name| Self::ALL.iter().any(|shelf| shelf.name() == name));
        let named = Self::LETTERS.into_iter().all(|letters| parts.next().is_some_and(|part| is_hex(part, letters)));
        shelf && named && parts.next().is_none()
    }

    /// Whether its entries go to other machines. Tiles are many and small: asking for each would take longer
    /// than computing most of them.
    pub(super) const fn travels(self) -> bool {
        !matches!(self, Self::Tiles)
    }
}

/// Returns true if a text is this many hexadecimal digits, as names of entries are.
pub(super) fn is_hex(text: &str, letters: usize) -> bool {
    text.len() == letters && text.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'))
}

/// What the entries of one build have in common: names that no other build uses, and tags that no other build accepts.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Seal {
    build: Key,
    /// What only those know who may write, if there are others.
    secret: Option<[u8; 32]>,
}

impl std::fmt::Debug for Seal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Seal").field("build", &self.build).field("keyed", &self.secret.is_some()).finish()
    }
}

/// Length and hash of a content.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Digest {
    /// Bytes.
    pub length: u64,
    hash: [u8; 32],
}

/// Makes a [`Digest`] of parts.
#[derive(Default)]
pub struct Digester {
    length: u64,
    hasher: blake3::Hasher,
}

impl Digester {
    /// Takes the next part.
    pub fn update(&mut self, part: &[u8]) {
        self.length += part.len() as u64;
        self.hasher.update(part);
    }

    /// Of all parts.
    pub fn finish(&self) -> Digest {
        Digest { length: self.length, hash: *self.hasher.finalize().as_bytes() }
    }
}

impl Seal {
    /// The bytes of a seal.
    pub const BYTES: usize = 8 + 8 + 16;

    /// The seals of a build, named by its fingerprint.
    pub const fn new(build: Key) -> Self {
        Self { build, secret: None }
    }

    /// The same for those who know `secret`: without it nobody makes tags that it accepts.
    #[must_use]
    pub fn keyed(self, secret: &[u8]) -> Self {
        Self { secret: Some(blake3::derive_key("shibo 2026 entries of shared caches", secret)), ..self }
    }

    /// A tag over `parts`, each delimited.
    pub(super) fn tag(&self, domain: &str, parts: &[&[u8]]) -> [u8; 32] {
        let mut hasher = self.secret.as_ref().map_or_else(blake3::Hasher::new, blake3::Hasher::new_keyed);
        for part in std::iter::once(domain.as_bytes()).chain(parts.iter().copied()) {
            hasher.update(&(part.len() as u64).to_le_bytes());
            hasher.update(part);
        }
        *hasher.finalize().as_bytes()
    }

    /// The name of an entry, in this build.
    pub fn name(&self, key: Key) -> Key {
        let parts = [self.build.as_bytes().as_slice(), key.as_bytes()];
        match self.secret {
            // The beginning of the tag: as good a name as any.
            Some(_) => Key::from_bytes(*self.tag("entry", &parts).first_chunk().unwrap_or(&[0; 16])),
            None => Key::of("entry", &parts),
        }
    }

    /// What follows a content that belongs to `key`.
    pub fn of(&self, shelf: Shelf, key: Key, content: &Digest) -> [u8; Self::BYTES] {
        let length = content.length.to_le_bytes();
        let parts = [&self.build.as_bytes()[..], shelf.name().as_bytes(), key.as_bytes(), &length, &content.hash];
        let mut seal = [0; Self::BYTES];
        seal[..8].copy_from_slice(&MAGIC.to_ne_bytes());
        seal[8..16].copy_from_slice(&content.length.to_ne_bytes());
        seal[16..].copy_from_slice(Key::of("seal", &parts).as_bytes());
        seal
    }

    /// How long the content before `seal` is said to be; `None` if this is no seal.
    pub fn length(seal: &[u8; Self::BYTES]) -> Option<u64> {
        let word = |at: usize| Some(u64::from_ne_bytes(*seal[at..].first_chunk()?));
        if word(0)? == MAGIC { word(8) } else { None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seal_is_of_one_place_and_one_content() {
        let digest = |content: &[u8]| {
            let mut digester = Digester::default();
            content.chunks(2).for_each(|part| digester.update(part));
            digester.finish()
        };
        let [a, b] = ["a", "b"].map(|word| Key::of("test", &[word.as_bytes()]));
        let seal = Seal::new(a).of(Shelf::Tiles, a, &digest(b"content"));
        assert_eq!(Seal::new(a).of(Shelf::Tiles, a, &digest(b"content")), seal);
        assert_eq!(Seal::length(&seal), Some(7));
        let others = [
            Seal::new(b).of(Shelf::Tiles, a, &digest(b"content")),
            Seal::new(a).of(Shelf::Objects, a, &digest(b"content")),
            Seal::new(a).of(Shelf::Tiles, b, &digest(b"content")),
            Seal::new(a).of(Shelf::Tiles, a, &digest(b"contents")),
            Seal::new(a).of(Shelf::Tiles, a, &digest(b"contend")),
        ];
        others.into_iter().for_each(|other| assert_ne!(other, seal));
        assert_ne!(Seal::new(a).name(a), Seal::new(b).name(a));
        assert_eq!(Seal::length(&[0; Seal::BYTES]), None);
    }
}
