//! Small pictures of all outputs as `shibo pin` keeps them: programs on different machines compare their bits.
use super::open::Source;
use super::shared::Around;
use super::{Message, Refusal, named};
use crate::lock::{RESOLUTION, sample};
use serde::Deserialize;
use serde_json::{Value as Json, json};
use shibo_graph::LoadOptions;

/// The fields of `sample`.
#[derive(Deserialize)]
pub(super) struct Request {
    pub(super) graph: String,
}

/// An unfinished request.
pub(super) struct Samples {
    source: Source,
    done: Json,
}

impl Samples {
    pub(super) fn new(source: Source) -> Self {
        Self { source, done: Json::Null }
    }

    pub(super) fn step(&mut self, around: &Around<'_>) -> Result<Option<Message>, Refusal> {
        let options = LoadOptions { resolution: Some(RESOLUTION), ..LoadOptions::default() };
        let graph = self.source.graph(around.shared, options)?;
        let made = sample(&around.shared.session, &graph, around.cancel);
        let made = made.map_err(|failure| {
            Refusal::of_failure(&around.shared.tools, &named(&self.source.path), failure, &graph.sources)
        })?;
        self.done = json!({ "samples": made });
        Ok(None)
    }

    pub(super) fn done(&mut self) -> Json {
        self.done.take()
    }
}
