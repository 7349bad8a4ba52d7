//! The fields that a run has prepared, and the number of their readers.
use super::demand::{At, at, reads};
use super::memory::Warned;
use crate::value::{Cost, Field, Grid};
use std::collections::{HashMap, HashSet};
use std::sync::{PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};

/// The prepared fields, and the number of readers of each field.
#[derive(Default)]
pub(super) struct Known(RwLock<State>);

#[derive(Default)]
struct State {
    /// The data prepared from whole pictures. Keeps the fields alive, so that their identities are not reused.
    prepared: HashMap<At, (Field, Option<Warned>)>,
    /// Number of reads of each field: by other fields, plus one if the field is a picture itself.
    readers: HashMap<At, u32>,
    pictures: HashSet<At>,
}

impl State {
    fn count(&mut self, field: &Field, grid: &Grid) {
        *self.readers.entry(at(field, grid)).or_default() += 1;
    }
}

impl Known {
    fn state(&self) -> RwLockReadGuard<'_, State> {
        self.0.read().unwrap_or_else(PoisonError::into_inner)
    }

    fn state_mut(&self) -> RwLockWriteGuard<'_, State> {
        self.0.write().unwrap_or_else(PoisonError::into_inner)
    }

    /// Counts a picture as a reader of its field, once.
    pub(super) fn add_picture(&self, field: &Field, grid: &Grid) {
        let mut state = self.state_mut();
        if state.pictures.insert(at(field, grid)) {
            state.count(field, grid);
        }
    }

    /// Keeps the data that a field prepared, and counts the field as a reader of its inputs.
    pub(super) fn add_prepared(&self, field: &Field, grid: &Grid, whole: Option<Warned>) {
        let mut state = self.state_mut();
        if !state.prepared.contains_key(&at(field, grid)) {
            reads(field, grid).for_each(|read| state.count(read.field, &read.grid));
            state.prepared.insert(at(field, grid), (field.clone(), whole));
        }
    }

    pub(super) fn is_prepared(&self, field: &Field, grid: &Grid) -> bool {
        self.state().prepared.contains_key(&at(field, grid))
    }

    /// The data that a field prepared from whole pictures on a grid.
    pub(super) fn prepared(&self, field: &Field, grid: &Grid) -> Option<Warned> {
        self.state().prepared.get(&at(field, grid)).and_then(|(_, whole)| whole.clone())
    }

    /// True if tiles of a prepared field are kept for its readers.
    pub(super) fn keeps(&self, field: &Field, grid: &Grid) -> bool {
        let shared = || self.state().readers.get(&at(field, grid)).is_some_and(|readers| *readers > 1);
        let local = field.source().cost() == Cost::Local;
        field.as_constant().is_none() && field.key().is_some() && (local || shared())
    }
}
