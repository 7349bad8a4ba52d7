//! Puts results into the store and takes them out. The [`Keeper`](super::keep::Keeper) decides which are worth keeping.
use super::run::Run;
use super::{Shelf, TileKey, codec, keep};
use crate::value::{Field, Grid, Key, Tile, Type, Value, Window};
use cpu_time::ThreadTime;
use std::time::Duration;

impl Run<'_> {
    /// An object from the store. One of a wrong type is removed.
    pub(super) fn stored_object(&self, key: Key, ty: Type) -> Option<Value> {
        let store = self.caches.store.as_ref().filter(|_| codec::is_data(ty))?;
        let value = codec::decode(&store.get(Shelf::Objects, key)?).filter(|value| value.ty() == ty);
        if value.is_none() {
            store.remove(Shelf::Objects, key);
        }
        value
    }

    /// Puts a new object into the store, if it is worth that.
    pub(super) fn keep_object(&self, key: Key, value: &Value, time: Duration) {
        if let Some(store) = &self.caches.store
            && codec::is_data(value.ty())
            && self.caches.keeper.object(value.bytes(), time)
            && !self.cancel.is_cancelled()
            && let Some(bytes) = codec::encode(value)
        {
            store.put(Shelf::Objects, key, &bytes, time, &|| self.cancel.is_cancelled());
        }
    }

    /// A tile from the store. One of a wrong size is removed.
    pub(super) fn stored_tile(&self, at: &TileKey, field: &Field, grid: &Grid, window: Window) -> Option<Tile> {
        let store = self.caches.store.as_ref().filter(|store| keep::fits(field, grid, store.room()))?;
        let bytes = store.get(Shelf::Tiles, at.name())?;
        let mut tile = Tile::unset(*grid, window, field.channels());
        let data = bytemuck::cast_slice_mut::<f32, u8>(tile.data_mut());
        if bytes.len() != data.len() {
            store.remove(Shelf::Tiles, at.name());
            return None;
        }
        data.copy_from_slice(&bytes);
        Some(tile)
    }

    /// Puts a new tile into the store, if it is worth that.
    pub(super) fn keep_tile(&self, at: &TileKey, field: &Field, tile: &Tile, debt: Duration) {
        let (Some(store), keeper) = (&self.caches.store, &self.caches.keeper) else { return };
        let bytes: &[u8] = bytemuck::cast_slice(tile.data());
        if keeper.tile(field, &tile.grid, bytes.len(), debt, store.room()) {
            let start = ThreadTime::now();
            store.put(Shelf::Tiles, at.name(), bytes, debt, &|| self.cancel.is_cancelled());
            keeper.wrote(bytes.len(), start.elapsed());
        }
    }
}
