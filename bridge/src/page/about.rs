//! The description of a target: its node, and the values in the text of the node.
use super::wiring;
use crate::scene::{Scene, Target, is_own};
use serde_json::{Value as Data, json};
use shibo_node::registry::Registry;
use shibo_value::Type;

/// Describes a target for pages: the node with its text and its written values, and the channels of a material. The graph is not
/// evaluated.
pub fn about(scene: &Scene, target: &Target, registry: &Registry) -> Data {
    let node = &scene.graph.nodes[target.node];
    let is_own = is_own(scene, node.span);
    let at = scene.graph.sources.position(node.span.file, node.span.start);
    let output = node.node.outputs().get(target.output);
    let mut about = json!({
        "target": target.name,
        "node": node.name,
        "kind": node.kind,
        "doc": output.map_or("", |output| output.doc),
        "text": wiring::text(node, &scene.graph.sources),
        "fields": wiring::constants(scene, node, registry),
        // The file of a sub-graph.
        "file": (!is_own).then(|| scene.graph.sources.path(node.span.file).display().to_string()),
        "line": is_own.then_some(at.line),
        "column": is_own.then_some(at.column),
    });
    if node.outputs.get(target.output) == Some(&Type::Material) {
        let first = node.channels.iter().next();
        about["channels"] = node.channels.iter().map(|channel| channel.name()).collect();
        about["channel"] = target.channel.or(first).map(|channel| channel.name()).into();
    }
    about
}
