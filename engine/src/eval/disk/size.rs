//! How much the cache on disk holds, and what goes when that is too much.
use super::DiskCache;
use crate::eval::Shelf;
use crate::picture::remove_stale_temporaries;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// How much a cache holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct DiskUse {
    /// Entries.
    pub entries: u64,
    /// Bytes.
    pub bytes: u64,
}

impl DiskCache {
    fn entries(&self) -> Vec<(SystemTime, u64, PathBuf)> {
        let list = |dir: &Path| fs::read_dir(dir).into_iter().flatten().flatten();
        let mut entries = Vec::new();
        for shelf in Shelf::ALL {
            for fan in list(&self.dir.join(shelf.name())) {
                let mut temporary = false;
                for entry in list(&fan.path()) {
                    if entry.file_name().as_encoded_bytes().starts_with(b".") {
                        temporary = true;
                        continue;
                    }
                    let Ok(meta) = entry.metadata() else { continue };
                    let time = meta.modified().unwrap_or(SystemTime::UNIX_EPOCH);
                    entries.push((time, meta.len(), entry.path()));
                }
                if temporary {
                    let _ = remove_stale_temporaries(&fan.path());
                }
            }
        }
        entries
    }

    /// How much it holds.
    pub fn usage(&self) -> DiskUse {
        let entries = self.entries();
        DiskUse { entries: entries.len() as u64, bytes: entries.iter().map(|e| e.1).sum() }
    }

    /// Removes what has not been used for longest until no more than `bound` bytes are left.
    pub(super) fn trim_to(&self, bound: u64) {
        let mut entries = self.entries();
        let mut total: u64 = entries.iter().map(|e| e.1).sum();
        if total <= bound {
            return;
        }
        entries.sort();
        // Some more than needed, so that it is not done again after the next entry.
        for (_, bytes, path) in entries {
            if total <= bound / 10 * 9 {
                break;
            }
            if fs::remove_file(&path).is_ok() {
                total -= bytes;
            }
        }
    }

    /// Removes everything, and says how much that was.
    pub fn clear(&self) -> DiskUse {
        let usage = self.usage();
        self.trim_to(0);
        usage
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{open, put};
    use super::*;
    use crate::eval::Store;

    #[test]
    fn stays_below_its_bound() {
        let dir = tempfile::tempdir().unwrap();
        let cache = open(dir.path(), 10_000);
        (0..40).for_each(|i| put(&cache, Shelf::Tiles, &i.to_string(), &[0; 1000]));
        cache.tidy();
        assert!(cache.usage().bytes <= 10_000);
        assert!(cache.usage().entries > 0);
    }
}
