//! The pictures of a graph's outputs, and the differences between those of two versions of a graph.
use crate::GraphText;
use crate::compare::{CompareRequest, Comparison, Measured, compare};
use petgraph::graph::NodeIndex;
use serde::{Deserialize, Serialize};
use shibo_engine::eval::{CancelToken, Observer, Silent};
use shibo_engine::session::{Failure, Session};
use shibo_graph::{Graph, LoadOptions, load_text};
use shibo_picture::{Picture, SampleKind};
use shibo_value::diagnostics::SourceMap;
use shibo_value::{Channel, Field, Key, Resolution, Tile, Type, Value, Window, linear_to_srgb};
use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

/// An output of a graph, or a channel of its material.
pub(crate) struct Shown {
    /// `OUTPUT`, or `OUTPUT.CHANNEL`.
    pub(crate) name: String,
    /// The key of the output.
    pub(crate) key: Key,
    /// Its value: a channel is a field.
    pub(crate) value: Value,
    /// The unit of its numbers, if it has one.
    pub(crate) unit: Option<&'static str>,
}

/// The outputs of a graph whose names are wanted, with their pictures not evaluated yet. An output with several names is made
/// once.
///
/// # Errors
/// Errors of the graph, at their places.
pub(crate) fn shown(
    session: &Session,
    graph: &Graph,
    is_wanted: &dyn Fn(&str) -> bool,
    cancel: &CancelToken,
    observer: &dyn Observer,
) -> Result<Vec<Shown>, Failure> {
    let keys = session.keys(graph)?;
    let mut values: BTreeMap<(NodeIndex, usize), Value> = BTreeMap::new();
    let mut found = Vec::new();
    for output in graph.outputs.iter().filter(|output| is_wanted(&output.name)) {
        let at = (output.node, output.output);
        let value = match values.entry(at) {
            Entry::Occupied(known) => known.into_mut(),
            Entry::Vacant(place) => place.insert(session.value(graph, at, cancel, observer)?),
        };
        let (key, value) = (keys.output(at.0, at.1), &*value);
        if let Value::Material(material) = value {
            found.extend(material.channels().iter().map(|(channel, field)| Shown {
                name: format!("{}.{}", output.name, channel.name()),
                key,
                value: Value::Field(field.clone()),
                unit: (*channel == Channel::Height).then_some("mm"),
            }));
        } else {
            let node = &graph.nodes[output.node].node;
            let unit = node.outputs().get(output.output).and_then(|output| node.unit(output));
            found.push(Shown { name: output.name.clone(), key, value: value.clone(), unit });
        }
    }
    Ok(found)
}

/// All pixels of a field, at the resolution of the graph.
pub(crate) fn pixels(
    session: &Session,
    graph: &Graph,
    field: &Field,
    cancel: &CancelToken,
    observer: &dyn Observer,
) -> Result<Option<Tile>, Failure> {
    let size = graph.canvas.resolution;
    let wanted = [(graph.canvas.grid(size), Window::full(size))];
    Ok(session.rasters(graph, field, &wanted, cancel, observer)?.0.pop())
}

/// The pictures that are compared.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PicturesRequest {
    /// Pixels of the longer side.
    pub size: u32,
    /// Outputs, or channels as `OUTPUT.CHANNEL`; all if empty.
    #[serde(default)]
    pub outputs: Vec<String>,
    /// The preset.
    #[serde(default)]
    pub preset: Option<String>,
    /// Folders for imports.
    #[serde(default)]
    pub import_paths: Vec<PathBuf>,
}

/// The kind of a picture's change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PictureChange {
    /// No pixel differs.
    Same,
    /// Pixels differ.
    Changed,
    /// Only the version after has it.
    Added,
    /// Only the version before has it.
    Removed,
}

/// The difference between two versions of a picture. Numbers of a colour are those on a screen, 0..255; others have the unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PictureDiff {
    /// The name of the output, or `OUTPUT.CHANNEL`.
    pub name: String,
    /// The kind of the change.
    pub change: PictureChange,
    /// Mean absolute difference over pixels and channels.
    pub mean: Option<f64>,
    /// Largest absolute difference.
    pub max: Option<f64>,
    /// Root of the mean square.
    pub rms: Option<f64>,
    /// The pixel with the largest difference: column and row, from 0.
    pub at: Option<[usize; 2]>,
    /// The unit of the numbers.
    pub unit: Option<String>,
    /// The difference in words.
    pub words: Vec<String>,
}

/// A difference with both pictures, for sheets. A picture that did not change has none.
pub struct Compared {
    /// The difference.
    pub diff: PictureDiff,
    /// The pixels before.
    pub before: Option<Tile>,
    /// The pixels after.
    pub after: Option<Tile>,
    /// True if the pixels are linear colours.
    pub is_color: bool,
}

/// A version of a graph that could not be rendered.
pub struct NotRendered {
    /// The reason.
    pub failure: Failure,
    /// The texts that its places point into.
    pub sources: SourceMap,
}

/// A version that was loaded, with its outputs.
struct Version {
    graph: Graph,
    outputs: Vec<Shown>,
}

/// Compares the pictures of two versions of a graph. An output with equal keys is not rendered.
///
/// # Errors
/// Errors of either version, with its texts; an output that neither version has.
pub fn pictures(
    session: &Session,
    (before, after): (&GraphText, &GraphText),
    request: &PicturesRequest,
    cancel: &CancelToken,
) -> Result<Vec<Compared>, Box<NotRendered>> {
    let (before, after) = (version(session, before, request, cancel)?, version(session, after, request, cancel)?);
    let names: BTreeSet<&str> = before.outputs.iter().chain(&after.outputs).map(|shown| shown.name.as_str()).collect();
    // The name of a material means all its channels.
    let means = |output: &str, name: &str| {
        name.strip_prefix(output).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    };
    let wanted = |name: &str| request.outputs.is_empty() || request.outputs.iter().any(|output| means(output, name));
    if let Some(unknown) = request.outputs.iter().find(|output| !names.iter().any(|name| means(output, name))) {
        let failure = Failure::Usage(format!("neither version has the output `{unknown}`"));
        return Err(Box::new(NotRendered { failure, sources: SourceMap::default() }));
    }
    let mut found = Vec::new();
    for name in names.into_iter().filter(|name| wanted(name)) {
        found.push(difference(session, name, &before, &after, cancel)?);
    }
    Ok(found)
}

fn version(
    session: &Session,
    text: &GraphText,
    request: &PicturesRequest,
    cancel: &CancelToken,
) -> Result<Version, Box<NotRendered>> {
    let options = LoadOptions {
        preset: request.preset.clone(),
        resolution: Some(Resolution::Longer(request.size)),
        import_paths: request.import_paths.clone(),
        ..LoadOptions::default()
    };
    let loaded = load_text(&text.path, &text.text, session.registry(), &options);
    let Some(graph) = loaded.graph else {
        let errors = loaded.diagnostics.into_iter().filter(|diagnostic| !diagnostic.warning).collect();
        return Err(Box::new(NotRendered { failure: Failure::Errors(errors), sources: loaded.sources }));
    };
    match shown(session, &graph, &|_| true, cancel, &Silent) {
        Ok(outputs) => Ok(Version { graph, outputs }),
        Err(failure) => Err(Box::new(NotRendered { failure, sources: graph.sources })),
    }
}

/// Compares one output.
fn difference(
    session: &Session,
    name: &str,
    before: &Version,
    after: &Version,
    cancel: &CancelToken,
) -> Result<Compared, Box<NotRendered>> {
    let [one, other] = [before, after].map(|version| version.outputs.iter().find(|shown| shown.name == name));
    let same_size = before.graph.canvas.resolution == after.graph.canvas.resolution;
    let mut diff = PictureDiff {
        name: name.to_owned(),
        change: match (one, other) {
            (Some(_), None) => PictureChange::Removed,
            (None, Some(_)) => PictureChange::Added,
            (Some(one), Some(other)) if one.key == other.key && same_size => PictureChange::Same,
            _ => PictureChange::Changed,
        },
        mean: None,
        max: None,
        rms: None,
        at: None,
        unit: None,
        words: Vec::new(),
    };
    let is_color = [one, other].into_iter().flatten().any(|shown| shown.value.ty() == Type::Rgb);
    if diff.change == PictureChange::Same {
        return Ok(Compared { diff, before: None, after: None, is_color });
    }
    let draw = |version: &Version, shown: Option<&Shown>| -> Result<Option<Tile>, Box<NotRendered>> {
        let Some(field) = shown.and_then(|shown| shown.value.field()) else { return Ok(None) };
        pixels(session, &version.graph, &field, cancel, &Silent)
            .map_err(|failure| Box::new(NotRendered { failure, sources: version.graph.sources.clone() }))
    };
    let (old, new) = (draw(before, one)?, draw(after, other)?);
    diff.unit = match is_color {
        true => Some("of 255".to_owned()),
        false => other.or(one).and_then(|shown| shown.unit).map(str::to_owned),
    };
    match (&old, &new) {
        (Some(old), Some(new)) if same_size && old.channels() == new.channels() => {
            measure(&mut diff, old, new, is_color)
        }
        (Some(_), Some(_)) => diff.words.push("another size or type".to_owned()),
        (None, None) if diff.change == PictureChange::Changed => diff.words.push("other data".to_owned()),
        _ => {}
    }
    Ok(Compared { diff, before: old, after: new, is_color })
}

/// Fills in the numbers and words.
fn measure(diff: &mut PictureDiff, old: &Tile, new: &Tile, is_color: bool) {
    let shown = |value: f32| if is_color { 255.0 * f64::from(linear_to_srgb(value)) } else { f64::from(value) };
    let (mut sum, mut squares, mut max, mut at) = (0.0, 0.0, 0.0, 0);
    for (index, (a, b)) in old.data().iter().zip(new.data()).enumerate() {
        let apart = (shown(*a) - shown(*b)).abs();
        sum += apart;
        squares += apart * apart;
        if apart > max {
            (max, at) = (apart, index);
        }
    }
    if old.data().iter().zip(new.data()).all(|(a, b)| a.to_bits() == b.to_bits()) {
        diff.change = PictureChange::Same;
        return;
    }
    let count = old.data().len().max(1) as f64;
    let pixel = at % (old.width() * old.height()).max(1);
    diff.mean = Some(sum / count);
    diff.max = Some(max);
    diff.rms = Some((squares / count).sqrt());
    diff.at = Some([pixel % old.width(), pixel / old.width()]);
    if let Ok(found) = compare(&picture(new, is_color), &picture(old, is_color), &CompareRequest::default()) {
        diff.words = words(&found, is_color);
    }
}

/// A tile as a picture to compare: a colour, or the first channel as grey between the extremes 0 and 1.
pub fn picture(tile: &Tile, is_color: bool) -> Picture {
    let channels: u8 = if is_color { 3 } else { 1 };
    let planes: Vec<f32> = (0..usize::from(channels)).flat_map(|channel| tile.plane(channel).to_vec()).collect();
    let names = if is_color { &["R", "G", "B"][..] } else { &["Y"] };
    Picture {
        width: u32::try_from(tile.width()).unwrap_or(u32::MAX),
        height: u32::try_from(tile.height()).unwrap_or(u32::MAX),
        channels,
        planes,
        source: SampleKind::F32,
        names: names.iter().map(|name| (*name).to_owned()).collect(),
        has_alpha: false,
    }
}

/// The differences of the version after that one would see.
fn words(found: &Comparison, is_color: bool) -> Vec<String> {
    let mut words = Vec::new();
    let percent = |measured: Option<Measured<f64>>, least: f64| {
        let Measured { value, error } = measured?;
        let log = libm::log(value).abs();
        (log > libm::log(least).max(2.0 * libm::log(error))).then_some(100.0 * (value - 1.0))
    };
    if let Some(coarser) = percent(found.size, 1.03) {
        words.push(format!("{:.0} % {}", coarser.abs(), if coarser > 0.0 { "coarser" } else { "finer" }));
    }
    for (name, measured) in [("contrast", found.contrast), ("fine detail", found.detail)] {
        words.extend(percent(measured, 1.03).map(|more| format!("{name} {more:+.0} %")));
    }
    if let Some(Measured { value: [light, ..], .. }) = found.color
        && is_color
        && light.abs() >= 1.0
    {
        words.push(format!("{} by {:.0} of 100", if light > 0.0 { "lighter" } else { "darker" }, light.abs()));
    }
    if let Some(Measured { value, error }) = found.turn.filter(|turn| is_color && turn.error < 10.0) {
        words.push(match value.abs() > (2.0 * error).max(4.0) {
            true => {
                format!("turned by {:.0}° {}", value.abs(), if value > 0.0 { "counter-clockwise" } else { "clockwise" })
            }
            false => "same direction".to_owned(),
        });
    }
    words
}
