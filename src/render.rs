//! `shibo render`: the outputs of a graph as picture files.
use crate::args::{EngineArgs, ValueArgs, region, resolution};
use crate::interrupt;
use crate::open;
use crate::progress::Progress;
use crate::quit::Quit;
use crate::report;
use crate::stats::Stats;
use crate::terminal::Terminal;
use clap::{Args, ValueEnum};
use shibo_engine::eval::CancelToken;
use shibo_engine::graph::Graph;
use shibo_engine::picture::{Depth, Format};
use shibo_engine::session::{RenderRequest, Report};
use shibo_engine::value::Resolution;
use std::path::PathBuf;
use std::time::Instant;

const EXAMPLES: &str = "\
Examples:
  shibo render calf.ron                                all outputs, into out/
  shibo render calf.ron --resolution 512 -o small      a quick look
  shibo render calf.ron --output calf.height --format exr
  shibo render calf.ron --set pitch=0.5 --preset fine
  shibo render calf.ron --region 0,0,256,256           the top left corner
  shibo render veins.ron --output lines --format svg   segments, for plotters and engravers

A second run of the same graph only copies files; after an edit, nothing costly is computed that is not downstream of it.";

/// Render the outputs of a graph to picture files.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct RenderArgs {
    /// The graph file.
    graph: PathBuf,
    /// The folder for the pictures; made if need be.
    #[arg(short, long, value_name = "DIR", default_value = "out")]
    out: PathBuf,
    /// Render only this output, or this channel of a material (NAME.CHANNEL); may be repeated.
    #[arg(long, value_name = "NAME")]
    output: Vec<String>,
    /// The pixels of the pictures, instead of the graph's: of the longer side, or width and height.
    #[arg(long, value_name = "N|WxH", value_parser = resolution)]
    resolution: Option<Resolution>,
    /// Render only a part: pixels of the whole picture, from the top left.
    #[arg(long, value_name = "X,Y,W,H", value_parser = region)]
    region: Option<[u32; 4]>,
    #[command(flatten)]
    values: ValueArgs,
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
    Json,
}

/// Runs the command.
pub(crate) fn run(args: &RenderArgs, terminal: &Terminal, start: Instant) -> Result<(), Quit> {
    let cancel = CancelToken::default();
    interrupt::cancel_on_signals(&cancel);
    let registry = shibo_nodes::registry();
    let graph = open::graph(open::load(&args.graph, &registry, &args.values, args.resolution), terminal)?;
    report::show(terminal, &graph.advice(), &graph.sources);
    let session = open::session(registry, &args.engine, terminal)?;
    let progress = Progress::new(terminal, args.quiet);
    let result = session.render(&graph, &request(args), &cancel, &progress);
    report::show(terminal, &progress.finish(), &graph.sources);
    let done = result.map_err(|failure| open::failed(failure, &graph.sources, terminal))?;
    finish(args, &graph, done, terminal, start)
}

fn request(args: &RenderArgs) -> RenderRequest {
    RenderRequest {
        dir: args.out.clone(),
        outputs: args.output.clone(),
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
        once: true,
    }
}

/// Says what was done.
fn finish(args: &RenderArgs, graph: &Graph, done: Report, terminal: &Terminal, start: Instant) -> Result<(), Quit> {
    if !args.quiet {
        done.files.iter().for_each(|file| terminal.say(&format!("wrote {}", file.display())));
        if done.files.is_empty() {
            terminal.warning("the graph has no outputs; name what to render in `outputs: { … }`");
        }
    }
    if let Some(StatsArg::Json) = args.stats {
        let stats = Stats::new(start, graph.canvas.resolution.to_array(), done.nodes, &done.files);
        terminal.json(&stats)?;
    }
    Ok(())
}
