//! Which pixels of each field are read while a part of a picture is computed.
//!
//! Tiles are computed whole as a rule, since the next tiles read them too. At the edges of a part nothing else does: a filter
//! that reads four rows of the tile above would make 256 of them, and each filter before it another 256. So for a part
//! everything is computed that is read, and no more. This follows from what fields state of themselves
//! ([`FieldSource::inputs`]), and a value depends on its position alone, so no pixel changes by it.
//!
//! What other parts have left of a field is not computed, and so nothing is read for it.
//!
//! [`FieldSource::inputs`]: crate::value::FieldSource::inputs
use super::area::Area;
use super::halos::{Halo, Neighbor};
use super::handover::Prices;
use super::memory::TileKey;
use super::passing::{FARTHEST, readers_first};
use super::prepare::{At, at};
use super::run::{Run, lock};
use crate::value::{Field, Grid, GridId, Key, Piece, Window};
use std::cmp::Reverse;
use std::collections::{HashMap, HashSet};
use std::sync::{Mutex, PoisonError};

/// The pixels that are read of each field.
pub(super) struct Reach {
    /// Without what is read only for pixels that others have left.
    areas: Areas,
    /// All that is read if nobody leaves anything.
    whole: Areas,
    /// Under which keys parts of tiles are kept.
    kept: Mutex<HashMap<TileKey, TileKey>>,
    neighbors: Vec<Beside>,
}

type Areas = HashMap<(Key, GridId), Area>;

/// Another part of the picture.
struct Beside {
    neighbor: Neighbor,
    /// What it reads if nobody leaves anything.
    areas: Areas,
    /// Of which fields something is left for it.
    left: HashSet<(Key, GridId)>,
}

/// The fields of pictures in the order in which readers come before what they read.
struct Fields<'f, 'a> {
    order: Vec<(&'f Field, Grid)>,
    pictures: &'a [&'f Field],
    grid: &'a Grid,
}

impl Reach {
    /// Of pictures of `fields` in `window`. All whole pictures that they need must be prepared; `keeps` says of which fields
    /// tiles are kept.
    fn new(
        fields: &[&Field],
        grid: &Grid,
        window: Window,
        neighbors: Vec<Neighbor>,
        keeps: impl Fn(&Field, &Grid) -> bool,
    ) -> Self {
        let fields = Fields { order: readers_first(fields, grid), pictures: fields, grid };
        let whole = fields.areas(window, |_, _, area| area.windows());
        let prices = (!neighbors.is_empty()).then(|| Prices::new(&fields.order, fields.pictures, grid));
        let mut found: HashMap<_, Vec<Area>> = HashMap::new();
        let beside = |neighbor: Neighbor| {
            let areas = fields.areas(neighbor.window, |_, _, area| area.windows());
            let mut left = HashSet::new();
            if neighbor.waits {
                left = fields.left_for(neighbor.window, &whole, &areas, |field, grid, overlap, read| {
                    keeps(field, grid) && prices.as_ref().is_some_and(|p| p.is_left(field, grid, overlap, read))
                });
            } else {
                for (place, area) in fields.left_by(&neighbor, &whole, &areas) {
                    found.entry(place).or_default().push(area);
                }
            }
            Beside { neighbor, areas, left }
        };
        let neighbors = neighbors.into_iter().map(beside).collect();
        let rest =
            |field: &Field, grid: &Grid, area: &Area| match place(field, grid).and_then(|place| found.get(&place)) {
                Some(found) => area.without(found.iter()),
                None => area.windows(),
            };
        let areas = if found.is_empty() { whole.clone() } else { fields.areas(window, rest) };
        Self { areas, whole, kept: Mutex::default(), neighbors }
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

    /// How many columns and rows are read of a field, if it is known.
    pub(super) fn size(&self, field: &Field, grid: &Grid) -> Option<(u64, u64)> {
        Some(self.areas.get(&place(field, grid)?)?.size())
    }

    /// The pixels of a tile that others read too, and have left or are to be left, the largest first. They are the same for both.
    pub(super) fn halos(&self, tile: &TileKey, at: (Piece, Piece)) -> Vec<Halo> {
        let place = (tile.field, tile.grid);
        if self.neighbors.is_empty() {
            return Vec::new();
        }
        let Some(own) = self.whole.get(&place) else { return Vec::new() };
        let halo = |beside: &Beside| {
            let Neighbor { spill, waits, .. } = beside.neighbor.clone();
            if waits && !beside.left.contains(&place) {
                return None;
            }
            let (at, window) = shared(tile, at, own, beside.areas.get(&place)?)?;
            Some(Halo { at, window, spill, waits })
        };
        let mut halos: Vec<Halo> = self.neighbors.iter().filter_map(halo).collect();
        halos.sort_by_key(|halo| Reverse(halo.window.len()));
        halos
    }
}

impl<'f> Fields<'f, '_> {
    /// What the pictures in `window` read of each field, if of its area the windows are `computed` that this gives.
    fn areas(&self, window: Window, mut computed: impl FnMut(&Field, &Grid, &Area) -> Vec<Window>) -> Areas {
        // `None` is everything.
        let mut areas: HashMap<At, Option<Area>> = HashMap::new();
        let want = |areas: &mut HashMap<At, Option<Area>>, field: &Field, grid: &Grid, window: Window| {
            let window = field.domain().one_repeat(grid, window);
            let area = areas.entry(at(field, grid)).or_insert_with(|| Some(Area::default()));
            let near = window.width <= FARTHEST && window.height <= FARTHEST;
            match area.as_mut().filter(|_| near) {
                Some(known) if !window.is_empty() => known.add(&field.domain().blocks(grid, window), window),
                Some(_) => {}
                None => *area = None,
            }
        };
        self.pictures.iter().for_each(|field| want(&mut areas, field, self.grid, window));
        let mut known = HashMap::new();
        for &(field, grid) in &self.order {
            let Some(area) = areas.get(&at(field, &grid)).cloned() else { continue };
            let windows: Vec<Option<Window>> = match &area {
                Some(area) => computed(field, &grid, area).into_iter().map(Some).collect(),
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
            if let (Some(place), Some(area)) = (place(field, &grid), area) {
                known.insert(place, area);
            }
        }
        known
    }

    /// The fields that are left for another part, whose pictures are those in `window`; `is_left` is told how many pixels both read,
    /// and how many of them the other part still does.
    fn left_for(
        &self,
        window: Window,
        own: &Areas,
        other: &Areas,
        is_left: impl Fn(&Field, &Grid, u64, u64) -> bool,
    ) -> HashSet<(Key, GridId)> {
        let mut left = HashSet::new();
        self.areas(window, |field, grid, area| {
            let areas = place(field, grid).and_then(|place| Some((place, own.get(&place)?, other.get(&place)?)));
            let Some((place, own, other)) = areas else { return area.windows() };
            let overlap = own.overlap(other);
            let pixels = overlap.iter().map(|window| window.len() as u64).sum();
            let read = overlap.iter().map(|window| area.pixels_in(*window)).sum();
            if read == 0 || !is_left(field, grid, pixels, read) {
                return area.windows();
            }
            left.insert(place);
            area.without([own].into_iter())
        });
        left
    }

    /// The areas of fields of which another part has left all that both read.
    fn left_by(&self, neighbor: &Neighbor, own: &Areas, other: &Areas) -> Vec<((Key, GridId), Area)> {
        let left = |&(field, grid): &(&Field, Grid)| {
            let key = field.key()?;
            let place = (key, grid.id());
            let (own, other) = (own.get(&place)?, other.get(&place)?);
            let is_left = |window: &Window| {
                let blocks = field.domain().blocks(&grid, *window);
                (0..blocks.count()).all(|i| {
                    blocks.get(i).is_some_and(|(x, y)| {
                        let tile = TileKey { field: key, grid: grid.id(), at: (x.index, y.index) };
                        shared(&tile, (x, y), own, other).is_some_and(|(at, _)| neighbor.spill.has(&at))
                    })
                })
            };
            let both = own.overlap(other);
            (!both.is_empty() && both.iter().all(is_left)).then(|| (place, other.clone()))
        };
        self.order.iter().filter_map(left).collect()
    }
}

/// The pixels of a tile in two areas, and under which key they are left.
fn shared(tile: &TileKey, at: (Piece, Piece), own: &Area, other: &Area) -> Option<(TileKey, Window)> {
    let window = own.within(at)?.overlap(&other.within(at)?)?;
    Some((named(tile, window), window))
}

fn place(field: &Field, grid: &Grid) -> Option<(Key, GridId)> {
    Some((field.key()?, grid.id()))
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
        let reach = Reach::new(fields, grid, window, neighbors, |field, grid| self.keeps(field, grid));
        *self.reach.write().unwrap_or_else(PoisonError::into_inner) = Some(reach);
    }

    /// True if a pixel of `field` follows from no whole picture, and from at most `most` pixels along a side of each field below it.
    pub fn is_near(&self, field: &Field, grid: &Grid, most: u64) -> bool {
        let fields = Fields { order: readers_first(&[field], grid), pictures: &[field], grid };
        let areas = fields.areas(Window { x: 0, y: 0, width: 1, height: 1 }, |_, _, area| area.windows());
        fields.order.iter().all(|(field, grid)| {
            let is_small = |area: &Area| area.size().0.max(area.size().1) <= most;
            // Fields without a key have no area; their inputs have.
            let near = place(field, grid).is_none_or(|place| areas.get(&place).is_some_and(is_small));
            near && field.source().whole(grid).is_empty()
        })
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
    use crate::value::{Halo, Tile, Tiling, Type};
    use glam::{DVec2, UVec2};
    use std::sync::Arc;

    fn grid() -> Grid {
        Grid { origin: DVec2::ZERO, step: DVec2::ONE, period: Some(UVec2::splat(2048)), shown: None }
    }

    fn keyed(field: Field, name: &str) -> Field {
        field.keyed(Key::of("test", &[name.as_bytes()]))
    }

    #[test]
    fn a_part_reads_its_halo_and_wraps() {
        let source = keyed(Field::generate(Type::Gray, Tiling::BOTH, |_, _| Ok(())), "a");
        let fill = |_: &mut Tile, [_]: [&Tile; 1]| Ok(());
        let blurred = keyed(Field::map(Type::Gray, [source.clone()], Halo::px(7), fill), "b");
        let grid = grid();
        let window = Window { x: 0, y: 0, width: 2048, height: 512 };
        let reach = Reach::new(&[&blurred], &grid, window, Vec::new(), |_, _| true);
        let area = &reach.areas[&(source.key().unwrap(), grid.id())];
        let rows = |y: i32, height: u32| Window { x: 0, y, width: 2048, height };
        assert_eq!(area.windows(), [rows(0, 519), rows(2041, 7)]);
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
        let fill = |_: &mut Tile, [_]: [&Tile; 1]| Ok(());
        let blurred = keyed(Field::map(Type::Gray, [source.clone()], Halo::px(7), fill), "b");
        let (grid, dir) = (grid(), tempfile::tempdir().unwrap());
        let rows = |y: i32| Window { x: 0, y, width: 2048, height: 512 };
        let part = |own: i32, other: i32| {
            let spill = Arc::new(Spill::create(&dir.path().join("spill")).unwrap());
            let neighbor = Neighbor { window: rows(other), spill, waits: true };
            Reach::new(&[&blurred], &grid, rows(own), vec![neighbor], |_, _| true)
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

    #[test]
    fn nothing_is_read_for_what_is_left() {
        let source = keyed(Field::generate(Type::Gray, Tiling::BOTH, |_, _| Ok(())), "a");
        let filter = |input: &Field, pixels: usize, name: &str| {
            let fill = |_: &mut Tile, [_]: [&Tile; 1]| Ok(());
            keyed(Field::map(Type::Gray, [input.clone()], Halo::px(pixels), fill), name)
        };
        let height = filter(&source, 3, "height");
        let lit = filter(&height, 40, "lit");
        let (grid, dir) = (grid(), tempfile::tempdir().unwrap());
        let rows = |y: i32| Window { x: 0, y, width: 2048, height: 512 };
        let name = dir.path().join("spill");
        let part = |own: i32, other: i32, spill: Spill, waits: bool| {
            let neighbor = Neighbor { window: rows(other), spill: Arc::new(spill), waits };
            Reach::new(&[&lit], &grid, rows(own), vec![neighbor], |_, _| true)
        };
        let build = Key::of("build", &[]);
        let place = |field: &Field| (field.key().unwrap(), grid.id());
        let upper = part(0, 512, Spill::create_for(&name, build, u64::MAX).unwrap(), true);
        assert_eq!(upper.neighbors[0].left, HashSet::from([place(&height)]));
        // All of the height is left, but for one tile.
        let leave = |all: bool| {
            let spill = Spill::create_for(&name, build, u64::MAX).unwrap();
            let blocks = height.domain().blocks(&grid, Window { y: 472, height: 80, ..rows(0) });
            for (x, y) in (0..blocks.count() - usize::from(!all)).filter_map(|i| blocks.get(i)) {
                let tile = TileKey { field: place(&height).0, grid: grid.id(), at: (x.index, y.index) };
                let [halo] = &upper.halos(&tile, (x, y))[..] else { panic!("one") };
                spill.put(&halo.at, &Tile::new(grid, halo.window, 1));
            }
            spill.publish().unwrap();
            let lower = part(512, 0, Spill::open(&name, build).unwrap(), false);
            let windows = |field: &Field| {
                let windows = lower.areas[&place(field)].windows();
                windows.iter().map(|window| (window.y, window.bottom())).collect::<Vec<_>>()
            };
            (windows(&height), windows(&source))
        };
        assert_eq!(leave(false), (vec![(472, 1064)], vec![(469, 1067)]));
        assert_eq!(leave(true), (vec![(472, 1064)], vec![(549, 1067)]));
    }
}
