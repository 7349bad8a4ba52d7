//! What lies near the edges of a part of a picture, handed from one part to the next.
//!
//! Filters read beyond the edges of a part, so there are pixels on both sides of an edge that two parts need (see
//! [`Reach`](super::reach::Reach)). The one that computes them first leaves them for the other: in the store, where another
//! process finds them, or in a temporary file, for the next strip of the same picture. No pixel changes by it, since a value
//! depends on its position alone; so parts may be made in any order, and several at once.
use super::Shelf;
use super::keep::Keeper;
use super::memory::TileKey;
use super::run::{Run, lock};
use crate::picture::AtomicFile;
use crate::value::{Field, Grid, Piece, Tile, Window};
use cpu_time::ThreadTime;
use std::collections::HashMap;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// What is left for other parts takes at most this part of a store.
const ROOM: u64 = 4;

/// Another part of the picture.
#[derive(Clone)]
pub struct Neighbor {
    /// Its pixels.
    pub window: Window,
    /// Where one of both leaves what the other needs.
    pub place: Place,
    /// Whether it is still to be made, so that something is to be left for it.
    pub waits: bool,
}

impl Neighbor {
    /// Whether it is done and may have left something in the store.
    pub(super) const fn is_done_in_store(&self) -> bool {
        !self.waits && matches!(self.place, Place::Store)
    }
}

/// Where parts leave something for each other.
#[derive(Clone)]
pub enum Place {
    /// In the store.
    Store,
    /// In a file of this process.
    File(Arc<Spill>),
}

/// Pixels of a tile that a neighbour reads too.
pub(super) struct Halo {
    /// Under which key they are kept.
    pub(super) at: TileKey,
    pub(super) window: Window,
    pub(super) place: Place,
    /// Whether the neighbour is still to be made.
    pub(super) waits: bool,
}

/// What a run knows of what it took and left.
#[derive(Default)]
pub(super) struct Halos {
    /// Weighs what is left for others. Not the one of whole tiles: what is kept near an edge spares nothing elsewhere.
    keeper: Keeper,
    /// Bytes that were put into the store.
    left: AtomicU64,
}

/// Parts of tiles in a temporary file, which is removed when it is dropped.
pub struct Spill(Mutex<Spilled>);

struct Spilled {
    file: AtomicFile,
    /// Where each begins.
    places: HashMap<TileKey, u64>,
    end: u64,
}

impl Spill {
    /// An empty one beside the file `name`.
    ///
    /// # Errors
    /// A folder that cannot be written.
    pub fn create(name: &Path) -> io::Result<Self> {
        let file = AtomicFile::create(name)?;
        Ok(Self(Mutex::new(Spilled { file, places: HashMap::new(), end: 0 })))
    }

    fn put(&self, at: TileKey, tile: &Tile) -> io::Result<()> {
        let mut spilled = lock(&self.0);
        let (begin, bytes) = (spilled.end, bytemuck::cast_slice::<f32, u8>(tile.data()));
        spilled.file.seek(SeekFrom::Start(begin))?;
        spilled.file.write_all(bytes)?;
        spilled.end += bytes.len() as u64;
        spilled.places.insert(at, begin);
        Ok(())
    }

    fn take(&self, at: &TileKey, tile: &mut Tile) -> Option<()> {
        let mut spilled = lock(&self.0);
        let begin = *spilled.places.get(at)?;
        spilled.file.seek(SeekFrom::Start(begin)).ok()?;
        spilled.file.read_exact(bytemuck::cast_slice_mut(tile.data_mut())).ok()
    }
}

/// What is left of `rest` without `part`, if that is a smaller window.
fn without(rest: Window, part: Window) -> Option<Window> {
    let part = rest.overlap(&part)?;
    let (left, top, right, bottom) = (rest.x, rest.y, rest.right(), rest.bottom());
    let between =
        |x: i32, y: i32, right: i32, bottom: i32| Window { x, y, width: right.abs_diff(x), height: bottom.abs_diff(y) };
    let (wide, high) = (part.width == rest.width, part.height == rest.height);
    match () {
        () if wide && part.y == top => Some(between(left, part.bottom(), right, bottom)),
        () if wide && part.bottom() == bottom => Some(between(left, top, right, part.y)),
        () if high && part.x == left => Some(between(part.right(), top, right, bottom)),
        () if high && part.right() == right => Some(between(left, top, part.x, bottom)),
        () => None,
    }
}

impl Run<'_> {
    /// The pixels of a tile that neighbours read too, the largest first.
    pub(super) fn shared_with_neighbors(&self, tile: &TileKey, at: (Piece, Piece)) -> Vec<Halo> {
        self.reached(|reach| Some(reach.halos(tile, at))).unwrap_or_default()
    }

    /// What neighbours have left of `window` of a tile, and the pixels that are not there; what was taken is removed from
    /// `halos`. `None` if nothing was.
    pub(super) fn taken(
        &self,
        halos: &mut Vec<Halo>,
        field: &Field,
        grid: &Grid,
        window: Window,
    ) -> Option<(Tile, Window)> {
        let (mut out, mut rest) = (None, window);
        halos.retain(|halo| {
            let Some(smaller) = without(rest, halo.window).filter(|_| window.contains(&halo.window)) else {
                return true;
            };
            let mut part = Tile::unset(*grid, halo.window, field.channels());
            if self.fetch_halo(halo, &mut part).is_none() {
                return true;
            }
            rest = smaller;
            out.get_or_insert_with(|| Tile::unset(*grid, window, field.channels())).copy_from(&part, 0, 0);
            false
        });
        out.map(|out| (out, rest))
    }

    fn fetch_halo(&self, halo: &Halo, part: &mut Tile) -> Option<()> {
        match &halo.place {
            Place::File(spill) => spill.take(&halo.at, part),
            Place::Store => {
                let (store, name) = (self.caches.store.as_ref()?, halo.at.name());
                let bytes = store.get(Shelf::Halos, name)?;
                let data = bytemuck::cast_slice_mut::<f32, u8>(part.data_mut());
                if bytes.len() != data.len() {
                    store.remove(Shelf::Halos, name);
                    return None;
                }
                data.copy_from_slice(&bytes);
                Some(())
            }
        }
    }

    /// Notes what a window of a field took, if there are neighbours.
    pub(super) fn weigh_halo(&self, field: &Field, grid: &Grid, window: Window, own: Duration) {
        if self.reached(|reach| reach.has_neighbors().then_some(())).is_some() {
            self.halos.keeper.filled(field, grid, window, own);
        }
    }

    /// Leaves for neighbours what they read of a new tile, if that is worth it.
    pub(super) fn leave(&self, halos: &[Halo], field: &Field, tile: &Tile) {
        for halo in halos.iter().filter(|halo| halo.waits && tile.window.contains(&halo.window)) {
            let mut part = Tile::unset(tile.grid, halo.window, tile.channels());
            let bytes = part.bytes();
            let keeper = &self.halos.keeper;
            if !keeper.halo(field, &tile.grid, halo.window, bytes) {
                continue;
            }
            part.copy_from(tile, 0, 0);
            let start = ThreadTime::now();
            match &halo.place {
                // What cannot be left is computed again.
                Place::File(spill) => drop(spill.put(halo.at, &part)),
                Place::Store => self.put_halo(halo, &part),
            }
            keeper.wrote(bytes, start.elapsed());
        }
    }

    fn put_halo(&self, halo: &Halo, part: &Tile) {
        let Some(store) = &self.caches.store else { return };
        let bytes: &[u8] = bytemuck::cast_slice(part.data());
        if self.halos.left.fetch_add(bytes.len() as u64, Ordering::Relaxed) < store.room() / ROOM {
            store.put(Shelf::Halos, halo.at.name(), bytes, Duration::ZERO, &|| self.cancel.is_cancelled());
        }
    }

    /// Removes what neighbours had left for the part that is done now.
    pub fn done_with_halos(&self) {
        let Some(store) = &self.caches.store else { return };
        let left = self.reached(|reach| Some(reach.left_in_store())).unwrap_or_default();
        left.into_iter().for_each(|name| store.remove(Shelf::Halos, name));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::value::Key;
    use glam::DVec2;

    #[test]
    fn what_is_left_is_a_window_or_nothing_is_taken() {
        let window = |x, y, width, height| Window { x, y, width, height };
        let whole = window(10, 20, 100, 50);
        assert_eq!(without(whole, window(0, 0, 500, 30)), Some(window(10, 30, 100, 40)));
        assert_eq!(without(whole, window(10, 60, 100, 10)), Some(window(10, 20, 100, 40)));
        assert_eq!(without(whole, window(10, 20, 30, 50)), Some(window(40, 20, 70, 50)));
        assert_eq!(without(whole, window(90, 0, 20, 100)), Some(window(10, 20, 80, 50)));
        assert!(without(whole, whole).is_some_and(|rest| rest.is_empty()));
        // In the middle, in a corner, beside it.
        for part in [window(20, 20, 10, 50), window(10, 20, 50, 20), window(200, 20, 10, 50)] {
            assert_eq!(without(whole, part), None);
        }
    }

    #[test]
    fn what_is_spilled_comes_back_and_the_file_goes() {
        let dir = tempfile::tempdir().unwrap();
        let grid = Grid { origin: DVec2::ZERO, step: DVec2::ONE, period: None };
        let window = Window { x: 0, y: 0, width: 3, height: 2 };
        let tile = |value: f32| {
            let mut tile = Tile::new(grid, window, 2);
            tile.data_mut().fill(value);
            tile
        };
        let at = |x: i32| TileKey { field: Key::of("test", &[]), grid: grid.id(), at: (x, 0) };
        let spill = Spill::create(&dir.path().join("a.exr")).unwrap();
        [1, 2, 3].into_iter().for_each(|x| spill.put(at(x), &tile(x as f32)).unwrap());
        let mut back = tile(0.0);
        assert!(spill.take(&at(2), &mut back).is_some() && back == tile(2.0));
        assert!(spill.take(&at(4), &mut back).is_none());
        spill.put(at(4), &tile(4.0)).unwrap();
        assert!(spill.take(&at(4), &mut back).is_some() && back == tile(4.0));
        drop(spill);
        assert_eq!(dir.path().read_dir().unwrap().count(), 0);
    }
}
