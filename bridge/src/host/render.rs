//! Rendering the outputs of a graph, one picture per step.
use super::open::Source;
use super::{MOST_PIXELS, Message, Refusal};
use crate::Tools;
use crate::pictures::{Shown, pixels, shown};
use serde::Deserialize;
use serde_json::{Map, Value as Json, json};
use shibo_engine::eval::CancelToken;
use shibo_engine::session::{Failure, Session};
use shibo_graph::{Graph, LoadOptions};
use shibo_value::clock::Stopwatch;
use shibo_value::{Field, Resolution, Tile, Type};
use std::collections::VecDeque;

/// The form of samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Form {
    /// Floats of 32 bits, little-endian: the exact values of the graph.
    #[default]
    F32,
}

/// Order of the rows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Rows {
    /// The top row comes first.
    #[default]
    Top,
    /// The bottom row comes first.
    Bottom,
}

/// The fields of `render`.
#[derive(Deserialize)]
pub(super) struct Request {
    pub(super) graph: String,
    /// `OUTPUT` or `OUTPUT.CHANNEL`; all by default.
    #[serde(default)]
    output: Option<String>,
    /// Channels of a material; all by default.
    #[serde(default)]
    channels: Option<Vec<String>>,
    #[serde(default)]
    set: Map<String, Json>,
    #[serde(default)]
    preset: Option<String>,
    #[serde(default)]
    seed: Option<u64>,
    /// Pixels of the longer side, smallest first; the size of the canvas by default.
    #[serde(default)]
    sizes: Vec<u32>,
    #[serde(default, rename = "as")]
    form: Form,
    #[serde(default)]
    rows: Rows,
    /// Components of a pixel; by default those of the picture.
    #[serde(default)]
    components: Option<usize>,
}

/// A graph at one size, and the pictures that are still to be made.
struct Size {
    graph: Graph,
    waiting: VecDeque<Shown>,
}

/// An unfinished render.
pub(super) struct Render {
    source: Source,
    wanted: Request,
    /// The sizes that were not begun.
    sizes: VecDeque<Option<u32>>,
    now: Option<Size>,
    computed: usize,
    watch: Stopwatch,
}

impl Render {
    pub(super) fn new(source: Source, wanted: Request) -> Result<Self, Refusal> {
        if let Some(wrong) = wanted.sizes.iter().find(|size| !(1..=MOST_PIXELS).contains(size)) {
            return Err(Refusal::new("usage", format!("a size is {wrong}; it must be 1 to {MOST_PIXELS} pixels")));
        }
        if wanted.components.is_some_and(|count| !(1..=4).contains(&count)) {
            return Err(Refusal::new("usage", "`components` must be 1 to 4"));
        }
        let sizes = match wanted.sizes.is_empty() {
            true => VecDeque::from([None]),
            false => wanted.sizes.iter().copied().map(Some).collect(),
        };
        Ok(Self { source, wanted, sizes, now: None, computed: 0, watch: Stopwatch::wall() })
    }

    /// Makes the next picture; `None` if there is none.
    pub(super) fn step(&mut self, session: &Session, tools: &Tools) -> Result<Option<Message>, Refusal> {
        loop {
            if let Some(size) = &mut self.now
                && let Some(shown) = size.waiting.pop_front()
            {
                let message =
                    picture(session, tools, &self.source, (&size.graph, &shown), &self.wanted, self.sizes.is_empty())?;
                self.computed += 1;
                return Ok(Some(message));
            }
            let Some(size) = self.sizes.pop_front() else { return Ok(None) };
            self.now = Some(self.begin(size, session, tools)?);
        }
    }

    /// The answer after the last picture.
    pub(super) fn done(&self) -> Json {
        json!({ "final": true, "computed": self.computed, "ms": self.watch.elapsed().as_millis() as u64 })
    }

    fn begin(&self, size: Option<u32>, session: &Session, tools: &Tools) -> Result<Size, Refusal> {
        let seed = self.wanted.seed.map(|seed| ("seed".to_owned(), seed.to_string()));
        let options = LoadOptions {
            preset: self.wanted.preset.clone(),
            set: self.wanted.set.iter().map(|(name, value)| (name.clone(), ron(value))).chain(seed).collect(),
            resolution: size.map(Resolution::Longer),
            ..LoadOptions::default()
        };
        let graph = self.source.graph(session, tools, options)?;
        let all = shown(session, &graph, &CancelToken::default());
        let all = all.map_err(|failure| refusal(tools, &self.source, failure, &graph))?;
        let names: Vec<String> = all.iter().map(|shown| shown.name.clone()).collect();
        let waiting: VecDeque<Shown> = all.into_iter().filter(|shown| self.is_wanted(&shown.name)).collect();
        if waiting.is_empty() {
            let output = self.wanted.output.as_deref().unwrap_or("");
            let message = format!("there is no picture `{output}`; there are {}", names.join(", "));
            return Err(Refusal::new("no-output", message));
        }
        Ok(Size { graph, waiting })
    }

    fn is_wanted(&self, name: &str) -> bool {
        let (output, channel) = name.split_once('.').unwrap_or((name, ""));
        let of_output = self.wanted.output.as_deref().is_none_or(|wanted| wanted == name || wanted == output);
        let channels = self.wanted.channels.as_ref();
        of_output && channels.is_none_or(|channels| channel.is_empty() || channels.iter().any(|one| one == channel))
    }
}

fn refusal(tools: &Tools, source: &Source, failure: Failure, graph: &Graph) -> Refusal {
    Refusal::of_failure(tools, &source.path.display().to_string(), failure, &graph.sources)
}

/// A value of JSON as the command line writes it.
fn ron(value: &Json) -> String {
    match value {
        Json::String(text) => text.clone(),
        Json::Array(items) => format!("({})", items.iter().map(ron).collect::<Vec<_>>().join(", ")),
        other => other.to_string(),
    }
}

/// The event with a picture.
fn picture(
    session: &Session,
    tools: &Tools,
    source: &Source,
    (graph, shown): (&Graph, &Shown),
    wanted: &Request,
    is_final: bool,
) -> Result<Message, Refusal> {
    let (output, channel) = match shown.name.split_once('.') {
        Some((output, channel)) => (output, Some(channel)),
        None => (shown.name.as_str(), None),
    };
    let mut json = Map::new();
    let size = graph.canvas.resolution;
    let mut put = |name: &str, value: Json| drop(json.insert(name.to_owned(), value));
    put("event", "picture".into());
    put("output", output.into());
    put("channel", channel.into());
    put("key", shown.key.to_string().into());
    put("width", size.x.into());
    put("height", size.y.into());
    put("size_mm", json!(graph.canvas.size_mm.to_array()));
    put("unit", shown.unit.into());
    put("final", is_final.into());
    let Some((field, _)) = shown.value.rendered() else {
        // Lines, points and other objects have no pixels here.
        put("meaning", "object".into());
        put("type", shown.value.ty().name().into());
        return Ok(Message { json, bytes: None });
    };
    put("meaning", meaning(&field).into());
    let components = wanted.components.unwrap_or_else(|| field.channels());
    put("components", components.into());
    if let Some(value) = field.as_constant() {
        put("value", (0..components).map(|at| component(at, value)).collect::<Vec<f32>>().into());
        return Ok(Message { json, bytes: None });
    }
    let tile = pixels(session, graph, &field, &CancelToken::default());
    let tile = tile.map_err(|failure| refusal(tools, source, failure, graph))?;
    let Form::F32 = wanted.form;
    let bytes = tile.map(|tile| samples(&tile, components, wanted.rows));
    Ok(Message { json, bytes })
}

/// The meaning of the numbers of a field.
fn meaning(field: &Field) -> &'static str {
    match field.ty() {
        Type::Rgb => "color",
        Type::Normal => "normal",
        Type::Gray => "number",
        _ => "data",
    }
}

/// A component of a pixel with these channels: a number counts for three, and opacity is 1.
fn component(at: usize, channels: &[f32]) -> f32 {
    match (channels, at) {
        (_, 3) if channels.len() < 4 => 1.0,
        ([one], _) => *one,
        _ => channels.get(at).copied().unwrap_or(0.0),
    }
}

/// Pixels with interleaved components, row by row.
fn samples(tile: &Tile, components: usize, rows: Rows) -> Vec<u8> {
    let (width, height, channels) = (tile.width(), tile.height(), tile.channels());
    let mut bytes = Vec::with_capacity(4 * components * width * height);
    let mut pixel = vec![0.0; channels];
    for row in 0..height {
        let row = if rows == Rows::Top { row } else { height - 1 - row };
        for at in row * width..(row + 1) * width {
            pixel.iter_mut().enumerate().for_each(|(channel, value)| *value = tile.plane(channel)[at]);
            (0..components).for_each(|at| bytes.extend(component(at, &pixel).to_le_bytes()));
        }
    }
    bytes
}
