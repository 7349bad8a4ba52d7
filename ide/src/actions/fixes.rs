//! Fixes for reported findings.
use super::super::complete::complete;
use super::super::diagnose::Finding;
use super::super::expect::Expect;
use super::super::file::File;
use super::super::rename::Edit;
use super::super::walk::trail;
use super::super::world::Cx;
use super::insert::append;
use super::{Action, ActionKind, apply};
use shibo_node::{KindInfo, Role};

/// Words in backticks of a message.
fn words(message: &str) -> impl DoubleEndedIterator<Item = &str> {
    let parts: Vec<&str> = message.split('`').collect();
    (1..parts.len()).step_by(2).map(move |i| parts[i]).collect::<Vec<_>>().into_iter()
}

/// Fixes suggested by the help of findings.
pub(super) fn fixes(cx: Cx<'_>, findings: &[Finding]) -> Vec<Action> {
    let fix = |(index, finding): (usize, &Finding)| {
        let edit = meant(cx, finding).or_else(|| instead(cx, finding))?;
        let title = format!("Change to `{}`", edit.text.trim_matches('"'));
        let action = Action::new(title, ActionKind::Fix, cx.file, vec![edit]);
        Some(Action { mends: Some(index), ..action })
    };
    findings.iter().enumerate().filter_map(fix).collect()
}

/// "did you mean": the wrong word is the last word of the message that occurs in the range.
fn meant(cx: Cx<'_>, finding: &Finding) -> Option<Edit> {
    let help = finding.help.as_deref()?.strip_prefix("did you mean `")?;
    let right = &help[..help.find('`')?];
    let written = cx.file.at(&finding.range);
    let wrong = words(&finding.message).rev().find(|word| written.contains(word))?;
    let at = if finding.code == "unknown-port" { written.rfind(wrong)? } else { written.find(wrong)? };
    let start = finding.range.start + at;
    Some(Edit { range: start..start + wrong.len(), text: right.to_owned() })
}

/// "write …": replaces the whole range.
fn instead(cx: Cx<'_>, finding: &Finding) -> Option<Edit> {
    let help = finding.help.as_deref()?.strip_prefix("write `\"")?;
    let right = &help[..help.find("\"`")?];
    let whole =
        matches!(finding.code.as_str(), "type-mismatch" | "file-not-found" | "bad-value" | "advice" | "unknown-node");
    let written = cx.file.at(&finding.range);
    let small = !written.is_empty() && !written.contains(['(', '{', '[', '\n']) && !right.contains('…');
    (whole && small).then(|| Edit { range: finding.range.clone(), text: format!("\"{right}\"") })
}

/// Adds required ports and parameters that the node at a position lacks.
pub(super) fn missing_ports(cx: Cx<'_>, at: usize, findings: &[Finding]) -> Option<Action> {
    let mends = findings.iter().position(|finding| finding.code == "missing-input");
    let at = mends.map_or(at, |index| findings[index].range.end);
    let trail = trail(cx, at);
    let on_word = |value: &super::super::view::Value| value.body().map(|body| body.range.start + 1);
    // On the kind itself, the position is still before the brackets.
    let inner = match trail.spot {
        super::super::walk::Spot::Value(_, value) if value.word().is_some_and(|word| word.end >= at) => on_word(value),
        _ => None,
    };
    let trail = inner.map_or(trail, |at| super::super::walk::trail(cx, at));
    let level = trail.node()?;
    let Expect::Kind(info) = level.inside else { return None };
    let missing = missing(info, level.body);
    if missing.is_empty() {
        return None;
    }
    let mut written = Vec::new();
    for field in &missing {
        written.push(filled(cx, level.body, &written, field, info));
    }
    let edits = append(cx.file, level.body, &written.join(", "));
    let title = format!("Add {}", missing.iter().map(|f| format!("`{f}`")).collect::<Vec<_>>().join(", "));
    Some(Action { mends, ..Action::new(title, ActionKind::Fix, cx.file, edits) })
}

fn missing<'k>(info: &'k KindInfo, body: &super::super::view::Body) -> Vec<&'k str> {
    let needed = info.fields.iter().filter(|field| match &field.role {
        Role::Port(port) => port.required,
        Role::Param(param) => param.required,
    });
    needed.map(|field| field.name.as_str()).filter(|name| body.get(name).is_none()).collect()
}

/// A field with the first value that completion would offer.
fn filled(cx: Cx<'_>, body: &super::super::view::Body, before: &[String], field: &str, info: &KindInfo) -> String {
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
