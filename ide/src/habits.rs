//! Statistics of the library graphs: frequencies of kinds, fields, choices and connections. Completion ranks common
//! ones first.
use super::expect::Expect;
use super::file::{File, Section};
use super::view::{Item, Shape, Value};
use super::walk::{Visit, walk};
use super::world::{Cx, World};
use shibo_node::registry::Registry;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Counts of observations.
#[derive(Debug, Default)]
pub struct Habits(HashMap<String, u32>);

impl Habits {
    /// Collects the statistics of some graphs.
    pub fn of<'f>(registry: &Registry, files: impl IntoIterator<Item = &'f File>) -> Self {
        let mut habits = Self::default();
        for file in files {
            let alone = Alone(registry, Self::default());
            let mut counter = Counter { cx: Cx { world: &alone, file }, habits: &mut habits, name: None };
            walk(Cx { world: &alone, file }, &mut counter);
        }
        habits
    }

    fn add(&mut self, parts: &[&str]) {
        *self.0.entry(parts.join("|")).or_default() += 1;
    }

    fn get(&self, parts: &[&str]) -> f64 {
        f64::from(self.0.get(&parts.join("|")).copied().unwrap_or_default())
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

    /// Frequency of an option, in nodes with these fields and in all nodes.
    pub fn choice(&self, kind: &str, field: &str, with: &str, word: &str) -> f64 {
        20.0 * self.get(&["with", kind, field, with, word]) + self.get(&["choice", kind, field, word])
    }

    /// Frequency with which an output of a kind feeds a port.
    pub fn source(&self, kind: &str, port: &str, from: &str) -> f64 {
        self.get(&["source", kind, port, from])
    }

    /// Frequency with which a parameter of this name is used for a field.
    pub fn param(&self, field: &str, name: &str) -> f64 {
        self.get(&["param", field, name])
    }
}

/// Last word of a name, without a number.
fn stem(name: &str) -> &str {
    let name = name.trim_end_matches(|c: char| c.is_ascii_digit() || c == '_');
    name.rsplit('_').next().unwrap_or(name)
}

/// Fields of a node joined to one text.
pub(crate) fn signature(args: &[Item], without: &str) -> String {
    let mut names: Vec<&str> = args.iter().filter_map(Item::name).filter(|n| *n != without && *n != "seed").collect();
    names.sort_unstable();
    names.join(",")
}

struct Counter<'a, 'h> {
    cx: Cx<'a>,
    habits: &'h mut Habits,
    /// Name of the next node, if it has one.
    name: Option<&'a str>,
}

impl<'a> Visit<'a> for Counter<'a, '_> {
    fn key(&mut self, inside: Expect<'a>, item: &'a Item) {
        self.name = matches!(inside, Expect::Section(Section::Nodes)).then(|| item.name()).flatten();
    }

    fn value(&mut self, expect: Expect<'a>, value: &'a Value) {
        let Shape::Call { word, body } = &value.shape else { return };
        if !expect.takes_nodes() {
            return;
        }
        let kind = self.cx.file.at(word);
        self.habits.add(&["kind", kind]);
        if let Some(name) = self.name.take() {
            self.habits.add(&["name", name, kind]);
            self.habits.add(&["stem", stem(name), kind]);
        }
        let mut before = "";
        for item in &body.items {
            let Some(field) = item.name() else { continue };
            self.habits.add(&["field", kind, field]);
            self.habits.add(&["next", kind, before, field]);
            before = field;
            match item.value.as_ref().map(|value| &value.shape) {
                Some(Shape::Word) => {
                    let word = item.value.as_ref().and_then(|value| self.cx.file.word(value)).unwrap_or_default();
                    self.habits.add(&["choice", kind, field, word]);
                    self.habits.add(&["with", kind, field, &signature(&body.items, field), word]);
                }
                Some(Shape::Call { word, .. }) => self.habits.add(&["source", kind, field, self.cx.file.at(word)]),
                Some(Shape::Text(text)) if text.starts_with('$') => self.habits.add(&["param", field, &text[1..]]),
                Some(Shape::Text(text)) => {
                    let (name, port) = text.split_once('.').unwrap_or((text, ""));
                    let from = self.cx.file.entry(Section::Nodes, name).and_then(|item| self.cx.file.head(item));
                    if let Some(from) = from {
                        self.habits.add(&["source", kind, field, &source(from, port)]);
                    }
                }
                _ => {}
            }
        }
    }
}

/// Name of an output of a kind in the counts.
pub(crate) fn source(kind: &str, port: &str) -> String {
    if port.is_empty() { kind.to_owned() } else { format!("{kind}.{port}") }
}

/// A world of a single file.
struct Alone<'r>(&'r Registry, Habits);

impl World for Alone<'_> {
    fn registry(&self) -> &Registry {
        self.0
    }

    fn file(&self, _path: &Path) -> Option<Arc<File>> {
        None
    }

    fn import(&self, _from: &Path, _name: &str) -> Option<PathBuf> {
        None
    }

    fn graphs(&self) -> Vec<Arc<File>> {
        Vec::new()
    }

    fn folder(&self, _path: &Path) -> Vec<(String, bool)> {
        Vec::new()
    }

    fn habits(&self) -> &Habits {
        &self.1
    }
}
