//! Inlay hints, shown between the words of the text: units, values of expressions, types of nodes.
use super::evaluate;
use super::expect::Expect;
use super::file::Section;
use super::formula::{FormulaText, Role};
use super::types::Types;
use super::view::{Item, Shape, Value};
use super::walk::{Visit, walk};
use super::world::Cx;
use serde::Deserialize;
use shibo_value::Accepts;
use shibo_value::expression::Value as Known;
use std::ops::Range;

/// Kinds of hints to show.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub struct InlayKinds {
    /// Units after numbers.
    pub units: bool,
    /// Values of expressions and parameters.
    pub values: bool,
    /// Types of nodes.
    pub types: bool,
}

impl Default for InlayKinds {
    fn default() -> Self {
        Self { units: true, values: true, types: true }
    }
}

/// An inlay hint.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Inlay {
    /// Position after which it is shown.
    pub at: usize,
    /// Text of the hint.
    pub text: String,
    /// True for a type.
    pub is_type: bool,
}

/// Hints for a part of a file.
pub fn inlays(cx: Cx<'_>, part: &Range<usize>, shown: InlayKinds) -> Vec<Inlay> {
    let mut inlays = Vec::new();
    for file in cx.file.scopes() {
        let cx = cx.with(&file);
        let mut found = Found { cx, types: Types::new(cx), part: part.clone(), shown, inlays: Vec::new() };
        walk(cx, &mut found);
        inlays.extend(found.inlays);
    }
    inlays
}

struct Found<'a> {
    cx: Cx<'a>,
    types: Types<'a>,
    part: Range<usize>,
    shown: InlayKinds,
    inlays: Vec<Inlay>,
}

impl Found<'_> {
    fn push(&mut self, at: usize, text: String, is_type: bool) {
        if self.part.start <= at && at <= self.part.end {
            self.inlays.push(Inlay { at, text, is_type });
        }
    }
}

impl<'a> Visit<'a> for Found<'a> {
    fn key(&mut self, inside: Expect<'a>, item: &'a Item) {
        let (true, Some(key)) = (self.shown.types, &item.key) else { return };
        if matches!(inside, Expect::Section(Section::Nodes)) && item.value.is_some() {
            let ports = self.types.ports(&key.name);
            if let Some(ty) = ports.first().and_then(|port| port.ty) {
                self.push(key.range.end, format!(": {}", Accepts::name(ty)), true);
            }
        }
    }

    fn value(&mut self, expect: Expect<'a>, value: &'a Value) {
        if value.range.end < self.part.start || value.range.start > self.part.end {
            return;
        }
        let unit = unit(self.cx, expect);
        let angle = |unit: &str| if unit == "°" { unit.to_owned() } else { format!(" {unit}") };
        let unit = unit.map_or(String::new(), |unit| angle(&unit));
        match &value.shape {
            Shape::Number(_) if self.shown.units && !unit.is_empty() => self.push(value.range.end, unit, false),
            Shape::Body(body) if self.shown.units && !unit.is_empty() && body.bracket == b'(' => {
                let numbers = |item: &Item| item.value.as_ref().is_some_and(|v| matches!(v.shape, Shape::Number(_)));
                if !body.items.is_empty() && body.items.iter().all(numbers) {
                    self.push(value.range.end, unit, false);
                }
            }
            Shape::Text(text) if self.shown.values && text.starts_with(['$', '=']) => {
                if let Some(plain) = default_text(self.cx, text) {
                    self.push(value.range.end, format!(" = {plain}"), false);
                } else if !matches!(expect, Expect::Note)
                    && let Some(known) = evaluate::value(self.cx, text)
                    && (!matches!(known, Known::Word(_)) || !is_point(self.cx, expect, value))
                {
                    self.push(value.range.end, format!(" = {}{unit}", evaluate::spell(&known)), false);
                }
            }
            _ => {}
        }
    }
}

/// Returns whether a formula may read nodes, so that a word in it is no option.
fn is_point(cx: Cx<'_>, expect: Expect<'_>, value: &Value) -> bool {
    FormulaText::of(cx, expect, value).is_some_and(|text| text.role == Role::Point)
}

/// Default of the parameter in a text, if the default is a text such as a colour.
fn default_text<'a>(cx: Cx<'a>, text: &str) -> Option<&'a str> {
    let item = cx.file.entry(Section::Params, text.strip_prefix('$')?)?;
    let default = item.value.as_ref()?.body()?.value("default")?.text()?;
    (!default.starts_with(['$', '='])).then_some(default)
}

/// Unit of a value in a place.
fn unit(cx: Cx<'_>, expect: Expect<'_>) -> Option<String> {
    let declared = |file: &super::File, name: &str| {
        let value = file.entry(Section::Params, name)?.value.as_ref()?;
        file.text_of(value, "unit").map(str::to_owned)
    };
    match expect {
        Expect::Value(_, param) => param.bounds.unit.clone(),
        Expect::Canvas(Some("size_mm")) | Expect::Layout(Some("offset" | "size_mm")) => Some("mm".to_owned()),
        Expect::Layout(Some("angle")) => Some("°".to_owned()),
        Expect::Preset(name) => declared(cx.file, name),
        Expect::With(import, Some(name)) => declared(&*cx.imported(import)?, name),
        _ => None,
    }
}
