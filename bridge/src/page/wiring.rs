//! Source text of a node, its constants, and its formulas.
//!
//! All of them are read in the brackets of the node itself. The spans of [`GraphNode::fields`] do not suffice: a value
//! that a sub-graph computes from a parameter has the span of the value given to the parameter, in the `with` of the use
//! or in a preset.
use super::numbers;
use crate::scene::{Scene, is_own};
use serde_json::{Value as Json, json};
use shibo_graph::syntax::{NodeKind, Tree};
use shibo_graph::{GraphNode, Input};
use shibo_node::registry::Registry;
use shibo_node::{Bounds, ParamInfo, ParamType, Role};
use shibo_value::diagnostics::{SourceMap, Span};
use std::ops::Range;

/// Longer source texts of nodes are cut, in bytes.
const TEXT: usize = 2000;
/// Longer values of fields cannot be edited as constants, in bytes.
const FIELD: usize = 80;

/// The declaration of a node: its whole range, and the range of each written field, in the text of its file.
struct Declaration {
    whole: Range<usize>,
    fields: Vec<(String, Range<usize>)>,
}

impl Declaration {
    fn of(node: &GraphNode, sources: &SourceMap) -> Self {
        let Span { file, start, end } = node.span;
        let tree = Tree::parse(sources.text(file));
        let found = tree.covering(start..end);
        let call = std::iter::once(found).chain(found.ancestors()).find(|node| node.kind() == NodeKind::Call);
        // Formulas and nodes that the graph adds have no brackets: their span is the whole text.
        let Some(call) = call.filter(|call| call.range().start == start) else {
            return Self { whole: start..end, fields: Vec::new() };
        };
        let entries = call.body().into_iter().flat_map(|body| body.entries());
        let fields = entries.filter_map(|entry| Some((entry.key()?.text().to_owned(), entry.value()?.range())));
        Self { whole: call.range(), fields: fields.collect() }
    }
}

/// Source text of a node, from its kind to its closing bracket.
pub fn text(node: &GraphNode, sources: &SourceMap) -> String {
    let whole = sources.text(node.span.file);
    let shown = whole.get(Declaration::of(node, sources).whole).unwrap_or(&node.kind);
    if shown.len() > TEXT { node.kind.clone() } else { shown.to_owned() }
}

/// The span of a field's value in the brackets of its node; without a name, that of the whole node.
pub fn place(node: &GraphNode, sources: &SourceMap, field: &str) -> Option<Span> {
    let found = Declaration::of(node, sources);
    let range = match field {
        "" => Some(found.whole),
        _ => found.fields.into_iter().find(|(name, _)| name == field).map(|(_, range)| range),
    };
    range.map(|range| Span { file: node.span.file, start: range.start, end: range.end })
}

/// Written fields of a node: the text, and the description of the parameter. A formula with numbers is cut at these;
/// that of a node that is a formula itself has no name. Fields in other files than the graph file are `fixed`: the page
/// does not change them. A computed number has its value as `now`.
pub fn constants(scene: &Scene, node: &GraphNode, registry: &Registry) -> Json {
    let sources = &scene.graph.sources;
    let info = registry.info(&node.kind);
    let whole = sources.text(node.span.file);
    let found = Declaration::of(node, sources);
    let fixed = !is_own(scene, node.span);
    let field = |(name, range): &(String, Range<usize>)| {
        let text = whole.get(range.clone())?;
        let found = info.and_then(|info| info.fields.iter().find(|field| field.name == *name))?;
        let mut about = json!({ "name": name, "text": text, "doc": found.doc, "fixed": fixed });
        let bounds = match &found.role {
            Role::Param(param) => &param.bounds,
            Role::Port(port) => &port.bounds,
        };
        let Bounds { min, max, unit, .. } = bounds;
        about["min"] = json!(min);
        about["max"] = json!(max);
        about["unit"] = json!(unit);
        if let Role::Param(ParamInfo { choices, ty, .. }) = &found.role {
            about["whole"] = (*ty == ParamType::Integer).into();
            about["choices"] =
                choices.iter().filter(|choice| !choice.has_arguments).map(|choice| choice.name.as_str()).collect();
        }
        if is_computed(text) {
            about["now"] = json!(number(node, name, &found.role));
        }
        let formula = numbers::pieces(text).filter(|_| text.len() <= TEXT && !fixed);
        let shown = formula.is_some() || text.len() <= FIELD;
        about["formula"] = json!(formula);
        shown.then_some(about)
    };
    let own = whole.get(node.span.start..node.span.end).filter(|text| text.len() <= TEXT && !fixed);
    let own =
        own.and_then(|text| Some(json!({ "name": "", "text": text, "doc": "", "formula": numbers::pieces(text)? })));
    own.into_iter().chain(found.fields.iter().filter_map(field)).collect()
}

/// Returns whether a literal is computed from parameters or other nodes.
fn is_computed(text: &str) -> bool {
    let inside = text.trim_start_matches('r').trim_start_matches('#');
    inside.strip_prefix('"').is_some_and(|inside| inside.starts_with(['$', '=']))
}

/// The number that a node has for a field; `None` for values of other types, and for fields that differ from point to
/// point.
fn number(node: &GraphNode, name: &str, role: &Role) -> Option<f64> {
    match role {
        Role::Param(param) if param.ty == ParamType::Number => {
            match entry(&node.node.canonical(), name) {
                Some(bytes) => decoded(bytes),
                // A value equal to the default is not among the bytes.
                None => param.default.as_f64(),
            }
        }
        Role::Param(_) => None,
        Role::Port(_) => {
            let slot = node.slots.iter().position(|slot| slot == name)?;
            let Input::Constant(field) = &node.inputs[slot] else { return None };
            field.as_constant().filter(|values| values.len() == 1).map(|values| tidy(values[0]))
        }
    }
}

/// The bytes of a field in the parameters of a node: each field is its name and its value, with their lengths.
fn entry<'b>(mut bytes: &'b [u8], name: &str) -> Option<&'b [u8]> {
    let mut part = || {
        let (length, rest) = bytes.split_first_chunk::<8>()?;
        let length = usize::try_from(u64::from_le_bytes(*length)).ok().filter(|length| *length <= rest.len())?;
        let (part, rest) = rest.split_at(length);
        bytes = rest;
        Some(part)
    };
    loop {
        let (found, value) = (part()?, part()?);
        if found == name.as_bytes() {
            return Some(value);
        }
    }
}

/// A number of 4 or 8 bytes, also as an option.
fn decoded(bytes: &[u8]) -> Option<f64> {
    let bytes = if bytes.len() % 4 == 1 { bytes.strip_prefix(&[1_u8])? } else { bytes };
    let wide = bytes.try_into().map(f64::from_le_bytes);
    wide.ok().or_else(|| bytes.try_into().ok().map(|bytes| tidy(f32::from_le_bytes(bytes))))
}

/// The shortest decimal number that reads as `value`.
fn tidy(value: f32) -> f64 {
    value.to_string().parse().unwrap_or_else(|_| value.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use shibo_graph::{LoadOptions, load_text};
    use std::path::Path;

    const TEXT: &str = r##"(
  canvas: (size_mm: 8, resolution: 64),
  params: { "deep": Number(default: 0.5, range: (0, 1), doc: "Depth") },
  graphs: {
    "bent": (
      params: { "warp": Number(default: 0.1, range: (0, 1), doc: "Warp") },
      nodes: {
        "noise": Perlin(size: 2),
        "it": Warp(input: "= noise * 2", amount: "= $warp * 0.5", size: 3, /* ) */ seed: 4),
      },
      outputs: { "it": "it" },
    ),
  },
  nodes: {
    "use": Use(graph: "bent", with: { "warp": 0.22 }),
    "out": Remap(input: "use", from: (0, 1), to: (0, "$deep")),
  },
  outputs: { "out": "out" },
)"##;

    #[test]
    fn reads_fields_in_brackets_of_node() {
        let registry = shibo_library::registry();
        let options = LoadOptions { set: vec![("deep".into(), "0.75".into())], ..LoadOptions::default() };
        let loaded = load_text(Path::new("a.ron"), TEXT, &registry, &options);
        let graph = loaded.graph.unwrap_or_else(|| panic!("{:?}", loaded.diagnostics));
        let node = |name: &str| graph.nodes.node_weights().find(|node| node.name == name).unwrap();
        let it = node("use/it");
        assert_eq!(
            text(it, &graph.sources),
            "Warp(input: \"= noise * 2\", amount: \"= $warp * 0.5\", size: 3, /* ) */ seed: 4)"
        );
        let at = |node: &GraphNode, field| place(node, &graph.sources, field).map(|span| &TEXT[span.start..span.end]);
        assert_eq!(at(it, "amount"), Some("\"= $warp * 0.5\""));
        assert_eq!(at(it, "octaves"), None);
        // The parameter was set from outside.
        assert_eq!(at(node("out"), "to"), Some("(0, \"$deep\")"));
        let info = registry.info("Warp").unwrap();
        let role = |name: &str| &info.fields.iter().find(|field| field.name == name).unwrap().role;
        assert_eq!(number(it, "amount", role("amount")), Some(0.11));
        assert_eq!(number(it, "size", role("size")), Some(3.0));
        assert_eq!(number(node("use/it"), "seed", role("seed")), None);
        assert_eq!(text(node("out"), &graph.sources), "Remap(input: \"use\", from: (0, 1), to: (0, \"$deep\"))");
    }
}
