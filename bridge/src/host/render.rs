//! Rendering the outputs of a graph, one picture per step.
use super::mesh::{Cut, Loaded, On};
use super::open::Source;
use super::samples::{Form, Layout};
use super::shared::{Around, SlotState};
use super::{MOST_PIXELS, Message, Refusal, named};
use crate::page::edits::FieldEdit;
use crate::pictures::{Shown, pixels, shown};
use serde::Deserialize;
use serde_json::{Map, Value as Json, json};
use shibo_engine::eval::Keys;
use shibo_engine::session::Failure;
use shibo_graph::{Graph, GraphOutput, LoadOptions};
use shibo_value::clock::Stopwatch;
use shibo_value::{Channel, Field, Key, Resolution, Tile, Type, Value, Window};
use std::collections::{BTreeSet, VecDeque};
use std::sync::Arc;

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
    /// The place where the other program shows the pictures.
    #[serde(default)]
    pub(super) slot: Option<String>,
    /// `OUTPUT` or `OUTPUT.CHANNEL`; all by default.
    #[serde(default)]
    output: Option<String>,
    /// Channels of a material; all by default.
    #[serde(default)]
    channels: Option<Vec<String>>,
    #[serde(flatten)]
    pub(super) values: Parameters,
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
    /// The mesh along which solids are cut.
    #[serde(default)]
    pub(super) on: Option<On>,
}

/// Values of parameters.
#[derive(Deserialize)]
pub(super) struct Parameters {
    #[serde(default)]
    set: Map<String, Json>,
    #[serde(default)]
    preset: Option<String>,
    #[serde(default)]
    seed: Option<u64>,
    /// Values in the texts of nodes; they are tried without a change of the text.
    #[serde(default)]
    pub(super) edits: Vec<FieldEdit>,
}

impl Parameters {
    /// Options to load the graph with these values, at a size of the longer side.
    pub(super) fn options(&self, size: Option<u32>) -> LoadOptions {
        let seed = self.seed.map(|seed| ("seed".to_owned(), seed.to_string()));
        LoadOptions {
            preset: self.preset.clone(),
            set: self.set.iter().map(|(name, value)| (name.clone(), ron(value))).chain(seed).collect(),
            resolution: size.map(Resolution::Longer),
            ..LoadOptions::default()
        }
    }
}

/// Refuses a size that no picture has.
pub(super) fn check_size(size: u32) -> Result<(), Refusal> {
    match (1..=MOST_PIXELS).contains(&size) {
        true => Ok(()),
        false => Err(Refusal::new("usage", format!("a size is {size}; it must be 1 to {MOST_PIXELS} pixels"))),
    }
}

/// A graph at one size, and the pictures that are still to be made.
struct Size {
    graph: Graph,
    /// The mesh, and the keys of the graph.
    cut: Option<(Cut, Keys)>,
    waiting: VecDeque<Shown>,
}

/// The names of all pictures that a graph may have.
fn names(graph: &Graph) -> Vec<String> {
    let of = |output: &GraphOutput| -> Vec<String> {
        if !output.ty.is_material() {
            return vec![output.name.clone()];
        }
        let channels = &graph.nodes[output.node].channels;
        channels.iter().map(|channel| format!("{}.{}", output.name, channel.name())).collect()
    };
    graph.outputs.iter().flat_map(of).collect()
}

/// An unfinished render.
pub(super) struct Render {
    source: Source,
    wanted: Request,
    slot: Option<Arc<SlotState>>,
    mesh: Option<Arc<Loaded>>,
    /// The pictures made so far, by place.
    places: BTreeSet<String>,
    /// The sizes that were not begun.
    sizes: VecDeque<Option<u32>>,
    now: Option<Size>,
    computed: usize,
    watch: Stopwatch,
}

impl Render {
    pub(super) fn new(
        source: Source,
        wanted: Request,
        slot: Option<Arc<SlotState>>,
        mesh: Option<Arc<Loaded>>,
    ) -> Result<Self, Refusal> {
        wanted.sizes.iter().try_for_each(|size| check_size(*size))?;
        wanted.on.as_ref().map_or(Ok(()), On::check)?;
        if wanted.components.is_some_and(|count| !(1..=4).contains(&count)) {
            return Err(Refusal::new("usage", "`components` must be 1 to 4"));
        }
        let sizes = match wanted.sizes.is_empty() {
            true => VecDeque::from([None]),
            false => wanted.sizes.iter().copied().map(Some).collect(),
        };
        let (places, watch) = (BTreeSet::new(), Stopwatch::wall());
        Ok(Self { source, wanted, slot, mesh, places, sizes, now: None, computed: 0, watch })
    }

    /// Makes the next picture; `None` if there is none.
    pub(super) fn step(&mut self, around: &Around<'_>) -> Result<Option<Message>, Refusal> {
        loop {
            let next = self.now.as_mut().and_then(|size| size.waiting.pop_front());
            if let (Some(size), Some(shown)) = (&self.now, next) {
                let made = self.picture(around, size, &shown)?;
                self.computed += usize::from(made.json["event"] == "picture");
                self.places.extend(made.place.clone());
                return Ok(Some(made));
            }
            let Some(size) = self.sizes.pop_front() else {
                if let Some(slot) = &self.slot {
                    slot.retain(|place| self.places.contains(place));
                }
                return Ok(None);
            };
            self.now = Some(self.begin(size, around)?);
        }
    }

    /// The answer after the last picture.
    pub(super) fn done(&self) -> Json {
        let ms = u64::try_from(self.watch.elapsed().as_millis()).unwrap_or(u64::MAX);
        json!({ "final": true, "computed": self.computed, "ms": ms })
    }

    fn begin(&self, size: Option<u32>, around: &Around<'_>) -> Result<Size, Refusal> {
        let graph = self.source.graph(around.shared, self.wanted.values.options(size))?;
        let own =
            self.wanted.output.as_deref().map(|wanted| wanted.split_once('.').map_or(wanted, |(output, _)| output));
        let is_own = |output: &str| own.is_none_or(|own| own == output);
        let found = shown(&around.shared.session, &graph, &is_own, around.cancel, around.observer);
        let found = found.map_err(|failure| refusal(around, &self.source, failure, &graph))?;
        let waiting: VecDeque<Shown> = found.into_iter().filter(|shown| self.is_wanted(&shown.name)).collect();
        if waiting.is_empty() {
            let output = self.wanted.output.as_deref().unwrap_or("");
            let message = format!("there is no picture `{output}`; there are {}", names(&graph).join(", "));
            return Err(Refusal::new("no-output", message));
        }
        let cut = match (&self.mesh, &self.wanted.on) {
            (Some(mesh), Some(on)) => {
                let keys = around.shared.session.keys(&graph);
                let keys = keys.map_err(|failure| refusal(around, &self.source, failure, &graph))?;
                Some((mesh.cut(around, on, (graph.canvas.size_mm, graph.canvas.seed))?, keys))
            }
            _ => None,
        };
        Ok(Size { graph, cut, waiting })
    }

    fn is_wanted(&self, name: &str) -> bool {
        let (output, channel) = name.split_once('.').unwrap_or((name, ""));
        let of_output = self.wanted.output.as_deref().is_none_or(|wanted| wanted == name || wanted == output);
        let channels = self.wanted.channels.as_ref();
        of_output && channels.is_none_or(|channels| channel.is_empty() || channels.iter().any(|one| one == channel))
    }

    /// The event with a picture, or the event `same`.
    fn picture(&self, around: &Around<'_>, Size { graph, cut, .. }: &Size, shown: &Shown) -> Result<Message, Refusal> {
        let size = graph.canvas.resolution;
        let (output, channel) = match shown.name.split_once('.') {
            Some((output, channel)) => (output, Some(channel)),
            None => (shown.name.as_str(), None),
        };
        let field = shown.value.rendered().map(|(field, _)| field);
        let key = self.key(graph, (shown, cut.as_ref()), field.as_ref());
        let place = format!("{} {} {}", shown.name, size.x, size.y);
        let mut message = Message::event("picture");
        message.put("output", output);
        message.put("channel", channel);
        message.put("key", key.as_str());
        message.put("width", size.x);
        message.put("height", size.y);
        message.put("size_mm", json!(graph.canvas.size_mm.to_array()));
        message.put("unit", shown.unit);
        message.put("final", self.sizes.is_empty());
        message.place = Some(place.clone());
        if self.slot.as_ref().is_some_and(|slot| slot.has(&place, &key)) {
            message.put("event", "same");
            return Ok(message);
        }
        if let Some(field) = field {
            self.fill(around, (graph, cut.as_ref(), shown), field, &mut message)?;
        } else {
            // Lines, points and other objects have no pixels here.
            message.put("meaning", "object");
            message.put("type", shown.value.ty().name());
        }
        if let Some(slot) = &self.slot {
            slot.set(place, key);
        }
        Ok(message)
    }

    /// Adds the samples of a field.
    fn fill(
        &self,
        around: &Around<'_>,
        (graph, cut, shown): (&Graph, Option<&(Cut, Keys)>, &Shown),
        plain: Field,
        message: &mut Message,
    ) -> Result<(), Refusal> {
        let drawn = match cut {
            Some(cut) => on_mesh(around, graph, cut, shown, plain),
            None if plain.as_constant().is_some() => Ok((plain, None)),
            None => {
                pixels(&around.shared.session, graph, &plain, around.cancel, around.observer).map(|tile| (plain, tile))
            }
        };
        let (field, tile) = drawn.map_err(|failure| refusal(around, &self.source, failure, graph))?;
        let (form, wanted) = (self.wanted.form, self.wanted.components);
        let components = wanted.unwrap_or_else(|| field.channels());
        let layout = Layout { components, bottom_up: self.wanted.rows == Rows::Bottom };
        message.put("meaning", meaning(field.ty()));
        message.put("components", components);
        message.put("as", form.name());
        message.put("bits", form.bits());
        if let Some(value) = field.as_constant() {
            message.put("value", layout.pixel(value));
            return Ok(());
        }
        let range = graph.outputs.iter().find(|output| shown.name == output.name).and_then(|output| output.range);
        let tile = tile.ok_or_else(|| Refusal::new("no-output", format!("`{}` has no pixels", shown.name)))?;
        message.bytes = Some(form.bytes(&tile, layout, (field.ty() == Type::Rgb, range))?);
        Ok(())
    }

    /// A name of the samples: equal names mean equal samples.
    fn key(&self, graph: &Graph, (shown, cut): (&Shown, Option<&(Cut, Keys)>), field: Option<&Field>) -> String {
        let own = || Key::of("shown", &[shown.key.as_bytes(), shown.name.as_bytes()]);
        let key = field.and_then(Field::key).unwrap_or_else(own);
        let grid = graph.canvas.grid(graph.canvas.resolution).id().bytes();
        let ty = field.map_or("", |field| field.ty().name());
        // The range of an output decides the bytes of `u8` and `png`.
        let range = graph.outputs.iter().find(|output| shown.name == output.name).and_then(|output| output.range);
        let how = format!("{ty} {:?} {:?} {:?} {range:?}", self.wanted.form, self.wanted.rows, self.wanted.components);
        let on = cut.map(|(cut, _)| cut.key());
        let on = on.as_ref().map_or(&[][..], |key| &key.as_bytes()[..]);
        Key::of("bridge", &[key.as_bytes(), &grid, how.as_bytes(), on]).to_string()
    }
}

/// A picture whose solids are cut along a mesh. `plain` is the picture without the mesh.
fn on_mesh(
    around: &Around<'_>,
    graph: &Graph,
    (cut, keys): &(Cut, Keys),
    shown: &Shown,
    plain: Field,
) -> Result<(Field, Option<Tile>), Failure> {
    let (name, channel) = shown.name.split_once('.').unwrap_or((&shown.name, ""));
    let at = graph.outputs.iter().find(|output| output.name == name).map(|output| (output.node, output.output));
    let size = graph.canvas.resolution;
    around.shared.session.look(graph, keys, around.cancel, around.observer, |look| {
        let value = at.map(|at| cut.of(look, (graph, keys), at, around)).transpose()?.flatten();
        let field = match value {
            Some(Value::Material(material)) => Channel::from_name(channel).and_then(|one| material.get(one).cloned()),
            Some(value) => value.field(),
            None => None,
        };
        let field = field.unwrap_or(plain);
        if field.as_constant().is_some() {
            return Ok((field, None));
        }
        let tile = look.raster(&field, &graph.canvas.grid(size), Window::full(size))?;
        Ok((field, Some(tile)))
    })
}

pub(super) fn refusal(around: &Around<'_>, source: &Source, failure: Failure, graph: &Graph) -> Refusal {
    Refusal::of_failure(&around.shared.tools, &named(&source.path), failure, &graph.sources)
}

/// A value of JSON as the command line writes it.
pub(super) fn ron(value: &Json) -> String {
    match value {
        Json::String(text) => text.clone(),
        Json::Array(items) => format!("({})", items.iter().map(ron).collect::<Vec<_>>().join(", ")),
        other => other.to_string(),
    }
}

/// The meaning of the numbers of a field.
pub(super) fn meaning(ty: Type) -> &'static str {
    match ty {
        Type::Rgb => "color",
        Type::Normal => "normal",
        Type::Gray => "number",
        _ => "data",
    }
}
