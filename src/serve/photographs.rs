//! The photograph of a page, and the fit that is at work.
use shibo_bridge::scene::lock;
use shibo_engine::eval::CancelToken;
use shibo_fit::graph::Preset;
use shibo_fit::page::Held;
use std::sync::{Arc, Mutex};

/// The photograph of this run, and the fit that is at work.
#[derive(Default)]
pub(crate) struct Photographs {
    held: Mutex<Option<Arc<Held>>>,
    pub(super) work: Mutex<Work>,
}

/// The fits of this run.
#[derive(Default)]
pub(super) struct Work {
    /// The number of the last one.
    pub(super) last: u64,
    pub(super) running: Option<CancelToken>,
    /// The preset of the last one that is finished.
    pub(super) found: Option<Preset>,
}

impl Photographs {
    /// The preset of the last fit.
    pub(super) fn found(&self) -> Option<Preset> {
        lock(&self.work).found.clone()
    }

    /// The photograph, if the page has one.
    pub(super) fn held(&self) -> Option<Arc<Held>> {
        lock(&self.held).clone()
    }

    /// Takes a photograph, or puts it away.
    pub(super) fn hold(&self, held: Option<Held>) {
        *lock(&self.held) = held.map(Arc::new);
    }
}
