//! Replaces kinds of earlier versions.
use super::super::diagnose::Finding;
use super::super::format::change;
use super::super::migrate::migrate;
use super::super::world::Cx;
use super::{Action, ActionKind};

/// Replaces all such nodes of the file, if a finding is about one.
pub(super) fn replace_all(cx: Cx<'_>, findings: &[Finding]) -> Option<Action> {
    let registry = cx.world.registry();
    let is_retired =
        |finding: &Finding| finding.code == "unknown-kind" && registry.is_retired(cx.file.at(&finding.range));
    if !findings.iter().any(is_retired) {
        return None;
    }
    let text = &cx.file.text;
    let edit = change(text, &(0..text.len()), &migrate(text, registry).ok()?.text)?;
    Some(Action::new("Replace all old kinds in the file", ActionKind::Rewrite, cx.file, vec![edit]))
}
