//! The notation of parameter values in graph files.
//!
//! The schema gives a default as JSON, which cannot distinguish a list from a tuple, a word from a text, `None` from
//! `inf`, or a colour from three numbers. The schema of the parameter can.
use super::ParamType;
use crate::value::linear_to_srgb;
use serde_json::{Map, Value as Json};

/// The shortest text of a number that reads back exactly.
pub fn spell_number(n: f64) -> String {
    let plain = n.to_string();
    if plain.len() <= 12 { plain } else { format!("{n:e}") }
}

/// Formats a value of the type that `schema` describes as RON.
pub(super) fn spell(schema: &Json, json: &Json) -> String {
    let empty = Map::new();
    let object = schema.as_object().unwrap_or(&empty);
    if json.is_null() {
        // JSON has no infinity. Types with a notation of their own are never infinite.
        return if is_optional(object) || ParamType::named_by(object).is_some() { "None" } else { "inf" }.to_owned();
    }
    let forms = forms(object);
    let word = forms.iter().find_map(|form| variant(*form, json));
    word.unwrap_or_else(|| plain(forms.first().map_or(object, |form| form.schema), json))
}

/// True if a parameter may be `None`.
pub(super) fn is_optional(object: &Map<String, Json>) -> bool {
    let null = |ty: &Json| ty.as_str() == Some("null");
    let of = |object: &Map<String, Json>| match object.get("type") {
        Some(Json::Array(types)) => types.iter().any(null),
        Some(ty) => null(ty),
        None => false,
    };
    of(object) || list(object, "anyOf").any(of)
}

fn list<'a>(object: &'a Map<String, Json>, key: &str) -> impl Iterator<Item = &'a Map<String, Json>> {
    object.get(key).and_then(Json::as_array).into_iter().flatten().filter_map(Json::as_object)
}

/// One of the alternative forms of a value.
#[derive(Clone, Copy)]
pub(super) struct Form<'a> {
    /// Its schema.
    pub(super) schema: &'a Map<String, Json>,
    /// True if it is a variant of an enum.
    pub(super) is_variant: bool,
}

impl<'a> Form<'a> {
    /// For a variant with a value: its name and the schema of the value.
    pub(super) fn variant_with_value(self) -> Option<(&'a str, &'a Json)> {
        let properties = self.schema.get("properties").filter(|_| self.is_variant)?.as_object()?;
        properties.iter().next().map(|(name, inner)| (name.as_str(), inner))
    }
}

/// The alternative forms that a schema allows, except `None`.
pub(super) fn forms(object: &Map<String, Json>) -> Vec<Form<'_>> {
    let is_null = |object: &Map<String, Json>| object.get("type").and_then(Json::as_str) == Some("null");
    let mut found: Vec<_> = list(object, "anyOf").filter(|object| !is_null(object)).flat_map(forms).collect();
    found.extend(list(object, "oneOf").map(|schema| Form { schema, is_variant: true }));
    if found.is_empty() { vec![Form { schema: object, is_variant: false }] } else { found }
}

/// Formats a value of an enum, if `form` is its variant.
fn variant(form: Form<'_>, json: &Json) -> Option<String> {
    if let Json::String(word) = json {
        // An enum whose variants have no docs is a list of words.
        let is_const = form.schema.get("const") == Some(json);
        let is_listed = form.schema.get("enum").and_then(Json::as_array).is_some_and(|words| words.contains(json));
        return (is_const || is_listed).then(|| word.clone());
    }
    let (name, inner) = form.variant_with_value()?;
    let value = json.as_object().filter(|object| object.len() == 1)?.get(name)?;
    let spelled = spell(inner, value);
    Some(if spelled.starts_with('(') { format!("{name}{spelled}") } else { format!("{name}({spelled})") })
}

/// Formats a value that is not a variant of an enum.
fn plain(kind: &Map<String, Json>, json: &Json) -> String {
    let ty = ParamType::named_by(kind);
    match json {
        Json::Array(channels) if ty == Some(ParamType::Color) => color(channels),
        // One number stands for a pair of equal numbers.
        Json::Array(pair) if matches!(ty, Some(ParamType::Range | ParamType::Linear | ParamType::Xy)) => {
            match &pair[..] {
                [a, b] if a == b => scalar(a),
                _ => numbers(pair),
            }
        }
        Json::Array(items) => sequence(kind, items),
        Json::Object(fields) => {
            let schemas = kind.get("properties").and_then(Json::as_object);
            let schema = |name: &str| schemas.and_then(|schemas| schemas.get(name)).unwrap_or(&Json::Null);
            let fields: Vec<String> =
                fields.iter().map(|(name, value)| format!("{name}: {}", spell(schema(name), value))).collect();
            format!("({})", fields.join(", "))
        }
        other => scalar(other),
    }
}

/// A tuple or a list.
fn sequence(kind: &Map<String, Json>, items: &[Json]) -> String {
    let each = kind.get("items").unwrap_or(&Json::Null);
    let first = kind.get("prefixItems").and_then(Json::as_array).map_or(&[][..], Vec::as_slice);
    let texts: Vec<String> =
        items.iter().enumerate().map(|(i, item)| spell(first.get(i).unwrap_or(each), item)).collect();
    let texts = texts.join(", ");
    let fixed = kind.get("maxItems").is_some_and(|most| Some(most) == kind.get("minItems"));
    if fixed { format!("({texts})") } else { format!("[{texts}]") }
}

fn numbers(items: &[Json]) -> String {
    format!("({})", items.iter().map(scalar).collect::<Vec<_>>().join(", "))
}

fn scalar(json: &Json) -> String {
    match json {
        Json::Null => "inf".to_owned(),
        Json::Number(n) if n.is_f64() => n.as_f64().map_or_else(|| n.to_string(), spell_number),
        Json::String(text) => format!("{text:?}"),
        other => other.to_string(),
    }
}

/// `"#rrggbb"` if that is exactly the same colour, otherwise three numbers.
fn color(channels: &[Json]) -> String {
    #[expect(clippy::cast_possible_truncation, reason = "colours are f32")]
    let linear: Vec<f32> = channels.iter().map(|channel| channel.as_f64().unwrap_or(f64::INFINITY) as f32).collect();
    let mut code = String::from("#");
    for value in &linear {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "held between 0 and 255")]
        let byte = (linear_to_srgb(*value) * 255.0).round().clamp(0.0, 255.0) as u8;
        code.push_str(&format!("{byte:02x}"));
    }
    if super::parse_color(&code).is_some_and(|rgb| rgb[..] == linear[..]) {
        return format!("{code:?}");
    }
    format!("({})", linear.iter().map(f32::to_string).collect::<Vec<_>>().join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::value::srgb_to_linear;
    use crate::{Color, FilePath, Linear, Range, Xy};
    use schemars::JsonSchema;
    use schemars::generate::SchemaSettings;
    use serde::Serialize;

    #[derive(Clone, Debug, Serialize, JsonSchema)]
    enum Word {
        Plain,
        /// A variant with docs.
        Documented,
        Number(f64),
        Pair(f64, f64),
        Named {
            at: f64,
        },
    }

    #[derive(Debug, Serialize, JsonSchema)]
    struct Part {
        height: f64,
        length: Option<f64>,
        word: Word,
    }

    fn spelled<T: Serialize + JsonSchema>(value: &T) -> String {
        let settings = SchemaSettings::draft2020_12().with(|s| s.inline_subschemas = true);
        let schema = settings.into_generator().into_root_schema_for::<T>();
        spell(schema.as_value(), &serde_json::to_value(value).unwrap())
    }

    #[test]
    fn values_are_spelled_in_ron() {
        assert_eq!(spelled(&4.0), "4");
        assert_eq!(spelled(&0.1), "0.1");
        assert_eq!(spelled(&(-1.0 / 3.0)), "-3.333333333333333e-1");
        assert_eq!(spelled(&u64::MAX), u64::MAX.to_string());
        assert_eq!(spelled(&true), "true");
        assert_eq!(spelled(&"a\"b".to_owned()), r#""a\"b""#);
        assert_eq!(spelled(&FilePath("a.png".into())), "\"\"");
        assert_eq!(spelled(&Range::new(0.2, 4.0)), "(0.2, 4)");
        assert_eq!(spelled(&Linear::new(2.0, 2.0)), "2");
        assert_eq!(spelled(&Some(Xy::new(2.0, 2.5))), "(2, 2.5)");
    }

    #[test]
    fn tuples_are_not_lists() {
        assert_eq!(spelled(&(0.0, 0.0, 0.0)), "(0, 0, 0)");
        assert_eq!(spelled(&[1, 2]), "(1, 2)");
        assert_eq!(spelled(&vec![1, 2]), "[1, 2]");
        assert_eq!(spelled(&vec![(0.0, 1.0)]), "[(0, 1)]");
        assert_eq!(spelled(&Some((8, 9))), "(8, 9)");
        assert_eq!(spelled(&Vec::<f64>::new()), "[]");
    }

    #[test]
    fn distinguishes_none_from_infinity() {
        assert_eq!(spelled(&None::<f64>), "None");
        assert_eq!(spelled(&f64::INFINITY), "inf");
        assert_eq!(spelled(&Some(f64::INFINITY)), "None", "JSON has no infinity: such a default is not possible");
        assert_eq!(spelled(&Range::new(1.0, f64::INFINITY)), "(1, inf)");
        assert_eq!(spelled(&Word::Number(f64::INFINITY)), "Number(inf)");
        assert_eq!(spelled(&None::<Word>), "None");
    }

    #[test]
    fn choices_are_words() {
        assert_eq!(spelled(&Word::Plain), "Plain");
        assert_eq!(spelled(&Some(Word::Documented)), "Documented");
        assert_eq!(spelled(&Some(Word::Number(2.0))), "Number(2)");
        assert_eq!(spelled(&Word::Pair(1.0, 2.0)), "Pair(1, 2)");
        assert_eq!(spelled(&Word::Named { at: 2.0 }), "Named(at: 2)");
        let part = Part { height: 1.0, length: None, word: Word::Plain };
        assert_eq!(spelled(&vec![part]), "[(height: 1, length: None, word: Plain)]");
    }

    #[test]
    fn spells_colours_as_codes_if_that_is_exact() {
        let code = |rgb: [u8; 3]| Color(rgb.map(|byte| srgb_to_linear(f32::from(byte) / 255.0)));
        assert_eq!(spelled(&code([0x8b, 0x5a, 0x2b])), "\"#8b5a2b\"");
        assert_eq!(spelled(&vec![(0.5, code([255, 0, 1]))]), "[(0.5, \"#ff0001\")]");
        assert_eq!(spelled(&Color([0.16, 0.085, 0.0])), "(0.16, 0.085, 0)", "the shortest numbers that read back");
        assert_eq!(spelled(&Color([2.0, 0.0, 0.0])), "(2, 0, 0)");
    }

    #[test]
    fn every_colour_code_reads_back() {
        for byte in 0..=255_u8 {
            let text = format!("#{byte:02x}{byte:02x}{byte:02x}");
            let rgb = crate::parse_color(&text).unwrap();
            assert_eq!(spelled(&Color(rgb)), format!("{text:?}"));
        }
    }
}
