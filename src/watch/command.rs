//! Command line of `shibo watch`, and start of its threads.
use super::editor;
use super::evaluate::{LatestJob, evaluate};
use super::follow::{Signal, Watch};
use super::status_reporter::StatusReporter;
use crate::args::{EngineArgs, ValueArgs};
use crate::interrupt;
use crate::library;
use crate::open;
use crate::quit::Quit;
use crate::serve::{self, Stage};
use crate::terminal::Terminal;
use clap::{Args, ValueEnum};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::channel;

const EXAMPLES: &str = "\
Examples:
  shibo watch calf.ron                   open a page that follows every save
  shibo watch calf.ron --no-open --port 7007
  shibo watch /net/share/calf.ron --poll
  shibo watch calf.ron --editor 'code -g {file}:{line}:{column}'   a click on a node shows its line

Over SSH, use the same port on both sides: ssh -L 7007:127.0.0.1:7007 host, then shibo watch calf.ron --port 7007.";

/// Show a graph in a browser, and follow every save of it.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct WatchArgs {
    /// The graph file.
    pub(super) graph: PathBuf,
    /// The port of the page; 0 is any that is free.
    #[arg(long, value_name = "N", default_value_t = 0)]
    port: u16,
    /// Do not open a browser.
    #[arg(long)]
    no_open: bool,
    /// Look at the files regularly instead of asking the system for changes; for network folders.
    #[arg(long)]
    pub(super) poll: bool,
    /// Command that shows a line in your editor when a node is clicked: `code -g {file}:{line}:{column}`.
    #[arg(long, value_name = "COMMAND")]
    editor: Option<String>,
    /// End when stdin is closed, for programs that start this one and may be killed.
    #[arg(long, hide = true)]
    while_stdin: bool,
    /// Print events on stdout, for programs.
    #[arg(long, value_name = "FORMAT")]
    log: Option<LogArg>,
    #[command(flatten)]
    pub(super) values: ValueArgs,
    #[command(flatten)]
    engine: EngineArgs,
}

/// Format of the events.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum LogArg {
    Json,
}

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
        move |values| wishes.send(Signal::Values(values)).is_ok(),
        move |place| editor.iter().for_each(|command| editor::open(command, place)),
    )?;
    let _note = editor::Note::write(&args.graph, &server.url);
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
        Watch::new(args, &stage, &desk, &teller, sender).run(&signals);
        desk.close();
    });
    server.stop();
    Ok(())
}
