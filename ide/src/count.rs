//! Collects the statistics of graphs.
use super::expect::Expect;
use super::file::{File, Section};
use super::formula::{FormulaText, Role, manual};
use super::habits::{Habits, class, signature, source, stem};
use super::view::{Item, Shape, Value};
use super::walk::{Visit, walk};
use super::world::{Cx, World};
use shibo_graph::syntax::formula::{Formula, WordKind};
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
            walk(cx, &mut Counter { cx, habits: &mut habits, name: None });
        }
        habits
    }
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
        let role = match text.role {
            Role::Point => "point",
            Role::Value => "value",
            Role::Function(_) => return,
        };
        let formula = text.parse();
        for (index, word) in formula.words().iter().enumerate() {
            let says = formula.word(index);
            let first = says.split('.').next().unwrap_or_default();
            let class = match word.kind {
                WordKind::Param => class::PARAM,
                WordKind::Name if formula.is_call(index) => class::FUNCTION,
                WordKind::Name if formula.local(first, word.range.start).is_some() => continue,
                WordKind::Name if manual(says).is_some() || says == "pi" => class::PLACE,
                WordKind::Name => class::NODE,
                _ => continue,
            };
            let before = before(&formula, index);
            self.habits.add(&["word", role, before, class]);
            self.habits.add(&["words", role, before]);
            if class != class::NODE {
                self.habits.add(&["after", before, says]);
            }
            if matches!(class, class::FUNCTION | class::PLACE) {
                self.habits.add(&["called", says]);
                self.habits.add(&["calls"]);
            }
        }
    }
}

/// The word before another one in the counts of formulas.
pub(crate) fn before(formula: &Formula, index: usize) -> &str {
    match index.checked_sub(1) {
        None => "=",
        Some(before) if formula.words()[before].kind == WordKind::Open && before > 0 && formula.is_call(before - 1) => {
            formula.word(before - 1)
        }
        Some(before) => formula.word(before),
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
