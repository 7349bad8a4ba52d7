//! What is computed while only a part of a picture is: the pixels that it reads, and none that a neighbour has left.
//!
//! Tiles are computed whole as a rule, since the next tiles read them too. At the edges of a part nothing else does: a filter
//! that reads four rows of the tile above would make 256 of them, and each filter before it another 256. So of a part only those
//! pixels are computed that are in its [`Demand`].
//!
//! The pixels that two parts both read, their overlap, can be left for the other part or computed twice. To leave all of them writes
//! several times as much as is needed: once a height is there, nobody reads what it is made of. So fields are looked at from the
//! pictures upwards. One is left if that costs less than computing again what is still read of it, and nothing more is read for it.
use super::demand::{At, Demand, Fields, at};
use super::memory::TileKey;
use super::overlap::OverlapStore;
use super::recompute::RecomputeCost;
use super::region::{Region, minus};
use super::{Shelf, Store};
use crate::value::{Field, Grid, Piece, Tile, Window};
use std::cell::LazyCell;
use std::collections::{HashMap, HashSet};
use std::sync::Arc;
use std::time::Duration;

/// Another part of the picture.
#[derive(Clone)]
pub struct Neighbor {
    /// Its pixels.
    pub window: Window,
    /// Where one of both leaves what the other needs.
    pub store: Arc<OverlapStore>,
    /// Whether it is still to be made, so that something is to be left for it.
    pub waits: bool,
}

/// The pixels that are computed for a part of a picture.
pub(super) struct Limit {
    /// Without what is read only for pixels that neighbours have left.
    pub(super) demand: Demand,
    /// Each neighbour, and what is left for it, or was perhaps left by it.
    neighbors: Vec<(Neighbor, HashMap<At, Region>)>,
}

impl Limit {
    /// The limit for pictures in `window`. All whole pictures that they need must be prepared; `keeps` says of which fields tiles are
    /// kept.
    pub(super) fn new(
        fields: &Fields<'_>,
        window: Window,
        neighbors: Vec<Neighbor>,
        keeps: impl Fn(&Field, &Grid) -> bool,
    ) -> Self {
        let whole = Demand::exact(fields, window);
        let costs = LazyCell::new(|| RecomputeCost::of(fields));
        let mut found: HashMap<At, Vec<Window>> = HashMap::new();
        let mut shared_with = |neighbor: Neighbor| {
            let mut shared = whole.intersect(&Demand::exact(fields, neighbor.window), fields);
            if neighbor.waits {
                let left = left(fields, neighbor.window, &shared, &costs, &keeps);
                shared.retain(|place, _| left.contains(place));
            } else {
                for (field, grid) in &fields.order {
                    let region = shared.get(&at(field, grid));
                    if let Some(region) = region.filter(|region| is_left(&neighbor.store, field, grid, region)) {
                        found.entry(at(field, grid)).or_default().extend(region.windows());
                    }
                }
            }
            (neighbor, shared)
        };
        let neighbors = neighbors.into_iter().map(&mut shared_with).collect();
        let computed = |field: &Field, grid: &Grid, region: &mut Region| {
            found.get(&at(field, grid)).into_iter().flatten().fold(region.windows(), |left, gone| minus(&left, gone))
        };
        let demand = if found.is_empty() { whole } else { Demand::of(fields, window, computed) };
        Self { demand, neighbors }
    }

    /// The pixels of a block of a field that are computed as one tile. All, if more than is known here is `wanted` of it.
    pub(super) fn window(&self, field: &Field, grid: &Grid, block: (Piece, Piece), wanted: Window) -> Option<Window> {
        self.demand.region(field, grid)?.within(block).filter(|part| part.contains(&wanted))
    }

    /// The parts of a block that are left for neighbours, or that neighbours may have left. They have the same keys for both.
    fn overlaps(
        &self,
        field: &Field,
        grid: &Grid,
        block: (Piece, Piece),
        waits: bool,
    ) -> impl Iterator<Item = (TileKey, &OverlapStore)> {
        let (place, grid, key) = (at(field, grid), grid.id(), field.key());
        let neighbors = self.neighbors.iter().filter(move |(neighbor, _)| neighbor.waits == waits);
        neighbors.filter_map(move |(neighbor, shared)| {
            let window = shared.get(&place)?.within(block)?;
            Some((TileKey { field: key?, grid, window }, &*neighbor.store))
        })
    }

    /// What neighbours have left of `window` of a block, and the windows that are missing; `None` if they have left nothing.
    pub(super) fn take(
        &self,
        field: &Field,
        grid: &Grid,
        block: (Piece, Piece),
        window: Window,
    ) -> Option<(Tile, Vec<Window>)> {
        let (mut out, mut missing) = (None, vec![window]);
        for (at, store) in self.overlaps(field, grid, block, false) {
            let rest = minus(&missing, &at.window);
            let part = if rest == missing { None } else { at.load(store, grid, field.channels()) };
            if let Some(part) = part {
                out.get_or_insert_with(|| Tile::unset(*grid, window, field.channels())).copy_from(&part, 0, 0);
                missing = rest;
            }
        }
        out.map(|out| (out, missing))
    }

    /// Leaves for neighbours what they read of a new tile of a block.
    pub(super) fn leave(&self, field: &Field, block: (Piece, Piece), tile: &Tile) {
        for (at, store) in self.overlaps(field, &tile.grid, block, true) {
            if tile.window.contains(&at.window) {
                let mut part = Tile::unset(tile.grid, at.window, tile.channels());
                part.copy_from(tile, 0, 0);
                store.put(Shelf::Tiles, at.name(), bytemuck::cast_slice(part.data()), Duration::ZERO, &|| false);
            }
        }
    }
}

/// The fields that are left for a part whose pictures are those in `window`; `shared` is all that it reads too.
fn left(
    fields: &Fields<'_>,
    window: Window,
    shared: &HashMap<At, Region>,
    costs: &RecomputeCost,
    keeps: impl Fn(&Field, &Grid) -> bool,
) -> HashSet<At> {
    let mut left = HashSet::new();
    Demand::of(fields, window, |field, grid, region| {
        let place = at(field, grid);
        let is_left = |shared: &&Region| {
            let read = region.intersect(shared).pixels();
            keeps(field, grid) && costs.exceeds_handing(field, grid, shared.pixels(), read)
        };
        match shared.get(&place).filter(is_left) {
            Some(shared) => {
                left.insert(place);
                region.minus(shared)
            }
            None => region.windows(),
        }
    });
    left
}

/// Whether all of a region was left in a store.
fn is_left(store: &OverlapStore, field: &Field, grid: &Grid, region: &Region) -> bool {
    let Some(key) = field.key() else { return false };
    let has = |block| {
        let tile = region.within(block).map(|window| TileKey { field: key, grid: grid.id(), window });
        tile.is_none_or(|tile| store.has(tile.name()))
    };
    region.windows().iter().all(|window| field.domain().blocks(grid, *window).iter().all(has))
}

#[cfg(test)]
mod tests {
    use super::super::Seal;
    use super::*;
    use crate::value::{Halo, Key, Tiling, Type};
    use glam::{DVec2, UVec2};
    use std::path::Path;

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

    fn create(name: &Path) -> OverlapStore {
        OverlapStore::create(name, Seal::new(Key::of("build", &[])), u64::MAX).unwrap()
    }

    /// The limit of 512 rows from `own` on, beside those from `other` on.
    fn part(field: &Field, own: i32, other: i32, store: OverlapStore, waits: bool) -> Limit {
        let neighbor = Neighbor { window: rows(other, 512), store: Arc::new(store), waits };
        Limit::new(&Fields::new(&[field], &grid()), rows(own, 512), vec![neighbor], |_, _| true)
    }

    #[test]
    fn tiles_of_a_part_end_with_its_demand() {
        let (source, grid) = (source(), grid());
        let fields = [filter(&source, 7, "b")];
        let limit = Limit::new(&Fields::new(&[&fields[0]], &grid), rows(0, 512), Vec::new(), |_, _| true);
        let wanted = Window { x: 0, y: 512, width: 256, height: 3 };
        let window = |row: i32, wanted: Window| limit.window(&source, &grid, (piece(0), piece(row)), wanted);
        assert_eq!(window(2, wanted), Some(Window { height: 7, ..wanted }));
        assert_eq!(window(1, Window { y: 256, ..wanted }), Some(Piece::window(piece(0), piece(1))));
        // More than is in the demand.
        assert_eq!(window(2, Window { height: 8, ..wanted }), None);
        assert_eq!(window(4, Window { y: 1024, ..wanted }), None);
    }

    #[test]
    fn two_parts_agree_on_their_overlap() {
        let (source, grid, dir) = (source(), grid(), tempfile::tempdir().unwrap());
        let blurred = filter(&source, 7, "b");
        let part = |own: i32, other: i32| part(&blurred, own, other, create(&dir.path().join("store")), true);
        let (upper, lower, far) = (part(0, 512), part(512, 0), part(0, 1536));
        let overlaps = |limit: &Limit, row: i32| {
            limit.overlaps(&source, &grid, (piece(0), piece(row)), true).map(|(at, _)| at).collect::<Vec<_>>()
        };
        for (row, y) in [(1, 505), (2, 512)] {
            let found = overlaps(&upper, row);
            assert_eq!(found[0].window, Window { x: 0, y, width: 256, height: 7 });
            assert_eq!(overlaps(&lower, row), found);
        }
        // Across the edge of what repeats, and nothing in the middle.
        assert_eq!(overlaps(&far, 7)[0].window.height, 7);
        assert_eq!(overlaps(&far, 2), []);
    }

    #[test]
    fn reads_nothing_for_pixels_that_are_left() {
        let (source, grid, dir) = (source(), grid(), tempfile::tempdir().unwrap());
        let height = filter(&source, 3, "height");
        let lit = filter(&height, 40, "lit");
        let name = dir.path().join("store");
        // All of the height is left, but for one tile.
        let leave = |all: bool| {
            let upper = part(&lit, 0, 512, create(&name), true);
            assert_eq!(upper.neighbors[0].1.keys().collect::<Vec<_>>(), [&at(&height, &grid)]);
            let blocks = height.domain().blocks(&grid, Window { y: 472, height: 80, ..rows(0, 0) });
            for block in (0..blocks.count() - usize::from(!all)).filter_map(|i| blocks.get(i)) {
                upper.leave(&height, block, &Tile::new(grid, Piece::window(block.0, block.1), 1));
            }
            upper.neighbors[0].0.store.publish().unwrap();
            let store = OverlapStore::open(&name, Seal::new(Key::of("build", &[]))).unwrap();
            let lower = part(&lit, 512, 0, store, false);
            let taken = lower.take(&height, &grid, (piece(0), piece(1)), Window { y: 470, height: 42, ..rows(0, 0) });
            assert_eq!(taken.map(|(_, missing)| missing).unwrap()[0], Window { y: 470, height: 2, ..rows(0, 0) });
            let windows = |field: &Field| {
                let windows = lower.demand.region(field, &grid).unwrap().windows();
                windows.iter().map(|window| (window.y, window.bottom())).collect::<Vec<_>>()
            };
            (windows(&height), windows(&source))
        };
        assert_eq!(leave(false), (vec![(472, 1064)], vec![(469, 1067)]));
        assert_eq!(leave(true), (vec![(472, 1064)], vec![(549, 1067)]));
    }
}
