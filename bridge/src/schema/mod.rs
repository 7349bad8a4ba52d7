//! The JSON Schema (2020-12) of graphs in the JSON form, made from the registry and from the places of a graph file.
//!
//! The schema cannot know the names of a graph. So it refuses unknown kinds, fields and words, missing inputs and numbers out of
//! range, but not references to nodes or parameters that do not exist.
mod node;
mod places;
mod value;

use crate::Tools;
use node::{kind, node_of};
use places::{export, graph, instances, local, outputs};
use serde_json::{Map, Value as Json, json};
use shibo_node::registry::Registry;

/// The schema of graphs.
pub fn schema(tools: &Tools) -> Json {
    let registry = &tools.registry;
    let mut definitions = shared(registry);
    definitions.insert("local".to_owned(), local());
    definitions.insert("output".to_owned(), outputs());
    definitions.extend(export());
    definitions.extend(instances());
    for info in registry.kinds().filter_map(|name| registry.info(name)) {
        definitions.insert(info.kind.clone(), kind(info));
    }
    let mut schema = graph(registry);
    if let Some(object) = schema.as_object_mut() {
        let mut head = Map::new();
        head.insert("$schema".to_owned(), "https://json-schema.org/draft/2020-12/schema".into());
        head.insert("title".to_owned(), "Shibo graph".into());
        head.append(object);
        head.insert("$defs".to_owned(), Json::Object(definitions));
        *object = head;
    }
    schema
}

/// The schema of the fields of one kind, or of `Use` or `Each`; `None` for other words.
pub fn kind_schema(tools: &Tools, name: &str) -> Option<Json> {
    let own = match tools.registry.info(name) {
        Some(info) => kind(info),
        None => instances().find(|(word, _)| word == name)?.1,
    };
    let mut schema = json!({ "$schema": "https://json-schema.org/draft/2020-12/schema", "title": name });
    let (head, own) = (schema.as_object_mut()?, own.as_object()?.clone());
    head.extend(own);
    // A node inside of this one is described by its kind alone.
    let mut definitions = shared(&tools.registry);
    definitions.insert("node".to_owned(), json!({ "type": "object", "minProperties": 1 }));
    head.insert("$defs".to_owned(), Json::Object(definitions));
    Some(schema)
}

/// Definitions that several others use.
fn shared(registry: &Registry) -> Map<String, Json> {
    let kinds = registry.kinds().chain(["Use", "Each"]);
    let definitions = json!({
        "comment": {
            "description": "A comment: a line, or an array of lines.",
            "anyOf": [{ "type": "string" }, { "type": "array", "items": { "type": "string" } }],
        },
        "comments": {
            "description": "Comments between the items of an array.",
            "type": "object",
            "properties": { "//": { "$ref": "#/$defs/comment" }, "item //": { "$ref": "#/$defs/comment" } },
            "minProperties": 1,
            "additionalProperties": false,
        },
        "formula": {
            "description": "A formula, `\"= 2 * $size\"`, or the value of a parameter of the graph, `\"$size\"`.",
            "type": "string",
            "pattern": "^[=$]",
        },
        "reference": {
            "description": "The name of a node, `\"node\"`, or of one of its outputs, `\"node.output\"`; or a formula.",
            "type": "string",
            "pattern": "^([=$]|[A-Za-z_][A-Za-z0-9_]*(\\.[A-Za-z0-9_]+)*$)",
        },
        "color": {
            "description": "A colour in sRGB, `\"#rrggbb\"`.",
            "type": "string",
            "pattern": "^#[0-9a-fA-F]+$",
        },
        "node": node_of(kinds),
        "wire": {
            "description": "A node: its name, a formula, or a node that is written here.",
            "anyOf": [{ "$ref": "#/$defs/reference" }, { "$ref": "#/$defs/node" }],
        },
    });
    definitions.as_object().cloned().unwrap_or_default()
}

/// An object with these fields and comments, and no others.
fn object(properties: Map<String, Json>, required: &[&str]) -> Json {
    let mut schema = json!({
        "type": "object",
        "properties": properties,
        "patternProperties": { (COMMENTS): { "$ref": "#/$defs/comment" } },
        "additionalProperties": false,
    });
    if let (Some(object), false) = (schema.as_object_mut(), required.is_empty()) {
        object.insert("required".to_owned(), json!(required));
    }
    schema
}

/// An object with any names, and comments.
fn named(value: Json) -> Json {
    json!({
        "type": "object",
        "patternProperties": { (COMMENTS): { "$ref": "#/$defs/comment" }, (NAMES): value },
        "additionalProperties": false,
    })
}

/// The fields with comments.
const COMMENTS: &str = "^//| //$";
/// The names of nodes, parameters, inputs and imports.
const NAMES: &str = "^[A-Za-z_][A-Za-z0-9_]*$";

/// A schema with a description.
fn described(mut schema: Json, text: &str) -> Json {
    if let Some(object) = schema.as_object_mut().filter(|_| !text.is_empty()) {
        object.shift_insert(0, "description".to_owned(), text.trim().into());
    }
    schema
}

/// One of several schemas.
fn any(mut forms: Vec<Json>) -> Json {
    match forms.len() {
        1 => forms.pop().unwrap_or_default(),
        _ => json!({ "anyOf": forms }),
    }
}

/// A definition of the document.
fn definition(name: &str) -> Json {
    json!({ "$ref": format!("#/$defs/{name}") })
}
