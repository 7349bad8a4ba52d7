//! The types of parameters.
use serde_json::{Map, Value as Json};
use std::fmt;

/// Type of the value of a parameter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ParamType {
    /// A number.
    Number,
    /// A whole number.
    Integer,
    /// `true` or `false`.
    Bool,
    /// A text in quotes.
    Text,
    /// The path of a file, in quotes: [`FilePath`](super::FilePath).
    Path,
    /// A colour: [`Color`](super::Color).
    Color,
    /// The smallest and the largest number: [`Range`](super::Range).
    Range,
    /// Values that 0 and 1 are mapped to: [`Linear`](super::Linear).
    Linear,
    /// A number for each direction: [`Xy`](super::Xy).
    Xy,
    /// One of several words, some of which may take arguments.
    Choice,
    /// A list.
    List,
    /// Anything else, such as a tuple or a struct.
    #[default]
    Value,
}

impl ParamType {
    /// All types.
    pub const ALL: [Self; 12] = [
        Self::Number,
        Self::Integer,
        Self::Bool,
        Self::Text,
        Self::Path,
        Self::Color,
        Self::Range,
        Self::Linear,
        Self::Xy,
        Self::Choice,
        Self::List,
        Self::Value,
    ];

    /// The name as users read it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Number => "Number",
            Self::Integer => "Integer",
            Self::Bool => "Bool",
            Self::Text => "Text",
            Self::Path => "Path",
            Self::Color => "Color",
            Self::Range => "Range",
            Self::Linear => "Linear",
            Self::Xy => "Xy",
            Self::Choice => "Choice",
            Self::List => "List",
            Self::Value => "Value",
        }
    }

    /// Type with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|ty| ty.name() == name)
    }

    /// The expected value, for messages.
    pub const fn expected(self) -> &'static str {
        match self {
            Self::Number => "a number",
            Self::Integer => "a whole number",
            Self::Bool => "`true` or `false`",
            Self::Text => "a text in quotes",
            Self::Path => "a path in quotes",
            Self::Color => "a colour, \"#rrggbb\" or (r, g, b)",
            Self::Range | Self::Linear | Self::Xy => "a number or a pair of numbers",
            Self::Choice => "one of its options",
            Self::List => "a list, `[ ]`",
            Self::Value => "of another type",
        }
    }

    /// Type that a schema names explicitly, as types with a notation of their own do (colours, ranges).
    pub(super) fn named_by(schema: &Map<String, Json>) -> Option<Self> {
        Self::from_name(schema.get("param")?.as_str()?)
    }

    /// Type that a schema describes, except choices.
    pub(super) fn of(schema: &Map<String, Json>) -> Self {
        let word = match schema.get("type") {
            Some(Json::String(word)) => word.as_str(),
            Some(Json::Array(words)) => {
                words.iter().filter_map(Json::as_str).find(|w| *w != "null").unwrap_or_default()
            }
            _ => "",
        };
        Self::named_by(schema).unwrap_or(match word {
            "number" => Self::Number,
            "integer" => Self::Integer,
            "boolean" => Self::Bool,
            "string" => Self::Text,
            "array" => Self::List,
            _ => Self::Value,
        })
    }
}

impl fmt::Display for ParamType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
