//! Encoded pictures by name, bounded in bytes: what pages show, and what they may come back to.
use shibo_engine::value::Type;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The most bytes of pictures that are kept besides those being shown.
const BUDGET: usize = 192 << 20;

/// A picture as pages get it.
#[derive(Debug)]
pub(crate) struct Stored {
    /// The name, which identifies the content.
    pub(crate) id: String,
    /// The file.
    pub(crate) png: axum::body::Bytes,
    /// Width and height in pixels.
    pub(crate) size: [u32; 2],
    /// The values shown as black and as white.
    pub(crate) range: [f32; 2],
    /// What it shows.
    pub(crate) ty: Type,
}

#[derive(Default)]
struct Inner {
    pictures: HashMap<String, (Arc<Stored>, u64)>,
    bytes: usize,
    clock: u64,
}

/// The pictures.
#[derive(Default)]
pub(crate) struct Store(Mutex<Inner>);

impl Store {
    fn lock(&self) -> MutexGuard<'_, Inner> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The picture of that name.
    pub(crate) fn get(&self, id: &str) -> Option<Arc<Stored>> {
        let mut inner = self.lock();
        inner.clock += 1;
        let now = inner.clock;
        let (picture, used) = inner.pictures.get_mut(id)?;
        *used = now;
        Some(picture.clone())
    }

    /// Keeps a picture; those that were not used for the longest time are dropped.
    pub(crate) fn put(&self, picture: Arc<Stored>) {
        let mut inner = self.lock();
        inner.clock += 1;
        let now = inner.clock;
        inner.bytes += picture.png.len();
        if let Some((old, _)) = inner.pictures.insert(picture.id.clone(), (picture, now)) {
            inner.bytes -= old.png.len();
        }
        while inner.bytes > BUDGET && inner.pictures.len() > 1 {
            let Some(oldest) = inner.pictures.iter().min_by_key(|(_, (_, used))| *used).map(|(id, _)| id.clone())
            else {
                break;
            };
            if let Some((old, _)) = inner.pictures.remove(&oldest) {
                inner.bytes -= old.png.len();
            }
        }
    }
}
