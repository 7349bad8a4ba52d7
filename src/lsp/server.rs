//! State of the server, and the order in which it handles messages.
use super::checker::Job;
use super::commands::Pages;
use super::pictures::Painter;
use super::text::{Encoding, Lines, changed};
use super::{answers, uris};
use lsp_server::{ErrorCode, Message, Notification, Request, RequestId, Response};
use lsp_types::{
    DidChangeTextDocumentParams, DidChangeWorkspaceFoldersParams, DidCloseTextDocumentParams,
    DidOpenTextDocumentParams, Uri,
};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::Value as Json;
use shibo_ide::inlay::InlayKinds;
use shibo_ide::{Cx, File, Workspace, World, identity};
use std::collections::{BTreeMap, HashSet};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Time for which the known state of the disk is trusted.
const BELIEVED: Duration = Duration::from_millis(300);

/// Settings of the editor.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Options {
    /// Inlay hints to show.
    pub(super) inlay_hints: InlayKinds,
    /// Form of pictures in hovers.
    pub(super) pictures: PictureForm,
    /// Shows actions above outputs and nodes.
    pub(super) code_lens: Option<bool>,
}

/// Form of pictures in hovers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) enum PictureForm {
    /// Address of a file.
    #[default]
    File,
    /// Data in the text itself.
    Data,
    /// No pictures.
    None,
}

/// Event for the main loop.
pub(super) enum Event {
    /// A message of the editor.
    Message(Message),
    /// A message of a thread, such as a click on a node of a page.
    Jump(super::commands::Jump),
    /// The connection to the editor is closed.
    Gone,
}

/// A text open in the editor.
pub(super) struct Document {
    /// The editor's address of the file.
    pub(super) uri: Uri,
    version: i32,
    /// The parsed text.
    pub(super) file: Arc<File>,
    /// Its lines.
    pub(super) lines: Lines,
}

/// Requests that the editor has cancelled.
pub(super) type Cancelled = Arc<Mutex<HashSet<RequestId>>>;

/// The server.
pub(super) struct Server {
    pub(super) workspace: Workspace,
    pub(super) encoding: Encoding,
    pub(super) options: Options,
    pub(super) documents: BTreeMap<String, Document>,
    pub(super) painter: Painter,
    pub(super) pages: Pages,
    pub(super) client: super::Client,
    checker: Sender<Job>,
    out: Box<dyn Fn(Message)>,
    cancelled: Cancelled,
    refreshed: Instant,
    stopping: bool,
    next: i32,
}

/// Reason why a request has no answer: code and message.
pub(super) struct Refusal(pub(super) ErrorCode, pub(super) String);

impl Refusal {
    /// A failure with a reason for the user.
    pub(super) fn because(reason: impl Into<String>) -> Self {
        Self(ErrorCode::RequestFailed, reason.into())
    }
}

/// Answer to a request.
pub(super) type Answer = Result<Json, Refusal>;

/// Dependencies of a server.
pub(super) struct ServerParts {
    pub(super) workspace: Workspace,
    pub(super) encoding: Encoding,
    pub(super) options: Options,
    pub(super) painter: Painter,
    pub(super) pages: Pages,
    pub(super) client: super::Client,
    pub(super) checker: Sender<Job>,
    pub(super) cancelled: Cancelled,
}

impl Server {
    /// Creates a server that answers through `out`.
    pub(super) fn new(parts: ServerParts, out: impl Fn(Message) + 'static) -> Self {
        let ServerParts { workspace, encoding, options, painter, pages, client, checker, cancelled } = parts;
        Self {
            workspace,
            encoding,
            options,
            documents: BTreeMap::new(),
            painter,
            pages,
            client,
            checker,
            out: Box::new(out),
            cancelled,
            refreshed: Instant::now(),
            stopping: false,
            next: 0,
        }
    }

    /// Answers until the editor ends the session; returns whether it ended properly.
    pub(super) fn run(&mut self, events: &Receiver<Event>) -> bool {
        for event in events {
            match event {
                Event::Message(Message::Request(request)) => self.request(request),
                Event::Message(Message::Notification(note)) if note.method == "exit" => return self.stopping,
                Event::Message(Message::Notification(note)) => self.safely(|server| server.notification(note)),
                Event::Message(Message::Response(_)) => {}
                Event::Jump(jump) => self.safely(|server| server.jump(&jump)),
                Event::Gone => return self.stopping,
            }
        }
        self.stopping
    }

    /// Does work without an answer. A panic is logged in the editor and affects nothing else.
    fn safely(&mut self, work: impl FnOnce(&mut Self)) {
        let _ = catch_unwind(AssertUnwindSafe(|| work(self)));
    }

    /// Sends a request whose answer is ignored.
    pub(super) fn ask(&mut self, method: &str, params: impl serde::Serialize) {
        self.next += 1;
        let request = Request::new(RequestId::from(self.next), method.to_owned(), params);
        (self.out)(Message::Request(request));
    }

    /// Sends a notification to the editor.
    pub(super) fn tell(&self, method: &str, params: impl serde::Serialize) {
        (self.out)(Message::Notification(Notification::new(method.to_owned(), params)));
    }

    fn request(&mut self, request: Request) {
        let id = request.id.clone();
        let cancelled = self.cancelled.lock().unwrap_or_else(PoisonError::into_inner).remove(&id);
        let response = if cancelled {
            Response::new_err(id, ErrorCode::RequestCanceled as i32, "cancelled".to_owned())
        } else if self.stopping {
            Response::new_err(id, ErrorCode::InvalidRequest as i32, "the server is shutting down".to_owned())
        } else if request.method == "shutdown" {
            self.stopping = true;
            Response::new_ok(id, Json::Null)
        } else {
            if self.refreshed.elapsed() > BELIEVED {
                self.workspace.refresh();
                self.refreshed = Instant::now();
            }
            // A panic in one answer must not affect other answers.
            let answer = catch_unwind(AssertUnwindSafe(|| answers::answer(self, &request.method, request.params)));
            match answer {
                Ok(Ok(answer)) => Response::new_ok(id, answer),
                Ok(Err(Refusal(code, reason))) => Response::new_err(id, code as i32, reason),
                Err(_) => {
                    let message = format!("the server has a defect in `{}`", request.method);
                    Response::new_err(id, ErrorCode::InternalError as i32, message)
                }
            }
        };
        (self.out)(Message::Response(response));
    }

    fn notification(&mut self, note: Notification) {
        let Notification { method, params } = note;
        match method.as_str() {
            "textDocument/didOpen" => {
                if let Some(DidOpenTextDocumentParams { text_document: doc }) = read(params) {
                    self.set(doc.uri, doc.version, doc.text);
                }
            }
            "textDocument/didChange" => {
                if let Some(DidChangeTextDocumentParams { text_document: doc, content_changes }) = read(params) {
                    // A change of a text that is not open is ignored.
                    let Some(open) = self.documents.get(doc.uri.as_str()) else { return };
                    let text = changed(&open.file.text, content_changes, self.encoding);
                    self.set(open.uri.clone(), doc.version, text);
                }
            }
            "textDocument/didClose" => {
                if let Some(DidCloseTextDocumentParams { text_document }) = read(params)
                    && let Some(document) = self.documents.remove(text_document.uri.as_str())
                {
                    self.workspace.close(&document.file.path);
                    self.check(Job::Close(document.file.path.clone()));
                }
            }
            "workspace/didChangeConfiguration" => {
                if let Some(options) = read(params["settings"]["shibo"].clone()) {
                    self.options = options;
                    self.painter.set_form(self.options.pictures);
                }
            }
            "workspace/didChangeWatchedFiles" | "textDocument/didSave" => self.workspace.rescan(),
            "workspace/didChangeWorkspaceFolders" => {
                if let Some(DidChangeWorkspaceFoldersParams { event }) = read(params) {
                    let gone: Vec<PathBuf> = event.removed.iter().map(|f| identity(&uris::path(&f.uri))).collect();
                    let mut roots: Vec<PathBuf> = self.workspace.roots().to_vec();
                    roots.retain(|root| !gone.contains(root));
                    roots.extend(event.added.iter().map(|folder| identity(&uris::path(&folder.uri))));
                    self.workspace.set_roots(roots.clone());
                    self.check(Job::Roots(roots));
                }
            }
            _ => {}
        }
    }

    fn check(&self, job: Job) {
        // Without the checker thread there are no diagnostics, but everything else works.
        let _ = self.checker.send(job);
    }

    /// Stores the text of an open file.
    fn set(&mut self, uri: Uri, version: i32, text: String) {
        let file = self.workspace.open(&uris::path(&uri), text);
        let lines = Lines::new(file.text.clone(), self.encoding);
        self.check(Job::Text { uri: uri.clone(), version, file: file.clone() });
        self.documents.insert(uri.as_str().to_owned(), Document { uri, version, file, lines });
    }

    /// An open file.
    pub(super) fn document(&self, uri: &Uri) -> Result<&Document, Refusal> {
        let missing = || Refusal(ErrorCode::InvalidParams, format!("`{}` is not open", uri.as_str()));
        self.documents.get(uri.as_str()).ok_or_else(missing)
    }

    /// A file and its world.
    pub(super) fn cx<'a>(&'a self, document: &'a Document) -> Cx<'a> {
        Cx { world: &self.workspace, file: &document.file }
    }

    /// The editor's address of a file if it is open, else one derived from the path; and the version.
    pub(super) fn address(&self, path: &std::path::Path) -> Option<(Uri, Option<i32>)> {
        let open = self.documents.values().find(|document| document.file.path == path);
        match open {
            Some(document) => Some((document.uri.clone(), Some(document.version))),
            None => uris::uri(path).map(|uri| (uri, None)),
        }
    }

    /// Lines of a file, open or on disk.
    pub(super) fn lines(&self, path: &std::path::Path) -> Option<Lines> {
        Some(Lines::new(self.workspace.file(path)?.text.clone(), self.encoding))
    }
}

/// Parses the parameters of a message; `None` if they are malformed.
pub(super) fn read<T: DeserializeOwned>(params: Json) -> Option<T> {
    serde_json::from_value(params).ok()
}
