//! Decides which formulas are written where their values are read, and which keep a node.
use super::bounds::{Bounds, bounds};
use super::formula::Formula;
use super::places::Holds;
use super::scope::Scope;
use super::terms::call;
use super::words::{Base, Name, Word, closing};
use std::collections::{BTreeMap, HashMap};
use std::ops::Range;

/// The longest line.
const WIDTH: usize = 120;
/// The longest formula that others become a part of.
const LONGEST: usize = 110;
/// The most operations of a formula that others become a part of.
const MOST_OPERATIONS: usize = 14;
/// The deepest brackets of a formula that others become a part of.
const DEEPEST: usize = 3;

/// An output of a node that becomes a formula.
#[derive(Clone, Debug)]
pub(super) struct Value {
    /// The index of its node in `nodes`.
    pub(super) entry: usize,
    /// The index of the output.
    pub(super) output: usize,
    /// The name by which formulas call it.
    pub(super) name: String,
    /// The formula.
    pub(super) formula: Formula,
    /// True if something reads it.
    pub(super) read: bool,
    /// True if it must keep its node.
    pub(super) pinned: bool,
    /// True if nothing is left of it.
    pub(super) gone: bool,
    /// The column of the formula in its line.
    pub(super) column: usize,
    /// The formulas and places that read it, once for each use.
    pub(super) users: Vec<Holder>,
    bounds: Bounds,
}

impl Value {
    /// A value.
    pub(super) fn new(entry: usize, output: usize, name: String, formula: Formula, column: usize) -> Self {
        Self {
            entry,
            output,
            name,
            formula,
            read: false,
            pinned: false,
            gone: false,
            column,
            bounds: Bounds::ANY,
            users: Vec::new(),
        }
    }
}

/// A place that reads values.
#[derive(Clone, Debug)]
pub(super) struct Place {
    /// The text of the place.
    pub(super) range: Range<usize>,
    /// The formula; a name if it is a wire.
    pub(super) formula: Formula,
    /// The values that it may have.
    pub(super) holds: Holds,
    /// Index of the entry of `nodes` that contains it.
    pub(super) entry: Option<usize>,
    /// Its text so far; empty if it is a node that is replaced.
    pub(super) was: String,
    /// True if its formula has changed.
    pub(super) changed: bool,
    /// Start of its line.
    pub(super) line: usize,
    /// Width of its line without the text of the place.
    pub(super) around: usize,
}

/// Something that has a formula.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Holder {
    /// A value.
    Value(usize),
    /// A place.
    Place(usize),
}

/// The lines around an entry, up to the next blank line or comment.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Run {
    /// Its number.
    pub(super) number: usize,
    /// True if a comment stands above it.
    pub(super) has_comment: bool,
    /// True if its paragraph has a comment up to here.
    pub(super) described: bool,
}

/// The values and places of a graph.
pub(super) struct Plan<'s, 't> {
    pub(super) scope: &'s Scope<'t>,
    pub(super) values: Vec<Value>,
    pub(super) places: Vec<Place>,
    /// The values of each entry that is replaced, by output.
    pub(super) of_entry: BTreeMap<usize, Vec<usize>>,
    /// The widths of lines with places, by their start.
    pub(super) widths: HashMap<usize, usize>,
    /// The run of each entry.
    runs: Vec<Run>,
}

impl<'s, 't> Plan<'s, 't> {
    /// A plan without decisions.
    pub(super) fn new(scope: &'s Scope<'t>, values: Vec<Value>, places: Vec<Place>, runs: Vec<Run>) -> Self {
        let mut of_entry: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (index, value) in values.iter().enumerate() {
            of_entry.entry(value.entry).or_default().push(index);
        }
        Self { scope, values, places, of_entry, widths: HashMap::new(), runs }
    }

    /// The text of a name.
    pub(super) fn spell(&self, name: &Name) -> String {
        let base = match &name.base {
            Base::Text(text) | Base::New(text) => text,
            Base::Value(index) => &self.values[*index].name,
        };
        format!("{base}{}", name.rest)
    }

    /// The text of a formula.
    pub(super) fn text(&self, formula: &Formula) -> String {
        formula.text(&|name| self.spell(name))
    }

    /// The formula of a holder.
    pub(super) fn formula(&self, holder: Holder) -> &Formula {
        match holder {
            Holder::Value(index) => &self.values[index].formula,
            Holder::Place(index) => &self.places[index].formula,
        }
    }

    fn set(&mut self, holder: Holder, formula: Formula) {
        match holder {
            Holder::Value(index) => self.values[index].formula = formula,
            Holder::Place(index) => {
                self.places[index].formula = formula;
                self.places[index].changed = true;
            }
        }
    }

    /// All values and places.
    pub(super) fn holders(&self) -> Vec<Holder> {
        let values = (0..self.values.len()).map(Holder::Value);
        values.chain((0..self.places.len()).map(Holder::Place)).collect()
    }

    /// Makes all decisions, except those about values below comments.
    pub(super) fn decide(&mut self) {
        let order = self.order();
        self.mark_read();
        let all: Vec<Holder> =
            order.iter().copied().map(Holder::Value).chain((0..self.places.len()).map(Holder::Place)).collect();
        for holder in &all {
            self.put_atoms(*holder);
        }
        self.count();
        self.measure();
        for holder in all {
            self.limit(holder);
            // A name that stands for another one reads nothing any more.
            if !matches!(holder, Holder::Value(index) if self.values[index].gone) {
                self.put_values(holder);
            }
            if let Holder::Value(index) = holder {
                self.values[index].bounds = self.bounds_of(&self.values[index].formula);
            }
        }
    }

    /// Puts names, parameters and numbers in the place of the values that are nothing else.
    fn put_atoms(&mut self, holder: Holder) {
        let formula = self.formula(holder);
        let whole = formula.words.len() == 1;
        let holds = match holder {
            Holder::Value(_) => Holds::Formula,
            Holder::Place(index) => self.places[index].holds,
        };
        let mut changed = false;
        let put = formula.replaced(&mut |name| {
            let Base::Value(index) = name.base else { return None };
            let value = &self.values[index];
            let fits = match holds {
                Holds::Formula => true,
                // A number is no output.
                Holds::Output | Holds::Path => whole && self.is_path(&value.formula),
            };
            let takes = fits && !value.pinned && value.formula.is_atom();
            changed |= takes;
            takes.then(|| value.formula.clone())
        });
        if changed {
            self.set(holder, put);
        }
    }

    /// True if a formula is the path of a value, which may be written without an equals sign.
    pub(super) fn is_path(&self, formula: &Formula) -> bool {
        match &formula.words[..] {
            [Word::Name(name)] => match &name.base {
                Base::Text(text) => self.scope.has(text.split('.').next().unwrap_or(text)),
                Base::New(_) | Base::Value(_) => true,
            },
            _ => false,
        }
    }

    fn bounds_of(&self, formula: &Formula) -> Bounds {
        let name = |name: &Name| match name.base {
            Base::Value(index) => self.values[index].bounds.read(),
            _ => Bounds::ANY,
        };
        bounds(formula, &name, &|param| self.scope.range_of(param))
    }

    /// Writes the limits that are needed: `positive(x)` as `max(x, 0)`, `saturated(x)` as `clamp(x, 0, 1)`.
    fn limit(&mut self, holder: Holder) {
        let mut words = self.formula(holder).words.clone();
        let mut changed = false;
        while let Some(at) = words.iter().position(is_limit) {
            let Some(close) = closing(&words, at + 1) else { return };
            let inner = Formula { words: words[at + 2..close].to_vec() };
            let bounds = self.bounds_of(&inner);
            let unit = matches!(&words[at], Word::Function(name) if name == "saturated");
            let idle = if unit { bounds.is_unit() } else { bounds.finite && bounds.lo >= 0.0 };
            let limited = match (idle, unit) {
                (true, _) => inner,
                (false, true) => call("clamp", vec![inner, Formula::number("0"), Formula::number("1")]),
                (false, false) => call("max", vec![inner, Formula::number("0")]),
            };
            // A name stands for the call, so that brackets are added where they are needed.
            let hole = "limited";
            words.splice(at..=close, [Word::Name(Name { base: Base::New(hole.to_owned()), rest: String::new() })]);
            let is_hole = |name: &Name| matches!(&name.base, Base::New(text) if text == hole);
            words = Formula { words }.replaced(&mut |name| is_hole(name).then(|| limited.clone())).words;
            changed = true;
        }
        if changed {
            self.set(holder, Formula { words });
        }
    }

    /// Puts the formulas of values that only this formula reads into it, small ones first.
    fn put_values(&mut self, holder: Holder) {
        let candidates = self.formula(holder).names().filter_map(|name| match name.base {
            Base::Value(index) => Some(index),
            _ => None,
        });
        let candidates = candidates.filter(|index| {
            let value = &self.values[*index];
            !value.pinned && !value.gone && value.users.len() == 1
        });
        let mut candidates: Vec<usize> = candidates.collect();
        candidates.sort_by_key(|index| self.values[*index].formula.words.len());
        for index in candidates {
            self.put_value(holder, index);
        }
    }

    /// Puts the formula of a value into the only formula that reads it; returns false if it does not fit.
    fn put_value(&mut self, holder: Holder, index: usize) -> bool {
        let (before, inner) = (self.formula(holder), &self.values[index].formula);
        if inner.words.len() > LONGEST || before.words.len() > LONGEST {
            return false;
        }
        let whole = matches!(&before.words[..], [Word::Name(name)] if name.rest.is_empty());
        let put = before.replaced(&mut |name| (name.base == Base::Value(index)).then(|| inner.clone()));
        let run = self.runs.get(self.values[index].entry).copied().unwrap_or_default();
        let allowed = match holder {
            Holder::Value(_) => true,
            Holder::Place(place) => match self.places[place].holds {
                // A comment describes the lines below it, so the formula stays below it.
                Holds::Formula if run.has_comment => {
                    self.places[place].entry.is_some_and(|entry| self.runs[entry].number == run.number)
                }
                Holds::Formula => true,
                Holds::Output => !run.described,
                Holds::Path => false,
            },
        };
        let fits = whole
            || (self.values[index].bounds.finite
                && inner.binds() > 0
                && put.operations() <= MOST_OPERATIONS
                && put.depth() <= DEEPEST
                && self.text(&put).chars().count() <= LONGEST);
        let Some(width) = self.fits_line(holder, &put).filter(|_| allowed && fits) else { return false };
        if let Holder::Place(place) = holder {
            self.widths.insert(self.places[place].line, width);
        }
        self.set(holder, put);
        self.values[index].gone = true;
        // The holder now reads the inputs of the value.
        let read: Vec<usize> = self.values[index].formula.names().filter_map(value_of).collect();
        for inner in read {
            for user in &mut self.values[inner].users {
                if *user == Holder::Value(index) {
                    *user = holder;
                }
            }
        }
        true
    }

    /// The width of the line of a holder with another formula; `None` if it is too long.
    fn fits_line(&self, holder: Holder, put: &Formula) -> Option<usize> {
        let width = match holder {
            // Closing quote and comma.
            Holder::Value(index) => self.values[index].column + self.text(put).chars().count() + 2,
            Holder::Place(index) => {
                let place = &self.places[index];
                let [old, new] =
                    [&place.formula, put].map(|formula| self.place_text(formula, place.holds).chars().count());
                (self.widths.get(&place.line).copied().unwrap_or(0) + new).saturating_sub(old)
            }
        };
        (width <= WIDTH).then_some(width)
    }

    /// The text of a place with a formula: a path or a literal where the formula is nothing else.
    pub(super) fn place_text(&self, formula: &Formula, holds: Holds) -> String {
        let text = self.text(formula);
        if formula.literal().is_some() && holds == Holds::Formula {
            return text;
        }
        let is_value = matches!(formula.words[..], [Word::Param(_) | Word::Color(_)]);
        let plain = self.is_path(formula) || (is_value && holds == Holds::Formula);
        if plain { format!("\"{text}\"") } else { format!("\"= {text}\"") }
    }

    /// Puts a value below a comment into the node that takes its place below the comment; returns true if it did.
    pub(super) fn put_below_comment(&mut self, index: usize, next: usize) -> bool {
        let within = |plan: &Self, holder: &Holder| match *holder {
            Holder::Value(user) => plan.values[user].entry == next,
            Holder::Place(place) => plan.places[place].entry == Some(next),
        };
        let users = self.values[index].users.clone();
        if users.is_empty() || self.values[index].gone || !users.iter().any(|user| within(self, user)) {
            return false;
        }
        if self.values[index].formula.is_atom() {
            self.values[index].pinned = false;
            users.iter().for_each(|user| self.put_atoms(*user));
            let left = users.iter().any(|user| self.formula(*user).names().any(|name| name.base == Base::Value(index)));
            self.values[index].gone = !left;
            let read: Vec<usize> = self.values[index].formula.names().filter_map(value_of).collect();
            for inner in read {
                self.values[inner].users.retain(|user| left || *user != Holder::Value(index));
                self.values[inner].users.extend(&users);
            }
            return !left;
        }
        matches!(users[..], [user] if self.put_value(user, index))
    }
}

/// The index of the value that a name means.
pub(super) fn value_of(name: &Name) -> Option<usize> {
    match name.base {
        Base::Value(index) => Some(index),
        _ => None,
    }
}

fn is_limit(word: &Word) -> bool {
    matches!(word, Word::Function(name) if name == "saturated" || name == "positive")
}
