//! `shibo graph`: draws a graph.
mod dot;
mod fold;
mod svg;

use crate::args::ValueArgs;
use crate::library;
use crate::open;
use crate::quit::Quit;
use crate::terminal::Terminal;
use clap::{Args, ValueEnum};
use shibo_bridge::write;
use shibo_graph::{Graph, Input};
use shibo_value::Type;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  shibo graph calf.ron --format svg -o calf.svg             sub-graphs as boxes
  shibo graph calf.ron --format svg -o calf.svg --unfold    with the nodes inside of them
  shibo graph calf.ron --format dot | dot -Tpdf -o calf.pdf";

/// Draw a graph.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct GraphArgs {
    /// The graph file.
    graph: PathBuf,
    /// Format of the drawing.
    #[arg(long)]
    format: FormatArg,
    /// The file to write; stdout if not given.
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Draw the nodes of sub-graphs, too, instead of a box for each.
    #[arg(long)]
    unfold: bool,
    #[command(flatten)]
    values: ValueArgs,
}

/// Output format.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum FormatArg {
    Dot,
    Svg,
}

/// Runs the command.
pub(crate) fn run(args: &GraphArgs, terminal: &Terminal) -> Result<(), Quit> {
    let registry = library::registry();
    let graph = open::graph(open::load(&args.graph, &registry, &args.values, None), terminal)?;
    let drawing = if args.unfold { Drawing::of(&graph) } else { fold::folded(&graph, Drawing::of(&graph)) };
    let text = match args.format {
        FormatArg::Dot => dot::dot(&drawing),
        FormatArg::Svg => svg::svg(&drawing),
    };
    let Some(out) = &args.out else { return terminal.data(&text) };
    write::whole_with_folders(out, text.as_bytes())
        .map_err(|e| Quit::failed(format!("cannot write `{}`: {e}", out.display())))?;
    terminal.say(&format!("wrote {}", out.display()));
    Ok(())
}

/// A box: a node, or an output of the graph.
struct Item {
    name: String,
    /// Kind of a node; for an output, its type.
    kind: String,
    shape: Shape,
}

/// Shape of a box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shape {
    Node,
    /// A sub-graph with its content.
    Use,
    /// An output of the graph.
    Output,
}

/// A wire between boxes.
struct Wire {
    from: usize,
    to: usize,
    /// Output at which it starts, unless that is the main one.
    output: Option<String>,
    /// Port at which it ends; empty for outputs of the graph.
    port: String,
    ty: Type,
}

/// A drawing.
struct Drawing {
    title: String,
    items: Vec<Item>,
    wires: Vec<Wire>,
}

impl Drawing {
    fn of(graph: &Graph) -> Self {
        let mut items: Vec<Item> = graph
            .nodes
            .node_weights()
            .map(|n| Item { name: n.name.clone(), kind: n.kind.clone(), shape: Shape::Node })
            .collect();
        let mut wires = Vec::new();
        let port_of = |node: usize, output: usize| {
            let node = &graph.nodes[petgraph::graph::NodeIndex::new(node)];
            let name = node.node.outputs().get(output).filter(|_| output > 0).map(|o| o.name.to_owned());
            (name, node.outputs.get(output).copied().unwrap_or(Type::Gray))
        };
        for index in graph.nodes.node_indices() {
            let node = &graph.nodes[index];
            for (slot, input) in node.inputs.iter().enumerate() {
                let Input::Wire { node: from, output: out } = input else { continue };
                let (output, ty) = port_of(from.index(), *out);
                let port = node.slots.get(slot).cloned().unwrap_or_default();
                wires.push(Wire { from: from.index(), to: index.index(), output, port, ty });
            }
        }
        for out in &graph.outputs {
            let (output, ty) = port_of(out.node.index(), out.output);
            wires.push(Wire { from: out.node.index(), to: items.len(), output, port: String::new(), ty });
            items.push(Item { name: out.name.clone(), kind: out.ty.to_string(), shape: Shape::Output });
        }
        let title = graph.path.file_name().map_or(String::new(), |name| name.to_string_lossy().into_owned());
        Self { title, items, wires }
    }
}
