//! `shibo diff`: the changes from one version of a graph to another.
mod human;
mod pictures;

pub(crate) use human::{name, words};

use crate::args::EngineArgs;
use crate::check::FormatArg;
use crate::git::{Repository, Version, version};
use crate::graph_files::{read, text};
use crate::library;
use crate::quit::Quit;
use crate::terminal::Terminal;
use clap::Args;
use pictures::Pictures;
use serde::Serialize;
use shibo_bridge::diff::{GraphDiff, imports, is_graph};
use shibo_bridge::pictures::PictureDiff;
use shibo_bridge::{DiffRequest, GraphText, Tools, diff};
use shibo_graph::Limits;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  shibo diff old.ron calf.ron                  names of what changed, with the values before and after
  shibo diff HEAD~3:graphs/calf.ron calf.ron   a version in the repository; its path begins at the root
  shibo diff --since main                      all graphs that differ from a branch, or import one that does
  shibo diff --since main --format json        for scripts
  shibo diff old.ron calf.ron --sheet s.png    a picture of what changed: before, after, difference

Comments, layout and the order of things do not count. A thing under a new name counts as renamed if it is the same otherwise.

Exit code: 0 when the changes were listed; with --exit-code, 1 if there are any; 2 if a version cannot be read.";

/// List the changes from one version of a graph to another.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct DiffArgs {
    /// Two versions, each a file or REV:PATH; with --since, the files or folders to compare.
    #[arg(value_name = "GRAPH", required_unless_present = "since")]
    paths: Vec<PathBuf>,
    /// Compare all graphs of the repository with this revision.
    #[arg(long, value_name = "REV", conflicts_with = "git")]
    since: Option<String>,
    /// For people, or for programs.
    #[arg(long, default_value = "human")]
    format: FormatArg,
    /// List changed comments too.
    #[arg(long)]
    all: bool,
    /// Render the outputs of both versions and compare them: `none`, or pixels of the longer side. 256 on a terminal.
    #[arg(long, value_name = "none|SIZE")]
    pictures: Option<String>,
    /// Write a picture of the outputs that differ: before, after, and the difference, at most 128 pixels each.
    #[arg(long, value_name = "FILE.png")]
    sheet: Option<PathBuf>,
    /// Compare only this output, or a channel of a material (NAME.CHANNEL); may be repeated.
    #[arg(long, value_name = "NAME")]
    output: Vec<String>,
    /// Compare pictures with this preset.
    #[arg(long, value_name = "NAME")]
    preset: Option<String>,
    #[command(flatten)]
    engine: EngineArgs,
    /// Exit with 1 if there is a change.
    #[arg(long)]
    exit_code: bool,
    /// Take the arguments that git gives to a diff program.
    #[arg(long, hide = true)]
    git: bool,
}

/// The changes of one graph.
#[derive(Serialize)]
struct Listed {
    path: String,
    /// Imports that changed, if the graph itself did not.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    imports: Vec<PathBuf>,
    #[serde(flatten)]
    diff: GraphDiff,
    /// The pictures of both versions, if they were compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pictures: Option<Vec<PictureDiff>>,
    /// Facts about the files themselves.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    notes: Vec<String>,
    /// Plain lines of a file that is not a graph.
    #[serde(skip_serializing_if = "Option::is_none")]
    lines: Option<String>,
}

impl Listed {
    /// No change yet.
    fn new(path: String) -> Self {
        Self { path, imports: Vec::new(), diff: GraphDiff::default(), pictures: None, notes: Vec::new(), lines: None }
    }
}

/// All changes.
#[derive(Default, Serialize)]
struct All {
    graphs: Vec<Listed>,
    errors: Vec<String>,
}

/// Runs the command.
pub(crate) fn run(args: &DiffArgs, terminal: &Terminal) -> Result<(), Quit> {
    let mut lister =
        Lister { tools: library::tools(), args, pictures: Pictures::of(args, terminal)?, failed: Vec::new() };
    let mut all = match (&args.since, &args.paths[..]) {
        (Some(revision), paths) => lister.since(revision, paths)?,
        (None, paths) if args.git => lister.for_git(paths)?,
        (None, [before, after]) => {
            let (before, after) = (version(before)?, version(after)?);
            All { graphs: vec![lister.listed(Some(before), Some(after))], ..All::default() }
        }
        _ => return Err(Quit::Usage("give two versions of a graph, or `--since REV`".to_owned())),
    };
    all.errors.append(&mut lister.failed);
    let size = lister.pictures.as_ref().map(Pictures::size);
    if let (Some(pictures), Some(path)) = (lister.pictures, &args.sheet) {
        pictures.write_sheet(path)?;
    }
    for error in &all.errors {
        terminal.error(error);
    }
    let differs = all
        .graphs
        .iter()
        .any(|graph| !graph.diff.changes.is_empty() || !graph.imports.is_empty() || graph.lines.is_some());
    match args.format {
        FormatArg::Json => terminal.json(&all)?,
        FormatArg::Human => terminal.print(&human::page(&all.graphs, size, terminal))?,
    }
    if !all.errors.is_empty() || (differs && args.exit_code) { Err(Quit::Shown) } else { Ok(()) }
}

/// Lists the changes of graphs.
struct Lister<'a> {
    tools: Tools,
    args: &'a DiffArgs,
    pictures: Option<Pictures<'a>>,
    /// Graphs whose pictures could not be rendered, as messages.
    failed: Vec<String>,
}

impl Lister<'_> {
    /// Compares two versions. Files that are not graphs are compared by lines.
    fn listed(&mut self, before: Option<Version>, after: Option<Version>) -> Listed {
        let path = after.as_ref().or(before.as_ref()).map(|version| version.name.clone()).unwrap_or_default();
        let (before, after) = (before.map(|version| version.graph), after.map(|version| version.graph));
        let graphs = [&before, &after].into_iter().flatten().any(|graph| is_graph(&graph.text));
        if !graphs {
            let text = |graph: Option<GraphText>| graph.map(|graph| graph.text).unwrap_or_default();
            let lines = shibo_bridge::diff::lines(&text(before), &text(after));
            let lines = Some(lines).filter(|lines| !lines.is_empty());
            return Listed { lines, ..Listed::new(path) };
        }
        let mut compared = None;
        if let (Some(pictures), Some(before), Some(after)) = (&mut self.pictures, &before, &after) {
            match pictures.compare(&path, before, after) {
                Ok(found) => compared = Some(found),
                Err(quit) => self.failed.push(format!("the pictures of `{path}` were not compared: {}", quit.text())),
            }
        }
        let diff = diff(&self.tools, &DiffRequest { before, after, comments: self.args.all });
        Listed { diff, pictures: compared, ..Listed::new(path) }
    }

    /// All graphs that differ from a revision, and their importers.
    fn since(&mut self, revision: &str, paths: &[PathBuf]) -> Result<All, Quit> {
        let repository = Repository::here()?;
        if repository.is_bare() {
            return Err(Quit::Usage(
                "`--since` compares with the files of a repository, and this one has none".to_owned(),
            ));
        }
        let mut all = All::default();
        let mut own = BTreeSet::new();
        for changed in repository.changed(revision, paths)? {
            let place = |path: &String| Version {
                name: path.clone(),
                graph: GraphText { path: repository.path(path), text: String::new() },
            };
            let before = changed.before.as_ref().map(|path| {
                let mut version = place(path);
                version.graph.text = repository.text(revision, path)?;
                Ok::<_, Quit>(version)
            });
            let after = changed.after.as_ref().map(|path| {
                let mut version = place(path);
                let file = version.graph.path.clone();
                own.insert(file.canonicalize().unwrap_or_else(|_| file.clone()));
                version.graph.text = text(&file, read(&file).map_err(Quit::failed)?)?;
                Ok::<_, Quit>(version)
            });
            match (before.transpose(), after.transpose()) {
                (Ok(before), Ok(after)) => {
                    let listed = self.listed(before, after);
                    all.graphs.extend((!listed.diff.changes.is_empty()).then_some(listed));
                }
                (Err(quit), _) | (_, Err(quit)) => all.errors.push(quit.text()),
            }
        }
        // Files outside of the given paths may be imported too.
        let mut changed = own.clone();
        for other in repository.changed(revision, &[])? {
            changed.extend(other.after.and_then(|path| repository.path(&path).canonicalize().ok()));
        }
        let mut readers = Readers { tools: &self.tools, changed: &changed, known: BTreeMap::new() };
        for path in repository.graphs(paths)? {
            let path = path.canonicalize().unwrap_or(path);
            let imports: Vec<PathBuf> = if own.contains(&path) { Vec::new() } else { readers.of(&path, 0) };
            if !imports.is_empty() {
                let shown = |path: &Path| repository.inside(path);
                let imports = imports.iter().map(|path| shown(path)).collect();
                all.graphs.push(Listed { imports, ..Listed::new(shown(&path).display().to_string()) });
            }
        }
        Ok(all)
    }

    /// Compares the files that git gives: path, old file, old hash, old mode, new file, new hash, new mode. Git stops at a failure of
    /// a diff program, so files that are no text get a note.
    fn for_git(&mut self, paths: &[PathBuf]) -> Result<All, Quit> {
        // A merge stopped at this file.
        if let [path] = paths {
            let note = "a merge left conflicts in this file; keep one version of each".to_owned();
            let listed = Listed { notes: vec![note], ..Listed::new(path.display().to_string()) };
            return Ok(All { graphs: vec![listed], ..All::default() });
        }
        let [path, old, _, _, new, ..] = paths else {
            return Err(Quit::Usage("`--git` takes the seven arguments that git gives to a diff program".to_owned()));
        };
        // Git may give the new name of a renamed file as the eighth argument.
        let name = paths.get(7).unwrap_or(path);
        let mut notes = Vec::new();
        let mut one = |file: &PathBuf, version: &str| -> Result<Option<Version>, String> {
            if file.as_os_str() == "/dev/null" || file.as_os_str() == "nul" {
                return Ok(None);
            }
            let (text, note) = decoded(read(file)?);
            notes.extend(note.map(|note| format!("{version} {note}")));
            let text = text.ok_or_else(|| format!("{version} was not compared"))?;
            Ok(Some(Version { name: name.display().to_string(), graph: GraphText { path: name.clone(), text } }))
        };
        let versions = (one(old, "the version before"), one(new, "the version after"));
        let listed = match versions {
            (Ok(before), Ok(after)) => self.listed(before, after),
            (before, after) => {
                notes.extend([before.err(), after.err()].into_iter().flatten());
                Listed::new(name.display().to_string())
            }
        };
        Ok(All { graphs: vec![Listed { notes, ..listed }], ..All::default() })
    }
}

/// The text of a file, and a note if it is not UTF-8. A text in another encoding is read as Latin-1, where each byte is a character;
/// `None` for a file that is no text or too large.
fn decoded(bytes: Vec<u8>) -> (Option<String>, Option<String>) {
    if bytes.len() as u64 > Limits::default().max_file_bytes {
        return (None, Some("is larger than a graph file may be".to_owned()));
    }
    match String::from_utf8(bytes) {
        Ok(text) => (Some(text), None),
        Err(error) if error.as_bytes().contains(&0) => (None, Some("is no text".to_owned())),
        Err(error) => {
            let text = error.as_bytes().iter().map(|byte| char::from(*byte)).collect();
            (Some(text), Some("is not UTF-8 text, and is shown as if it were Latin-1".to_owned()))
        }
    }
}

/// The deepest chain of imports that is followed.
const DEEPEST: usize = 32;

/// Finds the changed files that a graph imports, itself or through others.
struct Readers<'a> {
    tools: &'a Tools,
    changed: &'a BTreeSet<PathBuf>,
    known: BTreeMap<PathBuf, Vec<PathBuf>>,
}

impl Readers<'_> {
    fn of(&mut self, path: &Path, depth: usize) -> Vec<PathBuf> {
        if let Some(known) = self.known.get(path) {
            return known.clone();
        }
        // A file that imports itself ends here.
        self.known.insert(path.to_owned(), Vec::new());
        let read = read(path).ok().and_then(|bytes| String::from_utf8(bytes).ok()).filter(|_| depth < DEEPEST);
        let mut found = BTreeSet::new();
        for import in read.map_or_else(Vec::new, |text| imports(self.tools, &GraphText { path: path.to_owned(), text }))
        {
            if self.changed.contains(&import) {
                found.insert(import.clone());
            }
            found.extend(self.of(&import, depth + 1));
        }
        let found: Vec<PathBuf> = found.into_iter().collect();
        self.known.insert(path.to_owned(), found.clone());
        found
    }
}
