//! Reading fields: by tiles, through the caches. A tile is made on one thread, whose own clock says what it took.
use super::memory::{TILE, TileKey};
use super::run::{Run, address};
use super::stats::Work;
use super::{DiskCache, MemoryCache};
use crate::value::{Cost, Field, Grid, Key, Reader, Stop, Tile, Window};
use cpu_time::ThreadTime;
use quick_cache::sync::GuardResult;
use std::cell::Cell;
use std::collections::HashSet;
use std::sync::Arc;
use std::time::Duration;

/// The time that reading a tile back from disk takes at the most: what is made faster is not worth keeping.
const DISK_READ: Duration = Duration::from_micros(150);
/// A node that takes less in all is not worth keeping either.
const DISK_NODE: Duration = Duration::from_millis(1);

/// What the code of a field sees while it fills a tile.
struct FillReader<'r, 'g> {
    run: &'r Run<'g>,
    owner: Key,
    prepared: Option<Arc<Tile>>,
    nested: Cell<Duration>,
}

impl Reader for FillReader<'_, '_> {
    fn read(&self, field: &Field, grid: &Grid, window: Window) -> Result<Arc<Tile>, Stop> {
        let start = ThreadTime::now();
        let (tile, own) = self.run.read(field, grid, window, self.owner)?;
        // A part without a key of its own counts as its owner's work.
        self.nested.set(self.nested.get() + start.elapsed().saturating_sub(own));
        Ok(tile)
    }

    fn prepared(&self) -> Option<&Arc<Tile>> {
        self.prepared.as_ref()
    }

    fn check(&self) -> Result<(), Stop> {
        self.run.cancel.check()
    }
}

impl Run<'_> {
    /// The values of `field` in `window`, and the time to be counted as `owner`'s.
    pub(super) fn read(
        &self,
        field: &Field,
        grid: &Grid,
        window: Window,
        owner: Key,
    ) -> Result<(Arc<Tile>, Duration), Stop> {
        let Some(key) = field.key() else {
            let (tile, own) = self.fill(field, grid, window, owner)?;
            return Ok((Arc::new(tile), own));
        };
        let owner = field.owner().unwrap_or(key);
        let kept = field.source().cost() == Cost::Local || self.shared.contains(&key);
        if field.as_constant().is_some() || (!kept && covering(window).len() == 1) {
            let (tile, own) = self.fill(field, grid, window, owner)?;
            if field.as_constant().is_none() {
                self.ledger.add(owner, Work { time: own, computed: 1, ..Work::default() });
            }
            return Ok((Arc::new(tile), Duration::ZERO));
        }
        self.assemble(field, key, grid, window).map(|tile| (tile, Duration::ZERO))
    }

    /// How many values of a pixel are kept in tiles while `fields` are computed.
    pub fn kept(&self, fields: &[&Field], grid: &Grid) -> usize {
        let mut stack: Vec<(&Field, Grid)> = fields.iter().map(|field| (*field, *grid)).collect();
        let mut seen = HashSet::new();
        let mut kept = 0;
        while let Some((field, grid)) = stack.pop() {
            if field.as_constant().is_some() || !seen.insert((address(field), grid.id())) {
                continue;
            }
            let local = field.source().cost() == Cost::Local;
            if field.key().is_some_and(|key| local || self.shared.contains(&key)) {
                kept += field.channels();
            }
            stack.extend(field.source().reads(&grid));
        }
        kept
    }

    /// The bytes that may be kept in tiles.
    pub fn tile_bytes(&self) -> u64 {
        self.caches.memory.tiles.capacity()
    }

    /// Puts `window` together from whole tiles.
    fn assemble(&self, field: &Field, key: Key, grid: &Grid, window: Window) -> Result<Arc<Tile>, Stop> {
        let (across, down) = extents(field, grid);
        let columns = pieces(window.x, window.right(), across);
        let rows = pieces(window.y, window.bottom(), down);
        if let ([x], [y]) = (&columns[..], &rows[..]) {
            let tile = self.tile(field, key, grid, (x, y))?;
            if tile.window == window {
                return Ok(tile);
            }
        }
        let mut out = Tile::new(*grid, window, field.channels());
        for y in &rows {
            for x in &columns {
                let tile = self.tile(field, key, grid, (x, y))?;
                out.copy_from(&tile, x.shift, y.shift);
            }
        }
        Ok(Arc::new(out))
    }

    /// One whole tile, from the caches or computed.
    fn tile(&self, field: &Field, key: Key, grid: &Grid, (x, y): (&Piece, &Piece)) -> Result<Arc<Tile>, Stop> {
        self.cancel.check()?;
        let owner = field.owner().unwrap_or(key);
        let at = TileKey { field: key, grid: grid.id(), at: (x.index, y.index) };
        let memory: &MemoryCache = &self.caches.memory;
        let guard = match memory.tiles.get_value_or_guard(&at, None) {
            GuardResult::Value(tile) => {
                self.ledger.add(owner, Work { memory: 1, ..Work::default() });
                return Ok(tile);
            }
            GuardResult::Guard(guard) => Some(guard),
            GuardResult::Timeout => None,
        };
        let window = Window { x: x.start, y: y.start, width: x.length, height: y.length };
        let disk = self.caches.disk.as_ref().filter(|disk| self.worth_keeping(field, grid, disk));
        let name = || Key::of("tile", &[key.as_bytes(), format!("{at:?}").as_bytes()]);
        let tile = match disk.and_then(|disk| from_disk(disk, name(), grid, window, field.channels())) {
            Some(tile) => {
                self.ledger.add(owner, Work { disk: 1, ..Work::default() });
                tile
            }
            None => {
                let start = ThreadTime::now();
                let (tile, own) = self.fill(field, grid, window, owner)?;
                self.ledger.add(owner, Work { time: own, computed: 1, ..Work::default() });
                // What several nodes read stands for all that is before it.
                let spared = if self.shared.contains(&key) { start.elapsed() } else { own };
                if let Some(disk) = disk.filter(|_| spared >= DISK_READ.max(DISK_NODE / tiles(grid))) {
                    disk.put(DiskCache::TILES, name(), bytemuck::cast_slice(tile.data()));
                }
                tile
            }
        };
        let tile = Arc::new(tile);
        if let Some(guard) = guard {
            let _ = guard.insert(tile.clone());
        }
        Ok(tile)
    }

    /// Whether all tiles of a field have room on disk beside those of others.
    fn worth_keeping(&self, field: &Field, grid: &Grid, disk: &DiskCache) -> bool {
        grid.period.is_some_and(|p| u64::from(p.x) * u64::from(p.y) * 4 * field.channels() as u64 <= disk.bound() / 32)
    }

    /// Runs the code of a field. Gives the time that it took itself, parts without a key included.
    fn fill(&self, field: &Field, grid: &Grid, window: Window, owner: Key) -> Result<(Tile, Duration), Stop> {
        self.cancel.check()?;
        let start = ThreadTime::now();
        let prepared = self.prepared(field, grid);
        let reader = FillReader { run: self, owner, prepared, nested: Cell::new(Duration::ZERO) };
        let mut tile = Tile::new(*grid, window, field.channels());
        if let Err(stop) = field.source().fill(&reader, &mut tile) {
            if let Stop::Failed(problem) = &stop {
                self.failed(owner, problem);
            }
            return Err(stop);
        }
        Ok((tile, start.elapsed().saturating_sub(reader.nested.get())))
    }
}

fn from_disk(disk: &DiskCache, name: Key, grid: &Grid, window: Window, channels: usize) -> Option<Tile> {
    let bytes = disk.get(DiskCache::TILES, name)?;
    let mut tile = Tile::new(*grid, window, channels);
    if bytes.len() != size_of_val(tile.data()) {
        return None;
    }
    bytemuck::cast_slice_mut::<f32, u8>(tile.data_mut()).copy_from_slice(&bytes);
    Some(tile)
}

/// How many tiles cover the canvas.
fn tiles(grid: &Grid) -> u32 {
    grid.period.map_or(1, |p| p.x.div_ceil(TILE).saturating_mul(p.y.div_ceil(TILE))).max(1)
}

/// The tiles that a window touches, as their windows, if nothing repeats.
pub(super) fn covering(window: Window) -> Vec<Window> {
    let mut windows = Vec::new();
    for y in pieces(window.y, window.bottom(), Extent::Endless) {
        for x in pieces(window.x, window.right(), Extent::Endless) {
            windows.push(Window { x: x.start, y: y.start, width: x.length, height: y.length });
        }
    }
    windows
}

/// A tile's extent in one direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Piece {
    /// The tile's number.
    pub(super) index: i32,
    /// Its first pixel.
    start: i32,
    /// Its number of pixels.
    length: u32,
    /// By how many pixels it is to be shifted to where it is wanted.
    shift: i32,
}

impl Piece {
    /// Its first pixel where it is wanted.
    pub(super) const fn from(&self) -> i32 {
        self.start + self.shift
    }

    /// One past its last pixel there.
    pub(super) const fn to(&self) -> i32 {
        self.from() + self.length.cast_signed()
    }
}

/// How far the canvas reaches in one direction, in pixels.
#[derive(Clone, Copy, Debug)]
pub(super) enum Extent {
    /// It has no edge.
    Endless,
    /// It repeats after so many.
    Repeats(i32),
    /// It has so many; beyond them little is wanted, so tiles are small next to its edges.
    Ends(i32),
}

/// How far the canvas reaches for a field, across and down.
pub(super) fn extents(field: &Field, grid: &Grid) -> (Extent, Extent) {
    let canvas = |repeats: bool, pixels: Option<u32>| match pixels.map(u32::cast_signed) {
        Some(size) if repeats => Extent::Repeats(size),
        Some(size) => Extent::Ends(size),
        None => Extent::Endless,
    };
    let tiling = field.tiling();
    (canvas(tiling.x, grid.period.map(|p| p.x)), canvas(tiling.y, grid.period.map(|p| p.y)))
}

/// The tile at `away` pixels beyond an edge: its number from there, its first pixel and one past its last. The first two
/// have 16 pixels, the next ones twice as many each.
fn beyond(away: i32) -> (i32, i32, i32) {
    let tile = TILE.cast_signed();
    if away < 16 {
        (0, 0, 16)
    } else if away < tile {
        let power = away.ilog2();
        (power.cast_signed() - 3, 1 << power, 2 << power)
    } else {
        let number = away / tile;
        (number + tile.ilog2().cast_signed() - 4, number * tile, (number + 1) * tile)
    }
}

/// The tiles that cover the pixels `from..to` in one direction, in order.
pub(super) fn pieces(from: i32, to: i32, extent: Extent) -> Vec<Piece> {
    let tile = TILE.cast_signed();
    let mut list = Vec::new();
    let mut at = from;
    while at < to {
        let wrapped = if let Extent::Repeats(size) = extent { at.rem_euclid(size) } else { at };
        let (index, start, end) = match extent {
            Extent::Ends(_) if at < 0 => {
                let (number, near, far) = beyond(-1 - at);
                (-1 - number, -far, -near)
            }
            Extent::Ends(size) if at >= size => {
                let (number, near, far) = beyond(at - size);
                ((size - 1).div_euclid(tile) + 1 + number, size + near, size + far)
            }
            _ => {
                let index = wrapped.div_euclid(tile);
                let end = (index + 1) * tile;
                let last = if let Extent::Repeats(size) | Extent::Ends(size) = extent { size } else { end };
                (index, index * tile, end.min(last))
            }
        };
        let shift = at - wrapped;
        list.push(Piece { index, start, length: end.abs_diff(start), shift });
        at = end + shift;
    }
    list
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_cover_everything_once() {
        let extents = [100, 256, 300, 700].into_iter().flat_map(|size| [Extent::Repeats(size), Extent::Ends(size)]);
        for extent in extents.chain([Extent::Endless]) {
            for (from, to) in [(0, 256), (-30, 310), (-700, 900), (5, 6), (-1, 701)] {
                let list = pieces(from, to, extent);
                let mut at = from;
                let mut seen = std::collections::BTreeMap::new();
                for piece in list {
                    assert!(piece.start + piece.shift <= at, "{extent:?} {from}..{to}");
                    at = piece.start + piece.length.cast_signed() + piece.shift;
                    let end = piece.start + piece.length.cast_signed();
                    match extent {
                        Extent::Repeats(size) => assert!(piece.start >= 0 && end <= size),
                        // No tile is part of the canvas and of what is beyond.
                        Extent::Ends(size) => {
                            assert!(end <= 0 || (piece.start >= 0 && end <= size) || piece.start >= size)
                        }
                        Extent::Endless => {}
                    }
                    let same = *seen.entry(piece.index).or_insert((piece.start, end));
                    assert_eq!(same, (piece.start, end), "a number for each tile: {extent:?} {from}..{to}");
                }
                assert!(at >= to);
            }
        }
    }

    #[test]
    fn little_is_computed_beyond_an_edge() {
        let list = pieces(-1, 513, Extent::Ends(512));
        let parts: Vec<_> = list.iter().map(|p| (p.index, p.start, p.length)).collect();
        assert_eq!(parts, [(-1, -16, 16), (0, 0, 256), (1, 256, 256), (2, 512, 16)]);
        let lengths: Vec<_> = pieces(0, 600, Extent::Ends(1)).iter().map(|p| p.length).collect();
        assert_eq!(lengths, [1, 16, 16, 32, 64, 128, 256, 256]);
    }
}
