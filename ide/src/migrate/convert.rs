//! Turns a node that is replaced into the formulas of its outputs.
use super::formula::Formula;
use super::kinds::Rewrite;
use super::numbers::{apart, seeded};
use super::operands::{Call, Converter, Problem};
use super::places::Old;
use super::scope::{formula_of, text_of};
use super::terms::{call, instance};
use super::words::{Base, Name, Word};
use shibo_graph::syntax::{Node, NodeKind};
use shibo_value::{Channel, Type};
use std::collections::HashMap;

/// The most words that operands may have where a formula repeats them.
const MOST_REPEATED: usize = 4096;

/// Converts a node; its operands that are replaced as well were converted before.
pub(super) fn convert<'t>(converter: &mut Converter<'_, 't>, old: &Old<'t>) -> Result<(), Problem> {
    let mut call = Call { maker: converter, old, hoisted: Vec::new(), warnings: Vec::new() };
    let outputs = call.outputs()?;
    let (hoisted, warnings) = (call.hoisted, call.warnings);
    converter.taken.extend(hoisted.iter().map(|one| one.name.clone()));
    converter.warnings.extend(warnings);
    converter.hoisted.insert(old.node.index(), hoisted);
    converter.made.insert(old.node.index(), outputs);
    Ok(())
}

impl<'t> Call<'_, '_, 't> {
    fn outputs(&mut self) -> Result<Vec<Formula>, Problem> {
        if !self.removed().is_formula() {
            return Ok(Vec::new());
        }
        self.check_fields()?;
        Ok(match &self.removed().rewrite {
            Rewrite::Operation(table) => {
                let operation = self.word_of("operation")?;
                let found = table.iter().find(|(name, _)| operation.is_none_or(|wanted| *name == wanted));
                let Some((_, template)) = found else {
                    return self.fail(format!("there is no operation `{}`", operation.unwrap_or_default()));
                };
                vec![self.instance(template)?]
            }
            Rewrite::Formula(table) => {
                let given = |operand: &str| self.field(operand).is_some();
                let found = table.iter().find(|(operand, _)| operand.is_none_or(given));
                vec![self.instance(found.map_or("0", |(_, template)| template))?]
            }
            Rewrite::Expression => vec![self.expression()?],
            Rewrite::Channel => self.channel()?,
            Rewrite::Split => self.split()?,
            Rewrite::Constant => {
                let value = self.required("value")?;
                let color = self.operand("color")?.unwrap_or_else(|| value.clone());
                vec![value, color]
            }
            Rewrite::Kind { .. } => Vec::new(),
        })
    }

    fn check_fields(&self) -> Result<(), Problem> {
        let removed = self.removed();
        for child in self.old.node.body().into_iter().flat_map(Node::children) {
            let key = child.key_text().unwrap_or_default();
            let known = removed.operands.iter().any(|operand| operand.fields.contains(&key.as_str()));
            if !(known || removed.fields.contains(&key.as_str()) || key == "note") {
                return Err(Problem::new(child.range(), format!("`{}` has no field `{key}`", removed.kind)));
            }
        }
        Ok(())
    }

    /// The word of a field that is a choice.
    fn word_of(&self, field: &str) -> Result<Option<&'t str>, Problem> {
        let Some(value) = self.field(field) else { return Ok(None) };
        match value.kind() {
            NodeKind::Word => Ok(value.name()),
            _ => Err(Problem::new(value.range(), format!("`{field}` is not a word, so the formula is not known"))),
        }
    }

    /// The formula of an operation with the operands that it names.
    fn instance(&mut self, template: &str) -> Result<Formula, Problem> {
        let Ok(template) = Formula::read(template) else { return self.fail("its formula cannot be read") };
        let mut operands: HashMap<String, Formula> = HashMap::new();
        let names =
            template.names().filter_map(|name| if let Base::Text(text) = &name.base { Some(text) } else { None });
        for name in names {
            if !operands.contains_key(name) {
                let operand = self.required(name)?;
                operands.insert(name.clone(), operand);
            }
        }
        self.check_length(&template, &operands)?;
        let zero = Formula::number("0");
        let made = instance(&template, &|name| operands.get(name).unwrap_or(&zero).clone());
        made.map_or_else(|| self.fail("an operand has local names"), Ok)
    }

    /// Refuses a formula that repeats long operands.
    fn check_length(&self, formula: &Formula, operands: &HashMap<String, Formula>) -> Result<(), Problem> {
        let mut uses: HashMap<&str, usize> = HashMap::new();
        for name in formula.names() {
            if let Base::Text(text) = &name.base {
                *uses.entry(text.split('.').next().unwrap_or(text)).or_default() += 1;
            }
        }
        let repeated = |(name, operand): (&String, &Formula)| {
            let uses = uses.get(name.as_str()).copied().unwrap_or(0);
            if uses > 1 && !operand.is_atom() { uses.saturating_mul(operand.words.len()) } else { 0 }
        };
        if operands.iter().map(repeated).fold(0, usize::saturating_add) > MOST_REPEATED {
            return self.fail("an operand that the formula repeats is too long; give it a name first");
        }
        Ok(())
    }

    fn channel(&mut self) -> Result<Vec<Formula>, Problem> {
        let word = self.word_of("channel")?.unwrap_or("Height");
        let Some(channel) = Channel::ALL.iter().find(|channel| format!("{channel:?}") == word) else {
            return self.fail(format!("there is no channel `{word}`"));
        };
        let material = self.required("material")?;
        let [Word::Name(name)] = &material.words[..] else { return self.fail("`material` is not the name of a node") };
        if let Base::Text(path) = &name.base
            && !path.contains('.')
            && matches!(self.maker.scope.kind_of(path), Some("Use" | "Each"))
        {
            let message = format!(
                "`{path}.{0}` is the output `{0}` of that graph if it has one; write `{path}.material.{0}` then",
                channel.name()
            );
            self.warnings.push(Problem::new(self.word(), message));
        }
        let path = self.part(material.clone(), channel.name());
        let number = channel.ty().channels() == 1;
        let value = if number { path.clone() } else { call("luminance", vec![path.clone()]) };
        Ok(vec![value, path])
    }

    fn split(&mut self) -> Result<Vec<Formula>, Problem> {
        let input = self.required("input")?;
        let ty = match &input.words[..] {
            [Word::Name(Name { base: Base::Text(path), .. })] => self.maker.scope.type_of(path, self.maker.registry),
            [Word::Name(_)] => self.field("input").and_then(|value| self.type_of_call(value)),
            _ => Some(Type::Rgb),
        };
        if ty.is_some_and(|ty| ty.channels() == 1) {
            return self.fail("`input` is a single number, which has no components");
        }
        if ty.is_none() {
            let message =
                "the type of `input` is not known here; if it is a normal, `x`, `y` and `z` are `2 * n.x - 1` …";
            self.warnings.push(Problem::new(self.word(), message));
        }
        let part = |letter: &str| self.part(input.clone(), letter);
        let none = || Formula::number("0");
        Ok(match ty {
            Some(Type::Vec2) => vec![part("x"), part("y"), none(), part("x"), part("y"), none()],
            Some(Type::Normal) => {
                let Ok(template) = Formula::read("2 * n - 1") else { return self.fail("its formula cannot be read") };
                let decoded = |letter: &str| template.replaced(&mut |_| Some(part(letter)));
                vec![decoded("x"), decoded("y"), decoded("z"), part("r"), part("g"), part("b")]
            }
            _ => ["x", "y", "z", "r", "g", "b"].map(part).into(),
        })
    }

    fn type_of_call(&self, value: Node<'t>) -> Option<Type> {
        let info = self.maker.registry.info(value.name()?)?;
        match info.outputs.first()?.ty {
            shibo_node::OutputType::Fixed(ty) => Some(ty),
            _ => None,
        }
    }

    /// The formula of an `Expression`, with the connected values in place of its names.
    fn expression(&mut self) -> Result<Formula, Problem> {
        let Some(value) = self.field("formula") else { return self.fail("`formula` is not given") };
        let wrong = || Problem::new(value.range(), "`formula` is not a text");
        let text = text_of(value).ok_or_else(wrong)?;
        let start = text.len() - text.trim_start().len();
        let before = if formula_of(&text[start..]).is_some() { start + 1 } else { 0 };
        let mut formula = Formula::read(&text[before..]).map_err(|fault| self.in_text(value, &fault, before))?;
        if let Some(seed) = self.field("seed") {
            let seed = self.value(seed)?;
            if seed.literal() != Some(0.0) {
                let (words, random) = seeded(&formula.words, &seed.words);
                formula = Formula { words };
                if random {
                    let message = "`random`, `hash` and `noise` give other numbers than those of `seed`";
                    self.warnings.push(Problem::new(value.range(), message));
                }
            }
        }
        let mut ports: HashMap<String, Formula> = HashMap::new();
        for name in ["a", "b", "c", "d"] {
            if let Some(port) = self.field(name) {
                ports.insert(name.to_owned(), self.value(port)?);
            }
        }
        let is_ids = |name: &str| match ports.get(name).map(|port| &port.words[..]) {
            Some([Word::Name(Name { base: Base::Text(path), .. })]) => {
                self.maker.scope.type_of(path, self.maker.registry) == Some(Type::Ids)
            }
            _ => false,
        };
        match apart(&formula.words, &is_ids) {
            Ok((words, false)) => formula = Formula { words },
            Ok((words, true)) => {
                formula = Formula { words };
                let message = "numbers of pieces are only compared or hashed: `random(ids + n)` became `hash(ids, n)`, \
                               which gives other numbers";
                self.warnings.push(Problem::new(value.range(), message));
            }
            Err(name) => {
                let message = format!("`{name}` has numbers of pieces; use `random({name})` in the formula first");
                return Err(Problem::new(value.range(), message));
            }
        }
        self.check_length(&formula, &ports)?;
        self.names(&formula, value, &mut |name| match (ports.get(name), name) {
            (Some(port), _) => Ok(Some(port.clone())),
            (None, "a" | "b" | "c" | "d") => Err(Problem::new(value.range(), format!("`{name}` is not connected"))),
            (None, _) => Ok(None),
        })
    }
}
