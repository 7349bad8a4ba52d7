//! The format of a stored result: its content, then a seal that identifies the content.
//!
//! The seal is a magic word, the content's length, and a tag over the build, the shelf, the key, the length and the
//! content. An entry that was cut, altered, moved to another key or shelf, or made by another build does not match and
//! is not used. The tag is computed from the hash of the content, so content with a known hash can be sealed without
//! reading it.
use crate::value::Key;

/// Changes with the format of entries; its byte order identifies that of the machine.
const MAGIC: u64 = 0x5348_4942_4f00_0002;

/// A kind of results. On disk each shelf has its own folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Shelf {
    /// Objects.
    Objects,
    /// Tiles of fields.
    Tiles,
    /// Encoded pictures.
    Files,
    /// The channels that materials have, and the keys of these channels.
    Channels,
    /// Data that fields prepared from whole pictures.
    Wholes,
}

impl Shelf {
    /// All shelves.
    pub const ALL: [Self; 5] = [Self::Objects, Self::Tiles, Self::Files, Self::Channels, Self::Wholes];

    /// The name of the shelf's folder.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Objects => "objects",
            Self::Tiles => "tiles",
            Self::Files => "files",
            Self::Channels => "channels",
            Self::Wholes => "wholes",
        }
    }

    /// Number of letters of an entry's folder name and of its file name.
    pub(super) const LETTERS: [usize; 2] = [2, 30];

    /// Returns true if `place` has the form `SHELF/xx/NAME` of an entry. Nothing else is removed from a store.
    pub fn is_entry(place: &str) -> bool {
        let mut parts = place.split('/');
        let shelf = parts.next().is_some_and(|name| Self::ALL.iter().any(|shelf| shelf.name() == name));
        let named = Self::LETTERS.into_iter().all(|letters| parts.next().is_some_and(|part| is_hex(part, letters)));
        shelf && named && parts.next().is_none()
    }

    /// Returns true if entries of the shelf are shared with other machines. Tiles are not: they are many and small, so
    /// requesting each would take longer than computing most of them.
    pub(super) const fn travels(self) -> bool {
        !matches!(self, Self::Tiles)
    }
}

/// Returns true if a text is `letters` hexadecimal digits, as names of entries are.
pub(super) fn is_hex(text: &str, letters: usize) -> bool {
    text.len() == letters && text.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'))
}

/// Names and seals the entries of one build: no other build uses the same names or accepts the same tags.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Seal {
    build: Key,
    /// Shared by all machines that may write, if entries are shared.
    secret: Option<[u8; 32]>,
}

impl std::fmt::Debug for Seal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Seal").field("build", &self.build).field("keyed", &self.secret.is_some()).finish()
    }
}

/// Length and hash of an entry's content.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Digest {
    /// Length in bytes.
    pub length: u64,
    hash: [u8; 32],
}

/// Computes a [`Digest`] from successive parts.
#[derive(Default)]
pub struct Digester {
    length: u64,
    hasher: blake3::Hasher,
}

impl Digester {
    /// Adds the next part.
    pub fn update(&mut self, part: &[u8]) {
        self.length += part.len() as u64;
        self.hasher.update(part);
    }

    /// Returns the digest of all parts.
    pub fn finish(&self) -> Digest {
        Digest { length: self.length, hash: *self.hasher.finalize().as_bytes() }
    }
}

impl Seal {
    /// Length of a seal in bytes.
    pub const BYTES: usize = 8 + 8 + 16;

    /// The seals of the build with this fingerprint.
    pub const fn new(build: Key) -> Self {
        Self { build, secret: None }
    }

    /// A seal keyed with `secret`: tags it accepts cannot be forged without the secret.
    #[must_use]
    pub fn keyed(self, secret: &[u8]) -> Self {
        Self { secret: Some(blake3::derive_key("shibo 2026 entries of shared caches", secret)), ..self }
    }

    /// A tag over `parts`, each prefixed with its length.
    pub(super) fn tag(&self, domain: &str, parts: &[&[u8]]) -> [u8; 32] {
        let mut hasher = self.secret.as_ref().map_or_else(blake3::Hasher::new, blake3::Hasher::new_keyed);
        for part in std::iter::once(domain.as_bytes()).chain(parts.iter().copied()) {
            hasher.update(&(part.len() as u64).to_le_bytes());
            hasher.update(part);
        }
        *hasher.finalize().as_bytes()
    }

    /// The name of an entry in this build.
    pub fn name(&self, key: Key) -> Key {
        let parts = [self.build.as_bytes().as_slice(), key.as_bytes()];
        match self.secret {
            // The first 16 bytes of the tag serve as the name.
            Some(_) => Key::from_bytes(*self.tag("entry", &parts).first_chunk().unwrap_or(&[0; 16])),
            None => Key::of("entry", &parts),
        }
    }

    /// The seal to append to a content that belongs to `key`.
    pub fn of(&self, shelf: Shelf, key: Key, content: &Digest) -> [u8; Self::BYTES] {
        let length = content.length.to_le_bytes();
        let parts = [&self.build.as_bytes()[..], shelf.name().as_bytes(), key.as_bytes(), &length, &content.hash];
        let mut seal = [0; Self::BYTES];
        seal[..8].copy_from_slice(&MAGIC.to_ne_bytes());
        seal[8..16].copy_from_slice(&content.length.to_ne_bytes());
        seal[16..].copy_from_slice(Key::of("seal", &parts).as_bytes());
        seal
    }

    /// The content length that `seal` states; `None` if the bytes are not a seal.
    pub fn length(seal: &[u8; Self::BYTES]) -> Option<u64> {
        let word = |at: usize| Some(u64::from_ne_bytes(*seal[at..].first_chunk()?));
        if word(0)? == MAGIC { word(8) } else { None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seals_differ_by_key_shelf_build_and_content() {
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
