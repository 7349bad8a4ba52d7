//! Stores encoded pictures by name, bounded in bytes: those shown by pages, and recent ones.
use shibo_value::Type;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Bounds of the store's size in bytes; the size is an eighth of the engine's memory.
const LEAST: usize = 16 << 20;
const MOST: usize = 192 << 20;

/// An encoded picture.
#[derive(Debug)]
pub struct Stored {
    /// Name, which identifies the content.
    pub id: String,
    /// The PNG file.
    pub png: bytes::Bytes,
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Values shown as black and white.
    pub range: [f32; 2],
    /// Type of the values.
    pub ty: Type,
}

#[derive(Default)]
struct Inner {
    budget: usize,
    pictures: HashMap<String, (Arc<Stored>, u64)>,
    bytes: usize,
    clock: u64,
}

/// The pictures.
pub struct Store(Mutex<Inner>);

impl Store {
    /// Creates an empty store for an engine that may use `memory` bytes.
    pub fn new(memory: u64) -> Self {
        let budget = usize::try_from(memory / 8).unwrap_or(MOST).clamp(LEAST, MOST);
        Self(Mutex::new(Inner { budget, ..Inner::default() }))
    }

    fn lock(&self) -> MutexGuard<'_, Inner> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the picture `id`.
    pub fn get(&self, id: &str) -> Option<Arc<Stored>> {
        let mut inner = self.lock();
        inner.clock += 1;
        let now = inner.clock;
        let (picture, used) = inner.pictures.get_mut(id)?;
        *used = now;
        Some(picture.clone())
    }

    /// Stores a picture and drops the least recently used ones beyond the limit.
    pub fn put(&self, picture: Arc<Stored>) {
        let mut inner = self.lock();
        inner.clock += 1;
        let now = inner.clock;
        inner.bytes += picture.png.len();
        if let Some((old, _)) = inner.pictures.insert(picture.id.clone(), (picture, now)) {
            inner.bytes -= old.png.len();
        }
        while inner.bytes > inner.budget && inner.pictures.len() > 1 {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn drops_least_recently_used_pictures() {
        let store = Store::new(64 << 20);
        let picture = |k: usize| {
            let png = bytes::Bytes::from(vec![0; 3 << 20]);
            Arc::new(Stored { id: k.to_string(), png, size: [1, 1], range: [0.0, 1.0], ty: Type::Gray })
        };
        for k in 0..40 {
            store.put(picture(k));
            // The lookup keeps the first picture in use.
            assert!(store.get("0").is_some());
        }
        let kept = (0..40).filter(|k| store.get(&k.to_string()).is_some()).count();
        assert!((4..=5).contains(&kept), "{kept}");
        assert!(store.get("39").is_some() && store.get("20").is_none());
    }
}
