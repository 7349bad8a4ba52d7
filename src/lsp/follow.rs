//! Followed graphs: their pages show the texts of the editor as they are typed, and hand their changes to the editor.
use super::event::{Event, Jump, PageEdit};
use super::http::{self, Answer, Failure};
use super::pages::Pages;
use crate::serve::LONGEST_TEXT;
use lsp_types::MessageType;
use serde_json::{Value as Json, json};
use shibo_ide::server::Job;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::net::{Shutdown, TcpStream};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

/// Time in which keystrokes become one text.
const REST: Duration = Duration::from_millis(12);
/// Time that the editor gets to change its text.
const PATIENCE: Duration = Duration::from_secs(8);
/// Status with which the page refuses the texts of a session that has ended.
const GONE: u16 = 409;

/// A followed graph.
struct Session {
    number: u64,
    /// Receives the files whose texts have changed.
    due: Sender<PathBuf>,
    /// Connection on which the page sends its changes; the page shows the files again when it is closed.
    connection: TcpStream,
}

#[derive(Default)]
struct Inner {
    /// Texts open in the editor.
    open: BTreeMap<PathBuf, Arc<str>>,
    sessions: BTreeMap<PathBuf, Session>,
    /// Number of the last session.
    last: u64,
}

/// The followed graphs.
#[derive(Clone)]
pub(super) struct Follower {
    events: Sender<Event>,
    pages: Pages,
    inner: Arc<Mutex<Inner>>,
}

impl Follower {
    /// Starts without followed graphs.
    pub(super) fn new(events: Sender<Event>, pages: Pages) -> Self {
        Self { events, pages, inner: Arc::default() }
    }

    fn lock(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn say(&self, kind: MessageType, text: impl Into<String>) {
        let _ = self.events.send(Event::Jump(Jump::Say(kind, text.into())));
    }

    /// Returns whether a graph is followed.
    pub(super) fn follows(&self, path: &Path) -> bool {
        self.lock().sessions.contains_key(path)
    }

    /// Takes note of a text that was opened, changed or closed.
    pub(super) fn note(&self, job: &Job) {
        let mut inner = self.lock();
        let path = match job {
            Job::Text { file, .. } => {
                inner.open.insert(file.path.clone(), file.text.clone());
                &file.path
            }
            Job::Close(path) => {
                inner.open.remove(path);
                inner.sessions.remove(path).iter().for_each(Session::close);
                path
            }
            Job::Roots(_) => return,
        };
        for session in inner.sessions.values() {
            let _ = session.due.send(path.clone());
        }
    }

    /// Ends all sessions.
    pub(super) fn stop(&self) {
        std::mem::take(&mut self.lock().sessions).values().for_each(Session::close);
    }

    /// Ends the session of a graph.
    pub(super) fn unfollow(&self, path: &Path) {
        let session = self.lock().sessions.remove(path);
        let name = name(path);
        match session {
            Some(session) => {
                session.close();
                self.say(MessageType::INFO, format!("the page shows the saved file of `{name}` again"));
            }
            None => self.say(MessageType::INFO, format!("no page follows `{name}`")),
        }
    }

    /// Follows a graph until the session ends: its page shows the open texts.
    pub(super) fn follow(&self, path: &Path) {
        let name = name(path);
        if self.follows(path) {
            self.say(MessageType::INFO, format!("the page follows `{name}` already"));
            return;
        }
        let Some(url) = self.pages.find(path) else {
            let start = format!("start it with `shibo watch {}`, then follow again", path.display());
            self.say(MessageType::WARNING, format!("no page shows `{name}`: {start}"));
            return;
        };
        self.pages.hear(&url);
        let answer = match http::open(&url, "POST", "follow", &json!({ "graph": path }).to_string()) {
            Ok(answer) => answer,
            Err(failure) => {
                let why = match failure {
                    Failure::Silent => "the page does not answer".to_owned(),
                    Failure::Refused(_, why) => why,
                };
                self.say(MessageType::ERROR, format!("`{name}` cannot be followed: {why}"));
                return;
            }
        };
        let Ok(connection) = answer.get_ref().try_clone() else { return };
        let (due, wanted) = channel();
        let number = {
            let mut inner = self.lock();
            inner.open.keys().for_each(|path| drop(due.send(path.clone())));
            inner.last += 1;
            let number = inner.last;
            inner.sessions.insert(path.to_owned(), Session { number, due, connection });
            number
        };
        let why = self.serve(answer, (&url, path), wanted);
        let mut inner = self.lock();
        if inner.sessions.get(path).is_some_and(|session| session.number == number) {
            inner.sessions.remove(path);
            drop(inner);
            let why = why.unwrap_or_else(|| "`shibo watch` has ended".to_owned());
            self.say(MessageType::WARNING, format!("`{name}` is no longer followed: {why}"));
        }
    }

    /// Hears the page until the session ends; returns the reason that the page gives.
    fn serve(&self, answer: Answer, (url, graph): (&str, &Path), wanted: Receiver<PathBuf>) -> Option<String> {
        let (mut why, mut wanted, mut id) = (None, Some(wanted), Json::Null);
        http::listen(answer, |kind, data| {
            match kind {
                "begin" => {
                    id = data["id"].clone();
                    if let Some(wanted) = wanted.take() {
                        let (follower, url, id) = (self.clone(), url.to_owned(), id.clone());
                        thread::spawn(move || follower.send(&url, &id, &wanted));
                        self.say(MessageType::INFO, format!("the page shows `{}` as you type", name(graph)));
                    }
                }
                "edit" => {
                    let why = self.edit(graph, data).err();
                    let answer = json!({ "id": id, "number": data["number"], "why": why });
                    let _ = http::post(url, "follow/answer", &answer);
                }
                "end" => why = data["why"].as_str().map(str::to_owned),
                _ => {}
            }
            true
        });
        why
    }

    /// Lets the editor make a change of the page.
    fn edit(&self, graph: &Path, data: &Json) -> Result<(), String> {
        let text = |key: &str| data[key].as_str().unwrap_or_default().to_owned();
        let (answer, done) = channel();
        let edit = PageEdit { path: graph.to_owned(), base: text("base"), text: text("text"), answer };
        let gone = || "the editor does not answer".to_owned();
        self.events.send(Event::Edit(edit)).map_err(|_| gone())?;
        done.recv_timeout(PATIENCE).map_err(|_| gone())?
    }

    /// Sends the newest texts until the session ends.
    fn send(&self, url: &str, id: &Json, wanted: &Receiver<PathBuf>) {
        let mut told = BTreeSet::new();
        while let Ok(first) = wanted.recv() {
            thread::sleep(REST);
            let due: BTreeSet<PathBuf> = std::iter::once(first).chain(wanted.try_iter()).collect();
            for path in due {
                let open = self.lock().open.get(&path).cloned();
                // A text that is saved is that of the file.
                let text = open.filter(|text| fs::read(&path).map_or(true, |saved| saved != text.as_bytes()));
                let long = text.as_ref().is_some_and(|text| text.len() > LONGEST_TEXT);
                let text = text.filter(|_| !long);
                let sent = http::post(url, "follow/text", &json!({ "id": id, "file": path, "text": text }));
                let why = match sent {
                    Ok(_) if long => format!("it has more than {} KiB", LONGEST_TEXT >> 10),
                    Ok(_) => {
                        told.remove(&path);
                        continue;
                    }
                    // The session has ended, and its connection says why.
                    Err(Failure::Silent | Failure::Refused(GONE, _)) => return,
                    Err(Failure::Refused(_, why)) => why,
                };
                if told.insert(path.clone()) {
                    self.say(
                        MessageType::WARNING,
                        format!("the page shows the saved file of `{}`: {why}", name(&path)),
                    );
                }
            }
        }
    }
}

impl Session {
    fn close(&self) {
        let _ = self.connection.shutdown(Shutdown::Both);
    }
}

/// Name of a file for messages.
fn name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}
