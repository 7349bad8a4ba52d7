//! Declarations and uses of the names of a file.
use super::expect::Expect;
use super::file::Section;
use super::formula::{FormulaText, Role};
use super::functions::{self, Head};
use super::paths::Path;
use super::view::{Item, Shape, Value, plain};
use super::walk::{Visit, walk};
use super::world::Cx;
use shibo_graph::syntax::formula::{PartKind, WordKind};
use shibo_node::ParamType;
use std::ops::Range;
use std::sync::Arc;

/// Meaning of a name.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Symbol {
    /// A node or an input; both share one set of names.
    Node(String),
    /// A parameter.
    Param(String),
    /// An import, or a local graph; both share one set of names.
    Import(String),
    /// A function of the file.
    Function(String),
    /// A local name of a formula, or a value of a function, with the first byte of the formula's literal.
    Local(usize, String),
    /// An output.
    Output(String),
    /// A preset.
    Preset(String),
    /// An output of the node or input with the first name.
    Port(String, String),
    /// A parameter or an input of the imported graph.
    Given(String, String),
    /// A preset of the imported graph.
    GivenPreset(String, String),
    /// A function of the imported graph.
    GivenFunction(String, String),
    /// A channel or components: the path up to them.
    Part(String),
    /// The path of an import.
    Graph(String),
    /// A file that a node reads.
    File(String),
}

/// An occurrence of a name.
#[derive(Clone, Debug)]
pub struct Occurrence {
    /// Meaning of the name.
    pub symbol: Symbol,
    /// True if the name is declared here.
    pub declares: bool,
    /// Range of the name, or of the whole text in quotes if the text has escapes.
    pub range: Range<usize>,
    /// Range of the whole text in quotes, and its content without escapes.
    pub literal: (Range<usize>, Arc<str>),
    /// Range of the name in this content.
    pub within: Range<usize>,
}

impl Occurrence {
    /// True if the text has escapes, so that `range` covers the whole text.
    pub fn is_escaped(&self) -> bool {
        self.range == self.literal.0
    }
}

/// Puts a text in quotes.
pub fn quote(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}

/// All names of a graph, in the order of the text. A file does not include its local graphs.
pub fn occurrences(cx: Cx<'_>) -> Vec<Occurrence> {
    let mut names = Names { cx, found: Vec::new() };
    walk(cx, &mut names);
    names.found
}

/// The smallest name of a graph at a position.
pub(crate) fn at(cx: Cx<'_>, at: usize) -> Option<Occurrence> {
    let touched = occurrences(cx).into_iter().filter(|o| o.range.start <= at && at <= o.range.end);
    touched.min_by_key(|o| o.range.len())
}

/// A reference to an output of a node, without the channel and components that may follow.
#[derive(Clone, Debug)]
pub(crate) struct Reference {
    /// The node or the input.
    pub node: String,
    /// The text: `node` or `node.output`.
    pub says: String,
    /// Bytes of this text, or of the whole literal if it has escapes.
    pub range: Range<usize>,
    /// Range of the whole text in quotes, and its content without escapes.
    pub literal: (Range<usize>, Arc<str>),
    /// Range of the reference in this content.
    pub within: Range<usize>,
}

impl Reference {
    /// The literal or the part of it to replace, and the text for it where the reference becomes `new`.
    pub(crate) fn replaced(&self, new: &str) -> (Range<usize>, String) {
        if self.range != self.literal.0 {
            return (self.range.clone(), new.to_owned());
        }
        let mut content = self.literal.1.to_string();
        content.replace_range(self.within.clone(), new);
        (self.range.clone(), quote(&content))
    }
}

/// All references of a graph to its nodes and inputs, in the order of the text.
pub(crate) fn references(cx: Cx<'_>) -> Vec<Reference> {
    let mut found: Vec<Reference> = Vec::new();
    for one in occurrences(cx).into_iter().filter(|one| !one.declares) {
        match &one.symbol {
            Symbol::Node(name) => {
                let (node, says) = (name.clone(), name.clone());
                let Occurrence { range, literal, within, .. } = one;
                found.push(Reference { node, says, range, literal, within });
            }
            Symbol::Port(..) => {
                let follows =
                    |last: &&mut Reference| last.literal.0 == one.literal.0 && last.within.end + 1 == one.within.start;
                if let Some(last) = found.last_mut().filter(follows) {
                    last.range.end = one.range.end;
                    last.within.end = one.within.end;
                    last.says = last.literal.1[last.within.clone()].to_owned();
                }
            }
            _ => {}
        }
    }
    found
}

/// A text in quotes with names.
struct Literal {
    range: Range<usize>,
    /// Content without escapes.
    says: Arc<str>,
    /// Place of the content in the file; `None` for a literal with escapes.
    place: Option<Range<usize>>,
}

struct Names<'a> {
    cx: Cx<'a>,
    found: Vec<Occurrence>,
}

impl<'a> Visit<'a> for Names<'a> {
    fn key(&mut self, inside: Expect<'a>, item: &'a Item) {
        let Some(key) = &item.key else { return };
        let name = key.name.clone();
        let symbol = match inside {
            Expect::Section(Section::Functions) => return self.head(item),
            Expect::Section(Section::Nodes | Section::Inputs) => Symbol::Node(name),
            Expect::Section(Section::Params) => Symbol::Param(name),
            Expect::Section(Section::Imports | Section::Graphs) => Symbol::Import(name),
            Expect::Section(Section::Outputs) => Symbol::Output(name),
            Expect::Section(Section::Presets) => Symbol::Preset(name),
            Expect::Entry(Section::Presets, _) => Symbol::Param(name),
            Expect::With(import, None) => Symbol::Given(import.to_owned(), name),
            _ => return,
        };
        let within = 0..key.name.len();
        let declares = matches!(inside, Expect::Section(_));
        self.add(symbol, declares, &self.literal(&key.range, &key.name), within);
    }

    fn value(&mut self, expect: Expect<'a>, value: &'a Value) {
        let Shape::Text(says) = &value.shape else { return };
        if let Some(formula) = FormulaText::of(self.cx, expect, value) {
            return self.formula(&formula);
        }
        let literal = &self.literal(&value.range, says);
        let all = 0..says.len();
        match expect {
            Expect::Note => {}
            Expect::Entry(Section::Imports, _) => self.add(Symbol::Graph(says.clone()), false, literal, all),
            Expect::Use(_, _, Some("graph")) => self.add(Symbol::Import(says.clone()), false, literal, all),
            Expect::Use(args, _, Some("preset")) if !says.starts_with(['$', '=']) => {
                let import = args.value("graph").and_then(Value::text).unwrap_or_default();
                for (start, part) in parts(says) {
                    let symbol = Symbol::GivenPreset(import.to_owned(), part.to_owned());
                    self.add(symbol, false, literal, start..start + part.len());
                }
            }
            Expect::Value(_, param) if param.ty == ParamType::Path && !says.starts_with(['$', '=']) => {
                self.add(Symbol::File(says.clone()), false, literal, all);
            }
            _ if says.starts_with("$$") || says.starts_with("==") => {}
            _ if says.starts_with('$') => self.params(literal),
            _ if expect.reference(self.cx).is_some() => self.reference(literal, &all),
            // If the imported graph cannot be read, a value given to it may be a node.
            Expect::With(import, Some(_)) if self.cx.imported(import).is_none() && self.is_node(says) => {
                self.reference(literal, &all);
            }
            // Below a misspelt kind, a text with the name of a node most likely refers to it.
            Expect::Any if self.is_node(says) => self.reference(literal, &all),
            _ => {}
        }
    }
}

/// Names of presets in a text, with their offsets.
fn parts(says: &str) -> impl Iterator<Item = (usize, &str)> {
    says.split('+').map(move |part| {
        let trimmed = part.trim();
        (trimmed.as_ptr() as usize - says.as_ptr() as usize, trimmed)
    })
}

impl Names<'_> {
    fn literal(&self, range: &Range<usize>, says: &str) -> Literal {
        Literal { range: range.clone(), says: says.into(), place: plain(&self.cx.file.text, range, says) }
    }

    fn add(&mut self, symbol: Symbol, declares: bool, literal: &Literal, within: Range<usize>) {
        let inside = literal.place.as_ref().map(|place| place.start + within.start..place.start + within.end);
        self.found.push(Occurrence {
            symbol,
            declares,
            range: inside.unwrap_or_else(|| literal.range.clone()),
            literal: (literal.range.clone(), literal.says.clone()),
            within,
        });
    }

    /// Returns whether a text begins with the name of a node.
    fn is_node(&self, says: &str) -> bool {
        let name = says.split('.').next().unwrap_or_default();
        self.cx.file.entry(Section::Nodes, name).is_some()
    }

    /// Adds a reference at these bytes of a text: a path.
    fn reference(&mut self, literal: &Literal, within: &Range<usize>) {
        let says = &literal.says[within.clone()];
        if says.starts_with('#') || says.is_empty() {
            return;
        }
        let path = Path::of(self.cx, says);
        let at = |part: &Range<usize>| within.start + part.start..within.start + part.end;
        let name = says[path.node.clone()].to_owned();
        self.add(Symbol::Node(name.clone()), false, literal, at(&path.node));
        if let Some(port) = &path.port {
            self.add(Symbol::Port(name, says[port.clone()].to_owned()), false, literal, at(port));
        }
        for part in [&path.channel, &path.components].into_iter().flatten() {
            self.add(Symbol::Part(says[..part.end].to_owned()), false, literal, at(part));
        }
    }

    /// Adds all `$name` of a text.
    fn params(&mut self, literal: &Literal) {
        for range in params_in(&literal.says) {
            let name = literal.says[range.clone()].to_owned();
            self.add(Symbol::Param(name), false, literal, range);
        }
    }

    /// Adds the name of a function and the names of its values at their declaration.
    fn head(&mut self, item: &Item) {
        let Some(key) = &item.key else { return };
        let literal = &self.literal(&key.range, &key.name);
        let head = Head::of(&key.name);
        self.add(Symbol::Function(key.name[head.name.clone()].to_owned()), true, literal, head.name);
        let Some(body) = &item.value else { return };
        for param in head.params {
            self.add(Symbol::Local(body.range.start, key.name[param.clone()].to_owned()), true, literal, param);
        }
    }

    /// Adds the names of a formula.
    fn formula(&mut self, text: &FormulaText<'_>) {
        let literal = &self.literal(&text.literal, text.content);
        let values = text.values(self.cx);
        let formula = text.parse();
        for (index, word) in formula.words().iter().enumerate() {
            let within = text.begin + word.range.start..text.begin + word.range.end;
            let says = formula.word(index);
            let part = formula.part_of(index).and_then(|part| formula.parts().get(part));
            let first = says.split('.').next().unwrap_or_default();
            let base = within.start..within.start + first.len();
            let local = |name: &str| Symbol::Local(text.literal.start, name.to_owned());
            match word.kind {
                WordKind::Param if first.len() > 1 => {
                    self.add(Symbol::Param(first[1..].to_owned()), false, literal, base.start + 1..base.end);
                }
                WordKind::Name if formula.is_call(index) => self.call(literal, &within),
                // The word of the part is `let` itself.
                WordKind::Name if part.is_some_and(|part| part.kind == PartKind::Let && part.word == Some(index)) => {}
                WordKind::Name if part.is_some_and(|part| part.kind == PartKind::Let) => {
                    self.add(local(says), true, literal, within);
                }
                WordKind::Name if formula.local(first, word.range.start).is_some() || values.contains(&first) => {
                    self.add(local(first), false, literal, base);
                }
                WordKind::Name if text.role == Role::Point && self.is_value(first) => {
                    self.reference(literal, &within);
                }
                _ => {}
            }
        }
    }

    /// Returns whether a name is a node or an input.
    fn is_value(&self, name: &str) -> bool {
        [Section::Nodes, Section::Inputs].into_iter().any(|section| self.cx.file.entry(section, name).is_some())
    }

    /// Adds the name of a function that is called.
    fn call(&mut self, literal: &Literal, within: &Range<usize>) {
        let name = &literal.says[within.clone()];
        match name.split_once('.') {
            Some((import, function)) => {
                let dot = within.start + import.len();
                self.add(Symbol::Import(import.to_owned()), false, literal, within.start..dot);
                let symbol = Symbol::GivenFunction(import.to_owned(), function.to_owned());
                self.add(symbol, false, literal, dot + 1..within.end);
            }
            None if functions::is_of_language(name) => {}
            None => self.add(Symbol::Function(name.to_owned()), false, literal, within.clone()),
        }
    }
}

/// Ranges of parameter names in a text, without the `$`.
pub(crate) fn params_in(text: &str) -> Vec<Range<usize>> {
    let mut found = Vec::new();
    for (at, _) in text.match_indices('$') {
        let start = at + 1;
        let rest = &text[start..];
        let len = rest.find(|c: char| !(c == '_' || c.is_ascii_alphanumeric())).unwrap_or(rest.len());
        if len > 0 {
            found.push(start..start + len);
        }
    }
    found
}
