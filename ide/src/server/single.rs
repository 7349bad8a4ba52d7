//! A server for one editor, for programs without threads.
use super::checker::{Checker, Job};
use super::host::{Host, NoPictures};
use super::state::{Beginning, Server};
use crate::Workspace;
use crate::hover::Pictures;
use lsp_server::{Message, RequestId, Response};
use serde_json::{Value as Json, json};
use shibo_graph::Gate;
use shibo_node::registry::Registry;
use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Messages for the editor, and texts for the checker.
#[derive(Default)]
struct Queue {
    messages: VecDeque<Message>,
    jobs: VecDeque<Job>,
}

/// The two parts that the host and the checker share.
#[derive(Clone, Default)]
struct Shared(Arc<Mutex<Queue>>);

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Queue> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Host for Shared {
    fn send(&self, message: Message) {
        self.lock().messages.push_back(message);
    }

    fn check(&self, job: Job) {
        self.lock().jobs.push_back(job);
    }

    fn pictures<'a>(&'a self, _workspace: &'a Workspace) -> Box<dyn Pictures + 'a> {
        Box::new(NoPictures)
    }
}

/// A language server that answers each message at once. It makes no pictures and runs no commands.
pub struct Single {
    registry: Arc<Registry>,
    import_paths: Vec<PathBuf>,
    gate: Gate,
    shared: Shared,
    parts: Option<(Server, Checker)>,
}

impl Single {
    /// A server whose texts see the files of `gate`. It starts at the message `initialize`, and again after `exit`.
    pub fn new(registry: Arc<Registry>, import_paths: Vec<PathBuf>, gate: Gate) -> Self {
        Self { registry, import_paths, gate, shared: Shared::default(), parts: None }
    }

    /// Gives the texts other files.
    pub fn set_gate(&mut self, gate: Gate) {
        if let Some((server, checker)) = &mut self.parts {
            server.workspace.set_gate(gate.clone());
            checker.set_gate(gate.clone());
        }
        self.gate = gate;
    }

    /// Takes a message, an object of JSON-RPC. Returns the answer if it is a request. Messages that the server sends by itself wait for
    /// [`told`](Self::told).
    pub fn ask(&mut self, message: Json) -> Result<Option<Json>, String> {
        let message: Message = serde_json::from_value(message).map_err(|error| error.to_string())?;
        match message {
            Message::Request(request) => {
                let id = request.id.clone();
                let answer = if request.method == "initialize" {
                    Response::new_ok(id, self.begin(request.params))
                } else {
                    self.request(request)
                };
                Ok(Some(plain(&Message::Response(answer))))
            }
            Message::Notification(note) => {
                if note.method == "exit" {
                    self.parts = None;
                } else if let Some((server, _)) = &mut self.parts {
                    server.notice(note);
                }
                Ok(None)
            }
            Message::Response(_) => Ok(None),
        }
    }

    fn request(&mut self, request: lsp_server::Request) -> Response {
        let id: RequestId = request.id.clone();
        let Some((server, _)) = &mut self.parts else {
            let code = lsp_server::ErrorCode::ServerNotInitialized as i32;
            return Response::new_err(id, code, "the first request must be `initialize`".to_owned());
        };
        server.request(request);
        let messages = &mut self.shared.lock().messages;
        let is_answer = |message: &Message| matches!(message, Message::Response(response) if response.id == id);
        match messages.iter().position(is_answer).and_then(|at| messages.remove(at)) {
            Some(Message::Response(response)) => response,
            _ => Response::new_ok(id, Json::Null),
        }
    }

    fn begin(&mut self, params: Json) -> Json {
        let beginning = Beginning::new(params);
        let answer = beginning.answer(false);
        let workspace = || {
            let workspace = Workspace::new(self.registry.clone(), beginning.roots.clone());
            workspace.with_import_paths(self.import_paths.clone()).with_gate(self.gate.clone())
        };
        let out = self.shared.clone();
        let checker = Checker::new(workspace(), PathBuf::new(), beginning.encoding, move |message| out.send(message));
        let server = workspace();
        self.parts = Some((Server::new(server, beginning, Box::new(self.shared.clone())), checker));
        answer
    }

    /// The next message that the server sends by itself, such as the diagnostics of a new text; `None` if there is none.
    pub fn told(&mut self) -> Option<Json> {
        loop {
            let message = self.shared.lock().messages.pop_front();
            if let Some(message) = message {
                return Some(plain(&message));
            }
            let (_, checker) = self.parts.as_mut()?;
            let jobs = std::mem::take(&mut self.shared.lock().jobs);
            jobs.into_iter().for_each(|job| checker.take(job));
            if !checker.check_next() {
                return None;
            }
        }
    }
}

fn plain(message: &Message) -> Json {
    let mut json = json!(message);
    json["jsonrpc"] = "2.0".into();
    json
}

#[cfg(test)]
mod tests {
    use super::*;
    use shibo_value::files::Memory;

    const TEXT: &str =
        "(version: 1, canvas: (size_mm: 8, resolution: 8), nodes: { \"a\": Perlim() }, outputs: { \"a\": \"a\" })";

    fn request(id: i32, method: &str, params: &Json) -> Json {
        json!({ "jsonrpc": "2.0", "id": id, "method": method, "params": params })
    }

    #[test]
    fn answers_without_threads() {
        let registry = Arc::new(shibo_library::registry());
        let mut server = Single::new(registry, Vec::new(), Gate::of(Memory::default()));
        let hover = json!({ "textDocument": { "uri": "untitled:a.ron" }, "position": { "line": 0, "character": 64 } });
        let early = server.ask(request(1, "textDocument/hover", &hover)).unwrap().unwrap();
        assert_eq!(early["error"]["code"], -32002);
        let begun = server.ask(request(2, "initialize", &json!({ "capabilities": {} }))).unwrap().unwrap();
        assert_eq!(begun["result"]["capabilities"]["hoverProvider"], true);
        assert_eq!(begun["result"]["capabilities"]["executeCommandProvider"], Json::Null);
        let document = json!({ "uri": "untitled:a.ron", "languageId": "shibo", "version": 1, "text": TEXT });
        let open =
            json!({ "jsonrpc": "2.0", "method": "textDocument/didOpen", "params": { "textDocument": document } });
        assert_eq!(server.ask(open), Ok(None));
        let told = server.told().unwrap();
        assert_eq!(told["method"], "textDocument/publishDiagnostics");
        assert_eq!(told["params"]["version"], 1);
        assert!(told["params"]["diagnostics"][0]["message"].as_str().unwrap().contains("Perlim"), "{told}");
        let change = json!({
            "textDocument": { "uri": "untitled:a.ron", "version": 2 },
            "contentChanges": [{ "text": TEXT.replace("Perlim", "Perlin") }],
        });
        let change = json!({ "jsonrpc": "2.0", "method": "textDocument/didChange", "params": change });
        assert_eq!(server.ask(change), Ok(None));
        let told = server.told().unwrap();
        assert_eq!((&told["params"]["version"], &told["params"]["diagnostics"]), (&json!(2), &json!([])));
        let found = server.ask(request(3, "textDocument/hover", &hover)).unwrap().unwrap();
        assert!(found["result"]["contents"]["value"].as_str().unwrap().contains("Perlin"), "{found}");
        assert_eq!(server.told(), None);
        assert!(server.ask(json!(7)).is_err());
    }
}
