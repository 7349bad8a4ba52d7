//! The form of a parameter with the forms of its parts, for messages about a part.
use super::ParamType;
use super::spelling::forms;
use serde_json::{Map, Value as Json};
use std::fmt;

/// The form of a value in a graph file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum ParamForm {
    /// A value without parts, or one whose parts are numbers: colours, ranges.
    Plain(ParamType),
    /// A list of values of this form.
    List(Box<Self>),
    /// Values of these forms in brackets.
    Tuple(Vec<Self>),
    /// Named fields in brackets.
    Struct(Vec<(String, Self)>),
    /// Anything else: choices and their arguments.
    #[default]
    Any,
}

impl ParamForm {
    /// The form that a schema describes.
    pub(super) fn of(schema: &Json) -> Self {
        let Some(object) = schema.as_object() else { return Self::Any };
        let forms = forms(object);
        let [form] = &forms[..] else { return Self::Any };
        if form.is_variant || form.schema.contains_key("enum") || form.schema.contains_key("port") {
            return Self::Any;
        }
        Self::of_form(form.schema)
    }

    fn of_form(object: &Map<String, Json>) -> Self {
        let fixed = object.get("maxItems").is_some_and(|most| Some(most) == object.get("minItems"));
        let each = object.get("items").map(Self::of);
        let count = object.get("maxItems").and_then(Json::as_u64).and_then(|count| usize::try_from(count).ok());
        match (ParamType::of(object), object.get("prefixItems").and_then(Json::as_array), each, count) {
            (ParamType::List, Some(parts), ..) => Self::Tuple(parts.iter().map(Self::of).collect()),
            (ParamType::List, None, Some(each), Some(count)) if fixed && count < 64 => Self::Tuple(vec![each; count]),
            (ParamType::List, None, Some(each), _) => Self::List(Box::new(each)),
            (ParamType::Value, ..) => match object.get("properties").and_then(Json::as_object) {
                Some(fields) => Self::Struct(fields.iter().map(|(name, of)| (name.clone(), Self::of(of))).collect()),
                None => Self::Any,
            },
            (ty, ..) => Self::Plain(ty),
        }
    }

    /// The form of the part with this index or this name.
    pub fn part(&self, index: usize, name: Option<&str>) -> &Self {
        match (self, name) {
            (Self::List(each), None) => each,
            (Self::Tuple(parts), None) => parts.get(index).unwrap_or(&Self::Any),
            (Self::Plain(ParamType::Color | ParamType::Range | ParamType::Linear | ParamType::Xy), None) => &NUMBER,
            (Self::Struct(fields), Some(name)) => {
                fields.iter().find(|(field, _)| field == name).map_or(&Self::Any, |(_, of)| of)
            }
            _ => &Self::Any,
        }
    }

    /// A short name for use in a list of forms.
    fn brief(&self) -> String {
        match self {
            Self::Plain(ParamType::Color) => "colour".to_owned(),
            Self::Plain(ParamType::Range | ParamType::Linear | ParamType::Xy) => "number or pair".to_owned(),
            Self::Plain(ParamType::Integer) => "whole number".to_owned(),
            Self::Plain(ty) => ty.name().to_lowercase(),
            Self::List(each) => format!("[{}, …]", each.brief()),
            Self::Tuple(parts) => format!("({})", parts.iter().map(Self::brief).collect::<Vec<_>>().join(", ")),
            Self::Struct(fields) => format!(
                "({})",
                fields.iter().map(|(name, of)| format!("{name}: {}", of.brief())).collect::<Vec<_>>().join(", ")
            ),
            Self::Any => "value".to_owned(),
        }
    }
}

/// A number.
const NUMBER: ParamForm = ParamForm::Plain(ParamType::Number);

impl fmt::Display for ParamForm {
    /// Formats the requirement for messages.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Plain(ty) => f.write_str(ty.expected()),
            Self::Any => f.write_str(ParamType::Value.expected()),
            Self::List(_) => f.write_str(ParamType::List.expected()),
            Self::Tuple(_) | Self::Struct(_) => write!(f, "`{}`", self.brief()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Color;
    use schemars::JsonSchema;
    use schemars::generate::SchemaSettings;

    fn told<T: JsonSchema>() -> String {
        let settings = SchemaSettings::draft2020_12().with(|s| s.inline_subschemas = true);
        let schema = settings.into_generator().into_root_schema_for::<T>();
        ParamForm::of(schema.as_value()).to_string()
    }

    #[test]
    fn names_the_forms_of_parts() {
        assert_eq!(told::<f64>(), "a number");
        assert_eq!(told::<Vec<f64>>(), "a list, `[ ]`");
        assert_eq!(told::<(f64, Color)>(), "`(number, colour)`");
        assert_eq!(told::<Option<(u32, String)>>(), "`(whole number, text)`");
        assert_eq!(told::<[f64; 2]>(), "`(number, number)`");
    }
}
