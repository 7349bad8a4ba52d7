//! The manual of nodes as JSON for programs, and the search for nodes.
mod search;

pub use search::{Found, search};
#[cfg(feature = "agents")]
pub(crate) use search::{count_words, query_words};

use serde_json::{Value as Json, json};
use shibo_node::{Bounds, FieldInfo, KindInfo, Output, OutputType, ParamInfo, PortInfo, Role};

/// The kinds as JSON.
pub fn nodes<'a>(kinds: impl IntoIterator<Item = &'a KindInfo>) -> Json {
    json!({ "nodes": kinds.into_iter().map(node).collect::<Vec<_>>() })
}

/// A kind as JSON.
pub fn node(info: &KindInfo) -> Json {
    json!({
        "kind": info.kind,
        "family": info.family,
        "doc": info.doc,
        "version": info.version,
        "ports": info.ports().map(|(field, info)| port(field, info)).collect::<Vec<_>>(),
        "parameters": info.params().map(|(field, info)| param(field, info)).collect::<Vec<_>>(),
        "outputs": info.outputs.iter().map(output).collect::<Vec<_>>(),
    })
}

fn port(field: &FieldInfo, port: &PortInfo) -> Json {
    json!({
        "name": field.name,
        "type": port.ty.name(),
        "required": port.required,
        "list": port.list,
        "default": port.default,
        "range": range(&port.bounds),
        "unit": port.bounds.unit,
        "doc": field.doc,
    })
}

/// Minimum and maximum, if there are any.
fn range(bounds: &Bounds) -> Option<Json> {
    (bounds.min.is_some() || bounds.max.is_some()).then(|| json!([bounds.min, bounds.max]))
}

fn param(field: &FieldInfo, param: &ParamInfo) -> Json {
    let names: Vec<_> = param.choices.iter().map(ToString::to_string).collect();
    let docs: Vec<_> = param.choices.iter().map(|choice| &choice.doc).collect();
    json!({
        "name": field.name,
        "type": param.ty.name(),
        "default": param.default,
        "written": param.written,
        "required": param.required,
        "range": range(&param.bounds),
        "above_min": param.bounds.above_min,
        "infinite": param.infinite,
        "unit": param.bounds.unit,
        "choices": names,
        "choice_docs": docs,
        "ports": param.fields.iter().filter_map(inner_port).collect::<Vec<_>>(),
        "fields": param.params().map(|(field, info)| self::param(field, info)).collect::<Vec<_>>(),
        "doc": field.doc,
    })
}

/// A port in a list of structs.
fn inner_port(field: &FieldInfo) -> Option<Json> {
    match &field.role {
        Role::Port(info) => Some(port(field, info)),
        Role::Param(_) => None,
    }
}

fn output(output: &Output) -> Json {
    json!({
        "name": output.name,
        "former": output.former,
        "type": output_type(output),
        "unit": output.unit,
        "doc": output.doc,
    })
}

/// Type of an output; an output that follows its inputs may have any field type that they accept.
fn output_type(output: &Output) -> &'static str {
    match output.ty {
        OutputType::Fixed(ty) => ty.name(),
        OutputType::Like(_) => "Field",
        OutputType::ColorOf(_) => "Rgb",
        OutputType::NumberOf(_) => "Gray",
        OutputType::MaterialOf(_) => "AnyMaterial",
        OutputType::Told => "EveryField",
        OutputType::ValueOf(_) => "FieldOrSolid",
    }
}
