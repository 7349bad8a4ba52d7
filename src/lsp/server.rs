//! State of the server.
use super::answer::Refusal;
use super::checker::Job;
use super::options::Options;
use super::pages::Pages;
use super::pictures::Painter;
use super::text::{Encoding, Lines};
use super::uris;
use lsp_server::{ErrorCode, Message, Notification, Request, RequestId};
use lsp_types::Uri;
use serde::de::DeserializeOwned;
use serde_json::Value as Json;
use shibo_ide::{Cx, File, Workspace, World};
use std::collections::{BTreeMap, HashSet};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex};
use std::time::Instant;

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
    pub(super) out: Box<dyn Fn(Message)>,
    pub(super) cancelled: Cancelled,
    pub(super) refreshed: Instant,
    pub(super) stopping: bool,
    next: i32,
}

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

    pub(super) fn check(&self, job: Job) {
        // Without the checker thread there are no diagnostics, but everything else works.
        let _ = self.checker.send(job);
    }

    /// Stores the text of an open file.
    pub(super) fn set(&mut self, uri: Uri, version: i32, text: String) {
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
