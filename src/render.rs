//! `shibo render`: renders the outputs of a graph to picture files.
use crate::args::{EngineArgs, PartRange, ValueArgs, assignment, parts, region, resolution};
use crate::find;
use crate::interrupt;
use crate::library;
use crate::open;
use crate::progress::{Progress, ProgressArgs};
use crate::quit::Quit;
use crate::report;
use crate::stats::Stats;
use crate::sweep::{self, Axis, Variants, axis, variants};
use crate::target::Target;
use crate::terminal::Terminal;
use crate::view::ViewArgs;
use clap::{Args, ValueEnum};
use shibo_engine::eval::CancelToken;
use shibo_engine::session::{Failure, RenderRequest, Report, Session};
use shibo_graph::{Graph, GraphOutput};
use shibo_picture::{Depth, Format};
use shibo_value::Resolution;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
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
  shibo render calf.ron --sweep seed=1..100 --sweep pitch=0.6..1.2/4 --sheet sheet.png
  shibo render calf.ron --part 3/16 -o parts           one of 16 parts, for `shibo join parts -o maps`
  shibo render veins.ron --output lines --format svg   segments, for plotters and engravers
  shibo render calf.ron --as usd                       the material as a USD file with its textures
  shibo render calf.ron --view ball                    the material on a ball, in the light of a studio

A second run of the same graph only copies files; after an edit, nothing costly is computed that is not downstream of it.";

/// Placeholder for the name of the preset in a path.
const PRESET: &str = "{preset}";

/// Render the outputs of a graph to picture files.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct RenderArgs {
    /// The graph file, or `shibo:NAME` for a graph that comes with the program.
    pub(crate) graph: PathBuf,
    /// The folder for the pictures; made if need be. `{preset}` in it is the name of the preset.
    #[arg(short, long, value_name = "DIR", default_value = "out")]
    pub(crate) out: PathBuf,
    /// Render only this output, or this channel of a material (NAME.CHANNEL); may be repeated.
    #[arg(long, value_name = "NAME")]
    pub(crate) output: Vec<String>,
    /// Render what this node makes, or an output of it (NODE.PORT); of a sub-graph USE/NODE. May be repeated.
    #[arg(long, value_name = "NODE")]
    node: Vec<String>,
    /// Write the materials as files for another program; other outputs are left out.
    #[arg(long = "as", value_name = "TARGET", conflicts_with_all = ["node", "region", "combined", "format", "depth"])]
    pub(crate) target: Option<Target>,
    #[command(flatten)]
    pub(crate) view: ViewArgs,
    /// The pixels of the pictures, instead of the graph's: of the longer side, or width and height.
    #[arg(long, value_name = "N|WxH", value_parser = resolution)]
    pub(crate) resolution: Option<Resolution>,
    /// Render only a part: pixels of the whole picture, from the top left.
    #[arg(long, value_name = "X,Y,W,H", value_parser = region)]
    region: Option<[u32; 4]>,
    /// Render only some rows, for `shibo join`: part I of N, or parts I to J; `--out` is the folder for the parts.
    #[arg(long, value_name = "I[-J]/N", value_parser = parts, conflicts_with_all = ["region", "target"])]
    part: Option<PartRange>,
    /// Give a parameter of the graph, or of a sub-graph (USE.PARAM), a value; may be repeated.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = assignment)]
    pub(crate) set: Vec<(String, String)>,
    /// Take the newest versions of all nodes, whatever the pins of the graph say.
    #[arg(long)]
    pub(crate) newest: bool,
    /// Render a variant for each of these values of a parameter, of `seed` or of `preset`: 1..100, 0.6..1.2/4 or a,b,c.
    /// Repeated, it renders all combinations. Files of an earlier run are left as they are.
    #[arg(long, value_name = "NAME=VALUES", value_parser = axis, conflicts_with_all = ["part", "stats"])]
    pub(crate) sweep: Vec<Axis>,
    /// Render only these variants of the sweep, counted from 1, on one of several machines. Afterwards the same
    /// command without this option lists all variants, and renders missing ones.
    #[arg(long, value_name = "I[-J]", value_parser = variants, requires = "sweep", conflicts_with = "sheet")]
    pub(crate) variants: Option<Variants>,
    /// Draw all variants on one labelled picture.
    #[arg(long, value_name = "FILE.png", requires = "sweep")]
    pub(crate) sheet: Option<PathBuf>,
    /// Use the values of a preset of the graph, or of several: `a+b`. Repeated, it makes one set of pictures per
    /// preset; file names begin with the name of the preset unless `{preset}` is in `--out`.
    #[arg(long, value_name = "NAME")]
    pub(crate) preset: Vec<String>,
    /// The format of all pictures, instead of the graph's.
    #[arg(long)]
    format: Option<FormatArg>,
    /// The samples of all pictures, instead of the graph's.
    #[arg(long)]
    depth: Option<DepthArg>,
    /// Write the channels of a material into one EXR file.
    #[arg(long)]
    combined: bool,
    /// Dither values that are rounded to integers.
    #[arg(long)]
    dither: bool,
    /// Compress quickly or well.
    #[arg(long, value_name = "HOW", default_value = "fast")]
    compress: CompressArg,
    #[command(flatten)]
    pub(crate) engine: EngineArgs,
    /// Print what the run took and did on stdout.
    #[arg(long, value_name = "FORMAT")]
    stats: Option<StatsArg>,
    #[command(flatten)]
    pub(crate) progress: ProgressArgs,
}

/// Formats of pictures.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum FormatArg {
    Png,
    Tiff,
    Exr,
    Svg,
}

/// Types of samples.
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

/// Compression levels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum CompressArg {
    Fast,
    Best,
}

/// Formats of statistics.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum StatsArg {
    /// One line of JSON for each set of pictures.
    Json,
    /// A table of the nodes by cost, sub-graphs summed.
    Human,
}

/// A set of pictures: the graph with or without a preset.
struct Set {
    graph: Graph,
    preset: Option<String>,
}

/// Runs the command.
pub(crate) fn run(args: &RenderArgs, terminal: &Terminal, start: Instant) -> Result<(), Quit> {
    if !args.sweep.is_empty() {
        return sweep::run(args, terminal);
    }
    let cancel = CancelToken::default();
    interrupt::cancel_on_signals(&cancel);
    let registry = library::registry();
    let mut sets = Vec::new();
    for preset in presets(args)? {
        let values = ValueArgs { set: args.set.clone(), preset: preset.clone(), newest: args.newest };
        let mut graph = open::graph(open::load(&args.graph, &registry, &values, args.resolution), terminal)?;
        report::show(terminal, &graph.advice(), &graph.sources);
        show_nodes(&mut graph, args)?;
        args.target.as_ref().map_or(Ok(()), |target| target.replace_outputs(&mut graph, !args.output.is_empty()))?;
        args.view.replace_outputs(&mut graph, &registry, &args.output)?;
        sets.push(Set { graph, preset });
    }
    if args.part.is_some() && sets.len() > 1 && !args.out.to_string_lossy().contains(PRESET) {
        let message = "the parts of several presets would have the same names";
        return Err(Quit::Usage(format!("{message}; write `{PRESET}` into --out")));
    }
    let (session, shared) = open::opened(registry, &args.engine, terminal)?;
    let done = sets.iter().try_for_each(|set| one_set(&session, args, (set, sets.len()), &cancel, (terminal, start)));
    open::closed(shared, terminal);
    done
}

/// Renders a set of pictures.
fn one_set(
    session: &Session,
    args: &RenderArgs,
    (set, sets): (&Set, usize),
    cancel: &CancelToken,
    (terminal, start): (&Terminal, Instant),
) -> Result<(), Quit> {
    let progress = Progress::with(terminal, &args.progress);
    let request = request(args, set, sets);
    let result = match args.part {
        Some(parts) => some_parts(session, set, &request, (parts, &stem(&args.graph)), (cancel, &progress)),
        None => session.render(&set.graph, &request, cancel, &progress),
    };
    report::show(terminal, &progress.finish(), &set.graph.sources);
    let done = result.map_err(|failure| open::failed(failure, &set.graph.sources, terminal))?;
    finish(args, set, done, terminal, start)
}

/// Renders the missing parts.
fn some_parts(
    session: &Session,
    set: &Set,
    request: &RenderRequest,
    (parts, stem): (PartRange, &str),
    (cancel, progress): (&CancelToken, &Progress<'_>),
) -> Result<Report, Failure> {
    let mut all = Report::default();
    for part in parts.each() {
        let report = session.render_part(&set.graph, request, (part, stem), cancel, progress)?;
        all.files.push(report.file);
        all.nodes = report.nodes;
    }
    Ok(all)
}

/// Name of a graph for use in file names.
pub(crate) fn stem(graph: &Path) -> String {
    let name = graph.file_stem().map_or(String::new(), |name| name.to_string_lossy().into_owned());
    file_name(name.strip_prefix("shibo:").unwrap_or(&name))
}

/// Presets of the sets of pictures.
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

/// Name of a preset as a part of a file name.
fn file_name(preset: &str) -> String {
    let allowed = |c: char| c.is_alphanumeric() || matches!(c, '_' | '-' | '+');
    preset.chars().map(|c| if allowed(c) { c } else { '_' }).collect()
}

/// Adds outputs for the nodes of `--node`; without `--output` there are no others.
pub(crate) fn show_nodes(graph: &mut Graph, args: &RenderArgs) -> Result<(), Quit> {
    if args.node.is_empty() {
        return Ok(());
    }
    if args.output.is_empty() {
        graph.outputs.clear();
    }
    args.node.iter().try_for_each(|name| add_node(graph, name).map(drop))
}

/// Adds an output for a node; returns its name, which is unique.
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
    graph.outputs.push(GraphOutput::plain(file.clone(), (index, output), ty, span));
    Ok(file)
}

fn request(args: &RenderArgs, set: &Set, sets: usize) -> RenderRequest {
    let preset = set.preset.as_deref().map_or("default".to_owned(), file_name);
    let dir = args.out.to_string_lossy();
    let named = dir.contains(PRESET);
    let dir = if named { PathBuf::from(dir.replace(PRESET, &preset)) } else { args.out.clone() };
    let prefix = if sets > 1 && !named { format!("{preset}_") } else { String::new() };
    request_of(args, &set.graph, (&dir, prefix), sets == 1)
}

/// Request for a render: outputs of a graph, folder, and prefix of the file names. `once`: it is the only render.
pub(crate) fn request_of(
    args: &RenderArgs,
    graph: &Graph,
    (dir, prefix): (&Path, String),
    once: bool,
) -> RenderRequest {
    // The nodes of `--node` are the last outputs.
    let nodes = graph.outputs.iter().rev().take(args.node.len()).map(|output| output.name.clone());
    // The outputs of `--view` are those that `--output` names, under other names.
    let mut outputs = if args.view.is_given() { Vec::new() } else { args.output.clone() };
    if !args.node.is_empty() {
        outputs.extend(nodes.collect::<Vec<_>>().into_iter().rev());
    }
    RenderRequest {
        dir: dir.to_path_buf(),
        prefix,
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
        once,
    }
}

/// Reports the result.
fn finish(args: &RenderArgs, set: &Set, done: Report, terminal: &Terminal, start: Instant) -> Result<(), Quit> {
    let graph = &set.graph;
    if !args.progress.quiet {
        for file in &done.files {
            let note = done.notes.iter().find(|(noted, _)| noted == file);
            let note = note.map_or(String::new(), |(_, note)| format!(": {note}"));
            terminal.say(&format!("wrote {}{note}", file.display()));
        }
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
