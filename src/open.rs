//! Helpers of several sub-commands: load a graph from a file, and open a session for it.
use crate::args::{EngineArgs, ValueArgs};
use crate::environment;
use crate::quit::Quit;
use crate::report;
use crate::shared::{self, Shared};
use crate::terminal::Terminal;
use shibo_engine::eval::{DiskCache, Layers, Seal, Store, code};
use shibo_engine::session::{Failure, Session, Settings};
use shibo_graph::{self as graph, Graph, LoadOptions, Loaded};
use shibo_node::registry::Registry;
use shibo_value::Resolution;
use shibo_value::diagnostics::SourceMap;
use std::path::{Path, PathBuf};

/// Reads and checks a graph file.
pub(crate) fn load(path: &Path, registry: &Registry, values: &ValueArgs, resolution: Option<Resolution>) -> Loaded {
    load_text(path, None, registry, values, resolution)
}

/// Reads and checks a graph file, or a text in its place.
pub(crate) fn load_text(
    path: &Path,
    text: Option<String>,
    registry: &Registry,
    values: &ValueArgs,
    resolution: Option<Resolution>,
) -> Loaded {
    let options = LoadOptions {
        preset: values.preset.clone(),
        newest: values.newest,
        set: values.set.clone(),
        resolution,
        // If the working folder is unknown, relative paths stay relative, which means the same.
        working_dir: std::env::current_dir().unwrap_or_default(),
        import_paths: environment::import_paths().to_vec(),
        ..LoadOptions::default()
    };
    match text {
        Some(text) => graph::load_text(path, &text, registry, &options),
        None => graph::load(path, registry, &options),
    }
}

/// Returns the graph of a file; shows its errors and warnings.
pub(crate) fn graph(loaded: Loaded, terminal: &Terminal) -> Result<Graph, Quit> {
    report::show(terminal, &loaded.diagnostics, &loaded.sources);
    match loaded.graph {
        Some(graph) => Ok(graph),
        None => Err(Quit::Shown),
    }
}

/// Opens a session with all nodes. An unusable cache causes a warning.
pub(crate) fn session(registry: Registry, engine: &EngineArgs, terminal: &Terminal) -> Result<Session, Quit> {
    opened(registry, engine, terminal).map(|(session, _)| session)
}

/// Opens a session with the shared cache, if there is one; the cache must be [`closed`] later.
pub(crate) fn opened(
    registry: Registry,
    engine: &EngineArgs,
    terminal: &Terminal,
) -> Result<(Session, Option<Shared>), Quit> {
    let seal = Seal::new(code(&registry));
    let shared = if engine.no_cache { None } else { shared::open(engine.shared_cache.as_deref(), seal)? };
    let settings = Settings {
        threads: usize::from(engine.threads),
        memory: u64::from(engine.memory) << 20,
        cache_dir: if engine.no_cache { None } else { cache_dir(engine.cache_dir.as_deref(), terminal) },
        disk: u64::from(engine.cache_size) << 20,
    };
    let mut stores: Vec<Box<dyn Store>> = Vec::new();
    match settings.cache_dir.as_ref().map(|dir| DiskCache::open(dir, settings.disk, seal)).transpose() {
        Ok(disk) => stores.extend(disk.map(|disk| Box::new(disk) as Box<dyn Store>)),
        Err(error) => terminal.warning(&format!("{error}; nothing is kept for the next run")),
    }
    stores.extend(shared.iter().map(|shared| Box::new(shared.store.clone()) as Box<dyn Store>));
    let store = match stores.len() {
        0 | 1 => stores.pop(),
        _ => Some(Box::new(Layers::new(stores)) as Box<dyn Store>),
    };
    let session = Session::with_store(registry, &settings, store).map_err(|e| Quit::Failed(e.into()))?;
    Ok((session, shared))
}

/// Finishes writing to the shared cache; warns if that failed.
pub(crate) fn closed(shared: Option<Shared>, terminal: &Terminal) {
    if let Some(warning) = shared.and_then(|shared| shared.finish()) {
        terminal.warning(&warning);
    }
}

/// Folder for results: the given one, or the user's.
pub(crate) fn cache_dir(given: Option<&Path>, terminal: &Terminal) -> Option<PathBuf> {
    let dir = given.map(Path::to_path_buf).or_else(usual_cache_dir);
    if dir.is_none() {
        terminal.warning("there is no home folder to keep results in; say `--cache-dir DIR` to keep them elsewhere");
    }
    dir
}

/// Default folder for results; a folder made by an earlier version gets its marker.
pub(crate) fn usual_cache_dir() -> Option<PathBuf> {
    environment::cache_dir().inspect(|dir| DiskCache::adopt(dir))
}

/// Reports a failure.
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
