//! Graphs of agents: opened, checked, laid out, listed and saved.
use super::folders::Folders;
use super::save::{MOST_TEXT, sha256};
use super::{MOST_DIAGNOSTICS, Refusal};
use crate::check::{Located, located};
use crate::diff::lines;
use crate::fix::ROUNDS;
use crate::manual::{count_words, query_words};
use crate::{CheckRequest, FixRequest, GraphText, Tools};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value as Json;
use shibo_graph::{LoadOptions, Loaded, load_text, syntax};
use shibo_ide::fixes::Applies;
use shibo_value::Resolution;
use shibo_value::diagnostics::{Diagnostic, SourceMap};
use std::path::{Path, PathBuf};

/// The name of a graph that is given as a text.
const TEXT: &str = "text.ron";
/// The prefix of the names of shipped graphs.
const SHIPPED: &str = "shibo:";
/// The most graphs of an answer.
const MOST_GRAPHS: usize = 200;

/// A graph: a text or a path.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Source {
    /// The text of the graph, in RON.
    #[serde(default)]
    pub text: Option<String>,
    /// The path of a graph file, relative to the first folder for reading; `2:/PATH` for a file of the second folder;
    /// `shibo:NAME` for a shipped graph.
    #[serde(default)]
    pub path: Option<String>,
}

/// The text of a graph.
#[derive(Clone, Debug)]
pub struct Opened {
    /// The path, to which imports are relative.
    pub path: PathBuf,
    /// The text.
    pub text: String,
}

/// Reads a graph.
///
/// # Errors
/// Neither a text nor a path, or both; a path outside; a file that cannot be read; a text that is too long.
pub fn open(tools: &Tools, folders: &Folders, source: &Source) -> Result<Opened, Refusal> {
    match (&source.text, &source.path) {
        (Some(text), None) if text.len() as u64 > MOST_TEXT => Err(Refusal::new(
            "too-large",
            format!("the text is longer than {MOST_TEXT} bytes"),
            "split the graph by imports",
        )),
        (Some(text), None) => Ok(Opened { path: PathBuf::from(TEXT), text: text.clone() }),
        (None, Some(path)) => match path.strip_prefix(SHIPPED) {
            Some(name) => shipped(tools, name),
            None => folders.text(path).map(|(path, text)| Opened { path, text }),
        },
        _ => Err(Refusal::new("bad-value", "a graph is `text` or `path`, one of both", "give one of them")),
    }
}

fn shipped(tools: &Tools, name: &str) -> Result<Opened, Refusal> {
    let library = tools.registry.library();
    let found = library.and_then(|library| {
        let inside = library.find(name.trim_end_matches(".ron"))?;
        Some(Opened { text: library.text(&inside)?.to_owned(), path: Path::new(SHIPPED).join(inside) })
    });
    let names = library.map_or(Vec::new(), |library| library.names());
    let help = || shibo_value::diagnostics::suggest(name, "graph", &names);
    found.ok_or_else(|| Refusal::new("unknown", format!("there is no shipped graph `{SHIPPED}{name}`"), help()))
}

/// Loads a graph with values for its parameters. Only files that the gate of the tools lets pass are used.
pub fn load(
    tools: &Tools,
    opened: &Opened,
    (set, preset): (&[(String, String)], Option<&str>),
    resolution: Option<Resolution>,
) -> Loaded {
    let options = LoadOptions { set: set.to_vec(), preset: preset.map(str::to_owned), resolution, ..tools.options() };
    load_text(&opened.path, &opened.text, &tools.registry, &options)
}

/// Errors and warnings of a graph.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
pub struct Checked {
    /// Errors, as `shibo check --format json` gives them.
    pub errors: Vec<Json>,
    /// Warnings.
    pub warnings: Vec<Json>,
    /// The number of errors and warnings that were left out.
    pub more: usize,
    /// A sentence that says so if not all fixes were tried.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
}

/// Diagnostics for an answer with their fixes, at most [`MOST_DIAGNOSTICS`].
pub fn findings(tools: &Tools, diagnostics: &[Diagnostic], sources: &SourceMap) -> Checked {
    told(&located(tools, diagnostics, sources), None)
}

fn told(found: &[Located], note: Option<String>) -> Checked {
    let (warnings, errors): (Vec<&Located>, Vec<&Located>) = found.iter().partition(|one| one.warning);
    let mut left = MOST_DIAGNOSTICS;
    let mut take = |list: Vec<&Located>| {
        let taken: Vec<Json> = list.into_iter().take(left).filter_map(|one| serde_json::to_value(one).ok()).collect();
        left -= taken.len();
        taken
    };
    let (errors, warnings) = (take(errors), take(warnings));
    let more = found.len().saturating_sub(errors.len() + warnings.len());
    Checked { errors, warnings, more, note }
}

/// Checks a graph.
///
/// # Errors
/// Those of [`open`]. Errors in the graph are a part of the answer.
pub fn check(tools: &Tools, folders: &Folders, source: &Source) -> Result<Checked, Refusal> {
    let Opened { path, text } = open(tools, folders, source)?;
    let checked = crate::check::check(tools, &CheckRequest { graph: GraphText { path, text } });
    Ok(told(&checked.diagnostics, checked.note))
}

/// The certainty of fixes.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// Only one meaning is possible.
    Sure,
    /// Also the best guess.
    #[default]
    Likely,
}

/// A graph to fix: a text or a path.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FixArgs {
    /// The text of the graph, in RON or nearly so.
    #[serde(default)]
    pub text: Option<String>,
    /// The path of a graph file, `2:/PATH` in the second folder, or `shibo:NAME`.
    #[serde(default)]
    pub path: Option<String>,
    /// The fixes that are applied.
    #[serde(default)]
    pub applies: Level,
}

/// A graph after fixes.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Fixed {
    /// The text. It is not saved.
    pub text: String,
    /// Titles of the applied fixes.
    pub applied: Vec<String>,
    /// The remaining errors and warnings.
    pub diagnostics: Checked,
}

/// Applies fixes to a graph.
///
/// # Errors
/// Those of [`open`].
pub fn fix(tools: &Tools, folders: &Folders, args: &FixArgs) -> Result<Fixed, Refusal> {
    let source = Source { text: args.text.clone(), path: args.path.clone() };
    let Opened { path, text } = open(tools, folders, &source)?;
    let applies = match args.applies {
        Level::Sure => Applies::Sure,
        Level::Likely => Applies::Likely,
    };
    let fixed = crate::fix::fix(tools, &FixRequest { graph: GraphText { path, text }, applies, rounds: ROUNDS });
    Ok(Fixed { text: fixed.text, applied: fixed.applied, diagnostics: told(&fixed.diagnostics, fixed.note) })
}

/// A graph in the usual layout.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Formatted {
    /// The text; as it was if it has syntax errors.
    pub text: String,
    /// Its syntax errors.
    pub diagnostics: Checked,
}

/// Lays out a graph.
///
/// # Errors
/// Those of [`open`].
pub fn format(tools: &Tools, folders: &Folders, source: &Source) -> Result<Formatted, Refusal> {
    let opened = open(tools, folders, source)?;
    Ok(match syntax::format(&opened.text) {
        Ok(text) => Formatted { text, diagnostics: Checked::default() },
        Err(errors) => {
            let mut sources = SourceMap::default();
            let file = sources.add(&opened.path, opened.text.clone());
            let errors: Vec<Diagnostic> = errors.iter().map(|error| error.located(file)).collect();
            Formatted { diagnostics: findings(tools, &errors, &sources), text: opened.text }
        }
    })
}

/// Words to look for among graphs.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ListRequest {
    /// Words that begin a word of the name, of the first sentence, of the family or of a preset; empty for all graphs.
    #[serde(default)]
    pub words: String,
}

/// A graph that can be used.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Listed {
    /// The path: `shibo:NAME`, or that of a file.
    pub path: String,
    /// The first sentence of its first comment. It was written by the author of the graph.
    pub doc: String,
    /// The family of its material, such as `stone`; empty if the graph names none.
    pub family: String,
}

/// The graphs that can be used.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct ListedGraphs {
    /// The graphs, shipped ones first.
    pub graphs: Vec<Listed>,
    /// The number of further graphs.
    pub more: usize,
}

/// The shipped graphs and the readable files with all given words. A cancelled list is incomplete.
pub fn list(tools: &Tools, folders: &Folders, request: &ListRequest) -> ListedGraphs {
    let words = query_words(&request.words);
    let mut found = ListedGraphs { graphs: Vec::new(), more: 0 };
    let mut take = |path: String, text: String| {
        let tree = syntax::Tree::parse(text.as_str());
        let listed = Listed { doc: first_sentence(&text), family: family(&tree), path };
        let searched = format!("{} {} {} {}", listed.path, listed.doc, listed.family, presets(&tree).join(" "));
        if count_words(&words, &searched) == words.len() {
            if found.graphs.len() < MOST_GRAPHS {
                found.graphs.push(listed);
            } else {
                found.more += 1;
            }
        }
        !tools.cancel.is_cancelled()
    };
    if let Some(library) = tools.registry.library() {
        for name in library.names() {
            let text = library.find(name).and_then(|path| Some(library.text(&path)?.to_owned()));
            if !text.is_none_or(|text| take(format!("{SHIPPED}{name}"), text)) {
                break;
            }
        }
    }
    folders.graphs(&mut take);
    found
}

/// The family that a text names, without control characters.
fn family(tree: &syntax::Tree) -> String {
    let family = tree.value().and_then(|graph| graph.entry("family")?.value()?.string());
    family.unwrap_or_default().chars().filter(|c| !c.is_control()).take(40).collect()
}

/// The names of the presets of a text.
fn presets(tree: &syntax::Tree) -> Vec<String> {
    let presets = tree.value().and_then(|graph| graph.entry("presets")?.value());
    presets.into_iter().flat_map(syntax::Node::entries).filter_map(syntax::Node::key_text).collect()
}

/// The first sentence of the comment at the start, without control characters.
fn first_sentence(text: &str) -> String {
    let lines = text.lines().map_while(|line| line.strip_prefix("//")).map(str::trim);
    let comment = lines.take_while(|line| !line.is_empty()).collect::<Vec<_>>().join(" ");
    let sentence = comment.split_inclusive(". ").next().unwrap_or_default();
    sentence.trim().chars().filter(|c| !c.is_control()).take(300).collect()
}

/// A graph to save.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SaveRequest {
    /// The path of a file `*.ron`, relative to the first folder for writing.
    pub path: String,
    /// The text.
    pub text: String,
    /// The SHA-256 of the text that is replaced, in hexadecimal digits. A new file needs none.
    #[serde(default)]
    pub expect: Option<String>,
}

/// A saved graph.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Saved {
    /// The SHA-256 of the new text.
    pub sha256: String,
    /// The lines that changed, as a unified diff.
    pub diff: String,
}

/// Saves a graph in a folder for writing.
///
/// # Errors
/// A text that is too long, and those of [`Folders::write`].
pub fn save(folders: &Folders, request: &SaveRequest) -> Result<Saved, Refusal> {
    if request.text.len() as u64 > MOST_TEXT {
        let message = format!("the text is longer than {MOST_TEXT} bytes");
        return Err(Refusal::new("too-large", message, "split the graph by imports"));
    }
    let before = folders.write(&request.path, &request.text, request.expect.as_deref())?;
    let diff = lines(&before.unwrap_or_default(), &request.text);
    Ok(Saved { sha256: sha256(request.text.as_bytes()), diff })
}
