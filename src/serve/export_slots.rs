//! The exports at work, and the files of finished ones.
use axum::body::Bytes;
use shibo_bridge::scene::lock;
use shibo_engine::eval::CancelToken;
use std::collections::BTreeMap;
use std::sync::Mutex;

/// Maximum number of exports running at once.
pub(super) const AT_ONCE: usize = 2;

/// Number of finished exports kept until they are fetched.
const KEPT: usize = 4;

/// An export: its cancel token and its result.
pub(super) struct Export {
    pub(super) cancel: CancelToken,
    pub(super) made: Option<(String, Bytes)>,
}

/// The exports of this run by number.
#[derive(Default)]
pub(crate) struct Exports(pub(super) Mutex<(u64, BTreeMap<u64, Export>)>);

impl Exports {
    pub(super) fn begin(&self) -> Option<(u64, CancelToken)> {
        let mut inner = lock(&self.0);
        let at_work = inner.1.values().filter(|export| export.made.is_none()).count();
        if at_work >= AT_ONCE {
            return None;
        }
        while inner.1.len() >= KEPT + AT_ONCE {
            let oldest = inner.1.iter().find(|(_, export)| export.made.is_some()).map(|(id, _)| *id)?;
            inner.1.remove(&oldest);
        }
        inner.0 += 1;
        let (id, cancel) = (inner.0, CancelToken::default());
        inner.1.insert(id, Export { cancel: cancel.clone(), made: None });
        Some((id, cancel))
    }

    pub(super) fn end(&self, id: u64, made: Option<(String, Bytes)>) {
        let mut inner = lock(&self.0);
        match (made, inner.1.get_mut(&id)) {
            (Some(made), Some(export)) => export.made = Some(made),
            _ => drop(inner.1.remove(&id)),
        }
    }
}
