//! The format of an entry shared between machines: content, seal, and a check over both and the entry's name. The check
//! can be verified without the key of the result.
use crate::eval::{Digester, Seal, Shelf};
use crate::value::Key;

/// Length of the check in bytes.
const CHECK: usize = 32;
/// Bytes that an entry adds to its content.
pub(super) const MORE: u64 = (Seal::BYTES + CHECK) as u64;

/// Result of checking an entry.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Checked {
    /// Intact, and written with the same secret (or both without one).
    Whole,
    /// Damaged, or written with a different secret.
    Foreign,
}

/// Makes the entry of a content.
pub(super) fn close(seal: &Seal, name: &str, content: &[u8], sealed: &[u8; Seal::BYTES]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(content.len() + Seal::BYTES + CHECK);
    bytes.extend_from_slice(content);
    bytes.extend_from_slice(sealed);
    let check = seal.tag("shared entry", &[name.as_bytes(), &bytes]);
    bytes.extend(check);
    bytes
}

/// The content of an entry, if the entry is intact and belongs to this shelf and key.
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

/// Checks that an entry is the one written under its name.
pub(super) fn check(seal: &Seal, name: &str, bytes: &[u8]) -> Checked {
    let right = bytes.split_last_chunk::<CHECK>().is_some_and(|(before, check)| {
        // Constant-time comparison, so that a tag cannot be guessed byte by byte.
        let tag = blake3::Hash::from_bytes(seal.tag("shared entry", &[name.as_bytes(), before]));
        tag == blake3::Hash::from_bytes(*check)
    });
    if right { Checked::Whole } else { Checked::Foreign }
}

impl Seal {
    /// Checks that the bytes under a name of a shared store are an entry written there with this seal's secret.
    #[must_use]
    pub fn check(&self, name: &str, bytes: &[u8]) -> Checked {
        check(self, name, bytes)
    }
}
