//! Statistics of the library graphs: frequencies of kinds, fields, choices and connections. Completion ranks common
//! ones first.
use super::view::Item;
use std::collections::HashMap;

/// Counts of observations.
#[derive(Debug, Default)]
pub struct Habits(HashMap<String, u32>);

impl Habits {
    pub(crate) fn add(&mut self, parts: &[&str]) {
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

    /// Penalty for a word of this class after another word of a formula; smaller for frequent ones.
    pub(crate) fn word(&self, point: bool, before: &str, class: &str) -> f64 {
        let role = if point { "point" } else { "value" };
        let count = self.get(&["word", role, before, class]);
        -1.2 * ((count + 1.0) / (self.get(&["words", role, before]) + 6.0)).ln()
    }

    /// Penalty for a function or a position in formulas; smaller for frequent ones.
    pub(crate) fn name(&self, name: &str) -> f64 {
        -1.2 * ((self.get(&["called", name]) + 0.5) / (self.get(&["calls"]) + 20.0)).ln()
    }

    /// Bonus for a parameter, a function or a position after another word of a formula.
    pub(crate) fn after(&self, before: &str, name: &str) -> f64 {
        0.7 * (1.0 + self.get(&["after", before, name])).ln()
    }

    /// Frequency with which a parameter of this name is used for a field.
    pub fn param(&self, field: &str, name: &str) -> f64 {
        self.get(&["param", field, name])
    }
}

/// Class of a word in the counts of formulas.
pub(crate) mod class {
    pub(crate) const FUNCTION: &str = "function";
    pub(crate) const NODE: &str = "node";
    pub(crate) const PARAM: &str = "param";
    pub(crate) const PLACE: &str = "place";
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
