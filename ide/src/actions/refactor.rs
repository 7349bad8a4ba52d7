//! Refactorings: literals to parameters, relative paths, sorted presets, removal of unused nodes.
use super::super::diagnose::{Finding, unused};
use super::super::expect::Expect;
use super::super::file::Section;
use super::super::insert::{add_to, free_name, remove};
use super::super::rename::{Edit, sort};
use super::super::view::{Shape, Value};
use super::super::walk::{Spot, trail};
use super::super::world::Cx;
use super::{Action, ActionKind};
use shibo_node::{ParamType, parse_color};
use std::path::{Component, Path, PathBuf};

/// Turns the literal at a position into a parameter of the graph.
pub(super) fn name_literal(cx: Cx<'_>, at: usize) -> Option<Action> {
    let Spot::Value(expect, value) = trail(cx, at).spot else { return None };
    let (field, unit, integer) = match expect {
        Expect::Value(field, param) => (field, param.bounds.unit.clone(), param.ty == ParamType::Integer),
        Expect::Port(field, port, _) => (field, port.bounds.unit.clone(), false),
        _ => return None,
    };
    let written = cx.file.at(&value.range);
    let ty = match &value.shape {
        Shape::Number(_) if integer => "Integer",
        Shape::Number(number) if number.is_finite() => "Number",
        Shape::Word if matches!(written, "true" | "false") => "Bool",
        Shape::Text(text) if parse_color(text).is_some() => "Color",
        _ => return None,
    };
    let name = free_name(cx.file, &[Section::Params, Section::Inputs], &field.name);
    let unit =
        unit.filter(|_| matches!(ty, "Number" | "Integer")).map_or(String::new(), |u| format!(", unit: \"{u}\""));
    let doc = crate::manual::doc::summary(&field.doc).replace(['"', '\\'], "'");
    let entry = format!("\"{name}\": {ty}(default: {written}{unit}, doc: \"{}\")", doc.trim_end_matches('.'));
    let mut edits = add_to(cx.file, Section::Params, &entry);
    edits.push(Edit { range: value.range.clone(), text: format!("\"${name}\"") });
    let title = format!("Name this value as parameter `${name}`");
    Some(Action::new(title, ActionKind::Extract, cx.file, edits))
}

/// Makes the absolute path at a position relative to the file.
pub(super) fn relative_path(cx: Cx<'_>, at: usize) -> Option<Action> {
    let Spot::Value(expect, value) = trail(cx, at).spot else { return None };
    let path = match expect {
        Expect::Value(_, param) if param.ty == ParamType::Path => value.text()?,
        Expect::Entry(Section::Imports, _) => value.text()?,
        _ => return None,
    };
    if !Path::new(path).is_absolute() {
        return None;
    }
    let relative = relative(Path::new(path), cx.file.folder())?;
    let text = super::super::names::quote(&relative);
    let edit = Edit { range: value.range.clone(), text };
    Some(Action::new(format!("Make the path relative: `{relative}`"), ActionKind::Rewrite, cx.file, vec![edit]))
}

/// A path relative to a folder, with `/`.
pub(super) fn relative(path: &Path, folder: &Path) -> Option<String> {
    let clean = |path: &Path| -> PathBuf { path.components().filter(|c| !matches!(c, Component::CurDir)).collect() };
    let (path, folder) = (clean(path), clean(folder));
    let shared = path.components().zip(folder.components()).take_while(|(a, b)| a == b).count();
    // The paths share only the root or lie on different disks, so there is no useful relative path.
    if shared == 0 {
        return None;
    }
    let up = folder.components().skip(shared).map(|_| "..".to_owned());
    let down = path.components().skip(shared).map(|part| part.as_os_str().to_string_lossy().into_owned());
    Some(up.chain(down).collect::<Vec<_>>().join("/"))
}

/// Actions that remove the reported node, and all nodes that no output needs.
pub(super) fn remove_unused(cx: Cx<'_>, findings: &[Finding]) -> Vec<Action> {
    let Some(body) = cx.file.section(Section::Nodes) else { return Vec::new() };
    let reported = findings.iter().position(|finding| finding.unneeded);
    let all: Vec<usize> = unused(cx);
    let Some(reported) = reported.filter(|_| !all.is_empty()) else { return Vec::new() };
    let mut found = Vec::new();
    let here = all.iter().find(|index| body.items[**index].range == findings[reported].range);
    if let Some(item) = here.map(|index| &body.items[*index]) {
        let title = format!("Remove `{}`, which no output needs", item.name().unwrap_or_default());
        let action = Action::new(title, ActionKind::Fix, cx.file, vec![remove(cx.file, body, item)]);
        found.push(Action { mends: Some(reported), ..action });
    }
    let mut edits: Vec<Edit> = all.iter().map(|index| remove(cx.file, body, &body.items[*index])).collect();
    sort(&mut edits);
    let title = format!("Remove all {} nodes that no output needs", all.len());
    found.push(Action::new(title, ActionKind::Tidy, cx.file, edits));
    found
}

/// Sorts the presets by name.
pub(super) fn sort_presets(cx: Cx<'_>, at: usize) -> Option<Action> {
    let body = cx.file.section(Section::Presets)?;
    let inside = body.range.start <= at && at <= body.range.end;
    let names: Vec<&str> = body.items.iter().filter_map(|item| item.name()).collect();
    if !inside || names.is_sorted() || names.len() != body.items.len() {
        return None;
    }
    let mut sorted: Vec<_> = body.items.iter().collect();
    sorted.sort_by_key(|item| item.name());
    let edit = |(place, item): (&super::super::view::Item, &&super::super::view::Item)| Edit {
        range: place.range.clone(),
        text: cx.file.at(&item.range).to_owned(),
    };
    let edits = body.items.iter().zip(&sorted).map(edit).collect();
    Some(Action::new("Sort the presets by name", ActionKind::Rewrite, cx.file, edits))
}

/// Returns whether a value is a plain literal that means the same everywhere.
pub(super) fn is_literal(value: &Value) -> bool {
    matches!(value.shape, Shape::Number(_) | Shape::Word)
}
