//! Meshes for the 3D view of a page: the mesh of a graph, or the body of an output.
use super::look::scene;
use super::open::Source;
use super::render::{Parameters, refusal};
use super::shared::Around;
use super::{Message, Refusal};
use crate::page::{PageMesh, marks, preview_body, shown_body};
use crate::scene::Scene;
use serde::Deserialize;
use serde_json::{Value as Json, json};
use shibo_engine::session::{Failure, RenderRequest};
use shibo_value::{Atlas, Carried};

/// The fields of `shape`.
#[derive(Deserialize)]
pub(super) struct Request {
    pub(super) graph: String,
    /// An output that is a body; without one, the mesh of the graph.
    #[serde(default)]
    output: Option<String>,
    #[serde(flatten)]
    pub(super) values: Parameters,
    /// Pixels of the longer side; the size of the canvas by default.
    #[serde(default)]
    size: Option<u32>,
    /// The key of a mesh that the program has: it is not sent again.
    #[serde(default)]
    known: Option<String>,
    /// True if the overlays of the mesh are wanted instead of it.
    #[serde(default)]
    marks: bool,
}

/// An unfinished request for a mesh.
pub(super) struct Shaping {
    source: Source,
    wanted: Request,
    is_done: bool,
}

impl Shaping {
    pub(super) fn new(source: Source, wanted: Request) -> Self {
        Self { source, wanted, is_done: false }
    }

    /// The event with the mesh; `None` after it.
    pub(super) fn step(&mut self, around: &Around<'_>) -> Result<Option<Message>, Refusal> {
        if std::mem::replace(&mut self.is_done, true) {
            return Ok(None);
        }
        let scene = scene(&self.source, &self.wanted.values, self.wanted.size, around.shared)?;
        let made = match &self.wanted.output {
            Some(output) => self.body(around, scene, output),
            None => self.mesh(around, &scene),
        };
        made.map(Some)
    }

    fn mesh(&self, around: &Around<'_>, scene: &Scene) -> Result<Message, Refusal> {
        let Around { shared, cancel, observer } = around;
        let missing = || Refusal::new("no-output", "the graph has no mesh");
        let (node, output) = scene.mesh().ok_or_else(missing)?;
        let key = scene.keys.output(node, output).to_string();
        if self.wanted.known.as_ref() == Some(&key) {
            let mut message = Message::event("same");
            message.put("key", key);
            return Ok(message);
        }
        let (is_marked, fails) = (self.wanted.marks, |failure| refusal(around, &self.source, failure, &scene.graph));
        let made = shared.session.look(&scene.graph, &scene.keys, cancel, *observer, |look| match is_marked {
            true => Ok((None, marks(look, scene)?)),
            false => Ok((look.value(node, output)?.and_then(Atlas::unwrap), None)),
        });
        let (atlas, marks) = made.map_err(fails)?;
        if is_marked {
            let mut message = Message::event("marks");
            message.put("marks", marks.unwrap_or_default());
            return Ok(message);
        }
        let atlas = atlas.ok_or_else(missing)?;
        Ok(sent(&PageMesh::of(&atlas), key, Json::Null))
    }

    fn body(&self, around: &Around<'_>, mut scene: Scene, output: &str) -> Result<Message, Refusal> {
        if cfg!(not(target_family = "wasm")) {
            let message = "bodies are for pages that run the module in WebAssembly; `write` writes their files";
            return Err(Refusal::new("usage", message));
        }
        if !preview_body(&mut scene.graph, output) {
            return Err(Refusal::new("no-output", format!("there is no body `{output}`")));
        }
        let request = RenderRequest { outputs: vec![output.to_owned()], ..RenderRequest::default() };
        let report = around.shared.session.render(&scene.graph, &request, around.cancel, around.observer);
        // Files of a render that failed are dropped with the error.
        let files = shibo_picture::taken_files().into_iter();
        let files: Vec<_> = files.map(|(path, bytes)| (path.to_string_lossy().into_owned(), bytes)).collect();
        report.map_err(|failure: Failure| refusal(around, &self.source, failure, &scene.graph))?;
        let (mesh, report) = shown_body(&files).map_err(|message| Refusal::new("file", message))?;
        Ok(sent(&mesh, String::new(), serde_json::from_slice(&report).unwrap_or_default()))
    }
}

/// The event with a mesh.
fn sent(mesh: &PageMesh, key: String, report: Json) -> Message {
    let mut message = Message::event("mesh");
    message.put("key", key);
    message.put("vertices", mesh.vertices.len());
    message.put("indices", mesh.indices.len());
    message.put("per_mm", mesh.per_mm);
    message.put("middle", json!(mesh.middle));
    message.put("report", report);
    message.bytes = Some(mesh.bytes());
    message
}
