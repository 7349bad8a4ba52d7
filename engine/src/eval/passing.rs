//! Frees tiles while a picture is computed from top to bottom, or from left to right: those that nothing later can read.
//!
//! Every field says which windows of others it reads for a window of its own ([`FieldSource::inputs`]). From the rows or columns
//! that are still to be computed follows what may be read of every field, and all other tiles are no longer needed.
//!
//! [`FieldSource::inputs`]: crate::value::FieldSource::inputs
use super::memory::TileKey;
use super::prepare::{At, at, reads};
use super::run::Run;
use crate::value::{Blocks, Field, FieldId, Grid, Piece, Window};
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

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
            let of_part = match wanted[place] {
                Wanted::Window(window) => {
                    let window = part.field.domain().one_repeat(&part.grid, window);
                    let near = window.width <= FARTHEST && window.height <= FARTHEST;
                    near.then(|| part.field.domain().blocks(&part.grid, window))
                }
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

    /// The bytes of the tiles that are at hand while some rows or columns of pictures are computed: those that were read for these
    /// or earlier ones, `before`, and may be read for these or later ones, `after`. `kept` says of which fields tiles are kept, and
    /// how many columns and rows of them at most.
    fn bytes(&self, before: Window, after: Window, kept: impl Fn(&Field, &Grid) -> Option<(u64, u64)>) -> u64 {
        let window = before.union(&after);
        let mut bytes = 0;
        for ((part, before), after) in self.parts.iter().zip(self.wanted(before)).zip(self.wanted(after)) {
            let Some((width, height)) = kept(part.field, &part.grid) else { continue };
            let pixels = match (&before, &after) {
                (Some(before), Some(after)) => {
                    both(&before.columns, &after.columns).min(width) * both(&before.rows, &after.rows).min(height)
                }
                // All of it may be read.
                _ => u64::from(window.width).min(width) * u64::from(window.height).min(height),
            };
            bytes += pixels * 4 * part.field.channels() as u64;
        }
        bytes
    }

    /// The tiles that are not wanted any more once only the rows or columns `rest` of the pictures are to be computed; each is
    /// given once.
    fn passed(&mut self, rest: Window) -> Vec<(&'f Field, Grid, (i32, i32))> {
        let wanted = self.wanted(rest);
        let mut passed = Vec::new();
        for (part, blocks) in self.parts.iter_mut().zip(wanted) {
            let Some(blocks) = blocks else { continue };
            let (columns, rows) = (numbers(&blocks.columns), numbers(&blocks.rows));
            let gone: Vec<i32> = part.columns.difference(&columns).copied().collect();
            for row in &part.rows {
                // Of a row that is wanted, the columns that are not.
                let free: &mut dyn Iterator<Item = &i32> =
                    if rows.contains(row) { &mut gone.iter() } else { &mut part.columns.iter() };
                passed.extend(free.map(|column| (part.field, part.grid, (*column, *row))));
            }
            part.rows.retain(|row| rows.contains(row));
            part.columns.retain(|column| columns.contains(column));
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

/// The length of those pieces that are among others too.
fn both(pieces: &[Piece], others: &[Piece]) -> u64 {
    let others = numbers(others);
    let lengths: BTreeMap<i32, u64> = pieces.iter().map(|piece| (piece.index, u64::from(piece.length))).collect();
    lengths.into_iter().filter(|(index, _)| others.contains(index)).map(|(_, length)| length).sum()
}

fn numbers(pieces: &[Piece]) -> BTreeSet<i32> {
    pieces.iter().map(|piece| piece.index).collect()
}

impl Run<'_> {
    /// The bytes of the tiles that are at hand while some rows or columns of pictures are computed: what was read for these or earlier
    /// ones, `before`, and may be read for these or later ones, `after`.
    pub fn bytes_at_hand(&self, passing: &Passing<'_>, before: Window, after: Window) -> u64 {
        passing.bytes(before, after, |field, grid| {
            let read = || self.reached(|reach| reach.size(field, grid)).unwrap_or((u64::MAX, u64::MAX));
            self.keeps(field, grid).then(read)
        })
    }

    /// Frees the tiles that are not wanted any more once only the rows or columns `rest` of the pictures are to be computed.
    pub fn pass(&self, passing: &mut Passing<'_>, rest: Window) {
        for (field, grid, at) in passing.passed(rest) {
            if let Some(field) = field.key() {
                let tile = TileKey { field, grid: grid.id(), at };
                self.caches.memory.tiles.remove(&tile);
                if let Some(part) = self.reached(|reach| reach.at(&tile)) {
                    self.caches.memory.tiles.remove(&part);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::value::{Halo, Key, TILE, Tiling, Type};
    use glam::{DVec2, UVec2};

    /// A blur of 100 pixels over a source, 16 × 16 tiles.
    fn blurred(tiling: Tiling) -> Field {
        let keyed = |field: Field, name: &str| field.keyed(Key::of("test", &[name.as_bytes()]));
        let source = keyed(Field::generate(Type::Gray, tiling, |_, _| Ok(())), "a");
        let fill = |_: &mut crate::value::Tile, [_]: [&crate::value::Tile; 1]| Ok(());
        keyed(Field::map(Type::Gray, [source], Halo::px(100), fill), "b")
    }

    fn all(field: &Field, _: &Grid) -> Option<(u64, u64)> {
        field.as_constant().is_none().then_some((u64::MAX, u64::MAX))
    }

    #[test]
    fn tiles_at_hand_are_counted() {
        let grid = Grid { origin: DVec2::ZERO, step: DVec2::ONE, period: Some(UVec2::splat(4096)), shown: None };
        let bytes = |field: &Field, window: Window, band: Window| {
            let before = Window { height: band.bottom().abs_diff(window.y), ..window };
            let after = Window { y: band.y, height: window.bottom().abs_diff(band.y), ..window };
            Passing::new(&[field], &grid, window).bytes(before, after, all)
        };
        let whole = Window::full(UVec2::splat(4096));
        let band = Window { y: 2048, height: TILE, ..whole };
        // Of the source one row more above and below; beyond its ends, so many strips of 16 pixels as are read.
        let once = blurred(Tiling::NONE);
        let beyond = 112;
        let rows = |columns: u64, rows: u64| columns * rows * u64::from(TILE) * 4;
        assert_eq!(bytes(&once, whole, band), rows(4096, 1) + rows(4096 + 2 * beyond, 3));
        // What repeats has been read at the bottom for the first row, and is read again at the top for the last.
        assert_eq!(bytes(&blurred(Tiling::BOTH), whole, band), rows(4096, 1) + rows(4096, 5));
        let strip = Window { x: 1024, width: 1024, ..whole };
        assert_eq!(bytes(&once, strip, Window { x: 1024, width: 1024, ..band }), rows(1024, 1) + rows(1536, 3));
        // From left to right no more than what is read to the left of a column, the column and the one after it.
        let low = Window { y: 1024, height: TILE, ..whole };
        let (before, after) = (Window { width: 2304, ..low }, Window { x: 2048, width: 2048, ..low });
        let across = Passing::new(&[&once], &grid, low).bytes(before, after, all);
        assert_eq!(across, rows(u64::from(TILE), 1) + rows(3 * u64::from(TILE), 3));
        // Of a part's halo, not whole tiles.
        let part = Passing::new(&[&once], &grid, low).bytes(before, after, |_, _| Some((u64::MAX, 300)));
        assert_eq!(part, u64::from(TILE) * (u64::from(TILE) + 3 * 300) * 4);
    }

    #[test]
    fn what_repeats_is_wanted_once_however_far_it_is_read() {
        let grid = Grid { origin: DVec2::ZERO, step: DVec2::ONE, period: Some(UVec2::splat(16)), shown: None };
        let keyed = |field: Field, name: String| field.keyed(Key::of("test", &[name.as_bytes()]));
        let first = keyed(Field::generate(Type::Gray, Tiling::BOTH, |_, _| Ok(())), "first".to_owned());
        // 200 filters, each of which reads four pixels further: 100 repeats of the canvas.
        let last = (0..200).fold(first, |input, i| {
            let fill = |_: &mut crate::value::Tile, [_]: [&crate::value::Tile; 1]| Ok(());
            keyed(Field::map(Type::Gray, [input], Halo::px(4), fill), i.to_string())
        });
        let window = Window::full(UVec2::splat(16));
        let passing = Passing::new(&[&last], &grid, window);
        for blocks in passing.wanted(window) {
            assert_eq!(blocks.map(|blocks| blocks.count()), Some(1));
        }
    }

    #[test]
    fn tiles_pass_by_rows_and_by_columns() {
        let grid = Grid { origin: DVec2::ZERO, step: DVec2::ONE, period: Some(UVec2::splat(4096)), shown: None };
        let field = blurred(Tiling::BOTH);
        let part = Window { x: 0, y: 1024, width: 4096, height: 512 };
        let count = |rests: &[Window]| {
            let mut passing = Passing::new(&[&field], &grid, part);
            let mut seen = HashSet::new();
            for rest in rests {
                for (field, _, at) in passing.passed(*rest) {
                    assert!(seen.insert((field.id(), at)), "each is given once");
                }
            }
            seen.len()
        };
        let all =
            Passing::new(&[&field], &grid, part).parts.iter().map(|p| p.columns.len() * p.rows.len()).sum::<usize>();
        let columns: Vec<Window> =
            (1..16).map(|x| Window { x: x * 256, width: 4096 - x.cast_unsigned() * 256, ..part }).collect();
        let rows = [Window { y: 1280, height: 256, ..part }];
        // What is left is what the last column reads.
        let last = Passing::new(&[&field], &grid, columns[14]);
        let last: usize = last.parts.iter().map(|p| p.columns.len() * p.rows.len()).sum();
        assert_eq!(count(&columns), all - last);
        // Of the picture one row, and of the source the one above it.
        assert_eq!(count(&rows), 16 + 16);
    }
}
