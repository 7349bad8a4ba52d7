//! Selects the channels of an EXR file that make the picture.

use super::super::limits::{ReadError, list};
use exr::meta::MetaData;
use exr::meta::header::Header as Layer;

/// The selected channels of one layer, in the order of the picture's planes.
pub(super) struct Selection {
    /// Index of the layer (a part, in EXR).
    pub(super) layer: usize,
    /// Indices into the layer's list of channels; 1 to 4.
    pub(super) channels: Vec<usize>,
    /// Their full names.
    pub(super) names: Vec<String>,
    /// True if the last channel is opacity.
    pub(super) has_alpha: bool,
    /// True if the channels are red, green and blue.
    pub(super) is_color: bool,
    /// The assumed order, if the names of the channels do not define one.
    pub(super) assumed: Option<String>,
}

impl Selection {
    pub(super) fn count(&self) -> u8 {
        u8::try_from(self.channels.len()).expect("at most 4 channels are selected")
    }
}

/// Names of a channel: the usual one, and alternatives in lower case. Case matters only if a file has both.
struct Known {
    usual: &'static str,
    others: &'static [&'static str],
}

const R: Known = Known { usual: "R", others: &["r", "red"] };
const G: Known = Known { usual: "G", others: &["g", "green"] };
const B: Known = Known { usual: "B", others: &["b", "blue"] };
const A: Known = Known { usual: "A", others: &["a", "alpha"] };
const X: Known = Known { usual: "X", others: &["x"] };
const Y: Known = Known { usual: "Y", others: &["y"] };
const Z: Known = Known { usual: "Z", others: &["z"] };
const U: Known = Known { usual: "U", others: &["u"] };
const V: Known = Known { usual: "V", others: &["v"] };

/// Channels that form a picture, in order.
struct Group {
    members: &'static [Known],
    /// True if an opacity channel is added.
    takes_alpha: bool,
}

/// Channel groups, best first.
const GROUPS: [Group; 6] = [
    Group { members: &[R, G, B], takes_alpha: true },
    Group { members: &[X, Y, Z], takes_alpha: false },
    Group { members: &[R, G], takes_alpha: true },
    Group { members: &[X, Y], takes_alpha: false },
    Group { members: &[U, V], takes_alpha: false },
    Group { members: &[Y], takes_alpha: true },
];

/// Full names of all channels, layer by layer.
pub(super) fn all_names(meta: &MetaData) -> Vec<String> {
    (0..meta.headers.len()).flat_map(|layer| names(meta, layer)).collect()
}

/// Selects the named layer or channel, or the best group.
pub(super) fn select(meta: &MetaData, wanted: Option<&str>) -> Result<Selection, ReadError> {
    let layers = || 0..meta.headers.len();
    if let Some(wanted) = wanted {
        let found =
            layers().find_map(|layer| channel(meta, layer, wanted).or_else(|| group(meta, layer, Some(wanted))));
        let unknown = || ReadError::NoSuchLayer { wanted: wanted.to_owned(), existing: list(&all_names(meta)) };
        return found.ok_or_else(unknown);
    }
    let colours = || layers().find_map(|layer| group(meta, layer, Some("")));
    let found = colours().or_else(|| layers().find_map(|layer| group(meta, layer, None)));
    found
        .or_else(|| layers().find_map(|layer| first_channels(meta, layer)))
        .ok_or_else(|| ReadError::corrupt("it has no channels"))
}

/// Full names of a layer's channels. In files with one layer the channel names already include the layer's name.
fn names(meta: &MetaData, layer: usize) -> Vec<String> {
    let header: &Layer = &meta.headers[layer];
    let prefix = match &header.own_attributes.layer_name {
        Some(name) if meta.headers.len() > 1 => format!("{name}."),
        _ => String::new(),
    };
    header.channels.list.iter().map(|channel| format!("{prefix}{}", channel.name)).collect()
}

/// Splits `base_color.R` into `base_color` and `R`.
fn split(name: &str) -> (&str, &str) {
    name.rsplit_once('.').unwrap_or(("", name))
}

fn channel(meta: &MetaData, layer: usize, wanted: &str) -> Option<Selection> {
    let names = names(meta, layer);
    let index = names.iter().position(|name| name == wanted)?;
    let (channels, names) = (vec![index], vec![wanted.to_owned()]);
    Some(Selection { layer, channels, names, has_alpha: false, is_color: false, assumed: None })
}

/// The best group of channels that share a prefix: the given prefix or, in the order of the file, any.
fn group(meta: &MetaData, layer: usize, prefix: Option<&str>) -> Option<Selection> {
    let names = names(meta, layer);
    let mut prefixes: Vec<&str> = match prefix {
        Some(prefix) => vec![prefix],
        None => names.iter().map(|name| split(name).0).collect(),
    };
    prefixes.dedup();
    for Group { members, takes_alpha } in GROUPS {
        for prefix in &prefixes {
            let found: Option<Vec<usize>> = members.iter().map(|member| find(&names, prefix, member)).collect();
            let Some(mut channels) = found else { continue };
            let alpha = takes_alpha.then(|| find(&names, prefix, &A)).flatten();
            let is_color = members.len() == 3 && takes_alpha;
            channels.extend(alpha);
            let names = channels.iter().map(|index| names[*index].clone()).collect();
            return Some(Selection { layer, channels, names, has_alpha: alpha.is_some(), is_color, assumed: None });
        }
    }
    // A layer that was requested by name is read even if its channel names are unknown.
    let prefix = prefix.filter(|prefix| !prefix.is_empty())?;
    let members = (0..names.len()).filter(|index| split(&names[*index]).0 == prefix);
    first_of(layer, &names, members.collect())
}

/// The channel with this prefix and one of the known names; the usual name is preferred.
fn find(names: &[String], prefix: &str, known: &Known) -> Option<usize> {
    let own = |index: &usize| split(&names[*index]).0 == prefix;
    let suffix = |index: &usize| split(&names[*index]).1;
    let all = || (0..names.len()).filter(own);
    let other = |index: &usize| known.others.iter().any(|other| other.eq_ignore_ascii_case(suffix(index)));
    all().find(|index| suffix(index) == known.usual).or_else(|| all().find(other))
}

fn first_channels(meta: &MetaData, layer: usize) -> Option<Selection> {
    let names = names(meta, layer);
    first_of(layer, &names, (0..names.len()).collect())
}

fn first_of(layer: usize, names: &[String], mut channels: Vec<usize>) -> Option<Selection> {
    channels.truncate(4);
    let chosen: Vec<String> = channels.iter().map(|index| names[*index].clone()).collect();
    let assumed = (channels.len() > 1)
        .then(|| format!("the names of its channels do not tell their order; they are taken as {}", list(&chosen)));
    let selection = Selection { layer, channels, names: chosen, has_alpha: false, is_color: false, assumed };
    (!selection.channels.is_empty()).then_some(selection)
}
