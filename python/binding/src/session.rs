//! The session: threads and caches shared by graphs.
use crate::diagnostics::exception;
use pyo3::prelude::*;
use shibo_bridge::Tools;
use shibo_engine::eval::{CancelToken, DiskCache};
use shibo_engine::session::{Session as Engine, Settings};
use shibo_graph::Gate;
use std::path::PathBuf;
use std::sync::Arc;

/// Threads and caches for any number of graphs. Several threads of the program may use one session.
#[pyclass(frozen, module = "shibo")]
pub(crate) struct Session {
    pub(crate) inner: Arc<Engine>,
    /// The kinds of nodes, and more folders for imports.
    pub(crate) tools: Tools,
}

#[pymethods]
impl Session {
    #[new]
    #[pyo3(signature = (*, threads=0, memory=1536, cache_dir=None, cache_size=4096, usual_cache=false, import_path=Vec::new()))]
    #[allow(clippy::too_many_arguments, reason = "they are named in Python")]
    fn new(
        py: Python<'_>,
        threads: u16,
        memory: u32,
        cache_dir: Option<PathBuf>,
        cache_size: u32,
        usual_cache: bool,
        import_path: Vec<PathBuf>,
    ) -> PyResult<Self> {
        cache_dir.iter().filter(|_| usual_cache).for_each(|dir| DiskCache::adopt(dir));
        let settings = Settings {
            threads: usize::from(threads),
            memory: u64::from(memory) << 20,
            cache_dir,
            disk: u64::from(cache_size) << 20,
        };
        let made = py.detach(|| {
            let registry = Arc::new(crate::registry());
            Engine::new(registry.clone(), &settings).map(|engine| (engine, registry))
        });
        match made {
            Ok((engine, registry)) => {
                let (gate, cancel) = (Gate::default(), CancelToken::default());
                let tools = Tools { registry, import_paths: import_path, gate, cancel };
                Ok(Self { inner: Arc::new(engine), tools })
            }
            Err(error) => Err(exception(py, error.to_string(), Vec::new())),
        }
    }

    /// The reason if the cache folder cannot be used.
    #[getter]
    fn cache_error(&self) -> Option<String> {
        self.inner.cache_error().map(ToString::to_string)
    }
}
