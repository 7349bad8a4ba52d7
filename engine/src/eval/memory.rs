//! The cache in memory: tiles and objects by key, bounded in bytes.
use super::warnings::{self, Warning, Warnings};
use super::{Shelf, Store};
use crate::value::{Grid, GridId, Handle, Key, TILE, Tile, Value, Window};
use quick_cache::Weighter;
use quick_cache::sync::{Cache, DefaultLifecycle, PlaceholderGuard};
use quick_cache::{DefaultHashBuilder, OptionsBuilder};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// If there are more values than this, the values of other graphs are dropped. Fields, solids and other lazy values
/// count as zero bytes but take some kilobytes each, and a sweep makes several hundred of them for each variant.
const MANY: usize = 1024;

/// The identity of a tile.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct TileKey {
    /// The field.
    pub field: Key,
    /// The grid.
    pub grid: GridId,
    /// The pixels: a whole tile or a part of one; [`TileKey::PREPARED`] for data that a field prepared from the whole
    /// picture.
    pub window: Window,
}

impl TileKey {
    /// Replaces the window for data that a field prepared from the whole picture.
    pub const PREPARED: Window = Window { x: 0, y: 0, width: 0, height: 0 };

    /// The tile's key in a store.
    pub(super) fn name(&self) -> Key {
        let Window { x, y, width, height } = self.window;
        let window = [x.to_le_bytes(), y.to_le_bytes(), width.to_le_bytes(), height.to_le_bytes()];
        Key::of("tile", &[self.field.as_bytes(), &self.grid.bytes(), window.as_flattened()])
    }

    /// Loads the tile and its warnings from a store. Removes an entry of another form.
    pub(super) fn load(&self, store: &dyn Store, grid: &Grid, channels: usize) -> Option<(Tile, Warnings)> {
        let bytes = store.get(Shelf::Tiles, self.name())?;
        let mut tile = Tile::unset(*grid, self.window, channels);
        let data = bytemuck::cast_slice_mut::<f32, u8>(tile.data_mut());
        let parts = bytes.split_at_checked(data.len());
        let Some((values, found)) = parts.and_then(|(values, found)| Some((values, warnings::from_bytes(found)?)))
        else {
            store.remove(Shelf::Tiles, self.name());
            return None;
        };
        data.copy_from_slice(values);
        Some((tile, found))
    }

    /// Puts the tile and its warnings into a store: the values, then the warnings if there are some.
    pub(super) fn save(
        &self,
        store: &dyn Store,
        (tile, found): (&Tile, &[Warning]),
        spared: Duration,
        stopped: &dyn Fn() -> bool,
    ) {
        let values: &[u8] = bytemuck::cast_slice(tile.data());
        match found {
            [] => store.put(Shelf::Tiles, self.name(), values, spared, stopped),
            found => {
                let bytes = [values, &warnings::to_bytes(found)].concat();
                store.put(Shelf::Tiles, self.name(), &bytes, spared, stopped);
            }
        }
    }
}

/// A tile, with the warnings about its values and about those of the tiles that it was made of.
#[derive(Clone)]
pub(super) struct Warned {
    pub(super) tile: Arc<Tile>,
    pub(super) warnings: Warnings,
}

/// Bytes that a warning counts as in the memory.
const WARNING: u64 = 512;

/// Weighs entries by the memory they take.
#[derive(Clone)]
pub(super) struct Bytes;

impl Weighter<TileKey, Warned> for Bytes {
    fn weight(&self, _key: &TileKey, made: &Warned) -> u64 {
        made.tile.bytes() as u64 + WARNING * made.warnings.len() as u64
    }
}

impl Weighter<Key, (Value, Warnings)> for Bytes {
    fn weight(&self, _key: &Key, (value, _): &(Value, Warnings)) -> u64 {
        value.bytes() as u64 + 64
    }
}

pub(super) type Tiles = Cache<TileKey, Warned, Bytes>;
/// Held while a tile is computed; other threads that need the tile wait.
pub(super) type Guard<'c> =
    PlaceholderGuard<'c, TileKey, Warned, Bytes, DefaultHashBuilder, DefaultLifecycle<TileKey, Warned>>;
pub(super) type Objects = Cache<Key, (Value, Warnings), Bytes>;

/// Results by key, within a budget of bytes. Objects are expensive to compute and have their own share, which tiles
/// cannot use.
///
/// Fields and other lazy values count as almost nothing, but they hold references to the objects they were made from,
/// which keep those objects alive after the cache dropped them. All living objects are therefore tracked, and values
/// that hold too many of them are dropped.
pub struct MemoryCache {
    pub(super) tiles: Tiles,
    pub(super) objects: Objects,
    /// The bytes that all objects together may take.
    share: u64,
    /// Objects alive at the last count by address, with their bytes.
    watched: Mutex<BTreeMap<usize, (Handle, u64)>>,
}

fn cache<K: Eq + std::hash::Hash, V: Clone>(bytes: u64, item: u64) -> Cache<K, V, Bytes>
where
    Bytes: Weighter<K, V>,
{
    // At most one shard per eight fitting items: a small budget must still hold large items.
    let shards = (bytes / (8 * item)).clamp(1, 16);
    let options = OptionsBuilder::new()
        .estimated_items_capacity(usize::try_from((bytes / item).clamp(16, 1 << 20)).unwrap_or(1 << 20))
        .weight_capacity(bytes.max(1))
        .shards(usize::try_from(shards).unwrap_or(1))
        .build()
        .unwrap_or_else(|_| unreachable!("both capacities are given"));
    Cache::with_options(options, Bytes, DefaultHashBuilder::default(), DefaultLifecycle::default())
}

impl MemoryCache {
    /// A cache of at most `bytes`.
    pub fn new(bytes: u64) -> Self {
        let tile = u64::from(TILE) * u64::from(TILE) * 4;
        let share = bytes / 4;
        let objects = cache(share, 1 << 20);
        Self { tiles: cache(bytes / 4 * 3, tile), objects, share, watched: Mutex::default() }
    }

    /// Inserts a value and its warnings, within the budget.
    pub(super) fn keep(&self, key: Key, value: Value, warnings: Warnings) {
        if let Some(handle) = value.handle() {
            let mut watched = self.watched.lock().unwrap_or_else(PoisonError::into_inner);
            watched.insert(handle.as_ptr().cast::<u8>().addr(), (handle, value.bytes() as u64));
        }
        self.objects.insert(key, (value, warnings));
    }

    /// The bytes of all living objects.
    pub fn alive(&self) -> u64 {
        let mut watched = self.watched.lock().unwrap_or_else(PoisonError::into_inner);
        watched.retain(|_, (handle, _)| handle.strong_count() > 0);
        watched.values().map(|(_, bytes)| bytes).sum()
    }

    /// If objects exceed their share, or there are too many values, drops lazy values that are not `needed`, and with
    /// them the objects that only they hold. A lazy value is quickly recreated; an object worth keeping is in the cache
    /// or in the store.
    pub(super) fn relieve(&self, needed: impl Fn(&Key) -> bool) {
        if self.alive() > self.share || self.objects.len() > MANY {
            self.objects.retain(|key, (value, _)| value.handle().is_some() || needed(key));
        }
    }

    /// The bytes that the cache holds.
    pub fn bytes(&self) -> u64 {
        self.tiles.weight() + self.objects.weight()
    }

    /// Removes everything.
    pub fn clear(&self) {
        self.tiles.clear();
        self.objects.clear();
    }
}
