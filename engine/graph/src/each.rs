//! `Each`: several instances of a sub-graph, one of which is visible at each pixel.
use super::instance::Spread;
use super::linker::{Chooser, Entity, Flat, Linker, Port, Slot, Target};
use super::params::ParamValue;
use super::part::{Entry, Shape, SyntaxValue};
use super::ports::{self, Literal};
use super::read::{self, mismatch, shorten};
use super::subst::substitute;
use crate::GraphUse;
use crate::diagnostics::Code;
use crate::expression::{Meaning, Value as Number};
use crate::node::{Arg, DynNode};
use crate::registry::{Internal, Registry};
use crate::value::{Accepts, Type};
use petgraph::graph::NodeIndex;
use std::borrow::Cow;
use std::sync::Arc;

/// The word used in graph files.
pub(super) const KIND: &str = "Each";
/// The most instances of one `Each`.
pub(super) const MOST: usize = 64;
/// The parameter that receives the number of an instance.
pub(super) const INDEX: &str = "index";

/// The value of the parameter `index`.
fn number_value(index: usize, kind: &SyntaxValue) -> ParamValue {
    let (text, meaning) = (index.to_string(), Some(Meaning::Known(Number::Number(index as f64))));
    ParamValue { text, meaning, is_text: false, span: kind.span(), outside: false, base: None }
}

/// The node that selects one of several values of a type, and its kind.
pub(super) fn node(registry: &Registry, ty: Type, slots: usize) -> Option<(String, Arc<dyn DynNode>)> {
    let inputs = (1..u32::try_from(slots).ok()?).collect();
    let args = [("ids", Arg::Slot(0)), ("inputs", Arg::Slots(inputs))];
    let role = if ty == Type::Material { Internal::ChooseMaterial } else { Internal::ChooseField };
    let (kind, built) = registry.internal(role, &args)?;
    Some((kind.to_owned(), built.ok()?))
}

impl Linker<'_> {
    /// Declares the instances of an `Each`.
    pub(super) fn declare_each(
        &mut self,
        scope: usize,
        name: &str,
        kind: &SyntaxValue,
        args: &[Entry],
    ) -> Option<Entity> {
        let over = self.over(scope, kind, args);
        let Some(ids) = read::get(args, "ids").cloned() else {
            let help = "write `ids: \"node.ids\"`, numbers that name the pieces";
            self.report.push(kind.error(Code::MissingInput, "`Each` has no `ids`").help(help));
            return None;
        };
        let over = over?;
        let number = self.choosers.len();
        let full = format!("{}{name}", self.scopes[scope].prefix);
        self.choosers.push(Chooser { children: Vec::new(), kind: kind.clone(), scope, name: full, ids });
        for index in 0..over {
            let outer = self.scopes[scope].params.clone();
            self.scopes[scope].params.give(INDEX.to_owned(), Some(number_value(index, kind)));
            let child = self.declare_use(scope, &format!("{name}/{index}"), kind, args, Some(Spread { name, index }));
            self.scopes[scope].params = outer;
            self.choosers[number].children.push(child?);
        }
        Some(Entity::Each(number))
    }

    fn over(&mut self, scope: usize, kind: &SyntaxValue, args: &[Entry]) -> Option<usize> {
        let Some(part) = read::get(args, "over") else {
            let help = "write `over: 4`, the number of instances";
            self.report.push(kind.error(Code::MissingInput, "`Each` has no `over`").help(help));
            return None;
        };
        let part = substitute(part, &self.scopes[scope].params, self.report)?.part;
        let count = read::number(&part, "over", self.report)?;
        let found = (1..=MOST).find(|n| *n as f64 == count);
        if found.is_none() {
            let message = format!("over is `{}`; it must be a whole number between 1 and {MOST}", shorten(part.str()));
            self.report.push(part.error(Code::OutOfRange, message));
        }
        found
    }

    /// The node that selects among the values of an output; created on first use.
    pub(super) fn chosen(&mut self, chooser: usize, output: Option<&str>) -> Option<usize> {
        let found = &self.choosers[chooser];
        let first = self.docs[self.scopes[*found.children.first()?].doc].document.outputs.first();
        let output = output.or(first.map(|first| first.name.as_str()))?;
        if let Some(flat) = self.chosen.get(&(chooser, output.to_owned())) {
            return Some(*flat);
        }
        let name = format!("{}.{output}", found.name);
        let mut flat = Flat::new(found.scope, name, found.kind.clone(), KIND.to_owned(), None, Cow::Borrowed(&[]));
        flat.slots.push(Slot::unresolved(Port::Node("ids".into()), Accepts::One(Type::Ids), found.ids.clone()));
        flat.chooses = Some((chooser, output.to_owned()));
        let flat = self.add_flat(flat);
        self.chosen.insert((chooser, output.to_owned()), flat);
        Some(flat)
    }

    /// Resolves the inputs of a selecting node: the ids, and the output of every instance.
    pub(super) fn resolve_chosen(&mut self, flat: usize, chooser: usize, output: &str) {
        let docs = self.docs;
        let scope = self.flats[flat].scope;
        let part = self.flats[flat].slots[0].part.clone();
        let Some(ids) = substitute(&part, &self.scopes[scope].params, self.report) else { return };
        match ports::literal(&ids.part, Accepts::One(Type::Ids), &Port::Node("ids".into()), ids.is_text) {
            Ok(Literal::Reference(name)) => {
                let meaning = self.resolve(scope, &ids.part, &name);
                let slot = &mut self.flats[flat].slots[0];
                (slot.target, slot.declared) = (meaning.target, meaning.declared);
            }
            Ok(Literal::Constant(_)) => self.report.push(mismatch(&part, "`ids`", "the name of a node")),
            Err(error) => self.report.push(*error),
        }
        for child in self.choosers[chooser].children.clone() {
            let document = &docs[self.scopes[child].doc].document;
            let from = document.output(output).and_then(|output| output.from.as_ref());
            let Some((from, Shape::Text(name))) = from.map(|from| (from, from.shape())) else { continue };
            let target = match self.laid_out(child, Some(output), from) {
                Some(flat) => Target::Out { flat, output: 0 },
                None => {
                    self.enter(child);
                    self.resolve(child, from, &name).target
                }
            };
            let mut slot = Slot::unresolved(Port::Node("inputs".into()), Accepts::Field, from.clone());
            slot.target = target;
            self.flats[flat].slots.push(slot);
        }
    }

    /// All `Each` nodes as uses of their sub-graphs, with the outputs that are read.
    pub(super) fn eaches(&self) -> Vec<GraphUse> {
        let mut uses = Vec::new();
        for (number, found) in self.choosers.iter().enumerate() {
            let Some(child) = found.children.first() else { continue };
            let doc = &self.docs[self.scopes[*child].doc];
            let outputs = doc.document.outputs.iter().filter_map(|output| {
                let flat = self.chosen.get(&(number, output.name.clone()))?;
                Some((output.name.clone(), NodeIndex::new(*flat), 0))
            });
            uses.push(GraphUse { name: found.name.clone(), path: doc.path.clone(), outputs: outputs.collect() });
        }
        uses
    }
}
