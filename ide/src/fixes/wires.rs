//! Fixes of wires whose type does not fit: another output, a channel, or a node that converts.
use super::super::diagnose::Finding;
use super::super::world::Cx;
use super::words::{names_at, word_at};
use super::{Applies, Fix, value_at};
use shibo_node::KindInfo;

/// Most outputs that are tried.
const OUTPUTS: usize = 6;
/// Most kinds that are tried.
const KINDS: usize = 12;

/// Takes something else of the node that a text names.
pub(super) fn fixes(cx: Cx<'_>, finding: &Finding) -> Vec<Fix> {
    let Some((expect, value)) = value_at(cx, finding.range.start) else { return Vec::new() };
    let Some(path) = value.text().filter(|text| !text.starts_with(['=', '$', '#'])) else { return Vec::new() };
    if expect.reference(cx).is_none() || path.is_empty() || value.range != finding.range {
        return Vec::new();
    }
    let node = path.split('.').next().unwrap_or_default();
    let known = [super::super::Section::Nodes, super::super::Section::Inputs];
    if !known.into_iter().any(|section| cx.file.entry(section, node).is_some()) {
        return Vec::new();
    }
    let replace = |text: String| Fix::replace(Applies::Likely, value.range.clone(), text);
    let mut found = vec![];
    // Behind a dot, completion offers outputs and channels, those that fit first.
    let dotted = super::super::rename::apply(
        &cx.file.text,
        &[super::super::rename::Edit { range: value.range.clone(), text: format!("\"{node}.\"") }],
    );
    let file = super::super::File::new(cx.file.path.clone(), dotted);
    let at = value.range.start + 1 + node.len() + 1;
    let others = names_at(Cx { world: cx.world, file: &file }, at, false);
    let others = others.into_iter().filter(|name| name.starts_with(node) && *name != path);
    found.extend(others.take(OUTPUTS).map(|name| replace(format!("\"{name}\""))));
    found.push(replace(format!("\"= luminance({path})\"")));
    let converts = |kind: &&str| cx.kind(kind).and_then(single_port).is_some();
    let wanted = expect.reference(cx).flatten();
    let mut kinds: Vec<&str> = cx.registry().kinds().filter(converts).collect();
    // Kinds for this very type come first.
    let makes = |kind: &&str| {
        let output = cx.kind(kind).and_then(|info| info.outputs.first());
        !matches!((output.map(|output| output.ty), wanted), (Some(shibo_node::OutputType::Fixed(ty)), Some(wanted)) if wanted == shibo_value::Accepts::One(ty))
    };
    kinds.sort_by_key(makes);
    for kind in kinds.into_iter().take_while(|kind| !makes(kind)).take(KINDS) {
        let Some(port) = cx.kind(kind).and_then(single_port) else { continue };
        found.push(replace(format!("{kind}({port}: \"{path}\")")));
    }
    debug_assert!(word_at(path, 0).end <= path.len());
    found
}

/// The port of a kind that needs nothing else.
fn single_port(info: &KindInfo) -> Option<&str> {
    let mut needed = info.ports().filter(|(_, port)| port.required);
    let (field, port) = needed.next()?;
    let alone = needed.next().is_none() && !port.list && !info.params().any(|(_, param)| param.required);
    alone.then_some(field.name.as_str())
}
