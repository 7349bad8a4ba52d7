//! `shibo nodes`: the manual.
mod human;

use crate::library;
use crate::quit::Quit;
use crate::terminal::Terminal;
use clap::{Args, ValueEnum};
use serde_json::json;
use shibo_bridge::manual;
use shibo_ide::manual::markdown;
use shibo_ide::manual::words::{WORDS, Word};
use shibo_node::KindInfo;
use shibo_node::registry::Registry;
use shibo_value::diagnostics::suggest;

const EXAMPLES: &str = "\
Examples:
  shibo nodes                          all kinds, by family
  shibo nodes SimulateSprings          the manual of one
  shibo nodes Use                      how graphs are put into others
  shibo nodes noise                    all whose name or summary has the word
  shibo nodes color ramp               also what other programs call them
  shibo nodes --format json            the same for programs
  shibo nodes --format markdown        the reference, docs/nodes.md";

/// List the kinds of nodes, or show the manual of one.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct NodesArgs {
    /// The kind to show, or words to look for.
    #[arg(value_name = "KIND|WORDS")]
    words: Vec<String>,
    /// Output format.
    #[arg(long, default_value = "human")]
    format: FormatArg,
}

/// Output format.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum FormatArg {
    Human,
    Json,
    Markdown,
}

/// Runs the command.
pub(crate) fn run(args: &NodesArgs, terminal: &Terminal) -> Result<(), Quit> {
    let registry = library::registry();
    let words = args.words.join(" ");
    match registry.info(&words) {
        _ if words.is_empty() => all(&registry, args.format, terminal),
        Some(info) => one(info, args.format, terminal),
        None => match WORDS.iter().find(|word| word.name == words) {
            Some(word) => explain(word, args.format, terminal),
            None => found(&registry, &words, args.format, terminal),
        },
    }
}

fn all(registry: &Registry, format: FormatArg, terminal: &Terminal) -> Result<(), Quit> {
    match format {
        FormatArg::Json => terminal.json(&manual::nodes(registry.kinds().filter_map(|kind| registry.info(kind)))),
        FormatArg::Markdown => terminal.data(&markdown::reference(registry)),
        FormatArg::Human => {
            let mut page = terminal.page();
            human::families(&mut page, registry, terminal.width());
            terminal.print(&page)
        }
    }
}

fn one(info: &KindInfo, format: FormatArg, terminal: &Terminal) -> Result<(), Quit> {
    match format {
        FormatArg::Json => terminal.json(&manual::nodes([info])),
        FormatArg::Markdown => terminal.data(&markdown::node(info)),
        FormatArg::Human => {
            let mut page = terminal.page();
            human::node(&mut page, info, terminal.width());
            terminal.print(&page)
        }
    }
}

/// Shows the manual of a word that is no node.
fn explain(Word { family, name, doc }: &Word, format: FormatArg, terminal: &Terminal) -> Result<(), Quit> {
    match format {
        FormatArg::Json => terminal.json(&json!({ "nodes": [{ "kind": name, "doc": doc }] })),
        FormatArg::Markdown => terminal.data(&format!("### {name}\n\n{doc}\n")),
        FormatArg::Human => {
            let mut page = terminal.page();
            human::text(&mut page, name, family, doc, terminal.width());
            terminal.print(&page)
        }
    }
}

/// Shows the kinds that match some words.
fn found(registry: &Registry, words: &str, format: FormatArg, terminal: &Terminal) -> Result<(), Quit> {
    let found = manual::search(registry, words);
    if found.is_empty() {
        let kinds: Vec<&str> = registry.kinds().chain(WORDS.iter().map(|word| word.name)).collect();
        let help = suggest(words, "node", &kinds);
        return Err(Quit::Usage(format!("no node has `{words}` in its name, summary or names elsewhere; {help}")));
    }
    match format {
        FormatArg::Json => terminal.json(&manual::nodes(found.iter().filter_map(|found| registry.info(found.kind)))),
        FormatArg::Markdown => {
            let nodes = found.iter().filter_map(|found| registry.info(found.kind)).map(markdown::node);
            terminal.data(&nodes.collect::<Vec<_>>().join("\n"))
        }
        FormatArg::Human => {
            let mut page = terminal.page();
            human::found(&mut page, &found, terminal.width());
            terminal.print(&page)
        }
    }
}
