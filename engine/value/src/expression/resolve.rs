//! Finds the meanings of the names in an expression or in the body of a function.
use super::functions::{self, Makes};
use super::tree::{Node, NodeKind, Tree};
use super::{Fault, MOST_ERRORS, Meaning, Names, Op, Value, bad, components, shorten};
use crate::diagnostics::{Code, suggest};
use std::collections::{HashMap, HashSet};

/// The most parts of a name between dots.
const MOST_PARTS: usize = 16;

/// The meaning of a name.
#[derive(Debug)]
pub(super) enum Leaf {
    /// The value of a parameter of the function or of a local name, by number; its components begin at this byte.
    Local(usize, Option<usize>),
    /// A value; its components begin at this byte.
    Value(Meaning, Option<usize>),
    /// A word, or a name that is unknown; with the message and help for the latter.
    Bare(Option<(String, String)>),
}

/// Where names are looked up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Scope {
    Formula,
    Function,
}

/// The meanings of names, in the order of the tree.
#[derive(Debug, Default)]
pub(super) struct Resolved {
    pub(super) leaves: Vec<Leaf>,
    pub(super) faults: Vec<Fault>,
    /// Something is unknown because of errors that were reported before.
    pub(super) broken: bool,
}

/// Finds the meanings of all names; reports all wrong ones.
pub(super) fn resolve(tree: &Tree, text: &str, params: &[String], scope: Scope, names: &mut dyn Names) -> Resolved {
    let defined = tree.nodes.iter().filter_map(|node| match node.kind {
        NodeKind::Let { start, end } => Some(&text[start..end]),
        _ => None,
    });
    let defined: HashSet<&str> = defined.collect();
    let locals = params.iter().enumerate().map(|(index, name)| (name.as_str(), index)).collect();
    let mut resolver = Resolver { text, params, scope, locals, defined, names };
    let compared = compared(tree);
    let (mut resolved, mut count) = (Resolved::default(), params.len());
    for (index, node) in tree.nodes.iter().enumerate() {
        let leaf = match node.kind {
            NodeKind::Param => resolver.param(node),
            NodeKind::Name => resolver.name(node, compared[index]),
            NodeKind::Let { start, end } => {
                resolved.faults.extend(resolver.define(start, end, count).err());
                count += 1;
                continue;
            }
            _ => continue,
        };
        match leaf.and_then(|leaf| resolver.checked(node, leaf)) {
            Ok(leaf) => resolved.leaves.push(leaf),
            Err(Some(fault)) => resolved.faults.push(fault),
            Err(None) => resolved.broken = true,
        }
        if resolved.faults.len() >= MOST_ERRORS {
            break;
        }
    }
    resolved
}

/// For each part, whether it is an operand of `==` or `!=`. Beside a choice, a name may be an option.
fn compared(tree: &Tree) -> Vec<bool> {
    let mut compared = vec![false; tree.nodes.len()];
    // The parts that no other part has taken yet.
    let mut open: Vec<usize> = Vec::new();
    for (index, node) in tree.nodes.iter().enumerate() {
        let operands = open.split_off(open.len().saturating_sub(node.kind.parts()));
        if let NodeKind::Binary { op: Op::Equal | Op::NotEqual, .. } = node.kind {
            operands.into_iter().for_each(|operand| compared[operand] = true);
        }
        if !matches!(node.kind, NodeKind::Let { .. }) {
            open.push(index);
        }
    }
    compared
}

/// A name without a meaning; without a fault if one was reported before.
type Unknown = Option<Fault>;

struct Resolver<'u, 'n> {
    text: &'u str,
    params: &'u [String],
    scope: Scope,
    locals: HashMap<&'u str, usize>,
    /// All local names, including later ones.
    defined: HashSet<&'u str>,
    names: &'n mut dyn Names,
}

impl<'u> Resolver<'u, '_> {
    fn define(&mut self, start: usize, end: usize, index: usize) -> Result<(), Fault> {
        let name = &self.text[start..end];
        if self.locals.insert(name, index).is_none() {
            return Ok(());
        }
        let is_param = self.params.iter().any(|param| param == name);
        let before = if is_param { "a parameter of the function" } else { "already defined" };
        let help = Some("take another name".to_owned());
        Err(Fault { help, ..bad(start..end, format!("`{}` is {before}", shorten(name))) })
    }

    fn param(&mut self, node: &Node) -> Result<Leaf, Unknown> {
        let (word, start) = (&self.text[node.range.start + 1..node.range.end], node.range.start + 1);
        if self.scope == Scope::Function {
            let message = format!("a function does not see the parameter `${}`", shorten(word));
            let help = Some("give the value to the function as an argument".to_owned());
            return Err(Some(Fault { help, ..bad(node.range.clone(), message) }));
        }
        let name = word.split('.').next().unwrap_or(word);
        Ok(Leaf::Value(self.names.param(name), self.after(node, start + name.len())))
    }

    /// The place of the components behind a name that ends at `end`.
    fn after(&self, node: &Node, end: usize) -> Option<usize> {
        (end < node.range.end).then_some(end + 1)
    }

    fn name(&mut self, node: &Node, compared: bool) -> Result<Leaf, Unknown> {
        let (word, start) = (&self.text[node.range.clone()], node.range.start);
        let first = word.split('.').next().unwrap_or(word);
        if let Some(local) = self.locals.get(first) {
            return Ok(Leaf::Local(*local, self.after(node, start + first.len())));
        }
        let truth = |value| Ok(Leaf::Value(Meaning::Known(Value::Bool(value)), None));
        match word {
            "true" => return truth(true),
            "false" => return truth(false),
            _ => {}
        }
        // The longest path first; the rest are components.
        let mut ends: Vec<usize> =
            word.match_indices('.').map(|(at, _)| at).take(MOST_PARTS).chain([word.len()]).collect();
        while let Some(end) = ends.pop() {
            let meaning = match self.scope {
                Scope::Formula => self.names.name(&word[..end]),
                Scope::Function => self.names.in_function(&word[..end]),
            };
            if let Some(meaning) = meaning {
                return Ok(Leaf::Value(meaning, self.after(node, start + end)));
            }
        }
        self.unknown(node, word, first, compared)
    }

    /// The meaning of a name that the surroundings do not know.
    fn unknown(&mut self, node: &Node, word: &str, first: &str, compared: bool) -> Result<Leaf, Unknown> {
        let fault =
            |message: String, help: String| Err(Some(Fault { help: Some(help), ..bad(node.range.clone(), message) }));
        if let Some(functions) = functions::find(word) {
            if let [function] = functions
                && let Makes::Number(value) = function.makes
            {
                return Ok(Leaf::Value(Meaning::Known(Value::Number(value)), None));
            }
            let message = format!("`{word}` takes {}; found 0", functions::takes(functions));
            return fault(message, format!("write `{}`", functions[0].call()));
        }
        if self.defined.contains(first) {
            let message = format!("`{}` is used before it is defined", shorten(first));
            return fault(message, format!("move `let {} = …;` to the front", shorten(first)));
        }
        if self.scope == Scope::Function {
            let known: Vec<&str> = self.params.iter().map(String::as_str).collect();
            let help = if known.is_empty() {
                "a function sees its parameters, other functions and the canvas".to_owned()
            } else {
                format!("a function sees its parameters, `{}`, other functions and the canvas", known.join("`, `"))
            };
            return fault(format!("a function does not see `{}`", shorten(word)), help);
        }
        let instead = self.names.instead(word);
        if self.names.has_words() && !word.contains('.') {
            return Ok(Leaf::Bare(instead));
        }
        let all = self.names.all();
        let mut locals: Vec<&str> = self.locals.keys().copied().collect();
        locals.sort_unstable();
        let known: Vec<&str> = all.iter().map(String::as_str).chain(locals).collect();
        let unknown = || (format!("there is no name `{}`", shorten(word)), suggest(word, "name", &known));
        let (message, help) = instead.unwrap_or_else(unknown);
        if compared && !word.contains('.') { Ok(Leaf::Bare(Some((message, help)))) } else { fault(message, help) }
    }

    /// The meaning, if it is a value that has the components behind its name.
    fn checked(&self, node: &Node, leaf: Leaf) -> Result<Leaf, Unknown> {
        let (meaning, letters) = match leaf {
            Leaf::Value(Meaning::Wrong(code, message, help), _) => {
                return Err(Some(Fault { code, help, ..bad(node.range.clone(), message) }));
            }
            Leaf::Value(Meaning::Broken, _) => return Err(None),
            Leaf::Value(ref meaning, Some(letters)) => (meaning, letters),
            _ => return Ok(leaf),
        };
        let count = match meaning {
            Meaning::Planes { count, .. } => Some(*count),
            Meaning::Known(Value::Vector(values)) => Some(values.len()),
            Meaning::Any { .. } => None,
            _ => Some(1),
        };
        let (subject, letters) = (&self.text[node.range.start..letters - 1], &self.text[letters..node.range.end]);
        match components::check(count, subject, letters) {
            Ok(_) => Ok(leaf),
            Err((message, help)) => {
                Err(Some(Fault { code: Code::BadExpression, help: Some(help), ..bad(node.range.clone(), message) }))
            }
        }
    }
}
