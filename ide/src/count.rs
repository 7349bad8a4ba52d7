//! Collects the statistics of graphs.
use super::around::Around;
use super::expect::Expect;
use super::file::{File, Section};
use super::formula::{FormulaText, Role, manual};
use super::habits::{Class, Habits, Place, kind_of, signature, source, stem};
use super::view::{Item, Shape, Value};
use super::walk::{Visit, walk};
use super::world::{Cx, World};
use shibo_graph::syntax::formula::{Formula, PartKind, WordKind};
use shibo_node::registry::Registry;
use std::path::{Path, PathBuf};
use std::sync::Arc;

impl Habits {
    /// Collects the statistics of some graphs.
    pub fn of<'f>(registry: &Registry, files: impl IntoIterator<Item = &'f File>) -> Self {
        let mut habits = Self::default();
        for file in files.into_iter().flat_map(File::scopes) {
            let alone = Alone(registry, Self::default());
            let cx = Cx { world: &alone, file: &file };
            walk(cx, &mut Counter { cx, habits: &mut habits, name: None, field: "" });
        }
        habits
    }
}

struct Counter<'a, 'h> {
    cx: Cx<'a>,
    habits: &'h mut Habits,
    /// Name of the next node, if it has one.
    name: Option<&'a str>,
    /// Name of the present field; empty for nodes.
    field: &'a str,
}

impl<'a> Visit<'a> for Counter<'a, '_> {
    fn key(&mut self, inside: Expect<'a>, item: &'a Item) {
        let node = matches!(inside, Expect::Section(Section::Nodes));
        self.name = item.name().filter(|_| node);
        self.field = item.name().filter(|_| !node).unwrap_or_default();
    }

    fn value(&mut self, expect: Expect<'a>, value: &'a Value) {
        if let Some(text) = FormulaText::of(self.cx, expect, value) {
            return self.formula(&text);
        }
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
        if matches!(kind, "Use" | "Each")
            && let (Some(import), Some(given)) = (body.value("graph").and_then(Value::text), body.value("with"))
        {
            let graph = self.cx.file.stem_of(import);
            let mut before = "";
            for name in given.body().into_iter().flat_map(|given| &given.items).filter_map(Item::name) {
                self.habits.add(&["given", graph, name]);
                self.habits.add(&["given next", graph, before, name]);
                before = name;
            }
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

impl Counter<'_, '_> {
    /// Counts the words of a formula.
    fn formula(&mut self, text: &FormulaText<'_>) {
        if let Role::Function(_) = text.role {
            return;
        }
        let formula = text.parse();
        for index in 0..formula.words().len() {
            let Some(class) = class_of(&formula, index) else { continue };
            let says = formula.word(index);
            let around = &Around::of(&formula, index, index + 1);
            let kind = if class == Class::Node { kind_of(self.cx.file, says) } else { String::new() };
            let says = if class == Class::Node { kind.as_str() } else { says };
            let name = self.name.unwrap_or(self.field);
            let place = Place { point: text.role == Role::Point, field: self.field, name, around };
            self.habits.add_word(&place, class, says);
        }
    }
}

/// The class of a word of a formula; `None` if it is no name, or is defined there.
pub(crate) fn class_of(formula: &Formula, index: usize) -> Option<Class> {
    let (word, says) = (&formula.words()[index], formula.word(index));
    let first = says.split('.').next().unwrap_or_default();
    let defines = || formula.part_of(index).is_some_and(|part| formula.parts()[part].kind == PartKind::Let);
    match word.kind {
        WordKind::Param => Some(Class::Param),
        WordKind::Name if formula.is_call(index) => Some(Class::Function),
        WordKind::Name if defines() => None,
        WordKind::Name if formula.local(first, word.range.start).is_some() => Some(Class::Local),
        WordKind::Name if manual(says).is_some() || says == "pi" => Some(Class::Place),
        WordKind::Name => Some(Class::Node),
        _ => None,
    }
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
