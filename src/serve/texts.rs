//! Earlier texts of the graph file by hash, so that a page can restore them.
use sha2::{Digest, Sha256};
use shibo_bridge::scene::lock;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

/// Maximum number of bytes kept; the oldest texts are dropped first.
const BUDGET: usize = 8 << 20;

/// The texts, the newest last.
#[derive(Default)]
pub(crate) struct Texts(Mutex<VecDeque<(String, Arc<str>)>>);

/// Hash that names a content.
pub(crate) fn sha256(text: &str) -> String {
    Sha256::digest(text.as_bytes()).iter().map(|byte| format!("{byte:02x}")).collect()
}

impl Texts {
    /// Keeps a text.
    pub(crate) fn keep(&self, sha: &str, text: &str) {
        let mut texts = lock(&self.0);
        texts.retain(|(known, _)| known != sha);
        texts.push_back((sha.to_owned(), text.into()));
        let mut bytes: usize = texts.iter().map(|(_, text)| text.len()).sum();
        while bytes > BUDGET && texts.len() > 1 {
            bytes -= texts.pop_front().map_or(0, |(_, text)| text.len());
        }
    }

    /// Returns the text with this hash.
    pub(super) fn get(&self, sha: &str) -> Option<Arc<str>> {
        lock(&self.0).iter().find(|(known, _)| known == sha).map(|(_, text)| text.clone())
    }
}
