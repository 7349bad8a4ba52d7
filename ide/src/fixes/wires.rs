//! Fixes of wires whose type does not fit: another output, a channel, or a node that converts.
use super::super::diagnose::Finding;
use super::super::file::{File, Section};
use super::super::rename::{Edit, apply};
use super::super::world::Cx;
use super::words::names_at;
use super::{Applies, Fix, value_at};
use shibo_node::{KindInfo, OutputType};
use shibo_value::Accepts;

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
    let known = [Section::Nodes, Section::Inputs];
    if !known.into_iter().any(|section| cx.file.entry(section, node).is_some()) {
        return Vec::new();
    }
    let replace = |text: String| Fix::replace(Applies::Likely, value.range.clone(), text);
    let mut found = Vec::new();
    // Behind a dot, completion offers outputs and channels, those that fit first.
    let dotted = Edit { range: value.range.clone(), text: format!("\"{node}.\"") };
    let dotted = apply(&cx.file.text, &[dotted]);
    let file = File::new(cx.file.path.clone(), dotted);
    let at = value.range.start + 1 + node.len() + 1;
    let others = names_at(Cx { world: cx.world, file: &file }, at, false);
    let others = others.into_iter().filter(|name| name.starts_with(node) && *name != path);
    found.extend(others.take(OUTPUTS).map(|name| replace(format!("\"{name}\""))));
    found.push(replace(format!("\"= luminance({path})\"")));
    let wanted = expect.reference(cx).flatten();
    let makes = |info: &KindInfo| {
        let output = info.outputs.first().map(|output| output.ty);
        matches!((output, wanted), (Some(OutputType::Fixed(ty)), Some(wanted)) if wanted == Accepts::One(ty))
    };
    let converts = |kind: &str| {
        let info = cx.kind(kind).filter(|info| makes(info))?;
        Some(replace(format!("{kind}({}: \"{path}\")", single_port(info)?)))
    };
    found.extend(cx.registry().kinds().filter_map(converts).take(KINDS));
    found
}

/// The port of a kind that needs nothing else.
fn single_port(info: &KindInfo) -> Option<&str> {
    let mut needed = info.ports().filter(|(_, port)| port.required);
    let (field, port) = needed.next()?;
    let alone = needed.next().is_none() && !port.list && !info.params().any(|(_, param)| param.required);
    alone.then_some(field.name.as_str())
}
