//! `shibo schema`: the JSON Schema of graphs in the JSON form.
use crate::library;
use crate::quit::Quit;
use crate::terminal::Terminal;
use clap::Args;
use shibo_value::diagnostics::suggest;

const EXAMPLES: &str = "\
Examples:
  shibo schema > graph.schema.json     of graphs as `shibo fmt --to json` prints them
  shibo schema --kind Perlin           of the fields of one kind

The schema knows kinds, fields, words, ranges and what must be given, not the names of a graph: `shibo check` knows these too.";

/// Print the JSON Schema of graphs in the JSON form.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct SchemaArgs {
    /// Describe the fields of one kind of nodes.
    #[arg(long, value_name = "KIND")]
    kind: Option<String>,
}

/// Runs the command.
pub(crate) fn run(args: &SchemaArgs, terminal: &Terminal) -> Result<(), Quit> {
    let tools = library::tools();
    let Some(kind) = &args.kind else { return terminal.json(&shibo_bridge::schema(&tools)) };
    match shibo_bridge::kind_schema(&tools, kind) {
        Some(schema) => terminal.json(&schema),
        None => {
            let kinds: Vec<&str> = tools.registry.kinds().chain(["Use", "Each"]).collect();
            Err(Quit::Usage(format!("there is no kind `{kind}`; {}", suggest(kind, "kind", &kinds))))
        }
    }
}
