//! Verifies a graph against its entry in `shibo.lock`. Source: LASTING §1, *Commands*.
use super::file::Entry;
use super::sample::{Look, Sample};
use crate::diff;
use serde::{Deserialize, Serialize};
use shibo_graph::Graph;
use shibo_node::changes::{self, Changes, Thing};
use std::collections::BTreeSet;

/// The smallest difference that is told, in 1/255.
const LEAST_SEEN: f64 = 0.05;

/// The result for a graph or a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum State {
    /// The bits are the same.
    Same,
    /// A node or a shipped graph has changed since the graph was pinned.
    Changed,
    /// The text, an import or a file has been edited since.
    Edited,
    /// Neither has happened, and yet the bits differ.
    Defect,
    /// The entry was made by a program that knows later changes.
    Newer,
    /// The lock has no picture to compare with.
    NotPinned,
    /// The lock cannot be read.
    BadFile,
}

/// A graph against its entry.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Verified {
    /// The result for the graph.
    pub state: State,
    /// The pictures, by name.
    pub pictures: Vec<VerifiedPicture>,
    /// The changes of nodes and shipped graphs since the graph was pinned that alter it.
    pub because: Vec<Because>,
    /// The paths of files and imports that were edited, added or removed.
    pub files: Vec<String>,
    /// True if the text was edited, apart from comments, layout and order; also if it was pinned at an earlier change, or holds
    /// other versions.
    pub text_edited: bool,
    /// The edits of the text, where the pinned text is known.
    pub edits: Vec<diff::Change>,
}

/// A picture against its entry.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct VerifiedPicture {
    /// Its name.
    pub name: String,
    /// Its result.
    pub state: State,
    /// The difference in words; empty if there is none.
    pub words: Vec<String>,
}

/// A change that alters a graph.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Because {
    /// The number of the change.
    pub change: u32,
    /// The kind or the shipped graph that changed; none for the way every picture is made.
    pub kind: Option<String>,
    /// Its version now.
    pub version: u32,
    /// The description of the change.
    pub says: String,
    /// The first node that it alters.
    pub node: String,
    /// The line of that node in its file, counted from 1.
    pub line: usize,
}

impl Verified {
    /// A graph whose lock cannot be read. Nothing is compared.
    pub fn unread() -> Self {
        Self {
            state: State::BadFile,
            pictures: Vec::new(),
            because: Vec::new(),
            files: Vec::new(),
            text_edited: false,
            edits: Vec::new(),
        }
    }

    /// True if all pictures have the same bits.
    pub fn is_same(&self) -> bool {
        self.state == State::Same
    }
}

/// Compares a graph as it is with its entry in the lock.
pub fn verified(changes: &Changes, graph: &Graph, then: Option<&Entry>, now: &Entry) -> Verified {
    let Some(then) = then else {
        let unknown =
            |name: &String| VerifiedPicture { name: name.clone(), state: State::NotPinned, words: Vec::new() };
        let pictures = now.pictures.keys().map(unknown).collect();
        let (because, files) = (Vec::new(), Vec::new());
        return Verified { state: State::NotPinned, pictures, because, files, text_edited: false, edits: Vec::new() };
    };
    let because = because(changes, graph, then.pins);
    let paths: BTreeSet<&String> = then.files.keys().chain(now.files.keys()).collect();
    let files: Vec<String> =
        paths.into_iter().filter(|path| then.files.get(*path) != now.files.get(*path)).cloned().collect();
    // A pin that was raised is a reason only by the changes since then.
    let text_edited = then.text != now.text || now.pins < then.pins;
    let reason = match (because.is_empty(), text_edited || !files.is_empty()) {
        _ if then.pins > changes.newest() => State::Newer,
        (false, _) => State::Changed,
        (true, true) => State::Edited,
        (true, false) => State::Defect,
    };
    let names: BTreeSet<&String> = then.pictures.keys().chain(now.pictures.keys()).collect();
    let picture = |name: &String| {
        let (state, words) = match (then.pictures.get(name), now.pictures.get(name)) {
            (Some(then), Some(now)) if then.bits == now.bits => (State::Same, Vec::new()),
            (Some(then), Some(now)) => (reason, words(then, now)),
            (None, _) => (State::NotPinned, Vec::new()),
            (_, None) => (reason, vec!["it is gone".to_owned()]),
        };
        VerifiedPicture { name: name.clone(), state, words }
    };
    let pictures: Vec<VerifiedPicture> = names.into_iter().map(picture).collect();
    let has = |state: State| pictures.iter().any(|picture| picture.state == state);
    let state = match (has(reason), has(State::NotPinned)) {
        (true, _) => reason,
        (false, true) => State::NotPinned,
        (false, false) => State::Same,
    };
    Verified { state, pictures, because, files, text_edited, edits: Vec::new() }
}

/// The changes after a number that alter a graph.
fn because(changes: &Changes, graph: &Graph, pins: u32) -> Vec<Because> {
    let looks = changes.since(pins).filter(|change| change.look != changes::Look::Names);
    let altering = looks.filter_map(|change| {
        let node = graph.altered_by(change).next()?;
        let kind = match change.thing() {
            Thing::Kind(name) | Thing::Graph(name) => Some(name.to_owned()),
            Thing::All => None,
        };
        Some(Because {
            change: change.change,
            kind,
            version: change.version,
            says: change.what.clone(),
            node: node.name.clone(),
            line: graph.sources.position(node.span.file, node.span.start).line,
        })
    });
    altering.collect()
}

/// The difference of two pictures in words. It needs only their descriptions, so the program that made the first may be gone.
fn words(then: &Sample, now: &Sample) -> Vec<String> {
    if then.look.is_empty() || then.look.len() != now.look.len() {
        return vec!["other data".to_owned()];
    }
    let mean = |looks: &[Look], of: fn(&Look) -> f64| looks.iter().map(of).sum::<f64>() / looks.len() as f64;
    let both = |of: fn(&Look) -> f64| (mean(&then.look, of), mean(&now.look, of));
    let mut words = Vec::new();
    let (before, after) = both(|look| look.0);
    if (after - before).abs() >= LEAST_SEEN {
        let way = if after > before { "higher" } else { "lower" };
        words.push(format!("mean {way} by {:.1} of 255", (after - before).abs()));
    }
    for (name, (before, after)) in [("contrast", both(|look| look.1)), ("fine detail", both(|look| look.2))] {
        let percent = 100.0 * (after / before.max(1e-9) - 1.0);
        if before.max(after) >= LEAST_SEEN && percent.abs() >= 1.0 {
            words.push(format!("{name} {percent:+.0} %"));
        }
    }
    if words.is_empty() {
        words.push("other details".to_owned());
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample(bits: &str, mean: f64, deviation: f64) -> Sample {
        Sample { bits: bits.into(), look: vec![Look(mean, deviation, 0.5 * deviation, 1.0, 1.0)] }
    }

    #[test]
    fn describes_differences() {
        let then = sample("0", 100.0, 20.0);
        assert_eq!(words(&then, &sample("1", 97.9, 20.0)), ["mean lower by 2.1 of 255"]);
        assert_eq!(words(&then, &sample("1", 100.0, 23.0)), ["contrast +15 %", "fine detail +15 %"]);
        assert_eq!(words(&then, &sample("1", 100.0, 20.0)), ["other details"]);
        assert_eq!(words(&then, &Sample::default()), ["other data"]);
    }
}
