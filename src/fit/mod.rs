//! `shibo fit`: finds the values of parameters with which a graph looks like a photograph.
mod among;
mod progress;
mod sheet;

use crate::args::{ValueArgs, region};
use crate::check::FormatArg;
use crate::graph_files::{read, text};
use crate::interrupt;
use crate::library;
use crate::open;
use crate::quit::Quit;
use crate::terminal::{Terminal, is_unsafe};
use clap::Args;
use progress::Progress;
use shibo_bridge::write::{self, Refused as NotWritten};
use shibo_bridge::{GraphText, Tools};
use shibo_engine::eval::CancelToken;
use shibo_engine::session::{Session, Settings};
use shibo_fit::graph::{Bench, Fitted, Fitting, Light, Photo, Refused, Request, name_for};
use shibo_value::diagnostics::FileId;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  shibo fit goat.ron scan.jpg --width-mm 40            writes the preset `scan` into goat.ron
  shibo fit goat.ron scan.jpg --width-mm 40 --dry-run  only prints it
  shibo fit goat.ron scan.jpg --only color,dye         only the colours
  shibo fit goat.ron scan.jpg --fixed age,bare         all but these
  shibo fit walnut.ron flat.png --output material.base_color --width-mm 80
  shibo fit goat.ron scan.jpg --width-mm 40 --format json --sheet fit.png
  shibo fit --among stone scan.jpg --width-mm 160      which shipped graph is nearest

The photograph need not show the same place as the render: statistics are compared, not pixels. Each value has an error, and values
that the photograph does not determine are named. Ctrl-C writes the best values so far; the exit code is then 130.";

/// Find the values with which a graph looks like a photograph.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES, allow_missing_positional = true)]
pub(crate) struct FitArgs {
    /// The graph file, or `shibo:NAME` for a graph that comes with the program.
    #[arg(required_unless_present = "among")]
    graph: Option<PathBuf>,
    /// The photograph.
    #[arg(required = true)]
    photo: PathBuf,
    /// Rank shipped graphs in place of GRAPH, and fit the nearest three: names of graphs or of families, or `all`.
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', conflicts_with_all = ["graph", "preset", "start", "only", "fixed", "sheet"])]
    among: Vec<String>,
    /// Width of the photograph in mm; found too if not given.
    #[arg(long, value_name = "W")]
    width_mm: Option<f64>,
    /// The output to compare; `lit` if the graph has it, else the colour of its material.
    #[arg(long, value_name = "NAME")]
    output: Option<String>,
    /// Name of the preset that is written; that of the photograph if not given.
    #[arg(long, value_name = "NAME")]
    preset: Option<String>,
    /// Fit only these parameters.
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', conflicts_with = "fixed")]
    only: Vec<String>,
    /// Leave these parameters as they are.
    #[arg(long, value_name = "NAME,…", value_delimiter = ',')]
    fixed: Vec<String>,
    /// Start from a preset, or from several: `a+b`.
    #[arg(long, value_name = "PRESET")]
    start: Option<String>,
    /// Direction of the light: found, that of the graph, or azimuth and elevation in degrees.
    #[arg(long, value_name = "auto|graph|AZ,EL", default_value = "auto", allow_hyphen_values = true)]
    light: Light,
    /// Take only this part of the photograph, in pixels.
    #[arg(long, value_name = "X,Y,W,H", value_parser = region)]
    crop: Option<[u32; 4]>,
    /// Compare 256 × 256 pixels instead of 128 × 128.
    #[arg(long)]
    fine: bool,
    /// Finish after about this many seconds. Results then depend on the speed of the machine.
    #[arg(long, value_name = "S")]
    seconds: Option<f64>,
    /// The most renders.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(8..=100_000))]
    renders: Option<u32>,
    /// Seed of all random numbers.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Threads to compute with; one per core if not given.
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true, value_parser = clap::value_parser!(u16).range(0..=1024))]
    threads: u16,
    /// Memory for results, in MiB.
    #[arg(long, value_name = "MIB", default_value_t = 1536, value_parser = clap::value_parser!(u32).range(16..))]
    memory: u32,
    /// Write a picture: the photograph, the fit at two seeds, and the start.
    #[arg(long, value_name = "FILE.png")]
    sheet: Option<PathBuf>,
    /// Print the preset, and leave the graph file alone.
    #[arg(long)]
    dry_run: bool,
    /// Print errors and warnings only while working.
    #[arg(short, long)]
    quiet: bool,
    /// For people, or for programs.
    #[arg(long, default_value = "human")]
    format: FormatArg,
}

/// Runs the command.
pub(crate) fn run(args: &FitArgs, terminal: &Terminal) -> Result<(), Quit> {
    let request = request(args);
    request.check("--", args.width_mm).map_err(|refused| quit(refused, terminal))?;
    let tools = library::tools();
    let Some(path) = &args.graph else {
        return among::run(args, &request, &tools, terminal);
    };
    let of_library = path.to_string_lossy().starts_with("shibo:");
    let before = if of_library { None } else { Some(text(path, read(path).map_err(Quit::failed)?)?) };
    let loaded = open::load_text(path, before.clone(), &tools.registry, &ValueArgs::default(), None);
    let sources = loaded.sources.clone();
    let graph = open::graph(loaded, terminal)?;
    let before = before.unwrap_or_else(|| sources.text(FileId(0)).to_string());
    let photo = photo(args, terminal)?;
    let cancel = CancelToken::default();
    interrupt::cancel_on_signals(&cancel);
    let session = session(args, &tools)?;
    let bench = Bench { tools: &tools, session: &session, cancel: &cancel };
    let file = GraphText { path: graph.path.clone(), text: before };
    let fitting = Fitting::of(bench, &file, &graph, &photo, &request).map_err(|refused| quit(refused, terminal))?;
    fitting.warnings().iter().for_each(|warning| terminal.warning(warning));
    let progress = Progress::new(args, terminal);
    progress.announce(&fitting, &photo);
    let fitted = fitting.run(&|done, status| progress.tell(done, status));
    progress.finish();
    let fitted = fitted.map_err(|refused| quit(refused, terminal))?;
    finish(args, &fitted, (path, &file, of_library), bench, terminal)
}

/// A session that keeps results in memory alone.
fn session(args: &FitArgs, tools: &Tools) -> Result<Session, Quit> {
    let (threads, memory) = (usize::from(args.threads), u64::from(args.memory) << 20);
    let settings = Settings { threads, memory, ..Settings::default() };
    Session::new(tools.registry.clone(), &settings).map_err(|error| Quit::Failed(error.into()))
}

/// The options of the fit.
fn request(args: &FitArgs) -> Request {
    Request {
        output: args.output.clone(),
        preset: args.preset.clone().unwrap_or_else(|| name_for(&args.photo)),
        only: args.only.clone(),
        fixed: args.fixed.clone(),
        start: args.start.clone(),
        set: Vec::new(),
        light: args.light,
        fine: args.fine,
        seconds: args.seconds,
        renders: args.renders,
        seed: args.seed,
        threads: usize::from(args.threads),
    }
}

fn photo(args: &FitArgs, terminal: &Terminal) -> Result<Photo, Quit> {
    let name = args.photo.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let name: String = name.chars().filter(|c| !is_unsafe(*c)).collect();
    Photo::read(&args.photo, &name, args.width_mm, args.crop).map_err(|refused| quit(refused, terminal))
}

/// The end of the command if there is no fit.
fn quit(refused: Refused, terminal: &Terminal) -> Quit {
    match refused {
        Refused::Usage(message) => Quit::Usage(message),
        Refused::Unfit(message) => Quit::failed(message),
        Refused::Graph(failure, sources) => open::failed(failure, &sources, terminal),
        Refused::Cancelled => {
            terminal.error("interrupted before the first render; nothing was written");
            Quit::Interrupted
        }
    }
}

/// Writes the preset, the sheet and the report.
fn finish(
    args: &FitArgs,
    fitted: &Fitted<'_>,
    (path, file, of_library): (&Path, &GraphText, bool),
    bench: Bench<'_>,
    terminal: &Terminal,
) -> Result<(), Quit> {
    let preset = fitted.preset();
    let after = preset.put(file, bench.tools).map_err(|refused| match quit(refused, terminal) {
        Quit::Shown => Quit::failed(format!("`{}` was left alone: it would not load with the preset", path.display())),
        other => other,
    })?;
    let written = if args.dry_run || of_library { Ok(false) } else { put(path, &file.text, &after) };
    if let Some(sheet) = &args.sheet
        && !fitted.fit.cancelled
    {
        sheet::write(sheet, fitted)?;
    }
    let in_file = written.as_ref().is_ok_and(|written| *written);
    match args.format {
        FormatArg::Json => terminal.json(&fitted.json())?,
        FormatArg::Human => terminal.data(&fitted.page(in_file.then_some(path)))?,
    }
    if let Err(message) = written {
        // The values are not lost if the file cannot be written.
        if matches!(args.format, FormatArg::Json) {
            terminal.say(&preset.lines());
        }
        return Err(Quit::failed(message));
    }
    if fitted.fit.cancelled { Err(Quit::Interrupted) } else { Ok(()) }
}

/// Writes the file, or says why it was left alone.
fn put(path: &Path, before: &str, after: &str) -> Result<bool, String> {
    let shown = path.display();
    write::change(path, before, after).map(|()| true).map_err(|refused| match refused {
        NotWritten::Changed => format!("`{shown}` was saved meanwhile, and left alone; the preset is above"),
        NotWritten::Failed(error) => format!("cannot write `{shown}`: {error}; the preset is above"),
    })
}
