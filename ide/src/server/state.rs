//! State of the server.
use super::answer::Refusal;
use super::capabilities;
use super::checker::Job;
use super::client::Client;
use super::host::Host;
use super::options::Options;
use super::text::{Encoding, Lines};
use super::uris;
use crate::{Cx, File, Workspace, World, identity};
use lsp_server::{ErrorCode, Message, Notification, Request, RequestId};
use lsp_types::{InitializeParams, TextDocumentPositionParams, Uri};
use serde::de::DeserializeOwned;
use serde_json::{Value as Json, json};
use shibo_value::clock::Stopwatch;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

/// A text open in the editor.
pub(crate) struct Document {
    /// The editor's address of the file.
    pub(crate) uri: Uri,
    /// Version in the editor.
    pub(crate) version: i32,
    /// The parsed text.
    pub(crate) file: Arc<File>,
    /// Its lines.
    pub(crate) lines: Lines,
}

/// The parameters of the request `initialize`.
pub struct Beginning {
    pub(crate) client: Client,
    pub(crate) options: Options,
    /// The unit of columns.
    pub encoding: Encoding,
    /// The folders of the workspace.
    pub roots: Vec<PathBuf>,
}

impl Beginning {
    /// Reads the parameters; unknown ones are left out.
    pub fn new(params: Json) -> Self {
        let params: InitializeParams = serde_json::from_value(params).unwrap_or_default();
        let general = params.capabilities.general.as_ref();
        let options = params.initialization_options.clone();
        Self {
            client: Client::of(&params.capabilities),
            options: options.and_then(|options| serde_json::from_value(options).ok()).unwrap_or_default(),
            encoding: Encoding::negotiate(general.and_then(|general| general.position_encodings.as_deref())),
            roots: roots(&params),
        }
    }

    /// The form of pictures in hovers.
    pub fn pictures(&self) -> super::PictureForm {
        self.options.pictures
    }

    /// The answer to `initialize`.
    pub fn answer(&self, runs_commands: bool) -> Json {
        let info = json!({ "name": "shibo", "version": env!("CARGO_PKG_VERSION") });
        json!({ "capabilities": capabilities::capabilities(self.encoding, runs_commands), "serverInfo": info })
    }
}

/// Workspace folders of the editor.
fn roots(params: &InitializeParams) -> Vec<PathBuf> {
    let folders = params.workspace_folders.as_deref().unwrap_or_default().iter().map(|folder| &folder.uri);
    #[expect(deprecated, reason = "older editors tell only this")]
    let root = params.root_uri.as_ref();
    let mut roots: Vec<PathBuf> = folders.chain(root).map(|uri| identity(&uris::path(uri))).collect();
    roots.sort();
    roots.dedup();
    roots
}

/// The server. It answers messages one after the other, without threads.
pub struct Server {
    /// The files.
    pub workspace: Workspace,
    pub(crate) encoding: Encoding,
    pub(crate) options: Options,
    pub(crate) documents: BTreeMap<String, Document>,
    /// The capabilities of the editor.
    pub client: Client,
    /// The program that runs the server.
    pub host: Box<dyn Host>,
    pub(crate) refreshed: Stopwatch,
    pub(crate) stopping: bool,
    next: i32,
}

impl Server {
    /// A server for an editor.
    pub fn new(workspace: Workspace, beginning: Beginning, host: Box<dyn Host>) -> Self {
        let Beginning { client, options, encoding, .. } = beginning;
        Self {
            workspace,
            encoding,
            options,
            documents: BTreeMap::new(),
            client,
            host,
            refreshed: Stopwatch::wall(),
            stopping: false,
            next: 0,
        }
    }

    /// Returns whether the editor has asked for the end.
    pub fn is_stopping(&self) -> bool {
        self.stopping
    }

    /// Sends a request; returns its number, which the answer has too.
    pub fn ask(&mut self, method: &str, params: impl serde::Serialize) -> RequestId {
        self.next += 1;
        let id = RequestId::from(self.next);
        self.host.send(Message::Request(Request::new(id.clone(), method.to_owned(), params)));
        id
    }

    /// Sends a notification to the editor.
    pub fn tell(&self, method: &str, params: impl serde::Serialize) {
        self.host.send(Message::Notification(Notification::new(method.to_owned(), params)));
    }

    /// Stores the text of an open file.
    pub(crate) fn set(&mut self, uri: Uri, version: i32, text: String) {
        let file = self.workspace.open(&uris::path(&uri), text);
        let lines = Lines::new(file.text.clone(), self.encoding);
        self.host.check(Job::Text { uri: uri.clone(), version, file: file.clone() });
        self.documents.insert(uri.as_str().to_owned(), Document { uri, version, file, lines });
    }

    /// An open file.
    pub(crate) fn document(&self, uri: &Uri) -> Result<&Document, Refusal> {
        let missing = || Refusal(ErrorCode::InvalidParams, format!("`{}` is not open", uri.as_str()));
        self.documents.get(uri.as_str()).ok_or_else(missing)
    }

    /// Document of a request, and the byte offset of its position.
    pub(crate) fn place(&self, at: &TextDocumentPositionParams) -> Result<(&Document, usize), Refusal> {
        let document = self.document(&at.text_document.uri)?;
        Ok((document, document.lines.offset(at.position)))
    }

    /// A file and its world.
    pub(crate) fn cx<'a>(&'a self, document: &'a Document) -> Cx<'a> {
        Cx { world: &self.workspace, file: &document.file }
    }

    /// The editor's address of a file if it is open, else one derived from the path; and the version.
    pub fn address(&self, path: &std::path::Path) -> Option<(Uri, Option<i32>)> {
        let open = self.documents.values().find(|document| document.file.path == path);
        match open {
            Some(document) => Some((document.uri.clone(), Some(document.version))),
            None => uris::uri(path).map(|uri| (uri, None)),
        }
    }

    /// Lines of a file, open or on disk.
    pub(crate) fn lines(&self, path: &std::path::Path) -> Option<Lines> {
        Some(Lines::new(self.workspace.file(path)?.text.clone(), self.encoding))
    }
}

/// Parses the parameters of a message; `None` if they are malformed.
pub(crate) fn read<T: DeserializeOwned>(params: Json) -> Option<T> {
    serde_json::from_value(params).ok()
}
