//! The values of parameters of nodes, from the schemas of their structs.
use super::{any, definition, described, object};
use serde_json::{Map, Value as Json, json};
use shibo_node::{Bounds, ParamInfo};

/// The schema of a parameter in the JSON form.
pub(super) fn param(info: &ParamInfo, doc: &str) -> Json {
    let mut forms = values(&info.schema, &info.bounds, info.infinite);
    if !matches!(&*info.schema, Json::Object(schema) if is_text(schema)) {
        forms.push(definition("formula"));
    }
    let mut schema = described(any(forms), doc);
    if let Some(object) = schema.as_object_mut() {
        if !info.default.is_null() {
            object.insert("default".to_owned(), info.default.clone());
        }
        if let Some(unit) = info.bounds.unit.as_ref().filter(|unit| !unit.is_empty()) {
            object.insert("unit".to_owned(), unit.as_str().into());
        }
    }
    schema
}

/// A number within bounds, and infinity where it is allowed.
pub(super) fn number(ty: &str, bounds: &Bounds) -> Json {
    let mut schema = json!({ "type": ty });
    if let Some(object) = schema.as_object_mut() {
        let least = if bounds.above_min { "exclusiveMinimum" } else { "minimum" };
        object.extend(bounds.min.map(|min| (least.to_owned(), plain(min))));
        object.extend(bounds.max.map(|max| ("maximum".to_owned(), plain(max))));
    }
    schema
}

/// A number without a decimal point where it is whole and small.
fn plain(value: f64) -> Json {
    #[expect(clippy::cast_possible_truncation, reason = "checked to be whole and small")]
    let whole = value as i64;
    if value.abs() < 1e15 && whole as f64 == value { whole.into() } else { value.into() }
}

fn is_text(schema: &Map<String, Json>) -> bool {
    schema.get("type").and_then(Json::as_str) == Some("string") && !schema.contains_key("enum")
}

/// The alternative forms of a value.
fn values(schema: &Json, bounds: &Bounds, infinite: bool) -> Vec<Json> {
    let Some(object) = schema.as_object() else { return vec![json!({})] };
    let lists = ["anyOf", "oneOf"].into_iter().filter_map(|key| object.get(key)?.as_array());
    let forms: Vec<Json> = lists.flatten().flat_map(|form| values(form, bounds, infinite)).collect();
    let words = |forms: Vec<Json>| if forms.is_empty() { plain_values(object, bounds, infinite) } else { forms };
    words(forms)
}

/// The forms of a value that has no alternatives of its own, apart from `None`.
fn plain_values(schema: &Map<String, Json>, bounds: &Bounds, infinite: bool) -> Vec<Json> {
    let doc = schema.get("description").and_then(Json::as_str).unwrap_or_default();
    if let Some(word) = schema.get("const") {
        let word = if word == "None" { json!({ "enum": ["None", null] }) } else { json!({ "const": word }) };
        return vec![described(word, doc)];
    }
    if let Some(words) = schema.get("enum").and_then(Json::as_array) {
        let none = words.iter().any(|word| word == "None" || word.is_null());
        let words: Vec<&Json> = words.iter().filter(|word| !word.is_null()).collect();
        return vec![json!({ "enum": words })].into_iter().chain(none.then(|| json!({ "type": "null" }))).collect();
    }
    let part = |schema: &Json| {
        let mut forms = values(schema, bounds, infinite);
        forms.push(definition("formula"));
        any(forms)
    };
    let inf = || infinite.then(|| json!({ "enum": ["inf", "-inf"] }));
    let one = |ty: &str| std::iter::once(number(ty, bounds)).chain(inf());
    let array = |items: Json, least: u64, most: u64| json!({ "type": "array", "items": items, "minItems": least, "maxItems": most });
    let mut forms = match schema.get("param").and_then(Json::as_str) {
        Some("Color") => {
            let channel = any(vec![json!({ "type": "number" }), definition("formula")]);
            vec![definition("color"), array(channel, 3, 3)]
        }
        Some("Range" | "Linear" | "Xy") => {
            let each: Vec<Json> = one("number").chain([definition("formula")]).collect();
            one("number").chain([array(any(each), 2, 2)]).collect()
        }
        Some("Path") => vec![json!({ "type": "string" })],
        _ => Vec::new(),
    };
    let types = match schema.get("type") {
        Some(Json::Array(types)) => types.iter().filter_map(Json::as_str).collect(),
        Some(Json::String(ty)) => vec![ty.as_str()],
        _ => Vec::new(),
    };
    for ty in types {
        match ty {
            "number" | "integer" => forms.extend(one(ty)),
            "array" => forms.push(array_of(schema, &part)),
            "object" => forms.push(described(object_of(schema, &part), doc)),
            _ => forms.push(json!({ "type": ty })),
        }
    }
    if forms.is_empty() { vec![json!({})] } else { forms }
}

/// A list, or a tuple.
fn array_of(schema: &Map<String, Json>, part: &dyn Fn(&Json) -> Json) -> Json {
    let (least, most) = (schema.get("minItems"), schema.get("maxItems"));
    let fixed = most.is_some() && least == most;
    let items = schema.get("items").map(part);
    let mut array = Map::new();
    array.insert("type".to_owned(), "array".into());
    match schema.get("prefixItems").and_then(Json::as_array) {
        Some(parts) => {
            array.insert("prefixItems".to_owned(), parts.iter().map(part).collect());
        }
        None if fixed => array.extend(items.map(|items| ("items".to_owned(), items))),
        None => {
            let items = items.map_or_else(|| json!({}), |items| any(vec![items, definition("comments")]));
            array.insert("items".to_owned(), items);
        }
    }
    if fixed {
        array.extend(least.map(|least| ("minItems".to_owned(), least.clone())));
        array.extend(most.map(|most| ("maxItems".to_owned(), most.clone())));
    }
    Json::Object(array)
}

/// Named fields, or a word with arguments.
fn object_of(schema: &Map<String, Json>, part: &dyn Fn(&Json) -> Json) -> Json {
    let fields = schema.get("properties").and_then(Json::as_object);
    let is_word = |name: &String| name.starts_with(|c: char| c.is_ascii_uppercase());
    let fields = fields.into_iter().flatten().map(|(name, inner)| {
        let value = part(inner);
        // A word with one list or one tuple has it in an array of arguments.
        let arguments = is_word(name) && inner.get("type").and_then(Json::as_str) == Some("array");
        let listed = || json!({ "type": "array", "prefixItems": [value], "minItems": 1, "maxItems": 1 });
        let value = if arguments { any(vec![listed(), value.clone()]) } else { value };
        (name.clone(), value)
    });
    let fields: Map<String, Json> = fields.collect();
    let required = schema.get("required").and_then(Json::as_array);
    let required: Vec<&str> = required.into_iter().flatten().filter_map(Json::as_str).collect();
    object(fields, &required)
}
