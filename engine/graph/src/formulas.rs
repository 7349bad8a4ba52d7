//! Formulas of fields and solids: `height: "= waves * 0.16 + grain.dome"`.
//!
//! A formula is a node that the graph adds where the text stands. It reads the nodes that its names refer to. Its
//! program is compiled when the types of these nodes are known, so that errors of types are reported at their place in
//! the text.
use super::formula_names::{Functions, InFormula, InFunction};
use super::formula_text::{Formula, FormulaText};
use super::linker::{Entity, Flat, Linker, Port, Slot, Target};
use super::part::SyntaxValue;
use super::read::shorten;
use super::subst::{InParams, located};
use crate::diagnostics::{Code, Diagnostic};
use crate::expression::{self, Compiled, FIRST_INPUT, Fault, MOST_STEPS, Meaning, ON_CANVAS, PLACES, PlaneOf, Value};
use crate::node::Arg;
use crate::registry::Internal;
use crate::value::{Accepts, Type};
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// The name of the port, and of the kind in lists of nodes.
pub(super) const PORT: &str = "inputs";
pub(super) const KIND: &str = "Formula";

/// The kind of space that values are functions of.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Domain {
    Canvas,
    Space,
}

impl Linker<'_> {
    /// Checks the functions of the first scope; calls are checked where they stand. Those of a local graph are its file's.
    pub(super) fn check_functions(&mut self) {
        let docs = self.docs;
        let doc = &docs[self.scopes[0].doc];
        if doc.document.is_local {
            return;
        }
        self.enter(0);
        let mut first = BTreeMap::new();
        for decl in doc.document.functions.iter() {
            if let Some(span) = first.insert(decl.function.name.clone(), decl.key.span()) {
                let message = format!("function `{}` is given twice", decl.function.name);
                self.report.push(decl.key.error(Code::DuplicateKey, message).related(span, "it is given here first"));
            }
        }
        for decl in doc.document.functions.iter() {
            if self.cancel.is_cancelled() {
                return;
            }
            let mut names = InFunction {
                params: InParams::new(&self.scopes[0].params, self.report),
                functions: Functions::of(docs, self.scopes[0].doc),
            };
            let faults = expression::check_function(&decl.function, &mut names);
            let errors: Vec<_> = faults.iter().map(|fault| decl.fault(fault)).collect();
            errors.into_iter().for_each(|error| self.report.push(error));
        }
    }

    /// Returns true if a text is a formula that is computed for every point. A formula of parameters alone is one value
    /// instead.
    pub(super) fn is_formula(&mut self, scope: usize, part: &SyntaxValue) -> bool {
        let Some(text) = FormulaText::of(part) else { return false };
        let names = text.names();
        if names.is_empty() {
            return false;
        }
        // Words may be options of a choice: `$mode == Fast`.
        let may_be_words = names.iter().all(|name| !name.name.contains('.'));
        let known = may_be_words && {
            let mut params = InParams::new(&self.scopes[scope].params, self.report);
            expression::evaluate(&text.text, &mut params).is_ok()
        };
        !known
    }

    /// Adds the node of a formula; `name` is its name in the scope.
    pub(super) fn add_formula(&mut self, scope: usize, name: &str, part: &SyntaxValue) -> Entity {
        let Some(text) = FormulaText::of(part) else { return Entity::Broken };
        let name = format!("{}{name}", self.scopes[scope].prefix);
        let mut flat = Flat::new(scope, name, part.clone(), KIND.to_owned(), None, Cow::Borrowed(&[]));
        flat.formula = Some(Formula { text, values: Vec::new(), program: None, inner: false });
        Entity::Node(self.add_flat(flat))
    }

    /// Resolves the names of a formula.
    pub(super) fn resolve_formula(&mut self, flat: usize) {
        let scope = self.flats[flat].scope;
        let Some(formula) = &self.flats[flat].formula else { return };
        let text = formula.text.clone();
        let mut values: Vec<(String, usize)> = Vec::new();
        let mut seen = BTreeSet::new();
        let mut slots = Vec::new();
        for used in text.names() {
            let first = used.name.split('.').next().unwrap_or_default();
            if seen.contains(&used.name) || !self.scopes[scope].names.contains_key(first) {
                continue;
            }
            let place = text.place(&used.range);
            let (meaning, rest) = self.resolve_value(scope, &place, &used.name);
            let after = rest.and_then(|rest| rest.components).map_or(0, |components| components.len() + 1);
            let path = used.name[..used.name.len() - after].to_owned();
            seen.insert(used.name);
            if values.iter().all(|(known, _)| *known != path) {
                values.push((path, slots.len()));
                slots.push(Slot {
                    port: Port::Node(PORT.to_owned()),
                    wants: Accepts::EveryField,
                    part: place,
                    target: meaning.target,
                    declared: meaning.declared,
                });
            }
        }
        let node = &mut self.flats[flat];
        node.slots = slots;
        if let Some(formula) = &mut node.formula {
            formula.values = values;
        }
    }

    /// Compiles a formula; the types of its values are known.
    pub(super) fn type_formula(&mut self, flat: usize) {
        let node = &self.flats[flat];
        let Some(formula) = &node.formula else { return };
        let scope = node.scope;
        let mut problems = Vec::new();
        let mut meanings = BTreeMap::new();
        let mut domains = BTreeMap::new();
        for (path, slot) in &formula.values {
            let (meaning, domain) = self.meaning_of(&node.slots[*slot], path, FIRST_INPUT + 4 * slot);
            meanings.insert(path.clone(), meaning);
            domains.insert(path.clone(), domain);
        }
        let nodes = &self.scopes[scope].names;
        let mut names = InFormula {
            params: InParams::new(&self.scopes[scope].params, self.report),
            meanings,
            nodes,
            functions: Functions::of(self.docs, self.scopes[scope].doc),
        };
        let compiled = expression::compile(&formula.text.text, &mut names);
        drop(names);
        let text = formula.text.clone();
        let domain = match self.domain_of(&text, &domains) {
            Ok(domain) => domain,
            Err(error) => {
                problems.push(*error);
                Domain::Canvas
            }
        };
        let compiled = match compiled {
            Ok(compiled) => Some(compiled),
            Err(faults) => {
                problems.extend(faults.iter().map(|fault| self.fault(&text, scope, fault)));
                None
            }
        };
        let components = compiled.as_ref().and_then(Compiled::known_components);
        let ty = components.and_then(|components| type_of(components, domain));
        if let (Some(components), None, true) = (components, ty, problems.is_empty()) {
            let message = format!("a formula of solids makes one number or three; this makes {components}");
            problems.push(text.part.error(Code::TypeMismatch, message));
        }
        self.enter(scope);
        let node = &mut self.flats[flat];
        node.good &= problems.is_empty() && ty.is_some();
        node.outputs = match domain {
            Domain::Canvas => vec![ty],
            Domain::Space => vec![ty, ty.map(|_| Type::SolidVector)],
        };
        if let Some(formula) = &mut node.formula {
            formula.program = compiled.map(Arc::new);
        }
        problems.into_iter().for_each(|problem| self.report.push(problem));
    }

    /// The meaning of a value in a formula, and the space that it is a function of.
    fn meaning_of(&self, slot: &Slot, path: &str, first: usize) -> (Meaning, Option<Domain>) {
        let constant = |numbers: &[f32]| {
            let numbers: Vec<f64> = numbers.iter().copied().map(f64::from).collect();
            (Meaning::Known(if let [one] = numbers[..] { Value::Number(one) } else { Value::Vector(numbers) }), None)
        };
        if let Some(values) = self.constant_at(&slot.target) {
            return constant(&values);
        }
        let Some(ty) = self.field_type(&slot.target) else { return (Meaning::Any { first }, None) };
        let planes = |count, domain| (Meaning::Planes { first, count }, Some(domain));
        match ty {
            Type::Gray => planes(1, Domain::Canvas),
            Type::Vec2 => planes(2, Domain::Canvas),
            Type::Rgb | Type::Normal => planes(3, Domain::Canvas),
            Type::Jacobian => planes(4, Domain::Canvas),
            Type::Ids => (Meaning::Ids { plane: first }, Some(Domain::Canvas)),
            Type::Solid => planes(1, Domain::Space),
            Type::SolidColor | Type::SolidVector => planes(3, Domain::Space),
            Type::Material | Type::SolidMaterial => {
                let message = format!("`{}` is a material; a formula computes with its channels", shorten(path));
                (Meaning::Wrong(Code::TypeMismatch, message, Some(format!("write `{}.height`", shorten(path)))), None)
            }
            _ => {
                let message = format!("`{}` is {ty}; a formula computes with fields and solids", shorten(path));
                (Meaning::Wrong(Code::TypeMismatch, message, None), None)
            }
        }
    }

    /// The values of a literal, or of a formula of constants, also where inputs of graphs pass them on.
    fn constant_at(&self, target: &Target) -> Option<Vec<f32>> {
        let (mut target, mut spread, mut passed) = (target, false, 0);
        let mut values = loop {
            // Inputs that lead back to themselves have been reported.
            passed += 1;
            match target {
                _ if passed > self.flats.len() => return None,
                Target::Constant(field, _) => break field.as_constant()?.to_vec(),
                Target::Broken => return None,
                Target::Out { flat, .. } => {
                    let node = &self.flats[*flat];
                    if node.formula.is_some() {
                        break self.constant_formula(*flat)?;
                    }
                    let passes = node.info.is_none() && node.layout.is_none() && node.chooses.is_none();
                    let slot = node.slots.first().filter(|_| passes && node.channel.is_none())?;
                    spread |= slot.wants == Accepts::One(Type::Rgb);
                    target = &slot.target;
                }
            }
        };
        if let (true, [one]) = (spread, &values[..]) {
            values = vec![*one; 3];
        }
        Some(values)
    }

    /// Returns true for a literal and for a formula of constants.
    pub(super) fn is_constant(&self, target: &Target) -> bool {
        self.constant_at(target).is_some()
    }

    /// The value of a formula of constants.
    #[expect(clippy::cast_possible_truncation, reason = "fields hold f32")]
    fn constant_formula(&self, flat: usize) -> Option<Vec<f32>> {
        let program = self.flats[flat].formula.as_ref()?.program.as_ref()?;
        Some(match program.value()? {
            Value::Number(number) => vec![number as f32],
            Value::Bool(yes) => vec![f32::from(u8::from(yes))],
            Value::Vector(numbers) => numbers.iter().map(|number| *number as f32).collect(),
            Value::Word(_) => return None,
        })
    }

    /// The space that a formula is a function of; an error at the first name that does not fit.
    fn domain_of(
        &self,
        text: &FormulaText,
        domains: &BTreeMap<String, Option<Domain>>,
    ) -> Result<Domain, Box<Diagnostic>> {
        let mut first: Option<(Domain, String)> = None;
        for used in text.names() {
            let mut domain = match PLACES.iter().position(|place| *place == used.name) {
                Some(place) if place < ON_CANVAS => Some(Domain::Canvas),
                Some(_) => Some(Domain::Space),
                None => None,
            };
            // The longest known beginning of the path is the value.
            let mut path = used.name.as_str();
            loop {
                if let Some(known) = domains.get(path) {
                    domain = *known;
                    break;
                }
                let Some((before, _)) = path.rsplit_once('.') else {
                    path = &used.name;
                    break;
                };
                path = before;
            }
            match (&first, domain) {
                (None, Some(domain)) => first = Some((domain, path.to_owned())),
                (Some((of, other)), Some(domain)) if *of != domain => {
                    let (solid, field) = match domain {
                        Domain::Space => (path, other.as_str()),
                        Domain::Canvas => (other.as_str(), path),
                    };
                    let message = format!(
                        "`{}` is a solid and `{}` is a field; they do not go together",
                        shorten(solid),
                        shorten(field)
                    );
                    let help = format!("cut the solid first: `CutPlane(solid: \"{}\")`", shorten(solid));
                    return Err(Box::new(text.place(&used.range).error(Code::TypeMismatch, message).help(help)));
                }
                _ => {}
            }
        }
        Ok(first.map_or(Domain::Canvas, |(domain, _)| domain))
    }

    /// A fault of a formula at its place, which may lie in a function of the graph.
    fn fault(&self, text: &FormulaText, scope: usize, fault: &Fault) -> Diagnostic {
        let functions = Functions::of(self.docs, self.scopes[scope].doc);
        let function = fault.function.as_ref().and_then(|name| functions.find(name));
        match function {
            Some((_, function)) => function.fault(fault).related(text.part.span(), "it is called here"),
            None => located(&text.part, fault, text.offset.map(|offset| (offset, &fault.range))),
        }
    }

    /// Gives ports for solid vectors the output that has this type.
    pub(super) fn choose_vectors(&mut self) {
        let vectors: Vec<bool> = self
            .flats
            .iter()
            .map(|flat| flat.formula.is_some() && flat.outputs == [Some(Type::SolidColor), Some(Type::SolidVector)])
            .collect();
        for slot in self.flats.iter_mut().flat_map(|flat| &mut flat.slots) {
            if let (Accepts::One(Type::SolidVector), Target::Out { flat, output }) = (slot.wants, &mut slot.target)
                && vectors[*flat]
            {
                *output = 1;
            }
        }
    }

    /// Finds the formulas that one other formula alone reads.
    pub(super) fn find_inner_formulas(&mut self) {
        // The number of readers, with a large number for those that are no formulas.
        let mut readers: Vec<usize> = self.flats.iter().map(|flat| if flat.shown { 2 } else { 0 }).collect();
        for node in &self.flats {
            for slot in &node.slots {
                if let Target::Out { flat, .. } = slot.target {
                    readers[flat] += if node.formula.is_some() { 1 } else { 2 };
                }
            }
        }
        for (node, readers) in self.flats.iter_mut().zip(readers) {
            if let Some(formula) = &mut node.formula {
                formula.inner = readers == 1;
            }
        }
    }

    /// Builds the node of a formula from its program, and drops the values that the program does not need.
    pub(super) fn build_formula(&mut self, flat: usize) {
        let node = &self.flats[flat];
        let Some(formula) = node.formula.as_ref().filter(|_| node.good) else { return };
        let (Some(program), inner) = (formula.program.clone(), formula.inner) else { return };
        let role = if node.outputs.len() == 1 { Internal::Formula } else { Internal::SolidFormula };
        let planes = program.planes();
        let used: Vec<usize> =
            (0..node.slots.len()).filter(|slot| planes.iter().any(|plane| reads(*plane, *slot))).collect();
        let place = |plane: usize| match PlaneOf::number(plane) {
            PlaneOf::Channel { input, channel } => {
                FIRST_INPUT + 4 * used.iter().position(|slot| *slot == input).unwrap_or(0) + channel
            }
            PlaneOf::Place(_) => plane,
        };
        let Some(program) = program.fuse(&|_| None, &|_, plane| place(plane)) else {
            let message = format!("the formula has more than {MOST_STEPS} operations");
            let error = node.kind.error(Code::BadExpression, message);
            self.report.push(error.help("compute parts of it in nodes of their own"));
            return;
        };
        let text = super::ron_text::ron_string(&program.encode());
        let slots = (0_u32..).zip(&used).map(|(slot, _)| slot).collect();
        let inner = if inner { "true" } else { "false" };
        let args = [(PORT, Arg::Slots(slots)), ("program", Arg::Ron(&text)), ("inner", Arg::Ron(inner))];
        let built = self.registry.internal(role, &args);
        let node = &mut self.flats[flat];
        let mut slots: Vec<Option<Slot>> = std::mem::take(&mut node.slots).into_iter().map(Some).collect();
        node.slots = used.iter().filter_map(|slot| slots[*slot].take()).collect();
        match built {
            Some((kind, Ok(built))) => {
                node.kind_name = kind.to_owned();
                node.node = Some(built);
            }
            Some((_, Err(error))) => self.report.push(node.kind.error(Code::BadValue, error.message)),
            None => self.report.push(node.kind.error(Code::BadValue, "there is no node that computes formulas")),
        }
    }
}

/// The type of a value of so many components.
fn type_of(components: usize, domain: Domain) -> Option<Type> {
    Some(match (domain, components) {
        (Domain::Canvas, 1) => Type::Gray,
        (Domain::Canvas, 2) => Type::Vec2,
        (Domain::Canvas, 3) => Type::Rgb,
        (Domain::Canvas, _) => Type::Jacobian,
        (Domain::Space, 1) => Type::Solid,
        (Domain::Space, 3) => Type::SolidColor,
        (Domain::Space, _) => return None,
    })
}

/// Returns true if a plane is a channel of a slot.
fn reads(plane: usize, slot: usize) -> bool {
    matches!(PlaneOf::number(plane), PlaneOf::Channel { input, .. } if input == slot)
}
