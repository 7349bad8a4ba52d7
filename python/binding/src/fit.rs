//! Fits of graphs to photographs.
use crate::diagnostics::{exception, failed};
use crate::photo::Photo as Given;
use crate::wait;
use pyo3::exceptions::{PyUserWarning, PyValueError};
use pyo3::prelude::*;
use shibo_bridge::write::{self, Refused as NotWritten};
use shibo_bridge::{GraphText, Tools};
use shibo_engine::eval::Event;
use shibo_engine::session::{Failure, Session};
use shibo_fit::graph::{Bench, Fitting, Photo, Preset, Refused, Request, name_for};
use shibo_graph::Graph;
use shibo_value::diagnostics::FileId;
use std::ffi::CString;
use std::path::{Path, PathBuf};

/// The arguments of `shibo.fit`.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Options {
    width_mm: Option<f64>,
    output: Option<String>,
    only: Vec<String>,
    fixed: Vec<String>,
    light: String,
    crop: Option<[u32; 4]>,
    fine: bool,
    seconds: Option<f64>,
    renders: Option<u32>,
    seed: u64,
    threads: u16,
}

impl Options {
    /// The request for a graph with a preset and values.
    pub(crate) fn request(
        &self,
        start: Option<String>,
        set: Vec<(String, String)>,
        photo: &Given<'_>,
    ) -> PyResult<Request> {
        if !self.only.is_empty() && !self.fixed.is_empty() {
            return Err(PyValueError::new_err("`only` and `fixed` exclude each other: give one of them"));
        }
        if self.renders.is_some_and(|renders| !(8..=100_000).contains(&renders)) {
            return Err(PyValueError::new_err("renders must be from 8 to 100000"));
        }
        Ok(Request {
            output: self.output.clone(),
            preset: photo.path().map_or_else(|| "fitted".to_owned(), name_for),
            only: self.only.clone(),
            fixed: self.fixed.clone(),
            start,
            set,
            light: self.light.parse().map_err(|message| PyValueError::new_err(format!("light: {message}")))?,
            fine: self.fine,
            seconds: self.seconds,
            renders: self.renders,
            seed: self.seed,
            threads: usize::from(self.threads),
        })
    }
}

/// A finished fit.
#[pyclass(frozen, module = "shibo")]
pub(crate) struct Fit {
    tools: Tools,
    path: PathBuf,
    preset: Preset,
    /// The result as JSON.
    #[pyo3(get)]
    json: String,
    /// The report in words.
    #[pyo3(get)]
    report: String,
}

#[pymethods]
impl Fit {
    /// The found values as RON, by parameter.
    #[getter]
    fn values(&self) -> Vec<(String, String)> {
        self.preset.values.clone()
    }

    /// The name of the preset, if none is given to `write`.
    #[getter]
    fn name(&self) -> String {
        self.preset.name.clone()
    }

    /// Writes the values as a preset into the graph file.
    fn write(&self, py: Python<'_>, name: Option<String>) -> PyResult<()> {
        let shown = self.path.display().to_string();
        let wrong = |message: String| exception(py, message, Vec::new());
        if shown.starts_with("shibo:") {
            return Err(wrong(format!("`{shown}` comes with Shibo and is not changed: fit a copy of it")));
        }
        let text =
            std::fs::read_to_string(&self.path).map_err(|error| wrong(format!("cannot read `{shown}`: {error}")))?;
        let file = GraphText { path: self.path.clone(), text };
        let name = name.unwrap_or_else(|| self.preset.name.clone());
        let after = Preset { name, ..self.preset.clone() }.put(&file, &self.tools);
        let after = after.map_err(|refused| raised(py, refused))?;
        py.detach(|| write::change(&self.path, &file.text, &after)).map_err(|refused| match refused {
            NotWritten::Changed => wrong(format!("`{shown}` was saved meanwhile, and left alone: write again")),
            NotWritten::Failed(error) => wrong(format!("cannot write `{shown}`: {error}")),
        })
    }
}

/// Fits a graph to a photograph.
pub(crate) fn fitted(
    py: Python<'_>,
    (session, tools): (&Session, &Tools),
    (path, graph): (&Path, &Graph),
    (photo, options): (&Given<'_>, &Options),
    request: &Request,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Fit> {
    request.check("", options.width_mm).map_err(|refused| raised(py, refused))?;
    let (picture, shown) = photo.picture(py)?;
    let name = photo
        .path()
        .and_then(|path| path.file_name())
        .map_or(shown.clone(), |name| name.to_string_lossy().into_owned());
    let photo = Photo::of(&picture, (&shown, &name), options.width_mm, options.crop);
    let photo = photo.map_err(|refused| raised(py, refused))?;
    let file = GraphText { path: graph.path.clone(), text: graph.sources.text(FileId(0)).to_string() };
    let (done, _) = wait::for_result(py, progress, |cancel, told| {
        let work = || -> Result<(Fit, Vec<String>), Refused> {
            let fitting = Fitting::of(Bench { tools, session, cancel }, &file, graph, &photo, request)?;
            let fitted = fitting.run(&|done, status| {
                let (done, total) = (done as u64, status.planned as u64);
                told.event(Event::Node { name: "fit".to_owned(), done, total });
            })?;
            let (preset, json, report) = (fitted.preset(), fitted.json().to_string(), fitted.page(None));
            Ok((Fit { tools: tools.clone(), path: path.to_owned(), preset, json, report }, fitting.warnings()))
        };
        Ok(work())
    })?;
    let done = done.map_err(|failure| failed(py, failure, &graph.sources))?;
    let (fit, warnings) = done.map_err(|refused| raised(py, refused))?;
    let category = py.get_type::<PyUserWarning>();
    for warning in warnings {
        PyErr::warn(py, &category, &CString::new(warning.replace('\0', " ")).unwrap_or_default(), 2)?;
    }
    Ok(fit)
}

/// The exception for a fit that is not possible.
fn raised(py: Python<'_>, refused: Refused) -> PyErr {
    match refused {
        Refused::Usage(message) | Refused::Unfit(message) => exception(py, message, Vec::new()),
        Refused::Graph(failure, sources) => failed(py, failure, &sources),
        Refused::Cancelled => failed(py, Failure::Cancelled, &Default::default()),
    }
}
