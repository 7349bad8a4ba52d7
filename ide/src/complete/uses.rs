//! Uses of names in the formulas and references of a graph.
use super::super::around::Around;
use super::super::expect::Expect;
use super::super::file::Section;
use super::super::formula::FormulaText;
use super::super::view::{Item, Shape, Value};
use super::super::walk::{Visit, walk};
use super::super::world::Cx;
use shibo_graph::syntax::formula::WordKind;
use std::collections::{HashMap, HashSet};

/// The place for which uses are counted.
pub(super) struct Here<'h> {
    /// Position in the file.
    pub at: usize,
    /// Index of the entry of `nodes`.
    pub entry: Option<usize>,
    /// The words around it.
    pub around: &'h Around,
}

/// Numbers of uses of a name elsewhere.
#[derive(Clone, Debug, Default)]
pub(super) struct Tally {
    /// All.
    pub all: usize,
    /// In the same formula.
    pub here: usize,
    /// In formulas: behind the same word; behind the same two words.
    pub behind: usize,
    pub behind_two: usize,
    /// In formulas: between the same two words; before the same two words.
    pub between: usize,
    pub ahead: usize,
    /// In other formulas that share a name with this one.
    pub beside: usize,
    /// Distance to the nearest use, in entries of `nodes`.
    pub nearest: Option<usize>,
}

/// Uses of names. Those of parameters have their `$`; paths are names as written.
#[derive(Default)]
pub(super) struct Uses<'a> {
    found: HashMap<&'a str, Tally>,
    /// Uses of each node by any path.
    nodes: HashMap<&'a str, usize>,
    /// The last name before the place in its formula, and the next one.
    pub last: Option<&'a str>,
    pub next: Option<&'a str>,
    /// The last parameter before the place.
    pub last_param: Option<&'a str>,
}

impl<'a> Uses<'a> {
    /// Counts the uses in a graph.
    pub(super) fn of(cx: Cx<'a>, here: &Here<'_>) -> Self {
        let mut counter =
            Counter { cx, here, entry: None, entries: 0, uses: Self::default(), all: Vec::new(), own: HashSet::new() };
        walk(cx, &mut counter);
        let Counter { mut uses, all, own, .. } = counter;
        let beside = all.iter().filter(|formula| formula.iter().any(|name| own.contains(name)));
        for name in beside.flatten() {
            if let Some(tally) = uses.found.get_mut(name) {
                tally.beside += 1;
            }
        }
        uses
    }

    /// The uses of a name.
    pub(super) fn name(&self, name: &str) -> Option<&Tally> {
        self.found.get(name)
    }

    /// The number of uses of a node by any path, or of a name without a dot.
    pub(super) fn node(&self, node: &str) -> usize {
        self.nodes.get(node).copied().unwrap_or_default()
    }
}

struct Counter<'a, 'h> {
    cx: Cx<'a>,
    here: &'h Here<'h>,
    /// Index of the present entry of `nodes`; `None` in other sections.
    entry: Option<usize>,
    /// Number of entries of `nodes` so far.
    entries: usize,
    uses: Uses<'a>,
    /// The names of each other formula, and those of this one.
    all: Vec<Vec<&'a str>>,
    own: HashSet<&'a str>,
}

impl<'a> Counter<'a, '_> {
    fn add(&mut self, name: &'a str) -> &mut Tally {
        *self.uses.nodes.entry(first(name)).or_default() += 1;
        let tally = self.uses.found.entry(name).or_default();
        tally.all += 1;
        if let Some((entry, me)) = self.entry.zip(self.here.entry) {
            let distance = entry.abs_diff(me);
            tally.nearest = Some(tally.nearest.map_or(distance, |nearest| nearest.min(distance)));
        }
        tally
    }

    /// Notes a name before the place.
    fn passed(&mut self, name: &'a str) {
        if name.starts_with('$') {
            self.uses.last_param = Some(name);
        }
    }

    fn formula(&mut self, text: &FormulaText<'a>, is_here: bool) {
        let formula = text.parse();
        let place = if is_here { text.offset(self.here.at) } else { None };
        let mut names = Vec::new();
        for (index, word) in formula.words().iter().enumerate() {
            let touched = place.is_some_and(|at| word.range.start <= at && at <= word.range.end);
            if touched || !matches!(word.kind, WordKind::Name | WordKind::Param) {
                continue;
            }
            let name = &text.says()[word.range.clone()];
            let (now, here) = (Around::of(&formula, index, index + 1), self.here.around);
            if text.in_file(&word.range).is_some_and(|range| range.end < self.here.at) {
                self.passed(name);
            }
            let tally = self.add(name);
            let behind = now.before == here.before;
            let before = now.after == here.after && !now.after.is_empty();
            tally.behind += usize::from(behind);
            tally.behind_two += usize::from(behind && now.second == here.second);
            tally.between += usize::from(behind && before);
            tally.ahead += usize::from(before && now.then == here.then && !now.then.is_empty());
            let Some(at) = place else {
                names.push(name);
                continue;
            };
            tally.here += 1;
            self.own.insert(name);
            if word.range.end < at {
                self.uses.last = Some(name);
            } else if self.uses.next.is_none() {
                self.uses.next = Some(name);
            }
        }
        self.all.push(names);
    }
}

impl<'a> Visit<'a> for Counter<'a, '_> {
    fn key(&mut self, inside: Expect<'a>, _item: &'a Item) {
        if let Expect::Section(section) = inside {
            self.entry = (section == Section::Nodes).then_some(self.entries);
            self.entries += usize::from(section == Section::Nodes);
        }
    }

    fn value(&mut self, expect: Expect<'a>, value: &'a Value) {
        let Shape::Text(text) = &value.shape else { return };
        let is_here = value.range.start <= self.here.at && self.here.at <= value.range.end;
        if let Some(formula) = FormulaText::of(self.cx, expect, value) {
            self.formula(&formula, is_here);
        } else if !is_here && (text.starts_with('$') || (expect.reference(self.cx).is_some() && !text.starts_with('#')))
        {
            if value.range.end < self.here.at {
                self.passed(text);
            }
            self.add(text);
        }
    }
}

/// A path without what follows its first dot.
pub(super) fn first(path: &str) -> &str {
    path.split('.').next().unwrap_or_default()
}
