//! Small pictures of all outputs of a graph, as evidence of its look: their bits, and a description that outlives the program.
use crate::pictures::{pixels, shown};
use petgraph::graph::NodeIndex;
use serde::{Deserialize, Serialize};
use shibo_engine::eval::{CancelToken, Silent, encode};
use shibo_engine::session::{Failure, Session};
use shibo_graph::Graph;
use shibo_value::{Key, Resolution, Tile, Type, Value, linear_to_srgb};
use std::collections::BTreeMap;

/// The pixels of the longer side of the pictures.
pub const PIXELS: u32 = 64;

/// The resolution of the pictures.
pub const RESOLUTION: Resolution = Resolution::Longer(PIXELS);

/// Levels of detail in a description.
const OCTAVES: usize = 3;

/// A picture of an output, or its data.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sample {
    /// 16 hexadecimal digits that differ where a bit differs.
    pub bits: String,
    /// The description of each channel; empty for data that is no picture.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub look: Vec<Look>,
}

/// The description of a channel, in 1/255 of the values 0 to 1; of colours as shown on a screen: mean, deviation, and the
/// deviations of the details of 1, 2 and 4 pixels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Look(pub f64, pub f64, pub f64, pub f64, pub f64);

/// The pictures of all outputs of a graph by their names; a channel of a material is called `OUTPUT.CHANNEL`. The graph must
/// have been loaded at [`RESOLUTION`].
///
/// # Errors
/// Errors of the graph, at their places.
pub fn sample(session: &Session, graph: &Graph, cancel: &CancelToken) -> Result<BTreeMap<String, Sample>, Failure> {
    let mut samples = BTreeMap::new();
    for shown in shown(session, graph, &|_| true, cancel, &Silent)? {
        let sample = of_value(session, graph, &shown.value, shown.key, cancel)?;
        samples.insert(shown.name, sample);
    }
    Ok(samples)
}

/// The bits of all outputs of a node, as [`Sample::bits`].
///
/// # Errors
/// Errors of the graph, at their places.
pub fn bits_of(session: &Session, graph: &Graph, node: NodeIndex) -> Result<String, Failure> {
    let (cancel, keys) = (CancelToken::default(), session.keys(graph)?);
    let mut bits = String::new();
    for output in 0..graph.nodes[node].outputs.len() {
        let (key, value) = (keys.output(node, output), session.value(graph, (node, output), &cancel, &Silent)?);
        let parts = match &value {
            Value::Material(material) => {
                material.channels().iter().map(|(_, field)| Value::Field(field.clone())).collect()
            }
            _ => vec![value],
        };
        for part in parts {
            bits += &of_value(session, graph, &part, key, &cancel)?.bits;
        }
    }
    Ok(digest("node", &[bits.as_bytes()]))
}

/// The picture of a value that is no material.
fn of_value(
    session: &Session,
    graph: &Graph,
    value: &Value,
    key: Key,
    cancel: &CancelToken,
) -> Result<Sample, Failure> {
    match (value.field(), encode(value)) {
        (Some(field), _) => {
            let tile = pixels(session, graph, &field, cancel, &Silent)?;
            Ok(tile.map(|tile| of_tile(&tile, field.ty())).unwrap_or_default())
        }
        (None, Some(data)) => Ok(Sample { bits: digest("data", &[&data]), look: Vec::new() }),
        // A solid has no values until it is cut.
        (None, None) => Ok(Sample { bits: digest("key", &[key.as_bytes()]), look: Vec::new() }),
    }
}

fn of_tile(tile: &Tile, ty: Type) -> Sample {
    let data: Vec<u8> = tile.data().iter().flat_map(|value| value.to_bits().to_le_bytes()).collect();
    let [width, height] = [tile.width(), tile.height()].map(|side| (side as u64).to_le_bytes());
    Sample {
        bits: digest(ty.name(), &[&width, &height, &data]),
        look: (0..tile.channels()).map(|channel| look(tile, channel, ty == Type::Rgb)).collect(),
    }
}

/// 16 hexadecimal digits.
fn digest(kind: &str, parts: &[&[u8]]) -> String {
    Key::of(kind, parts).to_string().chars().take(16).collect()
}

/// Describes a channel of a picture.
fn look(tile: &Tile, channel: usize, is_color: bool) -> Look {
    let shown = |value: f32| f64::from(if is_color { linear_to_srgb(value) } else { value });
    let (mut width, mut height) = (tile.width(), tile.height());
    let mut level: Vec<f64> =
        (0..height).flat_map(|y| tile.row(channel, y).iter().map(|value| shown(*value))).collect();
    let mean = level.iter().sum::<f64>() / level.len().max(1) as f64;
    let deviation = root_mean(level.iter().map(|value| value - mean));
    let mut details = [0.0; OCTAVES];
    for detail in &mut details {
        let (wide, high) = (width.div_ceil(2), height.div_ceil(2));
        let average = |x: usize, y: usize| {
            let inside = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| (2 * x + dx, 2 * y + dy));
            let values = inside.iter().filter(|(x, y)| *x < width && *y < height).map(|(x, y)| level[y * width + x]);
            values.clone().sum::<f64>() / values.count().max(1) as f64
        };
        let coarse: Vec<f64> =
            (0..high).flat_map(|y| (0..wide).map(move |x| (x, y))).map(|(x, y)| average(x, y)).collect();
        let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        *detail = root_mean(places.map(|(x, y)| level[y * width + x] - coarse[y / 2 * wide + x / 2]));
        (level, width, height) = (coarse, wide, high);
    }
    let shown = |value: f64| (value * 255.0 * 100.0).round() / 100.0;
    Look(shown(mean), shown(deviation), shown(details[0]), shown(details[1]), shown(details[2]))
}

fn root_mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value * value, count + 1.0));
    f64::sqrt(sum / f64::max(count, 1.0))
}
