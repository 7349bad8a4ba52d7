//! `shibo job`: writes a graph as a job for a render farm. Existing schedulers run it; its tasks are commands of this
//! program.
mod openjd;
mod slurm;

use crate::args::{EngineArgs, ValueArgs, resolution};
use crate::library;
use crate::open;
use crate::pack;
use crate::quit::Quit;
use crate::render::stem;
use crate::report;
use crate::sweep;
use crate::terminal::Terminal;
use clap::{Args, ValueEnum};
use shibo_bridge::write;
use shibo_graph::Graph;
use shibo_value::{Resolution, TILE};
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  shibo job calf.ron -o calf.job --resolution 16384 --parts 32
  openjd check calf.job/template.yaml
  openjd run calf.job/template.yaml --step join --run-dependencies -p OutDir=/mnt/share/calf
  shibo job calf.ron -o calf.job --for slurm && calf.job/submit.sh /mnt/share/calf
  shibo job calf.ron -o many.job --resolution 1024 --sweep seed=1..500 --sweep preset=black,oxblood

The job prepares what all parts need, renders the parts, and joins them; or it renders the variants of a sweep, and lists them.
A task that failed is simply run again.";

/// Schedulers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Scheduler {
    /// Engines for `OpenJobDescription`, as AWS Deadline Cloud.
    Openjd,
    /// A Slurm cluster.
    Slurm,
}

/// Write a job that renders a graph on many machines.
#[derive(Args, Debug)]
#[command(after_help = EXAMPLES)]
pub(crate) struct JobArgs {
    /// The graph file.
    graph: PathBuf,
    /// The folder for the job; made if need be.
    #[arg(short, long, value_name = "DIR")]
    out: PathBuf,
    /// The scheduler that runs the job.
    #[arg(long = "for", value_name = "SCHEDULER", default_value = "openjd")]
    scheduler: Scheduler,
    /// Number of parts; 16, or one for each row of tiles, if not given.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    parts: Option<u32>,
    /// Render a variant for each of these values of a parameter, of `seed` or of `preset`, as `shibo render` does:
    /// 1..100, 0.6..1.2/4 or a,b,c. Repeated, it renders all combinations.
    #[arg(long, value_name = "NAME=VALUES", conflicts_with = "parts")]
    sweep: Vec<String>,
    /// Render only this output, or this channel of a material (NAME.CHANNEL); may be repeated.
    #[arg(long, value_name = "NAME")]
    output: Vec<String>,
    /// The pixels of the pictures, instead of the graph's: of the longer side, or width and height.
    #[arg(long, value_name = "N|WxH", value_parser = resolution)]
    resolution: Option<Resolution>,
    /// Dither values that are rounded to integers.
    #[arg(long)]
    dither: bool,
    #[command(flatten)]
    values: ValueArgs,
    #[command(flatten)]
    engine: EngineArgs,
}

/// Settings shared by both kinds of jobs.
struct Job {
    name: String,
    /// Path of the graph in the folder of the job.
    graph: String,
    /// Number of parts of the pictures, or of variants of a sweep.
    tasks: u32,
    /// Axes of the sweep; empty for a job of parts.
    sweep: Vec<String>,
    /// Memory for results in MiB; a task needs somewhat more.
    memory: u32,
    /// Cores per task; 0 if unspecified.
    threads: u16,
    /// Arguments after the graph, for `prepare` and `render`.
    common: Vec<String>,
    /// Further arguments for `render`.
    rendering: Vec<String>,
}

/// Runs the command.
pub(crate) fn run(args: &JobArgs, terminal: &Terminal) -> Result<(), Quit> {
    let loaded = open::load(&args.graph, &library::registry(), &args.values, args.resolution);
    let graph = open::graph(loaded, terminal)?;
    report::show(terminal, &graph.advice(), &graph.sources);
    let tasks = if args.sweep.is_empty() { parts(args, &graph)? } else { variants(args)? };
    let (files, main) = pack::gather(&args.graph, &args.values, terminal)?;
    let job = Job {
        name: stem(&args.graph),
        graph: format!("graph/{main}"),
        tasks,
        sweep: args.sweep.iter().flat_map(|axis| ["--sweep".into(), axis.clone()]).collect(),
        memory: args.engine.memory,
        threads: args.engine.threads,
        common: common(args),
        rendering: if args.dither { vec!["--dither".into()] } else { Vec::new() },
    };
    for (name, content) in files {
        put(&args.out.join("graph").join(name), &content)?;
    }
    match args.scheduler {
        Scheduler::Openjd => {
            put(&args.out.join("template.yaml"), openjd::template(&job).as_bytes())?;
            put(&args.out.join("parameter_values.yaml"), openjd::values(&job).as_bytes())?;
            put(&args.out.join("asset_references.yaml"), openjd::assets().as_bytes())?;
        }
        Scheduler::Slurm => {
            let script = args.out.join("submit.sh");
            put(&script, slurm::script(&job).as_bytes())?;
            executable(&script)?;
        }
    }
    let what = if job.sweep.is_empty() { "part" } else { "variant" };
    terminal.say(&format!("wrote {}, a job of {}", args.out.display(), report::count(u64::from(tasks), what)));
    Ok(())
}

/// Number of parts.
fn parts(args: &JobArgs, graph: &Graph) -> Result<u32, Quit> {
    if let Some(export) = graph.outputs.iter().find(|o| o.export.is_some() && args.output.is_empty()) {
        let message = format!("`{}` is made for another program, with whole pictures", export.name);
        return Err(Quit::Usage(format!("{message}; name the other outputs with --output")));
    }
    let rows = graph.canvas.resolution.y.div_ceil(TILE);
    let parts = args.parts.unwrap_or(rows.min(16));
    if parts > rows {
        return Err(Quit::Usage(format!(
            "the picture has {rows} rows of tiles, so at most as many parts; {parts} are too many"
        )));
    }
    Ok(parts)
}

/// Number of variants of a sweep.
fn variants(args: &JobArgs) -> Result<u32, Quit> {
    let axes: Result<Vec<_>, String> = args.sweep.iter().map(|text| sweep::axis(text)).collect();
    let axes = axes.map_err(Quit::Usage)?;
    if let Some(axis) = axes.iter().find(|axis| args.values.set.iter().any(|(name, _)| *name == axis.name)) {
        return Err(Quit::Usage(format!("`{}` is both set and swept; leave one of them out", axis.name)));
    }
    let count = sweep::count(&axes).map_err(Quit::Usage)?;
    Ok(u32::try_from(count).unwrap_or(u32::MAX))
}

/// Arguments shared by `prepare` and `render`.
fn common(args: &JobArgs) -> Vec<String> {
    let mut words = Vec::new();
    let mut add = |option: &str, value: String| words.extend([option.to_owned(), value]);
    if let Some(resolution) = args.resolution {
        let text = match resolution {
            Resolution::Longer(longer) => longer.to_string(),
            Resolution::Exact(size) => format!("{}x{}", size.x, size.y),
        };
        add("--resolution", text);
    }
    args.output.iter().for_each(|name| add("--output", name.clone()));
    args.values.set.iter().for_each(|(name, value)| add("--set", format!("{name}={value}")));
    args.values.preset.iter().for_each(|name| add("--preset", name.clone()));
    add("--memory", args.engine.memory.to_string());
    // Slurm determines the cores of a task itself.
    if args.engine.threads > 0 && args.scheduler == Scheduler::Openjd {
        add("--threads", args.engine.threads.to_string());
    }
    args.engine.shared_cache.iter().for_each(|url| add("--shared-cache", url.clone()));
    words
}

fn put(path: &Path, content: &[u8]) -> Result<(), Quit> {
    write::whole_with_folders(path, content)
        .map_err(|e| Quit::failed(format!("cannot write `{}`: {e}", path.display())))
}

#[cfg(unix)]
fn executable(path: &Path) -> Result<(), Quit> {
    use std::os::unix::fs::PermissionsExt;
    let done = std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o755));
    done.map_err(|e| Quit::failed(format!("cannot make `{}` executable: {e}", path.display())))
}

#[cfg(not(unix))]
fn executable(_path: &Path) -> Result<(), Quit> {
    Ok(())
}
