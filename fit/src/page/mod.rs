//! A photograph beside the picture of a page: compared with it in words, and fitted. The page of `shibo watch` and the playground take
//! this from here; the playground asks for it by [`Photographs`].
mod held;
mod host;
#[cfg(test)]
mod tests;

pub use held::{Held, MOST_BYTES, Wish, picture, too_large, why};
pub use host::Photographs;

use crate::Status;
use crate::graph::Fitting;
use serde_json::{Map, Value as Json, json};

/// The news of a fit that is at work: finished and planned renders, and the values of the best one.
pub fn progress(fitting: &Fitting<'_>, done: usize, status: &Status) -> Map<String, Json> {
    let best = status.best.as_ref();
    let set = best.map(|best| fitting.values(&best.amounts, best.combination)).unwrap_or_default();
    Map::from_iter([
        ("done".to_owned(), done.into()),
        ("total".to_owned(), status.planned.into()),
        ("best".to_owned(), json!(best.map(|best| best.distance))),
        ("floor".to_owned(), json!(status.floor)),
        ("set".to_owned(), json!(set)),
    ])
}
