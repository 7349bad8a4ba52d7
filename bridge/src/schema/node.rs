//! Nodes: their ports and parameters.
use super::value::{number, param};
use super::{COMMENTS, any, definition, described, object};
use serde_json::{Map, Value as Json, json};
use shibo_node::{FieldInfo, KindInfo, ParamInfo, PortInfo, Role};
use shibo_value::{Accepts, Type};

/// A node of one of these kinds: `{"Kind": {…}}`, or `{"Kind": null}` for a kind without fields.
pub(super) fn node_of<'a>(kinds: impl Iterator<Item = &'a str>) -> Json {
    let kinds: Map<String, Json> = kinds.map(|kind| (kind.to_owned(), definition(kind))).collect();
    json!({
        "description": "A node: its kind with its fields, `{ \"Perlin\": { \"size\": 3 } }`.",
        "type": "object",
        "properties": kinds,
        "patternProperties": { (COMMENTS): definition("comment") },
        "additionalProperties": false,
        "minProperties": 1,
    })
}

/// The fields of a kind.
pub(super) fn kind(info: &KindInfo) -> Json {
    let mut fields = fields(&info.fields);
    fields.insert("note".to_owned(), described(json!({ "type": "string" }), "A text for readers."));
    let required = required(&info.fields);
    let mut schema = object(fields, &required);
    if let (Some(object), true) = (schema.as_object_mut(), required.is_empty()) {
        object.insert("type".to_owned(), json!(["object", "null"]));
    }
    described(schema, &info.doc)
}

/// The schemas of ports and parameters.
fn fields(fields: &[FieldInfo]) -> Map<String, Json> {
    let field = |field: &FieldInfo| {
        let schema = match &field.role {
            Role::Port(info) => port(info, &field.doc),
            Role::Param(info) if has_ports(info) => structs(info, &field.doc),
            Role::Param(info) => param(info, &field.doc),
        };
        (field.name.clone(), schema)
    };
    fields.iter().map(field).collect()
}

/// The fields that must be given.
fn required(fields: &[FieldInfo]) -> Vec<&str> {
    let needed = |field: &&FieldInfo| match &field.role {
        Role::Port(port) => port.required,
        Role::Param(param) => param.required,
    };
    fields.iter().filter(needed).map(|field| field.name.as_str()).collect()
}

fn has_ports(info: &ParamInfo) -> bool {
    info.fields.iter().any(|field| matches!(field.role, Role::Port(_)))
}

/// A list of structs with ports.
fn structs(info: &ParamInfo, doc: &str) -> Json {
    let item = object(fields(&info.fields), &required(&info.fields));
    described(json!({ "type": "array", "items": any(vec![item, definition("comments")]) }), doc)
}

/// The values at a port.
fn port(info: &PortInfo, doc: &str) -> Json {
    let mut forms = vec![definition("wire")];
    let takes = |count| info.ty.is_anywhere() || takes(info.ty, count);
    forms.extend(takes(1).then(|| number("number", &info.bounds)));
    for count in (2..=4).filter(|count| takes(*count)) {
        let channel = any(vec![number("number", &info.bounds), definition("formula")]);
        forms.push(json!({ "type": "array", "items": channel, "minItems": count, "maxItems": count }));
    }
    forms.extend(takes(3).then(|| definition("color")));
    let value = any(forms);
    let list = || {
        let items = any(vec![value.clone(), definition("comments")]);
        json!({ "type": "array", "items": items, "minItems": usize::from(info.required) })
    };
    let mut schema = described(if info.list { list() } else { value.clone() }, doc);
    if let Some(object) = schema.as_object_mut() {
        object.insert("wire".to_owned(), info.ty.name().into());
        object.extend(info.default.map(|default| ("default".to_owned(), default.into())));
        let unit = info.bounds.unit.as_ref().filter(|unit| !unit.is_empty());
        object.extend(unit.map(|unit| ("unit".to_owned(), unit.as_str().into())));
    }
    schema
}

/// Returns true if a port takes this many numbers in place of a wire.
fn takes(ty: Accepts, count: usize) -> bool {
    let fits = |of: Type| of.fits(ty) || ty.solid_of(of).is_some();
    match count {
        1 => fits(Type::Gray) || matches!(ty, Accepts::One(Type::Rgb) | Accepts::Color),
        2 => fits(Type::Vec2),
        3 => fits(Type::Rgb) || matches!(ty, Accepts::Color),
        _ => fits(Type::Jacobian),
    }
}
