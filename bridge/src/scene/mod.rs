//! A displayed graph: its targets and their pictures.
mod cutters;
mod instead;
pub mod paint;
mod previews;
mod store;

pub use cutters::{Cutter, cutters, upstream};
pub use instead::{evaluated, instead};
pub use previews::tile as thinned;
pub use store::{Store, Stored};

use glam::UVec2;
use paint::{Painter, range};
use petgraph::graph::NodeIndex;
use serde::Serialize;
use shibo_engine::eval::{CancelToken, Keys, NodeStats};
use shibo_engine::session::{Failure, Look};
use shibo_graph::{ExportMesh, Graph};
use shibo_value::diagnostics::{Code, Diagnostic, Span};
use shibo_value::{Atlas, Carried, Channel, Field, Grid, Key, Pixels, Sketch, Tile, Type, Value, Window};
use std::collections::{BTreeMap, HashMap};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Longest side of a picture that is sent whole; pages request tiles of larger ones.
pub const WHOLE: u32 = 2048;
/// Longest side of the first, coarse picture.
pub const COARSE: u32 = 512;

/// Locks a mutex whose content is always valid, even after a panic.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Something in a graph that a page can show.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Target {
    /// `OUTPUT`, `OUTPUT.CHANNEL`, `@NODE`, `@NODE:PORT`, and the last two with `.CHANNEL`.
    pub name: String,
    /// Node that makes the target.
    pub node: NodeIndex,
    /// Index of the node's output.
    pub output: usize,
    /// Channel of a material.
    pub channel: Option<Channel>,
}

/// Style in which the values of a field are displayed.
#[derive(Clone, Copy, Debug)]
pub struct DisplayStyle {
    /// Unit of the values.
    pub unit: &'static str,
    /// Type as which the values are painted.
    pub ty: Type,
    /// True if values may be non-finite; these are painted black or white.
    pub holes: bool,
}

impl DisplayStyle {
    /// The default style of a field, by its type.
    fn of(field: &Field) -> Self {
        Self { unit: "", ty: field.ty(), holes: false }
    }
}

/// Preview of a target.
pub enum Preview {
    /// A field, painted as a picture.
    Field(Field, DisplayStyle),
    /// Pixels of an object, without a position on the canvas.
    Pixels(Pixels),
    /// An object of this type, and its sketch if it has one.
    Object(Type, Option<Sketch>),
}

/// Description of a target's picture for pages.
#[derive(Clone, Debug, Serialize)]
pub struct PictureInfo {
    /// Name of the target.
    pub target: String,
    /// Address of the picture, relative to the page.
    pub picture: String,
    /// Width and height.
    pub size: [u32; 2],
    /// False if a sharper picture will follow.
    #[serde(rename = "final")]
    pub is_final: bool,
    /// Values shown as black and white.
    pub range: [f32; 2],
    /// Type of the field.
    #[serde(rename = "type")]
    pub ty: String,
    /// Unit of the values, or empty.
    pub unit: &'static str,
    /// True if its pixels have no position on the canvas.
    pub own: bool,
    /// Keeps the picture in memory while it is shown.
    #[serde(skip)]
    pub stored: Arc<Stored>,
}

/// A displayed graph.
pub struct Scene {
    /// Number of the graph, counted within a run.
    pub generation: u64,
    /// Hash of the graph file.
    pub sha256: String,
    /// The graph.
    pub graph: Graph,
    /// Keys of the graph.
    pub keys: Keys,
    /// Pictures of outputs made so far.
    pub shown: Mutex<BTreeMap<String, PictureInfo>>,
    /// Statistics of the nodes so far.
    pub stats: Mutex<Vec<NodeStats>>,
    names: HashMap<String, NodeIndex>,
    /// Last id, and the cancel token of each running view.
    views: Mutex<(u64, BTreeMap<u64, CancelToken>)>,
}

/// A look into a scene that a page waits for. It is cancelled when the page stops waiting or a newer scene exists.
pub struct View {
    scene: Arc<Scene>,
    id: u64,
    token: CancelToken,
}

impl View {
    /// Begins a look into `scene`.
    pub fn new(scene: &Arc<Scene>) -> Self {
        let token = CancelToken::default();
        let mut views = lock(&scene.views);
        views.0 += 1;
        let id = views.0;
        views.1.insert(id, token.clone());
        drop(views);
        Self { scene: scene.clone(), id, token }
    }

    /// Token that cancels the work.
    pub fn token(&self) -> CancelToken {
        self.token.clone()
    }
}

impl Drop for View {
    fn drop(&mut self) {
        self.token.cancel();
        lock(&self.scene.views).1.remove(&self.id);
    }
}

/// The atlas whose mesh shows the material: that of an exported file, or else the first of the graph.
pub fn shown_mesh(graph: &Graph) -> Option<(NodeIndex, usize)> {
    let exported = graph.outputs.iter().find_map(|output| match output.mesh {
        Some(ExportMesh::Atlas { node, output }) => Some((node, output)),
        _ => None,
    });
    let of = |node: NodeIndex| {
        let output = graph.nodes[node].outputs.iter().position(|ty| *ty == Atlas::TYPE)?;
        Some((node, output))
    };
    exported.or_else(|| graph.nodes.node_indices().find_map(of))
}

impl Scene {
    /// The atlas whose mesh shows the material: see [`shown_mesh`].
    pub fn mesh(&self) -> Option<(NodeIndex, usize)> {
        shown_mesh(&self.graph)
    }

    /// Creates a scene without pictures.
    pub fn new(generation: u64, sha256: String, graph: Graph, keys: Keys) -> Self {
        let names = graph.nodes.node_indices().map(|index| (graph.nodes[index].name.clone(), index)).collect();
        Self {
            generation,
            sha256,
            graph,
            keys,
            shown: Mutex::default(),
            stats: Mutex::default(),
            names,
            views: Mutex::default(),
        }
    }

    /// Records the first picture of a target.
    pub fn begin(&self, shown: &PictureInfo) {
        lock(&self.shown).insert(shown.target.clone(), shown.clone());
    }

    /// Cancels all running looks.
    pub fn cancel_views(&self) {
        lock(&self.views).1.values().for_each(CancelToken::cancel);
    }

    /// Finds the target `name`.
    pub fn target(&self, name: &str) -> Option<Target> {
        let target = |node, output, channel| Some(Target { name: name.to_owned(), node, output, channel });
        let split = |name| str::rsplit_once(name, '.').and_then(|(rest, c)| Some((rest, Channel::from_name(c)?)));
        if let Some(name) = name.strip_prefix('@') {
            // A node without a name is called by its position, `node.port`.
            if let Some(node) = self.names.get(name) {
                return target(*node, 0, None);
            }
            let (rest, channel) = split(name).map_or((name, None), |(rest, channel)| (rest, Some(channel)));
            let (node, port) = rest.rsplit_once(':').map_or((rest, None), |(node, port)| (node, Some(port)));
            let node = *self.names.get(node)?;
            let outputs = self.graph.nodes[node].node.outputs();
            let output = port.map_or(Some(0), |port| outputs.iter().position(|o| o.name == port))?;
            return target(node, output, channel);
        }
        let output = |name: &str| self.graph.outputs.iter().find(|o| o.name == name);
        match output(name) {
            Some(output) => target(output.node, output.output, None),
            None => split(name).and_then(|(rest, c)| output(rest).and_then(|o| target(o.node, o.output, Some(c)))),
        }
    }

    /// Returns the preview of a target; for a material without a channel, that of its first channel.
    ///
    /// # Errors
    /// Fails if the value cannot be made.
    pub fn sight(&self, look: &Look<'_>, target: &Target) -> Result<Option<Preview>, Failure> {
        let Some(value) = look.value(target.node, target.output)? else { return Ok(None) };
        Ok(match value {
            Value::Material(material) => {
                let channel = target.channel.or_else(|| material.channels().first().map(|c| c.0));
                channel.and_then(|c| {
                    let field = material.get(c)?.clone();
                    let manner = DisplayStyle { unit: unit_of(c), ..DisplayStyle::of(&field) };
                    Some(Preview::Field(field, manner))
                })
            }
            Value::Field(field) => {
                let manner = DisplayStyle { unit: self.unit(target), ..DisplayStyle::of(&field) };
                Some(Preview::Field(field, manner))
            }
            Value::Picture(picture) => Some(Preview::Field(picture.rgb.clone(), DisplayStyle::of(&picture.rgb))),
            Value::SolidMaterial(material) => {
                let channel = target.channel.or_else(|| material.channels().first().map(|c| c.0));
                let Some((channel, solid)) = channel.and_then(|c| Some((c, material.get(c)?))) else { return Ok(None) };
                let field = previews::cut(look, &self.graph, (target.node, target.output), (solid, Some(channel)))?;
                let ty = field.ty();
                Some(Preview::Field(field, DisplayStyle { unit: unit_of(channel), ty, holes: true }))
            }
            Value::Solid(solid) => {
                let field = previews::cut(look, &self.graph, (target.node, target.output), (&solid, None))?;
                let ty = if solid.ty() == Type::SolidVector { Type::Vec2 } else { field.ty() };
                Some(Preview::Field(field, DisplayStyle { unit: self.unit(target), ty, holes: true }))
            }
            value => Some(match value.sketch() {
                Some(Sketch::Pixels(pixels)) => Preview::Pixels(pixels),
                sketch => Preview::Object(value.ty(), sketch),
            }),
        })
    }

    /// Unit of a target's values as its node declares it, or empty.
    fn unit(&self, target: &Target) -> &'static str {
        let node = &self.graph.nodes[target.node].node;
        node.outputs().get(target.output).and_then(|output| node.unit(output)).unwrap_or_default()
    }

    /// Size of a picture whose longest side is at most `longest`.
    pub fn size(&self, longest: u32) -> UVec2 {
        let full = self.graph.canvas.resolution;
        let side = full.max_element();
        if side <= longest {
            return full;
        }
        let scaled = |n: u32| (u64::from(n) * u64::from(longest)).div_ceil(u64::from(side));
        UVec2::new(scaled(full.x).try_into().unwrap_or(1), scaled(full.y).try_into().unwrap_or(1)).max(UVec2::ONE)
    }

    /// Returns the picture of a field in a size from the store, if it is there.
    pub fn known(&self, store: &Store, target: &Target, field: &Field, size: UVec2) -> Option<Arc<Stored>> {
        store.get(&self.id(target, field, &self.graph.canvas.grid(size)))
    }

    /// Returns the picture of a field in a size, from the store if it is there.
    ///
    /// # Errors
    /// Fails if the picture cannot be made or has values that are not finite.
    pub fn picture(
        &self,
        look: &Look<'_>,
        store: &Store,
        target: &Target,
        (field, manner): (&Field, DisplayStyle),
        size: UVec2,
    ) -> Result<Arc<Stored>, Failure> {
        let grid = self.graph.canvas.grid(size);
        let id = self.id(target, field, &grid);
        if let Some(known) = store.get(&id) {
            return Ok(known);
        }
        let (stored, _) = self.part(look, (target, id), (field, manner), (size, Window::full(size)))?;
        store.put(stored.clone());
        Ok(stored)
    }

    /// Draws a part of the picture of a field in a size; also returns its samples. The picture gets the name `id`.
    ///
    /// # Errors
    /// Those of [`picture`](Self::picture).
    pub fn part(
        &self,
        look: &Look<'_>,
        (target, id): (&Target, String),
        (field, manner): (&Field, DisplayStyle),
        (size, window): (UVec2, Window),
    ) -> Result<(Arc<Stored>, Tile), Failure> {
        let tile = look.raster(field, &self.graph.canvas.grid(size), window)?;
        if let Some(at) = tile.data().iter().position(|v| !v.is_finite() && !manner.holes) {
            return Err(self.not_finite(target, at % window.len().max(1), (size, window)));
        }
        let range = range(manner.ty, &tile);
        let png = Painter::new(manner.ty, range).png(&tile, &|| look.is_over());
        let Some(png) = png else { return Err(Failure::Cancelled) };
        let size = [window.width, window.height];
        Ok((Arc::new(Stored { id, png: png.into(), size, range, ty: field.ty() }), tile))
    }

    /// Returns a picture without a position on the canvas, at most `longest` pixels per side.
    pub fn pixels(&self, store: &Store, target: &Target, pixels: &Pixels, longest: u32) -> Arc<Stored> {
        let key = self.keys.output(target.node, target.output);
        let id = Key::of("flat preview", &[key.as_bytes(), &longest.to_le_bytes()]).to_string();
        store.get(&id).unwrap_or_else(|| {
            let (ty, tile) = (pixels.ty(), previews::tile(pixels, longest));
            let range = range(ty, &tile);
            let png = Painter::new(ty, range).png(&tile, &|| false).unwrap_or_default().into();
            let size = [tile.window.width, tile.window.height];
            let stored = Arc::new(Stored { id, png, size, range, ty });
            store.put(stored.clone());
            stored
        })
    }

    /// Name of the picture of a field on a grid.
    pub fn id(&self, target: &Target, field: &Field, grid: &Grid) -> String {
        let key = field.key().unwrap_or_else(|| {
            let channel = target.channel.map_or("", Channel::name);
            Key::of("channel", &[self.keys.output(target.node, target.output).as_bytes(), channel.as_bytes()])
        });
        let parts: [&[u8]; 3] = [key.as_bytes(), field.ty().name().as_bytes(), &grid.id().bytes()];
        Key::of("preview", &parts).to_string()
    }

    fn not_finite(&self, target: &Target, at: usize, (size, window): (UVec2, Window)) -> Failure {
        let width = window.width.max(1) as usize;
        let full = self.graph.canvas.resolution.as_dvec2() / size.as_dvec2();
        let place = |start: i32, at: usize, full: f64| ((f64::from(start) + at as f64) * full).floor();
        let (x, y) = (place(window.x, at % width, full.x), place(window.y, at / width, full.y));
        let message = format!("`{}` is not a finite number at pixel ({x}, {y})", target.name);
        let output = self.graph.outputs.iter().find(|o| o.node == target.node && o.output == target.output);
        let span = output.map_or(self.graph.nodes[target.node].span, |output| output.span);
        let help = "look for divisions by zero or overflow in the nodes before it";
        Failure::Errors(vec![Diagnostic::new(Code::NotFinite, span, message).help(help)])
    }

    /// Describes a picture for pages.
    pub fn shown(&self, target: &Target, unit: &'static str, stored: Arc<Stored>) -> PictureInfo {
        PictureInfo {
            target: target.name.clone(),
            picture: format!("picture/{}.png", stored.id),
            size: stored.size,
            is_final: stored.size == self.size(WHOLE).to_array(),
            range: stored.range,
            ty: stored.ty.to_string(),
            unit,
            own: false,
            stored,
        }
    }

    /// Describes a picture without a position on the canvas for pages.
    pub fn shown_pixels(&self, target: &Target, stored: Arc<Stored>) -> PictureInfo {
        PictureInfo { own: true, is_final: true, ..self.shown(target, "", stored) }
    }
}

fn unit_of(channel: Channel) -> &'static str {
    match channel {
        Channel::Height => "mm",
        Channel::AnisotropyAngle => "°",
        _ => "",
    }
}

/// Returns whether `span` lies in the graph file itself.
pub fn is_own(scene: &Scene, span: Span) -> bool {
    scene.graph.sources.path(span.file) == scene.graph.path
}

/// Returns whether the graph has a coloured solid.
pub fn has_solid(scene: &Scene) -> bool {
    scene.graph.nodes.node_weights().any(|node| node.outputs.contains(&Type::SolidColor))
}
