//! The language server for a program that has one connection.
use super::Bridge;
use crate::lsp;
use lsp_server::{Connection, Message, RequestId};
use serde_json::{Value as Json, json};
use shibo_bridge::host::Host;
use shibo_bridge::scene::lock;
use std::collections::HashMap;
use std::sync::Mutex;
use std::thread::Scope;

/// Requests to the language server, with the ids of the requests that brought them.
pub(super) type Pending = Mutex<HashMap<RequestId, u64>>;

/// The language server. It starts at the first message.
#[derive(Default)]
pub(super) struct Language(Option<Connection>);

impl Language {
    /// Passes a message on. The answer to a request comes when the server has one; other messages are answered at once.
    pub(super) fn send<'s>(&mut self, scope: &'s Scope<'s, '_>, bridge: &'s Bridge<'_>, id: u64, message: Json) {
        let message: Message = match serde_json::from_value(message) {
            Ok(message) => message,
            Err(error) => {
                let why = format!("`message` is no message of the language server protocol: {error}");
                return bridge.send(Host::refused(id, "bad-request", &why).json.into());
            }
        };
        if let Message::Request(request) = &message {
            let mut pending = lock(&bridge.pending);
            if pending.contains_key(&request.id) {
                let why = format!("the request {} is not answered yet", request.id);
                return bridge.send(Host::refused(id, "usage", &why).json.into());
            }
            pending.insert(request.id.clone(), id);
        }
        let is_request = matches!(message, Message::Request(_));
        let connection = self.0.get_or_insert_with(|| start(scope, bridge));
        if let Err(failed) = connection.sender.send(message) {
            // The server has ended, by the message `exit`: a new one starts.
            let connection = self.0.insert(start(scope, bridge));
            let _ = connection.sender.send(failed.into_inner());
        }
        if !is_request {
            bridge.send(Host::answered(id, json!({ "messages": [] })).json.into());
        }
    }
}

fn start<'s>(scope: &'s Scope<'s, '_>, bridge: &'s Bridge<'_>) -> Connection {
    let (server, client) = Connection::memory();
    let told = client.receiver.clone();
    scope.spawn(move || drop(lsp::serve(server, None)));
    scope.spawn(move || {
        for message in told {
            let wanted = match &message {
                Message::Response(response) => lock(&bridge.pending).remove(&response.id),
                _ => None,
            };
            let mut json = json!(message);
            json["jsonrpc"] = "2.0".into();
            bridge.send(match wanted {
                Some(id) => Host::answered(id, json!({ "messages": [json] })).json.into(),
                None => json!({ "event": "lsp", "message": json }),
            });
        }
        // The server has ended, and answers no more.
        let left = std::mem::take(&mut *lock(&bridge.pending));
        let mut left: Vec<u64> = left.into_values().collect();
        left.sort_unstable();
        for id in left {
            bridge.send(Host::refused(id, "cancelled", "the language server has ended").json.into());
        }
    });
    client
}
