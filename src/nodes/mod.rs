//! `shibo nodes`: the manual.
mod doc;
mod human;
mod json;
mod markdown;
mod spelling;

use crate::quit::Quit;
use crate::terminal::Terminal;
use clap::{Args, ValueEnum};
use shibo_engine::diagnostics::suggest;
use shibo_engine::node::KindInfo;
use shibo_engine::registry::Registry;

const EXAMPLES: &str = "\
Examples:
  shibo nodes                          all kinds, by family
  shibo nodes SimulateSprings          the manual of one
  shibo nodes --format json            the same for programs
  shibo nodes --format markdown        the reference, docs/nodes.md";

/// List the kinds of nodes, or show the manual of one.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct NodesArgs {
    /// The kind to show.
    kind: Option<String>,
    /// How to print.
    #[arg(long, default_value = "human")]
    format: FormatArg,
}

/// How to print.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum FormatArg {
    Human,
    Json,
    Markdown,
}

/// Runs the command.
pub(crate) fn run(args: &NodesArgs, terminal: &Terminal) -> Result<(), Quit> {
    let registry = shibo_nodes::registry();
    let one = args.kind.as_deref().map(|kind| find(&registry, kind)).transpose()?;
    match args.format {
        FormatArg::Json => terminal.json(&match one {
            Some(info) => json::nodes([info]),
            None => json::nodes(registry.kinds().filter_map(|kind| registry.info(kind))),
        }),
        FormatArg::Markdown => terminal.data(&match one {
            Some(info) => markdown::node(info),
            None => markdown::reference(&registry),
        }),
        FormatArg::Human => {
            let mut page = terminal.page();
            match one {
                Some(info) => human::node(&mut page, info, terminal.width()),
                None => human::families(&mut page, &registry, terminal.width()),
            }
            terminal.print(&page)
        }
    }
}

fn find<'r>(registry: &'r Registry, kind: &str) -> Result<&'r KindInfo, Quit> {
    registry.info(kind).ok_or_else(|| {
        let kinds: Vec<&str> = registry.kinds().collect();
        Quit::Usage(format!("there is no node `{kind}`; {}", suggest(kind, "node", &kinds)))
    })
}
