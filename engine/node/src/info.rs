//! Facts about a kind of nodes, read from the schema of its struct.
use super::spelling::{Form, forms, spell};
use super::{Node, Output, ParamForm, ParamType};
use crate::value::Accepts;
use schemars::generate::SchemaSettings;
use serde_json::{Map, Value as Json};
use std::fmt;

/// All facts about a kind.
#[derive(Clone, Debug)]
pub struct KindInfo {
    /// The name in graph files.
    pub kind: String,
    /// The family it belongs to.
    pub family: &'static str,
    /// The manual: the struct's doc comment.
    pub doc: String,
    /// Ports and parameters, in the order of their declaration.
    pub fields: Vec<FieldInfo>,
    /// The version of its results, see [`Node::VERSION`].
    pub version: u32,
    /// Its outputs; the first is the main output.
    pub outputs: &'static [Output],
}

/// A port or a parameter.
#[derive(Clone, Debug)]
pub struct FieldInfo {
    /// The name in graph files.
    pub name: String,
    /// The manual: the doc comment of the field.
    pub doc: String,
    /// Whether it is a port or a parameter.
    pub role: Role,
}

/// The role of a field of a node struct.
#[derive(Clone, Debug)]
pub enum Role {
    /// A port, which takes a wire.
    Port(PortInfo),
    /// A parameter, which takes a value.
    Param(ParamInfo),
}

/// A port.
#[derive(Clone, Debug, PartialEq)]
pub struct PortInfo {
    /// Types that it accepts.
    pub ty: Accepts,
    /// True if it must be connected.
    pub required: bool,
    /// True if it takes a list of wires.
    pub list: bool,
    /// Its default value when nothing is connected, if it has one.
    pub default: Option<f64>,
    /// Range of numbers that may be written in place of a wire.
    pub bounds: Bounds,
}

/// Range of numbers that may be written for a field.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bounds {
    /// The smallest number allowed.
    pub min: Option<f64>,
    /// The largest number allowed.
    pub max: Option<f64>,
    /// True if `min` itself is not allowed.
    pub above_min: bool,
    /// The unit, for display.
    pub unit: Option<String>,
}

impl Bounds {
    /// Bounds that a schema states. Values missing in `outer` are taken from `inner`.
    fn of(outer: &Map<String, Json>, inner: &Map<String, Json>) -> Self {
        let number = |key: &str| outer.get(key).or_else(|| inner.get(key)).and_then(Json::as_f64);
        let above = number("exclusiveMinimum");
        Self {
            min: above.or_else(|| number("minimum")),
            max: number("maximum"),
            above_min: above.is_some(),
            unit: outer.get("unit").and_then(Json::as_str).map(str::to_owned),
        }
    }

    /// True if a number is allowed.
    pub fn admit(&self, value: f64) -> bool {
        let below = self.min.is_some_and(|min| value < min || (self.above_min && value <= min));
        !below && self.max.is_none_or(|max| value <= max)
    }
}

impl fmt::Display for Bounds {
    /// Formats the requirement for messages: `between 0 and 1 mm`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.min, self.max) {
            (Some(min), None) if self.above_min => write!(f, "greater than {min}")?,
            (Some(min), Some(max)) if self.above_min => write!(f, "greater than {min} and at most {max}")?,
            (Some(min), Some(max)) => write!(f, "between {min} and {max}")?,
            (Some(min), None) => write!(f, "at least {min}")?,
            (None, max) => write!(f, "at most {}", max.unwrap_or(f64::INFINITY))?,
        }
        self.unit.as_ref().filter(|unit| !unit.is_empty()).map_or(Ok(()), |unit| write!(f, " {unit}"))
    }
}

/// A parameter.
#[derive(Clone, Debug, Default)]
pub struct ParamInfo {
    /// Type of the value that is written for it.
    pub ty: ParamType,
    /// The default, as JSON. Infinity, which JSON does not have, is `"inf"`.
    pub default: Json,
    /// The default in the notation of graph files.
    pub written: String,
    /// True if it must be given, because the node cannot work with the default.
    pub required: bool,
    /// Range of allowed numbers.
    pub bounds: Bounds,
    /// True if `inf` is allowed.
    pub infinite: bool,
    /// The words to choose from, for a choice.
    pub choices: Vec<Choice>,
    /// For a list of structs: the fields of each struct.
    pub fields: Vec<FieldInfo>,
    /// Its form, with the forms of its parts.
    pub form: ParamForm,
    /// The JSON Schema of its value as serde writes it, all parts inline. The key `param` names a [`ParamType`] with a notation
    /// of its own.
    pub schema: Box<Json>,
}

/// One of the words of a choice.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Choice {
    /// The word.
    pub name: String,
    /// True if arguments in brackets follow it.
    pub has_arguments: bool,
    /// The manual.
    pub doc: String,
}

impl fmt::Display for Choice {
    /// Formats the word for the manual: with `(…)` if it takes arguments.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}{}", self.name, if self.has_arguments { "(…)" } else { "" })
    }
}

impl KindInfo {
    /// Reads the schema of `T`.
    pub fn of<T: Node>(family: &'static str) -> Self {
        let settings = SchemaSettings::draft2020_12().with(|s| s.inline_subschemas = true);
        let schema = settings.into_generator().into_root_schema_for::<T>();
        let empty = Map::new();
        let root = schema.as_value().as_object().unwrap_or(&empty);
        Self {
            kind: T::schema_name().into_owned(),
            family,
            doc: text(root, "description"),
            fields: fields(root),
            version: T::VERSION,
            outputs: T::OUTPUTS,
        }
    }

    /// The port or parameter of that name.
    pub fn field(&self, name: &str) -> Option<&FieldInfo> {
        self.fields.iter().find(|f| f.name == name)
    }

    /// The port that owns a slot. Slots of ports in a list of structs are called `layers.2.mask`.
    pub fn port(&self, slot: &str) -> Option<&PortInfo> {
        let (first, last) = (slot.split('.').next()?, slot.rsplit('.').next()?);
        match &self.field(first)?.role {
            Role::Port(port) => Some(port),
            Role::Param(param) => {
                param.fields.iter().find(|field| field.name == last).and_then(|field| match &field.role {
                    Role::Port(port) => Some(port),
                    Role::Param(_) => None,
                })
            }
        }
    }

    /// The ports.
    pub fn ports(&self) -> impl Iterator<Item = (&FieldInfo, &PortInfo)> {
        self.fields.iter().filter_map(|f| match &f.role {
            Role::Port(port) => Some((f, port)),
            Role::Param(_) => None,
        })
    }

    /// The parameters.
    pub fn params(&self) -> impl Iterator<Item = (&FieldInfo, &ParamInfo)> {
        params(&self.fields)
    }
}

impl ParamInfo {
    /// For a list of structs: the fields of each struct.
    pub fn params(&self) -> impl Iterator<Item = (&FieldInfo, &Self)> {
        params(&self.fields)
    }
}

fn params(fields: &[FieldInfo]) -> impl Iterator<Item = (&FieldInfo, &ParamInfo)> {
    fields.iter().filter_map(|f| match &f.role {
        Role::Param(param) => Some((f, param)),
        Role::Port(_) => None,
    })
}

fn text(object: &Map<String, Json>, key: &str) -> String {
    object.get(key).and_then(Json::as_str).unwrap_or_default().to_owned()
}

fn field(name: &str, schema: &Json) -> FieldInfo {
    let (empty, any) = (Map::new(), Json::Object(Map::new()));
    let schema = if schema.is_object() { schema } else { &any };
    let object = schema.as_object().unwrap_or(&empty);
    let role = match port(object) {
        Some(port) => Role::Port(port),
        None => Role::Param(param(schema)),
    };
    FieldInfo { name: name.to_owned(), doc: text(object, "description"), role }
}

fn port(object: &Map<String, Json>) -> Option<PortInfo> {
    let of = |object: &Map<String, Json>| Accepts::from_name(object.get("port")?.as_str()?);
    let (default, bounds) = (object.get("default").and_then(Json::as_f64), Bounds::of(object, object));
    if let Some(ty) = of(object) {
        let optional = object.get("type").is_some_and(Json::is_array);
        let required = default.is_none() && !optional;
        return Some(PortInfo { ty, required, list: false, default, bounds });
    }
    if let Some(ty) = object.get("items").and_then(Json::as_object).and_then(of) {
        let optional = object.get("optional").and_then(Json::as_bool).unwrap_or(false);
        return Some(PortInfo { ty, required: !optional, list: true, default: None, bounds });
    }
    None
}

fn param(schema: &Json) -> ParamInfo {
    let empty = Map::new();
    let object = schema.as_object().unwrap_or(&empty);
    let forms = forms(object);
    let inner = forms.first().map_or(object, |form| form.schema);
    let choices = choices(&forms);
    let ty = if choices.is_empty() { ParamType::of(inner) } else { ParamType::Choice };
    let default = object.get("default").unwrap_or(&Json::Null);
    let written = spell(schema, default);
    ParamInfo {
        default: if written == "inf" { "inf".into() } else { default.clone() },
        // A path is a text; the empty text means no file.
        required: ty == ParamType::Path && !default.is_null(),
        written,
        ty,
        bounds: Bounds::of(object, inner),
        infinite: object.get("infinite").and_then(Json::as_bool).unwrap_or(false),
        choices,
        fields: inner.get("items").and_then(Json::as_object).map_or_else(Vec::new, fields),
        form: ParamForm::of(schema),
        schema: Box::new(schema.clone()),
    }
}

/// The fields of a struct.
fn fields(object: &Map<String, Json>) -> Vec<FieldInfo> {
    let properties = object.get("properties").and_then(Json::as_object);
    properties.into_iter().flatten().map(|(name, schema)| field(name, schema)).collect()
}

/// The variants of an enum: plain ones, and variants with arguments in brackets.
fn choices(forms: &[Form<'_>]) -> Vec<Choice> {
    let mut found = Vec::new();
    for form in forms {
        let doc = text(form.schema, "description");
        if let Some(word) = form.schema.get("const").and_then(Json::as_str) {
            found.push(Choice { name: word.to_owned(), has_arguments: false, doc });
        } else if let Some(words) = form.schema.get("enum").and_then(Json::as_array) {
            // Variants without docs are listed together.
            let undocumented = |word: &str| Choice { name: word.to_owned(), has_arguments: false, doc: String::new() };
            found.extend(words.iter().filter_map(Json::as_str).map(undocumented));
        } else if let Some((name, _)) = form.variant_with_value() {
            found.push(Choice { name: name.to_owned(), has_arguments: true, doc });
        }
    }
    found
}
