//! Writes the result of a plan as edits of the text.
use super::Change;
use super::comments::{Surroundings, lines_of};
use super::edits::{Edits, column, line_start, removals, with_line};
use super::formula::Formula;
use super::kinds::Rewrite;
use super::operands::Converter;
use super::places::{Old, Places, Spot};
use super::plan::{Plan, Value};
use super::scope::Scope;
use shibo_graph::syntax::Node;
use shibo_graph::syntax::formula::literal;
use std::collections::{HashMap, HashSet};
use std::ops::Range;

/// The result for one graph.
#[derive(Default)]
pub(super) struct Rewritten {
    pub(super) edits: Edits,
    pub(super) changes: Vec<Change>,
    pub(super) warnings: Vec<Change>,
}

/// Writes the result of a plan.
pub(super) struct Writer<'w, 't> {
    pub(super) scope: &'w Scope<'t>,
    pub(super) plan: Plan<'w, 't>,
    pub(super) found: &'w Places<'t>,
    pub(super) converter: &'w Converter<'w, 't>,
    pub(super) around: &'w [Surroundings],
}

impl Writer<'_, '_> {
    /// True if nothing is left of an entry.
    fn is_gone(&self, entry: usize) -> bool {
        let values = self.plan.of_entry.get(&entry);
        values.is_some_and(|values| values.iter().all(|value| self.plan.values[*value].gone))
    }

    /// A comment describes the lines below it. If the entry below a comment becomes a part of a later entry,
    /// the comment stands above the later one.
    pub(super) fn join_comments(&mut self) {
        for entry in (0..self.scope.entries.len()).rev() {
            let around = &self.around[entry];
            let has_lines = !lines_of(self.scope.entries[entry].value, &[]).is_empty();
            if !around.comment_above || around.comment_behind || has_lines {
                continue;
            }
            let live =
                self.plan.of_entry.get(&entry).into_iter().flatten().filter(|value| !self.plan.values[**value].gone);
            let live: Vec<usize> = live.copied().collect();
            let [value] = live[..] else { continue };
            let below = (entry + 1..self.scope.entries.len()).take_while(|next| !self.around[*next].begins);
            let next = below.into_iter().find(|next| !self.is_gone(*next));
            if let Some(next) = next {
                self.plan.put_below_comment(value, next);
            }
        }
    }

    /// Names the values that stay. The first of a node keeps its name.
    pub(super) fn name_values(&mut self) {
        let mut taken: HashSet<String> = HashSet::new();
        for hoisted in self.converter.hoisted.values().flatten() {
            taken.insert(hoisted.name.clone());
        }
        for (entry, values) in &self.plan.of_entry {
            let name = &self.scope.entries[*entry].name;
            let mut first = !taken.contains(name);
            let live: Vec<usize> = values.iter().copied().filter(|value| !self.plan.values[*value].gone).collect();
            for value in live {
                if std::mem::take(&mut first) {
                    continue;
                }
                let output =
                    self.found.old.iter().find(|old| old.spot == Spot::Entry(*entry)).and_then(|old| {
                        old.removed.outputs.get(self.plan.values[value].output).map(|(output, _)| *output)
                    });
                let mut new = format!("{name}_{}", output.unwrap_or("value"));
                while self.scope.has(&new) || taken.contains(&new) {
                    new.push('_');
                }
                taken.insert(new.clone());
                self.plan.values[value].name = new;
            }
        }
    }

    pub(super) fn write(&self) -> Rewritten {
        let mut rewritten = Rewritten::default();
        let tree = self.scope.body.tree();
        let text = tree.text();
        let edits = &mut rewritten.edits;
        for place in &self.plan.places {
            // A value that stays may have another name than its output had.
            if !place.changed && place.was == self.plan.text(&place.formula) {
                continue;
            }
            let mut new = self.plan.place_text(&place.formula, place.holds);
            if new.starts_with("\"=") {
                let indent = text[place.line..].len() - text[place.line..].trim_start_matches(' ').len();
                new = self.laid_out(&place.formula, column(text, place.range.start), indent);
            }
            let inside = tree.comments_in(place.range.clone()).map(|comment| format!("{}\n", text[comment].trim_end()));
            let comments: String = if place.was.is_empty() { inside.collect() } else { String::new() };
            edits.replace(place.range.clone(), format!("{comments}{new}"));
        }
        for old in &self.found.old {
            kind_edits(old, edits);
        }
        edits.sort();
        self.write_entries(&mut rewritten);
        for old in &self.found.old {
            let message = self.message(old);
            rewritten.changes.push(Change { range: old.node.range(), message });
        }
        rewritten
    }

    fn write_entries(&self, rewritten: &mut Rewritten) {
        let text = self.scope.body.tree().text();
        let newline = if text.contains("\r\n") { "\r\n" } else { "\n" };
        let mut lines: HashMap<Option<usize>, Vec<String>> = HashMap::new();
        let mut moved: HashMap<usize, Vec<Range<usize>>> = HashMap::new();
        for old in self.found.old.iter().rev() {
            for hoisted in self.converter.hoisted.get(&old.node.index()).into_iter().flatten() {
                let call = rewritten.edits.apply(text, hoisted.range.clone());
                lines.entry(old.entry).or_default().push(format!("\"{}\": {call}", hoisted.name));
                old.entry.into_iter().for_each(|entry| moved.entry(entry).or_default().push(hoisted.range.clone()));
            }
        }
        let mut removed = Vec::new();
        for (index, entry) in self.scope.entries.iter().enumerate() {
            let mut new = lines.remove(&Some(index)).unwrap_or_default();
            let range = entry.node.range();
            let start = line_start(text, range.start);
            let indent = &text[start..range.start];
            let indent = if indent.trim().is_empty() { indent } else { "" };
            let between = format!(",{newline}{indent}");
            let Some(values) = self.plan.of_entry.get(&index) else {
                if !new.is_empty() {
                    rewritten.edits.replace(range.start..range.start, new.join(&between) + &between);
                }
                continue;
            };
            let live = values.iter().map(|value| &self.plan.values[*value]).filter(|value| !value.gone);
            new.extend(live.map(|value| self.entry_text(value, indent.chars().count())));
            if new.is_empty() {
                removed.push(with_line(text, range));
                continue;
            }
            let moved = moved.remove(&index).unwrap_or_default();
            let comments = lines_of(entry.value, &moved);
            let comments: String = comments.iter().map(|comment| format!("{comment}{newline}{indent}")).collect();
            rewritten.edits.replace(range, comments + &new.join(&between));
        }
        for range in removals(text, removed) {
            rewritten.edits.replace(range, "");
        }
        if let (Some(more), Some(nodes)) = (lines.remove(&None), self.scope.nodes) {
            // After the last entry, or after the opening bracket.
            let tokens = nodes.tokens();
            let last = tokens.len().checked_sub(2).and_then(|at| tokens.get(at));
            let comma = last.is_some_and(|last| !matches!(&text[last.range()], "," | "{"));
            let at = last.map_or(nodes.range().start + 1, |last| last.end());
            let first = if comma { "," } else { "" };
            let lines: String = more.iter().map(|line| format!("{newline}    {line},")).collect();
            rewritten.edits.replace(at..at, format!("{first}{lines}"));
        }
        rewritten.edits.sort();
    }

    /// An entry with a formula.
    fn entry_text(&self, value: &Value, indent: usize) -> String {
        let column = indent + value.name.chars().count() + "\"\": ".len();
        format!("\"{}\": {}", value.name, self.laid_out(&value.formula, column, indent))
    }

    /// A formula, in several lines if it is long.
    fn laid_out(&self, formula: &Formula, column: usize, indent: usize) -> String {
        literal(&format!("= {}", self.plan.text(formula)), column, indent + 2)
    }

    fn message(&self, old: &Old<'_>) -> String {
        let kind = old.removed.kind;
        if let Rewrite::Kind { kind: new, .. } = &old.removed.rewrite {
            return format!("`{kind}` is `{new}`");
        }
        let Spot::Entry(entry) = old.spot else { return format!("`{kind}` is a formula in its place") };
        let name = &self.scope.entries[entry].name;
        if self.is_gone(entry) {
            return format!("`{name}` (`{kind}`) is written where it is read");
        }
        format!("`{name}` (`{kind}`) is a formula")
    }
}

/// Renames a kind and its fields, and adds fields whose default is another one.
pub(super) fn kind_edits(old: &Old<'_>, edits: &mut Edits) {
    let Rewrite::Kind { kind, renamed, added } = &old.removed.rewrite else { return };
    let (Some(word), Some(body)) = (old.node.tokens().first(), old.node.body()) else { return };
    edits.replace(word.range(), *kind);
    for (from, to) in *renamed {
        if let Some(key) = body.entry(from).and_then(Node::key) {
            edits.replace(key.range(), *to);
        }
    }
    for (field, value) in *added {
        let tokens = body.tokens();
        if body.entry(field).is_some() || tokens.len() < 2 {
            continue;
        }
        let last = &tokens[tokens.len() - 2];
        let comma = if matches!(&old.node.tree().text()[last.range()], "," | "(") { "" } else { ", " };
        edits.replace(last.end()..last.end(), format!("{comma}{field}: {value}"));
    }
}
