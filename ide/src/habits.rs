//! Statistics of the library graphs: frequencies of kinds, fields, choices and connections. Completion ranks common
//! ones first.
use super::around::Around;
use super::file::{File, Section};
use super::view::Item;
use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};

/// Counts of observations, by the hash of their words.
#[derive(Debug, Default)]
pub struct Habits(HashMap<u64, u32>);

/// The hash of a context, to which words can be added.
fn hashed(parts: &[&str]) -> DefaultHasher {
    let mut hasher = DefaultHasher::new();
    parts.iter().for_each(|part| part.hash(&mut hasher));
    hasher
}

/// The key of a word in a context.
fn key(context: &DefaultHasher, word: &str) -> u64 {
    let mut hasher = context.clone();
    word.hash(&mut hasher);
    hasher.finish()
}

impl Habits {
    pub(crate) fn add(&mut self, parts: &[&str]) {
        *self.0.entry(hashed(parts).finish()).or_default() += 1;
    }

    fn get(&self, parts: &[&str]) -> f64 {
        self.count(hashed(parts).finish())
    }

    fn count(&self, key: u64) -> f64 {
        f64::from(self.0.get(&key).copied().unwrap_or_default())
    }

    /// Frequency of a kind.
    pub fn kind(&self, kind: &str) -> f64 {
        self.get(&["kind", kind])
    }

    /// Frequency of a kind among nodes of this name.
    pub fn named(&self, name: &str, kind: &str) -> f64 {
        4.0 * self.get(&["name", name, kind]) + self.get(&["stem", stem(name), kind])
    }

    /// Share of the nodes of a kind that have a field.
    pub fn field(&self, kind: &str, field: &str) -> f64 {
        self.get(&["field", kind, field]) / self.kind(kind).max(1.0)
    }

    /// Frequency with which a field directly follows another one.
    pub fn next(&self, kind: &str, before: &str, field: &str) -> f64 {
        self.get(&["next", kind, before, field])
    }

    /// Frequencies with which a value is given to a graph, and with which it is given directly behind another one. Graphs are
    /// told apart by [`File::stem_of`].
    pub fn given(&self, graph: &str, before: &str, name: &str) -> (f64, f64) {
        (self.get(&["given", graph, name]), self.get(&["given next", graph, before, name]))
    }

    /// Frequency of an option, in nodes with these fields and in all nodes.
    pub fn choice(&self, kind: &str, field: &str, with: &str, word: &str) -> f64 {
        20.0 * self.get(&["with", kind, field, with, word]) + self.get(&["choice", kind, field, word])
    }

    /// Frequency with which an output of a kind feeds a port.
    pub fn source(&self, kind: &str, port: &str, from: &str) -> f64 {
        self.get(&["source", kind, port, from])
    }

    /// Counts a word of a formula; `word` is the kind of a node.
    pub(crate) fn add_word(&mut self, place: &Place<'_>, class: Class, word: &str) {
        let mut add = |context: &DefaultHasher, word: &str| {
            *self.0.entry(context.finish()).or_default() += 1;
            *self.0.entry(key(context, word)).or_default() += 1;
        };
        for context in place.of_classes() {
            add(&context, class.key());
        }
        if !matches!(class, Class::Local | Class::Param) {
            for context in place.of_words(class) {
                add(&context, word);
            }
        }
    }

    /// Likelihood of a class of words in a place, as logarithms: by the words before it, and the factors by the words behind
    /// it and by the field.
    pub(crate) fn class(&self, place: &Place<'_>, class: Class) -> [f64; 3] {
        let [role, before, both, after, field] = place.of_classes();
        let open = place.around.after.is_empty();
        let class = class.key();
        let prior = (self.count(key(&role, class)) + 1.0) / (self.count(role.finish()) + 5.0);
        let by_one = self.share(&before, class, prior, 3.0);
        let by_two = self.share(&both, class, by_one, 3.0);
        let factor = |context: &DefaultHasher| (self.share(context, class, prior, 3.0) / prior).ln();
        [by_two.ln(), if open { 0.0 } else { factor(&after) }, factor(&field)]
    }

    /// Likelihood of a function, a position or a kind of nodes among its class, as logarithms: by the words before it, and
    /// the factors by the words behind it, by the values in the brackets that follow, and by the name of the node or field.
    pub(crate) fn word(&self, place: &Place<'_>, class: Class, word: &str) -> [f64; 4] {
        let [all, before, both, after, given, named] = place.of_words(class);
        let prior = (self.count(key(&all, word)) + 0.1) / (self.count(all.finish()) + 10.0);
        let by_one = self.share(&before, word, prior, 5.0);
        let by_two = self.share(&both, word, by_one, 5.0);
        let factor = |context: &DefaultHasher, known: bool, weight: f64| {
            if known { (self.share(context, word, prior, weight) / prior).ln() } else { 0.0 }
        };
        let around = place.around;
        [
            by_two.ln(),
            factor(&after, !around.after.is_empty(), 5.0),
            factor(&given, !around.given.is_empty(), 1.0),
            factor(&named, true, 5.0),
        ]
    }

    /// Share of `what` among the observations in a context, to which `weight` observations of share `prior` are added.
    fn share(&self, context: &DefaultHasher, what: &str, prior: f64, weight: f64) -> f64 {
        (self.count(key(context, what)) + weight * prior) / (self.count(context.finish()) + weight)
    }

    /// Frequency with which a parameter of this name is used for a field.
    pub fn param(&self, field: &str, name: &str) -> f64 {
        self.get(&["param", field, name])
    }
}

/// Class of a word of a formula.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Class {
    /// A name that the formula defines, or a value of the function.
    Local,
    /// A parameter.
    Param,
    /// A node or an input.
    Node,
    /// A function.
    Function,
    /// A position, a fact of the canvas or a constant.
    Place,
}

impl Class {
    pub(crate) const ALL: [Self; 5] = [Self::Local, Self::Param, Self::Node, Self::Function, Self::Place];

    pub(crate) const fn key(self) -> &'static str {
        ["local", "param", "node", "function", "place"][self as usize]
    }
}

/// A place in a formula.
pub(crate) struct Place<'p> {
    /// True if the formula is computed for every point.
    pub point: bool,
    /// Name of the field; empty for a node that is a formula.
    pub field: &'p str,
    /// Name of the field, or of the node that is a formula.
    pub name: &'p str,
    /// The words around it.
    pub around: &'p Around,
}

impl Place<'_> {
    /// Contexts in which classes are counted: the role, then with the word before, the two before, the two behind, and the field.
    fn of_classes(&self) -> [DefaultHasher; 5] {
        let Around { before, second, after, then, .. } = self.around;
        let role = if self.point { "point" } else { "value" };
        [
            hashed(&["class", role]),
            hashed(&["class", role, "1", before]),
            hashed(&["class", role, "2", before, reduced(second)]),
            hashed(&["class", role, "3", after, reduced(then)]),
            hashed(&["class", role, "4", self.field]),
        ]
    }

    /// Contexts in which words of a class are counted: all, behind the same word and the same two, before the same two, before
    /// such values, and for such a name.
    fn of_words(&self, class: Class) -> [DefaultHasher; 6] {
        let Around { before, second, after, then, given, .. } = self.around;
        let class = class.key();
        [
            hashed(&[class, "all"]),
            hashed(&[class, "1", before]),
            hashed(&[class, "2", before, reduced(second)]),
            hashed(&[class, "3", after, then]),
            hashed(&[class, "4", given]),
            hashed(&[class, "5", stem(self.name)]),
        ]
    }
}

/// Kind of the node or input of a path in a formula, with the output.
pub(crate) fn kind_of(file: &File, path: &str) -> String {
    let (node, output) = path.split_once('.').unwrap_or((path, ""));
    let kind = file.entry(Section::Nodes, node).map_or("input", |item| file.head(item).unwrap_or("="));
    // Outputs of graphs, and components, have any names.
    let any = !output.is_empty() && matches!(kind, "input" | "=" | "Use" | "Each");
    source(kind, if any { "*" } else { output })
}

/// A word of a formula, without the name.
fn reduced(word: &str) -> &str {
    if word.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') {
        "name"
    } else if word.starts_with('$') {
        "$"
    } else {
        word
    }
}

/// Last word of a name, without a number.
pub(crate) fn stem(name: &str) -> &str {
    let name = name.trim_end_matches(|c: char| c.is_ascii_digit() || c == '_');
    name.rsplit('_').next().unwrap_or(name)
}

/// Fields of a node joined to one text.
pub(crate) fn signature(args: &[Item], without: &str) -> String {
    let mut names: Vec<&str> = args.iter().filter_map(Item::name).filter(|n| *n != without && *n != "seed").collect();
    names.sort_unstable();
    names.join(",")
}

/// Name of an output of a kind in the counts.
pub(crate) fn source(kind: &str, port: &str) -> String {
    if port.is_empty() { kind.to_owned() } else { format!("{kind}.{port}") }
}
