//! `shibo cache`: the results kept on disk.
use crate::open;
use crate::quit::Quit;
use crate::report;
use crate::shared::{self, Address};
use crate::terminal::Terminal;
use clap::{Args, Subcommand};
use serde_json::json;
use shibo_engine::eval::{Checked, DiskCache, DiskUse, Seal, Trouble};
use shibo_value::Key;
use std::path::PathBuf;

/// Look at, or empty, the cache of results.
#[derive(Args, Debug)]
pub(crate) struct CacheArgs {
    #[command(subcommand)]
    action: Action,
    /// The cache that machines share, instead of the folder; for `clear` and `verify` it must be given here.
    #[arg(long, value_name = "URL", global = true, conflicts_with = "cache_dir")]
    shared_cache: Option<String>,
    /// The folder of the cache; $XDG_CACHE_HOME/shibo or ~/.cache/shibo if not given.
    #[arg(long, value_name = "DIR", global = true)]
    cache_dir: Option<PathBuf>,
}

/// Actions on the cache.
#[derive(Debug, Subcommand)]
enum Action {
    /// Print how much it holds, as JSON.
    Stat,
    /// Remove everything.
    Clear,
    /// Check that no entry of a shared cache was altered, with the same $SHIBO_CACHE_KEY if there is one.
    Verify,
}

/// Runs the command.
pub(crate) fn run(args: &CacheArgs, terminal: &Terminal) -> Result<(), Quit> {
    if let Some(url) = &args.shared_cache {
        return shared(url, &args.action, terminal);
    }
    let Some(dir) = open::cache_dir(args.cache_dir.as_deref(), terminal) else {
        return Err(Quit::failed("there is no cache"));
    };
    match args.action {
        Action::Stat => {
            let usage = if dir.is_dir() { open_cache(&dir)?.usage() } else { DiskUse::default() };
            terminal.json(&json!({ "dir": dir.to_string_lossy(), "entries": usage.entries, "bytes": usage.bytes }))
        }
        Action::Verify => Err(Quit::Usage("only a shared cache is verified: say `--shared-cache URL`".into())),
        Action::Clear => {
            let usage = if dir.is_dir() { open_cache(&dir)?.clear() } else { DiskUse::default() };
            terminal.say(&format!(
                "removed {}, {} MiB, from {}",
                report::count(usage.entries, "entry"),
                usage.bytes >> 20,
                dir.display()
            ));
            Ok(())
        }
    }
}

/// Handles a cache that machines share.
fn shared(url: &str, action: &Action, terminal: &Terminal) -> Result<(), Quit> {
    let address = Address::read(url).map_err(Quit::Usage)?;
    let entries = shared::entries(&address)?;
    let failed = |trouble: Trouble| Quit::failed(format!("the shared cache {address} {}", trouble.text()));
    let (mut count, mut bytes, mut foreign) = (0_u64, 0_u64, 0_u64);
    // Tags of all builds differ only by the secret.
    let seal = shared::seal(Seal::new(Key::of("no build", &[])));
    let verify = matches!(action, Action::Verify);
    if matches!(action, Action::Clear) {
        let (count, bytes) = entries.clear().map_err(failed)?;
        let entries = report::count(count, "entry");
        terminal.say(&format!("removed {entries}, {} MiB, from {address}", bytes >> 20));
        return Ok(());
    }
    let mut visit = |name: &str, size: u64, content: &[u8]| {
        (count, bytes) = (count + 1, bytes + size);
        foreign += u64::from(verify && seal.check(name, content) == Checked::Foreign);
    };
    entries.each(verify, &mut visit).map_err(failed)?;
    let place = address.to_string();
    if !verify {
        return terminal.json(&json!({ "url": place, "entries": count, "bytes": bytes }));
    }
    terminal.json(&json!({ "url": place, "entries": count, "bytes": bytes, "foreign": foreign }))?;
    if foreign == 0 {
        return Ok(());
    }
    let what = "damaged, or were written with another key; renders ignore them";
    let are = if foreign == 1 { "is" } else { "are" };
    Err(Quit::failed(format!("{foreign} of {} {are} {what}", report::count(count, "entry"))))
}

fn open_cache(dir: &std::path::Path) -> Result<DiskCache, Quit> {
    // Entries of all builds are counted and removed, so the seal does not matter.
    DiskCache::open(dir, u64::MAX, Seal::new(Key::of("no build", &[]))).map_err(|e| Quit::Failed(e.into()))
}
