//! The editor and the page: the editor shows a node on the page, and a click on the page shows the node's line in the editor.
use super::handlers::{App, No};
use axum::body::Bytes;
use axum::extract::State;
use axum::http::StatusCode;
use axum::response::Json;
use petgraph::graph::NodeIndex;
use serde::{Deserialize, Serialize};
use serde_json::{Value as Data, json};
use shibo_engine::graph::Graph;
use std::path::PathBuf;
use std::sync::Arc;

/// The query of an editor that listens, and is no page.
pub(super) const EDITOR: &str = "editor=yes";

/// Takes the places of nodes that are clicked.
pub(super) type Jumps = Arc<dyn Fn(&Place) + Send + Sync>;

/// A place in a file, as people count: from 1, columns in characters.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(crate) struct Place {
    /// The file.
    pub(crate) file: PathBuf,
    /// The line.
    pub(crate) line: usize,
    /// The column.
    pub(crate) column: usize,
}

impl Place {
    /// Where the kind of a node is written; nowhere, if that is in a graph that comes with the program.
    fn of(graph: &Graph, node: NodeIndex) -> Option<Self> {
        let span = graph.nodes[node].span;
        let at = graph.sources.position(span.file, span.start);
        // A graph of the library is no file, and an argument of the command line neither.
        let file = graph.sources.path(span.file).canonicalize().ok()?;
        Some(Self { file, line: at.line, column: at.column })
    }
}

#[derive(Debug, Deserialize)]
struct Show {
    target: Option<String>,
}

#[derive(Debug, Deserialize)]
struct Click {
    node: String,
}

fn read<'b, T: Deserialize<'b>>(body: &'b Bytes) -> Result<T, No> {
    serde_json::from_slice(body).map_err(|error| No::Bad(error.to_string()))
}

/// An editor shows a target; how many pages are open is answered. Without a target nothing is shown.
pub(super) async fn show(State(app): State<App>, body: Bytes) -> Result<Json<Data>, No> {
    let Show { target } = read(&body)?;
    if let Some(target) = target.filter(|target| !target.is_empty()) {
        app.stage.set_focus(&target);
        app.stage.tell("look", &json!({ "target": target }));
    }
    Ok(Json(json!({ "pages": app.pages.load(std::sync::atomic::Ordering::Relaxed) })))
}

/// A node was clicked on a page.
pub(super) async fn jump(State(app): State<App>, body: Bytes) -> Result<StatusCode, No> {
    let Click { node } = read(&body)?;
    let scene = app.stage.scene().ok_or(No::Unknown)?;
    let target = scene.target(&format!("@{node}")).ok_or(No::Unknown)?;
    let Some(place) = Place::of(&scene.graph, target.node) else { return Ok(StatusCode::NO_CONTENT) };
    app.stage.tell("jump", &json!(place));
    (app.jumps)(&place);
    Ok(StatusCode::ACCEPTED)
}
