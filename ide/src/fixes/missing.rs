//! Adds fields that a node needs, and sections that a graph needs.
use super::super::complete::complete;
use super::super::diagnose::Finding;
use super::super::expect::Expect;
use super::super::file::File;
use super::super::insert::append;
use super::super::rename::apply;
use super::super::view::Body;
use super::super::walk::{Spot, trail};
use super::super::world::Cx;
use super::words::{nearest_name, renamed_section};
use super::{Applies, Fix};
use shibo_node::{KindInfo, Role};

/// Adds what the node of a finding lacks, or calls a section `nodes`.
pub(super) fn fixes(cx: Cx<'_>, finding: &Finding) -> Vec<Fix> {
    let mut found: Vec<Fix> = renamed_section(cx, finding).into_iter().collect();
    found.extend(fields(cx, finding.range.end).or_else(|| fields(cx, finding.range.start)));
    found
}

/// Adds required ports and parameters that the node at a position lacks.
pub(crate) fn fields(cx: Cx<'_>, at: usize) -> Option<Fix> {
    let found = trail(cx, at);
    // On the kind itself, the position is still before the brackets.
    let inner = match found.spot {
        Spot::Value(_, value) if value.word().is_some_and(|word| word.end >= at) => {
            value.body().map(|body| body.range.start + 1)
        }
        _ => None,
    };
    let found = inner.map_or(found, |at| trail(cx, at));
    let level = found.node()?;
    let Expect::Kind(info) = level.inside else { return None };
    let missing = missing(info, level.body);
    if missing.is_empty() {
        return None;
    }
    if let Some(fix) = misspelt(&missing, info, level.body) {
        return Some(fix);
    }
    let mut written = Vec::new();
    for field in &missing {
        written.push(filled(cx, level.body, &written, field, info));
    }
    let edits = append(cx.file, level.body, &written.join(", "));
    let title = format!("Add {}", missing.iter().map(|f| format!("`{f}`")).collect::<Vec<_>>().join(", "));
    Some(Fix::new(title, Applies::Likely, edits))
}

/// Renames a field that the kind does not have to one that is missing.
fn misspelt(missing: &[&str], info: &KindInfo, body: &Body) -> Option<Fix> {
    let unknown = body.items.iter().filter_map(|item| item.key.as_ref()).filter(|key| info.field(&key.name).is_none());
    let mut meant = unknown.filter_map(|key| Some((key, nearest_name(&key.name, missing)?)));
    meant.next().map(|(key, name)| Fix::replace(Applies::Likely, key.range.clone(), name))
}

fn missing<'k>(info: &'k KindInfo, body: &Body) -> Vec<&'k str> {
    let needed = info.fields.iter().filter(|field| match &field.role {
        Role::Port(port) => port.required,
        Role::Param(param) => param.required,
    });
    needed.map(|field| field.name.as_str()).filter(|name| body.get(name).is_none()).collect()
}

/// A field with the first value that completion would offer.
fn filled(cx: Cx<'_>, body: &Body, before: &[String], field: &str, info: &KindInfo) -> String {
    let list = info.field(field).is_some_and(|f| matches!(&f.role, Role::Port(port) if port.list));
    let (open, close) = if list { ("[\"", "\"]") } else { ("\"", "\"") };
    let entry = format!("{}{field}: {open}{close}", before.iter().map(|b| format!("{b}, ")).collect::<String>());
    let edits = append(cx.file, body, &entry);
    let text = apply(&cx.file.text, &edits);
    let place = edits.first().map_or(0, |edit| edit.range.start + edit.text.rfind(close).unwrap_or(0));
    let trial = File::new(cx.file.path.clone(), text);
    let offers = complete(Cx { world: cx.world, file: &trial }, place);
    let first = offers.first().filter(|one| !one.label.ends_with('/')).map_or("", |one| one.label.as_str());
    format!("{field}: {open}{first}{close}")
}
