//! Texts that an editor sends as they are typed: the page shows them instead of the files. One editor at a time has a session.
use super::texts::sha256;
use serde_json::json;
use shibo_bridge::scene::lock;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::Duration;
use tokio::sync::mpsc::{UnboundedReceiver, UnboundedSender, unbounded_channel};

/// The most texts of a session.
const MOST: usize = 64;
/// The longest text of an editor in bytes. Editors send no longer ones.
pub(crate) const LONGEST_TEXT: usize = 128 << 10;
/// Time that the editor gets to make a change.
const PATIENCE: Duration = Duration::from_secs(10);

/// Texts by the paths of their files.
pub(crate) type TextsByPath = BTreeMap<PathBuf, Arc<str>>;

/// Message to the editor: its kind and its content.
pub(super) type Message = (&'static str, Arc<str>);

/// A change that the editor has been asked to make: its number, and the receiver of the result.
type Asked = (u64, Sender<Result<(), String>>);

/// Why a text is not taken.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Refused {
    /// The session has ended.
    Over,
    /// There are too many texts, or the text is too long.
    Large(String),
}

struct Session {
    id: String,
    /// Messages to the editor.
    out: UnboundedSender<Message>,
    texts: TextsByPath,
    asked: Option<Asked>,
    /// Number of the last change.
    last: u64,
}

/// The texts of the editor that follows the graph, if one does.
#[derive(Default)]
pub(crate) struct Buffers(Mutex<Option<Session>>);

impl Session {
    fn tell(&self, kind: &'static str, what: &serde_json::Value) {
        // An editor that is gone ends its session by itself.
        let _ = self.out.send((kind, what.to_string().into()));
    }
}

impl Buffers {
    /// Begins a session, which ends that of another editor; returns the messages to the editor.
    pub(super) fn begin(&self, id: String) -> UnboundedReceiver<Message> {
        let (out, messages) = unbounded_channel();
        let session = Session { id, out, texts: TextsByPath::new(), asked: None, last: 0 };
        session.tell("begin", &json!({ "id": session.id }));
        if let Some(old) = lock(&self.0).replace(session) {
            old.tell("end", &json!({ "why": "another editor follows it now" }));
        }
        messages
    }

    /// Ends a session, if it is still the present one.
    pub(super) fn end(&self, id: &str) -> bool {
        lock(&self.0).take_if(|session| session.id == id).is_some()
    }

    /// Ends the present session, and tells the editor the reason.
    pub(super) fn close(&self, why: &str) {
        if let Some(session) = lock(&self.0).take() {
            session.tell("end", &json!({ "why": why }));
        }
    }

    /// Sets the text of a file; without a text the file itself counts. Returns whether that is a change.
    pub(super) fn set(&self, id: &str, path: &Path, text: Option<Arc<str>>) -> Result<bool, Refused> {
        let mut present = lock(&self.0);
        let session = present.as_mut().filter(|session| session.id == id).ok_or(Refused::Over)?;
        let Some(text) = text else { return Ok(session.texts.remove(path).is_some()) };
        if text.len() > LONGEST_TEXT {
            return Err(Refused::Large(format!("a text has at most {} KiB", LONGEST_TEXT >> 10)));
        }
        if session.texts.len() >= MOST && !session.texts.contains_key(path) {
            return Err(Refused::Large(format!("at most {MOST} unsaved files are followed")));
        }
        let old = session.texts.insert(path.to_owned(), text.clone());
        Ok(old.as_ref() != Some(&text))
    }

    /// The texts; `None` if no editor follows.
    pub(crate) fn texts(&self) -> Option<TextsByPath> {
        lock(&self.0).as_ref().map(|session| session.texts.clone())
    }

    /// Forgets a text that has been saved, unless there is a newer one.
    pub(crate) fn forget(&self, path: &Path, saved: &str) {
        if let Some(session) = lock(&self.0).as_mut()
            && session.texts.get(path).is_some_and(|text| **text == *saved)
        {
            session.texts.remove(path);
        }
    }

    /// Asks the editor to change the text of the graph from `before` to `after`, and waits until it has.
    ///
    /// # Errors
    /// The reason why the text is not changed.
    pub(super) fn change(&self, path: &Path, before: &str, after: &str) -> Result<(), String> {
        let gone = || "the editor has stopped following".to_owned();
        let (sender, result) = channel();
        let id = {
            let mut present = lock(&self.0);
            let session = present.as_mut().ok_or_else(gone)?;
            session.last += 1;
            session.asked = Some((session.last, sender));
            session.tell("edit", &json!({ "number": session.last, "base": sha256(before), "text": after }));
            session.id.clone()
        };
        result.recv_timeout(PATIENCE).map_err(|error| match error {
            RecvTimeoutError::Timeout => "the editor does not answer".to_owned(),
            RecvTimeoutError::Disconnected => gone(),
        })??;
        // The editor sends the same text later, unless it has sent a newer one already.
        if let Some(session) = lock(&self.0).as_mut().filter(|session| session.id == id)
            && session.texts.get(path).is_none_or(|text| **text == *before)
        {
            session.texts.insert(path.to_owned(), after.into());
        }
        Ok(())
    }

    /// Takes the answer of the editor: the reason why it has not made a change, if it has not.
    pub(super) fn answer(&self, id: &str, number: u64, why: Option<String>) {
        let mut present = lock(&self.0);
        let session = present.as_mut().filter(|session| session.id == id);
        let asked = session.and_then(|session| session.asked.take_if(|(asked, _)| *asked == number));
        if let Some((_, sender)) = asked {
            let _ = sender.send(why.map_or(Ok(()), Err));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: &str = "/a/a.ron";

    fn set(buffers: &Buffers, id: &str, path: &str, text: &str) -> Result<bool, Refused> {
        buffers.set(id, Path::new(path), Some(text.into()))
    }

    #[test]
    fn the_newest_session_counts() {
        let buffers = Buffers::default();
        assert_eq!(set(&buffers, "1", A, "x"), Err(Refused::Over));
        let mut first = buffers.begin("1".into());
        assert_eq!(first.try_recv().unwrap().0, "begin");
        assert_eq!(set(&buffers, "1", A, "x"), Ok(true));
        assert_eq!(set(&buffers, "1", A, "x"), Ok(false));
        let mut second = buffers.begin("2".into());
        let (kind, why) = first.try_recv().unwrap();
        assert!(kind == "end" && why.contains("another editor"), "{why}");
        assert_eq!(set(&buffers, "1", A, "y"), Err(Refused::Over));
        assert_eq!(buffers.texts(), Some(TextsByPath::new()), "the texts end with their session");
        assert!(!buffers.end("1") && buffers.texts().is_some());
        assert!(buffers.end("2") && buffers.texts().is_none());
        assert!(second.try_recv().is_ok() && second.try_recv().is_err());
    }

    #[test]
    fn texts_are_bounded_and_forgotten_once_saved() {
        let buffers = Buffers::default();
        let _messages = buffers.begin("1".into());
        let large = |result| matches!(result, Err(Refused::Large(_)));
        assert!(large(set(&buffers, "1", A, &"x".repeat(LONGEST_TEXT + 1))));
        assert_eq!(set(&buffers, "1", A, &"x".repeat(LONGEST_TEXT)), Ok(true));
        (1..MOST).for_each(|i| assert_eq!(set(&buffers, "1", &format!("/{i}"), "x"), Ok(true)));
        assert!(large(set(&buffers, "1", "/more", "x")));
        assert_eq!(set(&buffers, "1", A, "y"), Ok(true));
        buffers.forget(Path::new(A), "x");
        assert_eq!(buffers.texts().unwrap().get(Path::new(A)).map(|text| &**text), Some("y"));
        buffers.forget(Path::new(A), "y");
        assert!(!buffers.texts().unwrap().contains_key(Path::new(A)));
    }

    #[test]
    fn changes_wait_for_the_editor() {
        let buffers = Buffers::default();
        assert!(buffers.change(Path::new(A), "old", "new").unwrap_err().contains("stopped following"));
        let mut messages = buffers.begin("1".into());
        messages.try_recv().unwrap();
        let mut change = |answer: &(dyn Fn(u64) + Sync)| {
            std::thread::scope(|scope| {
                let change = scope.spawn(|| buffers.change(Path::new(A), "old", "new"));
                let (kind, what) = messages.blocking_recv().unwrap();
                let what: serde_json::Value = serde_json::from_str(&what).unwrap();
                assert!(kind == "edit" && what["base"] == *sha256("old") && what["text"] == "new", "{what}");
                answer(what["number"].as_u64().unwrap());
                change.join().unwrap()
            })
        };
        // Answers to other changes and of other sessions do not count.
        let refused = change(&|number| {
            buffers.answer("1", number + 1, None);
            buffers.answer("0", number, None);
            buffers.answer("1", number, Some("no".into()));
        });
        assert_eq!(refused, Err("no".to_owned()));
        assert_eq!(buffers.texts(), Some(TextsByPath::new()));
        assert_eq!(change(&|number| buffers.answer("1", number, None)), Ok(()));
        assert_eq!(buffers.texts().unwrap().get(Path::new(A)).map(|text| &**text), Some("new"));
        // A newer text stays.
        assert_eq!(set(&buffers, "1", A, "old"), Ok(true));
        let typed = change(&|number| {
            assert_eq!(set(&buffers, "1", A, "newer"), Ok(true));
            buffers.answer("1", number, None);
        });
        assert_eq!(typed, Ok(()));
        assert_eq!(buffers.texts().unwrap().get(Path::new(A)).map(|text| &**text), Some("newer"));
        let gone = change(&|_| assert!(buffers.end("1")));
        assert!(gone.unwrap_err().contains("stopped following"));
    }
}
