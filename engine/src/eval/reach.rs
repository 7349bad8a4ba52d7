//! Which pixels of each field are read while a part of a picture is computed.
//!
//! Tiles are computed whole as a rule, since the next tiles read them too. At the edges of a part nothing else does: a filter
//! that reads four rows of the tile above would make 256 of them, and each filter before it another 256. So for a part
//! everything is computed that is read, and no more. This follows from what fields state of themselves
//! ([`FieldSource::inputs`]), and a value depends on its position alone, so no pixel changes by it.
//!
//! [`FieldSource::inputs`]: crate::value::FieldSource::inputs
use super::halos::{Halo, Neighbor};
use super::memory::TileKey;
use super::passing::{FARTHEST, readers_first};
use super::prepare::{At, at, reads};
use super::run::{Run, lock};
use crate::value::{Blocks, Field, Grid, GridId, Key, Piece, TILE, Window};
use std::cmp::Reverse;
use std::collections::{HashMap, HashSet};
use std::sync::{Mutex, PoisonError};

/// The pixels that are read of each field.
pub(super) struct Reach {
    areas: Areas,
    /// Under which keys parts of tiles are kept.
    kept: Mutex<HashMap<TileKey, TileKey>>,
    /// Other parts of the picture, and what they read.
    neighbors: Vec<(Neighbor, Areas)>,
    /// How many fields read each, pictures included.
    readers: HashMap<At, u32>,
}

type Areas = HashMap<(Key, GridId), Area>;

/// Columns and rows; all pixels that lie in one of both are read.
#[derive(Clone, Debug, Default, PartialEq)]
struct Area {
    columns: Spans,
    rows: Spans,
}

/// Intervals in order, each further from the next than a tile is wide: in no tile there are two.
#[derive(Clone, Debug, Default, PartialEq)]
struct Spans(Vec<(i32, i32)>);

impl Spans {
    /// Adds those pixels of pieces that lie between `from` and `to`.
    fn add(&mut self, pieces: &[Piece], from: i32, to: i32) {
        for piece in pieces {
            let end = piece.start + piece.length.cast_signed();
            let (low, high) = ((from - piece.shift).max(piece.start), (to - piece.shift).min(end));
            if low < high {
                self.insert(low, high);
            }
        }
    }

    fn insert(&mut self, mut low: i32, mut high: i32) {
        let apart = TILE.cast_signed();
        self.0.retain(|&(from, to)| {
            let joins = from - apart < high && low < to + apart;
            if joins {
                (low, high) = (low.min(from), high.max(to));
            }
            !joins
        });
        let place = self.0.partition_point(|span| span.0 < low);
        self.0.insert(place, (low, high));
    }

    /// What lies in a piece.
    fn within(&self, piece: Piece) -> Option<(i32, i32)> {
        let (start, end) = (piece.start, piece.start + piece.length.cast_signed());
        self.0.iter().find(|(from, to)| *from < end && start < *to).map(|(from, to)| (*from.max(&start), *to.min(&end)))
    }
}

impl Area {
    fn add(&mut self, blocks: &Blocks, window: Window) {
        self.columns.add(&blocks.columns, window.x, window.right());
        self.rows.add(&blocks.rows, window.y, window.bottom());
    }

    /// What lies in a tile.
    fn within(&self, (x, y): (Piece, Piece)) -> Option<Window> {
        Some(between(self.columns.within(x)?, self.rows.within(y)?))
    }

    fn windows(&self) -> impl Iterator<Item = Window> {
        let rows = self.rows.0.iter();
        rows.flat_map(|&row| self.columns.0.iter().map(move |&column| between(column, row)))
    }
}

fn between((left, right): (i32, i32), (top, bottom): (i32, i32)) -> Window {
    Window { x: left, y: top, width: right.abs_diff(left), height: bottom.abs_diff(top) }
}

impl Reach {
    /// Of pictures of `fields` in `window`. All whole pictures that they need must be prepared.
    fn new(fields: &[&Field], grid: &Grid, window: Window, neighbors: Vec<Neighbor>) -> Self {
        let order = readers_first(fields, grid);
        let with_areas = |neighbor: Neighbor| {
            let areas = areas(&order, fields, grid, neighbor.window);
            (neighbor, areas)
        };
        let neighbors = neighbors.into_iter().map(with_areas).collect();
        Self {
            areas: areas(&order, fields, grid, window),
            kept: Mutex::default(),
            neighbors,
            readers: readers(&order, fields, grid),
        }
    }

    /// What one reader of a field owes of what the field does.
    pub(super) fn share(&self, field: &At) -> f64 {
        1.0 / f64::from(self.readers.get(field).copied().unwrap_or(1).max(1))
    }

    /// The key under which the part of a tile is kept that is read, if it is not computed whole.
    pub(super) fn at(&self, tile: &TileKey) -> Option<TileKey> {
        lock(&self.kept).remove(tile)
    }

    /// The part of a tile that is read, and under which key it is kept; `None` if it is to be computed whole: all of it is
    /// read, or more than is known here.
    pub(super) fn part(&self, tile: &TileKey, (x, y): (Piece, Piece), wanted: Window) -> Option<(TileKey, Window)> {
        let part = self.areas.get(&(tile.field, tile.grid))?.within((x, y))?;
        if !part.contains(&wanted) || part == Piece::window(x, y) {
            return None;
        }
        let key = *lock(&self.kept).entry(*tile).or_insert_with(|| named(tile, part));
        Some((key, part))
    }

    /// Whether there are other parts of the picture that read some of the same pixels.
    pub(super) fn has_neighbors(&self) -> bool {
        !self.neighbors.is_empty()
    }

    /// The pixels of a tile that others read too, the largest first. They are the same for both.
    pub(super) fn halos(&self, tile: &TileKey, at: (Piece, Piece)) -> Vec<Halo> {
        if self.neighbors.is_empty() {
            return Vec::new();
        }
        let within = |areas: &Areas| areas.get(&(tile.field, tile.grid))?.within(at);
        let Some(own) = within(&self.areas) else { return Vec::new() };
        let shared = |(neighbor, areas): &(Neighbor, Areas)| {
            let window = own.overlap(&within(areas)?)?;
            let Neighbor { spill, waits, .. } = neighbor.clone();
            Some(Halo { at: named(tile, window), window, spill, waits })
        };
        let mut halos: Vec<Halo> = self.neighbors.iter().filter_map(shared).collect();
        halos.sort_by_key(|halo| Reverse(halo.window.len()));
        halos
    }
}

/// What pictures of `fields` in `window` read; `order` are all fields that are read for them, each before those that it reads.
fn areas(order: &[(&Field, Grid)], fields: &[&Field], grid: &Grid, window: Window) -> Areas {
    // `None` is everything.
    let mut areas: HashMap<_, Option<Area>> = HashMap::new();
    let want = |areas: &mut HashMap<_, Option<Area>>, field: &Field, grid: &Grid, window: Window| {
        let area = areas.entry(at(field, grid)).or_insert_with(|| Some(Area::default()));
        let window = field.domain().one_repeat(grid, window);
        let near = window.width <= FARTHEST && window.height <= FARTHEST;
        match area.as_mut().filter(|_| near) {
            Some(known) if !window.is_empty() => known.add(&field.domain().blocks(grid, window), window),
            Some(_) => {}
            None => *area = None,
        }
    };
    fields.iter().for_each(|field| want(&mut areas, field, grid, window));
    let mut known = HashMap::new();
    for &(field, grid) in order {
        let Some(area) = areas.get(&at(field, &grid)).cloned() else { continue };
        let windows: Vec<Option<Window>> = match &area {
            Some(area) => area.windows().map(Some).collect(),
            None => vec![None],
        };
        for window in windows {
            let shown = window.unwrap_or(Window { x: 0, y: 0, width: 1, height: 1 });
            let source = field.source();
            for read in source.inputs(&grid, shown).into_iter().chain(source.later(&grid, shown)) {
                // A window that is too large to be looked at stands for everything.
                let all = Window { width: u32::MAX / 4, height: u32::MAX / 4, ..read.window };
                want(&mut areas, read.field, &read.grid, window.map_or(all, |_| read.window));
            }
        }
        if let (Some(key), Some(area)) = (field.key(), area) {
            known.insert((key, grid.id()), area);
        }
    }
    known
}

/// How many of `order`, and of pictures of `fields`, read each field.
fn readers(order: &[(&Field, Grid)], fields: &[&Field], grid: &Grid) -> HashMap<At, u32> {
    let mut readers = HashMap::new();
    let of = |(field, grid): &(&Field, Grid)| reads(field, grid).map(|read| at(read.field, &read.grid)).collect();
    let all: Vec<HashSet<At>> = order.iter().map(of).collect();
    let pictures = fields.iter().map(|field| at(field, grid));
    all.into_iter().flatten().chain(pictures).for_each(|read| *readers.entry(read).or_insert(0) += 1);
    readers
}

/// The key of a part of a tile.
fn named(tile: &TileKey, part: Window) -> TileKey {
    let place = [part.x, part.y, part.right(), part.bottom()].map(i32::to_le_bytes);
    let field = Key::of("part of a tile", &[tile.field.as_bytes(), place.as_flattened()]);
    TileKey { field, ..*tile }
}

impl Run<'_> {
    /// From now on, computes no more of each field than pictures of `fields` in `window` need, and nothing that `neighbors` have
    /// left. To be called when these fields are prepared and no tile is being computed.
    pub fn limit(&self, fields: &[&Field], grid: &Grid, window: Window, neighbors: Vec<Neighbor>) {
        let reach = Reach::new(fields, grid, window, neighbors);
        *self.reach.write().unwrap_or_else(PoisonError::into_inner) = Some(reach);
    }

    /// What is known of the pixels that are read, if only a part of a picture is computed.
    pub(super) fn reached<T>(&self, look: impl FnOnce(&Reach) -> Option<T>) -> Option<T> {
        self.reach.read().unwrap_or_else(PoisonError::into_inner).as_ref().and_then(look)
    }
}

#[cfg(test)]
mod tests {
    use super::super::spill::Spill;
    use super::*;
    use crate::value::{Halo, Tiling, Type};
    use glam::{DVec2, UVec2};
    use std::sync::Arc;

    fn grid() -> Grid {
        Grid { origin: DVec2::ZERO, step: DVec2::ONE, period: Some(UVec2::splat(2048)) }
    }

    fn keyed(field: Field, name: &str) -> Field {
        field.keyed(Key::of("test", &[name.as_bytes()]))
    }

    #[test]
    fn spans_stay_in_order_and_apart() {
        let mut spans = Spans::default();
        spans.insert(1000, 1100);
        spans.insert(0, 10);
        assert_eq!(spans.0, [(0, 10), (1000, 1100)]);
        spans.insert(200, 300);
        assert_eq!(spans.0, [(0, 300), (1000, 1100)]);
        spans.insert(400, 900);
        assert_eq!(spans.0, [(0, 1100)]);
    }

    #[test]
    fn a_part_reads_its_halo_and_wraps() {
        let source = keyed(Field::generate(Type::Gray, Tiling::BOTH, |_, _| Ok(())), "a");
        let fill = |_: &mut crate::value::Tile, [_]: [&crate::value::Tile; 1]| Ok(());
        let blurred = keyed(Field::map(Type::Gray, [source.clone()], Halo::px(7), fill), "b");
        let grid = grid();
        let window = Window { x: 0, y: 0, width: 2048, height: 512 };
        let reach = Reach::new(&[&blurred], &grid, window, Vec::new());
        let area = &reach.areas[&(source.key().unwrap(), grid.id())];
        assert_eq!(area.rows.0, [(0, 519), (2041, 2048)]);
        assert_eq!(area.columns.0, [(0, 2048)]);
        let piece = |index: i32| Piece { index, start: index * 256, length: 256, shift: 0 };
        let tile = TileKey { field: source.key().unwrap(), grid: grid.id(), at: (0, 2) };
        let wanted = Window { x: 0, y: 512, width: 256, height: 3 };
        let (key, part) = reach.part(&tile, (piece(0), piece(2)), wanted).unwrap();
        assert_eq!(part, Window { height: 7, ..wanted });
        assert_ne!(key, tile);
        // What nobody said that it would read is computed whole, and so is what is read whole.
        assert!(reach.part(&tile, (piece(0), piece(2)), Window { height: 8, ..wanted }).is_none());
        assert!(reach.part(&tile, (piece(0), piece(1)), Window { x: 0, y: 256, width: 1, height: 1 }).is_none());
        assert!(reach.part(&tile, (piece(0), piece(4)), Window { x: 0, y: 1024, width: 1, height: 1 }).is_none());
    }

    #[test]
    fn two_parts_agree_on_what_both_read() {
        let source = keyed(Field::generate(Type::Gray, Tiling::BOTH, |_, _| Ok(())), "a");
        let fill = |_: &mut crate::value::Tile, [_]: [&crate::value::Tile; 1]| Ok(());
        let blurred = keyed(Field::map(Type::Gray, [source.clone()], Halo::px(7), fill), "b");
        let (grid, dir) = (grid(), tempfile::tempdir().unwrap());
        let rows = |y: i32| Window { x: 0, y, width: 2048, height: 512 };
        let part = |own: i32, other: i32| {
            let spill = Arc::new(Spill::create(&dir.path().join("spill")).unwrap());
            let neighbor = Neighbor { window: rows(other), spill, waits: true };
            Reach::new(&[&blurred], &grid, rows(own), vec![neighbor])
        };
        let tile = |row: i32| TileKey { field: source.key().unwrap(), grid: grid.id(), at: (0, row) };
        let piece = |index: i32| Piece { index, start: index * 256, length: 256, shift: 0 };
        let (upper, lower, far) = (part(0, 512), part(512, 0), part(0, 1536));
        for (row, y) in [(1, 505), (2, 512)] {
            let halos = |reach: &Reach| {
                let halos = reach.halos(&tile(row), (piece(0), piece(row)));
                halos.into_iter().map(|halo| (halo.at, halo.window)).collect::<Vec<_>>()
            };
            let (key, window) = halos(&upper)[0];
            assert_eq!(window, Window { x: 0, y, width: 256, height: 7 });
            assert_eq!(halos(&lower), [(key, window)]);
        }
        // Across the edge of what repeats, and nothing in the middle.
        assert_eq!(far.halos(&tile(7), (piece(0), piece(7)))[0].window.height, 7);
        assert!(far.halos(&tile(2), (piece(0), piece(2))).is_empty());
    }
}
