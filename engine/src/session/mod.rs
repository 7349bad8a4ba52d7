//! The engine's interface for programs: load a graph, render it, inspect it. A [`Session`] holds all state.
mod bands;
mod clipped;
mod export;
mod files;
mod fitted;
mod job;
mod look;
mod part;
mod pictures;
mod plan;
mod points;
mod render;
mod sink;
mod storage;
mod verify;
mod warned;

pub use look::Look;
pub use part::{PartReport, Prepared};
pub use render::{RenderRequest, Report};

use crate::diagnostics::{Code, Diagnostic, Problem};
use crate::eval::{
    CacheError, Caches, CancelToken, DiskCache, Keys, MemoryCache, NodeStats, Observer, Run, Seal, Store, code, defect,
};
use crate::graph::{self, Graph, LoadOptions, Loaded};
use crate::picture::{contain_thread, contained};
use crate::registry::Registry;
use crate::value::{Field, Grid, Stop, Tile, Value, Window};
use petgraph::graph::NodeIndex;
use rayon::ThreadPool;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Memory kept for reuse is at most one part in this many of the memory for results.
const SPARE: u64 = 8;

/// The resources that a session may use.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Number of worker threads; 0 for one per core.
    pub threads: usize,
    /// Bytes for results in memory; nodes may take as many again for their computation.
    pub memory: u64,
    /// The folder of the disk cache, if one is used.
    pub cache_dir: Option<PathBuf>,
    /// The most bytes in the disk cache.
    pub disk: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { threads: 0, memory: 1536 << 20, cache_dir: None, disk: 4 << 30 }
    }
}

/// Reason why a session could not start.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// The threads could not be started.
    #[error("cannot start {threads} threads: {source}")]
    Threads {
        /// Number of threads.
        threads: usize,
        /// The cause.
        source: rayon::ThreadPoolBuildError,
    },
}

/// Reason why there is no result.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Failure {
    /// The work was cancelled.
    Cancelled,
    /// Errors in the graph, at their places.
    Errors(Vec<Diagnostic>),
    /// A file that could not be written, with the cause.
    File(String),
    /// An invalid request.
    Usage(String),
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Cancelled => f.write_str("cancelled"),
            Self::Errors(errors) => {
                let messages: Vec<&str> = errors.iter().map(|error| error.message.as_str()).collect();
                f.write_str(&messages.join("; "))
            }
            Self::File(text) | Self::Usage(text) => f.write_str(text),
        }
    }
}

impl std::error::Error for Failure {}

impl From<Vec<Diagnostic>> for Failure {
    fn from(errors: Vec<Diagnostic>) -> Self {
        if errors.is_empty() { Self::Cancelled } else { Self::Errors(errors) }
    }
}

/// The engine with its nodes, threads and caches.
pub struct Session {
    registry: Arc<Registry>,
    caches: Caches,
    pool: ThreadPool,
    memory: u64,
    cache_error: Option<CacheError>,
}

impl Session {
    /// A session with the node kinds of `registry`. If the cache folder cannot be used, the session runs without it;
    /// see [`cache_error`](Self::cache_error).
    ///
    /// # Errors
    /// Threads cannot be started.
    pub fn new(registry: impl Into<Arc<Registry>>, settings: &Settings) -> Result<Self, SessionError> {
        let registry = registry.into();
        let open = |dir: &PathBuf| DiskCache::open(dir, settings.disk, Seal::new(code(&registry)));
        match settings.cache_dir.as_ref().map(open).transpose() {
            Ok(disk) => Self::with_store(registry, settings, disk.map(|disk| Box::new(disk) as Box<dyn Store>)),
            Err(error) => Ok(Self { cache_error: Some(error), ..Self::with_store(registry, settings, None)? }),
        }
    }

    /// Creates a session with the given store instead of a cache folder; the folder in `settings` is ignored.
    ///
    /// # Errors
    /// Threads cannot be started.
    pub fn with_store(
        registry: impl Into<Arc<Registry>>,
        settings: &Settings,
        store: Option<Box<dyn Store>>,
    ) -> Result<Self, SessionError> {
        let threads = settings.threads;
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        // WebAssembly cannot start threads: the thread of the host does all the work.
        #[cfg(target_family = "wasm")]
        let pool = pool.num_threads(1).use_current_thread();
        let pool = pool
            .thread_name(|i| format!("shibo-{i}"))
            .start_handler(|_| contain_thread())
            .build()
            .map_err(|source| SessionError::Threads { threads, source })?;
        let caches = Caches::new(MemoryCache::new(settings.memory), store);
        crate::value::hold_back(settings.memory / SPARE);
        Ok(Self { registry: registry.into(), caches, pool, memory: settings.memory, cache_error: None })
    }

    /// Bytes for results in memory, as in [`Settings::memory`].
    pub const fn memory(&self) -> u64 {
        self.memory
    }

    /// The node kinds that graphs may use.
    pub fn registry(&self) -> &Registry {
        &self.registry
    }

    /// The caches.
    pub fn caches(&self) -> &Caches {
        &self.caches
    }

    /// The reason why the cache folder is not used, if it could not be opened.
    pub fn cache_error(&self) -> Option<&CacheError> {
        self.cache_error.as_ref()
    }

    /// Reads and checks a graph file.
    pub fn load(&self, path: &Path, options: &LoadOptions) -> Loaded {
        graph::load(path, &self.registry, options)
    }

    /// Advice that needs the whole graph: outputs that should tile but do not.
    pub fn advice(&self, graph: &Graph) -> Vec<Diagnostic> {
        graph.advice()
    }

    /// Runs `work` with a run of `graph` on the session's threads.
    fn run<T: Send>(
        &self,
        graph: &Graph,
        cancel: &CancelToken,
        observer: &dyn Observer,
        work: impl FnOnce(&Run<'_>) -> Result<T, Failure> + Send,
    ) -> Result<T, Failure> {
        self.pooled(graph, || {
            let keys = Keys::of(graph)?;
            let run = Run::new(graph, &keys, &self.caches, self.memory, cancel, observer);
            let result = work(&run);
            run.report_values();
            run.relieve();
            self.trim();
            result
        })
    }

    /// Runs `work` on the session's threads. A panic is reported at the canvas of `graph`: panics in code of nodes are
    /// reported at the node, so this one is a defect of the engine.
    fn pooled<T: Send>(&self, graph: &Graph, work: impl FnOnce() -> Result<T, Failure> + Send) -> Result<T, Failure> {
        let told = |said: String| Failure::Errors(vec![Diagnostic::from_problem(defect(&said), graph.canvas_span)]);
        contained(|| self.pool.install(work)).unwrap_or_else(|said| Err(told(said)))
    }

    /// The value of an output of a node; a field is not evaluated yet.
    ///
    /// # Errors
    /// Errors of the graph, at their places.
    pub fn value(
        &self,
        graph: &Graph,
        at: (NodeIndex, usize),
        cancel: &CancelToken,
        observer: &dyn Observer,
    ) -> Result<Value, Failure> {
        self.run(graph, cancel, observer, |run| {
            run.values(&[at])?.pop().ok_or_else(|| {
                let span = graph.nodes[at.0].span;
                Failure::Errors(vec![Diagnostic::new(Code::BadValue, span, "the node made nothing")])
            })
        })
    }

    /// Computes the values of a field of `graph` in windows of grids; also returns statistics of the work.
    ///
    /// # Errors
    /// Errors of the graph, at their places.
    pub fn rasters(
        &self,
        graph: &Graph,
        field: &Field,
        wanted: &[(Grid, Window)],
        cancel: &CancelToken,
        observer: &dyn Observer,
    ) -> Result<(Vec<Tile>, Vec<NodeStats>), Failure> {
        self.run(graph, cancel, observer, |run| {
            let mut tiles = Vec::with_capacity(wanted.len());
            for (grid, window) in wanted {
                let bytes = window.len() as u64 * 4 * field.channels() as u64;
                if bytes > self.memory {
                    let message =
                        format!("the picture needs {} MiB; {} MiB are allowed", bytes >> 20, self.memory >> 20);
                    let problem = Problem::new(Code::TooLarge, message).help("lower the resolution, or raise --memory");
                    return Err(Failure::Errors(vec![Diagnostic::from_problem(problem, graph.canvas_span)]));
                }
                tiles.push(run.raster(field, grid, *window).map_err(|stop| located(run, graph, stop))?);
            }
            Ok((tiles, run.stats()))
        })
    }
}

impl Session {
    /// Computes the values of a field of `graph` in a window of a grid into the caller's memory: row by row from the
    /// top, with the channels of a pixel interleaved, `window.len() * field.channels()` values. Returns statistics of
    /// the work.
    ///
    /// # Errors
    /// Errors of the graph, at their places; `out` with another length. The content of `out` is then unspecified.
    pub fn raster_into(
        &self,
        graph: &Graph,
        field: &Field,
        (grid, window): (&Grid, Window),
        out: &mut [f32],
        cancel: &CancelToken,
        observer: &dyn Observer,
    ) -> Result<Vec<NodeStats>, Failure> {
        let wanted = window.len() * field.channels();
        if out.len() != wanted {
            return Err(Failure::Usage(format!("the window has {wanted} values, the memory for them {}", out.len())));
        }
        self.run(graph, cancel, observer, |run| {
            run.raster_into(field, grid, window, out).map_err(|stop| located(run, graph, stop))?;
            Ok(run.stats())
        })
    }
}

/// The failure for a stop, at its place, or at the canvas if its place is unknown.
fn located(run: &Run<'_>, graph: &Graph, stop: Stop) -> Failure {
    run.diagnose(stop, graph.canvas_span).map_or(Failure::Cancelled, |d| Failure::Errors(vec![d]))
}
