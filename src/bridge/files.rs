//! The files of pictures. A file exists until the next render of its slot is done, or until the other program frees it.
use serde_json::Value as Json;
use shibo_bridge::host::Message;
use shibo_bridge::scene::lock;
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use tempfile::TempDir;

/// The files of a slot by picture.
#[derive(Default)]
struct Slot {
    /// The newest file of each picture.
    files: BTreeMap<String, PathBuf>,
    /// Files that newer ones have replaced.
    replaced: Vec<PathBuf>,
    /// The pictures of the running render.
    seen: BTreeSet<String>,
}

/// All files, in a temporary folder.
pub(super) struct Files {
    folder: TempDir,
    slots: Mutex<(u64, BTreeMap<Option<String>, Slot>)>,
}

impl Files {
    pub(super) fn new() -> io::Result<Self> {
        Ok(Self { folder: tempfile::Builder::new().prefix("shibo-").tempdir()?, slots: Mutex::default() })
    }

    pub(super) fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// Completes a message of a job: samples become a file, and a picture that is the same has the file of before.
    pub(super) fn complete(&self, slot: Option<&str>, message: Message) -> io::Result<Json> {
        let Message { mut json, bytes, place } = message;
        let mut all = lock(&self.slots);
        let (count, slots) = &mut *all;
        let slot = slots.entry(slot.map(str::to_owned)).or_default();
        let Some(place) = place else { return Ok(json.into()) };
        slot.seen.insert(place.clone());
        if let Some(bytes) = bytes {
            *count += 1;
            let ending = json.get("as").and_then(Json::as_str).unwrap_or("bin");
            let path = self.folder.path().join(format!("{count}.{ending}"));
            std::fs::write(&path, bytes).inspect_err(|_| drop(std::fs::remove_file(&path)))?;
            slot.replaced.extend(slot.files.insert(place.clone(), path));
        } else if json.get("event").is_some_and(|event| event == "picture") {
            slot.replaced.extend(slot.files.remove(&place));
        }
        if let Some(path) = slot.files.get(&place) {
            json.insert("file".into(), path.display().to_string().into());
        }
        Ok(json.into())
    }

    /// Ends a render: if it is complete, removes the files of renders before. A render that was stopped removes nothing.
    pub(super) fn end(&self, slot: Option<&str>, is_complete: bool) {
        let mut all = lock(&self.slots);
        let Some(slot) = all.1.get_mut(&slot.map(str::to_owned)) else { return };
        let seen = std::mem::take(&mut slot.seen);
        if !is_complete || seen.is_empty() {
            return;
        }
        let gone: Vec<String> = slot.files.keys().filter(|place| !seen.contains(*place)).cloned().collect();
        slot.replaced.extend(gone.iter().filter_map(|place| slot.files.remove(place)));
        slot.replaced.drain(..).for_each(|path| drop(std::fs::remove_file(path)));
    }

    /// Removes files; returns the pictures of slots that have none now. A path that is no file of a picture is ignored.
    pub(super) fn free(&self, files: &[PathBuf]) -> Vec<(String, String)> {
        let mut freed = Vec::new();
        for (name, slot) in &mut lock(&self.slots).1 {
            slot.replaced.retain(|path| !files.contains(path) || std::fs::remove_file(path).is_err());
            slot.files.retain(|place, path| {
                let gone = files.contains(path);
                if gone {
                    let _ = std::fs::remove_file(path);
                    freed.extend(name.clone().map(|name| (name, place.clone())));
                }
                !gone
            });
        }
        freed
    }
}
