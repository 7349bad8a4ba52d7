//! Loads an expression and all functions that it calls.
use super::functions::{self, COMPOSED};
use super::parse::parse;
use super::resolve::{Leaf, Resolved, Scope, resolve};
use super::tree::{Callee, Tree};
use super::{Fault, MOST_ERRORS, Meaning, Names, UserFunction};
use crate::diagnostics::suggest;
use std::collections::HashMap;
use std::sync::LazyLock;

/// The most functions of the user that an expression may need.
const MOST_FUNCTIONS: usize = 1024;

/// An expression, or the body of a function.
#[derive(Debug)]
pub(super) struct Unit {
    /// The name of the function, as it was asked for; `None` for the expression and for functions of the language.
    pub(super) name: Option<String>,
    pub(super) text: String,
    pub(super) tree: Tree,
    /// The meanings of the names in the tree, in its order.
    pub(super) leaves: Vec<Leaf>,
}

/// The units of an expression: itself, then the functions that it needs.
#[derive(Debug, Default)]
pub(super) struct Loaded {
    pub(super) units: Vec<Unit>,
    pub(super) faults: Vec<Fault>,
    /// Something is unknown because of errors that were reported before.
    pub(super) broken: bool,
}

/// A text that is not parsed yet.
struct Source {
    name: Option<String>,
    text: String,
    params: Vec<String>,
}

impl Source {
    fn of(name: &str, function: &UserFunction) -> Self {
        Self { name: Some(name.to_owned()), text: function.body.clone(), params: function.params.clone() }
    }
}

/// Loads an expression.
pub(super) fn load(text: &str, names: &mut dyn Names) -> Loaded {
    Loader::new(Source { name: None, text: text.to_owned(), params: Vec::new() }, names).load(Scope::Formula)
}

/// Loads a function.
pub(super) fn load_function(function: &UserFunction, names: &mut dyn Names) -> Loaded {
    Loader::new(Source::of(&function.name, function), names).load(Scope::Function)
}

/// The functions of the language that are defined by expressions, in the order of their table.
pub(super) static BUILT_IN: LazyLock<Vec<Unit>> = LazyLock::new(|| {
    let units = COMPOSED.iter().flat_map(|composed| {
        let params = composed.params.iter().map(|(name, _)| (*name).to_owned()).collect();
        let source = Source { name: None, text: composed.body.to_owned(), params };
        let loaded = Loader::new(source, &mut Nothing).load(Scope::Function);
        debug_assert!(loaded.faults.is_empty(), "{:?}", loaded.faults);
        loaded.units
    });
    units.collect()
});

struct Loader<'n> {
    names: &'n mut dyn Names,
    sources: Vec<Source>,
    /// The sources of functions by their names.
    known: HashMap<String, usize>,
}

impl<'n> Loader<'n> {
    fn new(root: Source, names: &'n mut dyn Names) -> Self {
        let known = root.name.clone().map(|name| (name, 0)).into_iter().collect();
        Self { names, sources: vec![root], known }
    }

    fn load(mut self, root: Scope) -> Loaded {
        let mut loaded = Loaded::default();
        while loaded.units.len() < self.sources.len() && loaded.faults.len() < MOST_ERRORS {
            let source = &mut self.sources[loaded.units.len()];
            let (name, text) = (source.name.take(), std::mem::take(&mut source.text));
            let params = source.params.clone();
            let scope = if loaded.units.is_empty() { root } else { Scope::Function };
            let (tree, mut resolved) = match parse(&text, &mut |called| self.find(called, name.as_deref())) {
                Err(faults) => (Tree::default(), Resolved { faults, ..Resolved::default() }),
                Ok(tree) => {
                    let resolved = resolve(&tree, &text, &params, scope, self.names);
                    (tree, resolved)
                }
            };
            resolved.faults.iter_mut().for_each(|fault| fault.function.clone_from(&name));
            loaded.faults.append(&mut resolved.faults);
            loaded.broken |= resolved.broken;
            loaded.units.push(Unit { name, text, tree, leaves: resolved.leaves });
        }
        loaded
    }

    /// The function that `caller`, or the expression, calls by this name; else the advice.
    fn find(&mut self, called: &str, caller: Option<&str>) -> Result<Callee, String> {
        if let Some(functions) = functions::find(called) {
            return Ok(Callee::BuiltIn(functions));
        }
        // A function of an import calls others of the same import.
        let prefix = caller.and_then(|caller| caller.rsplit_once('.')).map(|(prefix, _)| format!("{prefix}.{called}"));
        for name in prefix.into_iter().chain([called.to_owned()]) {
            let known = self.known.get(&name).copied();
            let unit = match known {
                Some(unit) => unit,
                None => {
                    let Some(function) = self.names.function(&name) else { continue };
                    if self.sources.len() > MOST_FUNCTIONS {
                        return Err(format!("a formula can use at most {MOST_FUNCTIONS} functions"));
                    }
                    self.sources.push(Source::of(&name, &function));
                    self.known.insert(name, self.sources.len() - 1);
                    self.sources.len() - 1
                }
            };
            return Ok(Callee::User { unit, params: self.sources[unit].params.len() });
        }
        if let Some(help) = functions::elsewhere(called) {
            return Err(help.to_owned());
        }
        let own = self.names.functions();
        let all: Vec<&str> = functions::names().chain(own.iter().map(String::as_str)).collect();
        Err(suggest(called, "function", &all))
    }
}

/// No names.
struct Nothing;

impl Names for Nothing {
    fn param(&mut self, _name: &str) -> Meaning {
        Meaning::Broken
    }

    fn name(&mut self, _name: &str) -> Option<Meaning> {
        None
    }

    fn all(&self) -> Vec<String> {
        Vec::new()
    }

    fn has_words(&self) -> bool {
        false
    }

    fn seed(&mut self) -> Option<u64> {
        None
    }
}
