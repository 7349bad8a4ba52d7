//! The light of the panorama that a page sent last.
use axum::body::Bytes;
use std::sync::Mutex;
use tokio::sync::Semaphore;

/// The environment of this run.
pub(crate) struct Environment {
    pub(super) bytes: Mutex<Option<Bytes>>,
    /// Only one panorama is read at a time.
    pub(super) turn: Semaphore,
}

impl Default for Environment {
    fn default() -> Self {
        Self { bytes: Mutex::default(), turn: Semaphore::new(1) }
    }
}
