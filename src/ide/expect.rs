//! Describes the values allowed in each place of a graph file.
use super::file::Section;
use super::view::{Body, Item, Shape, Value};
use super::world::{Cx, is_use};
use shibo_engine::export::target_named;
use shibo_engine::node::{FieldInfo, KindInfo, ParamInfo, PortInfo, Role};
use shibo_engine::value::Accepts;

/// Fields of a graph file, with descriptions.
pub(crate) const ROOT: [(&str, &str); 8] = [
    ("version", "The version of the format: 1."),
    ("canvas", "Size in mm, resolution, tiling and seed."),
    ("imports", "Graphs to be used as sub-graphs: `{ \"name\": \"path\" }`."),
    ("params", "What others may change: `\"pitch\": Number(default: 0.8)`."),
    ("presets", "Sets of values for the parameters."),
    ("inputs", "What a sub-graph takes: `\"field\": Gray(default: 0.5)`."),
    ("nodes", "The nodes: `\"name\": Kind(port: \"node\", parameter: value)`."),
    ("outputs", "What is rendered: `\"height\": \"node.port\"`."),
];
/// Fields of the canvas.
pub(crate) const CANVAS: [(&str, &str); 4] = [
    ("size_mm", "Width and height in mm: one number, or a pair. Default 100."),
    ("resolution", "Pixels of the longer side, or a pair. Default 1024."),
    ("tile", "The directions in which it repeats: `Both`, `X`, `Y` or `None`. Default `Both`."),
    ("seed", "Another number gives other random numbers everywhere. Default 0."),
];
/// Fields of `Use` and `Each`.
pub(crate) const USE: [(&str, &str); 8] = [
    ("graph", "A name from `imports`."),
    ("over", "How many instances there are, 1 to 64."),
    ("ids", "The numbers of the pieces."),
    ("with", "Values for parameters and inputs of the sub-graph: `{ \"name\": value }`."),
    ("preset", "A preset of the sub-graph, or several: `\"a+b\"`."),
    ("seed", "Another number gives another instance."),
    ("canvas", "How the outputs of the instance lie: `scale`, `angle`, `offset` and `size_mm`."),
    ("note", "A text for readers."),
];
/// Fields of the layout of an instance.
pub(crate) const LAYOUT: [(&str, &str); 4] = [
    ("scale", "2 is twice as large; one number or a pair."),
    ("angle", "Degrees from +x towards +y."),
    ("offset", "To the right and down, in mm."),
    ("size_mm", "The canvas on which its graph is made, in mm; only where the canvas does not tile."),
];
/// Fields of `File`.
pub(crate) const FILE: [(&str, &str); 9] = [
    ("from", "The node, or `\"node.port\"`."),
    ("format", "The file format."),
    ("depth", "The type of the samples."),
    ("combined", "Whether the channels of a material go into one file; only in `Exr`."),
    ("range", "The values that become the smallest and the largest integer."),
    ("mip", "Whether an `Exr` or a `Tiff` is written in tiles with mip levels, as renderers read textures."),
    (
        "widen_roughness",
        "Whether mip levels of a roughness grow by the normals that they average away; `true` if left out.",
    ),
    ("normal", "Which way `y` of a normal map points: up, `OpenGl`, or down, `DirectX`."),
    ("color_space", "What colours are stored as."),
];
/// Fields of the declaration of a parameter.
pub(crate) const PARAM: [(&str, &str); 5] = [
    ("default", "The value if nothing else is given."),
    ("range", "The smallest and the largest value: `(0, 1)`."),
    ("unit", "The unit, for people."),
    ("options", "The words to choose from."),
    ("doc", "What it does."),
];
/// Types of the parameters of a graph.
pub(crate) const PARAM_TYPES: [&str; 7] = ["Number", "Integer", "Bool", "Color", "Text", "Path", "Choice"];

/// The kind of value expected in a place. Applied to brackets, it describes their contents.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Expect<'a> {
    /// The whole file.
    Root,
    /// A section.
    Section(Section),
    /// An entry of a section.
    Entry(Section, &'a str),
    /// `canvas` or a field of it.
    Canvas(Option<&'a str>),
    /// Declaration of a parameter of this type, or a field of it.
    Param(&'a str, Option<&'a str>),
    /// Declaration of an input of this type, or a field of it.
    Input(&'a str, Option<&'a str>),
    /// A value for a parameter in a preset.
    Preset(&'a str),
    /// Fields of a kind.
    Kind(&'a KindInfo),
    /// Fields of a `Use` or an `Each` (true), with all arguments; or one of these fields.
    Use(&'a Body, bool, Option<&'a str>),
    /// Values for the imported graph, or one of them.
    With(&'a str, Option<&'a str>),
    /// The layout of an instance.
    Layout(Option<&'a str>),
    /// A port; true for a port in a list.
    Port(&'a FieldInfo, &'a PortInfo, bool),
    /// A parameter of a node.
    Value(&'a FieldInfo, &'a ParamInfo),
    /// A struct in a list.
    Struct(&'a ParamInfo),
    /// `File`, `Gltf` or another form of an output, or a field of it.
    File(&'a str, Option<&'a str>),
    /// A note for readers.
    Note,
    /// Any value.
    Any,
}

impl<'a> Expect<'a> {
    /// Expectation for the contents of the brackets of `value`.
    pub(crate) fn inside(self, value: &'a Value, cx: Cx<'a>) -> Self {
        let (word, body) = match &value.shape {
            Shape::Call { word, body } => (cx.file.at(word), body),
            Shape::Body(body) => ("", body),
            _ => return Self::Any,
        };
        match self {
            Self::Entry(Section::Presets, name) if word.is_empty() => Self::Entry(Section::Presets, name),
            Self::Entry(Section::Params, _) => Self::Param(word, None),
            Self::Entry(Section::Inputs, _) => Self::Input(word, None),
            Self::Entry(Section::Outputs, _) => Self::File(word, None),
            Self::Port(..) | Self::Value(..) if word.is_empty() => self,
            _ if is_use(word) && self.takes_nodes() => Self::Use(body, word == "Each", None),
            _ if !word.is_empty() && self.takes_nodes() => cx.kind(word).map_or(Self::Any, Self::Kind),
            Self::Use(..) | Self::Kind(_) | Self::Entry(..) => Self::Any,
            _ => self,
        }
    }

    /// Expectation for an item of brackets.
    pub(crate) fn item(self, item: &'a Item) -> Self {
        let name = item.name();
        match (self, name) {
            (Self::Root, Some("canvas")) => Self::Canvas(None),
            (Self::Root, Some(name)) => {
                let section = Section::ALL.into_iter().find(|section| section.key() == name);
                section.map_or(Self::Any, Self::Section)
            }
            (Self::Section(section), Some(name)) => Self::Entry(section, name),
            (Self::Canvas(None), Some(name)) => Self::Canvas(Some(name)),
            (Self::Param(_, None), Some("doc" | "unit")) | (Self::Input(_, None), Some("doc")) => Self::Note,
            (Self::Param(word, None), Some(name)) => Self::Param(word, Some(name)),
            (Self::Input(word, None), Some(name)) => Self::Input(word, Some(name)),
            (Self::Entry(Section::Presets, _), Some(name)) => Self::Preset(name),
            (Self::Kind(_) | Self::Use(..), Some("note")) => Self::Note,
            (Self::Kind(info), Some(name)) => info.field(name).map_or(Self::Any, Self::field),
            (Self::Use(_, _, None), Some("canvas")) => Self::Layout(None),
            (Self::Use(args, ..), Some("with")) => {
                Self::With(args.value("graph").and_then(Value::text).unwrap_or_default(), None)
            }
            (Self::Use(args, each, None), Some(name)) => Self::Use(args, each, Some(name)),
            (Self::With(import, None), Some(name)) => Self::With(import, Some(name)),
            (Self::Layout(None), Some(name)) => Self::Layout(Some(name)),
            (Self::File(word, None), Some(name)) => Self::File(word, Some(name)),
            (Self::Port(field, port, false), None) if port.list => Self::Port(field, port, true),
            (Self::Value(_, param), None) if !param.fields.is_empty() => Self::Struct(param),
            (Self::Struct(param), Some(name)) => {
                param.fields.iter().find(|field| field.name == name).map_or(Self::Any, Self::field)
            }
            _ => Self::Any,
        }
    }

    /// Expectation for a field.
    pub(crate) fn field(field: &'a FieldInfo) -> Self {
        match &field.role {
            Role::Port(port) => Self::Port(field, port, false),
            Role::Param(param) => Self::Value(field, param),
        }
    }

    /// Returns whether a node is allowed here.
    pub(crate) fn takes_nodes(self) -> bool {
        match self {
            Self::Entry(Section::Nodes, _) | Self::Port(..) | Self::With(_, Some(_)) => true,
            Self::Input(_, Some(name)) => name == "default",
            Self::Use(_, _, Some(name)) => name == "ids",
            _ => false,
        }
    }

    /// Type that a reference must fit here, if references are allowed; `Some(None)` allows any type.
    pub(crate) fn reference(self, cx: Cx<'_>) -> Option<Option<Accepts>> {
        match self {
            Self::Port(_, port, _) => Some(Some(port.ty)),
            Self::Entry(Section::Outputs, _) => Some(None),
            Self::File(_, Some("from")) => Some(None),
            Self::File(word, Some(name)) => {
                let field = target_named(word)?.info().fields.iter().find(|field| field.name == name)?;
                field.takes.reference().map(|ty| Some(Accepts::One(ty)))
            }
            Self::Use(_, true, Some("ids")) => Some(Accepts::from_name("Ids")),
            Self::Input(word, Some("default")) => Some(Accepts::from_name(word)),
            Self::With(import, Some(name)) => {
                let file = cx.imported(import)?;
                let item = file.entry(Section::Inputs, name)?;
                Some(file.head(item).and_then(Accepts::from_name))
            }
            _ => None,
        }
    }
}
