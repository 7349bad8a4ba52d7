//! `shibo fit`: finds the values of parameters with which a graph looks like a photograph.
mod drawn;
mod evaluate;
mod light;
mod photo;
mod preset;
mod report;
mod setup;
mod sheet;

use crate::args::{ValueArgs, region};
use crate::check::FormatArg;
use crate::graph_files::{read, text};
use crate::interrupt;
use crate::library;
use crate::open;
use crate::quit::Quit;
use crate::report as diagnostics;
use crate::terminal::Terminal;
use clap::Args;
use evaluate::Evaluator;
use light::Light;
use photo::Photo;
use setup::Setup;
use shibo_engine::eval::CancelToken;
use shibo_engine::session::{Session, Settings};
use shibo_fit::{Failure, Fit, Problem, fit};
use shibo_graph::{LoadOptions, Loaded};
use shibo_value::clock::Stopwatch;
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

The photograph need not show the same place as the render: statistics are compared, not pixels. Each value has an error, and values
that the photograph does not determine are named. Ctrl-C writes the best values so far; the exit code is then 130.";

/// Find the values with which a graph looks like a photograph.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct FitArgs {
    /// The graph file, or `shibo:NAME` for a graph that comes with the program.
    graph: PathBuf,
    /// The photograph.
    photo: PathBuf,
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
    #[arg(long, value_name = "auto|graph|AZ,EL", default_value = "auto", value_parser = light::light, allow_hyphen_values = true)]
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
    let clock = (Stopwatch::process(), Stopwatch::wall());
    check(args)?;
    let registry = library::registry();
    let of_library = args.graph.to_string_lossy().starts_with("shibo:");
    let before = if of_library { None } else { Some(text(&args.graph, read(&args.graph).map_err(Quit::failed)?)?) };
    let loaded = open::load_text(&args.graph, before.clone(), &registry, &ValueArgs::default(), None);
    let sources = loaded.sources.clone();
    let graph = open::graph(loaded, terminal)?;
    let before = before.or_else(|| Some(sources.text(FileId(0)).to_string())).unwrap_or_default();
    let photo = Photo::read(args, terminal)?;
    let cancel = CancelToken::default();
    interrupt::cancel_on_signals(&cancel);
    let settings =
        Settings { threads: usize::from(args.threads), memory: u64::from(args.memory) << 20, ..Settings::default() };
    let session = Session::new(registry, &settings).map_err(|error| Quit::Failed(error.into()))?;
    let setup = Setup::of(args, &session, (&graph, &before), &photo, &cancel, terminal)?;
    photo.warn(&setup.gauge, setup.stretched, terminal);
    let evaluator = Evaluator::new(args, &session, &setup, &cancel, terminal, clock.1);
    // A graph that fails as it is fails as in `render`.
    evaluator.try_start().map_err(|failure| open::failed(failure.0, &failure.1, terminal))?;
    let problem = Problem {
        unknowns: setup.unknowns.clone(),
        starts: setup.starts.clone(),
        target: setup.gauge.numbers(&photo.picture, setup.stretched),
        scale: setup.gauge.scale().clone(),
        renders: args.renders.map(|count| count as usize),
        seed: args.seed,
    };
    evaluator.announce(&photo);
    let fitted = fit(&problem, &evaluator);
    evaluator.finish();
    let fitted = fitted.map_err(|failure| none(failure, terminal))?;
    let done = Done { args, setup: &setup, photo: &photo, fit: &fitted, cpu: clock.0.elapsed().as_secs_f64() };
    finish(&done, &evaluator, &before, of_library, terminal)
}

/// A finished fit.
struct Done<'d> {
    args: &'d FitArgs,
    setup: &'d Setup,
    photo: &'d Photo,
    fit: &'d Fit,
    cpu: f64,
}

fn none(failure: Failure, terminal: &Terminal) -> Quit {
    match failure {
        Failure::Cancelled => {
            terminal.error("interrupted before the first render; nothing was written");
            Quit::Interrupted
        }
        Failure::AllRefused => Quit::failed(
            "the graph refused all values at this size of the canvas: give a larger --width-mm, or fix parameters with --fixed",
        ),
    }
}

/// Checks numbers before any file is read.
fn check(args: &FitArgs) -> Result<(), Quit> {
    let positive = |name: &str, value: Option<f64>| match value {
        Some(value) if !(value.is_finite() && value > 0.0) => {
            Err(Quit::Usage(format!("{name} is {value}; it must be a number above 0")))
        }
        _ => Ok(()),
    };
    positive("--width-mm", args.width_mm)?;
    positive("--seconds", args.seconds)
}

/// Writes the preset, the sheet and the report.
fn finish(
    done: &Done<'_>,
    evaluator: &Evaluator<'_>,
    before: &str,
    of_library: bool,
    terminal: &Terminal,
) -> Result<(), Quit> {
    let args = done.args;
    let (name, after) = preset::text(done, before)?;
    check_text(&args.graph, &after, &name, evaluator.session, terminal)?;
    let mut written = Ok(());
    if !args.dry_run && !of_library {
        written = preset::write(&args.graph, before, &after);
    }
    let in_file = !args.dry_run && !of_library && written.is_ok();
    if let Some(path) = &args.sheet
        && !done.fit.cancelled
    {
        sheet::write(path, done, evaluator)?;
    }
    match args.format {
        FormatArg::Json => terminal.json(&report::json(done, &name))?,
        FormatArg::Human => {
            let lines = preset::lines(done, &name);
            terminal.data(&report::page(done, &name, in_file.then_some(args.graph.as_path()), &lines))?;
        }
    }
    if let Err(message) = written {
        // The values are not lost if the file cannot be written.
        if matches!(args.format, FormatArg::Json) {
            terminal.say(&preset::lines(done, &name));
        }
        return Err(Quit::failed(message));
    }
    if done.fit.cancelled { Err(Quit::Interrupted) } else { Ok(()) }
}

/// A text that does not load with its new preset is not written.
fn check_text(path: &Path, text: &str, preset: &str, session: &Session, terminal: &Terminal) -> Result<(), Quit> {
    let options = LoadOptions {
        preset: Some(preset.to_owned()),
        import_paths: crate::environment::import_paths().to_vec(),
        ..LoadOptions::default()
    };
    let loaded: Loaded = shibo_graph::load_text(path, text, session.registry(), &options);
    if loaded.graph.is_none() {
        diagnostics::show(terminal, &loaded.diagnostics, &loaded.sources);
        return Err(Quit::failed(format!("`{}` was left alone: it would not load with the preset", path.display())));
    }
    Ok(())
}
