//! Before tiles: what fields need of whole pictures, and which fields are read more than once.
use super::TileKey;
use super::evaluators::Whole;
use super::run::Run;
use super::stats::Work;
use crate::diagnostics::{Code, Problem};
use crate::value::{Cost, Field, FieldId, Grid, GridId, Key, Read, Stop, Tile, Window};
use cpu_time::ProcessTime;
use std::collections::{HashMap, HashSet};
use std::sync::{Arc, PoisonError};

/// A field on a grid.
pub(super) type At = (FieldId, GridId);

/// What a run knows of the fields that it reads.
#[derive(Default)]
pub(super) struct Known {
    /// What was prepared of whole pictures; the fields are kept alive with it, so that their identities stay theirs.
    prepared: HashMap<At, (Field, Option<Arc<Tile>>)>,
    /// How many reads of other fields, and as a picture of its own, there are of each field with a key.
    readers: HashMap<(Key, GridId), u32>,
    /// The pictures that were asked for.
    pictures: HashSet<At>,
}

impl Known {
    fn count(&mut self, field: &Field, grid: &Grid) {
        if let Some(key) = field.key() {
            *self.readers.entry((key, grid.id())).or_default() += 1;
        }
    }
}

/// What tells a field on a grid from others.
pub(super) fn at(field: &Field, grid: &Grid) -> At {
    (field.id(), grid.id())
}

/// What a field reads while it fills tiles of `grid`; the windows are those for one pixel.
pub(super) fn reads<'f>(field: &'f Field, grid: &Grid) -> impl Iterator<Item = Read<'f>> + use<'f> {
    let pixel = Window { x: 0, y: 0, width: 1, height: 1 };
    let source = field.source();
    source.inputs(grid, pixel).into_iter().chain(source.later(grid, pixel))
}

impl Run<'_> {
    /// Computes what `field` and all that it reads need of whole pictures before their tiles can be filled. Uses a
    /// work-list, because fields may read each other in long chains.
    ///
    /// # Errors
    /// As the fields' code says.
    pub fn prepare(&self, field: &Field, grid: &Grid) -> Result<(), Stop> {
        {
            let mut known = self.known.write().unwrap_or_else(PoisonError::into_inner);
            if known.pictures.insert(at(field, grid)) {
                known.count(field, grid);
            }
        }
        let mut open = vec![(field.clone(), *grid, false)];
        let mut begun = HashSet::new();
        while let Some((field, grid, inputs_are_done)) = open.pop() {
            if inputs_are_done {
                let whole = self.prepare_one(&field, &grid)?;
                let mut known = self.known.write().unwrap_or_else(PoisonError::into_inner);
                if !known.prepared.contains_key(&at(&field, &grid)) {
                    reads(&field, &grid).for_each(|read| known.count(read.field, &read.grid));
                    known.prepared.insert(at(&field, &grid), (field, whole));
                }
            } else if !self.is_prepared(&field, &grid) && begun.insert(at(&field, &grid)) {
                open.push((field.clone(), grid, true));
                let all = || reads(&field, &grid).chain(field.source().whole(&grid));
                let read = || Ok(all().map(|read| (read.field.clone(), read.grid, false)).collect::<Vec<_>>());
                open.extend(self.of_owner(field.owner().or(field.key()), read)?);
            }
        }
        Ok(())
    }

    fn is_prepared(&self, field: &Field, grid: &Grid) -> bool {
        self.known.read().unwrap_or_else(PoisonError::into_inner).prepared.contains_key(&at(field, grid))
    }

    fn prepare_one(&self, field: &Field, grid: &Grid) -> Result<Option<Arc<Tile>>, Stop> {
        let key = field.key().map(|field| TileKey { field, grid: grid.id(), at: TileKey::WHOLE });
        let tiles = &self.caches.memory.tiles;
        if let Some(tile) = key.as_ref().and_then(|key| tiles.get(key)) {
            return Ok(Some(tile));
        }
        // Most fields prepare nothing, and need no look into the store.
        let sought = key.filter(|_| !field.source().whole(grid).is_empty());
        if let (Some(key), Some(tile)) = (key, sought.and_then(|key| self.stored_whole(&key))) {
            let tile = Arc::new(tile);
            tiles.insert(key, tile.clone());
            return Ok(Some(tile));
        }
        let start = ProcessTime::now();
        let whole = self.prepare_new(field, grid)?;
        if let (Some(key), Some(tile)) = (key, &whole) {
            tiles.insert(key, tile.clone());
            if sought.is_some() {
                self.keep_whole(&key, tile, field.owner().or(field.key()), start.elapsed());
            }
        }
        Ok(whole)
    }

    fn prepare_new(&self, field: &Field, grid: &Grid) -> Result<Option<Arc<Tile>>, Stop> {
        let bytes = field.source().prepare_bytes(grid);
        if bytes > self.memory {
            let message = format!(
                "an operation on the whole picture needs {} MiB; {} MiB are allowed",
                bytes >> 20,
                self.memory >> 20
            );
            return Err(Problem::new(Code::TooLarge, message).help("lower the resolution, or raise --memory").into());
        }
        let working = self.meter.begin();
        let pictures = Whole { run: self, reads: field.source().whole(grid), working: &working };
        let owner = field.owner().or(field.key());
        let result = self.of_owner(owner, || field.source().prepare(grid, &pictures))?;
        if let (Some(owner), true) = (owner, result.is_some()) {
            self.ledger.add(owner, Work { time: working.time(), computed: 1, ..Work::default() });
        }
        Ok(result.map(Arc::new))
    }

    /// What a field prepared of whole pictures on a grid.
    pub(super) fn prepared(&self, field: &Field, grid: &Grid) -> Option<Arc<Tile>> {
        let known = self.known.read().unwrap_or_else(PoisonError::into_inner);
        known.prepared.get(&at(field, grid)).and_then(|(_, tile)| tile.clone())
    }

    /// Whether the field with this key is read more than once on a grid.
    pub(super) fn is_shared(&self, key: Key, grid: &Grid) -> bool {
        let known = self.known.read().unwrap_or_else(PoisonError::into_inner);
        known.readers.get(&(key, grid.id())).is_some_and(|readers| *readers > 1)
    }

    /// Whether tiles of `field`, which is prepared, are kept for others that read them.
    pub fn keeps(&self, field: &Field, grid: &Grid) -> bool {
        let local = field.source().cost() == Cost::Local;
        field.as_constant().is_none() && field.key().is_some_and(|key| local || self.is_shared(key, grid))
    }
}
