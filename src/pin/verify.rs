//! `shibo verify`: compares pinned graphs with the pictures in `shibo.lock`.
use super::lock::LockFile;
use crate::args::{EngineArgs, ValueArgs};
use crate::check::FormatArg;
use crate::diff::{name, words};
use crate::git::Repository;
use crate::graph_files::files;
use crate::interrupt;
use crate::quit::Quit;
use crate::report::{self, count};
use crate::terminal::{Style, Terminal, Text};
use crate::{library, open};
use clap::Args;
use serde::Serialize;
use serde_json::{Value as Json, json};
use shibo_bridge::lock::{Entry, LOCK, RESOLUTION, State, Verified, VerifiedPicture, entry, text_hash, verified};
use shibo_bridge::{DiffRequest, GraphText, Tools, diff};
use shibo_engine::eval::CancelToken;
use shibo_engine::session::{Failure, Session};
use shibo_graph::Graph;
use shibo_ide::actions::pinned_at;
use shibo_value::diagnostics::to_json;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  shibo verify graphs                     all graphs of a folder
  shibo verify calf.ron --format json     for scripts

The pictures of all outputs are rendered at 64 pixels and compared bit by bit with those that `shibo pin` kept in `shibo.lock`.
A difference is explained: `changed` by a new version of a node or of a shipped graph, `edited` text or files, or a `defect` of
the program, if neither happened. A graph without an entry is `not pinned`. A lock that cannot be read stops only the graphs of its
folder: they are `bad-file`.

Exit code: 0 if all pictures are the same, otherwise 1.";

/// The most versions of a file in which the pinned text is searched.
const MOST_VERSIONS: usize = 200;

/// Prove that pinned graphs still give their pictures.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct VerifyArgs {
    /// Graph files, or folders of them.
    #[arg(value_name = "GRAPH", required = true)]
    graphs: Vec<PathBuf>,
    /// For people, or for programs.
    #[arg(long, default_value = "human")]
    format: FormatArg,
    #[command(flatten)]
    engine: EngineArgs,
}

/// The result for a graph, or its errors.
#[derive(Serialize)]
struct Listed {
    path: String,
    #[serde(flatten)]
    verified: Option<Verified>,
    #[serde(skip_serializing_if = "Option::is_none")]
    errors: Option<Json>,
}

/// Runs the command.
pub(crate) fn run(args: &VerifyArgs, terminal: &Terminal) -> Result<(), Quit> {
    let files = files(&args.graphs)?;
    let session = open::session(library::registry(), &args.engine, terminal)?;
    let cancel = CancelToken::default();
    interrupt::cancel_on_signals(&cancel);
    // The lock of the folder of the last graph; none if it cannot be read.
    let mut known: Option<(PathBuf, Option<LockFile>)> = None;
    let (mut graphs, mut good) = (Vec::new(), true);
    for path in &files {
        let beside = path.with_file_name(LOCK);
        let (_, lock) = match known.take().filter(|(place, _)| *place == beside) {
            Some(same) => known.insert(same),
            None => {
                let read = LockFile::beside(path).inspect_err(|quit| {
                    quit.code(terminal);
                });
                known.insert((beside, read.ok()))
            }
        };
        let listed = match lock {
            Some(lock) => check(path, lock, (args.format, terminal), &session, &cancel)?,
            None => Listed { path: path.display().to_string(), verified: Some(Verified::unread()), errors: None },
        };
        good &= listed.verified.as_ref().is_some_and(Verified::is_same);
        if args.format == FormatArg::Human {
            terminal.print(&page(&listed, terminal))?;
        }
        graphs.push(listed);
    }
    if args.format == FormatArg::Json {
        terminal.json(&json!({ "graphs": graphs }))?;
    }
    if good { Ok(()) } else { Err(Quit::Shown) }
}

/// Renders a graph and compares it with its entry.
fn check(
    path: &Path,
    lock: &LockFile,
    (format, terminal): (FormatArg, &Terminal),
    session: &Session,
    cancel: &CancelToken,
) -> Result<Listed, Quit> {
    let loaded = open::load(path, session.registry(), &ValueArgs::default(), Some(RESOLUTION));
    let mut listed = Listed { path: path.display().to_string(), verified: None, errors: None };
    let mut failed = |errors: &[_], sources: &_| match format {
        FormatArg::Human => report::show(terminal, errors, sources),
        FormatArg::Json => listed.errors = to_json(errors, sources).get_mut("errors").map(Json::take),
    };
    let Some(graph) = loaded.graph else {
        failed(&loaded.diagnostics, &loaded.sources);
        return Ok(listed);
    };
    let then = lock.entry(path);
    match entry(session, &graph, cancel) {
        Ok(now) => {
            let mut verified = verified(session.registry().changes(), &graph, then, &now);
            if let Some(then) = then.filter(|_| verified.text_edited && !verified.is_same()) {
                verified.edits = edits(&graph, then);
            }
            listed.verified = Some(verified);
        }
        Err(Failure::Errors(errors)) => failed(&errors, &graph.sources),
        Err(failure) => return Err(open::failed(failure, &graph.sources, terminal)),
    }
    Ok(listed)
}

/// The edits since the pinned text, if git has that text.
fn edits(graph: &Graph, pinned: &Entry) -> Vec<diff::Change> {
    let Ok(repository) = Repository::here() else { return Vec::new() };
    // The text may have been saved in git before it was pinned.
    let is_pinned =
        |text: &String| text_hash(text) == pinned.text && pinned_at(text).is_none_or(|change| change == pinned.pins);
    let Some(then) = repository.past_texts(&graph.path, MOST_VERSIONS).find(is_pinned) else {
        return Vec::new();
    };
    let text = |text: String| Some(GraphText { path: graph.path.clone(), text });
    let now = graph.sources.sources().first().map(|source| source.text.to_string()).unwrap_or_default();
    let tools: Tools = library::tools();
    diff::diff(&tools, &DiffRequest { before: text(then), after: text(now), comments: false }).changes
}

/// The result of a graph as text.
fn page(listed: &Listed, terminal: &Terminal) -> Text {
    let mut page = terminal.page();
    page.styled(Style::Bold, &listed.path);
    let Some(verified) = &listed.verified else {
        page.push("  refused, see its errors").end();
        return page;
    };
    let state = match verified.state {
        State::Same => "same",
        State::Changed => "changed",
        State::Edited => "edited",
        State::Defect => "defect",
        State::Newer => "newer",
        State::NotPinned => "not pinned",
        State::BadFile => "bad-file",
    };
    page.push("  ").styled(Style::Accent, state);
    if verified.is_same() {
        page.push(&format!("  {}", count(verified.pictures.len() as u64, "picture"))).end();
        return page;
    }
    page.end();
    // Pictures with the same difference share a line.
    let mut lines: Vec<(String, Vec<&str>)> = Vec::new();
    for picture in verified.pictures.iter().filter(|picture| picture.state != State::Same) {
        let says = difference(picture);
        match lines.iter_mut().find(|(known, _)| *known == says) {
            Some((_, names)) => names.push(&picture.name),
            None => lines.push((says, vec![&picture.name])),
        }
    }
    for (says, names) in lines {
        page.push(&format!("  {}: {says}", names.join(", "))).end();
    }
    explain(&mut page, verified);
    page
}

fn difference(picture: &VerifiedPicture) -> String {
    match picture.state {
        State::NotPinned => "it has no picture in the lock; `shibo pin` keeps one".to_owned(),
        _ => picture.words.join(", "),
    }
}

/// The reasons of a difference.
fn explain(page: &mut Text, verified: &Verified) {
    for change in &verified.because {
        let thing = change.kind.as_ref().map_or("everything".to_owned(), |kind| format!("`{kind}` {}", change.version));
        let place = format!("change {}, node \"{}\", line {}", change.change, change.node, change.line);
        page.push(&format!("  {thing} ({place}): {}", change.says)).end();
    }
    for path in &verified.files {
        page.push(&format!("  {path} was edited since the graph was pinned")).end();
    }
    for edit in &verified.edits {
        page.push(&format!("  {}  {}", name(&edit.path), words(edit))).end();
    }
    if verified.text_edited && verified.edits.is_empty() {
        page.push("  the text was edited since the graph was pinned").end();
    }
    match verified.state {
        State::Defect => page.push("  the same recipe gave other bits; please report it").end(),
        State::Newer => {
            page.push("  a newer Shibo made the entry in the lock; update Shibo, or pin the graph again").end()
        }
        State::BadFile => page.push("  the lock of its folder cannot be read").end(),
        _ => page,
    };
}
