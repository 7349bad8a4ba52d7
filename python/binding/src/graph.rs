//! A graph file as a Python object.
use crate::diagnostics::{Diagnostic, all, errors, exception, failed};
use crate::fit::{Fit, Options, fitted};
use crate::photo::Photo;
use crate::session::Session;
use crate::values::{Pixels, given};
use crate::wait;
use numpy::{IxDyn, PyArray, PyArrayDyn, PyArrayMethods};
use pyo3::exceptions::{PyRuntimeWarning, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use shibo_bridge::Tools;
use shibo_engine::session::{RenderRequest, Session as Engine};
use shibo_graph::{self as engine, LoadOptions};
use shibo_picture::export::Chosen;
use shibo_picture::{Depth, Format};
use shibo_value::{Canvas, Resolution, TileMode, Window};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A graph file, with values for its parameters.
#[pyclass(frozen, module = "shibo")]
pub(crate) struct Graph {
    session: Arc<Engine>,
    tools: Tools,
    path: PathBuf,
    state: Mutex<State>,
}

/// The preset and values of the graph, and the result of the last load.
#[derive(Clone, Default)]
struct State {
    preset: Option<String>,
    set: Vec<(String, String)>,
    loaded: Option<Arc<engine::Graph>>,
}

impl Graph {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Reads the file with these values.
    fn load(&self, py: Python<'_>, state: &State, resolution: Option<Resolution>) -> PyResult<engine::Graph> {
        let options = LoadOptions {
            preset: state.preset.clone(),
            set: state.set.clone(),
            resolution,
            working_dir: std::env::current_dir().unwrap_or_default(),
            import_paths: self.tools.import_paths.clone(),
            ..LoadOptions::default()
        };
        let loaded = py.detach(|| self.session.load(&self.path, &options));
        match loaded.graph {
            Some(graph) => Ok(graph),
            None => Err(errors(py, &loaded.diagnostics, &loaded.sources)),
        }
    }

    /// Takes over new values if the graph loads with them.
    fn change(&self, py: Python<'_>, mut new: State) -> PyResult<()> {
        new.loaded = Some(Arc::new(self.load(py, &new, None)?));
        *self.state() = new;
        Ok(())
    }

    /// The graph of the last load.
    fn last(&self, py: Python<'_>) -> PyResult<Arc<engine::Graph>> {
        let state = self.state().clone();
        match state.loaded {
            Some(graph) => Ok(graph),
            None => self.load(py, &state, None).map(Arc::new),
        }
    }

    /// Reads the file again, at a resolution and with further values.
    fn now(
        &self,
        py: Python<'_>,
        resolution: Option<Pixels>,
        values: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<engine::Graph> {
        let mut state = self.state().clone();
        if let Some(values) = values {
            state.set.extend(given(values)?);
        }
        self.load(py, &state, resolution.map(Resolution::from))
    }
}

#[pymethods]
impl Graph {
    #[new]
    fn new(
        py: Python<'_>,
        path: PathBuf,
        session: &Bound<'_, Session>,
        preset: Option<String>,
        values: &Bound<'_, PyDict>,
    ) -> PyResult<Self> {
        let state = State { preset, set: given(values)?, loaded: None };
        let Session { inner, tools } = session.get();
        let graph = Self { session: inner.clone(), tools: tools.clone(), path, state: Mutex::default() };
        graph.change(py, state)?;
        Ok(graph)
    }

    fn __repr__(&self) -> String {
        format!("<shibo.Graph {}>", self.path.display())
    }

    /// The file.
    #[getter]
    fn path(&self) -> PathBuf {
        self.path.clone()
    }

    /// The preset in use, or several as `a+b`.
    #[getter]
    fn preset(&self) -> Option<String> {
        self.state().preset.clone()
    }

    #[setter]
    fn set_preset(&self, py: Python<'_>, preset: Option<String>) -> PyResult<()> {
        let old = self.state().clone();
        self.change(py, State { preset, ..old })
    }

    /// The names of the presets.
    #[getter]
    fn presets(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        Ok(self.last(py)?.presets.clone())
    }

    /// The names of the outputs.
    #[getter]
    fn outputs(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        Ok(self.last(py)?.outputs.iter().map(|output| output.name.clone()).collect())
    }

    /// The parameters by name.
    #[getter]
    fn params<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let params = PyDict::new(py);
        for param in &self.last(py)?.params {
            let one = PyDict::new(py);
            one.set_item("type", param.ty)?;
            one.set_item("value", &param.value)?;
            one.set_item("default", &param.default)?;
            one.set_item("range", param.range)?;
            one.set_item("unit", &param.unit)?;
            one.set_item("group", &param.group)?;
            one.set_item("doc", &param.doc)?;
            one.set_item("options", &param.options)?;
            params.set_item(&param.name, one)?;
        }
        Ok(params)
    }

    /// Size, resolution, tiling and seed.
    #[getter]
    fn canvas<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let graph = self.last(py)?;
        let Canvas { size_mm, resolution, tile, seed } = graph.canvas;
        let modes = [(TileMode::Both, "Both"), (TileMode::X, "X"), (TileMode::Y, "Y"), (TileMode::None, "None")];
        let name = modes.iter().find(|(mode, _)| mode.tiling() == tile).map(|(_, name)| *name);
        let canvas = PyDict::new(py);
        canvas.set_item("size_mm", (size_mm.x, size_mm.y))?;
        canvas.set_item("resolution", (resolution.x, resolution.y))?;
        canvas.set_item("tile", name)?;
        canvas.set_item("seed", seed)?;
        Ok(canvas)
    }

    /// Warnings of the last load, and advice that needs the whole graph.
    #[getter]
    fn diagnostics(&self, py: Python<'_>) -> PyResult<Vec<Diagnostic>> {
        let graph = self.last(py)?;
        let mut found = graph.warnings.clone();
        found.extend(graph.advice());
        Ok(all(&found, &graph.sources))
    }

    /// Sets parameters; on an error nothing changes.
    fn set_values(&self, py: Python<'_>, values: &Bound<'_, PyDict>) -> PyResult<()> {
        let given = given(values)?;
        let mut new = self.state().clone();
        new.set.retain(|(name, _)| given.iter().all(|(other, _)| other != name));
        new.set.extend(given);
        self.change(py, new)
    }

    /// Renders an output: an array, or for a whole material a dict of arrays.
    #[pyo3(signature = (name, *, resolution=None, region=None, values=None, progress=None))]
    fn render<'py>(
        &self,
        py: Python<'py>,
        name: &str,
        resolution: Option<Pixels>,
        region: Option<[u32; 4]>,
        values: Option<&Bound<'py, PyDict>>,
        progress: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let graph = self.now(py, resolution, values)?;
        let window = window(graph.canvas.resolution.to_array(), region)?;
        let pictures = finished(
            py,
            &graph,
            wait::for_result(py, progress, |cancel, told| self.session.pictures(&graph, name, cancel, told))?,
        )?;
        let mut made = Vec::new();
        for (name, field) in pictures {
            let (height, width) = (window.height as usize, window.width as usize);
            let channels = field.channels();
            let shape = if channels == 1 { vec![height, width] } else { vec![height, width, channels] };
            let array: Bound<'py, PyArrayDyn<f32>> = PyArray::zeros(py, IxDyn(&shape), false);
            {
                let mut memory = array.readwrite();
                let out = memory.as_slice_mut().map_err(|error| PyValueError::new_err(error.to_string()))?;
                let grid = graph.canvas.grid(graph.canvas.resolution);
                let done = wait::for_result(py, progress, |cancel, told| {
                    self.session.raster_into(&graph, &field, (&grid, window), out, cancel, told)
                })?;
                finished(py, &graph, done)?;
            }
            made.push((name, array));
        }
        let [(_, one)] = &made[..] else {
            let all = PyDict::new(py);
            made.iter().try_for_each(|(name, array)| all.set_item(name, array))?;
            return Ok(all.into_any());
        };
        Ok(one.clone().into_any())
    }

    /// Writes the outputs as files, like `shibo render`.
    #[pyo3(signature = (out, *, outputs=Vec::new(), resolution=None, region=None, target=None, format=None, depth=None, values=None, progress=None))]
    #[expect(clippy::too_many_arguments, reason = "named arguments of Python")]
    fn write(
        &self,
        py: Python<'_>,
        out: PathBuf,
        outputs: Vec<String>,
        resolution: Option<Pixels>,
        region: Option<[u32; 4]>,
        target: Option<&str>,
        format: Option<&str>,
        depth: Option<&str>,
        values: Option<&Bound<'_, PyDict>>,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Vec<PathBuf>> {
        let mut graph = self.now(py, resolution, values)?;
        if let Some(name) = target {
            let all = Chosen::variants();
            let known: Vec<_> = all.iter().map(|(name, _, target)| (*name, target)).collect();
            let target = word(name, "target", &known)?;
            let named = !outputs.is_empty();
            graph.export_as(target, named).map_err(|message| exception(py, message, Vec::new()))?;
        }
        let request = RenderRequest {
            dir: out,
            outputs,
            region,
            format: format
                .map(|name| word(name, "format", &Format::ALL.map(|format| (format.extension(), format))))
                .transpose()?,
            depth: depth.map(|name| word(name, "depth", &DEPTHS)).transpose()?,
            ..RenderRequest::default()
        };
        let done = wait::for_result(py, progress, |cancel, told| self.session.render(&graph, &request, cancel, told))?;
        Ok(finished(py, &graph, done)?.files)
    }

    /// Finds the values with which an output looks like a photograph.
    #[pyo3(signature = (photo, options, *, progress=None))]
    fn fit(
        &self,
        py: Python<'_>,
        photo: Photo<'_>,
        options: Options,
        progress: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Fit> {
        let state = self.state().clone();
        // The values of the state are those to begin with; presets are compared without them.
        let graph = self.load(py, &State::default(), None)?;
        let request = options.request(state.preset, state.set, &photo)?;
        fitted(py, (&self.session, &self.tools), (&self.path, &graph), (&photo, &options), &request, progress)
    }
}

const DEPTHS: [(&str, Depth); 4] = [("8", Depth::U8), ("16", Depth::U16), ("f16", Depth::F16), ("f32", Depth::F32)];

/// The value of a known word, or an error that lists all.
fn word<T: Copy>(name: &str, what: &str, known: &[(&str, T)]) -> PyResult<T> {
    known.iter().find(|(known, _)| *known == name).map(|(_, value)| *value).ok_or_else(|| {
        let names: Vec<&str> = known.iter().map(|(name, _)| *name).collect();
        PyValueError::new_err(format!("{what} is `{name}`; it must be one of {}", names.join(", ")))
    })
}

/// The window of a region (x, y, width and height from the top left), checked against the picture.
fn window([width, height]: [u32; 2], region: Option<[u32; 4]>) -> PyResult<Window> {
    let [x, y, w, h] = region.unwrap_or([0, 0, width, height]);
    let fits = |at: u32, length: u32, whole: u32| length > 0 && at.checked_add(length).is_some_and(|end| end <= whole);
    if fits(x, w, width) && fits(y, h, height) {
        return Ok(Window { x: x.cast_signed(), y: y.cast_signed(), width: w, height: h });
    }
    let message = format!("the region {x}, {y}, {w}, {h} does not lie within the picture of {width} × {height}");
    Err(PyValueError::new_err(message))
}

/// The result of a computation; its warnings become Python warnings.
fn finished<T>(py: Python<'_>, graph: &engine::Graph, (result, warnings): wait::Done<T>) -> PyResult<T> {
    let category = py.get_type::<PyRuntimeWarning>();
    for warning in all(&warnings, &graph.sources) {
        let message = std::ffi::CString::new(warning.to_string().replace('\0', " ")).unwrap_or_default();
        PyErr::warn(py, &category, &message, 2)?;
    }
    result.map_err(|failure| failed(py, failure, &graph.sources))
}
