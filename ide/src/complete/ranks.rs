//! Ranks of the names that a formula may have in a place.
//!
//! The rank of a name is a sum of facts, each times a weight. Some facts are counted in the library graphs: how likely a name of
//! this class, this function, or a node of this kind is between such words and in such a field. The others are of this graph:
//! the type of the name, its uses, its distance, and its likeness to the field or the node. The weights make the sum the
//! logarithm of a likelihood. `fits_weights` in the tests computes them from the shipped graphs, in which names
//! are deleted with and without the text behind them.
use super::super::expect::Expect;
use super::super::file::Section;
use super::super::habits::{Class, Place, kind_of};
use super::super::view::Item;
use super::references::shares;
use super::uses::{Here, Uses, first};
use super::{Ask, Completion, Sort};
use std::collections::HashMap;

/// Number of facts.
pub(crate) const FACTS: usize = 23;

/// Index of the penalty for the type among the facts.
#[cfg(test)]
pub(crate) const TYPE: usize = 1;

/// Weights of each fact: for local names, parameters, nodes, functions, and positions.
#[rustfmt::skip]
pub(crate) const WEIGHTS: [[f64; 5]; FACTS] = [
    // Always.
    [3.12, -0.98, 0.91, 0.35, 1.37],
    // The penalty for the type; this weight is chosen, because few shipped graphs mix types.
    [-0.50, -0.50, -0.50, -0.50, -0.50],
    // The rank of a node as a reference.
    [0.00, 0.00, -0.24, 0.00, 0.00],
    // The likelihood of the class by the words before; factors by the words behind and by the field.
    [0.17, 0.61, 0.74, 0.84, 0.35],
    [0.09, 1.21, -0.13, 2.14, 0.36],
    [0.32, 0.59, 2.92, 0.74, 0.28],
    // The likelihood of the word in its class by the words before; factors by the words behind, by the values that follow,
    // and by the name of the field or node. Of a node, its kind is counted.
    [0.00, 0.00, 0.11, 0.37, 0.51],
    [0.00, 0.00, 0.28, 0.48, 0.64],
    [0.00, 0.00, 0.00, 0.56, 0.00],
    [0.00, 0.00, 0.32, 0.60, 0.44],
    // Used in the graph; used in this formula.
    [2.22, 0.42, -0.19, 1.95, -0.24],
    [-2.02, -1.39, -1.52, -1.01, -1.94],
    // Used behind the same word; behind the same two; between the same two; before the same two.
    [1.20, 0.65, 0.91, 0.54, -0.46],
    [0.40, 0.94, 0.75, 0.54, 1.57],
    [0.39, 0.29, 0.17, 0.18, 0.14],
    [1.06, 1.33, 0.07, 0.47, 0.61],
    // Used beside the other names of the formula; used near.
    [0.31, 0.54, 0.51, 0.26, 0.89],
    [1.24, 3.61, 2.38, 2.37, 2.93],
    // Unread, and to be read before the other unread names; beside the last name or parameter, or before the next name.
    [-0.86, 3.31, 1.85, 0.00, 0.00],
    [0.00, 0.30, 1.04, 0.00, 0.00],
    // Not used by any path; the number of uses by any path.
    [0.79, 0.36, 0.60, 1.18, -0.90],
    [-1.41, -0.42, -0.07, -0.46, -0.22],
    // It resembles the field or the node.
    [0.00, 1.35, 0.31, 0.26, 0.00],
];

/// Penalty for a name that is no function before brackets.
const NOT_CALLED: f64 = 30.0;

/// Penalty for the type from which on the rest of it is no fact with a weight, but part of the rank.
const UNFIT: f64 = 12.0;

/// A name that may stand in the place. Its score is the penalty for its type.
pub(super) struct Candidate {
    pub offer: Completion,
    pub class: Class,
    /// The rank of a node as the only reference of a field, without the penalty for its type.
    pub wire: f64,
}

/// The parts of the rank of a name.
#[cfg(test)]
pub(crate) struct Ranked {
    pub label: String,
    pub class: Class,
    pub facts: [f64; FACTS],
    /// Penalty without a weight.
    pub unfit: f64,
}

impl<'a> Ask<'a> {
    /// Sets the scores of the names.
    pub(super) fn ranked(&mut self, expect: Expect<'a>, place: &Place<'_>, found: Vec<Candidate>) -> Vec<Completion> {
        let facts = self.facts(expect, place, &found);
        let ranked = |(one, facts): (Candidate, [f64; FACTS])| {
            let Candidate { offer, class, .. } = one;
            let sum: f64 = facts.iter().zip(&WEIGHTS).map(|(fact, weights)| fact * weights[class as usize]).sum();
            let apart = place.around.called && class != Class::Function;
            let unfit = (offer.score - UNFIT).max(0.0) + if apart { NOT_CALLED } else { 0.0 };
            #[cfg(test)]
            self.ranked.push(Ranked { label: offer.label.clone(), class, facts, unfit });
            Completion { score: unfit - sum, ..offer }
        };
        found.into_iter().zip(facts).map(ranked).collect()
    }

    /// The facts about each name.
    fn facts(&self, expect: Expect<'a>, place: &Place<'_>, found: &[Candidate]) -> Vec<[f64; FACTS]> {
        let file = self.cx.file;
        let nodes = file.entries(Section::Nodes);
        let me = nodes.partition_point(|item| item.range.start <= self.at).checked_sub(1);
        let me = me.filter(|index| self.at <= nodes[*index].range.end);
        let uses = Uses::of(self.cx, &Here { at: self.at, entry: me, around: place.around });
        let position = |path: &str| file.position(Section::Nodes, first(path));
        let [last, next] = [uses.last, uses.next].map(|name| name.and_then(position));
        let param = |name: &str| file.position(Section::Params, name.strip_prefix('$')?);
        let last_param = uses.last_param.and_then(param);
        // Unread names, numbered from the one to read next: the nearest node above, the first parameter, the last local name.
        let above = nodes[..me.unwrap_or(nodes.len())].iter().rev().filter_map(Item::name);
        let above = numbered(above.filter(|name| uses.node(name) == 0));
        let params = file.names(Section::Params);
        let params = numbered(params.filter(|name| uses.name(&format!("${name}")).is_none()));
        let locals = found.iter().rev().filter(|one| one.class == Class::Local && one.offer.sort == Sort::Value);
        let locals = locals.map(|one| one.offer.label.as_str());
        let locals = numbered(locals.filter(|name| uses.name(name).is_none_or(|tally| tally.here == 0)));
        let (field, own) = (self.port_name(expect), me.and_then(|me| nodes[me].name()).unwrap_or_default());
        let habits = self.cx.world.habits();
        let classes = Class::ALL.map(|class| habits.class(place, class));
        let facts = |one: &Candidate| {
            let label = one.offer.label.as_str();
            let tally = uses.name(label).cloned().unwrap_or_default();
            let name = first(label);
            let paths = uses.node(name);
            let index = position(label).filter(|_| one.class == Class::Node);
            let [before, behind, by_field] = classes[one.class as usize];
            let [word, word_behind, given, named] = match one.class {
                Class::Function | Class::Place => habits.word(place, one.class, label),
                Class::Node => habits.word(place, one.class, &kind_of(file, label)),
                Class::Local | Class::Param => [0.0; 4],
            };
            let step = |other: Option<usize>| index.zip(other).map_or(0, |(index, other)| index.abs_diff(other));
            let (unread, beside_last) = match one.class {
                Class::Node => (&above, near(step(last)) + flag(step(next) == 1)),
                Class::Param => {
                    (&params, param(label).zip(last_param).map_or(0.0, |(one, last)| near(one.abs_diff(last))))
                }
                _ => (&locals, 0.0),
            };
            let unread = unread.get(name.trim_start_matches('$'));
            let bare = name.trim_start_matches('$');
            [
                1.0,
                one.offer.score.min(UNFIT),
                one.wire.clamp(-UNFIT, UNFIT),
                before,
                behind,
                by_field,
                word,
                word_behind,
                given,
                named,
                flag(tally.all > 0),
                flag(tally.here > 0),
                ln(tally.behind),
                ln(tally.behind_two),
                ln(tally.between),
                ln(tally.ahead),
                ln(tally.beside),
                tally.nearest.map_or(0.0, |nearest| near(1 + nearest)),
                unread.map_or(0.0, |before| near(1 + before)),
                beside_last,
                flag(paths == 0),
                ln(paths),
                flag(!field.is_empty() && bare == field) + flag(shares(bare, field) || shares(bare, own)),
            ]
        };
        found.iter().map(facts).collect()
    }
}

fn numbered<'n>(names: impl Iterator<Item = &'n str>) -> HashMap<&'n str, usize> {
    names.enumerate().map(|(index, name)| (name, index)).collect()
}

/// One over a distance; 0 for none.
fn near(distance: usize) -> f64 {
    if distance == 0 { 0.0 } else { 1.0 / distance as f64 }
}

fn ln(count: usize) -> f64 {
    (1.0 + count as f64).ln()
}

fn flag(is: bool) -> f64 {
    f64::from(u8::from(is))
}
