//! Messages of the editor.
use super::answer::Refusal;
use super::checker::Job;
use super::state::{Server, read};
use super::text::changed;
use super::{answers, uris};
use crate::identity;
use lsp_server::{ErrorCode, Message, Notification, Request, Response};
use lsp_types::{
    DidChangeTextDocumentParams, DidChangeWorkspaceFoldersParams, DidCloseTextDocumentParams, DidOpenTextDocumentParams,
};
use serde_json::Value as Json;
use shibo_value::clock::Stopwatch;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::time::Duration;

/// Time for which the known state of the disk is trusted.
const BELIEVED: Duration = Duration::from_millis(300);

impl Server {
    /// Handles a notification. A panic is logged in the editor and affects nothing else.
    pub fn notice(&mut self, note: Notification) {
        let _ = catch_unwind(AssertUnwindSafe(|| self.notification(note)));
    }

    /// Answers a request.
    pub fn request(&mut self, request: Request) {
        let id = request.id.clone();
        let response = if self.host.is_cancelled(&id) {
            Response::new_err(id, ErrorCode::RequestCanceled as i32, "cancelled".to_owned())
        } else if self.stopping {
            Response::new_err(id, ErrorCode::InvalidRequest as i32, "the server is shutting down".to_owned())
        } else if request.method == "shutdown" {
            self.stopping = true;
            Response::new_ok(id, Json::Null)
        } else {
            if self.refreshed.elapsed() > BELIEVED {
                self.workspace.refresh();
                self.refreshed = Stopwatch::wall();
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
        self.host.send(Message::Response(response));
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
                    self.host.check(Job::Close(document.file.path.clone()));
                }
            }
            "workspace/didChangeConfiguration" => {
                if let Some(options) = read(params["settings"]["shibo"].clone()) {
                    self.options = options;
                    self.host.set_form(self.options.pictures);
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
                    self.host.check(Job::Roots(roots));
                }
            }
            _ => {}
        }
    }
}
