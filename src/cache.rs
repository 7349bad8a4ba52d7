//! `shibo cache`: the results kept on disk.
use crate::open;
use crate::quit::Quit;
use crate::terminal::Terminal;
use clap::{Args, Subcommand};
use serde_json::json;
use shibo_engine::eval::{DiskCache, DiskUse, Seal};
use shibo_engine::value::Key;
use std::path::PathBuf;

/// Look at, or empty, the cache of results.
#[derive(Args, Debug)]
pub(crate) struct CacheArgs {
    #[command(subcommand)]
    action: Action,
    /// The folder of the cache; $XDG_CACHE_HOME/shibo or ~/.cache/shibo if not given.
    #[arg(long, value_name = "DIR", global = true)]
    cache_dir: Option<PathBuf>,
}

/// What to do with it.
#[derive(Debug, Subcommand)]
enum Action {
    /// Print how much it holds, as JSON.
    Stat,
    /// Remove everything.
    Clear,
}

/// Runs the command.
pub(crate) fn run(args: &CacheArgs, terminal: &Terminal) -> Result<(), Quit> {
    let Some(dir) = open::cache_dir(args.cache_dir.as_deref(), terminal) else {
        return Err(Quit::failed("there is no cache"));
    };
    match args.action {
        Action::Stat => {
            let usage = if dir.is_dir() { open_cache(&dir)?.usage() } else { DiskUse::default() };
            terminal.json(&json!({ "dir": dir.to_string_lossy(), "entries": usage.entries, "bytes": usage.bytes }))
        }
        Action::Clear => {
            let usage = if dir.is_dir() { open_cache(&dir)?.clear() } else { DiskUse::default() };
            terminal.say(&format!(
                "removed {} entries, {} MiB, from {}",
                usage.entries,
                usage.bytes >> 20,
                dir.display()
            ));
            Ok(())
        }
    }
}

fn open_cache(dir: &std::path::Path) -> Result<DiskCache, Quit> {
    // The entries of all builds are counted and removed, whatever the seal.
    DiskCache::open(dir, u64::MAX, Seal::new(Key::of("no build", &[]))).map_err(|e| Quit::Failed(e.into()))
}
