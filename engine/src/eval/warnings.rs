//! Warnings of nodes about their results.
//!
//! The warnings of a result, and those of the results before it, are kept with it, in memory and in the store. A result
//! from a cache brings them along. Warnings about the values of tiles are not kept: they are reported when a tile is
//! computed.
use crate::diagnostics::{Code, Problem};
use crate::value::Key;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeSet, HashMap};
use std::sync::{Arc, Mutex};

/// A warning of a node.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Warning {
    /// The first output of the node.
    pub(super) owner: Key,
    pub(super) problem: Problem,
}

/// The warnings of a result and of all results that it was made of.
pub(super) type Warnings = Arc<[Warning]>;

/// The warnings that a run has found.
#[derive(Default)]
pub(super) struct Found {
    /// By result; results without warnings have no entry.
    pub(super) results: Mutex<HashMap<Key, Warnings>>,
    /// The warnings that were reported.
    pub(super) reported: Mutex<Vec<Warning>>,
    /// Results whose tiles have already reported a warning.
    pub(super) of_tiles: Mutex<BTreeSet<Key>>,
}

/// A warning in the store.
#[derive(Serialize, Deserialize)]
struct Stored<'a> {
    owner: [u8; 16],
    code: &'a str,
    field: Option<&'a str>,
    within: Option<(usize, usize)>,
    message: &'a str,
    help: Option<&'a str>,
    at_mm: Option<[f64; 3]>,
}

/// Appends warnings to the bytes of a result: a list, then its length.
pub(super) fn append(bytes: &mut Vec<u8>, warnings: &[Warning]) {
    let stored: Vec<Stored<'_>> = warnings.iter().map(Stored::of).collect();
    let list = if stored.is_empty() { Vec::new() } else { postcard::to_allocvec(&stored).unwrap_or_default() };
    bytes.extend_from_slice(&list);
    bytes.extend_from_slice(&u32::try_from(list.len()).unwrap_or(0).to_le_bytes());
}

/// Splits the bytes of a result from its warnings. `None` for bytes that [`append`] did not make.
pub(super) fn split(bytes: &[u8]) -> Option<(&[u8], Vec<Warning>)> {
    let (bytes, length) = bytes.split_last_chunk::<4>()?;
    let length = usize::try_from(u32::from_le_bytes(*length)).ok()?;
    let (bytes, list) = bytes.split_at_checked(bytes.len().checked_sub(length)?)?;
    if list.is_empty() {
        return Some((bytes, Vec::new()));
    }
    let stored: Vec<Stored<'_>> = postcard::from_bytes(list).ok()?;
    Some((bytes, stored.into_iter().map(Stored::warning).collect::<Option<_>>()?))
}

impl<'a> Stored<'a> {
    fn of(warning: &'a Warning) -> Self {
        let Problem { code, field, within, message, help, at_mm } = &warning.problem;
        Self {
            owner: *warning.owner.as_bytes(),
            code: code.as_str(),
            field: field.as_deref(),
            within: within.as_ref().map(|range| (range.start, range.end)),
            message,
            help: help.as_deref(),
            at_mm: at_mm.as_deref().copied(),
        }
    }

    fn warning(self) -> Option<Warning> {
        let code = *Code::ALL.iter().find(|code| code.as_str() == self.code)?;
        let problem = Problem {
            code,
            field: self.field.map(str::to_owned),
            within: self.within.map(|(start, end)| start..end),
            message: self.message.to_owned(),
            help: self.help.map(str::to_owned),
            at_mm: self.at_mm.map(Box::new),
        };
        Some(Warning { owner: Key::from_bytes(self.owner), problem })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_back_stored_warnings() {
        let key = |word: &str| Key::of("test", &[word.as_bytes()]);
        let warning = |owner: &str, problem: Problem| Warning { owner: key(owner), problem };
        let found = [
            warning("a", Problem::new(Code::Advice, "an edge is open").at("mesh").within(2..5).help("close it")),
            warning("b", Problem::new(Code::Advice, "too steep").at_mm([1.5, -2.0, 0.25])),
        ];
        let mut bytes = b"a result".to_vec();
        append(&mut bytes, &found);
        assert_eq!(split(&bytes), Some((b"a result".as_slice(), found.to_vec())));
        let mut bytes = b"a result".to_vec();
        append(&mut bytes, &[]);
        assert_eq!(split(&bytes), Some((b"a result".as_slice(), Vec::new())));
    }

    #[test]
    fn refuses_bytes_that_hold_no_warnings() {
        for bytes in [b"".as_slice(), b"abc", &[9, 0, 0, 0], &[255; 9], &[1, 7, 3, 0, 0, 0]] {
            assert_eq!(split(bytes), None, "{bytes:?}");
        }
    }
}
