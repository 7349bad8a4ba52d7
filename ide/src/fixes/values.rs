//! Fixes of values that a field does not take: units, quotes, words of other languages, ranges.
use super::super::diagnose::Finding;
use super::super::expect::Expect;
use super::super::file::Section;
use super::super::insert::remove;
use super::super::rename::Edit;
use super::super::view::{Body, Shape, Value};
use super::super::walk::trail;
use super::super::world::Cx;
use super::dialects::in_units;
use super::words::nearest_as;
use super::{Applies, Fix, value_at};
use shibo_graph::syntax::is_name;
use shibo_node::{Bounds, spell_number};

/// Words of other languages for no value.
const NOTHING: [&str; 6] = ["null", "None", "nil", "undefined", "none", "NULL"];

/// Fixes of a value.
pub(super) fn fixes(cx: Cx<'_>, finding: &Finding) -> Vec<Fix> {
    let says = cx.file.at(&finding.range);
    let inside = says.trim_matches(['"', '\'']);
    let replace = |level: Applies, text: String| Fix::replace(level, finding.range.clone(), text);
    let mut found = Vec::new();
    if finding.code == "bad-name" {
        return renamed(cx, says, inside);
    }
    let expected = value_at(cx, finding.range.start);
    if finding.code == "out-of-range" {
        let bounds = expected.and_then(|(expect, _)| bounds(cx, expect));
        return bounds.map_or(Vec::new(), |bounds| within(finding, says, &bounds));
    }
    found.extend(number(inside).filter(|text| text != says).map(|text| replace(Applies::Sure, text)));
    found.extend(truth(inside).filter(|text| *text != says).map(|text| replace(Applies::Sure, text.to_owned())));
    if NOTHING.contains(&inside) {
        found.extend(without(cx, finding));
    }
    if let Ok(value) = says.parse::<f64>() {
        let whole = value.round();
        let level = if whole == value { Applies::Sure } else { Applies::Likely };
        found.push(replace(level, format!("{whole:.0}")));
        found.push(replace(Applies::Likely, format!("({says}, {says})")));
        if value == 0.0 || value == 1.0 {
            found.push(replace(Applies::Likely, (value == 1.0).to_string()));
        }
    }
    if let Some(color) = says.strip_prefix("0x").filter(|digits| digits.len() == 6) {
        found.push(replace(Applies::Sure, format!("\"#{color}\"")));
    }
    if is_name(inside) {
        found.extend(names(cx, finding, says, inside));
    } else if says.starts_with('"') && inside.contains(['+', '*', '/', '$', '-']) && !inside.starts_with(['=', '#']) {
        let at = finding.range.start + 1;
        found.push(Fix::new("Make it a formula", Applies::Likely, vec![Edit { range: at..at, text: "= ".to_owned() }]));
    }
    if let Some((_, value)) = expected {
        found.extend(brackets(cx, value));
    }
    found
}

/// A name where another sort of value stands: a parameter, a node, or a choice.
fn names(cx: Cx<'_>, finding: &Finding, says: &str, inside: &str) -> Vec<Fix> {
    let replace = |level: Applies, text: String| Fix::replace(level, finding.range.clone(), text);
    let has = |section: Section| cx.file.entry(section, inside).is_some();
    let quoted = says.starts_with('"');
    let mut found = Vec::new();
    if has(Section::Params) {
        found.push(replace(Applies::Sure, format!("\"${inside}\"")));
    }
    if !quoted {
        let level = if has(Section::Nodes) || has(Section::Inputs) { Applies::Sure } else { Applies::Likely };
        found.push(replace(level, format!("\"{inside}\"")));
    }
    let level = |sure: bool| if sure { Applies::Sure } else { Applies::Likely };
    for (sure, name) in nearest_as(cx, &finding.range, inside, false) {
        if is_name(&name) {
            found.push(replace(level(sure), name));
        }
    }
    for (sure, name) in nearest_as(cx, &finding.range, &format!("\"{inside}\""), true) {
        found.push(replace(level(sure), format!("\"{name}\"")));
    }
    found
}

/// A number with a unit, or in quotes.
fn number(text: &str) -> Option<String> {
    let text = text.trim();
    let end = text.rfind(|c: char| c.is_ascii_digit() || c == '.').map_or(0, |at| at + 1);
    let (number, unit) = text.split_at(end);
    number.parse::<f64>().ok()?;
    if unit.trim().is_empty() { Some(number.to_owned()) } else { in_units(number, unit) }
}

fn truth(text: &str) -> Option<&'static str> {
    match text.to_lowercase().as_str() {
        "true" | "yes" | "on" => Some("true"),
        "false" | "no" | "off" => Some("false"),
        _ => None,
    }
}

/// Removes the field of a value.
fn without(cx: Cx<'_>, finding: &Finding) -> Option<Fix> {
    let found = trail(cx, finding.range.start);
    let level = found.levels.iter().rev().find(|level| level.item.is_some_and(|item| item.key.is_some()))?;
    let edit = remove(cx.file, level.body, level.item?);
    Some(Fix::new("Leave out the field", Applies::Sure, vec![edit]))
}

/// Other brackets around the same values.
fn brackets(cx: Cx<'_>, value: &Value) -> Vec<Fix> {
    let Shape::Body(body) = &value.shape else { return Vec::new() };
    let inside = cx.file.at(&body.inside());
    let with = |open: &str, close: &str| {
        Fix::replace(Applies::Likely, body.range.clone(), format!("{open}{}{close}", inside.trim()))
    };
    match body.bracket {
        b'[' if body.items.len() == 1 => vec![with("", ""), with("(", ")")],
        b'[' => vec![with("(", ")")],
        b'(' if body.items.len() == 1 && body.items[0].key.is_none() => vec![with("", ""), with("[", "]")],
        b'(' => vec![with("[", "]"), with("{", "}")],
        _ => vec![with("(", ")")],
    }
}

/// The bounds of a value in a place.
fn bounds(cx: Cx<'_>, expect: Expect<'_>) -> Option<Bounds> {
    match expect {
        Expect::Value(_, param) => Some(param.bounds.clone()),
        Expect::Port(_, port, _) => Some(port.bounds.clone()),
        Expect::Preset(name) => declared(cx, name),
        Expect::Param(..) => None,
        Expect::With(import, Some(name)) => {
            let file = cx.imported(import)?;
            declared(cx.with(&file), name)
        }
        _ => None,
    }
}

/// The range of a parameter of the graph.
fn declared(cx: Cx<'_>, name: &str) -> Option<Bounds> {
    let body = cx.file.entry(Section::Params, name)?.value.as_ref()?.body()?;
    let numbers = |body: &Body| {
        let number = |index: usize| match body.items.get(index)?.value.as_ref()?.shape {
            Shape::Number(number) => Some(number),
            _ => None,
        };
        (number(0), number(1))
    };
    let (min, max) = numbers(body.value("range")?.body()?);
    Some(Bounds { min, max, ..Bounds::default() })
}

/// The nearest number within bounds, and the number as a share of 100.
fn within(finding: &Finding, says: &str, bounds: &Bounds) -> Vec<Fix> {
    let Ok(value) = says.trim().parse::<f64>() else { return Vec::new() };
    let replace = |number: f64| Fix::replace(Applies::Likely, finding.range.clone(), spell_number(number));
    let mut found = Vec::new();
    if bounds.max == Some(1.0) && value > 1.0 && value <= 100.0 && value.fract() == 0.0 && value >= 5.0 {
        found.push(replace(value / 100.0));
    }
    let nearest = match (bounds.min, bounds.max) {
        (Some(min), _) if value < min || (bounds.above_min && value <= min) => {
            if bounds.above_min {
                bounds.max.map_or(min + 1.0, |max| (min + max) / 2.0).min(min + 0.1)
            } else {
                min
            }
        }
        (_, Some(max)) if value > max => max,
        _ => return found,
    };
    found.push(replace(nearest));
    found
}

/// A name with other signs than letters, digits and `_`, changed in all its places.
fn renamed(cx: Cx<'_>, says: &str, inside: &str) -> Vec<Fix> {
    let plain: String = inside.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    let plain = if plain.starts_with(|c: char| c.is_ascii_digit()) { format!("n{plain}") } else { plain };
    if !says.starts_with('"') || !is_name(&plain) || inside.is_empty() {
        return Vec::new();
    }
    let text = &cx.file.text;
    let same = cx.file.tree.tokens().iter().map(|token| token.range()).filter(|range| &text[range.clone()] == says);
    let edits = same.map(|range| Edit { range, text: format!("\"{plain}\"") }).collect();
    vec![Fix::new(format!("Call it `{plain}`"), Applies::Likely, edits)]
}
