//! Reads the operands of a node that is replaced.
use super::formula::{Formula, listed};
use super::kinds::{Removed, Rewrite};
use super::places::{Old, Spot};
use super::scope::{Scope, formula_of, is_path, text_of};
use super::terms::ordered;
use super::words::{Base, Fault, Name, Word};
use shibo_graph::syntax::{Node, NodeKind, number};
use shibo_node::parse_color;
use shibo_node::registry::Registry;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::ops::Range;

/// Why a node cannot be rewritten, or what its rewriting changes; with its place in the text.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Problem {
    /// The place.
    pub(super) range: Range<usize>,
    /// The message.
    pub(super) message: String,
}

impl Problem {
    /// A problem at a place.
    pub(super) fn new(range: Range<usize>, message: impl Into<String>) -> Self {
        Self { range, message: message.into() }
    }
}

/// A node written in place that gets an entry of its own.
#[derive(Clone, Debug)]
pub(super) struct Hoisted {
    /// Where it is written.
    pub(super) range: Range<usize>,
    /// Its new name.
    pub(super) name: String,
}

/// Converts the nodes of a graph, inner nodes first.
pub(super) struct Converter<'s, 't> {
    /// The graph.
    pub(super) scope: &'s Scope<'t>,
    /// The kinds.
    pub(super) registry: &'s Registry,
    /// Formulas of the outputs of the nodes so far, by the index of the call.
    pub(super) made: HashMap<usize, Vec<Formula>>,
    /// Nodes that get entries, by the index of the call that reads them.
    pub(super) hoisted: BTreeMap<usize, Vec<Hoisted>>,
    /// Warnings.
    pub(super) warnings: Vec<Problem>,
    /// New names of nodes.
    pub(super) taken: HashSet<String>,
}

impl<'s, 't> Converter<'s, 't> {
    /// Begins.
    pub(super) fn new(scope: &'s Scope<'t>, registry: &'s Registry) -> Self {
        let (made, hoisted) = (HashMap::new(), BTreeMap::new());
        Self { scope, registry, made, hoisted, warnings: Vec::new(), taken: HashSet::new() }
    }

    /// A free name for a node of a kind.
    fn free_name(&self, kind: &str, more: &[Hoisted]) -> String {
        let mut base = String::new();
        for c in kind.chars() {
            if c.is_ascii_uppercase() && !base.is_empty() {
                base.push('_');
            }
            base.push(c.to_ascii_lowercase());
        }
        let is_free = |name: &str| {
            !self.scope.has(name) && !self.taken.contains(name) && more.iter().all(|other| other.name != name)
        };
        let mut name = base.clone();
        for number in 2_usize.. {
            if is_free(&name) {
                break;
            }
            name = format!("{base}_{number}");
        }
        name
    }
}

/// A node while it is converted.
pub(super) struct Call<'c, 's, 't> {
    /// The known facts about the other nodes.
    pub(super) maker: &'c Converter<'s, 't>,
    pub(super) old: &'c Old<'t>,
    /// Nodes in place that get entries.
    pub(super) hoisted: Vec<Hoisted>,
    /// Warnings about it.
    pub(super) warnings: Vec<Problem>,
}

impl<'t> Call<'_, '_, 't> {
    /// The row of the table.
    pub(super) fn removed(&self) -> &'static Removed {
        self.old.removed
    }

    /// The range of the kind.
    pub(super) fn word(&self) -> Range<usize> {
        self.old.node.tokens().first().map_or_else(|| self.old.node.range(), |token| token.range())
    }

    /// A problem at the kind.
    pub(super) fn fail<T>(&self, message: impl Into<String>) -> Result<T, Problem> {
        Err(Problem::new(self.word(), message))
    }

    /// The value of a field.
    pub(super) fn field(&self, name: &str) -> Option<Node<'t>> {
        self.old.node.body()?.entry(name)?.value()
    }

    /// An operand, or its default.
    pub(super) fn required(&mut self, name: &str) -> Result<Formula, Problem> {
        match self.operand(name)? {
            Some(formula) => Ok(formula),
            None => self.fail(format!("`{name}` is not given")),
        }
    }

    /// An operand, or its default; `None` if it is not given and has none.
    pub(super) fn operand(&mut self, name: &str) -> Result<Option<Formula>, Problem> {
        let Some(operand) = self.removed().operands.iter().find(|operand| operand.name == name) else {
            return Ok(None);
        };
        match operand.fields.iter().find_map(|field| self.field(field)) {
            Some(value) => self.value(value).map(Some),
            None => Ok(operand.default.map(Formula::number)),
        }
    }

    /// A value as a formula.
    pub(super) fn value(&mut self, value: Node<'t>) -> Result<Formula, Problem> {
        let wrong = || Problem::new(value.range(), format!("`{}` cannot be a part of a formula", value.text()));
        match value.kind() {
            NodeKind::Number => plain_number(value.text()).map(|text| Formula::number(&text)).ok_or_else(wrong),
            NodeKind::Text => self.text(value, &text_of(value).ok_or_else(wrong)?),
            NodeKind::Parens => {
                let parts = value.children().map(|part| match part.kind() {
                    NodeKind::Number => plain_number(part.text()).map(|text| Formula::number(&text)),
                    _ => None,
                });
                let parts = parts.collect::<Option<Vec<_>>>().filter(|parts| parts.len() > 1).ok_or_else(wrong)?;
                let mut words = listed(parts);
                words.insert(0, Word::Open);
                words.push(Word::Close);
                Ok(Formula { words })
            }
            NodeKind::Call | NodeKind::Word => {
                if let Some(made) = self.maker.made.get(&value.index()).and_then(|outputs| outputs.first()) {
                    return Ok(made.clone());
                }
                let kind = value.name().unwrap_or_default();
                let is_node = value.kind() == NodeKind::Call || self.maker.registry.info(kind).is_some();
                if is_node { Ok(self.hoist(value, kind)) } else { Err(wrong()) }
            }
            _ => Err(wrong()),
        }
    }

    /// Gives an entry to a node that is written in place.
    fn hoist(&mut self, value: Node<'t>, kind: &str) -> Formula {
        let takes_entry = matches!(self.removed().rewrite, Rewrite::Channel | Rewrite::Split);
        let name = match self.old.spot {
            // The node itself leaves nothing behind.
            Spot::Entry(index) if takes_entry => self.maker.scope.entries[index].name.clone(),
            _ => self.maker.free_name(kind, &self.hoisted),
        };
        self.hoisted.push(Hoisted { range: value.range(), name: name.clone() });
        Formula::of(Word::Name(Name { base: Base::New(name), rest: String::new() }))
    }

    fn text(&mut self, value: Node<'t>, text: &str) -> Result<Formula, Problem> {
        if let Some(formula) = formula_of(text) {
            let read = Formula::read(formula).map_err(|fault| self.in_text(value, &fault, 1))?;
            let named = self.names(&read, value, &mut |_| Ok(None))?;
            return Ok(ordered(named));
        }
        if let Some(name) = text.strip_prefix('$').filter(|name| !name.starts_with('$')) {
            return Ok(Formula::of(Word::Param(name.trim().to_owned())));
        }
        if parse_color(text).is_some() {
            return Ok(Formula::of(Word::Color(text.to_owned())));
        }
        if matches!(text.split('.').next(), Some("true" | "false" | "let")) {
            return Err(Problem::new(value.range(), format!("`{text}` is a word of formulas; rename the node first")));
        }
        if is_path(text) {
            return Ok(Formula::of(Word::name(text)));
        }
        Err(Problem::new(value.range(), format!("`{text}` cannot be a part of a formula")))
    }

    /// The place of a mistake in a formula; `before` bytes of the text are not part of it.
    pub(super) fn in_text(&self, value: Node<'t>, fault: &Fault, before: usize) -> Problem {
        let range = value.range();
        let quote = value.text().find('"').map_or(0, |at| at + 1 + before);
        let start = (range.start + quote + fault.range.start).min(range.end);
        let end = (range.start + quote + fault.range.end).clamp(start, range.end);
        let plain = text_of(value).is_some_and(|text| value.text().contains(&text));
        Problem::new(if plain { start..end } else { range }, fault.message.clone())
    }

    /// A formula with the meanings that its names have in an old text: no name is that of a node. `port` returns the value that is connected to a name.
    pub(super) fn names(
        &mut self,
        formula: &Formula,
        value: Node<'t>,
        port: &mut dyn FnMut(&str) -> Result<Option<Formula>, Problem>,
    ) -> Result<Formula, Problem> {
        let (mut failed, mut hidden) = (None, None);
        let scope = self.maker.scope;
        let named = formula.replaced(&mut |name| {
            let Base::Text(text) = &name.base else { return None };
            let (first, rest) = text.split_once('.').map_or((text.as_str(), ""), |(first, rest)| (first, rest));
            match port(first) {
                Ok(Some(formula)) if rest.is_empty() => return Some(formula),
                Ok(Some(formula)) => return Some(self.part(formula, rest)),
                Ok(None) => {}
                Err(problem) => {
                    failed.get_or_insert(problem);
                    return None;
                }
            }
            if !scope.has(first) {
                return None;
            }
            // A node has the name of something else.
            let mut other = |text: &str| {
                hidden.get_or_insert_with(|| {
                    format!(
                        "the node `{first}` hides `{first}` of formulas, so it is `{text}`, perhaps rounded differently"
                    )
                });
                Formula::read(text).ok()
            };
            match first {
                "pi" => other("3.141592653589793"),
                "x" if !scope.has("u") && !scope.has("canvas") => other("u * canvas.width"),
                "y" if !scope.has("v") && !scope.has("canvas") => other("v * canvas.height"),
                "u" if !scope.has("x") && !scope.has("canvas") => other("x / canvas.width"),
                "v" if !scope.has("y") && !scope.has("canvas") => other("y / canvas.height"),
                "x" | "y" | "u" | "v" | "canvas" => {
                    let message = format!("the node `{first}` hides `{first}` of formulas; rename it first");
                    failed.get_or_insert(Problem::new(value.range(), message));
                    None
                }
                _ => None,
            }
        });
        self.warnings.extend(hidden.map(|message| Problem::new(value.range(), message)));
        failed.map_or(Ok(named), Err)
    }

    /// Components or a channel of a value. Where an output has the same name, the main output is named.
    pub(super) fn part(&self, formula: Formula, rest: &str) -> Formula {
        if let [Word::Name(Name { base: Base::Text(path), rest: before })] = &formula.words[..]
            && before.is_empty()
            && !path.contains('.')
            && let Some(outputs) = self.maker.scope.outputs_of(path, self.maker.registry)
            && let Some(first) = rest.split('.').next()
            && outputs.contains(&first)
        {
            return Formula::of(Word::name(format!("{path}.{}", outputs[0]))).part(&format!(".{rest}"));
        }
        formula.part(&format!(".{rest}"))
    }
}

/// A number as formulas write it; `None` for one that is not finite.
fn plain_number(text: &str) -> Option<String> {
    let digits = text.trim_start_matches('+');
    let unsigned = digits.trim_start_matches('-');
    let plain = unsigned.bytes().all(|b| b.is_ascii_digit() || b == b'.') && unsigned.parse::<f64>().is_ok();
    if plain {
        return Some(digits.to_owned());
    }
    number(text).filter(|value| value.is_finite()).map(|value| format!("{value}"))
}
