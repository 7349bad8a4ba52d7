//! The form of an entry that machines share: content, seal, and a check of both under the entry's name, which can be
//! verified without knowing the key of the result.
use crate::eval::{Digester, Seal, Shelf};
use crate::value::Key;

/// The bytes of the check.
const CHECK: usize = 32;
/// How much longer an entry is than its content.
pub(super) const MORE: u64 = (Seal::BYTES + CHECK) as u64;

/// What an entry is found to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Checked {
    /// Whole, and written with the same secret, or with none if there is none.
    Whole,
    /// Damaged, or written with another secret.
    Foreign,
}

/// The entry of a content.
pub(super) fn close(seal: &Seal, name: &str, content: &[u8], sealed: &[u8; Seal::BYTES]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(content.len() + Seal::BYTES + CHECK);
    bytes.extend_from_slice(content);
    bytes.extend_from_slice(sealed);
    let check = seal.tag("shared entry", &[name.as_bytes(), &bytes]);
    bytes.extend(check);
    bytes
}

/// The content of an entry, if it is that of this place.
pub(super) fn open(seal: &Seal, (shelf, key): (Shelf, Key), name: &str, mut bytes: Vec<u8>) -> Option<Vec<u8>> {
    if check(seal, name, &bytes) != Checked::Whole {
        return None;
    }
    let content = bytes.len().checked_sub(Seal::BYTES + CHECK)?;
    let mut digest = Digester::default();
    digest.update(&bytes[..content]);
    let whole = seal.of(shelf, key, &digest.finish()) == bytes[content..content + Seal::BYTES];
    bytes.truncate(content);
    whole.then_some(bytes)
}

/// Whether an entry is what was written under its name.
pub(super) fn check(seal: &Seal, name: &str, bytes: &[u8]) -> Checked {
    let right = bytes.split_last_chunk::<CHECK>().is_some_and(|(before, check)| {
        // Compared in constant time, so that nobody can find a tag byte by byte.
        let tag = blake3::Hash::from_bytes(seal.tag("shared entry", &[name.as_bytes(), before]));
        tag == blake3::Hash::from_bytes(*check)
    });
    if right { Checked::Whole } else { Checked::Foreign }
}

impl Seal {
    /// Whether the bytes under a name of a shared store are an entry that was written there with this seal's secret.
    #[must_use]
    pub fn check(&self, name: &str, bytes: &[u8]) -> Checked {
        check(self, name, bytes)
    }
}
