//! What several sub-commands need: a graph from a file, and a session for it.
use crate::args::{EngineArgs, ValueArgs};
use crate::environment;
use crate::quit::Quit;
use crate::report;
use crate::terminal::Terminal;
use shibo_engine::diagnostics::SourceMap;
use shibo_engine::graph::{self, Graph, LoadOptions, Loaded};
use shibo_engine::registry::Registry;
use shibo_engine::session::{Failure, Session, Settings};
use shibo_engine::value::Resolution;
use std::path::{Path, PathBuf};

/// Reads and checks a graph file.
pub(crate) fn load(path: &Path, registry: &Registry, values: &ValueArgs, resolution: Option<Resolution>) -> Loaded {
    let options = LoadOptions {
        preset: values.preset.clone(),
        set: values.set.clone(),
        resolution,
        // Without a known working folder, relative paths stay relative, which means the same.
        working_dir: std::env::current_dir().unwrap_or_default(),
        ..LoadOptions::default()
    };
    graph::load(path, registry, &options)
}

/// The graph of a file; its errors are shown, and its warnings too unless `quiet`.
pub(crate) fn graph(loaded: Loaded, terminal: &Terminal) -> Result<Graph, Quit> {
    report::show(terminal, &loaded.diagnostics, &loaded.sources);
    match loaded.graph {
        Some(graph) => Ok(graph),
        None => Err(Quit::Shown),
    }
}

/// A session with all nodes. A cache that cannot be used is a warning.
pub(crate) fn session(registry: Registry, engine: &EngineArgs, terminal: &Terminal) -> Result<Session, Quit> {
    let settings = Settings {
        threads: usize::from(engine.threads),
        memory: u64::from(engine.memory) << 20,
        cache_dir: if engine.no_cache { None } else { cache_dir(engine.cache_dir.as_deref(), terminal) },
        disk: u64::from(engine.cache_size) << 20,
    };
    let session = Session::new(registry, &settings).map_err(|e| Quit::Failed(e.into()))?;
    if let Some(error) = session.cache_error() {
        terminal.warning(&format!("{error}; nothing is kept for the next run"));
    }
    Ok(session)
}

/// The folder for results: the one given, or the user's.
pub(crate) fn cache_dir(given: Option<&Path>, terminal: &Terminal) -> Option<PathBuf> {
    let dir = given.map(Path::to_path_buf).or_else(environment::cache_dir);
    if dir.is_none() {
        terminal.warning("there is no home folder to keep results in; say `--cache-dir DIR` to keep them elsewhere");
    }
    dir
}

/// Says why there is no result.
pub(crate) fn failed(failure: Failure, sources: &SourceMap, terminal: &Terminal) -> Quit {
    match failure {
        Failure::Cancelled => Quit::failed("interrupted; files that were not complete are as they were before"),
        Failure::File(message) => Quit::failed(message),
        Failure::Usage(message) => Quit::Usage(message),
        Failure::Errors(errors) => {
            report::show(terminal, &errors, sources);
            Quit::Shown
        }
    }
}
