//! The demand of pictures: the pixels of each field that must be read to compute them.
//!
//! For a window of its own, every field states the windows that it reads of its inputs ([`FieldSource::inputs`]). One
//! walk over the fields, readers before inputs, adds up these windows. Differences and intersections of demands tell
//! which tiles may be freed, which pixels two parts of a picture both read, and how much memory is needed.
//!
//! [`FieldSource::inputs`]: crate::value::FieldSource::inputs
use super::memory::TileKey;
use super::region::Region;
use crate::value::{Field, FieldId, Grid, GridId, Piece, Read, Window};
use std::collections::{HashMap, HashSet};
use std::convert::Infallible;

/// A window with a longer side, in pixels, counts as the whole field.
const FARTHEST: u32 = 1 << 18;

/// A field on a grid.
pub(super) type At = (FieldId, GridId);

/// The identity of a field on a grid.
pub(super) fn at(field: &Field, grid: &Grid) -> At {
    (field.id(), grid.id())
}

/// The inputs that a field reads to fill tiles on `grid`, with the windows for one pixel.
pub(super) fn reads<'f>(field: &'f Field, grid: &Grid) -> impl Iterator<Item = Read<'f>> + use<'f> {
    reads_for(field, grid, Window { x: 0, y: 0, width: 1, height: 1 })
}

fn reads_for<'f>(field: &'f Field, grid: &Grid, window: Window) -> impl Iterator<Item = Read<'f>> + use<'f> {
    let source = field.source();
    source.inputs(grid, window).into_iter().chain(source.later(grid, window))
}

/// Visits fields on grids, each once and after all its `inputs`. Uses an explicit stack, because chains of fields may
/// be long.
pub(super) fn inputs_first<'f, E>(
    fields: &[&'f Field],
    grid: &Grid,
    mut inputs: impl FnMut(&'f Field, &Grid) -> Result<Vec<Read<'f>>, E>,
    mut visit: impl FnMut(&'f Field, Grid) -> Result<(), E>,
) -> Result<(), E> {
    let mut begun = HashSet::new();
    let mut open: Vec<_> = fields.iter().map(|field| (*field, *grid, false)).collect();
    while let Some((field, grid, inputs_are_done)) = open.pop() {
        if inputs_are_done {
            visit(field, grid)?;
        } else if begun.insert(at(field, &grid)) {
            open.push((field, grid, true));
            open.extend(inputs(field, &grid)?.into_iter().map(|read| (read.field, read.grid, false)));
        }
    }
    Ok(())
}

/// All fields below some pictures, sorted so that each field comes before its inputs.
pub struct Fields<'f> {
    pub(super) order: Vec<(&'f Field, Grid)>,
    pub(super) pictures: Vec<&'f Field>,
    pub(super) grid: Grid,
}

impl<'f> Fields<'f> {
    /// The fields below pictures of `fields` on `grid`.
    pub fn new(fields: &[&'f Field], grid: &Grid) -> Self {
        let mut order = Vec::new();
        let inputs = |field, grid: &Grid| Ok(reads(field, grid).collect());
        let Ok(()) = inputs_first(fields, grid, inputs, |field, grid| {
            order.push((field, grid));
            Ok::<_, Infallible>(())
        });
        order.reverse();
        Self { order, pictures: fields.to_vec(), grid: *grid }
    }
}

/// The pixels of each field that are read to compute pictures in a window.
pub struct Demand {
    window: Window,
    /// `None` stands for all pixels of a field. A field without an entry is not read.
    regions: HashMap<At, Option<Region>>,
}

impl Demand {
    /// The demand of pictures in `window`. `computed` gets the region of a field that is read, and returns the windows
    /// that are computed for it. It may change the region to the pixels that are kept as tiles.
    pub(super) fn of(
        fields: &Fields<'_>,
        window: Window,
        mut computed: impl FnMut(&Field, &Grid, &mut Region) -> Vec<Window>,
    ) -> Self {
        let mut demand = Self { window, regions: HashMap::new() };
        fields.pictures.iter().for_each(|picture| demand.add(&Read::new(picture, &fields.grid, window)));
        for &(field, grid) in &fields.order {
            match demand.regions.get_mut(&at(field, &grid)) {
                None => {}
                Some(None) => {
                    reads(field, &grid).for_each(|read| drop(demand.regions.insert(at(read.field, &read.grid), None)))
                }
                Some(Some(region)) => {
                    for window in computed(field, &grid, region) {
                        reads_for(field, &grid, window).for_each(|read| demand.add(&read));
                    }
                }
            }
        }
        demand
    }

    /// The demand of pictures in `window` if only pixels that are read are computed.
    pub(super) fn exact(fields: &Fields<'_>, window: Window) -> Self {
        Self::of(fields, window, |_, _, region| region.windows())
    }

    /// The demand of pictures in `window` if whole tiles are computed. A field with a region in `limit` stays within
    /// it.
    pub(super) fn in_tiles(fields: &Fields<'_>, window: Window, limit: Option<&Self>) -> Self {
        Self::of(fields, window, |field, grid, region| {
            *region = region.rounded(field.domain(), grid);
            if let Some(limit) = limit.and_then(|limit| limit.region(field, grid)) {
                *region = region.intersect(limit);
            }
            region.windows()
        })
    }

    fn add(&mut self, &Read { field, grid, window }: &Read<'_>) {
        let window = field.domain().one_repeat(&grid, window);
        let region = self.regions.entry(at(field, &grid)).or_insert_with(|| Some(Region::default()));
        match region {
            _ if window.width > FARTHEST || window.height > FARTHEST => *region = None,
            Some(region) if !window.is_empty() => region.add(&field.domain().blocks(&grid, window), window),
            _ => {}
        }
    }

    /// The pixels of a field that are read; `None` if it is not read, or all pixels are.
    pub(super) fn region(&self, field: &Field, grid: &Grid) -> Option<&Region> {
        self.regions.get(&at(field, grid))?.as_ref()
    }

    /// The pixels of each field that are in both demands.
    pub(super) fn intersect(&self, other: &Self, fields: &Fields<'_>) -> HashMap<At, Region> {
        let both = |(field, grid): &(&Field, Grid)| {
            let both = self.region(field, grid)?.intersect(other.region(field, grid)?);
            (both.pixels() > 0).then(|| (at(field, grid), both))
        };
        fields.order.iter().filter_map(both).collect()
    }

    /// The bytes of the pixels in both demands, of all fields that `keeps` tiles.
    pub(super) fn shared_bytes(&self, other: &Self, fields: &Fields<'_>, keeps: impl Fn(&Field, &Grid) -> bool) -> u64 {
        let bytes = |(field, grid): &(&Field, Grid)| {
            let place = at(field, grid);
            let pixels = match (self.regions.get(&place)?, other.regions.get(&place)?) {
                (Some(own), Some(other)) => own.intersect(other).pixels(),
                // At least one demand reads all pixels, so assume the windows of both pictures.
                _ => self.window.union(&other.window).len() as u64,
            };
            keeps(field, grid).then(|| pixels * 4 * field.channels() as u64)
        };
        fields.order.iter().filter_map(bytes).sum()
    }

    /// The tiles, whole or in part, that this demand reads and `rest` does not.
    pub(super) fn minus(&self, rest: &Self, fields: &Fields<'_>) -> Vec<TileKey> {
        let nothing = Region::default();
        let mut tiles = Vec::new();
        for &(field, grid) in &fields.order {
            let (Some(key), Some(own)) = (field.key(), self.region(field, &grid)) else { continue };
            let rest = match rest.regions.get(&at(field, &grid)) {
                None => &nothing,
                Some(Some(rest)) => rest,
                Some(None) => continue,
            };
            for window in own.minus(rest) {
                let blocks = field.domain().blocks(&grid, window);
                for block in blocks.iter().filter(|block| rest.within(*block).is_none()) {
                    let whole = Piece::window(block.0, block.1);
                    let part = own.within(block).filter(|part| *part != whole);
                    let tile = |window| TileKey { field: key, grid: grid.id(), window };
                    tiles.extend(part.into_iter().chain([whole]).map(tile));
                }
            }
        }
        tiles
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::value::{Halo, Key, TILE, Tiling, Type};
    use glam::{DVec2, UVec2};

    fn keyed(field: Field, name: &str) -> Field {
        field.keyed(Key::of("test", &[name.as_bytes()]))
    }

    fn filter(input: Field, pixels: usize, name: &str) -> Field {
        keyed(Field::map(Type::Gray, [input], Halo::px(pixels), |_, _| Ok(())), name)
    }

    fn source(tiling: Tiling) -> Field {
        keyed(Field::generate(Type::Gray, tiling, |_, _| Ok(())), "a")
    }

    fn grid(pixels: u32) -> Grid {
        Grid { origin: DVec2::ZERO, step: DVec2::ONE, period: Some(UVec2::splat(pixels)), shown: None }
    }

    /// A blur of radius 100 pixels over a source, for 16 × 16 tiles.
    fn blurred(tiling: Tiling) -> Field {
        filter(source(tiling), 100, "b")
    }

    #[test]
    fn sums_bytes_of_tiles_read_again() {
        let grid = grid(4096);
        let bytes = |field: &Field, before: Window, after: Window| {
            let fields = Fields::new(&[field], &grid);
            let demand = |window| Demand::in_tiles(&fields, window, None);
            demand(before).shared_bytes(&demand(after), &fields, |_, _| true)
        };
        let band = |window: Window, band: Window| {
            let before = Window { height: band.bottom().abs_diff(window.y), ..window };
            (before, Window { y: band.y, height: window.bottom().abs_diff(band.y), ..window })
        };
        let whole = Window::full(UVec2::splat(4096));
        let middle = Window { y: 2048, height: TILE, ..whole };
        let once = blurred(Tiling::NONE);
        let rows = |columns: u64, rows: u64| columns * rows * u64::from(TILE) * 4;
        let (before, after) = band(whole, middle);
        // The source adds one row of tiles above and one below. Beyond its ends it adds the 16-pixel strips that are
        // read.
        assert_eq!(bytes(&once, before, after), rows(4096, 1) + rows(4096 + 2 * 112, 3));
        // A repeating field is read at the bottom for the first row, and at the top for the last row.
        assert_eq!(bytes(&blurred(Tiling::BOTH), before, after), rows(4096, 1) + rows(4096, 5));
        let strip = Window { x: 1024, width: 1024, ..whole };
        let (before, after) = band(strip, Window { x: 1024, width: 1024, ..middle });
        assert_eq!(bytes(&once, before, after), rows(1024, 1) + rows(1536, 3));
        // From left to right: a column, and the columns on its left and right that the blur reaches.
        let low = Window { y: 1024, height: TILE, ..whole };
        let (before, after) = (Window { width: 2304, ..low }, Window { x: 2048, width: 2048, ..low });
        assert_eq!(bytes(&once, before, after), rows(u64::from(TILE), 1) + rows(3 * u64::from(TILE), 3));
        // The halo of a part ends with the demand, not with whole tiles.
        let fields = Fields::new(&[&once], &grid);
        let limit = Demand::exact(&fields, low);
        let [before, after] = [before, after].map(|window| Demand::in_tiles(&fields, window, Some(&limit)));
        let part = before.shared_bytes(&after, &fields, |_, _| true);
        assert_eq!(part, u64::from(TILE) * (u64::from(TILE) + 3 * (256 + 2 * 100)) * 4);
    }

    #[test]
    fn counts_each_repeat_once() {
        let grid = grid(16);
        // 200 filters with a halo of four pixels each: together they read across 100 repeats of the canvas.
        let last = (0..200).fold(source(Tiling::BOTH), |input, i| filter(input, 4, &i.to_string()));
        let fields = Fields::new(&[&last], &grid);
        let demand = Demand::in_tiles(&fields, Window::full(UVec2::splat(16)), None);
        assert_eq!(demand.regions.len(), 201);
        assert!(demand.regions.values().all(|region| region.as_ref().is_some_and(|region| region.pixels() == 256)));
    }

    #[test]
    fn frees_each_tile_once_by_rows_and_by_columns() {
        let grid = grid(4096);
        let field = blurred(Tiling::BOTH);
        let fields = Fields::new(&[&field], &grid);
        let part = Window { x: 0, y: 1024, width: 4096, height: 512 };
        let demand = |window| Demand::in_tiles(&fields, window, None);
        let nothing = Demand { window: part, regions: HashMap::new() };
        let count = |rests: &[Window]| {
            let (mut seen, mut before) = (HashSet::new(), demand(part));
            for rest in rests.iter().map(|rest| demand(*rest)) {
                before.minus(&rest, &fields).into_iter().for_each(|tile| assert!(seen.insert(tile), "{tile:?}"));
                before = rest;
            }
            seen.len()
        };
        let columns: Vec<Window> =
            (1..16).map(|x| Window { x: x * 256, width: 4096 - x.cast_unsigned() * 256, ..part }).collect();
        let tiles = |window| demand(window).minus(&nothing, &fields).len();
        // All tiles are freed but those that the last column reads.
        assert_eq!(count(&columns), tiles(part) - tiles(columns[14]));
        // One row of tiles of the picture is freed, and the row above it of the source.
        assert_eq!(count(&[Window { y: 1280, height: 256, ..part }]), 16 + 16);
    }

    #[test]
    fn includes_halo_of_part_and_wraps() {
        let (source, grid) = (source(Tiling::BOTH), grid(2048));
        let blurred = filter(source.clone(), 7, "b");
        let window = Window { x: 0, y: 0, width: 2048, height: 512 };
        let demand = Demand::exact(&Fields::new(&[&blurred], &grid), window);
        let rows = |y: i32, height: u32| Window { x: 0, y, width: 2048, height };
        assert_eq!(demand.region(&source, &grid).unwrap().windows(), [rows(0, 519), rows(2041, 7)]);
    }
}
