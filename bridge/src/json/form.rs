//! The form of a value: whether a string is a word, and whether an array is a list.
use serde_json::{Map, Value as Json};
use shibo_graph::syntax::{is_infinity, is_name};
use shibo_ide::forms;
use std::borrow::Cow;

/// The form of a value.
#[derive(Clone, Debug)]
pub(super) enum Form<'a> {
    /// Brackets are named fields or a tuple.
    Plain,
    /// Brackets are a list.
    List,
    /// A string that could be a word is one.
    Word,
    /// A string that is one of these words is a word.
    Words(Vec<&'static str>),
    /// A value that this schema describes.
    Schema(Cow<'a, Json>),
}

/// The longest tuple. A longer array is a list where the place does not tell.
const LONGEST_TUPLE: usize = 4;

impl Form<'static> {
    /// The form of a place; `None` if it is [`Form::Plain`].
    pub(super) fn of(form: forms::Form<'_>) -> Option<Self> {
        match form {
            forms::Form::Plain => None,
            forms::Form::Word => Some(Self::Word),
            forms::Form::List => Some(Self::List),
            forms::Form::WordOrText(words) => Some(Self::Words(words.to_vec())),
            forms::Form::Param(param) => Some(Self::Schema(Cow::Owned((*param.schema).clone()))),
        }
    }
}

impl Form<'_> {
    /// The alternatives of the schema.
    fn alternatives(&self) -> Vec<&Map<String, Json>> {
        let mut found = Vec::new();
        if let Self::Schema(schema) = self {
            collect(schema, &mut found);
        }
        found
    }

    /// Returns true if a string is a word here. A misspelt word is one too, where texts are not possible.
    pub(super) fn is_word(&self, text: &str) -> bool {
        match self {
            Self::Word => is_name(text),
            Self::Words(words) => words.contains(&text),
            _ => {
                let forms = self.alternatives();
                let has_words = forms.iter().any(|form| form.contains_key("const") || form.contains_key("enum"));
                let has_texts = forms.iter().any(|form| {
                    form.contains_key("param")
                        || is_type(form, "string") && !form.contains_key("enum") && !form.contains_key("const")
                });
                has_words && !has_texts && is_name(text)
            }
        }
    }

    /// Returns true if a string is an infinite number here.
    pub(super) fn is_infinite(&self, text: &str) -> bool {
        let takes_numbers = |schema: &Map<String, Json>| {
            let pair = schema
                .get("param")
                .and_then(Json::as_str)
                .is_some_and(|name| ["Range", "Linear", "Xy"].contains(&name));
            pair || is_type(schema, "number")
        };
        is_infinity(text) && self.alternatives().into_iter().any(takes_numbers)
    }

    /// Returns true if an array of this length is a list here, and false if it is a tuple.
    pub(super) fn is_list(&self, length: usize) -> bool {
        match self {
            Self::List => true,
            Self::Schema(_) => {
                let arrays = self.alternatives();
                let mut arrays = arrays.iter().filter(|schema| is_type(schema, "array"));
                arrays.next().is_some_and(|schema| !is_tuple(schema))
            }
            _ => length == 0 || length > LONGEST_TUPLE,
        }
    }

    /// The form of an item of an array.
    pub(super) fn item(&self, index: usize) -> Form<'_> {
        let part = self.alternatives().into_iter().find_map(|schema| {
            let numbers = schema.get("param").is_some();
            let first = schema.get("prefixItems").and_then(Json::as_array).and_then(|parts| parts.get(index));
            first
                .or_else(|| schema.get("items"))
                .map(Cow::Borrowed)
                .or_else(|| numbers.then(|| Cow::Owned(serde_json::json!({ "type": "number" }))))
        });
        part.map_or(Form::Plain, Form::Schema)
    }

    /// The form of a field in brackets.
    pub(super) fn field(&self, name: &str) -> Form<'_> {
        let found = self.alternatives().into_iter().find_map(|schema| schema.get("properties")?.get(name));
        found.map_or(Form::Plain, |schema| Form::Schema(Cow::Borrowed(schema)))
    }
}

/// The alternatives of a schema, without those for `None`.
fn collect<'a>(schema: &'a Json, found: &mut Vec<&'a Map<String, Json>>) {
    let Some(object) = schema.as_object() else { return };
    let lists = ["anyOf", "oneOf"].into_iter().filter_map(|key| object.get(key)?.as_array());
    let before = found.len();
    lists.flatten().for_each(|schema| collect(schema, found));
    if found.len() == before {
        found.push(object);
    }
}

/// Returns true if a schema names a type.
fn is_type(schema: &Map<String, Json>, name: &str) -> bool {
    match schema.get("type") {
        Some(Json::Array(types)) => types.iter().any(|ty| ty.as_str() == Some(name)),
        Some(ty) => ty.as_str() == Some(name),
        None => false,
    }
}

/// Returns true if the arrays of a schema have a fixed length.
fn is_tuple(schema: &Map<String, Json>) -> bool {
    schema.get("maxItems").is_some_and(|most| Some(most) == schema.get("minItems"))
}
