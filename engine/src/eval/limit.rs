//! Limits the computed pixels when only a part of a picture is rendered: to its demand, minus the pixels that
//! neighbours have handed over.
//!
//! Tiles are usually computed whole, since the next tiles read them too. Beyond the edges of a part no tile follows: a
//! filter that reads four rows of the tile above would compute 256 rows, and each filter before it another 256. A part
//! therefore computes only the pixels in its [`Demand`].
//!
//! The overlap, the pixels that two parts both read, is either handed over to the other part or computed twice. Handing
//! over every field would write several times as much as needed: once a height is there, its inputs are not read. So
//! the fields are visited from the pictures to their inputs. A field is handed over if more than a quarter of its
//! overlap is still read; its inputs are then not read for these pixels.
use super::Store;
use super::demand::{At, Demand, Fields, at};
use super::memory::{TileKey, Warned};
use super::region::{Region, minus};
use super::warnings::{Gathered, Warnings, are_placed};
use crate::value::{Field, Grid, Piece, Tile, Window};
use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;

/// A field is handed over if more than one pixel in this many of its overlap is still read.
const READ: u64 = 4;

/// Another part of the picture, near the computed one.
#[derive(Clone)]
pub struct Neighbor {
    /// The window of its pixels.
    pub window: Window,
    /// The store through which the part computed first hands over the overlap.
    pub store: Arc<dyn Store>,
    /// True if it is not computed yet, so that the overlap is handed over to it. Otherwise it has handed over the
    /// overlap; pixels that are missing in the store are computed again.
    pub is_pending: bool,
}

/// The limit of the pixels that are computed for a part of a picture, and the overlap with its neighbours.
pub(super) struct Limit {
    /// The demand of the part, without pixels that are read only to compute pixels handed over by neighbours.
    pub(super) demand: Demand,
    /// The demand with these pixels, if neighbours have handed over some: they are computed if they are missing.
    exact: Option<Demand>,
    /// Each neighbour, and the overlap that is handed over to it or was handed over by it.
    neighbors: Vec<(Neighbor, HashMap<At, Region>)>,
}

impl Limit {
    /// The limit for pictures in `window`, whose fields must be prepared. `keeps` is true for fields that are kept as
    /// tiles.
    pub(super) fn new(
        fields: &Fields<'_>,
        window: Window,
        neighbors: Vec<Neighbor>,
        keeps: impl Fn(&Field, &Grid) -> bool,
    ) -> Self {
        let whole = Demand::exact(fields, window);
        let mut found: HashMap<At, Vec<Window>> = HashMap::new();
        let mut overlap_with = |neighbor: Neighbor| {
            let shared = whole.intersect(&Demand::exact(fields, neighbor.window), fields);
            // Both parts choose the same fields, because both consider the part that reads the overlap.
            let reader = if neighbor.is_pending { neighbor.window } else { window };
            let overlap = handed_over(fields, reader, shared, &keeps);
            for (place, region) in overlap.iter().filter(|_| !neighbor.is_pending) {
                found.entry(*place).or_default().extend(region.windows());
            }
            (neighbor, overlap)
        };
        let neighbors = neighbors.into_iter().map(&mut overlap_with).collect();
        let computed = |field: &Field, grid: &Grid, region: &mut Region| {
            found.get(&at(field, grid)).into_iter().flatten().fold(region.windows(), |left, gone| minus(&left, gone))
        };
        let (demand, exact) = match found.is_empty() {
            true => (whole, None),
            false => (Demand::of(fields, window, computed), Some(whole)),
        };
        Self { demand, exact, neighbors }
    }

    /// The pixels of a block that are computed as one tile. `None`, for the whole block, if `wanted` exceeds the
    /// demand.
    pub(super) fn window(&self, field: &Field, grid: &Grid, block: (Piece, Piece), wanted: Window) -> Option<Window> {
        let part = |demand: &Demand| demand.region(field, grid)?.within(block).filter(|part| part.contains(&wanted));
        part(&self.demand).or_else(|| part(self.exact.as_ref()?))
    }

    /// The overlap of a block with each neighbour: with those still to be computed if `is_pending`, else with the computed
    /// ones. Both parts derive the same keys.
    fn overlaps(
        &self,
        field: &Field,
        grid: &Grid,
        block: (Piece, Piece),
        is_pending: bool,
    ) -> impl Iterator<Item = (TileKey, &dyn Store)> {
        let (place, grid, key) = (at(field, grid), grid.id(), field.key());
        let neighbors = self.neighbors.iter().filter(move |(neighbor, _)| neighbor.is_pending == is_pending);
        neighbors.filter_map(move |(neighbor, shared)| {
            let window = shared.get(&place)?.within(block)?;
            Some((TileKey { field: key?, grid, window }, &*neighbor.store))
        })
    }

    /// The pixels of `window` in a block that neighbours have handed over, the missing windows, and the warnings about the
    /// pixels; `None` if there are no such pixels.
    pub(super) fn take(
        &self,
        field: &Field,
        grid: &Grid,
        block: (Piece, Piece),
        window: Window,
    ) -> Option<(Tile, Vec<Window>, Warnings)> {
        let (mut out, mut missing, mut found) = (None, vec![window], Gathered::default());
        for (at, store) in self.overlaps(field, grid, block, false) {
            let rest = minus(&missing, &at.window);
            let part = if rest == missing { None } else { at.load(store, grid, field.channels()) };
            if let Some((part, warnings)) = part {
                found.add(&warnings);
                out.get_or_insert_with(|| Tile::unset(*grid, window, field.channels())).copy_from(&part, 0, 0);
                missing = rest;
            }
        }
        out.map(|out| (out, missing, found.warnings()))
    }

    /// Hands over the overlap in a new tile of a block to neighbours. A tile with warnings about single places is not
    /// handed over: the places may lie beyond the overlap, and the neighbour finds those within by itself.
    pub(super) fn hand_over(&self, field: &Field, block: (Piece, Piece), Warned { tile, warnings }: &Warned) {
        if are_placed(warnings) {
            return;
        }
        for (at, store) in self.overlaps(field, &tile.grid, block, true) {
            if tile.window.contains(&at.window) {
                let mut part = Tile::unset(tile.grid, at.window, tile.channels());
                part.copy_from(tile, 0, 0);
                at.save(store, (&part, warnings), Duration::ZERO, &|| false);
            }
        }
    }
}

/// The overlap of the fields that are handed over to a part with the pictures in `window`; `shared` is the overlap of
/// all fields.
fn handed_over(
    fields: &Fields<'_>,
    window: Window,
    mut shared: HashMap<At, Region>,
    keeps: impl Fn(&Field, &Grid) -> bool,
) -> HashMap<At, Region> {
    let mut chosen = HashMap::new();
    Demand::of(fields, window, |field, grid, region| match shared.remove(&at(field, grid)) {
        Some(overlap) if keeps(field, grid) && READ * region.intersect(&overlap).pixels() > overlap.pixels() => {
            let rest = region.minus(&overlap);
            chosen.insert(at(field, grid), overlap);
            rest
        }
        _ => region.windows(),
    });
    chosen
}

#[cfg(test)]
mod tests {
    use super::super::MemoryStore;
    use super::*;
    use crate::value::{Halo, Key, Tiling, Type};
    use glam::{DVec2, UVec2};

    fn grid() -> Grid {
        Grid { origin: DVec2::ZERO, step: DVec2::ONE, period: Some(UVec2::splat(2048)), shown: None }
    }

    fn source() -> Field {
        Field::generate(Type::Gray, Tiling::BOTH, |_, _| Ok(())).keyed(Key::of("test", &[b"a"]))
    }

    fn filter(input: &Field, pixels: usize, name: &str) -> Field {
        let map = Field::map(Type::Gray, [input.clone()], Halo::px(pixels), |_: &mut Tile, [_]: [&Tile; 1]| Ok(()));
        map.keyed(Key::of("test", &[name.as_bytes()]))
    }

    fn rows(y: i32, height: u32) -> Window {
        Window { x: 0, y, width: 2048, height }
    }

    const fn piece(index: i32) -> Piece {
        Piece { index, start: index * 256, length: 256, shift: 0 }
    }

    fn store() -> Arc<MemoryStore> {
        Arc::new(MemoryStore::new(1 << 30))
    }

    /// The limit of the 512 rows from `own` on, with the 512 rows from `other` on as the neighbour.
    fn part(field: &Field, own: i32, other: i32, store: Arc<MemoryStore>, is_pending: bool) -> Limit {
        let neighbor = Neighbor { window: rows(other, 512), store, is_pending };
        Limit::new(&Fields::new(&[field], &grid()), rows(own, 512), vec![neighbor], |_, _| true)
    }

    #[test]
    fn clips_tiles_of_part_to_its_demand() {
        let (source, grid) = (source(), grid());
        let fields = [filter(&source, 7, "b")];
        let limit = Limit::new(&Fields::new(&[&fields[0]], &grid), rows(0, 512), Vec::new(), |_, _| true);
        let wanted = Window { x: 0, y: 512, width: 256, height: 3 };
        let window = |row: i32, wanted: Window| limit.window(&source, &grid, (piece(0), piece(row)), wanted);
        assert_eq!(window(2, wanted), Some(Window { height: 7, ..wanted }));
        assert_eq!(window(1, Window { y: 256, ..wanted }), Some(Piece::window(piece(0), piece(1))));
        // Windows that exceed the demand.
        assert_eq!(window(2, Window { height: 8, ..wanted }), None);
        assert_eq!(window(4, Window { y: 1024, ..wanted }), None);
    }

    #[test]
    fn two_parts_agree_on_their_overlap() {
        let (source, grid) = (source(), grid());
        let blurred = filter(&source, 7, "b");
        let part = |own: i32, other: i32| part(&blurred, own, other, store(), true);
        let (upper, lower, far) = (part(0, 512), part(512, 0), part(0, 1536));
        let overlaps = |limit: &Limit, row: i32| {
            limit.overlaps(&source, &grid, (piece(0), piece(row)), true).map(|(at, _)| at).collect::<Vec<_>>()
        };
        for (row, y) in [(1, 505), (2, 512)] {
            let found = overlaps(&upper, row);
            assert_eq!(found[0].window, Window { x: 0, y, width: 256, height: 7 });
            assert_eq!(overlaps(&lower, row), found);
        }
        // The repeating field overlaps across the edge of the canvas, and not in the middle.
        assert_eq!(overlaps(&far, 7)[0].window.height, 7);
        assert_eq!(overlaps(&far, 2), []);
    }

    #[test]
    fn reads_no_inputs_of_pixels_handed_over() {
        let (source, grid) = (source(), grid());
        let height = filter(&source, 3, "height");
        let lit = filter(&height, 40, "lit");
        let store = store();
        let upper = part(&lit, 0, 512, store.clone(), true);
        assert_eq!(upper.neighbors[0].1.keys().collect::<Vec<_>>(), [&at(&height, &grid)]);
        let blocks = height.domain().blocks(&grid, Window { y: 472, height: 80, ..rows(0, 0) });
        // All tiles but the last.
        for block in (0..blocks.count() - 1).filter_map(|i| blocks.get(i)) {
            let tile = Arc::new(Tile::new(grid, Piece::window(block.0, block.1), 1));
            upper.hand_over(&height, block, &Warned { tile, warnings: Warnings::default() });
        }
        let lower = part(&lit, 512, 0, store, false);
        let wanted = Window { y: 470, height: 42, ..rows(0, 0) };
        let taken = lower.take(&height, &grid, (piece(0), piece(1)), wanted);
        assert_eq!(taken.map(|(_, missing, _)| missing).unwrap()[0], Window { y: 470, height: 2, ..wanted });
        let last = blocks.get(blocks.count() - 1).unwrap();
        assert!(lower.take(&height, &grid, last, Piece::window(last.0, last.1)).is_none());
        let windows = |field: &Field| {
            let windows = lower.demand.region(field, &grid).unwrap().windows();
            windows.iter().map(|window| (window.y, window.bottom())).collect::<Vec<_>>()
        };
        assert_eq!((windows(&height), windows(&source)), (vec![(472, 1064)], vec![(549, 1067)]));
    }
}
