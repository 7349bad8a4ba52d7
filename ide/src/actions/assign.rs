//! Writes values chosen elsewhere into a file: as parameter defaults, in presets, or as node arguments.
use super::super::colors;
use super::super::file::{File, Section};
use super::super::insert::{add_to, append};
use super::super::names::quote;
use super::super::rename::Edit;
use super::super::view::{Item, Value};
use super::super::world::Cx;
use super::refactor;
use shibo_node::parse_color;
use shibo_value::linear_to_srgb;
use std::ops::Range;

/// Sets values, given as RON: in a preset, or as the defaults without one.
pub fn assign(cx: Cx<'_>, preset: Option<&str>, values: &[(String, String)]) -> Result<Vec<Edit>, String> {
    let mut edits = Vec::new();
    let mut added = Vec::new();
    for (name, value) in values {
        let declared =
            cx.file.entry(Section::Params, name).and_then(|item| item.value.as_ref()?.body()?.value("default"));
        let Some(declared) = declared else { return Err(format!("the file declares no parameter `{name}`")) };
        let Some(preset) = preset else {
            edits.push(replacement(cx, declared, name, value)?);
            continue;
        };
        match body_of(cx.file, preset)?.value(name) {
            Some(given) => edits.push(replacement(cx, given, name, value)?),
            None => added.push(format!("{}: {}", quote(name), alike(cx, &declared.range, value))),
        }
    }
    if let (Some(preset), false) = (preset, added.is_empty()) {
        edits.extend(append(cx.file, body_of(cx.file, preset)?, &added.join(", ")));
    }
    Ok(edits)
}

/// Adds a preset with these values.
pub fn add_preset(cx: Cx<'_>, name: &str, values: &[(String, String)]) -> Result<Vec<Edit>, String> {
    check_preset_name(name)?;
    if cx.file.entry(Section::Presets, name).is_some() {
        return Err(format!("there is a preset `{name}` already"));
    }
    let entry = format!("{}: {}", quote(name), preset_of(cx, values)?);
    Ok(add_to(cx.file, Section::Presets, &entry))
}

/// A preset with these values as text, each in the notation of the default of its parameter.
///
/// # Errors
/// A parameter that the file does not declare.
pub(super) fn preset_of(cx: Cx<'_>, values: &[(String, String)]) -> Result<String, String> {
    let mut entries = Vec::new();
    for (param, value) in values {
        let item = cx.file.entry(Section::Params, param);
        let declared = item.and_then(|item| item.value.as_ref()?.body()?.value("default"));
        let declared = declared.ok_or_else(|| format!("the file declares no parameter `{param}`"))?;
        entries.push(format!("{}: {}", quote(param), alike(cx, &declared.range, value)));
    }
    Ok(if entries.is_empty() { "{}".to_owned() } else { format!("{{ {} }}", entries.join(", ")) })
}

/// Refuses a text that cannot be the name of a preset.
pub(super) fn check_preset_name(name: &str) -> Result<(), String> {
    let allowed = |c: char| c.is_alphanumeric() || matches!(c, '_' | '-' | ' ');
    if name.trim().is_empty() || !name.chars().all(allowed) {
        return Err(format!("`{name}` cannot be the name of a preset: use letters, digits, `_` and `-`"));
    }
    Ok(())
}

/// Turns the literal at a position into a parameter; `None` if there is no literal.
pub fn promote(cx: Cx<'_>, at: usize) -> Option<Vec<Edit>> {
    let file = cx.file.scope_at(at);
    refactor::name_literal(cx.with(&file), at).and_then(|action| action.edits.into_values().next())
}

/// Formats a value in the notation of the text that it replaces.
pub fn alike(cx: Cx<'_>, there: &Range<usize>, value: &str) -> String {
    let written = cx.file.at(there);
    let color = value.strip_prefix('"').and_then(|text| parse_color(text.strip_suffix('"')?));
    if let Some(linear) = color.filter(|_| written.starts_with('(')) {
        return colors::written(cx, there, linear.map(linear_to_srgb));
    }
    let whole = value.strip_prefix('-').unwrap_or(value).bytes().all(|b| b.is_ascii_digit());
    if whole && written.contains('.') { format!("{value}.0") } else { value.to_owned() }
}

fn replacement(cx: Cx<'_>, there: &Value, name: &str, value: &str) -> Result<Edit, String> {
    let written = cx.file.at(&there.range);
    if there.text().is_some_and(|text| text.starts_with(['=', '$'])) {
        return Err(format!(
            "`{name}` is the formula {written} in the file, which a value would replace; edit it there"
        ));
    }
    Ok(Edit { range: there.range.clone(), text: alike(cx, &there.range, value) })
}

fn body_of<'f>(file: &'f File, preset: &str) -> Result<&'f super::super::view::Body, String> {
    let item: Option<&Item> = file.entry(Section::Presets, preset);
    let body = item.and_then(|item| item.value.as_ref()?.body());
    body.ok_or_else(|| format!("the file declares no preset `{preset}`"))
}
