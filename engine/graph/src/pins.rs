//! Pins: the versions of kinds that a graph means. Source: LASTING §1.
//!
//! `pins: 41` means the versions after change 41 of the table of changes; `hold` names other versions of some kinds. A file
//! without pins has those of the graph that uses it. A version that the program does not have is refused, unless the
//! change does not alter the node.
use super::part::{Entry, Shape, SyntaxValue};
use super::read::{self, mismatch, shorten};
use super::report::Report;
use super::schema;
use crate::diagnostics::{Code, Span, suggest};
use crate::node::changes::{Change, Changes, Look, Thing};
use crate::registry::Registry;

/// The pins of a graph file.
#[derive(Debug)]
pub(super) struct Pins {
    /// The number of the change.
    change: u32,
    /// Its place.
    place: SyntaxValue,
    /// The kinds with a version of their own.
    hold: Vec<(Entry, u32)>,
}

impl Pins {
    /// Reads `41` or `(change: 41, hold: { "Kind": 3 })`. `None` after an error.
    pub(super) fn read(part: &SyntaxValue, report: &mut Report) -> Option<Self> {
        if let Shape::Number(_) = part.shape() {
            return Some(Self { change: whole(part, "`pins`", report)?, place: part.clone(), hold: Vec::new() });
        }
        let fields = read::fields(part, "`pins`", schema::PINS, report)?;
        let Some(place) = read::get(&fields, "change") else {
            let error = part.error(Code::MissingInput, "`pins` needs `change`, the number of a change");
            report.push(error.help("`shibo changes` lists the changes"));
            return None;
        };
        let held = read::get(&fields, "hold").map(|hold| read::map(hold, "hold", report)).unwrap_or_default();
        let mut hold = Vec::new();
        for entry in read::unique(held, "kind", report) {
            let version = whole(&entry.value, "a version", report)?;
            hold.push((entry, version));
        }
        Some(Self { change: whole(place, "`change`", report)?, place: place.clone(), hold })
    }

    /// Reports numbers that the program does not know.
    pub(super) fn check(&self, registry: &Registry, report: &mut Report) {
        let newest = registry.changes().newest();
        if !(1..=newest).contains(&self.change) {
            let change = self.change;
            let (message, help) = match change {
                0 => ("changes are numbered from 1".to_owned(), format!("the newest is {newest}")),
                _ => (
                    format!("the graph was made with a newer Shibo: change {change}, this one knows {newest}"),
                    "update Shibo, or see the newest pictures with `--newest`".to_owned(),
                ),
            };
            report.push(self.place.error(Code::UnknownVersion, message).help(help));
        }
        // The program makes all pictures in one way, the newest.
        let is_other = |line: &&Change| line.thing() == Thing::All && line.look == Look::Look;
        if let Some(line) = registry.changes().since(self.change.max(1)).find(is_other) {
            let message = format!(
                "the way in which pictures were made before change {} is not in this program any more",
                line.change
            );
            let help = format!("`shibo migrate FILE` takes the newest one: {}", line.difference(line.worst));
            report.push(self.place.error(Code::ChangedKind, message).help(help));
        }
        for (entry, version) in &self.hold {
            let Some(info) = registry.info(&entry.name) else {
                let kinds: Vec<&str> = registry.kinds().collect();
                let error =
                    entry.key.error(Code::UnknownKind, format!("there is no node kind `{}`", shorten(&entry.name)));
                report.push(error.help(suggest(&entry.name, "kind", &kinds)));
                continue;
            };
            // No change tells what differs from a version before the table.
            let (oldest, newest) = (registry.changes().version(Thing::Kind(&info.kind), info.version, 0), info.version);
            if !(oldest..=newest).contains(version) {
                let known = match oldest == newest {
                    true => format!("version {newest}"),
                    false => format!("versions {oldest} to {newest}"),
                };
                let message = format!("`{}` has the {known}; found {version}", info.kind);
                report.push(entry.value.error(Code::UnknownVersion, message).help("`shibo changes KIND` lists them"));
            }
        }
    }

    /// The number of the change.
    pub(super) fn change(&self) -> u32 {
        self.change
    }

    /// The version of a kind, given its version now; with the place where `hold` names it.
    pub(super) fn version(&self, changes: &Changes, kind: &str, now: u32) -> (u32, Option<Span>) {
        match self.hold.iter().find(|(entry, _)| entry.name == kind) {
            Some((entry, version)) => (*version, Some(entry.key.span())),
            None => (changes.version(Thing::Kind(kind), now, self.change), None),
        }
    }
}

fn whole(part: &SyntaxValue, what: &str, report: &mut Report) -> Option<u32> {
    match part.shape() {
        Shape::Number(_) => {
            let number = part.str().parse().ok();
            if number.is_none() {
                report.push(mismatch(part, what, "a whole number"));
            }
            number
        }
        _ => {
            report.push(mismatch(part, what, "a whole number"));
            None
        }
    }
}
