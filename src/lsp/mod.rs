//! `shibo lsp`: the language server, on stdin and stdout. The answers come from [`ide`](shibo_ide::server); this module has the
//! transport and three threads, which answer requests, check texts, and make pictures for hovers. No answer waits for another thread.
mod checking;
mod edits;
mod event;
mod follow;
mod frames;
mod http;
mod jumps;
mod pages;
mod pictures;
mod process;

use crate::environment;
use crate::library;
use crate::quit::Quit;
use clap::Args;
use edits::Edits;
use event::Event;
use follow::Follower;
use lsp_server::{Connection, Message, ProtocolError, RequestId};
use pages::Pages;
use pictures::Painter;
#[cfg(feature = "mcp")]
pub(crate) use pictures::base64;
use process::{Cancelled, Process};
use serde_json::Value as Json;
use shibo_ide::Workspace;
use shibo_ide::server::{Beginning, Checker, Server};
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, PoisonError};

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
    let beginning = Beginning::new(params);
    connection.initialize_finish(id, beginning.answer(true))?;
    let registry = Arc::new(library::registry());
    let workspace = || {
        let workspace = Workspace::new(registry.clone(), beginning.roots.clone());
        workspace.with_import_paths(environment::import_paths().to_vec())
    };
    let cancelled = Cancelled::default();
    let (events, told) = channel();
    let (jobs, wanted) = channel();
    let send = connection.sender.clone();
    let working_dir = std::env::current_dir().unwrap_or_default();
    let out = move |message| drop(send.send(message));
    let checker = Checker::new(workspace(), working_dir, beginning.encoding, out);
    let checking = std::thread::spawn(move || checking::run(checker, &wanted));
    let out = connection.sender.clone();
    let reading = std::thread::spawn({
        let (events, cancelled) = (events.clone(), cancelled.clone());
        move || listen(&connection, &events, &cancelled)
    });
    let pages = Pages::new(events.clone(), cache_dir.clone());
    let follower = Follower::new(events, pages.clone());
    let process = Process {
        out: Box::new(move |message| drop(out.send(message))),
        checker: jobs,
        painter: Painter::new(cache_dir, beginning.pictures()),
        pages: pages.clone(),
        follower: follower.clone(),
        cancelled,
    };
    let files = workspace();
    let mut server = Server::new(files, beginning, Box::new(process));
    let good = run_events(&mut server, &told);
    follower.stop();
    pages.stop();
    // The threads end when their senders are dropped.
    drop(server);
    let _ = checking.join();
    drop(told);
    let _ = reading.join();
    Ok(good)
}

/// Answers until the editor ends the session; returns whether it ended properly.
fn run_events(server: &mut Server, events: &Receiver<Event>) -> bool {
    let mut edits = Edits::default();
    for event in events {
        match event {
            Event::Message(Message::Request(request)) => server.request(request),
            Event::Message(Message::Notification(note)) if note.method == "exit" => break,
            Event::Message(Message::Notification(note)) => server.notice(note),
            Event::Message(Message::Response(response)) => edits.take(&response),
            Event::Edit(edit) => edits.ask(server, edit),
            Event::Jump(jump) => jumps::handle(server, &jump),
            Event::Gone => break,
        }
    }
    server.is_stopping()
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
