//! `shibo lsp`: the language server, on stdin and stdout. The answers come from [`ide`](shibo_ide); this module has
//! the protocol and three threads, which answer requests, check texts, and make pictures for hovers. No answer waits
//! for another thread.
mod actions;
mod answer;
mod answers;
mod checker;
mod commands;
mod convert;
mod dispatch;
mod event;
mod frames;
mod http;
mod options;
mod pages;
mod pictures;
mod server;
mod text;
mod uris;

use crate::library;
use crate::quit::Quit;
use checker::Checker;
use clap::Args;
use event::Event;
use lsp_server::{Connection, Message, ProtocolError, RequestId};
use lsp_types::{ClientCapabilities, InitializeParams};
use options::Options;
use pages::Pages;
use pictures::Painter;
#[cfg(feature = "mcp")]
pub(crate) use pictures::base64;
use serde_json::{Value as Json, json};
use server::{Cancelled, Server, ServerParts};
use shibo_ide::{Workspace, identity};
use std::path::PathBuf;
use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, PoisonError};
use text::Encoding;

const EXAMPLES: &str = "\
Editors start this command; docs/editor.md says how to set them up.";

/// Help editors with graph files: the language server, on stdin and stdout.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct LspArgs {
    /// Accepted for editors that pass it: there is no other way to talk.
    #[arg(long)]
    stdio: bool,
    /// The folder for results of nodes whose pictures are shown; that of `render` if not given.
    #[arg(long, value_name = "DIR")]
    cache_dir: Option<PathBuf>,
}

/// Capabilities of the editor.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Client {
    /// Supports snippets.
    snippets: bool,
    /// Can create files in a workspace edit.
    creates: bool,
    /// Can show files and pages.
    shows: bool,
}

impl Client {
    fn of(capabilities: &ClientCapabilities) -> Self {
        let item =
            || capabilities.text_document.as_ref()?.completion.as_ref()?.completion_item.as_ref()?.snippet_support;
        let edit = || capabilities.workspace.as_ref()?.workspace_edit.as_ref()?.resource_operations.as_ref();
        let show = || capabilities.window.as_ref()?.show_document.as_ref();
        Self {
            snippets: item().unwrap_or(false),
            creates: edit().is_some_and(|operations| operations.contains(&lsp_types::ResourceOperationKind::Create)),
            shows: show().is_some_and(|show| show.support),
        }
    }
}

/// Runs the command.
pub(crate) fn run(args: &LspArgs) -> Result<(), Quit> {
    let _ = args.stdio;
    let (connection, threads) = frames::stdio();
    let good = serve(connection, args.cache_dir.clone()).map_err(|error| Quit::failed(error.to_string()))?;
    threads.join().map_err(|error| Quit::failed(error.to_string()))?;
    if good { Ok(()) } else { Err(Quit::Shown) }
}

/// Serves an editor until it ends; returns whether it ended properly.
pub(crate) fn serve(connection: Connection, cache_dir: Option<PathBuf>) -> Result<bool, ProtocolError> {
    let (id, params) = connection.initialize_start()?;
    let params: InitializeParams = serde_json::from_value(params).unwrap_or_default();
    let offered = params.capabilities.general.as_ref().and_then(|general| general.position_encodings.as_deref());
    let encoding = Encoding::negotiate(offered);
    let info = json!({ "name": "shibo", "version": env!("CARGO_PKG_VERSION") });
    let answer = json!({ "capabilities": convert::capabilities(encoding), "serverInfo": info });
    connection.initialize_finish(id, answer)?;
    let options: Options =
        params.initialization_options.clone().and_then(|o| serde_json::from_value(o).ok()).unwrap_or_default();
    let registry = Arc::new(library::registry());
    let roots = roots(&params);
    let cancelled = Cancelled::default();
    let (events, told) = channel();
    let (jobs, wanted) = channel();
    let send = connection.sender.clone();
    let checker = Checker::new(registry.clone(), roots.clone(), encoding, move |message| drop(send.send(message)));
    let checking = std::thread::spawn(move || checker.run(&wanted));
    let out = connection.sender.clone();
    let reading = std::thread::spawn({
        let (events, cancelled) = (events.clone(), cancelled.clone());
        move || listen(&connection, &events, &cancelled)
    });
    let parts = ServerParts {
        workspace: Workspace::new(registry, roots).with_import_paths(crate::environment::import_paths().to_vec()),
        encoding,
        painter: Painter::new(cache_dir.clone(), options.pictures),
        options,
        pages: Pages::new(events, cache_dir),
        client: Client::of(&params.capabilities),
        checker: jobs,
        cancelled,
    };
    let mut server = Server::new(parts, move |message| drop(out.send(message)));
    let good = server.run(&told);
    server.pages.stop();
    // The threads end when their senders are dropped.
    drop(server);
    let _ = checking.join();
    drop(told);
    let _ = reading.join();
    Ok(good)
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

/// Forwards messages, and records cancellations before the cancelled requests are answered.
fn listen(connection: &Connection, events: &Sender<Event>, cancelled: &Cancelled) {
    for message in &connection.receiver {
        if let Message::Notification(note) = &message
            && note.method == "$/cancelRequest"
        {
            if let Some(id) = request_id(&note.params["id"]) {
                let mut all = cancelled.lock().unwrap_or_else(PoisonError::into_inner);
                // Most cancelled requests were already answered, and their ids never occur again.
                if all.len() > 1000 {
                    all.clear();
                }
                all.insert(id);
            }
            continue;
        }
        let last = matches!(&message, Message::Notification(note) if note.method == "exit");
        if events.send(Event::Message(message)).is_err() || last {
            return;
        }
    }
    let _ = events.send(Event::Gone);
}

fn request_id(id: &Json) -> Option<RequestId> {
    let number = id.as_i64().and_then(|id| i32::try_from(id).ok()).map(RequestId::from);
    number.or_else(|| id.as_str().map(|id| RequestId::from(id.to_owned())))
}
