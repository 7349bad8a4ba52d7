//! Prepares fields: computes the data that they need from whole pictures, before any tile.
use super::TileKey;
use super::demand::{inputs_first, reads};
use super::evaluators::Whole;
use super::lock;
use super::memory::Warned;
use super::run::Run;
use super::stats::Work;
use crate::diagnostics::{Code, Problem};
use crate::value::clock::Stopwatch;
use crate::value::{Field, Grid, Stop};
use std::sync::{Arc, Mutex};

impl Run<'_> {
    /// Computes the data from whole pictures that `field` and all fields below it need before their tiles can be
    /// filled.
    ///
    /// # Errors
    /// As the code of the fields reports.
    pub fn prepare(&self, field: &Field, grid: &Grid) -> Result<(), Stop> {
        self.known.add_picture(field, grid);
        let inputs = |field, grid: &Grid| {
            let all = || Ok(reads(field, grid).chain(field.source().whole(grid)).collect());
            if self.known.is_prepared(field, grid) { Ok(Vec::new()) } else { self.of_owner(owner(field), all) }
        };
        inputs_first(&[field], grid, inputs, |field, grid| {
            if !self.known.is_prepared(field, &grid) {
                self.known.add_prepared(field, &grid, self.prepare_one(field, &grid)?);
            }
            Ok(())
        })
    }

    fn prepare_one(&self, field: &Field, grid: &Grid) -> Result<Option<Warned>, Stop> {
        let key = field.key().map(|field| TileKey { field, grid: grid.id(), window: TileKey::PREPARED });
        let tiles = &self.caches.memory.tiles;
        if let Some(whole) = key.as_ref().and_then(|key| tiles.get(key)) {
            return Ok(Some(whole));
        }
        // Most fields prepare nothing, so the store is not searched for them.
        let sought = key.filter(|_| !field.source().whole(grid).is_empty());
        let stored = sought.and_then(|key| self.stored_whole(&key));
        let (found, start) = (stored.is_some(), Stopwatch::process());
        let whole = if found { stored } else { self.prepare_new(field, grid)? };
        if let (Some(key), Some(whole)) = (key, &whole) {
            tiles.insert(key, whole.clone());
            if sought.is_some() && !found {
                self.keep_whole(&key, whole, owner(field), start.elapsed());
            }
        }
        Ok(whole)
    }

    fn prepare_new(&self, field: &Field, grid: &Grid) -> Result<Option<Warned>, Stop> {
        let bytes = field.source().prepare_bytes(grid);
        if bytes > self.memory {
            let (needed, allowed) = (bytes >> 20, self.memory >> 20);
            let message = format!("an operation on the whole picture needs {needed} MiB; {allowed} MiB are allowed");
            return Err(Problem::new(Code::TooLarge, message).help("lower the resolution, or raise --memory").into());
        }
        let working = self.meter.begin();
        let reads = field.source().whole(grid);
        let pictures = Whole { run: self, reads, working: &working, found: Mutex::default() };
        let result = self.of_owner(owner(field), || field.source().prepare(grid, &pictures))?;
        if let (Some(owner), true) = (owner(field), result.is_some()) {
            self.ledger.add(owner, Work { time: working.time(), computed: 1, ..Work::default() });
        }
        let warnings = lock(&pictures.found).warnings();
        Ok(result.map(|tile| Warned { tile: Arc::new(tile), warnings }))
    }
}

/// The result to which the work of a field is charged.
fn owner(field: &Field) -> Option<crate::value::Key> {
    field.owner().or(field.key())
}
