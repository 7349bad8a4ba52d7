//! State that jobs share.
use crate::Tools;
use crate::scene::lock;
use shibo_engine::eval::{CancelToken, Observer};
use shibo_engine::session::Session;
use std::collections::BTreeMap;
use std::sync::Mutex;

/// The parts of a host that all jobs use.
pub(super) struct Shared {
    pub(super) session: Session,
    pub(super) tools: Tools,
}

/// The pictures that the other program has of a slot: their keys, by place.
#[derive(Default)]
pub(super) struct SlotState(Mutex<BTreeMap<String, String>>);

impl SlotState {
    pub(super) fn has(&self, place: &str, key: &str) -> bool {
        lock(&self.0).get(place).is_some_and(|known| known == key)
    }

    pub(super) fn set(&self, place: String, key: String) {
        lock(&self.0).insert(place, key);
    }

    pub(super) fn forget(&self, place: &str) {
        lock(&self.0).remove(place);
    }

    /// Forgets all pictures but these.
    pub(super) fn retain(&self, keep: impl Fn(&str) -> bool) {
        lock(&self.0).retain(|place, _| keep(place));
    }
}

/// Surroundings of a step.
pub(super) struct Around<'a> {
    pub(super) shared: &'a Shared,
    pub(super) cancel: &'a CancelToken,
    pub(super) observer: &'a dyn Observer,
}
