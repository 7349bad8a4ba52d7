//! Describes the values allowed in each place of a graph file.
use super::file::Section;
use super::view::{Body, Item, Shape, Value};
use super::world::{Cx, is_use};
use shibo_graph::schema;
use shibo_node::{FieldInfo, KindInfo, ParamInfo, PortInfo, Role};
use shibo_picture::export::{FieldDecl, Takes};
use shibo_value::Accepts;

/// The kind of value expected in a place. Applied to brackets, it describes their contents.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Expect<'a> {
    /// The whole file.
    Root,
    /// A local graph.
    Local,
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
            Self::Entry(Section::Graphs, _) if word.is_empty() => Self::Local,
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
            // Its words may equal the name of a node.
            (Self::Root, Some("family")) => Self::Note,
            (Self::Root, Some(name)) => {
                let section = Section::ALL.into_iter().find(|section| section.key() == name);
                section.map_or(Self::Any, Self::Section)
            }
            (Self::Local, Some(name)) if schema::LOCAL.iter().any(|field| field.name == name) => {
                let section = Section::ALL.into_iter().find(|section| section.key() == name);
                section.map_or(Self::Any, Self::Section)
            }
            (Self::Section(section), Some(name)) => Self::Entry(section, name),
            (Self::Canvas(None), Some(name)) => Self::Canvas(Some(name)),
            (Self::Param(_, None), Some("doc" | "unit" | "group")) | (Self::Input(_, None), Some("doc")) => Self::Note,
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

    /// Fields allowed in brackets, except brackets of a kind; and the name of the field that is expected, if the place is
    /// its value.
    fn declared(self) -> (Vec<FieldDecl>, Option<&'a str>) {
        match self {
            Self::Root => (schema::ROOT.to_vec(), None),
            Self::Local => (schema::LOCAL.to_vec(), None),
            Self::Canvas(name) => (schema::CANVAS.to_vec(), name),
            Self::Layout(name) => (schema::LAYOUT.to_vec(), name),
            Self::Use(_, each, name) => (schema::instance(each), name),
            Self::File(word, name) => (schema::output(word).to_vec(), name),
            Self::Input(_, name) => (schema::INPUT.to_vec(), name),
            Self::Param(word, name) => (schema::param(word), name),
            _ => (Vec::new(), None),
        }
    }

    /// Fields allowed in brackets, except brackets of a kind.
    pub(crate) fn fields(self) -> Vec<FieldDecl> {
        let (fields, name) = self.declared();
        if name.is_none() { fields } else { Vec::new() }
    }

    /// Values allowed for a field, except a field of a kind.
    pub(crate) fn takes(self) -> Option<Takes> {
        let (fields, name) = self.declared();
        fields.into_iter().find(|field| Some(field.name) == name).map(|field| field.takes)
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
            Self::Input(word, Some("default")) => Some(Accepts::from_name(word)),
            Self::With(import, Some(name)) => {
                let file = cx.imported(import)?;
                let item = file.entry(Section::Inputs, name)?;
                Some(file.head(item).and_then(Accepts::from_name))
            }
            _ => Some(self.takes()?.reference()?.map(Accepts::One)),
        }
    }
}
