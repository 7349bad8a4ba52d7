//! Values at ports: references and literals, and the resolution of references.
use super::color_names::color_meant;
use super::linker::{Bound, Entity, Linker, Port, Slot, Target};
use super::part::{Shape, SyntaxValue};
use super::read::{self, shorten};
use super::subst::substitute;
use crate::diagnostics::{Code, Diagnostic, did_you_mean};
use crate::node::{Output, PortInfo, parse_color};
use crate::value::{Accepts, Field, Type};
use std::collections::BTreeSet;

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
        (Accepts::One(Type::Gray) | Accepts::Direction | Accepts::Field | Accepts::EveryField, 1) => Type::Gray,
        (Accepts::One(Type::Rgb), 1 | 3) | (Accepts::Field | Accepts::EveryField, 3) => Type::Rgb,
        (Accepts::One(Type::Vec2) | Accepts::EveryField, 2) => Type::Vec2,
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
    matches!(accepts, Accepts::One(Type::Rgb) | Accepts::Field | Accepts::EveryField)
}

fn how_to_write(accepts: Accepts) -> &'static str {
    match accepts {
        Accepts::One(Type::Gray) => "write a number, or the name of a node, \"node\" or \"node.port\"",
        Accepts::One(Type::Rgb) | Accepts::Field | Accepts::EveryField => {
            "write a number, a colour \"#rrggbb\" or (r, g, b), or the name of a node"
        }
        Accepts::Direction => "write degrees, or the name of a node that makes them or vectors",
        Accepts::One(Type::Vec2) => "write a pair of numbers, or the name of a node",
        _ => "write the name of a node, \"node\" or \"node.port\"",
    }
}

/// The resolved meaning of a reference.
pub(super) struct Meaning {
    pub(super) target: Target,
    pub(super) declared: Option<Accepts>,
}

impl Linker<'_> {
    /// Resolves `name`, written at `part` in `scope`. Errors of the name itself are reported here, others at their own
    /// places.
    pub(super) fn resolve(&mut self, scope: usize, part: &SyntaxValue, name: &str) -> Meaning {
        let mut passed = Vec::new();
        let target = self.follow((scope, part.clone(), name.to_owned()), &mut passed);
        // Cache the targets of inputs, since many references may lead through the same inputs.
        for (scope, input) in passed {
            self.scopes[scope].resolved[input] = Some(target.clone());
        }
        let declared = match self.scopes[scope].names.get(name) {
            Some(Entity::Input(index)) => self.docs[self.scopes[scope].doc].document.inputs[*index].ty,
            _ => None,
        };
        Meaning { declared: declared.filter(|_| !matches!(target, Target::Broken)), target }
    }

    /// Follows names until it reaches a node or a literal; adds the inputs on the way to `passed`.
    fn follow(&mut self, mut at: (usize, SyntaxValue, String), passed: &mut Vec<(usize, usize)>) -> Target {
        let mut seen = BTreeSet::new();
        loop {
            let (scope, part, name) = &at;
            let first = seen.is_empty();
            let (node, port) = name.split_once('.').map_or((name.as_str(), None), |(node, port)| (node, Some(port)));
            let inline = self.inlines.get(&(*scope, part.span())).copied();
            let (port, named) = (port.filter(|_| inline.is_none()), self.scopes[*scope].names.get(node).copied());
            let entity = inline.or(named);
            if !seen.insert((*scope, name.clone())) {
                let message = format!("`{}` leads back to itself", shorten(name));
                self.report.push(part.error(Code::Cycle, message));
                return Target::Broken;
            }
            let found = match entity {
                None => Err(self.unknown_node(*scope, part, node)),
                Some(Entity::Broken) => return Target::Broken,
                Some(Entity::Node(flat)) => self.output_of(flat, part, node, port).map(|output| {
                    let renamed =
                        port.filter(|_| first).and_then(|port| self.renamed(flat, output, part, (node, port)));
                    renamed.into_iter().for_each(|warning| self.report.push(warning));
                    Next::Found(Target::Out { flat, output })
                }),
                Some(Entity::Use(child)) => match self.output_of_use(child, part, node, port) {
                    Ok(Next::Go((inner, from, name))) => Ok(match self.laid_out(child, port, &from) {
                        Some(flat) => Next::Found(Target::Out { flat, output: 0 }),
                        None => Next::Go((inner, from, name)),
                    }),
                    other => other,
                },
                Some(Entity::Each(chooser)) => match self.choosers[chooser].children.first().copied() {
                    // All instances have the same output names.
                    Some(child) => {
                        self.output_of_use(child, part, node, port).map(|_| match self.chosen(chooser, port) {
                            Some(flat) => Next::Found(Target::Out { flat, output: 0 }),
                            None => Next::Found(Target::Broken),
                        })
                    }
                    None => return Target::Broken,
                },
                Some(Entity::Input(index)) => {
                    let found = self.input_of(*scope, index, part, node, port);
                    if found.is_ok() {
                        passed.push((*scope, index));
                    }
                    found
                }
            };
            match found {
                Ok(Next::Found(target)) => return target,
                Ok(Next::Go(next)) => at = next,
                Err(error) => {
                    if first {
                        self.report.push(*error);
                    }
                    return Target::Broken;
                }
            }
        }
    }

    fn unknown_node(&self, scope: usize, part: &SyntaxValue, node: &str) -> Box<Diagnostic> {
        let names = self.scopes[scope].names.keys().map(String::as_str);
        let error = part.error(Code::UnknownNode, format!("there is no node `{}`", shorten(node)));
        Box::new(self.report.with_suggestion(error, node, "node", names))
    }

    fn output_of(
        &self,
        flat: usize,
        part: &SyntaxValue,
        node: &str,
        port: Option<&str>,
    ) -> Result<usize, Box<Diagnostic>> {
        let outputs = self.flats[flat].info.map_or(&[][..], |info| info.outputs);
        let Some(port) = port else { return Ok(0) };
        Output::position(outputs, port).ok_or_else(|| {
            let names = outputs.iter().map(|output| output.name);
            self.unknown_port(part, node, port, names)
        })
    }

    /// The warning for a reference to an old name of an output.
    fn renamed(
        &self,
        flat: usize,
        output: usize,
        part: &SyntaxValue,
        (node, port): (&str, &str),
    ) -> Option<Diagnostic> {
        let info = self.flats[flat].info?;
        let now = info.outputs.get(output).map(|output| output.name).filter(|now| *now != port)?;
        let message = format!("the output `{port}` of `{}` is called `{now}` now", info.kind);
        let written = format!("write `\"{node}.{now}\"`");
        Some(part.error(Code::Advice, message).help(written).as_warning())
    }

    fn output_of_use(
        &self,
        child: usize,
        part: &SyntaxValue,
        node: &str,
        port: Option<&str>,
    ) -> Result<Next, Box<Diagnostic>> {
        let document = &self.docs[self.scopes[child].doc].document;
        let found = match port {
            Some(port) => document.output(port),
            None => document.outputs.first(),
        };
        let output = found.ok_or_else(|| {
            let names = document.outputs.iter().map(|output| output.name.as_str());
            self.unknown_port(part, node, port.unwrap_or("…"), names)
        })?;
        Ok(match output.from.as_ref().map(|from| (from, from.shape())) {
            Some((from, Shape::Text(name))) => Next::Go((child, from.clone(), name)),
            _ => Next::Found(Target::Broken),
        })
    }

    fn unknown_port<'n>(
        &self,
        part: &SyntaxValue,
        node: &str,
        port: &str,
        names: impl IntoIterator<Item = &'n str>,
    ) -> Box<Diagnostic> {
        let message = format!("`{}` has no output `{}`", shorten(node), shorten(port));
        Box::new(self.report.with_suggestion(part.error(Code::UnknownPort, message), port, "output", names))
    }

    fn input_of(
        &self,
        scope: usize,
        index: usize,
        part: &SyntaxValue,
        node: &str,
        port: Option<&str>,
    ) -> Result<Next, Box<Diagnostic>> {
        if let Some(port) = port {
            let message = format!("`{node}` is an input of the graph; it has no output `{}`", shorten(port));
            return Err(Box::new(part.error(Code::UnknownPort, message).help(format!("write \"{node}\""))));
        }
        if let Some(known) = &self.scopes[scope].resolved[index] {
            return Ok(Next::Found(known.clone()));
        }
        Ok(match &self.scopes[scope].inputs[index] {
            Bound::Constant(field, part) => Next::Found(Target::Constant(field.clone(), part.clone())),
            Bound::Pass(flat) => Next::Found(Target::Out { flat: *flat, output: 0 }),
            Bound::Wire { scope, part, name } => Next::Go((*scope, part.clone(), name.clone())),
            Bound::Broken => Next::Found(Target::Broken),
        })
    }

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
            if self.is_node(&item) {
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
        if matches!(slot.target, Target::Broken) || ty.fits(slot.wants) {
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

enum Next {
    Found(Target),
    Go((usize, SyntaxValue, String)),
}
