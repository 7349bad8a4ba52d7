//! Declarations and uses of the names of a file.
use super::expect::Expect;
use super::file::Section;
use super::view::{Item, Shape, Value, plain};
use super::walk::{Visit, walk};
use super::world::Cx;
use shibo_node::ParamType;
use std::ops::Range;

/// Meaning of a name.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Symbol {
    /// A node or an input; both share one set of names.
    Node(String),
    /// A parameter.
    Param(String),
    /// An import.
    Import(String),
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
    pub literal: (Range<usize>, String),
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
pub(crate) fn quote(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\""))
}

/// All names of a file, in the order of the text.
pub(crate) fn occurrences(cx: Cx<'_>) -> Vec<Occurrence> {
    let mut names = Names { cx, found: Vec::new() };
    walk(cx, &mut names);
    names.found
}

/// The smallest name at a position.
pub(crate) fn at(cx: Cx<'_>, at: usize) -> Option<Occurrence> {
    let touched = occurrences(cx).into_iter().filter(|o| o.range.start <= at && at <= o.range.end);
    touched.min_by_key(|o| o.range.len())
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
            Expect::Section(Section::Nodes | Section::Inputs) => Symbol::Node(name),
            Expect::Section(Section::Params) => Symbol::Param(name),
            Expect::Section(Section::Imports) => Symbol::Import(name),
            Expect::Section(Section::Outputs) => Symbol::Output(name),
            Expect::Section(Section::Presets) => Symbol::Preset(name),
            Expect::Entry(Section::Presets, _) => Symbol::Param(name),
            Expect::With(import, None) => Symbol::Given(import.to_owned(), name),
            _ => return,
        };
        let within = 0..key.name.len();
        let declares = matches!(inside, Expect::Section(_));
        self.add(symbol, declares, (&key.range, &key.name), within);
    }

    fn value(&mut self, expect: Expect<'a>, value: &'a Value) {
        let Shape::Text(says) = &value.shape else { return };
        let literal = (&value.range, says.as_str());
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
            Expect::Value(_, param) if param.ty == ParamType::Formula => self.params(literal),
            _ if says.starts_with("$$") || says.starts_with("==") => {}
            _ if says.starts_with(['$', '=']) => self.params(literal),
            _ if expect.reference(self.cx).is_some() => self.reference(literal),
            // If the imported graph cannot be read, a value given to it may be a node.
            Expect::With(import, Some(_)) if self.cx.imported(import).is_none() && self.is_node(says) => {
                self.reference(literal);
            }
            // Below a misspelt kind, a text with the name of a node most likely refers to it.
            Expect::Any if self.is_node(says) => self.reference(literal),
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
    fn add(&mut self, symbol: Symbol, declares: bool, (range, says): (&Range<usize>, &str), within: Range<usize>) {
        let place = plain(&self.cx.file.text, range, says)
            .map_or_else(|| range.clone(), |inside| inside.start + within.start..inside.start + within.end);
        self.found.push(Occurrence {
            symbol,
            declares,
            range: place,
            literal: (range.clone(), says.to_owned()),
            within,
        });
    }

    /// Returns whether a text begins with the name of a node.
    fn is_node(&self, says: &str) -> bool {
        let name = says.split('.').next().unwrap_or_default();
        self.cx.file.entry(Section::Nodes, name).is_some()
    }

    /// Adds a reference, `node` or `node.port`.
    fn reference(&mut self, literal: (&Range<usize>, &str)) {
        let says = literal.1;
        if says.starts_with('#') || says.is_empty() {
            return;
        }
        let end = says.find('.').unwrap_or(says.len());
        let name = &says[..end];
        self.add(Symbol::Node(name.to_owned()), false, literal, 0..end);
        let Some(port) = says.get(end + 1..).filter(|port| !port.is_empty()) else { return };
        self.add(Symbol::Port(name.to_owned(), port.to_owned()), false, literal, end + 1..says.len());
    }

    /// Adds all `$name` of a text.
    fn params(&mut self, literal: (&Range<usize>, &str)) {
        for range in params_in(literal.1) {
            let name = literal.1[range.clone()].to_owned();
            self.add(Symbol::Param(name), false, literal, range);
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
