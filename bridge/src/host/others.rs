//! Operations of crates above this one, which a host answers beside its own.
use super::look::scene;
use super::render::{Parameters, check_size};
use super::shared::Shared;
use super::{Host, Message, Refusal, named, no_graph};
use crate::scene::Scene;
use crate::{GraphText, Tools};
use serde::Deserialize;
use serde_json::Value as Json;
use shibo_engine::eval::{CancelToken, Observer};
use shibo_engine::session::{Failure, Session};
use shibo_graph::LoadOptions;
use std::sync::Arc;

/// Operations beside those of a host.
pub trait Operations: Send + Sync {
    /// The names of the operations.
    fn names(&self) -> &'static [&'static str];

    /// Begins the operation `op`, which is one of [`names`](Self::names).
    ///
    /// # Errors
    /// The reason why the request cannot be done.
    fn begin(&self, op: &str, request: Json, host: &Host) -> Result<Begun, Refusal>;
}

/// An operation that has begun.
pub enum Begun {
    /// It is done, with this answer.
    Answer(Json),
    /// It takes time.
    Work(Box<dyn Steps>),
}

/// Work in steps. Between two of them a transport can pass messages on.
pub trait Steps: Send {
    /// Does one step. After `cancel` asked for it, the work ends soon: with an error, or with the result so far.
    ///
    /// # Errors
    /// The reason why the work ends without a result.
    fn step(&mut self, cancel: &CancelToken, observer: &dyn Observer) -> Result<Step, Refusal>;
}

/// The result of a step.
pub enum Step {
    /// An event; there are more steps.
    Event(Message),
    /// The answer of the request.
    Done(Json),
}

/// The fields of a request about a graph: `graph`, `size`, and values as in `render`.
#[derive(Deserialize)]
pub struct OnGraph {
    graph: String,
    #[serde(flatten)]
    values: Parameters,
    /// Pixels of the longer side; the size of the canvas by default.
    #[serde(default)]
    size: Option<u32>,
}

/// The graph of a request, with its values.
pub struct Given {
    /// The graph with the values.
    pub scene: Scene,
    /// The text of the graph, with the tried values of nodes and without the others.
    pub file: GraphText,
    /// The preset of the request.
    pub preset: Option<String>,
    /// Values of parameters, as RON.
    pub set: Vec<(String, String)>,
    /// The tools of the host, with the files of the graph.
    pub tools: Tools,
    shared: Arc<Shared>,
}

impl Given {
    /// The session of the host.
    pub fn session(&self) -> &Session {
        &self.shared.session
    }

    /// The error of a failure of the session with this graph.
    pub fn refusal(&self, failure: Failure) -> Refusal {
        Refusal::of_failure(&self.tools, &named(&self.file.path), failure, &self.scene.graph.sources)
    }
}

impl Host {
    /// The same host with further operations.
    #[must_use]
    pub fn with(self, others: Arc<dyn Operations>) -> Self {
        Self { others: Some(others), ..self }
    }

    /// The graph of a request.
    ///
    /// # Errors
    /// There is no such open graph, the values do not fit it, or the size is no size of a picture.
    pub fn given(&self, wanted: &OnGraph) -> Result<Given, Refusal> {
        wanted.size.map_or(Ok(()), check_size)?;
        let opened = self.graphs.get(&wanted.graph).ok_or_else(|| no_graph(&wanted.graph))?;
        let (source, _) = opened.tried(&wanted.values.edits, &self.shared);
        let scene = scene(&source, &wanted.values, wanted.size, &self.shared)?;
        let LoadOptions { preset, set, .. } = wanted.values.options(None);
        let tools = Tools { gate: source.gate.clone(), ..self.shared.tools.clone() };
        let shipped = || source.shipped(&tools).unwrap_or_default();
        let text = source.text.as_deref().map_or_else(shipped, ToOwned::to_owned);
        let file = GraphText { path: source.path, text };
        Ok(Given { scene, file, preset, set, tools, shared: self.shared.clone() })
    }
}
