//! Size of the cache on disk, and removal of old entries when it exceeds the bound.
use super::{DiskCache, folder};
use crate::picture::remove_stale_temporaries;
use std::fs;
use std::path::PathBuf;
use std::time::SystemTime;

/// Size of a cache.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct DiskUse {
    /// Entries.
    pub entries: u64,
    /// Size of all entries in bytes.
    pub bytes: u64,
}

impl DiskCache {
    /// The entries of a marked folder: files with names of entries, with time and size. Links do not count.
    fn entries(&self) -> Vec<(SystemTime, u64, PathBuf)> {
        let mut entries = Vec::new();
        if !folder::is_marked(&self.dir) {
            return entries;
        }
        for fan in folder::fans(&self.dir) {
            let mut temporary = false;
            for entry in fs::read_dir(&fan).into_iter().flatten().flatten() {
                let name = entry.file_name();
                let Some(name) = name.to_str() else { continue };
                temporary |= name.starts_with('.');
                // Metadata of the entry itself, not of a link's target.
                let file = entry.metadata().ok().filter(|meta| meta.is_file() && folder::is_entry(name));
                let Some(meta) = file else { continue };
                let time = meta.modified().unwrap_or(SystemTime::UNIX_EPOCH);
                entries.push((time, meta.len(), entry.path()));
            }
            if temporary {
                let _ = remove_stale_temporaries(&fan);
            }
        }
        entries
    }

    /// Counts the entries and their bytes.
    pub fn usage(&self) -> DiskUse {
        let entries = self.entries();
        DiskUse { entries: entries.len() as u64, bytes: entries.iter().map(|e| e.1).sum() }
    }

    /// Removes the least recently used entries until at most `bound` bytes are left.
    pub(super) fn trim_to(&self, bound: u64) {
        let mut entries = self.entries();
        let mut total: u64 = entries.iter().map(|e| e.1).sum();
        if total <= bound {
            return;
        }
        entries.sort();
        // Trim to 90 % of the bound, so that the next entry does not trigger this again.
        for (_, bytes, path) in entries {
            if total <= bound / 10 * 9 {
                break;
            }
            if fs::remove_file(&path).is_ok() {
                total -= bytes;
            }
        }
    }

    /// Removes all entries and returns how much they took.
    pub fn clear(&self) -> DiskUse {
        let usage = self.usage();
        self.trim_to(0);
        usage
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{key, open, put};
    use super::*;
    use crate::eval::{Seal, Shelf, Store};
    use std::path::Path;

    #[test]
    fn stays_below_its_bound() {
        let dir = tempfile::tempdir().unwrap();
        let cache = open(dir.path(), 10_000);
        (0..40).for_each(|i| put(&cache, Shelf::Tiles, &i.to_string(), &[0; 1000]));
        cache.tidy();
        assert!(cache.usage().bytes <= 10_000);
        assert!(cache.usage().entries > 0);
    }

    #[test]
    fn opens_marked_and_empty_folders_only() {
        let dir = tempfile::tempdir().unwrap();
        let path = |name: &str| dir.path().join(name);
        let seal = Seal::new(key("build"));
        let opened = |dir: &Path| DiskCache::open(dir, 1 << 20, seal).is_ok();
        fs::create_dir(path("empty")).unwrap();
        assert!(opened(&path("empty")) && opened(&path("new/cache")));
        assert!(opened(&path("empty")) && DiskCache::is_cache(&path("empty")), "it is marked now");
        // Folders that are no caches: with a file, or with the marker of another program.
        let tags = ["objects", "CACHEDIR.TAG", ".a", ".x.1.0.tmp"];
        for (number, name) in tags.into_iter().enumerate() {
            let other = path(&format!("other{number}"));
            fs::create_dir(&other).unwrap();
            fs::write(other.join(name), "Signature: 8a477f597d28d172789f06886806bc55\n# Of a compiler.\n").unwrap();
            let error = DiskCache::open(&other, 1 << 20, seal).unwrap_err().to_string();
            assert!(error.contains("not marked as a cache of shibo"), "{error}");
            DiskCache::adopt(&other);
            assert!(!opened(&other), "{name}");
            assert_eq!(fs::read_dir(&other).unwrap().count(), 1, "{name}");
        }
    }

    #[test]
    fn marks_old_caches_that_hold_nothing_but_entries() {
        let dir = tempfile::tempdir().unwrap();
        let cache = open(dir.path(), 1 << 20);
        put(&cache, Shelf::Tiles, "a", b"content");
        let entry = cache.path(Shelf::Tiles, key("a"));
        let tag = dir.path().join("CACHEDIR.TAG");
        let again = || DiskCache::open(dir.path(), 1 << 20, Seal::new(key("build")));
        fs::remove_file(&tag).unwrap();
        assert!(again().is_err(), "nobody said that it is a cache");
        assert_eq!((cache.clear().entries, entry.exists()), (0, true), "without the marker nothing is removed");
        for other in ["notes", "tiles/notes", "tiles/00/notes", "tiles/00/00000000000000000000000000000z"] {
            let other = dir.path().join(other);
            fs::create_dir_all(other.parent().unwrap()).unwrap();
            fs::write(&other, "mine").unwrap();
            DiskCache::adopt(dir.path());
            assert!(!tag.exists(), "{other:?}");
            fs::remove_file(other).unwrap();
        }
        fs::write(entry.with_file_name(".x.1.0.tmp"), "").unwrap();
        DiskCache::adopt(dir.path());
        assert_eq!(again().unwrap().get(Shelf::Tiles, key("a")).unwrap(), b"content");
    }

    #[test]
    fn removes_nothing_but_entries() {
        let dir = tempfile::tempdir().unwrap();
        let cache = open(&dir.path().join("cache"), 1 << 20);
        put(&cache, Shelf::Objects, "a", b"content");
        let entry = cache.path(Shelf::Objects, key("a"));
        let files =
            ["notes", "objects/notes", "objects/ab/notes", "objects/ab/0", "tiles/0/000000000000000000000000000000"];
        for file in files {
            let file = dir.path().join("cache").join(file);
            fs::create_dir_all(file.parent().unwrap()).unwrap();
            fs::write(file, "mine").unwrap();
        }
        assert_eq!(cache.clear().entries, 1);
        assert!(!entry.exists());
        put(&cache, Shelf::Objects, "a", b"content");
        cache.remove_all();
        assert!(files.iter().all(|file| dir.path().join("cache").join(file).exists()));
        assert!(dir.path().join("cache/CACHEDIR.TAG").exists(), "the folder is there, so it stays a cache");
        let whole = open(&dir.path().join("whole"), 1 << 20);
        put(&whole, Shelf::Objects, "a", b"content");
        whole.remove_all();
        assert!(!dir.path().join("whole").exists());
    }

    #[test]
    #[cfg(unix)]
    fn follows_no_links() {
        use std::os::unix::fs::symlink;
        let dir = tempfile::tempdir().unwrap();
        let cache = open(&dir.path().join("cache"), 1 << 20);
        put(&cache, Shelf::Objects, "a", b"content");
        put(&cache, Shelf::Tiles, "a", b"content");
        let of = |shelf: Shelf| dir.path().join("cache").join(shelf.name());
        // A shelf, or a folder of entries, is a link to another place.
        for (shelf, folder) in [
            (Shelf::Objects, of(Shelf::Objects)),
            (
                Shelf::Tiles,
                of(Shelf::Tiles).join(cache.path(Shelf::Tiles, key("a")).parent().unwrap().file_name().unwrap()),
            ),
        ] {
            let elsewhere = dir.path().join(shelf.name());
            fs::rename(&folder, &elsewhere).unwrap();
            symlink(&elsewhere, &folder).unwrap();
            let entry = cache.path(shelf, key("a"));
            assert!(entry.exists());
            assert_eq!(cache.get(shelf, key("a")), None);
            cache.remove(shelf, key("a"));
            put(&cache, shelf, "a", b"other");
            assert!(entry.exists() && fs::read(&entry).unwrap().starts_with(b"content"));
        }
        // An entry is a link to a file of the user.
        let entry = cache.path(Shelf::Files, key("a"));
        fs::create_dir_all(entry.parent().unwrap()).unwrap();
        fs::write(dir.path().join("mine"), "mine").unwrap();
        symlink(dir.path().join("mine"), &entry).unwrap();
        assert_eq!(cache.get(Shelf::Files, key("a")), None);
        assert_eq!(cache.clear(), DiskUse::default());
        assert!(fs::symlink_metadata(&entry).is_ok() && fs::read(dir.path().join("mine")).unwrap() == b"mine");
    }
}
