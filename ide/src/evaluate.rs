//! Values of parameters and expressions in a file, using the defaults of its parameters.
use super::file::Section;
use super::functions;
use super::view::{Shape, Value as Written};
use super::world::Cx;
use shibo_node::{parse_color, spell_number};
use shibo_value::expression::{self, Meaning, Names, UserFunction, Value};
use std::cell::Cell;
use std::sync::Arc;

/// Maximum depth of defaults that refer to other parameters.
const DEEPEST: u32 = 16;

/// Value of `"$name"` or `"= …"`.
pub(crate) fn value(cx: Cx<'_>, text: &str) -> Option<Value> {
    let depth = Cell::new(0);
    of_text(cx, text, &depth)
}

/// Value of a parameter of the graph.
pub(crate) fn param(cx: Cx<'_>, name: &str) -> Option<Value> {
    known(of_param(cx, name, &Cell::new(0)))
}

/// Formats a value for display.
pub(crate) fn spell(value: &Value) -> String {
    match value {
        Value::Number(number) => spell(&Value::Vector(vec![*number])).trim_matches(['(', ')']).to_owned(),
        Value::Bool(value) => value.to_string(),
        Value::Word(word) => word.clone(),
        Value::Vector(values) => {
            let short = |n: &f64| spell_number((n * 1e6).round() / 1e6);
            format!("({})", values.iter().map(short).collect::<Vec<_>>().join(", "))
        }
    }
}

fn known(meaning: Option<Meaning>) -> Option<Value> {
    match meaning? {
        Meaning::Known(value) => Some(value),
        Meaning::Choice(word, _) => Some(Value::Word(word)),
        _ => None,
    }
}

fn of_text(cx: Cx<'_>, text: &str, depth: &Cell<u32>) -> Option<Value> {
    if depth.get() > DEEPEST {
        return None;
    }
    if let Some(name) = text.strip_prefix('$') {
        return known(of_param(cx, name, depth));
    }
    let formula = text.strip_prefix('=').filter(|rest| !rest.starts_with('='))?;
    expression::evaluate(formula, &mut InFile { cx, depth }).ok()
}

/// Meaning of a parameter.
fn of_param(cx: Cx<'_>, name: &str, depth: &Cell<u32>) -> Option<Meaning> {
    let item = cx.file.entry(Section::Params, name)?;
    let default = item.value.as_ref()?.body()?.value("default")?;
    depth.set(depth.get() + 1);
    let found = of_value(cx, default, depth).map(|value| match (value, cx.file.head(item)) {
        (Value::Word(word), Some("Choice")) => Meaning::Choice(word, cx.file.options(name)),
        (value, _) => Meaning::Known(value),
    });
    depth.set(depth.get() - 1);
    found
}

/// Value of a literal, a reference to a parameter, or an expression.
pub(crate) fn of_value(cx: Cx<'_>, value: &Written, depth: &Cell<u32>) -> Option<Value> {
    match &value.shape {
        Shape::Number(number) => Some(Value::Number(*number)),
        Shape::Word => Some(match cx.file.at(&value.range) {
            "true" => Value::Bool(true),
            "false" => Value::Bool(false),
            word => Value::Word(word.to_owned()),
        }),
        Shape::Text(text) if text.starts_with('#') => Some(Value::Vector(parse_color(text)?.map(f64::from).to_vec())),
        Shape::Text(text) if text.starts_with(['$', '=']) => of_text(cx, text, depth),
        Shape::Text(text) => Some(Value::Word(text.clone())),
        Shape::Body(body) if body.bracket == b'(' => {
            let numbers = body.items.iter().map(|item| match item.value.as_ref()?.shape {
                Shape::Number(number) => Some(number),
                _ => None,
            });
            Some(Value::Vector(numbers.collect::<Option<_>>()?))
        }
        _ => None,
    }
}

struct InFile<'a, 'd> {
    cx: Cx<'a>,
    depth: &'d Cell<u32>,
}

impl InFile<'_, '_> {
    /// Value of a field of the canvas, or its default.
    fn canvas(&self, field: &str, default: Value) -> Value {
        let written = self.cx.file.body().and_then(|body| body.value("canvas")?.body()?.value(field));
        written.and_then(|value| of_value(self.cx, value, self.depth)).unwrap_or(default)
    }

    fn seed_number(&self) -> f64 {
        if let Value::Number(seed) = self.canvas("seed", Value::Number(0.0)) { seed } else { 0.0 }
    }
}

impl Names for InFile<'_, '_> {
    fn param(&mut self, name: &str) -> Meaning {
        of_param(self.cx, name, self.depth).unwrap_or(Meaning::Broken)
    }

    fn name(&mut self, name: &str) -> Option<Meaning> {
        let size = |index: usize| match self.canvas("size_mm", Value::Number(100.0)) {
            Value::Vector(size) => size.get(index).copied().unwrap_or(100.0),
            Value::Number(size) => size,
            _ => 100.0,
        };
        let number = match name {
            "canvas.width" => size(0),
            "canvas.height" => size(1),
            "canvas.seed" => self.seed_number(),
            _ => return None,
        };
        Some(Meaning::Known(Value::Number(number)))
    }

    fn all(&self) -> Vec<String> {
        Vec::new()
    }

    fn has_words(&self) -> bool {
        true
    }

    fn function(&mut self, name: &str) -> Option<Arc<UserFunction>> {
        functions::find(self.cx, name)?.compiled().map(Arc::new)
    }

    fn in_function(&mut self, name: &str) -> Option<Meaning> {
        self.name(name)
    }

    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a seed is a whole number")]
    fn seed(&mut self) -> Option<u64> {
        Some(self.seed_number() as u64)
    }
}
