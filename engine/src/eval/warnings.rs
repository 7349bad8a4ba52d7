//! Warnings of nodes about their results.
//!
//! The warnings of a result, and those of the results before it, are kept with it, in memory and in the store. A result
//! from a cache brings them along. This holds for objects, for tiles, for data prepared from whole pictures and for files.
//!
//! Code that fills tiles may find the same fault in many of them, so one warning of each result counts: the first in the
//! order of the places, row by row, with places on the canvas before those beyond it. The choice depends neither on the
//! order in which tiles are computed nor on their division.
use crate::diagnostics::{Code, Problem};
use crate::value::{Grid, Key};
use serde::{Deserialize, Serialize};
use std::cmp::Ordering;
use std::collections::{BTreeMap, HashMap};
use std::sync::{Arc, Mutex};

/// The most warnings about the values of tiles that are kept with a result. A tile may be made of the tiles of thousands
/// of nodes.
const MOST: usize = 64;

/// Says who has found a warning.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(crate) enum Finder {
    /// The node, when it was evaluated.
    Node,
    /// The code of a field, in a tile.
    Tile,
    /// The code of a field, in a tile, at a place beyond the canvas.
    Beyond,
}

/// A warning of a node.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Warning {
    /// The first output of the node, or the result that a field belongs to.
    pub(super) owner: Key,
    pub(super) problem: Problem,
    pub(super) finder: Finder,
}

/// The warnings of a result and of all results that it was made of: those of nodes, then those of tiles by owner.
pub(crate) type Warnings = Arc<[Warning]>;

impl Warning {
    /// A warning about values that code of a field found while it filled a tile of `grid`.
    pub(super) fn of_tile(owner: Key, problem: Problem, grid: &Grid) -> Self {
        let inside = |at: &[f64; 3]| {
            let size = grid.picture().map(|size| size.as_dvec2() * grid.step);
            size.is_none_or(|size| (0.0..=size.x).contains(&at[0]) && (0.0..=size.y).contains(&at[1]))
        };
        let finder = if problem.at_mm.as_deref().is_none_or(inside) { Finder::Tile } else { Finder::Beyond };
        Self { owner, problem, finder }
    }

    /// The problem, without the place in the text.
    pub(crate) const fn problem(&self) -> &Problem {
        &self.problem
    }

    /// True if the warning is about values of a tile.
    pub(super) fn is_of_tile(&self) -> bool {
        self.finder != Finder::Node
    }

    /// The order of the warnings about values that a result has: on the canvas first, then row by row.
    fn order(&self, other: &Self) -> Ordering {
        let (a, b) = (&self.problem, &other.problem);
        let placed = match (a.at_mm.as_deref(), b.at_mm.as_deref()) {
            (Some(a), Some(b)) => {
                [1, 0, 2].map(|axis| a[axis].total_cmp(&b[axis])).into_iter().fold(Ordering::Equal, Ordering::then)
            }
            (a, b) => a.is_some().cmp(&b.is_some()),
        };
        let texts = || (&a.message, &a.help, &a.field).cmp(&(&b.message, &b.help, &b.field));
        self.finder.cmp(&other.finder).then(placed).then_with(texts)
    }
}

/// True if some of these warnings are about single places. Other pixels of the same tile may have none.
pub(super) fn are_placed(warnings: &[Warning]) -> bool {
    warnings.iter().any(|warning| warning.is_of_tile() && warning.problem.at_mm.is_some())
}

/// The warnings of several results.
#[derive(Clone, Debug, Default)]
pub(crate) struct Gathered(Warnings);

impl Gathered {
    /// Adds the warnings of a result.
    pub(crate) fn add(&mut self, more: &Warnings) {
        if self.0.is_empty() {
            self.0 = Arc::clone(more);
        } else if !Arc::ptr_eq(&self.0, more) && !more.iter().all(|warning| self.0.contains(warning)) {
            self.0 = merged(self.0.iter().chain(more.iter()));
        }
    }

    /// Adds one warning.
    pub(super) fn push(&mut self, warning: Warning) {
        self.add(&Arc::from([warning]));
    }

    /// The warnings, each once.
    pub(crate) fn warnings(&self) -> Warnings {
        Arc::clone(&self.0)
    }
}

/// The warnings of nodes, each once and in this order, then one warning of each owner about values of tiles.
fn merged<'w>(all: impl Iterator<Item = &'w Warning>) -> Warnings {
    let mut merged: Vec<Warning> = Vec::new();
    let mut of_tiles: BTreeMap<Key, &Warning> = BTreeMap::new();
    for warning in all {
        if warning.is_of_tile() {
            let first = of_tiles.entry(warning.owner).or_insert(warning);
            if warning.order(first).is_lt() {
                *first = warning;
            }
        } else if !merged.contains(warning) {
            merged.push(warning.clone());
        }
    }
    // The least owners of several lists are those of their union, so the order of merging does not matter.
    merged.extend(of_tiles.into_values().take(MOST).cloned());
    merged.into()
}

/// The warnings that a run has found.
#[derive(Default)]
pub(super) struct Found {
    /// By result; results without warnings have no entry.
    pub(super) results: Mutex<HashMap<Key, Warnings>>,
    /// The warnings of nodes that were reported.
    pub(super) reported: Mutex<Vec<Warning>>,
    /// The warnings about values of tiles. They are reported at the end of the run, when all of them are known.
    pub(super) of_tiles: Mutex<Gathered>,
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
    finder: Finder,
}

/// Warnings as bytes; none for no warnings.
pub(super) fn to_bytes(warnings: &[Warning]) -> Vec<u8> {
    let stored: Vec<Stored<'_>> = warnings.iter().map(Stored::of).collect();
    if stored.is_empty() { Vec::new() } else { postcard::to_allocvec(&stored).unwrap_or_default() }
}

/// The warnings in bytes. `None` for bytes that [`to_bytes`] did not make.
pub(super) fn from_bytes(bytes: &[u8]) -> Option<Warnings> {
    if bytes.is_empty() {
        return Some(Warnings::default());
    }
    let (stored, rest) = postcard::take_from_bytes::<Vec<Stored<'_>>>(bytes).ok()?;
    if rest.is_empty() && !stored.is_empty() { stored.into_iter().map(Stored::warning).collect() } else { None }
}

/// Appends warnings to the bytes of a result: a list, then its length.
pub(crate) fn append(bytes: &mut Vec<u8>, warnings: &[Warning]) {
    let list = to_bytes(warnings);
    bytes.extend_from_slice(&list);
    bytes.extend_from_slice(&u32::try_from(list.len()).unwrap_or(0).to_le_bytes());
}

/// Splits the bytes of a result from its warnings. `None` for bytes that [`append`] did not make.
pub(crate) fn split(bytes: &[u8]) -> Option<(&[u8], Warnings)> {
    let (bytes, length) = bytes.split_last_chunk::<4>()?;
    let length = usize::try_from(u32::from_le_bytes(*length)).ok()?;
    let (bytes, list) = bytes.split_at_checked(bytes.len().checked_sub(length)?)?;
    Some((bytes, from_bytes(list)?))
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
            finder: warning.finder,
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
        Some(Warning { owner: Key::from_bytes(self.owner), problem, finder: self.finder })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(word: &str) -> Key {
        Key::of("test", &[word.as_bytes()])
    }

    fn by_node(owner: &str, problem: Problem) -> Warning {
        Warning { owner: key(owner), problem, finder: Finder::Node }
    }

    /// A warning of a tile at a place in mm on a canvas of 8 mm.
    fn in_tile(owner: &str, at: [f64; 2]) -> Warning {
        let (step, period) = (glam::DVec2::splat(0.5), Some(glam::UVec2::splat(16)));
        let grid = Grid { origin: glam::DVec2::ZERO, step, period, shown: None };
        let problem = Problem::new(Code::Advice, format!("not finite at {at:?}")).at_mm([at[0], at[1], 0.0]);
        Warning::of_tile(key(owner), problem, &grid)
    }

    #[test]
    fn reads_back_stored_warnings() {
        let found = [
            by_node("a", Problem::new(Code::Advice, "an edge is open").at("mesh").within(2..5).help("close it")),
            by_node("b", Problem::new(Code::Advice, "too steep").at_mm([1.5, -2.0, 0.25])),
            in_tile("c", [2.0, 1.0]),
            in_tile("c", [-2.0, 1.0]),
        ];
        let mut bytes = b"a result".to_vec();
        append(&mut bytes, &found);
        assert_eq!(split(&bytes), Some((b"a result".as_slice(), Warnings::from(found.clone()))));
        assert_eq!(from_bytes(&to_bytes(&found)), Some(found.into()));
        let mut bytes = b"a result".to_vec();
        append(&mut bytes, &[]);
        assert_eq!(split(&bytes), Some((b"a result".as_slice(), Warnings::default())));
        assert_eq!((to_bytes(&[]), from_bytes(b"")), (Vec::new(), Some(Warnings::default())));
    }

    #[test]
    fn refuses_bytes_that_hold_no_warnings() {
        for bytes in [b"".as_slice(), b"abc", &[9, 0, 0, 0], &[255; 9], &[1, 7, 3, 0, 0, 0]] {
            assert_eq!(split(bytes), None, "{bytes:?}");
        }
        let mut longer = to_bytes(&[in_tile("a", [0.0; 2])]);
        longer.push(0);
        assert_eq!((from_bytes(&longer), from_bytes(&[0])), (None, None));
    }

    /// The warnings of lists, added in this order.
    fn gathered(lists: &[&[Warning]]) -> Warnings {
        let mut all = Gathered::default();
        lists.iter().for_each(|list| all.add(&Warnings::from(*list)));
        all.warnings()
    }

    #[test]
    fn counts_the_first_place_of_each_owner_in_any_order() {
        let [first, later, right, beyond] =
            [[6.0, 1.0], [1.0, 2.0], [7.0, 1.0], [1.0, -1.0]].map(|at| in_tile("a", at));
        let (other, node) = (in_tile("b", [3.0, 3.0]), by_node("a", Problem::new(Code::Advice, "of the node")));
        let lists: [&[Warning]; 4] =
            [std::slice::from_ref(&beyond), &[node.clone(), later.clone()], &[right], &[first.clone(), other.clone()]];
        let wanted = gathered(&lists);
        assert_eq!((wanted.len(), &wanted[0]), (3, &node));
        assert!(wanted.contains(&first) && wanted.contains(&other), "{wanted:?}");
        for turn in 1..lists.len() {
            let mut turned = lists;
            turned.rotate_left(turn);
            assert_eq!(gathered(&turned), wanted);
            turned.reverse();
            assert_eq!(gathered(&turned), wanted);
        }
        // A place beyond the canvas counts if there is no other.
        assert_eq!(*gathered(&[std::slice::from_ref(&beyond)]), [beyond]);
        assert!(are_placed(&wanted) && !are_placed(&[node]));
    }

    #[test]
    fn keeps_the_same_few_owners_in_any_order() {
        let all: Vec<Warning> = (0..3 * MOST).map(|n| in_tile(&n.to_string(), [1.0, 1.0])).collect();
        let forwards = gathered(&all.chunks(7).collect::<Vec<_>>());
        assert_eq!(forwards.len(), MOST);
        assert_eq!(gathered(&all.rchunks(5).collect::<Vec<_>>()), forwards);
    }
}
