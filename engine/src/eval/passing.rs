//! Letting go of tiles while a picture is computed from top to bottom: those that no row to come can read.
//!
//! Every field says which part of its inputs it reads for a window of its own ([`FieldSource::span`]). From the rows that
//! are still to be computed follows what may be read of every field on the way, and all other tiles are needed no more.
//! Where a field does not say, its inputs are kept.
//!
//! [`FieldSource::span`]: crate::value::FieldSource::span
use super::memory::TileKey;
use super::run::{Run, address};
use super::tiles::{Extent, Piece, extents, pieces};
use crate::value::{Field, Grid, GridId, Window};
use std::collections::{BTreeSet, HashMap};

/// What may be read of a field is not followed beyond so many pixels.
const FARTHEST: u32 = 1 << 18;

/// The fields that a render reads, readers before what they read, and which of their tiles it may still want.
pub struct Passing<'f> {
    parts: Vec<Part<'f>>,
}

struct Part<'f> {
    field: &'f Field,
    grid: Grid,
    extents: (Extent, Extent),
    /// Whether it is one of the pictures.
    shown: bool,
    /// The places in the list of those that read it; no places if one of them may read anything.
    readers: Option<Vec<usize>>,
    /// The numbers of the columns and rows of tiles that are wanted.
    columns: BTreeSet<i32>,
    rows: BTreeSet<i32>,
}

impl<'f> Passing<'f> {
    /// For pictures of `fields` in `window`; to be told to [`Run::pass`] row by row.
    pub fn new(fields: &[&'f Field], grid: &Grid, window: Window) -> Self {
        let mut order = Vec::new();
        let mut known = HashMap::new();
        for field in fields {
            visit(field, grid, &mut known, &mut order);
        }
        let place = |field: &Field, grid: &Grid| Some(order.len() - 1 - known.get(&(address(field), grid.id()))?);
        let mut parts: Vec<Part<'f>> = order
            .iter()
            .rev()
            .map(|&(field, grid)| Part {
                field,
                grid,
                extents: extents(field, &grid),
                shown: false,
                readers: Some(Vec::new()),
                columns: BTreeSet::new(),
                rows: BTreeSet::new(),
            })
            .collect();
        for at in fields.iter().filter_map(|field| place(field, grid)) {
            parts[at].shown = true;
        }
        for reader in 0..parts.len() {
            let (field, grid) = (parts[reader].field, parts[reader].grid);
            let says = field.source().span(&grid, window).is_some();
            for (input, on) in field.source().reads(&grid) {
                let Some(at) = place(input, &on) else { continue };
                let same = on.id() == grid.id();
                parts[at].readers = parts[at].readers.take().filter(|_| says && same).map(|mut readers| {
                    readers.push(reader);
                    readers
                });
            }
        }
        let mut passing = Self { parts };
        let wanted = passing.wanted(window);
        for (part, wanted) in passing.parts.iter_mut().zip(wanted) {
            if let Some(wanted) = wanted {
                (part.columns, part.rows) = (numbers(&wanted.columns), numbers(&wanted.rows));
            }
        }
        passing
    }

    /// What may be read of each field while the rows `rest` of the pictures are computed; nothing where it is not known.
    fn wanted(&self, rest: Window) -> Vec<Option<Tiles>> {
        let mut wanted: Vec<Option<Tiles>> = Vec::with_capacity(self.parts.len());
        for part in &self.parts {
            let windows = part.readers.as_ref().and_then(|readers| {
                let of_reader = |&reader: &usize| {
                    let Part { field, grid, .. } = &self.parts[reader];
                    field.source().span(grid, wanted.get(reader)?.as_ref()?.window)
                };
                readers.iter().map(of_reader).collect::<Option<Vec<_>>>()
            });
            let window =
                windows.and_then(|windows| windows.into_iter().chain(part.shown.then_some(rest)).reduce(union));
            wanted.push(window.and_then(|window| Tiles::around(window, part.extents)));
        }
        wanted
    }

    /// The tiles that are not wanted any more once only the rows `rest` of the pictures are to be computed; each is told
    /// once.
    fn passed(&mut self, rest: Window) -> Vec<(&'f Field, GridId, (i32, i32))> {
        let wanted = self.wanted(rest);
        let mut passed = Vec::new();
        for (part, wanted) in self.parts.iter_mut().zip(wanted) {
            let Some(wanted) = wanted else { continue };
            let still = numbers(&wanted.rows);
            for row in part.rows.difference(&still) {
                passed.extend(part.columns.iter().map(|column| (part.field, part.grid.id(), (*column, *row))));
            }
            part.rows.retain(|row| still.contains(row));
        }
        passed
    }
}

/// Puts what a field reads into `order`, then the field.
fn visit<'f>(
    field: &'f Field,
    grid: &Grid,
    known: &mut HashMap<(usize, GridId), usize>,
    order: &mut Vec<(&'f Field, Grid)>,
) {
    if known.contains_key(&(address(field), grid.id())) {
        return;
    }
    for (input, grid) in field.source().reads(grid) {
        visit(input, &grid, known, order);
    }
    known.insert((address(field), grid.id()), order.len());
    order.push((field, *grid));
}

fn numbers(pieces: &[Piece]) -> BTreeSet<i32> {
    pieces.iter().map(|piece| piece.index).collect()
}

fn union(a: Window, b: Window) -> Window {
    let (x, y) = (a.x.min(b.x), a.y.min(b.y));
    let (right, bottom) = (a.right().max(b.right()), a.bottom().max(b.bottom()));
    Window { x, y, width: right.abs_diff(x), height: bottom.abs_diff(y) }
}

/// The tiles of a field that a window touches.
struct Tiles {
    columns: Vec<Piece>,
    rows: Vec<Piece>,
    /// What they cover.
    window: Window,
}

impl Tiles {
    fn around(window: Window, (across, down): (Extent, Extent)) -> Option<Self> {
        if window.width > FARTHEST || window.height > FARTHEST {
            return None;
        }
        let columns = pieces(window.x, window.right(), across);
        let rows = pieces(window.y, window.bottom(), down);
        let from = |pieces: &[Piece]| Some(pieces.first()?.from());
        let to = |pieces: &[Piece]| Some(pieces.last()?.to());
        let (x, y) = (from(&columns)?, from(&rows)?);
        let window = Window { x, y, width: to(&columns)?.abs_diff(x), height: to(&rows)?.abs_diff(y) };
        Some(Self { columns, rows, window })
    }
}

impl Run<'_> {
    /// Forgets the tiles that are not wanted any more once only the rows `rest` of the pictures are to be computed.
    pub fn pass(&self, passing: &mut Passing<'_>, rest: Window) {
        for (field, grid, at) in passing.passed(rest) {
            if let Some(field) = field.key() {
                self.caches.memory.tiles.remove(&TileKey { field, grid, at });
            }
        }
    }
}
