//! Thumbnails. The preview of a node is its full picture, shrunk, because a graph evaluated with so few pixels would
//! look different.
use super::app::{ApiError, App, Query2, png};
use super::edits::tried;
use super::stage::Stage;
use super::values::Values;
use axum::extract::{Query, State};
use axum::response::Response;
use petgraph::graph::NodeIndex;
use serde::Deserialize;
use shibo_bridge::scene::paint::{Painter, small};
use shibo_bridge::scene::{COARSE, DisplayStyle, Preview, Scene, Target, WHOLE};
use shibo_bridge::scene::{Store, Stored};
use shibo_engine::eval::{CancelToken, Silent};
use shibo_engine::session::{Failure, Look};
use shibo_graph::{self as graph, LoadOptions};
use shibo_value::{Field, Key, Window};
use std::sync::Arc;

/// Longest side of a thumbnail in pixels.
const LONGEST: u32 = 96;
/// Longest side of a variation in pixels.
const VARIATION: u32 = 240;

/// Query: an output of a node.
#[derive(Debug, Deserialize)]
pub(super) struct Node {
    g: u64,
    /// Index of the node.
    n: usize,
    /// Index of the output.
    #[serde(default)]
    o: usize,
}

/// Returns a thumbnail of an output of a node.
pub(super) async fn thumb(State(app): State<App>, query: Query2<Node>) -> Result<Response, ApiError> {
    let Query(Node { g, n, o }) = query?;
    let scene = app.scene(g)?;
    let node = NodeIndex::new(n);
    let found = scene.graph.nodes.node_weight(node).filter(|node| o < node.outputs.len()).ok_or(ApiError::Unknown)?;
    let target = Target { name: format!("@{}", found.name), node, output: o, channel: None };
    let stored = app
        .look(&scene, move |look, stage, scene| match scene.sight(look, &target)? {
            Some(Preview::Field(field, manner)) => {
                shrunk(look, &stage.store, scene, &target, (&field, manner)).map(Some)
            }
            Some(Preview::Pixels(pixels)) => Ok(Some(scene.pixels(&stage.store, &target, &pixels, LONGEST))),
            _ => Ok(None),
        })
        .await?;
    stored.map(|stored| png(stored.png.clone())).ok_or(ApiError::Nothing)
}

/// Shrinks the sharp picture of a field. Outputs are computed at this size anyway, so most of the tiles needed are in
/// memory.
fn shrunk(
    look: &Look<'_>,
    store: &Store,
    scene: &Scene,
    target: &Target,
    (field, manner): (&Field, DisplayStyle),
) -> Result<Arc<Stored>, Failure> {
    let size = scene.size(WHOLE);
    let sharp = scene.known(store, target, field, size);
    let id = Key::of("thumb", &[scene.id(target, field, &scene.graph.canvas.grid(size)).as_bytes()]).to_string();
    if let Some(known) = store.get(&id) {
        return Ok(known);
    }
    let made = |(png, size): (Vec<u8>, [u32; 2]), range| {
        Arc::new(Stored { id: id.clone(), png: png.into(), size, range, ty: field.ty() })
    };
    let stored = match sharp.and_then(|sharp| Some(made(decoded(&sharp.png)?, sharp.range))) {
        Some(stored) => stored,
        None => {
            let tile = look.raster(field, &scene.graph.canvas.grid(size), Window::full(size))?;
            let range = shibo_bridge::scene::paint::range(manner.ty, &tile);
            made(Painter::new(manner.ty, range).small(&tile, LONGEST), range)
        }
    };
    store.put(stored.clone());
    Ok(stored)
}

/// Query: a variation.
#[derive(Debug, Deserialize)]
pub(super) struct Variation {
    g: u64,
    t: String,
    /// Values of parameters as JSON.
    v: String,
    /// Value shown as black.
    lo: Option<f32>,
    /// Value shown as white.
    hi: Option<f32>,
    /// Longest side in pixels.
    s: Option<u32>,
}

/// Returns a small picture of a target with other values of the parameters.
pub(super) async fn vary(State(app): State<App>, query: Query2<Variation>) -> Result<Response, ApiError> {
    let Query(Variation { g, t, v, lo, hi, s }) = query?;
    let longest = s.unwrap_or(VARIATION).clamp(16, COARSE);
    let values: Values = serde_json::from_str(&v).map_err(|error| ApiError::Bad(error.to_string()))?;
    let scene = app.scene(g)?;
    let text = app.stage.texts.get(&scene.sha256).ok_or(ApiError::Nothing)?;
    let made =
        app.apart(&scene, move |stage, cancel| varied(stage, cancel, &text, values, (&t, lo.zip(hi), longest))).await?;
    made.map(|bytes| png(bytes.into())).ok_or(ApiError::Nothing)
}

fn varied(
    stage: &Stage,
    cancel: &CancelToken,
    text: &str,
    values: Values,
    (target, given, longest): (&str, Option<(f32, f32)>, u32),
) -> Result<Option<Vec<u8>>, Failure> {
    let path = stage.path();
    let overlay = stage.unsaved();
    let (text, _) = tried(&path, text, stage.session.registry(), &values, &overlay);
    let options = LoadOptions { overlay, ..values.options() };
    let loaded = graph::load_text(&path, &text, stage.session.registry(), &options);
    let graph = loaded.graph.ok_or(Failure::Errors(loaded.diagnostics))?;
    let keys = stage.session.keys(&graph)?;
    let scene = Scene::new(0, String::new(), graph, keys);
    let Some(target) = scene.target(target) else { return Ok(None) };
    stage.session.look(&scene.graph, &scene.keys, cancel, &Silent, |look| match scene.sight(look, &target)? {
        Some(Preview::Field(field, manner)) => {
            let size = scene.size(COARSE);
            let tile = look.raster(&field, &scene.graph.canvas.grid(size), Window::full(size))?;
            let range = given.map_or_else(|| shibo_bridge::scene::paint::range(manner.ty, &tile), |(lo, hi)| [lo, hi]);
            Ok(Some(Painter::new(manner.ty, range).small(&tile, longest).0))
        }
        _ => Ok(None),
    })
}

/// Decodes and shrinks an earlier picture.
fn decoded(bytes: &[u8]) -> Option<(Vec<u8>, [u32; 2])> {
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().ok()?;
    let mut pixels = vec![0; reader.output_buffer_size()?];
    let info = reader.next_frame(&mut pixels).ok()?;
    let channels = info.color_type.samples();
    Some(small(&pixels, [info.width, info.height], channels, LONGEST))
}
