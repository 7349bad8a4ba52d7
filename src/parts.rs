//! `shibo prepare` and `shibo join`: the steps before and after `shibo render --part`, which makes the parts of a
//! picture.
use crate::args::{EngineArgs, ValueArgs, resolution};
use crate::interrupt;
use crate::library;
use crate::open;
use crate::progress::{Progress, ProgressArgs};
use crate::quit::Quit;
use crate::report;
use crate::terminal::Terminal;
use clap::Args;
use shibo_engine::eval::{CancelToken, DiskCache, NodeState, Seal};
use shibo_engine::session::{Prepared, RenderRequest};
use shibo_picture::{self as picture, JoinError, JoinedPart};
use shibo_value::{Key, Resolution};
use std::path::{Path, PathBuf};

const PREPARE: &str = "\
Examples:
  shibo prepare calf.ron --resolution 8192        once
  shibo render calf.ron --resolution 8192 --part 1/4 -o parts    and 2/4, 3/4, 4/4, on machines that share the cache
  shibo join parts -o maps";

/// Compute and keep what all parts of a graph's pictures need: simulations, analyses, whole pictures.
#[derive(Args, Debug)]
#[command(after_help = PREPARE)]
pub(crate) struct PrepareArgs {
    /// The graph file, or `shibo:NAME` for a graph that comes with the program.
    graph: PathBuf,
    /// Prepare only this output, or this channel of a material (NAME.CHANNEL); may be repeated.
    #[arg(long, value_name = "NAME")]
    output: Vec<String>,
    /// The pixels of the pictures, instead of the graph's: of the longer side, or width and height.
    #[arg(long, value_name = "N|WxH", value_parser = resolution)]
    resolution: Option<Resolution>,
    #[command(flatten)]
    values: ValueArgs,
    #[command(flatten)]
    engine: EngineArgs,
    #[command(flatten)]
    progress: ProgressArgs,
}

/// Runs `shibo prepare`.
pub(crate) fn prepare(args: &PrepareArgs, terminal: &Terminal) -> Result<(), Quit> {
    let cancel = CancelToken::default();
    interrupt::cancel_on_signals(&cancel);
    let registry = library::registry();
    let graph = open::graph(open::load(&args.graph, &registry, &args.values, args.resolution), terminal)?;
    let (session, shared) = open::opened(registry, &args.engine, terminal)?;
    let request = RenderRequest { outputs: args.output.clone(), ..RenderRequest::default() };
    let progress = Progress::with(terminal, &args.progress);
    let result = session.prepare(&graph, &request, &cancel, &progress);
    open::closed(shared, terminal);
    report::show(terminal, &progress.finish(), &graph.sources);
    let done = result.map_err(|failure| open::failed(failure, &graph.sources, terminal))?;
    let mut page = terminal.page();
    for stored in &done.stored {
        page.push(&format!("{:9.3} s {:9.1} MiB  {}", stored.seconds, stored.bytes as f64 / 1_048_576.0, stored.node));
        page.end();
    }
    terminal.print(&page)?;
    if !args.progress.quiet {
        terminal.say(&summary(&done));
    }
    Ok(())
}

fn summary(done: &Prepared) -> String {
    let known = done.nodes.iter().filter(|node| node.state == NodeState::Disk).count();
    let bytes: u64 = done.stored.iter().map(|stored| stored.bytes).sum();
    format!("stored {} results, {} MiB; {known} were there already", done.stored.len(), bytes >> 20)
}

const JOIN: &str = "\
Examples:
  shibo join parts -o maps

Nothing is written if a part is missing, doubled, damaged or of another picture; the parts are left as they are.";

/// Join the parts of pictures that `render --part` made into the files of a single run.
#[derive(Args, Debug)]
#[command(after_help = JOIN)]
pub(crate) struct JoinArgs {
    /// The folder of the parts.
    parts: PathBuf,
    /// The folder for the pictures; made if need be.
    #[arg(short, long, value_name = "DIR", default_value = "out")]
    out: PathBuf,
    /// Remove the parts after joining, and the cache that jobs make beside them.
    #[arg(long)]
    remove: bool,
    /// Threads to compress with; one per core if not given.
    #[arg(long, value_name = "N", default_value_t = 0, hide_default_value = true, value_parser = clap::value_parser!(u16).range(0..=1024))]
    threads: u16,
    /// Memory to use, in MiB.
    #[arg(long, value_name = "MIB", default_value_t = 1536, value_parser = clap::value_parser!(u32).range(16..))]
    memory: u32,
    #[command(flatten)]
    progress: ProgressArgs,
}

/// Runs `shibo join`.
pub(crate) fn join(args: &JoinArgs, terminal: &Terminal) -> Result<(), Quit> {
    let cancel = CancelToken::default();
    interrupt::cancel_on_signals(&cancel);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(usize::from(args.threads)).build();
    let pool = pool.map_err(|error| Quit::failed(format!("cannot start threads: {error}")))?;
    let made_here = !args.out.exists();
    std::fs::create_dir_all(&args.out)
        .map_err(|e| Quit::failed(format!("cannot make the folder `{}`: {e}", args.out.display())))?;
    let _ = picture::remove_stale_temporaries(&args.out);
    let progress = Progress::with(terminal, &args.progress);
    let told = |done: u64, total: u64| {
        progress.of_all(done >> 20, (total >> 20).max(1), "MiB");
        !cancel.is_cancelled()
    };
    let joined = pool.install(|| picture::join(&args.parts, &args.out, u64::from(args.memory) << 20, &told));
    progress.finish();
    let joined = joined.map_err(|error| {
        if made_here {
            // Succeeds only if the folder is empty.
            let _ = std::fs::remove_dir(&args.out);
        }
        refused(error, terminal)
    })?;
    if args.remove {
        remove(&args.parts, &joined.parts);
    }
    for file in &joined.files {
        if !args.progress.quiet {
            terminal.say(&format!("wrote {}", file.path.display()));
        }
        let range = (f64::from(file.range.0), f64::from(file.range.1));
        file.written.and_then(|written| written.loss(&file.path, range)).iter().for_each(|text| terminal.warning(text));
    }
    Ok(())
}

/// Removes the joined parts, then the results that a job keeps beside them, then the folder if it is empty. Errors are
/// ignored, since the pictures are complete.
fn remove(dir: &Path, parts: &[JoinedPart]) {
    parts.iter().for_each(JoinedPart::remove);
    let cache = dir.join("cache");
    if !cache.is_symlink()
        && DiskCache::is_cache(&cache)
        && let Ok(disk) = DiskCache::open(&cache, u64::MAX, Seal::new(Key::of("no build", &[])))
    {
        disk.remove_all();
    }
    // Succeeds only if the folder is empty.
    let _ = std::fs::remove_dir(dir);
}

fn refused(error: JoinError, terminal: &Terminal) -> Quit {
    match error {
        JoinError::Cancelled => Quit::failed("interrupted; nothing was written, and the parts are as they were"),
        JoinError::Parts(bad) => {
            bad.iter().for_each(|line| terminal.error(line));
            terminal.say("nothing was written");
            Quit::Shown
        }
        other => Quit::failed(other.to_string()),
    }
}
