//! Tests of the cache on disk: contents are returned complete, and damage is detected.
use super::*;

const NO_TIME: Duration = Duration::ZERO;

pub(super) fn key(word: &str) -> Key {
    Key::of("test", &[word.as_bytes()])
}

pub(super) fn open(dir: &Path, bound: u64) -> DiskCache {
    DiskCache::open(dir, bound, Seal::new(key("build"))).unwrap()
}

pub(super) fn put(cache: &DiskCache, shelf: Shelf, word: &str, content: &[u8]) {
    cache.put(shelf, key(word), content, NO_TIME, &|| false);
}

#[test]
fn returns_stored_content() {
    let dir = tempfile::tempdir().unwrap();
    let cache = open(dir.path(), 1 << 20);
    put(&cache, Shelf::Objects, "a", b"content");
    assert_eq!(cache.get(Shelf::Objects, key("a")).unwrap(), b"content");
    assert_eq!(cache.get(Shelf::Objects, key("b")), None);
    assert_eq!(cache.get(Shelf::Tiles, key("a")), None);
    cache.remove(Shelf::Objects, key("a"));
    assert_eq!(cache.get(Shelf::Objects, key("a")), None);
    put(&cache, Shelf::Tiles, "a", b"");
    assert_eq!(cache.get(Shelf::Tiles, key("a")).unwrap(), b"");
    assert_eq!(cache.clear().entries, 1);
    assert_eq!(cache.usage().entries, 0);
}

#[test]
fn removes_damaged_entries() {
    let dir = tempfile::tempdir().unwrap();
    let cache = open(dir.path(), 1 << 20);
    let path = cache.path(Shelf::Objects, key("a"));
    put(&cache, Shelf::Objects, "a", b"content");
    let good = fs::read(&path).unwrap();
    let damaged = (0..good.len()).map(|at| {
        let mut bytes = good.clone();
        bytes[at] ^= 1;
        bytes
    });
    let cut = (0..good.len()).map(|at| good[..at].to_vec());
    let longer = [[&good[..], b"x"].concat(), [b"x", &good[..]].concat(), [&good[..], &good[..]].concat()];
    for bytes in damaged.chain(cut).chain(longer) {
        fs::write(&path, &bytes).unwrap();
        assert_eq!(cache.get(Shelf::Objects, key("a")), None, "{bytes:?}");
        assert!(!path.exists());
    }
    fs::write(&path, &good).unwrap();
    assert_eq!(cache.get(Shelf::Objects, key("a")).unwrap(), b"content");
}

#[test]
fn rejects_entries_copied_to_another_place() {
    let dir = tempfile::tempdir().unwrap();
    let cache = open(dir.path(), 1 << 20);
    let other = DiskCache::open(dir.path(), 1 << 20, Seal::new(key("another build"))).unwrap();
    put(&cache, Shelf::Tiles, "a", b"content");
    let good = cache.path(Shelf::Tiles, key("a"));
    assert_eq!(other.get(Shelf::Tiles, key("a")), None);
    assert!(good.exists(), "another build's entries are left alone");
    let places = [
        (&cache, Shelf::Tiles, key("b")),
        (&cache, Shelf::Objects, key("a")),
        (&cache, Shelf::Files, key("a")),
        (&cache, Shelf::Channels, key("a")),
        (&other, Shelf::Tiles, key("a")),
    ];
    for (cache, shelf, key) in places {
        let path = cache.path(shelf, key);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::copy(&good, &path).unwrap();
        let to = dir.path().join("to");
        let found =
            if shelf == Shelf::Files { cache.get_file(key, &to).unwrap() } else { cache.get(shelf, key).is_some() };
        assert!(!found && !path.exists() && !to.exists(), "{shelf:?}");
    }
    assert_eq!(cache.get(Shelf::Tiles, key("a")).unwrap(), b"content");
}

#[test]
fn copies_files_completely_or_not_at_all() {
    let dir = tempfile::tempdir().unwrap();
    let cache = open(&dir.path().join("cache"), 1 << 20);
    let (from, to) = (dir.path().join("from"), dir.path().join("to"));
    fs::write(&from, vec![7; 300_000]).unwrap();
    cache.put_file(key("f"), &from, NO_TIME);
    assert!(cache.get_file(key("f"), &to).unwrap());
    assert_eq!(fs::read(&to).unwrap(), vec![7; 300_000]);
    let path = cache.path(Shelf::Files, key("f"));
    let mut bytes = fs::read(&path).unwrap();
    bytes[1000] = 8;
    fs::write(&path, bytes).unwrap();
    fs::write(&to, b"old").unwrap();
    assert!(!cache.get_file(key("f"), &to).unwrap());
    assert_eq!(fs::read(&to).unwrap(), b"old");
    // Ignores a source that cannot be read; reports a target that cannot be written.
    cache.put_file(key("g"), &dir.path().join("none"), NO_TIME);
    assert!(!cache.get_file(key("g"), &to).unwrap());
    cache.put_file(key("f"), &from, NO_TIME);
    assert!(cache.get_file(key("f"), &dir.path().join("none/to")).is_err());
}

#[test]
fn discards_stopped_writes() {
    let dir = tempfile::tempdir().unwrap();
    let cache = open(dir.path(), 1 << 30);
    let content: Vec<u8> = (0..3 * PART + 5).map(|i| u8::try_from(i % 251).unwrap()).collect();
    let asked = std::cell::Cell::new(0);
    cache.put(Shelf::Objects, key("a"), &content, NO_TIME, &|| {
        asked.set(asked.get() + 1);
        asked.get() > 2
    });
    assert_eq!((asked.get(), cache.get(Shelf::Objects, key("a")), cache.failures()), (3, None, 0));
    assert_eq!(cache.usage().entries, 0);
    put(&cache, Shelf::Objects, "a", &content);
    assert_eq!(cache.get(Shelf::Objects, key("a")).unwrap(), content);
}

#[test]
#[cfg(target_os = "linux")]
fn tolerates_other_files_in_place_of_entries() {
    let dir = tempfile::tempdir().unwrap();
    let cache = open(dir.path(), 1 << 20);
    let path = cache.path(Shelf::Objects, key("a"));
    // A folder in an entry's place: nothing can be stored there, and nothing fails.
    fs::create_dir_all(&path).unwrap();
    put(&cache, Shelf::Objects, "a", b"content");
    assert_eq!((cache.get(Shelf::Objects, key("a")), cache.failures()), (None, 1));
    fs::remove_dir(&path).unwrap();
    // A pipe without a writer.
    assert!(std::process::Command::new("mkfifo").arg(&path).status().unwrap().success());
    assert_eq!(cache.get(Shelf::Objects, key("a")), None);
    fs::remove_file(&path).unwrap();
    // A file larger than memory, with a seal that confirms its length.
    put(&cache, Shelf::Objects, "a", b"content");
    let seal = fs::read(&path).unwrap().split_off(7);
    let length = 1_u64 << 43;
    let file = File::create(&path).unwrap();
    file.set_len(length).unwrap();
    let mut file = fs::OpenOptions::new().append(true).open(&path).unwrap();
    file.write_all(&[&seal[..8], &length.to_ne_bytes(), &seal[16..]].concat()).unwrap();
    assert_eq!(cache.get(Shelf::Objects, key("a")), None);
    assert!(!path.exists());
    // A temporary file of another program stays.
    let folder = path.parent().unwrap();
    fs::write(folder.join(".x.4294967295.0.tmp"), "").unwrap();
    put(&cache, Shelf::Objects, "b", b"content");
    cache.tidy();
    assert!(folder.join(".x.4294967295.0.tmp").exists());
}
