//! Source text of a node, its constants, and its formulas.
use super::numbers;
use super::scene::{Scene, is_own};
use serde_json::{Value as Json, json};
use shibo_graph::GraphNode;
use shibo_node::registry::Registry;
use shibo_node::{ParamInfo, ParamType, Role};
use shibo_value::diagnostics::{SourceMap, Span};

/// Longer source texts of nodes are cut, in bytes.
const TEXT: usize = 2000;
/// Longer values of fields cannot be edited as constants, in bytes.
const FIELD: usize = 80;

/// Source text of a node, from its kind to its closing bracket.
pub(super) fn text(node: &GraphNode, sources: &SourceMap) -> String {
    let Span { file, start, .. } = node.span;
    let text = sources.text(file);
    let end = node.fields.iter().filter(|(_, s)| s.file == file && s.end > start).map(|(_, s)| s.end).max();
    let after = end.unwrap_or(node.span.end);
    let close = text.get(after..).and_then(|rest| rest.find(')')).map_or(after, |at| after + at + 1);
    let shown = text.get(start..close).unwrap_or(&node.kind);
    if shown.len() > TEXT { node.kind.clone() } else { shown.to_owned() }
}

/// Fields of a node written in the graph file itself: the text, and the description of the parameter. A formula with
/// numbers is cut at these; that of a node that is a formula itself has no name.
pub(super) fn constants(scene: &Scene, node: &GraphNode, registry: &Registry) -> Json {
    let info = registry.info(&node.kind);
    let field = |(name, span): &(String, Span)| {
        let whole = is_own(scene, *span).then(|| scene.graph.sources.text(span.file))?;
        let text = whole.get(span.start..span.end)?;
        let found = info.and_then(|info| info.fields.iter().find(|field| field.name == *name))?;
        let mut about = json!({ "name": name, "text": text, "doc": found.doc });
        let bounds = match &found.role {
            Role::Param(param) => &param.bounds,
            Role::Port(port) => &port.bounds,
        };
        about["min"] = json!(bounds.min);
        about["max"] = json!(bounds.max);
        about["unit"] = json!(bounds.unit);
        if let Role::Param(ParamInfo { choices, ty, .. }) = &found.role {
            about["whole"] = (*ty == ParamType::Integer).into();
            about["choices"] =
                choices.iter().filter(|choice| !choice.has_arguments).map(|choice| choice.name.as_str()).collect();
        }
        let formula = numbers::pieces(text).filter(|_| text.len() <= TEXT);
        let shown = formula.is_some() || text.len() <= FIELD;
        about["formula"] = json!(formula);
        shown.then_some(about)
    };
    let whole = is_own(scene, node.span).then(|| scene.graph.sources.text(node.span.file));
    let own =
        whole.as_deref().and_then(|text| text.get(node.span.start..node.span.end)).filter(|text| text.len() <= TEXT);
    let own =
        own.and_then(|text| Some(json!({ "name": "", "text": text, "doc": "", "formula": numbers::pieces(text)? })));
    own.into_iter().chain(node.fields.iter().filter_map(field)).collect()
}
