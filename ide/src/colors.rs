//! Colour swatches of a file, and the text of a picked colour.
use super::expect::Expect;
use super::file::Section;
use super::view::{Item, Shape, Value};
use super::walk::{Visit, walk};
use super::world::Cx;
use shibo_node::{ParamType, parse_color};
use shibo_value::{Accepts, Type, linear_to_srgb, srgb_to_linear};
use std::ops::Range;

/// A colour in a file: its range and its sRGB components.
pub type Swatch = (Range<usize>, [f32; 3]);

/// All colours of a file.
pub fn swatches(cx: Cx<'_>) -> Vec<Swatch> {
    let mut found = Vec::new();
    for file in cx.file.scopes() {
        let mut colors = Colors { cx: cx.with(&file), found: Vec::new() };
        walk(colors.cx, &mut colors);
        found.extend(colors.found);
    }
    found
}

/// Formats a colour in the notation used at `range`.
pub fn written(cx: Cx<'_>, range: &Range<usize>, srgb: [f32; 3]) -> String {
    let srgb = srgb.map(|v| v.clamp(0.0, 1.0));
    if cx.file.at(range).starts_with('(') {
        let numbers = srgb.map(|v| significant(srgb_to_linear(v)));
        return format!("({})", numbers.join(", "));
    }
    let bytes = srgb.map(|v| format!("{:02x}", byte(v)));
    format!("\"#{}\"", bytes.concat())
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to a byte")]
fn byte(v: f32) -> u8 {
    (v * 255.0).round() as u8
}

/// Formats a number with four significant digits.
fn significant(v: f32) -> String {
    if v == 0.0 {
        return "0.0".to_owned();
    }
    // Each zero after the point adds one digit.
    let zeros = (1..6).take_while(|n| v.abs() < 0.1_f32.powi(*n)).count();
    let text = format!("{v:.*}", 4 + zeros - usize::from(v.abs() >= 1.0));
    let short = text.trim_end_matches('0');
    if short.ends_with('.') { format!("{short}0") } else { short.to_owned() }
}

struct Colors<'a> {
    cx: Cx<'a>,
    found: Vec<Swatch>,
}

impl<'a> Visit<'a> for Colors<'a> {
    fn key(&mut self, _inside: Expect<'a>, _item: &'a Item) {}

    fn value(&mut self, expect: Expect<'a>, value: &'a Value) {
        match &value.shape {
            Shape::Text(text) if text.starts_with('#') && !matches!(expect, Expect::Note) => {
                if let Some(linear) = parse_color(text) {
                    self.found.push((value.range.clone(), linear.map(linear_to_srgb)));
                }
            }
            Shape::Body(body) if body.bracket == b'(' && body.items.len() == 3 && takes_color(self.cx, expect) => {
                let number = |item: &Item| match item.value.as_ref()?.shape {
                    #[expect(clippy::cast_possible_truncation, reason = "a colour")]
                    Shape::Number(number) if item.key.is_none() => Some(number as f32),
                    _ => None,
                };
                let numbers: Option<Vec<f32>> = body.items.iter().map(number).collect();
                if let Some([r, g, b]) = numbers.as_deref() {
                    let srgb = [*r, *g, *b].map(|v| linear_to_srgb(v.max(0.0)).clamp(0.0, 1.0));
                    self.found.push((value.range.clone(), srgb));
                }
            }
            _ => {}
        }
    }
}

/// Returns whether three numbers are a colour here.
fn takes_color(cx: Cx<'_>, expect: Expect<'_>) -> bool {
    match expect {
        Expect::Port(_, port, _) => {
            matches!(port.ty, Accepts::One(Type::Rgb) | Accepts::Color) || Accepts::Field.fits(port.ty)
        }
        Expect::Value(_, param) => param.ty == ParamType::Color,
        Expect::Param("Color", Some("default")) | Expect::Input("Rgb", Some("default")) => true,
        Expect::Preset(name) => cx.file.entry(Section::Params, name).is_some_and(|i| cx.file.head(i) == Some("Color")),
        Expect::With(import, Some(name)) => cx.imported(import).is_some_and(|file| {
            let item = file.entry(Section::Params, name).or_else(|| file.entry(Section::Inputs, name));
            item.is_some_and(|item| matches!(file.head(item), Some("Color" | "Rgb")))
        }),
        _ => false,
    }
}
