//! Thumbnails and comparisons of pictures for agents.
use super::graphs::{Checked, Source, findings, load, open};
use super::region::Region;
use super::{Refusal, State};
use crate::compare::Comparison;
use crate::scene::{Preview, Scene, Store, Target};
use crate::{CompareRequest, compare, picture};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_engine::eval::{CancelToken, Silent};
use shibo_engine::session::{Failure, Look};
use shibo_graph::Graph;
use shibo_picture::{Picture, ReadLimits, read_bytes};
use shibo_value::clock::Stopwatch;
use shibo_value::{Resolution, Tile, Window};
use std::collections::BTreeMap;
use std::io::Read as _;

/// The longest side of a picture in pixels.
const MOST: u32 = 512;
/// The longest side if none is asked for.
const USUAL: u32 = 256;
/// The largest picture file that is compared, in bytes and in pixels.
const MOST_BYTES: u64 = 64 << 20;
const MOST_PIXELS: u64 = 16 << 20;

/// A picture of a graph.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RenderRequest {
    /// The text of the graph, in RON.
    text: Option<String>,
    /// The path of a graph, or `shibo:NAME`.
    path: Option<String>,
    /// The output, `name` or `name.channel`. The first one, if neither an output nor a node is given.
    output: Option<String>,
    /// The node, `name` or `name.port`, in place of an output.
    node: Option<String>,
    /// The longest side in pixels, at most 512; 256 if not given.
    size: Option<u32>,
    /// Values of parameters, in RON: `{ "pitch": "0.7" }`.
    #[serde(default)]
    set: BTreeMap<String, String>,
    /// A preset, or several: `a+b`.
    preset: Option<String>,
    /// The part of the canvas to show, `[x, y, width, height]` in mm from the upper left corner; the whole if not given. Its longest
    /// side gets `size` pixels.
    region: Option<[f64; 4]>,
}

/// Facts about a picture.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct Rendered {
    /// The output or the node.
    target: String,
    /// Width and height in pixels.
    size: [u32; 2],
    /// The values that are black and white.
    range: [f32; 2],
    /// The part of the canvas that the picture shows: x, y, width and height in mm from the upper left corner.
    region: [f64; 4],
    /// The smallest, the largest and the mean value in the picture, for each channel.
    min: Vec<f32>,
    max: Vec<f32>,
    mean: Vec<f64>,
    /// The type, such as `Gray`.
    #[serde(rename = "type")]
    ty: String,
    /// Width of a pixel in mm.
    mm_per_pixel: f64,
    /// True in the directions in which the canvas repeats: to the right, and down.
    tiles: [bool; 2],
    /// Seconds that the call took.
    seconds: f64,
}

/// Two pictures.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CompareArgs {
    /// The first picture.
    a: Side,
    /// The second picture.
    b: Side,
    /// Width of the first one in mm.
    width_mm_a: Option<f64>,
    /// Width of the second one in mm.
    width_mm_b: Option<f64>,
}

/// A picture file, or a picture of a graph.
#[derive(Clone, Debug, Deserialize, JsonSchema)]
#[serde(untagged)]
enum Side {
    /// A picture file in the folders for reading.
    File {
        /// The path.
        file: String,
    },
    /// A picture of a graph.
    Graph(Box<RenderRequest>),
}

/// The reason why there is no picture.
#[derive(Debug)]
pub enum NoPicture {
    /// The operation is refused.
    Refused(Refusal),
    /// Errors of the graph.
    Faulty(Checked),
}

impl From<Refusal> for NoPicture {
    fn from(refusal: Refusal) -> Self {
        Self::Refused(refusal)
    }
}

/// A picture with its samples and facts.
struct Made {
    png: Vec<u8>,
    facts: Rendered,
    tile: Tile,
}

/// Renders a picture of at most 512 pixels on its longest side: PNG and facts.
///
/// # Errors
/// Fails if the graph has errors, if it may not be read, or if the target is no picture.
pub fn render(state: &State, request: &RenderRequest, cancel: &CancelToken) -> Result<(Vec<u8>, Rendered), NoPicture> {
    let start = Stopwatch::wall();
    let mut made = make(state, request, cancel)?;
    made.facts.seconds = start.elapsed().as_secs_f64();
    Ok((made.png, made.facts))
}

/// Compares two pictures, each a file or a picture of a graph.
///
/// # Errors
/// Fails if one of the pictures cannot be read or made, or if they cannot be compared.
pub fn compare_pictures(state: &State, args: &CompareArgs, cancel: &CancelToken) -> Result<Comparison, NoPicture> {
    let (a, b) = (side(state, &args.a, cancel)?, side(state, &args.b, cancel)?);
    let request = CompareRequest { width_mm_a: args.width_mm_a, width_mm_b: args.width_mm_b };
    compare(&a, &b, &request).map_err(|message| Refusal::new("bad-value", message, "give other pictures").into())
}

fn side(state: &State, side: &Side, cancel: &CancelToken) -> Result<Picture, NoPicture> {
    let request = match side {
        Side::File { file } => {
            // The opened file is read: another file may take its name meanwhile.
            let (_, opened) = state.folders.file(file, MOST_BYTES)?;
            let mut bytes = Vec::new();
            let unread = |_| Refusal::new("bad-file", format!("`{file}` cannot be read"), "give a readable file");
            opened.take(MOST_BYTES).read_to_end(&mut bytes).map_err(unread)?;
            let limits = ReadLimits { max_pixels: MOST_PIXELS, ..ReadLimits::default() };
            let failed =
                |_| Refusal::new("bad-file", format!("`{file}` is not a picture"), "give PNG, JPEG, TIFF or EXR");
            return Ok(read_bytes(&bytes, &limits).map_err(failed)?);
        }
        Side::Graph(request) => request,
    };
    let tile = make(state, request, cancel)?.tile;
    if !matches!(tile.channels(), 1 | 3) {
        return Err(Refusal::new("bad-value", "vectors are no picture to compare", "compare numbers or colours").into());
    }
    Ok(picture(&tile, tile.channels() == 3))
}

fn make(state: &State, request: &RenderRequest, cancel: &CancelToken) -> Result<Made, NoPicture> {
    let side = request.size.unwrap_or(USUAL);
    if side == 0 || side > MOST {
        let message = format!("`size` is {side}; it must be between 1 and {MOST} pixels");
        return Err(Refusal::new("out-of-range", message, "thumbnails are enough to judge a material").into());
    }
    let source = Source { text: request.text.clone(), path: request.path.clone() };
    let opened = open(&state.tools, &state.folders, &source)?;
    let set: Vec<(String, String)> = request.set.clone().into_iter().collect();
    let values = (&set[..], request.preset.as_deref());
    let tools = state.tools.until(cancel);
    let load = |longest| load(&tools, &opened, values, Some(Resolution::Longer(longest)));
    let mut loaded = load(side);
    let size_mm = loaded.graph.as_ref().map(|graph| graph.canvas.size_mm);
    let region = request.region.zip(size_mm).map(|(region, size_mm)| Region::new(region, size_mm, side)).transpose()?;
    if let Some(region) = &region {
        loaded = load(region.longest);
    }
    let Some(graph) = loaded.graph else {
        return Err(NoPicture::Faulty(findings(&tools, &loaded.diagnostics, &loaded.sources)));
    };
    let name = target_name(&graph, request)?;
    let session = state.session()?;
    let sources = loaded.sources;
    let failed = |failure: Failure| match failure {
        Failure::Errors(errors) => NoPicture::Faulty(findings(&tools, &errors, &sources)),
        Failure::Cancelled => Refusal::new("cancelled", "the call was cancelled", "").into(),
        Failure::File(message) | Failure::Usage(message) => Refusal::new("bad-value", message, "").into(),
    };
    let keys = session.keys(&graph).map_err(failed)?;
    let scene = Scene::new(0, String::new(), graph, keys);
    let unknown =
        || Refusal::new("unknown", format!("there is no `{name}`"), "`describe_graph` names nodes and outputs");
    let target = scene.target(&name).ok_or_else(unknown)?;
    let made = session.look(&scene.graph, &scene.keys, cancel, &Silent, |look| {
        paint(&scene, look, (&target, &state.store), (region, side))
    });
    let made = made.map_err(failed)?;
    session.trim();
    let none = || match target.channel {
        Some(channel) => {
            let message = format!("the material does not set `{}`, so it has its default value", channel.name());
            Refusal::new("type-mismatch", message, "render a channel that its `Material` sets")
        }
        None => Refusal::new("type-mismatch", format!("`{name}` is no picture"), "render a node that draws it"),
    };
    Ok(made.ok_or_else(none)?)
}

/// The picture of a target or of a part of it; `None` if it has none.
fn paint(
    scene: &Scene,
    look: &Look<'_>,
    (target, store): (&Target, &Store),
    (region, side): (Option<Region>, u32),
) -> Result<Option<Made>, Failure> {
    let Some(Preview::Field(field, style)) = scene.sight(look, target)? else { return Ok(None) };
    let canvas = &scene.graph.canvas;
    let size = scene.size(region.map_or(side, |region| region.longest));
    let window = region.map_or(Window::full(size), |region| region.window(canvas.size_mm, size));
    let (stored, tile) = if region.is_some() {
        scene.part(look, (target, String::new()), (&field, style), (size, window))?
    } else {
        let stored = scene.picture(look, store, target, (&field, style), size)?;
        (stored, look.raster(&field, &canvas.grid(size), window)?)
    };
    let pixel = canvas.size_mm / size.as_dvec2();
    let planes = || (0..tile.channels()).map(|channel| tile.plane(channel));
    let fold =
        |f: fn(f32, f32) -> f32, start: f32| planes().map(|plane| plane.iter().copied().fold(start, f)).collect();
    let mean = |plane: &[f32]| plane.iter().map(|value| f64::from(*value)).sum::<f64>() / plane.len().max(1) as f64;
    let facts = Rendered {
        target: target.name.clone(),
        size: stored.size,
        range: stored.range,
        region: [
            f64::from(window.x) * pixel.x,
            f64::from(window.y) * pixel.y,
            f64::from(window.width) * pixel.x,
            f64::from(window.height) * pixel.y,
        ],
        min: fold(f32::min, f32::INFINITY),
        max: fold(f32::max, f32::NEG_INFINITY),
        mean: planes().map(mean).collect(),
        ty: stored.ty.to_string(),
        mm_per_pixel: pixel.x,
        tiles: [canvas.tile.x, canvas.tile.y],
        seconds: 0.0,
    };
    Ok(Some(Made { png: stored.png.to_vec(), facts, tile }))
}

/// The name of what a request shows, as scenes call it.
fn target_name(graph: &Graph, request: &RenderRequest) -> Result<String, Refusal> {
    match (&request.output, &request.node) {
        (Some(_), Some(_)) => Err(Refusal::new("bad-value", "give `output` or `node`", "one of both is shown")),
        (Some(output), None) => Ok(output.clone()),
        (None, Some(node)) => Ok(match node.split_once('.') {
            Some((node, port)) => format!("@{node}:{port}"),
            None => format!("@{node}"),
        }),
        (None, None) => {
            let first = graph.outputs.first().map(|output| output.name.clone());
            first.ok_or_else(|| Refusal::new("missing-input", "the graph has no outputs", "give a `node`"))
        }
    }
}
