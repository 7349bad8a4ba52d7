//! `shibo changes`: the table of changes.
use crate::library;
use crate::quit::Quit;
use crate::terminal::Terminal;
use clap::{Args, ValueEnum};
use serde_json::json;
use shibo_node::changes::{Change, Keeps, Look, Thing, Touches};
use shibo_value::diagnostics::suggest;

const EXAMPLES: &str = "\
Examples:
  shibo changes                        all changes that alter pictures or names
  shibo changes --since 38             those after change 38
  shibo changes WoodRays goat          those of a kind and of a shipped graph
  shibo changes --format json          the same for programs";

/// List the changes of nodes and shipped graphs that alter pictures or names.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct ChangesArgs {
    /// Kinds of nodes and shipped graphs.
    #[arg(value_name = "NAME")]
    names: Vec<String>,
    /// Only changes after this one.
    #[arg(long, value_name = "CHANGE", default_value_t = 0, hide_default_value = true)]
    since: u32,
    /// Output format.
    #[arg(long, default_value = "human")]
    format: FormatArg,
}

/// Output format.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum FormatArg {
    Human,
    Json,
}

/// Runs the command.
pub(crate) fn run(args: &ChangesArgs, terminal: &Terminal) -> Result<(), Quit> {
    let registry = library::registry();
    let mut known: Vec<&str> = registry.kinds().collect();
    known.extend(registry.library().map_or(Vec::new(), |library| library.names()));
    if let Some(name) = args.names.iter().find(|name| !known.contains(&name.as_str())) {
        let help = suggest(name, "kind or graph", &known);
        return Err(Quit::Usage(format!("there is no kind and no shipped graph `{name}`; {help}")));
    }
    let changes = registry.changes();
    if args.since > changes.newest() {
        let newest = changes.newest();
        return Err(Quit::Usage(format!("change {} is unknown: the newest is {newest}", args.since)));
    }
    let wanted = |change: &&Change| match change.thing() {
        Thing::Kind(name) | Thing::Graph(name) => args.names.is_empty() || args.names.iter().any(|one| one == name),
        Thing::All => true,
    };
    let found: Vec<&Change> = changes.since(args.since).filter(wanted).collect();
    match args.format {
        FormatArg::Json => terminal.json(&json!({ "changes": found })),
        FormatArg::Human => terminal.data(&found.into_iter().map(line).collect::<String>()),
    }
}

/// A change in words, with a line break.
fn line(change: &Change) -> String {
    let thing = match change.thing() {
        Thing::Kind(kind) => format!("`{kind}` {}", change.version),
        Thing::Graph(graph) => format!("`shibo:{graph}` {}", change.version),
        Thing::All => "everything".to_owned(),
    };
    let uses = match &change.touches {
        Touches::All => String::new(),
        Touches::Given(fields) => format!(" (where {} is written)", fields.join(" or ")),
        Touches::Values(field, values) => format!(" (where {field} is {})", values.join(" or ")),
        Touches::Outputs(outputs) => format!(" (where {} is read)", outputs.join(" or ")),
    };
    let look = match change.look {
        Look::Roundings => ", at most 1 of 255",
        Look::Look => "",
        Look::Names => ", names only",
    };
    let kept = match change.keeps {
        Keeps::Gone => "",
        Keeps::Kernel | Keeps::Text => "; the version before is kept",
    };
    format!("{:>4}  {thing}: {}{uses}{look}{kept}\n", change.change, change.what)
}
