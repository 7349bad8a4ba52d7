//! Replaces kinds of earlier versions.
use super::super::diagnose::Finding;
use super::super::format::change;
use super::super::migrate::{migrate, rewrite_of};
use super::super::rename::Edit;
use super::super::world::Cx;
use super::{Action, ActionKind};

/// Replaces each node that a finding is about, and all nodes of the file.
pub(super) fn replace(cx: Cx<'_>, findings: &[Finding]) -> Vec<Action> {
    let registry = cx.world.registry();
    let is_retired =
        |finding: &Finding| finding.code == "unknown-kind" && registry.is_retired(cx.file.at(&finding.range));
    let told: Vec<(usize, &Finding)> = findings.iter().enumerate().filter(|(_, finding)| is_retired(finding)).collect();
    let one = |(index, finding): &(usize, &Finding)| {
        let node = cx.file.tree.covering(finding.range.clone());
        let text = rewrite_of(node, registry)?;
        let new = if text.starts_with('"') { "a formula".to_owned() } else { format!("`{}`", text.split('(').next()?) };
        let title = format!("Replace `{}` by {new}", cx.file.at(&finding.range));
        let action = Action::new(title, ActionKind::Fix, cx.file, vec![Edit { range: node.range(), text }]);
        Some(Action { mends: Some(*index), ..action })
    };
    let mut actions: Vec<Action> = told.iter().filter_map(one).collect();
    let all = || {
        let text = &cx.file.text;
        let edit = change(text, &(0..text.len()), &migrate(text, registry).ok()?.text)?;
        Some(Action::new("Replace all old kinds in the file", ActionKind::Rewrite, cx.file, vec![edit]))
    };
    actions.extend(if told.is_empty() { None } else { all() });
    actions
}
