//! Rewrites one graph.
use super::Change;
use super::comments::{Surroundings, lines_of, surroundings};
use super::convert::convert;
use super::edits::{column, line_start};
use super::formula::Formula;
use super::operands::{Converter, Problem};
use super::places::{Holds, Old, Places, Spot, Wire, places};
use super::plan::{Place, Plan, Run, Value, value_of};
use super::scope::{Scope, formula_of, is_path, text_of};
use super::words::{Base, Name, Word};
use super::write::{Rewritten, Writer};
use shibo_graph::syntax::{Node, NodeKind};
use shibo_node::registry::Registry;
use std::collections::{BTreeMap, HashMap, HashSet};

impl From<Problem> for Change {
    fn from(problem: Problem) -> Self {
        Self { range: problem.range, message: problem.message }
    }
}

/// Rewrites a graph; nothing if it has no kinds that are replaced.
pub(super) fn rewrite(body: Node<'_>, registry: &Registry) -> Rewritten {
    let scope = Scope::new(body);
    let mut found = places(&scope, registry);
    if found.old.is_empty() {
        return Rewritten::default();
    }
    let mut converter = Converter::new(&scope, registry);
    let mut failed = BTreeMap::new();
    // Inner nodes come after outer ones.
    for old in found.old.iter().rev() {
        if let Err(problem) = convert(&mut converter, old) {
            failed.insert(old.node.index(), problem);
        }
    }
    settle_failed(&mut found, &failed, &scope);
    let around = surroundings(&scope);
    let plan = plan(&scope, &found, &converter, &around);
    let mut writer = Writer { scope: &scope, plan, found: &found, converter: &converter, around: &around };
    writer.plan.decide();
    writer.join_comments();
    writer.name_values();
    let mut rewritten = writer.write();
    rewritten.warnings.extend(converter.warnings.iter().cloned().map(Change::from));
    rewritten.warnings.extend(failed.into_values().map(|problem| {
        let message = format!("not rewritten: {}", problem.message);
        Change { range: problem.range, message }
    }));
    rewritten.warnings.sort_by_key(|warning| warning.range.start);
    rewritten
}

/// Nodes that cannot be rewritten stay; their operands become wires, and nodes inside them places.
fn settle_failed<'t>(found: &mut Places<'t>, failed: &BTreeMap<usize, Problem>, scope: &Scope<'t>) {
    if failed.is_empty() {
        return;
    }
    let mut spots: HashMap<usize, Spot> = HashMap::new();
    for old in found.old.iter().filter(|old| failed.contains_key(&old.node.index())) {
        let values = old.node.body().into_iter().flat_map(Node::entries).filter_map(Node::value);
        for value in values {
            match value.kind() {
                NodeKind::Call => drop(spots.insert(value.index(), Spot::Place)),
                NodeKind::Text if old.removed.is_formula() => {
                    let text = text_of(value).unwrap_or_default();
                    let name = text.split('.').next().unwrap_or_default();
                    if is_path(&text) && scope.has(name) {
                        let (range, holds, entry) = (value.range(), Holds::Path, old.entry);
                        found.wires.push(Wire { range, text, holds, entry });
                    }
                }
                _ => {}
            }
        }
    }
    found.old.retain(|old| !failed.contains_key(&old.node.index()));
    for old in &mut found.old {
        if let Some(spot) = spots.get(&old.node.index()) {
            old.spot = *spot;
        }
    }
}

/// The values and places of a graph, with names resolved.
fn plan<'s, 't>(
    scope: &'s Scope<'t>,
    found: &Places<'t>,
    converter: &Converter<'_, 't>,
    around: &[Surroundings],
) -> Plan<'s, 't> {
    let text = scope.body.tree().text();
    let mut values = Vec::new();
    // The values of each name, by output.
    let mut named: HashMap<&str, (&Old<'t>, usize)> = HashMap::new();
    for old in found.old.iter().filter(|old| old.removed.is_formula()) {
        let (Spot::Entry(index), Some(formulas)) = (old.spot, converter.made.get(&old.node.index())) else { continue };
        let entry = &scope.entries[index];
        // Of several entries with one name the first is meant.
        if scope.node(&entry.name) == Some(index) {
            named.insert(&entry.name, (old, values.len()));
        }
        let start = column(text, entry.node.range().start) + entry.name.chars().count() + "\"\": \"= ".len();
        for (output, formula) in formulas.iter().enumerate() {
            values.push(Value::new(index, output, entry.name.clone(), formula.clone(), start));
        }
    }
    let resolve = |formula: &Formula| resolved(formula, &named);
    for value in &mut values {
        value.formula = resolve(&value.formula);
    }
    let mut all = Vec::new();
    for wire in &found.wires {
        let formula = match formula_of(&wire.text).filter(|_| wire.holds != Holds::Path) {
            Some(formula) => Formula::read(formula).ok(),
            None => is_path(&wire.text).then(|| Formula::of(Word::name(wire.text.clone()))),
        };
        all.extend(formula.map(|formula| {
            let place = place(scope, &wire.range, resolve(&formula), wire.holds, wire.entry);
            Place { was: formula.text(&as_written), ..place }
        }));
    }
    for old in found.old.iter().filter(|old| old.spot == Spot::Place && old.removed.is_formula()) {
        let Some(formula) = converter.made.get(&old.node.index()).and_then(|outputs| outputs.first()) else { continue };
        all.push(place(scope, &old.node.range(), resolve(formula), Holds::Formula, old.entry));
    }
    share_lines(&mut all, text);
    let mut plan = Plan::new(scope, values, all, runs(around));
    pin(&mut plan, around);
    plan
}

fn place(
    scope: &Scope<'_>,
    range: &std::ops::Range<usize>,
    formula: Formula,
    holds: Holds,
    entry: Option<usize>,
) -> Place {
    let text = scope.body.tree().text();
    let line = line_start(text, range.start);
    let end = text[range.end..].find(['\n', '\r']).map_or(text.len(), |at| range.end + at);
    let around = text[line..range.start].chars().count() + text[range.end..end].chars().count();
    Place { range: range.clone(), formula, holds, entry, was: String::new(), changed: false, line, around }
}

fn as_written(name: &Name) -> String {
    match &name.base {
        Base::Text(text) | Base::New(text) => format!("{text}{}", name.rest),
        Base::Value(_) => String::new(),
    }
}

/// Subtracts the other places of a line from its width around each place.
fn share_lines(places: &mut [Place], text: &str) {
    let width = |place: &Place| text[place.range.clone()].chars().count();
    let mut inside: HashMap<usize, usize> = HashMap::new();
    for place in &*places {
        *inside.entry(place.line).or_default() += width(place);
    }
    for place in places {
        let others = inside.get(&place.line).copied().unwrap_or(0) - width(place);
        place.around = place.around.saturating_sub(others);
    }
}

/// Replaces the names of nodes that become formulas by their values.
fn resolved(formula: &Formula, named: &HashMap<&str, (&Old<'_>, usize)>) -> Formula {
    let locals: HashSet<&str> = formula
        .words
        .iter()
        .filter_map(|word| if let Word::Let(name) = word { Some(name.as_str()) } else { None })
        .collect();
    let words = formula.words.iter().map(|word| {
        let Word::Name(name) = word else { return word.clone() };
        let Base::Text(path) = &name.base else { return word.clone() };
        let (first, rest) = path.split_once('.').map_or((path.as_str(), None), |(first, rest)| (first, Some(rest)));
        let Some((old, base)) = named.get(first).filter(|_| !locals.contains(first)) else { return word.clone() };
        let (output, after) = match rest {
            None => (0, None),
            Some(rest) => {
                let (second, after) =
                    rest.split_once('.').map_or((rest, None), |(second, after)| (second, Some(after)));
                match old.removed.output(Some(second)) {
                    Some(output) => (output, after),
                    None => (0, Some(rest)),
                }
            }
        };
        let mut name = name.clone();
        name.base = Base::Value(base + output);
        name.rest.insert_str(0, &after.map(|after| format!(".{after}")).unwrap_or_default());
        Word::Name(name)
    });
    Formula { words: words.collect() }
}

/// The runs of entries without comments and blank lines between them.
fn runs(around: &[Surroundings]) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::with_capacity(around.len());
    for around in around {
        let before = runs.last().copied().unwrap_or_default();
        let (number, has_comment) = match around.begins {
            true => (before.number + 1, around.comment_above),
            false => (before.number, before.has_comment),
        };
        runs.push(Run { number, has_comment, described: around.described });
    }
    runs
}

/// Values with a comment keep their nodes, unless several outputs of the node are read.
fn pin(plan: &mut Plan<'_, '_>, around: &[Surroundings]) {
    let formulas = plan.values.iter().map(|value| &value.formula).chain(plan.places.iter().map(|place| &place.formula));
    let read: HashSet<usize> = formulas.flat_map(Formula::names).filter_map(value_of).collect();
    for values in plan.of_entry.values() {
        let Some(entry) = values.first().map(|value| plan.values[*value].entry) else { continue };
        let around = &around[entry];
        let several = values.iter().filter(|value| read.contains(value)).count() > 1;
        let has_lines = !lines_of(plan.scope.entries[entry].value, &[]).is_empty();
        if around.comment_behind || has_lines || (around.comment_above && !several) {
            values.iter().for_each(|value| plan.values[*value].pinned = true);
        }
    }
}
