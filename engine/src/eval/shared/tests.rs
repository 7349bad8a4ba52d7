//! Tests of a shared store with remotes that misbehave.
use super::*;
use std::collections::HashMap;

/// A remote in memory with configurable failures.
#[derive(Default)]
struct Fake {
    held: Mutex<HashMap<String, Vec<u8>>>,
    asked: Mutex<u32>,
    how: Mutex<How>,
}

#[derive(Clone, Copy, Default, PartialEq)]
enum How {
    #[default]
    Well,
    Failing(Trouble),
    Slow,
    Cut,
    Lying,
    ReadOnly,
}

impl Remote for Arc<Fake> {
    fn get(&self, name: &str, _most: u64, within: Duration) -> Result<Option<Vec<u8>>, Trouble> {
        *self.asked.lock().unwrap() += 1;
        let found = self.held.lock().unwrap().get(name).cloned();
        let how = *self.how.lock().unwrap();
        match how {
            How::Well | How::ReadOnly => Ok(found),
            How::Failing(trouble) => Err(trouble),
            How::Slow => {
                std::thread::sleep(within);
                Err(Trouble::Slow)
            }
            How::Cut => Ok(found.map(|bytes| bytes[..bytes.len() / 2].to_vec())),
            How::Lying => Ok(Some(vec![7; 1000])),
        }
    }

    fn put(&self, name: &str, bytes: Vec<u8>, within: Duration) -> Result<(), Trouble> {
        let how = *self.how.lock().unwrap();
        match how {
            How::Failing(trouble) => return Err(trouble),
            How::ReadOnly => return Err(Trouble::Denied),
            How::Slow => {
                std::thread::sleep(within);
                return Err(Trouble::Slow);
            }
            How::Well | How::Cut | How::Lying => {}
        }
        self.held.lock().unwrap().insert(name.to_owned(), bytes);
        Ok(())
    }
}

fn key(word: &str) -> Key {
    Key::of("test", &[word.as_bytes()])
}

fn seal() -> Seal {
    Seal::new(key("build"))
}

fn store(fake: &Arc<Fake>, seal: Seal) -> SharedStore {
    SharedStore::new(Box::new(fake.clone()), seal)
}

fn put(store: &SharedStore, word: &str) {
    store.put(Shelf::Objects, key(word), word.as_bytes(), COSTLY, &|| false);
    store.finish();
}

fn get(store: &SharedStore, word: &str) -> Option<Vec<u8>> {
    store.get(Shelf::Objects, key(word))
}

#[test]
fn reads_entries_of_other_machines() {
    let fake = Arc::new(Fake::default());
    let (a, b) = (store(&fake, seal()), store(&fake, seal()));
    put(&a, "one");
    assert_eq!(get(&b, "one").unwrap(), b"one");
    assert_eq!(get(&b, "two"), None);
    assert_eq!((a.trouble(), b.trouble()), (None, None));
    // Quickly computed results and tiles are not shared.
    a.put(Shelf::Objects, key("cheap"), b"cheap", Duration::from_millis(1), &|| false);
    a.put(Shelf::Tiles, key("tile"), b"tile", Duration::from_secs(9), &|| false);
    a.finish();
    assert_eq!(fake.held.lock().unwrap().len(), 1);
}

#[test]
fn accepts_only_entries_with_the_same_secret() {
    let fake = Arc::new(Fake::default());
    let seals = [seal(), seal().keyed(b"one"), seal().keyed(b"two")];
    let stores = seals.map(|seal| store(&fake, seal));
    for (i, writer) in stores.iter().enumerate() {
        put(writer, "word");
        let names: Vec<String> = fake.held.lock().unwrap().keys().cloned().collect();
        let own = writer.name(Shelf::Objects, key("word"));
        assert!(names.contains(&own));
        for (j, reader) in stores.iter().enumerate() {
            // Fails even under the name that the reader looks up.
            let bytes = fake.held.lock().unwrap()[&own].clone();
            let place = reader.name(Shelf::Objects, key("word"));
            let before = fake.held.lock().unwrap().insert(place.clone(), bytes.clone());
            assert_eq!(get(reader, "word").is_some(), i == j, "{i} {j}");
            assert_eq!(seals[j].check(&place, &bytes) == Checked::Whole, i == j, "{i} {j}");
            match before {
                Some(bytes) => fake.held.lock().unwrap().insert(place, bytes),
                None => fake.held.lock().unwrap().remove(&place),
            };
        }
    }
    assert!(!format!("{:?}", seals[1]).contains("secret: Some([") && seals[1] != seals[2]);
}

#[test]
fn stops_using_a_failing_store_and_reports_it() {
    let cases = [
        (How::Failing(Trouble::Gone), Trouble::Gone, 3),
        (How::Failing(Trouble::Failed), Trouble::Failed, 3),
        (How::Failing(Trouble::Denied), Trouble::Denied, 3),
        (How::Slow, Trouble::Slow, 2),
        (How::Cut, Trouble::Wrong, 3),
        (How::Lying, Trouble::Wrong, 3),
    ];
    for (how, trouble, times) in cases {
        let fake = Arc::new(Fake::default());
        put(&store(&fake, seal()), "word");
        *fake.how.lock().unwrap() = how;
        let bad = store(&fake, seal());
        (0..20).for_each(|_| assert_eq!(get(&bad, "word"), None));
        assert_eq!(*fake.asked.lock().unwrap(), times, "{trouble:?}");
        assert_eq!(bad.trouble(), Some((trouble, times)));
        assert!(bad.shared.tally().lost <= MOST_LOST + PATIENCE);
    }
}

#[test]
fn overwrites_damaged_entries() {
    let fake = Arc::new(Fake::default());
    let one = store(&fake, seal());
    put(&one, "word");
    fake.held.lock().unwrap().values_mut().for_each(|bytes| bytes[1] ^= 1);
    assert_eq!(get(&one, "word"), None);
    put(&one, "word");
    assert_eq!(get(&one, "word").unwrap(), b"word");
}

#[test]
fn reads_a_store_that_denies_writes() {
    let fake = Arc::new(Fake::default());
    put(&store(&fake, seal()), "word");
    *fake.how.lock().unwrap() = How::ReadOnly;
    let reader = store(&fake, seal());
    put(&reader, "other");
    assert_eq!(get(&reader, "word").unwrap(), b"word");
    assert_eq!(reader.trouble(), Some((Trouble::Denied, 1)));
}
