//! Pictures for hovers: of kinds, nodes and picture files. A thread makes them when first requested; that request does
//! not wait, and the next one shows the picture.
mod draw;
mod sketch;

use crate::environment;
use crate::open;
use draw::Studio;
use sha2::{Digest, Sha256};
use shibo_bridge::write;
use shibo_engine::eval::CancelToken;
use shibo_ide::hover::{Evaluated, Pictures};
use shibo_ide::server::{PictureForm, uris};
use shibo_ide::{Workspace, World};
use std::collections::{BTreeMap, HashMap};
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::SystemTime;

/// Maximum number of pictures kept.
const KEPT: usize = 400;

/// Subject of a picture.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) enum Subject {
    /// A kind.
    Kind(String),
    /// A node, or `node.port`, of a graph file.
    Node(PathBuf, String),
    /// A picture file with its modification time.
    File(PathBuf, Option<SystemTime>),
}

/// A request: its subject, and for a node the text of its file and of the other open files.
pub(super) struct Wish {
    subject: Subject,
    text: Option<Arc<str>>,
    open: BTreeMap<PathBuf, Arc<str>>,
}

impl Wish {
    /// A request that needs no text.
    fn new(subject: Subject) -> Self {
        Self { subject, text: None, open: BTreeMap::new() }
    }
}

/// Result: a PNG and a short description.
#[derive(Clone, Debug, Default)]
pub(super) struct Made {
    png: Option<Vec<u8>>,
    about: String,
}

/// Cached result for a text.
struct Known {
    text: Option<Arc<str>>,
    shown: Evaluated,
}

#[derive(Default)]
struct Shared {
    known: HashMap<Subject, Known>,
    /// Requests that wait.
    pending: HashMap<Subject, Option<Arc<str>>>,
    form: PictureForm,
    /// Cancels the node picture being made.
    current: Option<CancelToken>,
}

/// Makes the pictures.
pub(super) struct Painter {
    shared: Arc<Mutex<Shared>>,
    cache_dir: Option<PathBuf>,
    wishes: OnceLock<Sender<Wish>>,
}

fn lock(shared: &Mutex<Shared>) -> MutexGuard<'_, Shared> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Painter {
    /// Creates a painter without pictures.
    pub(super) fn new(cache_dir: Option<PathBuf>, form: PictureForm) -> Self {
        let shared = Shared { form, ..Shared::default() };
        let cache_dir = cache_dir.or_else(open::usual_cache_dir);
        Self { shared: Arc::new(Mutex::new(shared)), cache_dir, wishes: OnceLock::new() }
    }

    /// Sets the form in which the editor gets pictures.
    pub(super) fn set_form(&self, form: PictureForm) {
        let mut shared = lock(&self.shared);
        shared.form = form;
        shared.known.clear();
    }

    /// Pictures of a workspace.
    pub(super) fn of<'a>(&'a self, workspace: &'a Workspace) -> View<'a> {
        View { painter: self, workspace }
    }

    /// Returns the cached result; without one, requests it.
    fn ask(&self, wish: Wish) -> Option<Evaluated> {
        let mut shared = lock(&self.shared);
        if let Some(known) = shared.known.get(&wish.subject)
            && known.text == wish.text
        {
            return Some(known.shown.clone());
        }
        if shared.form == PictureForm::None && !matches!(wish.subject, Subject::Node(..)) {
            return None;
        }
        if shared.pending.get(&wish.subject) == Some(&wish.text) {
            return None;
        }
        shared.pending.insert(wish.subject.clone(), wish.text.clone());
        // The newest request is the one on screen, so the current one is cancelled.
        shared.current.iter().for_each(CancelToken::cancel);
        drop(shared);
        let wishes = self.wishes.get_or_init(|| {
            let (sender, wishes) = channel();
            let (shared, cache_dir) = (self.shared.clone(), self.cache_dir.clone());
            std::thread::spawn(move || work(&shared, cache_dir, &wishes));
            sender
        });
        let _ = wishes.send(wish);
        None
    }
}

/// Makes requested pictures, the newest first, until all senders are gone.
fn work(shared: &Mutex<Shared>, cache_dir: Option<PathBuf>, wishes: &Receiver<Wish>) {
    let mut studio = Studio::new(cache_dir);
    let mut waiting: Vec<Wish> = Vec::new();
    loop {
        if waiting.is_empty() {
            let Ok(wish) = wishes.recv() else { return };
            waiting.push(wish);
        }
        waiting.extend(wishes.try_iter());
        let Some(wish) = waiting.pop() else { continue };
        // A request for a newer text of the same file has replaced this one.
        if lock(shared).pending.get(&wish.subject) != Some(&wish.text) {
            continue;
        }
        let cancel = CancelToken::default();
        lock(shared).current = Some(cancel.clone());
        // After a panic the request has no picture; the panic is logged in the editor.
        let made = catch_unwind(AssertUnwindSafe(|| studio.make(&wish, &cancel))).unwrap_or_default();
        let cancelled = cancel.is_cancelled() && made.is_none();
        let mut now = lock(shared);
        now.current = None;
        if cancelled && waiting.len() < KEPT {
            // A cancelled request is tried again after the newer ones.
            waiting.insert(0, wish);
            drop(now);
            waiting.extend(wishes.try_iter());
            continue;
        }
        now.pending.remove(&wish.subject);
        let made = made.unwrap_or_default();
        let picture = made.png.and_then(|png| address(&png, now.form));
        if now.known.len() >= KEPT {
            now.known.clear();
        }
        let shown = Evaluated { picture, about: made.about };
        now.known.insert(wish.subject, Known { text: wish.text, shown });
    }
}

/// Address of a picture for use in Markdown.
fn address(png: &[u8], form: PictureForm) -> Option<String> {
    match form {
        PictureForm::None => None,
        PictureForm::Data => Some(format!("data:image/png;base64,{}", base64(png))),
        PictureForm::File => {
            let folder = environment::editor_dir();
            let hash: String = Sha256::digest(png).iter().take(10).map(|byte| format!("{byte:02x}")).collect();
            let path = folder.join(format!("{hash}.png"));
            if !path.exists() {
                write::whole_with_folders(&path, png).ok()?;
            }
            uris::uri(&path).map(|uri| uri.as_str().to_owned())
        }
    }
}

/// Encodes bytes in base 64.
pub(crate) fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let byte = |i: usize| u32::from(chunk.get(i).copied().unwrap_or_default());
        let word = byte(0) << 16 | byte(1) << 8 | byte(2);
        for i in 0..4 {
            let letter = LETTERS[(word >> (18 - 6 * i) & 63) as usize];
            out.push(if i <= chunk.len() { char::from(letter) } else { '=' });
        }
    }
    out
}

/// Pictures of one workspace, as hovers request them.
pub(super) struct View<'a> {
    painter: &'a Painter,
    workspace: &'a Workspace,
}

impl Pictures for View<'_> {
    fn kind(&self, kind: &str) -> Option<String> {
        self.painter.ask(Wish::new(Subject::Kind(kind.to_owned())))?.picture
    }

    fn node(&self, path: &Path, node: &str) -> Option<Evaluated> {
        let file = self.workspace.file(path)?;
        let open = self.workspace.texts();
        let subject = Subject::Node(path.to_owned(), node.to_owned());
        self.painter.ask(Wish { subject, text: Some(file.text.clone()), open })
    }

    fn node_in(&self, path: &Path, text: &str, node: &str) -> Option<Evaluated> {
        let subject = Subject::Node(path.to_owned(), node.to_owned());
        self.painter.ask(Wish { subject, text: Some(text.into()), open: self.workspace.texts() })
    }

    fn file(&self, path: &Path) -> Option<String> {
        let time = fs::metadata(path).and_then(|metadata| metadata.modified()).ok();
        self.painter.ask(Wish::new(Subject::File(path.to_owned(), time)))?.picture
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encodes_base64() {
        assert_eq!(
            [b"".as_slice(), b"f", b"fo", b"foo", b"foob"].map(base64),
            ["", "Zg==", "Zm8=", "Zm9v", "Zm9vYg=="]
        );
    }
}
