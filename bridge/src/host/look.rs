//! Any target of a graph, for pages: its description, its picture, and the level of the graph in which it stands.
use super::open::Source;
use super::render::{Parameters, check_size, meaning, refusal};
use super::samples::{Form, Layout};
use super::shared::{Around, Shared};
use super::{Message, Refusal};
use crate::page::{self, SolidShape};
use crate::scene::{Preview, Scene, Target, WHOLE, thinned};
use serde::Deserialize;
use serde_json::{Value as Json, json};
use shibo_engine::eval::{NodeState, NodeStats};
use shibo_engine::session::Failure;
use shibo_value::{Field, Key, Tile, Type, Window};

/// The fields of `look`.
#[derive(Deserialize)]
pub(super) struct Request {
    pub(super) graph: String,
    target: String,
    #[serde(flatten)]
    pub(super) values: Parameters,
    /// Pixels of the longer side; the size of the canvas by default.
    #[serde(default)]
    size: Option<u32>,
    /// The number of the node's output, in place of its name in `target`.
    #[serde(default)]
    port: Option<usize>,
    /// The shape along which solids are cut.
    #[serde(default)]
    shape: Option<SolidShape>,
}

/// The fields of `about`.
#[derive(Deserialize)]
pub(super) struct AboutRequest {
    pub(super) graph: String,
    target: String,
    #[serde(flatten)]
    pub(super) values: Parameters,
}

/// The fields of `level`.
#[derive(Deserialize)]
pub(super) struct LevelRequest {
    pub(super) graph: String,
    /// The name of a sub-graph; empty for the whole graph.
    #[serde(default)]
    path: String,
    #[serde(flatten)]
    pub(super) values: Parameters,
}

/// The graph with values, as a scene.
pub(super) fn scene(
    source: &Source,
    values: &Parameters,
    size: Option<u32>,
    shared: &Shared,
) -> Result<Scene, Refusal> {
    let graph = source.graph(shared, values.options(size))?;
    match shared.session.keys(&graph) {
        Ok(keys) => Ok(Scene::new(0, String::new(), graph, keys)),
        Err(failure) => Err(Refusal::of_failure(&shared.tools, &super::named(&source.path), failure, &graph.sources)),
    }
}

fn target(scene: &Scene, name: &str) -> Result<Target, Refusal> {
    scene.target(name).ok_or_else(|| {
        let message = format!("there is no `{name}`; a target is an output, `OUTPUT.CHANNEL`, `@NODE` or `@NODE:PORT`");
        Refusal::new("no-output", message)
    })
}

/// The description of a target.
pub(super) fn about(source: &Source, wanted: &AboutRequest, shared: &Shared) -> Result<Json, Refusal> {
    let scene = scene(source, &wanted.values, None, shared)?;
    let target = target(&scene, &wanted.target)?;
    Ok(page::about(&scene, &target, shared.session.registry()))
}

/// The boxes and wires of a level of the graph.
pub(super) fn level(source: &Source, wanted: &LevelRequest, shared: &Shared) -> Result<Json, Refusal> {
    let graph = source.graph(shared, wanted.values.options(None))?;
    let missing = || Refusal::new("no-output", format!("there is no sub-graph `{}`", wanted.path));
    page::level(&graph, &wanted.path).ok_or_else(missing)
}

/// The picture of a target, before it is sent.
enum Seen {
    /// A field on the canvas, and the type as which it is shown.
    Field(Field, Type, &'static str),
    /// Pixels that were made: on a shape, or without a place on the canvas.
    Tile { tile: Tile, ty: Type, is_own: bool },
    /// An object that has no pixels, with its drawing.
    Object(String, Option<Json>),
    /// There is no picture.
    Nothing,
}

/// An unfinished look.
pub(super) struct LookAt {
    source: Source,
    wanted: Request,
    is_done: bool,
    stats: Vec<NodeStats>,
}

impl LookAt {
    pub(super) fn new(source: Source, wanted: Request) -> Result<Self, Refusal> {
        wanted.size.map_or(Ok(()), check_size)?;
        Ok(Self { source, wanted, is_done: false, stats: Vec::new() })
    }

    /// The event with the picture; `None` after it, or if there is no picture.
    pub(super) fn step(&mut self, around: &Around<'_>) -> Result<Option<Message>, Refusal> {
        if std::mem::replace(&mut self.is_done, true) {
            return Ok(None);
        }
        let scene = scene(&self.source, &self.wanted.values, self.wanted.size, around.shared)?;
        let mut target = target(&scene, &self.wanted.target)?;
        if let Some(port) = self.wanted.port {
            if port >= scene.graph.nodes[target.node].outputs.len() {
                return Err(Refusal::new("no-output", format!("`{}` has no output {port}", target.name)));
            }
            target.output = port;
        }
        let source = self.source.clone();
        let fails = |failure: Failure| refusal(around, &source, failure, &scene.graph);
        let mut message = Message::event("picture");
        message.put("target", target.name.as_str());
        message.put("size_mm", json!(scene.graph.canvas.size_mm.to_array()));
        match self.seen(around, &scene, &target).map_err(fails)? {
            Seen::Nothing => return Ok(None),
            Seen::Object(ty, drawing) => {
                message.put("event", "object");
                message.put("type", ty);
                message.put("drawing", drawing);
            }
            Seen::Tile { tile, ty, is_own } => fill(&mut message, &tile, (ty, is_own))?,
            Seen::Field(field, ty, unit) => {
                let size = scene.graph.canvas.resolution;
                message.put("unit", unit);
                message.put("key", scene.id(&target, &field, &scene.graph.canvas.grid(size)));
                let wanted = [(scene.graph.canvas.grid(size), Window::full(size))];
                let session = &around.shared.session;
                let made = session.rasters(&scene.graph, &field, &wanted, around.cancel, around.observer);
                let (mut tiles, stats) = made.map_err(fails)?;
                self.stats = together(std::mem::take(&mut self.stats), stats);
                let missing = || Refusal::new("no-output", format!("`{}` has no pixels", target.name));
                fill(&mut message, &tiles.pop().ok_or_else(missing)?, (ty, false))?;
            }
        }
        Ok(Some(message))
    }

    /// The answer after the picture: the work of each node.
    pub(super) fn done(&self) -> Json {
        json!({ "nodes": self.stats })
    }

    fn seen(&mut self, around: &Around<'_>, scene: &Scene, target: &Target) -> Result<Seen, Failure> {
        let (shape, size) = (self.wanted.shape, self.wanted.size);
        let Around { shared, cancel, observer } = around;
        let (seen, stats) = shared.session.look(&scene.graph, &scene.keys, cancel, *observer, |look| {
            let seen = match shape {
                Some(shape) => {
                    let side = size.unwrap_or_else(|| scene.graph.canvas.resolution.max_element());
                    let worn = page::worn(look, scene, target, shape, side)?;
                    worn.map_or(Seen::Nothing, |(field, tile)| Seen::Tile { tile, ty: field.ty(), is_own: false })
                }
                None => match scene.sight(look, target)? {
                    Some(Preview::Field(field, style)) => Seen::Field(field, style.ty, style.unit),
                    Some(Preview::Pixels(pixels)) => {
                        Seen::Tile { tile: thinned(&pixels, WHOLE), ty: pixels.ty(), is_own: true }
                    }
                    Some(Preview::Object(ty, sketch)) => {
                        let drawing = sketch.and_then(|sketch| page::drawing(ty, &sketch, &scene.graph.canvas));
                        Seen::Object(ty.name().to_owned(), drawing)
                    }
                    None => Seen::Nothing,
                },
            };
            Ok((seen, look.stats()))
        })?;
        self.stats = stats;
        Ok(seen)
    }
}

/// The work of two runs, one after the other.
fn together(first: Vec<NodeStats>, second: Vec<NodeStats>) -> Vec<NodeStats> {
    let order = [NodeState::Computed, NodeState::Disk, NodeState::Memory, NodeState::Folded, NodeState::Unused];
    let rank = |state: NodeState| order.iter().position(|other| *other == state);
    let both = first.into_iter().zip(second).map(|(a, b)| NodeStats {
        state: if rank(b.state) < rank(a.state) { b.state } else { a.state },
        seconds: a.seconds + b.seconds,
        tiles: a.tiles + b.tiles,
        pixels: a.pixels + b.pixels,
        ..a
    });
    both.collect()
}

/// Adds the samples of a tile; `key` names them.
fn fill(message: &mut Message, tile: &Tile, (ty, is_own): (Type, bool)) -> Result<(), Refusal> {
    let layout = Layout { components: tile.channels(), bottom_up: false };
    let bytes = Form::F32.bytes(tile, layout, (false, None))?;
    if !message.json.contains_key("key") {
        message.put("key", Key::of("look", &[&bytes]).to_string());
    }
    message.put("width", tile.window.width);
    message.put("height", tile.window.height);
    message.put("components", tile.channels());
    message.put("meaning", meaning(ty));
    message.put("type", ty.name());
    message.put("own", is_own);
    message.bytes = Some(bytes);
    Ok(())
}
