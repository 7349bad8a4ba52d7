//! Parts of tiles in a file: what parts of a picture leave for each other.
//!
//! ```text
//! values of each part of a tile, as they are in memory
//! for each: its name, where it begins, its bytes, its tag
//! MAGIC, how many there are, the tag of that list
//! ```
//!
//! The strips of one picture share a file that has no name and is gone with its last owner. Parts that other processes make find a
//! [published](Spill::publish) one. It is never trusted: what was cut, altered, or left by another build has another tag and counts
//! as missing, and names are made from the keys of fields, so another graph's are not found.
use super::memory::TileKey;
use super::run::lock;
use crate::picture::{AtomicFile, SPILL_END, SPILL_MAGIC as MAGIC};
use crate::value::{Key, Tile};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::sync::Mutex;

/// The bytes of what the list says of a part of a tile: two keys and two numbers.
const ITEM: usize = 48;
/// The bytes of the end.
const END: usize = SPILL_END;

/// Parts of tiles in a file.
pub struct Spill {
    /// The fingerprint of the code that computes; none if nobody else reads the file.
    build: Option<Key>,
    /// The most bytes of values.
    room: u64,
    spilled: Mutex<Spilled>,
}

struct Spilled {
    medium: Medium,
    /// By their names.
    places: BTreeMap<Key, Place>,
    /// Where the next one begins.
    end: u64,
}

enum Medium {
    /// A file of this process.
    Own(AtomicFile),
    /// One that another has published.
    Found(File),
    /// One that was published, or could not be written.
    Closed,
}

#[derive(Clone, Copy)]
struct Place {
    begin: u64,
    bytes: u64,
    tag: Key,
}

impl Spill {
    /// An empty one beside the file `name`, without a name.
    ///
    /// # Errors
    /// A folder that cannot be written.
    pub fn create(name: &Path) -> io::Result<Self> {
        Self::new(name, None, u64::MAX)
    }

    /// An empty one that can be published as the file `name`, of at most `room` bytes.
    ///
    /// # Errors
    /// A folder that cannot be written.
    pub fn create_for(name: &Path, build: Key, room: u64) -> io::Result<Self> {
        Self::new(name, Some(build), room)
    }

    fn new(name: &Path, build: Option<Key>, room: u64) -> io::Result<Self> {
        let medium = Medium::Own(AtomicFile::create(name)?);
        Ok(Self { build, room, spilled: Mutex::new(Spilled { medium, places: BTreeMap::new(), end: 0 }) })
    }

    /// What was published as the file `name` by the same build; `None` if there is nothing, or it is not whole.
    pub fn open(name: &Path, build: Key) -> Option<Self> {
        let mut file = File::open(name).ok()?;
        let length = file.metadata().ok()?.len();
        let end_at = length.checked_sub(END as u64)?;
        file.seek(SeekFrom::Start(end_at)).ok()?;
        let mut end = [0; END];
        file.read_exact(&mut end).ok()?;
        let count = number(&end, 8)?;
        let list_at = end_at.checked_sub(count.checked_mul(ITEM as u64)?)?;
        if number(&end, 0)? != MAGIC {
            return None;
        }
        file.seek(SeekFrom::Start(list_at)).ok()?;
        // No longer than the file is.
        let mut list = vec![0; usize::try_from(end_at - list_at).ok()?];
        file.read_exact(&mut list).ok()?;
        if key(&end, 16)? != tag(build, &[&list]) {
            return None;
        }
        let place = |item: &[u8]| {
            Some((key(item, 0)?, Place { begin: number(item, 16)?, bytes: number(item, 24)?, tag: key(item, 32)? }))
        };
        let places = list.chunks_exact(ITEM).map(place).collect::<Option<_>>()?;
        let spilled = Spilled { medium: Medium::Found(file), places, end: list_at };
        Some(Self { build: Some(build), room: 0, spilled: Mutex::new(spilled) })
    }

    /// Keeps a part of a tile. What cannot be kept is computed again.
    pub(super) fn put(&self, at: &TileKey, tile: &Tile) {
        let (name, bytes) = (at.name(), bytemuck::cast_slice::<f32, u8>(tile.data()));
        let tag = self.build.map_or(name, |build| tag(build, &[name.as_bytes(), bytes]));
        let mut spilled = lock(&self.spilled);
        let begin = spilled.end;
        let Medium::Own(file) = &mut spilled.medium else { return };
        if begin.saturating_add(bytes.len() as u64) > self.room {
            return;
        }
        let written = file.seek(SeekFrom::Start(begin)).and_then(|_| file.write_all(bytes));
        if written.is_err() {
            // A full disk: the room is the pictures'.
            spilled.medium = Medium::Closed;
            spilled.places.clear();
            return;
        }
        spilled.end += bytes.len() as u64;
        spilled.places.insert(name, Place { begin, bytes: bytes.len() as u64, tag });
    }

    /// Whether a part of a tile was kept.
    pub(super) fn has(&self, at: &TileKey) -> bool {
        let spilled = lock(&self.spilled);
        !matches!(spilled.medium, Medium::Closed) && spilled.places.contains_key(&at.name())
    }

    /// Sets a tile to what was kept, if it was.
    pub(super) fn take(&self, at: &TileKey, tile: &mut Tile) -> Option<()> {
        let (name, data) = (at.name(), bytemuck::cast_slice_mut::<f32, u8>(tile.data_mut()));
        let place = {
            let mut spilled = lock(&self.spilled);
            let place = *spilled.places.get(&name).filter(|place| place.bytes == data.len() as u64)?;
            let file: &mut dyn ReadAt = match &mut spilled.medium {
                Medium::Own(file) => file,
                Medium::Found(file) => file,
                Medium::Closed => return None,
            };
            file.read_at(place.begin, data).ok()?;
            place
        };
        self.build.is_none_or(|build| tag(build, &[name.as_bytes(), data]) == place.tag).then_some(())
    }

    /// Gives the file its name, for other processes. Nothing is put into it or taken from it afterwards.
    ///
    /// # Errors
    /// A disk that is full.
    pub fn publish(&self) -> io::Result<()> {
        let mut spilled = lock(&self.spilled);
        let (Medium::Own(mut file), Some(build)) = (std::mem::replace(&mut spilled.medium, Medium::Closed), self.build)
        else {
            return Ok(());
        };
        let mut list = Vec::with_capacity(spilled.places.len() * ITEM);
        for (name, place) in &spilled.places {
            let numbers = [place.begin, place.bytes].map(u64::to_ne_bytes);
            [name.as_bytes(), numbers.as_flattened(), place.tag.as_bytes()]
                .into_iter()
                .for_each(|part| list.extend_from_slice(part));
        }
        let end = tag(build, &[&list]);
        [MAGIC, spilled.places.len() as u64].into_iter().for_each(|word| list.extend_from_slice(&word.to_ne_bytes()));
        list.extend_from_slice(end.as_bytes());
        file.seek(SeekFrom::Start(spilled.end))?;
        file.write_all(&list)?;
        file.commit()
    }
}

trait ReadAt {
    fn read_at(&mut self, begin: u64, data: &mut [u8]) -> io::Result<()>;
}

impl<F: Read + Seek> ReadAt for F {
    fn read_at(&mut self, begin: u64, data: &mut [u8]) -> io::Result<()> {
        self.seek(SeekFrom::Start(begin))?;
        self.read_exact(data)
    }
}

fn tag(build: Key, parts: &[&[u8]]) -> Key {
    let mut all = vec![build.as_bytes().as_slice()];
    all.extend(parts);
    Key::of("spilled", &all)
}

fn number(bytes: &[u8], at: usize) -> Option<u64> {
    bytes.get(at..)?.first_chunk().map(|word| u64::from_ne_bytes(*word))
}

fn key(bytes: &[u8], at: usize) -> Option<Key> {
    bytes.get(at..)?.first_chunk().map(|word| Key::from_bytes(*word))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::value::{Grid, Window};
    use glam::DVec2;

    fn tile(value: f32) -> Tile {
        let grid = Grid { origin: DVec2::ZERO, step: DVec2::ONE, period: None, shown: None };
        let mut tile = Tile::new(grid, Window { x: 0, y: 0, width: 3, height: 2 }, 2);
        tile.data_mut().fill(value);
        tile
    }

    fn at(x: i32) -> TileKey {
        TileKey { field: Key::of("test", &[]), grid: tile(0.0).grid.id(), at: (x, 0) }
    }

    fn build(name: &str) -> Key {
        Key::of("build", &[name.as_bytes()])
    }

    #[test]
    fn what_is_spilled_comes_back_and_the_file_goes() {
        let dir = tempfile::tempdir().unwrap();
        let spill = Spill::create(&dir.path().join("a.exr")).unwrap();
        [1, 2, 3].into_iter().for_each(|x| spill.put(&at(x), &tile(x as f32)));
        let mut back = tile(0.0);
        assert!(spill.take(&at(2), &mut back).is_some() && back == tile(2.0));
        assert!(spill.take(&at(4), &mut back).is_none());
        spill.put(&at(4), &tile(4.0));
        assert!(spill.take(&at(4), &mut back).is_some() && back == tile(4.0));
        drop(spill);
        assert_eq!(dir.path().read_dir().unwrap().count(), 0);
    }

    #[test]
    fn what_is_published_is_found_by_the_same_build() {
        let dir = tempfile::tempdir().unwrap();
        let name = dir.path().join("a.halos");
        // Room for two.
        let spill = Spill::create_for(&name, build("a"), 2 * 48 + 47).unwrap();
        [1, 2, 3].into_iter().for_each(|x| spill.put(&at(x), &tile(x as f32)));
        assert!(!name.exists());
        spill.publish().unwrap();
        let mut back = tile(0.0);
        assert!(spill.take(&at(1), &mut back).is_none());
        let found = Spill::open(&name, build("a")).unwrap();
        assert!(found.take(&at(2), &mut back).is_some() && back == tile(2.0));
        assert!(found.take(&at(3), &mut back).is_none());
        found.put(&at(3), &tile(3.0));
        assert!(found.take(&at(3), &mut back).is_none());
        assert!(Spill::open(&name, build("b")).is_none());
        assert!(Spill::open(&dir.path().join("none"), build("a")).is_none());
        assert_eq!(dir.path().read_dir().unwrap().count(), 1);
    }

    /// Whatever is altered or cut: what comes back is what was put.
    #[test]
    fn a_damaged_file_gives_nothing_wrong() {
        let dir = tempfile::tempdir().unwrap();
        let name = dir.path().join("a.halos");
        let spill = Spill::create_for(&name, build("a"), 1 << 20).unwrap();
        [1, 2, 3].into_iter().for_each(|x| spill.put(&at(x), &tile(x as f32)));
        spill.publish().unwrap();
        let whole = std::fs::read(&name).unwrap();
        let look = |bytes: &[u8]| {
            std::fs::write(&name, bytes).unwrap();
            let Some(found) = Spill::open(&name, build("a")) else { return 0 };
            let taken = |x: &i32| {
                let mut back = tile(0.0);
                let taken = found.take(&at(*x), &mut back).is_some();
                assert!(!taken || back == tile(*x as f32));
                taken
            };
            (1..=3).filter(taken).count()
        };
        assert_eq!(look(&whole), 3);
        for i in 0..whole.len() {
            let mut altered = whole.clone();
            altered[i] ^= 0x41;
            assert!(look(&altered) < 3, "{i}");
            assert_eq!(look(&whole[..i]), 0, "{i}");
        }
    }
}
