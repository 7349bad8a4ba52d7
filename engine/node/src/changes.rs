//! The table of changes: which version each kind and each shipped graph had after each change. Source: LASTING §1.
use crate::ron_options;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// All changes, in order. A graph that is pinned at a change means the versions that things had after it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Changes(Vec<Change>);

/// A change that alters pictures or names.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Change {
    /// Its number, from 1.
    pub change: u32,
    /// The kind of nodes that changed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kind: Option<String>,
    /// The shipped graph that changed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub graph: Option<String>,
    /// True if the way in which every picture is made changed.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub all: bool,
    /// The version of that thing since this change.
    pub version: u32,
    /// The largest change of a picture.
    pub look: Look,
    /// A description for users, without a full stop.
    pub what: String,
    /// The uses that can change.
    pub touches: Touches,
    /// The largest mean difference over the shipped graphs, from 0 to 1.
    pub worst: f64,
    /// The part of the version before that the program has.
    pub keeps: Keeps,
    /// The edit that answers the change, if there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub answer: Option<Answer>,
    /// True if that edit gives the same bits as the version before.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub exact: bool,
}

/// The largest change of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Look {
    /// At most 1/255 everywhere.
    Roundings,
    /// The picture.
    Look,
    /// Names in the text only.
    Names,
}

/// The uses of a thing that a change can alter.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Touches {
    /// All uses.
    All,
    /// Those in which one of these fields is written.
    Given(Vec<String>),
    /// Those in which the field has one of these values.
    Values(String, Vec<String>),
    /// Those that read one of these outputs.
    Outputs(Vec<String>),
}

impl Touches {
    /// True if a use is among them, given the text of each field that is written. A value that a formula or a parameter
    /// gives may be any.
    pub fn includes<'t>(&self, written: impl Fn(&str) -> Option<&'t str>) -> bool {
        match self {
            Self::All | Self::Outputs(_) => true,
            Self::Given(fields) => fields.iter().any(|field| written(field).is_some()),
            Self::Values(field, values) => written(field).is_some_and(|text| {
                let text = text.trim_matches('"').trim_start();
                text.starts_with(['$', '=']) || values.iter().any(|value| value == text)
            }),
        }
    }
}

/// The part of the version before a change that the program has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Keeps {
    /// The code of the kind.
    Kernel,
    /// The text of the graph.
    Text,
    /// Nothing.
    Gone,
}

/// An edit of a text that answers a change.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum Answer {
    /// Writes a value for a field that is not written.
    Set {
        /// The field.
        field: String,
        /// The value, as it stands in a graph file.
        value: String,
    },
    /// Renames a field.
    Rename {
        /// The name before.
        field: String,
        /// The name now.
        to: String,
    },
    /// Renames the kind.
    RenameKind {
        /// The name now.
        to: String,
    },
    /// Multiplies the numbers of a field.
    Scale {
        /// The field.
        field: String,
        /// The factor.
        by: f64,
    },
    /// Removes a field.
    Remove {
        /// The field.
        field: String,
    },
    /// Renames outputs.
    Outputs(BTreeMap<String, String>),
    /// Replaces a node by a formula.
    Formula(String),
}

/// A thing whose versions the table counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Thing<'a> {
    /// A kind of nodes.
    Kind(&'a str),
    /// A shipped graph.
    Graph(&'a str),
    /// The way in which every picture is made.
    All,
}

impl Change {
    /// The thing that changed.
    pub fn thing(&self) -> Thing<'_> {
        match (&self.kind, &self.graph) {
            (Some(kind), _) => Thing::Kind(kind),
            (None, Some(graph)) => Thing::Graph(graph),
            (None, None) => Thing::All,
        }
    }

    /// The description for messages, with the largest mean difference of a picture, from 0 to 1.
    pub fn difference(&self, worst: f64) -> String {
        let percent = worst * 100.0;
        let digits = usize::from(percent < 1.0);
        format!("{} (up to {percent:.digits$} % of full scale)", self.what)
    }
}

impl Changes {
    /// Reads the table from RON.
    ///
    /// # Errors
    /// The place of the error in the text, or the first line that breaks a rule of the table, as a message.
    pub fn read(text: &str) -> Result<Self, String> {
        let lines: Vec<Change> = ron_options().from_str(text).map_err(|error| error.to_string())?;
        let mut versions: BTreeMap<Thing<'_>, u32> = BTreeMap::new();
        for (line, number) in lines.iter().zip(1..) {
            if line.change != number {
                return Err(format!("change {} stands where change {number} must stand", line.change));
            }
            let named = [line.kind.is_some(), line.graph.is_some(), line.all];
            if named.into_iter().filter(|named| *named).count() != 1 {
                return Err(format!("change {number} must name one of `kind`, `graph` and `all`"));
            }
            if let Some(before) = versions.insert(line.thing(), line.version)
                && line.version != before + 1
            {
                return Err(format!("change {number} must have version {}", before + 1));
            }
            if line.version == 0 || !(0.0..=1.0).contains(&line.worst) {
                return Err(format!("change {number} needs a version from 1 and `worst` between 0 and 1"));
            }
        }
        Ok(Self(lines))
    }

    /// The number of the last change; 0 in an empty table.
    pub fn newest(&self) -> u32 {
        self.0.last().map_or(0, |line| line.change)
    }

    /// The changes after one, in order; all for 0.
    pub fn since(&self, change: u32) -> impl Iterator<Item = &Change> {
        self.0.iter().filter(move |line| line.change > change)
    }

    /// The version of a thing after a change, given its version now.
    pub fn version(&self, thing: Thing<'_>, now: u32, change: u32) -> u32 {
        let later = self.since(change).filter(|line| line.thing() == thing).count();
        now.saturating_sub(u32::try_from(later).unwrap_or(u32::MAX)).max(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TABLE: &str = r#"[
        (change: 1, all: true, version: 1, look: Look, what: "first", touches: All, worst: 0, keeps: Gone),
        (change: 2, kind: "Rays", version: 3, look: Look, what: "thin rays", touches: Given(["width"]), worst: 0.3, keeps: Kernel),
        (change: 3, graph: "goat", version: 2, look: Names, what: "outputs", touches: Outputs(["goat"]), worst: 0, keeps: Text, answer: Outputs({ "goat": "material" }), exact: true),
        (change: 4, kind: "Rays", version: 4, look: Roundings, what: "sums", touches: All, worst: 0.002, keeps: Gone, answer: Set(field: "even", value: "0")),
    ]"#;

    #[test]
    fn tells_the_version_after_a_change() {
        let changes = Changes::read(TABLE).unwrap();
        assert_eq!(changes.newest(), 4);
        let rays = |change| changes.version(Thing::Kind("Rays"), 4, change);
        assert_eq!([1, 2, 3, 4].map(rays), [2, 3, 3, 4]);
        assert_eq!(changes.version(Thing::Kind("Perlin"), 7, 1), 7);
        assert_eq!(changes.version(Thing::Graph("goat"), 2, 2), 1);
        let first = changes.since(1).next().unwrap();
        assert_eq!(first.difference(0.31), "thin rays (up to 31 % of full scale)");
        assert_eq!(first.difference(0.0014), "thin rays (up to 0.1 % of full scale)");
        assert_eq!(changes.since(2).map(|line| line.change).collect::<Vec<_>>(), [3, 4]);
    }

    #[test]
    fn values_of_formulas_may_be_any() {
        let touches = Touches::Values("mode".into(), vec!["Round".into()]);
        for (text, included) in [("Round", true), ("Flat", false), ("\"$mode\"", true), ("\"= a\"", true)] {
            assert_eq!(touches.includes(|field| (field == "mode").then_some(text)), included, "{text}");
        }
        assert!(!touches.includes(|_| None));
    }

    #[test]
    fn refuses_tables_that_break_a_rule() {
        for (from, to, says) in [
            ("change: 3", "change: 5", "change 5 stands where change 3 must stand"),
            ("kind: \"Rays\", version: 4", "version: 4", "change 4 must name one of"),
            ("kind: \"Rays\", version: 4", "all: true, kind: \"Rays\", version: 4", "change 4 must name one of"),
            ("version: 4", "version: 5", "change 4 must have version 4"),
            ("worst: 0.3", "worst: 30", "change 2 needs a version"),
            ("keeps: Text", "keeps: Nothing", "Nothing"),
        ] {
            let error = Changes::read(&TABLE.replace(from, to)).unwrap_err();
            assert!(error.contains(says), "{error}");
        }
    }
}
