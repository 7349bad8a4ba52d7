//! The meanings of names in formulas and in the bodies of functions.
use super::files::Doc;
use super::functions::FunctionDecl;
use super::linker::Entity;
use super::read::shorten;
use super::subst::InParams;
use crate::diagnostics::{Code, suggest};
use crate::expression::{Meaning, Names, PLACES, UserFunction};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The functions that the formulas of a document call.
#[derive(Clone, Copy)]
pub(super) struct Functions<'d> {
    docs: &'d [Doc],
    doc: usize,
}

impl<'d> Functions<'d> {
    pub(super) fn of(docs: &'d [Doc], doc: usize) -> Self {
        Self { docs, doc }
    }

    /// The function `name`, or `import.name` of another graph, with the index of its document.
    pub(super) fn find(self, name: &str) -> Option<(usize, &'d FunctionDecl)> {
        let (mut doc, mut name) = (self.doc, name);
        while let Some((import, rest)) = name.split_once('.') {
            let from = self.docs.get(doc)?;
            (doc, name) = ((*from.imports.get(from.document.import(import)?)?)?, rest);
        }
        let functions = &self.docs.get(doc)?.document.functions;
        functions.iter().find(|decl| decl.function.name == name).map(|decl| (doc, decl))
    }
}

/// Resolves the names of a formula.
pub(super) struct InFormula<'l> {
    pub(super) params: InParams<'l>,
    pub(super) meanings: BTreeMap<String, Meaning>,
    pub(super) nodes: &'l BTreeMap<String, Entity>,
    pub(super) functions: Functions<'l>,
}

impl Names for InFormula<'_> {
    fn param(&mut self, name: &str) -> Meaning {
        self.params.param(name)
    }

    fn name(&mut self, name: &str) -> Option<Meaning> {
        if let Some(meaning) = self.meanings.get(name) {
            return Some(meaning.clone());
        }
        // A node hides the position.
        let first = name.split('.').next().unwrap_or_default();
        if self.nodes.contains_key(first) {
            return None;
        }
        let place = PLACES.iter().position(|place| *place == name);
        place.map(|first| Meaning::Planes { first, count: 1 }).or_else(|| self.params.name(name))
    }

    fn all(&self) -> Vec<String> {
        let nodes = self.nodes.keys().cloned();
        nodes.chain(PLACES.map(str::to_owned)).chain(self.params.all()).collect()
    }

    fn has_words(&self) -> bool {
        true
    }

    fn instead(&mut self, name: &str) -> Option<(String, String)> {
        let names = self.all();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        Some((format!("there is no node `{}`", shorten(name)), suggest(name, "name", &names)))
    }

    fn function(&mut self, name: &str) -> Option<Arc<UserFunction>> {
        self.functions.find(name).map(|(_, decl)| decl.function.clone())
    }

    fn functions(&self) -> Vec<String> {
        self.params.functions()
    }

    fn in_function(&mut self, name: &str) -> Option<Meaning> {
        self.params.name(name)
    }

    fn seed(&mut self) -> Option<u64> {
        self.params.seed()
    }

    fn seed_of(&mut self, seed: u64) -> Option<u64> {
        self.params.seed_of(seed)
    }
}

/// Resolves the names in the body of a function.
pub(super) struct InFunction<'l> {
    pub(super) params: InParams<'l>,
    pub(super) functions: Functions<'l>,
}

impl Names for InFunction<'_> {
    fn param(&mut self, name: &str) -> Meaning {
        let message = format!("`${}` has no value in a function", shorten(name));
        Meaning::Wrong(Code::UnknownParam, message, Some("give it to the function as a value".to_owned()))
    }

    fn name(&mut self, _name: &str) -> Option<Meaning> {
        None
    }

    fn all(&self) -> Vec<String> {
        self.params.all()
    }

    fn has_words(&self) -> bool {
        false
    }

    fn function(&mut self, name: &str) -> Option<Arc<UserFunction>> {
        self.functions.find(name).map(|(_, decl)| decl.function.clone())
    }

    fn functions(&self) -> Vec<String> {
        self.params.functions()
    }

    fn in_function(&mut self, name: &str) -> Option<Meaning> {
        self.params.name(name)
    }

    fn seed(&mut self) -> Option<u64> {
        self.params.seed()
    }

    fn seed_of(&mut self, seed: u64) -> Option<u64> {
        self.params.seed_of(seed)
    }
}
