//! `shibo render`: the outputs of a graph as picture files.
use crate::args::{EngineArgs, ValueArgs, assignment, region, resolution};
use crate::find;
use crate::interrupt;
use crate::library;
use crate::open;
use crate::progress::Progress;
use crate::quit::Quit;
use crate::report;
use crate::stats::Stats;
use crate::target::Target;
use crate::terminal::Terminal;
use clap::{Args, ValueEnum};
use shibo_engine::eval::CancelToken;
use shibo_engine::graph::{Graph, GraphOutput, Storage};
use shibo_engine::picture::{Depth, Format};
use shibo_engine::session::{RenderRequest, Report};
use shibo_engine::value::Resolution;
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::time::Instant;

const EXAMPLES: &str = "\
Examples:
  shibo render calf.ron                                all outputs, into out/
  shibo render calf.ron --resolution 512 -o small      a quick look
  shibo render calf.ron --output material.height --format exr
  shibo render calf.ron --set pitch=0.5 --preset black+heavy
  shibo render calf.ron --preset black --preset oxblood -o 'out/{preset}'
  shibo render inlay.ron --set left.gap=2              a parameter of the sub-graph `left`
  shibo render calf.ron --node grain/dome              any node, also of a sub-graph
  shibo render calf.ron --region 0,0,256,256           the top left corner
  shibo render veins.ron --output lines --format svg   segments, for plotters and engravers
  shibo render calf.ron --as usd                       the material as a USD file with its textures

A second run of the same graph only copies files; after an edit, nothing costly is computed that is not downstream of it.";

/// What stands for the name of the preset in a path.
const PRESET: &str = "{preset}";

/// Render the outputs of a graph to picture files.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct RenderArgs {
    /// The graph file, or `shibo:NAME` for a graph that comes with the program.
    graph: PathBuf,
    /// The folder for the pictures; made if need be. `{preset}` in it is the name of the preset.
    #[arg(short, long, value_name = "DIR", default_value = "out")]
    out: PathBuf,
    /// Render only this output, or this channel of a material (NAME.CHANNEL); may be repeated.
    #[arg(long, value_name = "NAME")]
    output: Vec<String>,
    /// Render what this node makes, or an output of it (NODE.PORT); of a sub-graph USE/NODE. May be repeated.
    #[arg(long, value_name = "NODE")]
    node: Vec<String>,
    /// Write the materials as files for another program; other outputs are left out.
    #[arg(long = "as", value_name = "TARGET", conflicts_with_all = ["node", "region", "combined", "format", "depth"])]
    target: Option<Target>,
    /// The pixels of the pictures, instead of the graph's: of the longer side, or width and height.
    #[arg(long, value_name = "N|WxH", value_parser = resolution)]
    resolution: Option<Resolution>,
    /// Render only a part: pixels of the whole picture, from the top left.
    #[arg(long, value_name = "X,Y,W,H", value_parser = region)]
    region: Option<[u32; 4]>,
    /// Give a parameter of the graph, or of a sub-graph (USE.PARAM), a value; may be repeated.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = assignment)]
    set: Vec<(String, String)>,
    /// Use the values of a preset of the graph, or of several: `a+b`. Repeated, it makes one set of pictures each, whose
    /// names begin with that of the preset unless `{preset}` is in `--out`.
    #[arg(long, value_name = "NAME")]
    preset: Vec<String>,
    /// The format of all pictures, instead of the graph's.
    #[arg(long)]
    format: Option<FormatArg>,
    /// The samples of all pictures, instead of the graph's.
    #[arg(long)]
    depth: Option<DepthArg>,
    /// Write the channels of a material into one EXR file.
    #[arg(long)]
    combined: bool,
    /// Dither what is rounded to integers.
    #[arg(long)]
    dither: bool,
    /// Whether to compress quickly or well.
    #[arg(long, value_name = "HOW", default_value = "fast")]
    compress: CompressArg,
    #[command(flatten)]
    engine: EngineArgs,
    /// Print what the run took and did on stdout.
    #[arg(long, value_name = "FORMAT")]
    stats: Option<StatsArg>,
    /// Print errors and warnings only.
    #[arg(short, long)]
    quiet: bool,
}

/// The formats of pictures.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum FormatArg {
    Png,
    Tiff,
    Exr,
    Svg,
}

/// The types of samples.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum DepthArg {
    #[value(name = "8", help = "8-bit integers")]
    U8,
    #[value(name = "16", help = "16-bit integers")]
    U16,
    #[value(name = "f16", help = "16-bit floats")]
    F16,
    #[value(name = "f32", help = "32-bit floats")]
    F32,
}

/// How to compress.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum CompressArg {
    Fast,
    Best,
}

/// How to print what a run did.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum StatsArg {
    /// One line of JSON for each set of pictures.
    Json,
    /// A table of the nodes by cost, sub-graphs summed.
    Human,
}

/// A set of pictures: the graph with a preset, or as it is.
struct Set {
    graph: Graph,
    preset: Option<String>,
}

/// Runs the command.
pub(crate) fn run(args: &RenderArgs, terminal: &Terminal, start: Instant) -> Result<(), Quit> {
    let cancel = CancelToken::default();
    interrupt::cancel_on_signals(&cancel);
    let registry = library::registry();
    let mut sets = Vec::new();
    for preset in presets(args)? {
        let values = ValueArgs { set: args.set.clone(), preset: preset.clone() };
        let mut graph = open::graph(open::load(&args.graph, &registry, &values, args.resolution), terminal)?;
        report::show(terminal, &graph.advice(), &graph.sources);
        show_nodes(&mut graph, args)?;
        args.target.map_or(Ok(()), |target| target.replace_outputs(&mut graph, !args.output.is_empty()))?;
        sets.push(Set { graph, preset });
    }
    let session = open::session(registry, &args.engine, terminal)?;
    for set in &sets {
        let progress = Progress::new(terminal, args.quiet);
        let result = session.render(&set.graph, &request(args, set, sets.len()), &cancel, &progress);
        report::show(terminal, &progress.finish(), &set.graph.sources);
        let done = result.map_err(|failure| open::failed(failure, &set.graph.sources, terminal))?;
        finish(args, set, done, terminal, start)?;
    }
    Ok(())
}

/// The presets of the sets of pictures.
fn presets(args: &RenderArgs) -> Result<Vec<Option<String>>, Quit> {
    let mut seen = BTreeSet::new();
    if let Some(twice) = args.preset.iter().find(|preset| !seen.insert(file_name(preset).to_lowercase())) {
        let message = format!("the pictures of the preset `{twice}` would overwrite those of one before it");
        return Err(Quit::Usage(format!("{message}; name each preset once")));
    }
    if args.preset.is_empty() {
        return Ok(vec![None]);
    }
    Ok(args.preset.iter().cloned().map(Some).collect())
}

/// The name of a preset as a part of a file name.
fn file_name(preset: &str) -> String {
    let allowed = |c: char| c.is_alphanumeric() || matches!(c, '_' | '-' | '+');
    preset.chars().map(|c| if allowed(c) { c } else { '_' }).collect()
}

/// Makes outputs of the nodes that are asked for; without `--output` there are no others.
fn show_nodes(graph: &mut Graph, args: &RenderArgs) -> Result<(), Quit> {
    if args.node.is_empty() {
        return Ok(());
    }
    if args.output.is_empty() {
        graph.outputs.clear();
    }
    args.node.iter().try_for_each(|name| add_node(graph, name).map(drop))
}

/// Makes an output of what a node makes; its name, which no other output has.
pub(crate) fn add_node(graph: &mut Graph, name: &str) -> Result<String, Quit> {
    let (index, output) = find::output(graph, name)?;
    let node = &graph.nodes[index];
    let ty = node.outputs[output];
    if ty.renders().is_none() {
        return Err(Quit::Usage(format!("`{name}` is {ty}, which is no picture; `shibo dump` prints it")));
    }
    let plain: String = name.chars().map(|c| if matches!(c, '/' | '.') { '_' } else { c }).collect();
    let taken = |name: &str, graph: &Graph| graph.outputs.iter().any(|o| o.name.eq_ignore_ascii_case(name));
    let mut file = plain.clone();
    let mut number = 2;
    while taken(&file, graph) {
        file = format!("{plain}_{number}");
        number += 1;
    }
    let span = node.span;
    graph.outputs.push(GraphOutput {
        export: None,
        mesh: None,
        name: file.clone(),
        node: index,
        output,
        ty,
        format: None,
        depth: None,
        combined: false,
        range: None,
        storage: Storage::default(),
        span,
    });
    Ok(file)
}

fn request(args: &RenderArgs, set: &Set, sets: usize) -> RenderRequest {
    let preset = set.preset.as_deref().map_or("default".to_owned(), file_name);
    let dir = args.out.to_string_lossy();
    let named = dir.contains(PRESET);
    // The nodes that are asked for are the last of the outputs.
    let nodes = set.graph.outputs.iter().rev().take(args.node.len()).map(|output| output.name.clone());
    let mut outputs = args.output.clone();
    if !args.node.is_empty() {
        outputs.extend(nodes.collect::<Vec<_>>().into_iter().rev());
    }
    RenderRequest {
        dir: if named { PathBuf::from(dir.replace(PRESET, &preset)) } else { args.out.clone() },
        prefix: if sets > 1 && !named { format!("{preset}_") } else { String::new() },
        outputs,
        region: args.region,
        format: args.format.map(|format| match format {
            FormatArg::Png => Format::Png,
            FormatArg::Tiff => Format::Tiff,
            FormatArg::Exr => Format::Exr,
            FormatArg::Svg => Format::Svg,
        }),
        depth: args.depth.map(|depth| match depth {
            DepthArg::U8 => Depth::U8,
            DepthArg::U16 => Depth::U16,
            DepthArg::F16 => Depth::F16,
            DepthArg::F32 => Depth::F32,
        }),
        dither: args.dither,
        best_compression: args.compress == CompressArg::Best,
        combined: args.combined,
        once: sets == 1,
    }
}

/// Says what was done.
fn finish(args: &RenderArgs, set: &Set, done: Report, terminal: &Terminal, start: Instant) -> Result<(), Quit> {
    let graph = &set.graph;
    if !args.quiet {
        done.files.iter().for_each(|file| terminal.say(&format!("wrote {}", file.display())));
        if done.files.is_empty() {
            terminal.warning("the graph has no outputs; name what to render in `outputs: { … }`");
        }
    }
    let Some(format) = args.stats else { return Ok(()) };
    let stats = Stats::new(start, graph, done.nodes, &done.files, set.preset.as_deref());
    match format {
        StatsArg::Json => terminal.json(&stats),
        StatsArg::Human => {
            let mut page = terminal.page();
            stats.table(&mut page, graph);
            terminal.print(&page)
        }
    }
}
