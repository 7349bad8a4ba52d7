//! Runs `shibo watch`: starts its threads.
use super::args::WatchArgs;
use super::editor;
use super::evaluate::{LatestJob, evaluate};
use super::follow::Watch;
use super::signal::Signal;
use super::status_reporter::StatusReporter;
use crate::interrupt;
use crate::library;
use crate::open;
use crate::quit::Quit;
use crate::serve::{self, Stage, Wish};
use crate::terminal::Terminal;
use std::sync::Arc;
use std::sync::mpsc::channel;

/// Runs the command.
pub(crate) fn run(args: &WatchArgs, terminal: &Terminal) -> Result<(), Quit> {
    let (sender, signals) = channel();
    let session = open::session(library::registry(), &args.engine, terminal)?;
    let stage = Arc::new(Stage::new(session, args.graph.clone()));
    let wishes = sender.clone();
    let editor = args.editor.clone();
    let server = serve::start(
        args.port,
        stage.clone(),
        move |wish| {
            let signal = match wish {
                Wish::Values(values) => Signal::Values(values),
                Wish::Open(path) => Signal::Open(path),
                Wish::Texts => Signal::Texts,
            };
            wishes.send(signal).is_ok()
        },
        move |place| editor.iter().for_each(|command| editor::open(command, place)),
    )?;
    let note = editor::Note::write(&args.graph, &server.url);
    let teller = StatusReporter { terminal, log: args.log.is_some() };
    interrupt::on_signals({
        let sender = sender.clone();
        move || drop(sender.send(Signal::Stop))
    });
    if args.while_stdin {
        let sender = sender.clone();
        std::thread::spawn(move || {
            let _ = std::io::copy(&mut std::io::stdin(), &mut std::io::sink());
            let _ = sender.send(Signal::Stop);
        });
    }
    teller.listening(&server.url);
    if !args.no_open {
        serve::open_browser(&server.url);
    }
    let desk = LatestJob::default();
    std::thread::scope(|scope| {
        scope.spawn(|| evaluate(&desk, &stage, &teller));
        Watch::new(args, &stage, &desk, &teller, sender, (&server.url, note)).run(&signals);
        desk.close();
    });
    server.stop();
    Ok(())
}
