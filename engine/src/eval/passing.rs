//! Frees tiles while a picture is computed from top to bottom: those that no later row can read.
//!
//! Every field says which windows of others it reads for a window of its own ([`FieldSource::inputs`]). From the rows that
//! are still to be computed follows what may be read of every field, and all other tiles are no longer needed.
//!
//! [`FieldSource::inputs`]: crate::value::FieldSource::inputs
use super::memory::TileKey;
use super::prepare::{At, at, reads};
use super::run::Run;
use crate::value::{Blocks, Field, FieldId, Grid, Piece, Window};
use std::collections::{BTreeSet, HashMap, HashSet};

/// A larger window, in pixels, counts as the whole field.
pub(super) const FARTHEST: u32 = 1 << 18;

/// The fields that a render reads, each before those that it reads, and which of their tiles may still be read.
pub struct Passing<'f> {
    parts: Vec<Part<'f>>,
    places: HashMap<At, usize>,
}

struct Part<'f> {
    field: &'f Field,
    grid: Grid,
    /// Whether it is one of the pictures.
    shown: bool,
    /// The numbers of the columns and rows of tiles that are wanted.
    columns: BTreeSet<i32>,
    rows: BTreeSet<i32>,
}

/// What may be read of a field.
#[derive(Clone, Copy)]
enum Wanted {
    Nothing,
    Window(Window),
    Everything,
}

impl Wanted {
    fn add(&mut self, window: Window) {
        *self = match *self {
            Self::Nothing => Self::Window(window),
            Self::Window(before) => Self::Window(before.union(&window)),
            Self::Everything => Self::Everything,
        };
    }
}

impl<'f> Passing<'f> {
    /// For pictures of `fields` in `window`; to be given to [`Run::pass`] after each band.
    pub fn new(fields: &[&'f Field], grid: &Grid, window: Window) -> Self {
        let order = readers_first(fields, grid);
        let shown: HashSet<FieldId> = fields.iter().map(|field| field.id()).collect();
        let part = |(field, on): (&'f Field, Grid)| {
            let shown = on.id() == grid.id() && shown.contains(&field.id());
            Part { field, grid: on, shown, columns: BTreeSet::new(), rows: BTreeSet::new() }
        };
        let parts: Vec<Part<'f>> = order.into_iter().map(part).collect();
        let places = parts.iter().enumerate().map(|(place, part)| (at(part.field, &part.grid), place)).collect();
        let mut passing = Self { parts, places };
        let wanted = passing.wanted(window);
        for (part, blocks) in passing.parts.iter_mut().zip(wanted) {
            if let Some(blocks) = blocks {
                (part.columns, part.rows) = (numbers(&blocks.columns), numbers(&blocks.rows));
            }
        }
        passing
    }

    /// The blocks that may be read of each field while the rows `rest` of the pictures are computed; nothing where it is
    /// not known.
    fn wanted(&self, rest: Window) -> Vec<Option<Blocks>> {
        let mut wanted = vec![Wanted::Nothing; self.parts.len()];
        let mut blocks = Vec::with_capacity(self.parts.len());
        for (place, part) in self.parts.iter().enumerate() {
            if part.shown {
                wanted[place].add(rest);
            }
            let near = |window: &Window| window.width <= FARTHEST && window.height <= FARTHEST;
            let of_part = match wanted[place] {
                Wanted::Window(window) if near(&window) => Some(part.field.domain().blocks(&part.grid, window)),
                _ => None,
            };
            match of_part.as_ref().and_then(Blocks::window) {
                Some(window) => {
                    let source = part.field.source();
                    for read in source.inputs(&part.grid, window).iter().chain(&source.later(&part.grid, window)) {
                        if let Some(input) = self.places.get(&at(read.field, &read.grid)) {
                            wanted[*input].add(read.window);
                        }
                    }
                }
                None if matches!(wanted[place], Wanted::Nothing) => {}
                None => {
                    for read in reads(part.field, &part.grid) {
                        if let Some(input) = self.places.get(&at(read.field, &read.grid)) {
                            wanted[*input] = Wanted::Everything;
                        }
                    }
                }
            }
            blocks.push(match wanted[place] {
                Wanted::Nothing => Some(Blocks::default()),
                _ => of_part,
            });
        }
        blocks
    }

    /// The tiles that are not wanted any more once only the rows `rest` of the pictures are to be computed; each is given
    /// once.
    fn passed(&mut self, rest: Window) -> Vec<(&'f Field, Grid, (i32, i32))> {
        let wanted = self.wanted(rest);
        let mut passed = Vec::new();
        for (part, blocks) in self.parts.iter_mut().zip(wanted) {
            let Some(blocks) = blocks else { continue };
            let still = numbers(&blocks.rows);
            for row in part.rows.difference(&still) {
                passed.extend(part.columns.iter().map(|column| (part.field, part.grid, (*column, *row))));
            }
            part.rows.retain(|row| still.contains(row));
        }
        passed
    }
}

/// All fields that are read for tiles, each before those that it reads.
pub(super) fn readers_first<'f>(fields: &[&'f Field], grid: &Grid) -> Vec<(&'f Field, Grid)> {
    let mut order = Vec::new();
    let mut seen = HashSet::new();
    let mut open: Vec<(&Field, Grid, bool)> = fields.iter().map(|field| (*field, *grid, false)).collect();
    while let Some((field, grid, inputs_are_done)) = open.pop() {
        if inputs_are_done {
            order.push((field, grid));
        } else if seen.insert(at(field, &grid)) {
            open.push((field, grid, true));
            open.extend(reads(field, &grid).map(|read| (read.field, read.grid, false)));
        }
    }
    order.reverse();
    order
}

fn numbers(pieces: &[Piece]) -> BTreeSet<i32> {
    pieces.iter().map(|piece| piece.index).collect()
}

impl Run<'_> {
    /// Frees the tiles that are not wanted any more once only the rows `rest` of the pictures are to be computed.
    pub fn pass(&self, passing: &mut Passing<'_>, rest: Window) {
        for (field, grid, at) in passing.passed(rest) {
            if let Some(field) = field.key() {
                let tile = TileKey { field, grid: grid.id(), at };
                self.caches.memory.tiles.remove(&tile);
                if let Some(part) = self.reach.get().and_then(|reach| reach.at(&tile)) {
                    self.caches.memory.tiles.remove(&part);
                }
            }
        }
    }
}
