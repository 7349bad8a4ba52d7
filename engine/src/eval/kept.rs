//! Writes results to the store and reads them back. The [`CachePolicy`](super::keep::CachePolicy) decides which results
//! to store.
use super::memory::Warned;
use super::run::Run;
use super::stats::Stored;
use super::warnings::{self, Warning, Warnings};
use super::{Shelf, TileKey, keep, lock};
use crate::value::clock::Stopwatch;
use crate::value::codec;
use crate::value::{Field, Grid, Key, Tile, Type, Value, Window};
use glam::{DVec2, UVec2};
use std::sync::Arc;
use std::time::Duration;

/// Data prepared from whole pictures is not stored if it takes more than one part in this many of a store.
const WHOLE: u64 = 4;

/// Serializes a tile and its warnings: grid, window and number of channels, then the values, then the warnings if there
/// are some.
fn bytes_of(Warned { tile, warnings }: &Warned) -> Vec<u8> {
    let (grid, window) = (tile.grid, tile.window);
    let shown = grid.shown.unwrap_or(DVec2::ZERO);
    let floats = [grid.origin.x, grid.origin.y, grid.step.x, grid.step.y, shown.x, shown.y].map(f64::to_le_bytes);
    let period = grid.period.map_or([0; 2], |period| period.to_array());
    let channels = u32::try_from(tile.channels()).unwrap_or(0);
    let [x, y] = [window.x, window.y].map(i32::cast_unsigned);
    let words = [u32::from(grid.period.is_some()), period[0], period[1], x, y, window.width, window.height, channels];
    let words = words.map(u32::to_le_bytes);
    let values = bytemuck::cast_slice(tile.data());
    [floats.as_flattened(), words.as_flattened(), values, &warnings::to_bytes(warnings)].concat()
}

fn tile_of(bytes: &[u8]) -> Option<Warned> {
    let (floats, rest) = bytes.split_at_checked(48)?;
    let (words, data) = rest.split_at_checked(32)?;
    let float = |i: usize| Some(f64::from_le_bytes(*floats.as_chunks::<8>().0.get(i)?));
    let word = |i: usize| Some(u32::from_le_bytes(*words.as_chunks::<4>().0.get(i)?));
    let (origin, step) = (DVec2::new(float(0)?, float(1)?), DVec2::new(float(2)?, float(3)?));
    let shown = Some(DVec2::new(float(4)?, float(5)?)).filter(|shown| *shown != DVec2::ZERO);
    let period = if word(0)? == 0 { None } else { Some(UVec2::new(word(1)?, word(2)?)) };
    let [x, y] = [word(3)?.cast_signed(), word(4)?.cast_signed()];
    let window = Window { x, y, width: word(5)?, height: word(6)? };
    let channels = word(7)?;
    let bytes = u128::from(window.width) * u128::from(window.height) * u128::from(channels) * 4;
    let (data, found) = data.split_at_checked(usize::try_from(bytes).ok()?)?;
    let warnings = warnings::from_bytes(found)?;
    let mut tile = Tile::unset(Grid { origin, step, period, shown }, window, usize::try_from(channels).ok()?);
    bytemuck::cast_slice_mut::<f32, u8>(tile.data_mut()).copy_from_slice(data);
    Some(Warned { tile: Arc::new(tile), warnings })
}

impl Run<'_> {
    /// Reads an object and its warnings from the store. Removes an object of the wrong type.
    pub(super) fn stored_object(&self, key: Key, ty: Type) -> Option<(Value, Warnings)> {
        let store = self.caches.store.as_ref().filter(|_| codec::is_data(ty))?;
        let read = |bytes: &[u8]| {
            let (bytes, found) = warnings::split(bytes)?;
            Some((codec::decode(bytes).filter(|value| value.ty() == ty)?, found))
        };
        let found = read(&store.get(Shelf::Objects, key)?);
        if found.is_none() {
            store.remove(Shelf::Objects, key);
        }
        found
    }

    /// Stores a new object and its warnings if it is worth storing.
    pub(super) fn keep_object(&self, key: Key, value: &Value, warnings: &[Warning], time: Duration) {
        if let Some(store) = &self.caches.store
            && codec::is_data(value.ty())
            && self.caches.policy.object(value.bytes(), time)
            && !self.cancel.is_cancelled()
            && let Some(mut bytes) = codec::encode(value)
        {
            warnings::append(&mut bytes, warnings);
            store.put(Shelf::Objects, key, &bytes, time, &|| self.cancel.is_cancelled());
            self.note(key, bytes.len(), time);
        }
    }

    fn note(&self, key: Key, bytes: usize, time: Duration) {
        let stored = Stored { node: String::new(), bytes: bytes as u64, seconds: time.as_secs_f64() };
        lock(&self.stored).push((key, stored));
    }

    /// The results stored for objects and whole pictures, in the order of the graph.
    pub fn stored(&self) -> Vec<Stored> {
        let stored = lock(&self.stored);
        let mut found = Vec::new();
        for index in self.graph.nodes.node_indices() {
            let node = &self.graph.nodes[index];
            let specs = node.node.outputs();
            for (output, spec) in specs.iter().enumerate() {
                let key = self.keys.output(index, output);
                let name = if specs.len() == 1 { node.name.clone() } else { format!("{}.{}", node.name, spec.name) };
                let own = stored.iter().filter(|(of, _)| *of == key);
                found.extend(own.map(|(_, one)| Stored { node: name.clone(), ..one.clone() }));
            }
        }
        found
    }

    /// Reads the data that a field prepared from whole pictures.
    pub(super) fn stored_whole(&self, at: &TileKey) -> Option<Warned> {
        let store = self.caches.store.as_ref()?;
        let whole = tile_of(&store.get(Shelf::Wholes, at.name())?);
        if whole.is_none() {
            store.remove(Shelf::Wholes, at.name());
        }
        whole
    }

    /// Stores the data that a field prepared if it is worth storing; `owner` is the result that the field belongs to.
    pub(super) fn keep_whole(&self, at: &TileKey, whole: &Warned, owner: Option<Key>, time: Duration) {
        let tile = &whole.tile;
        let Some(store) = self.caches.store.as_ref().filter(|store| tile.bytes() as u64 <= store.room() / WHOLE) else {
            return;
        };
        if self.caches.policy.object(tile.bytes(), time) && !self.cancel.is_cancelled() {
            let bytes = bytes_of(whole);
            store.put(Shelf::Wholes, at.name(), &bytes, time, &|| self.cancel.is_cancelled());
            owner.into_iter().for_each(|owner| self.note(owner, bytes.len(), time));
        }
    }

    /// Reads a tile and its warnings from the store. Removes an entry of another form.
    pub(super) fn stored_tile(&self, at: &TileKey, field: &Field, grid: &Grid) -> Option<(Tile, Warnings)> {
        let store = self.caches.store.as_ref().filter(|store| keep::fits(field, grid, store.room()))?;
        at.load(&**store, grid, field.channels())
    }

    /// Stores a new tile if it is worth storing.
    pub(super) fn keep_tile(&self, at: &TileKey, field: &Field, Warned { tile, warnings }: &Warned, debt: Duration) {
        let (Some(store), policy) = (&self.caches.store, &self.caches.policy) else { return };
        let bytes = size_of_val(tile.data());
        if policy.tile(field, &tile.grid, bytes, debt, store.room()) {
            let start = Stopwatch::thread();
            at.save(&**store, (tile, warnings), debt, &|| self.cancel.is_cancelled());
            policy.wrote(bytes, start.elapsed());
        }
    }
}
