//! Values at ports: references and literals, and checks of their types and bounds.
use super::color_names::color_meant;
use super::linker::{Linker, Port, Slot, Target};
use super::part::{Shape, SyntaxValue};
use super::read::{self, shorten};
use super::subst::substitute;
use crate::diagnostics::{Code, Diagnostic, did_you_mean};
use crate::node::{PortInfo, parse_color};
use crate::value::{Accepts, Field, Type};

/// The value written at a port.
pub(super) enum Literal {
    /// A number, a colour or a vector.
    Constant(Field),
    /// The name of a node or of a node's output.
    Reference(String),
}

/// Reads the value at `port`, which takes `accepts`; `is_text` if the value comes from a text parameter.
pub(super) fn literal(
    part: &SyntaxValue,
    accepts: Accepts,
    port: &Port,
    is_text: bool,
) -> Result<Literal, Box<Diagnostic>> {
    let wrong = |found: &str| {
        let message = format!("{port} takes {accepts}; found {found} `{}`", shorten(part.str()));
        let help = read::without_b(part).unwrap_or_else(|| how_to_write(accepts).to_owned());
        Box::new(part.error(Code::TypeMismatch, message).help(help))
    };
    let colour = takes_colors(accepts);
    let values = match part.shape() {
        Shape::Text(_) if is_text => return Err(wrong("a parameter that is a text")),
        Shape::Text(text) if text.starts_with('#') => match parse_color(&text) {
            Some(rgb) if colour => return Ok(Literal::Constant(Field::constant(Type::Rgb, &rgb))),
            Some(_) => return Err(wrong("a colour")),
            None => return Err(wrong("what is not a colour")),
        },
        Shape::Text(text) => return Ok(Literal::Reference(text)),
        Shape::Number(value) => vec![(part.clone(), value)],
        Shape::Tuple(items) => {
            let numbers = items.into_iter().map(|item| match item.shape() {
                Shape::Number(value) => Some((item, value)),
                _ => None,
            });
            numbers.collect::<Option<Vec<_>>>().ok_or_else(|| wrong("values in brackets"))?
        }
        shape => return Err(wrong(shape.describe())),
    };
    let constant = match (accepts, values.len()) {
        (_, 1) if accepts.solid_of(Type::Gray).is_some() => Type::Gray,
        (_, 3) if accepts.solid_of(Type::Rgb).is_some() => Type::Rgb,
        (Accepts::One(Type::Rgb) | Accepts::Color, 1 | 3) => Type::Rgb,
        (accepts, 1) if Type::Gray.fits(accepts) => Type::Gray,
        (accepts, 3) if takes_colors(accepts) => Type::Rgb,
        (Accepts::One(Type::Vec2) | Accepts::EveryField | Accepts::EveryFieldOrSolid | Accepts::FieldOrMaterial, 2) => {
            Type::Vec2
        }
        (Accepts::One(Type::Jacobian), 4) => Type::Jacobian,
        (_, 1) => return Err(wrong("a number")),
        _ => return Err(wrong("values in brackets")),
    };
    let mut numbers = [0.0_f32; 4];
    for (slot, (item, value)) in numbers.iter_mut().zip(&values) {
        *slot = narrow(*value);
        if !slot.is_finite() {
            return Err(Box::new(read::not_finite(item, &port.to_string())));
        }
    }
    let numbers = if values.len() == 1 { [numbers[0]; 4] } else { numbers };
    Ok(Literal::Constant(Field::constant(constant, &numbers[..constant.channels()])))
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "fields hold f32; what does not fit becomes infinite and is refused"
)]
fn narrow(value: f64) -> f32 {
    value as f32
}

/// Returns true if a colour may be written in place of a wire.
fn takes_colors(accepts: Accepts) -> bool {
    let several = matches!(accepts, Accepts::One(Type::Rgb) | Accepts::Color) || Accepts::Field.fits(accepts);
    several || accepts.solid_of(Type::Rgb).is_some()
}

fn how_to_write(accepts: Accepts) -> &'static str {
    match accepts {
        Accepts::One(Type::Gray) => "write a number, or the name of a node, \"node\" or \"node.port\"",
        accepts if takes_colors(accepts) => "write a number, a colour \"#rrggbb\" or (r, g, b), or the name of a node",
        Accepts::Direction => "write degrees, or the name of a node that makes them or vectors",
        Accepts::One(Type::Vec2) => "write a pair of numbers, or the name of a node",
        Accepts::One(Type::Solid) | Accepts::Number => "write a number, or the name of a node",
        _ => "write the name of a node, \"node\" or \"node.port\"",
    }
}

impl Linker<'_> {
    /// Reads the values at a port into slots; `None` after an error.
    pub(super) fn read_port(
        &mut self,
        flat: usize,
        name: &str,
        port: &PortInfo,
        value: &SyntaxValue,
    ) -> Option<Vec<Slot>> {
        let scope = self.flats[flat].scope;
        let items = match (port.list, value.shape()) {
            (true, Shape::List(items)) => items,
            (true, _) => {
                let message = format!("`{name}` takes a list of {}; found `{}`", port.ty, shorten(value.str()));
                let help = format!("write `{name}: [{}]`", shorten(value.str()));
                self.report.push(value.error(Code::TypeMismatch, message).help(help));
                return None;
            }
            (false, _) => vec![value.clone()],
        };
        let takes = Port::Node(name.to_owned());
        let mut slots = Vec::with_capacity(items.len());
        let mut good = true;
        for (index, item) in (1..).zip(items) {
            let slot = |part: &SyntaxValue, target, declared| {
                let (port, wants, part) = (takes.clone(), port.ty, part.clone());
                Slot { port, wants, part, target, declared }
            };
            // Parameters inside an inline node are substituted when that node is read.
            if self.is_node(scope, &item) {
                let place = if port.list { format!("{name}.{index}") } else { name.to_owned() };
                let inner = format!("{}.{place}", self.local_name(flat));
                self.add_inline(scope, &inner, &item);
                let meaning = self.resolve(scope, &item, &inner);
                slots.push(slot(&item, meaning.target, meaning.declared));
                continue;
            }
            let Some(value) = substitute(&item, &self.scopes[scope].params, self.report) else {
                good = false;
                continue;
            };
            let part = value.part;
            let slot = |target, declared| slot(&part, target, declared);
            match literal(&part, port.ty, &takes, value.is_text) {
                Ok(Literal::Constant(field)) => slots.push(slot(Target::Constant(field, part.clone()), None)),
                Ok(Literal::Reference(reference)) if self.is_color_name(scope, &reference, port.ty) => {
                    let message = format!("there is no node `{}`, and colours have no names", shorten(&reference));
                    let help = color_meant(&reference).map(|meant| format!("write `\"{meant}\"`"));
                    self.report.push(part.error(Code::UnknownNode, message).help(help.unwrap_or_default()));
                    good = false;
                }
                Ok(Literal::Reference(reference)) => {
                    let meaning = self.resolve(scope, &part, &reference);
                    slots.push(slot(meaning.target, meaning.declared));
                }
                Err(error) => {
                    self.report.push(*error);
                    good = false;
                }
            }
        }
        good.then_some(slots)
    }

    /// Returns true if a text means a colour: colours are accepted, and no node has that name or a similar one.
    fn is_color_name(&self, scope: usize, text: &str, accepts: Accepts) -> bool {
        let names = &self.scopes[scope].names;
        takes_colors(accepts)
            && !names.contains_key(text)
            && color_meant(text).is_some()
            && self.report.may_compare(names.len())
            && did_you_mean(text, names.keys().map(String::as_str)).is_none()
    }

    /// The type of a slot's value; `None` if an error hides it.
    pub(super) fn type_of(&self, target: &Target) -> Option<Type> {
        match target {
            Target::Constant(field, _) => Some(field.ty()),
            Target::Out { flat, output } => self.flats[*flat].outputs.get(*output).copied().flatten(),
            Target::Broken => None,
        }
    }

    /// The error for a wire in `scope` that does not fit its port. `kind` is the kind of the node, if the port belongs
    /// to a node.
    pub(super) fn check_type(&self, scope: usize, slot: &Slot, kind: Option<&str>) -> Option<Diagnostic> {
        let ty = slot.declared.or_else(|| self.type_of(&slot.target).map(Accepts::One))?;
        let as_solid = || ty.only().and_then(|ty| slot.wants.solid_of(ty)).is_some() && self.is_constant(&slot.target);
        if matches!(slot.target, Target::Broken) || ty.fits(slot.wants) || as_solid() {
            return None;
        }
        let written = shorten(slot.part.str());
        let message = format!("{} takes {}; {written} is {ty}", slot.port, slot.wants);
        let error = slot.part.error(Code::TypeMismatch, message);
        Some(match self.remedy(scope, slot, ty, kind) {
            Some(help) => error.help(help),
            None => error,
        })
    }
}

impl Linker<'_> {
    /// Reports numbers in place of wires that are outside the bounds of their ports, including numbers passed through
    /// inputs of the graph.
    pub(super) fn check_bounds(&mut self, flat: usize) {
        let node = &self.flats[flat];
        let Some(info) = node.info else { return };
        let wrong = |slot: &Slot| {
            let (Port::Node(name), Target::Constant(field, part)) = (&slot.port, &slot.target) else { return None };
            let bounds = &info.port(name)?.bounds;
            let values = field.as_constant()?;
            let (index, value) = values.iter().enumerate().find(|(_, value)| !bounds.admit(f64::from(**value)))?;
            let place = match part.shape() {
                Shape::Tuple(items) => items.get(index).cloned(),
                _ => None,
            };
            let place = place.unwrap_or_else(|| part.clone());
            let written = match place.shape() {
                Shape::Number(_) => shorten(place.str()),
                _ => value.to_string(),
            };
            let name = name.rsplit('.').next().unwrap_or(name);
            let error = place.error(Code::OutOfRange, format!("{name} is `{written}`; it must be {bounds}"));
            let here = slot.part.span();
            Some(if part.span() == here { (place, error) } else { (place, error.related(here, "it is taken here")) })
        };
        let errors: Vec<_> = node.slots.iter().filter_map(wrong).collect();
        if errors.is_empty() {
            return;
        }
        self.enter(self.flats[flat].scope);
        self.flats[flat].good = false;
        errors.into_iter().for_each(|(place, error)| self.report.push_value(&place, error));
    }
}
