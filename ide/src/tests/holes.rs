//! Completion of names in formulas: deletes each name in the formulas of the shipped graphs, in several ways.
use super::super::around::closing;
use super::super::count::class_of;
use super::super::formula::formulas;
use super::super::habits::Class;
use super::super::{Cx, File, Workspace, complete};
use super::{graphs, habits_without, registry};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::ops::Range;
use std::sync::Arc;

/// The text that is deleted with a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Cut {
    /// Nothing else: the brackets of a function stay.
    Name,
    /// Its brackets.
    Call,
    /// The rest of its formula.
    Formula,
    /// The rest of the file.
    File,
}

impl Cut {
    pub(super) const ALL: [Self; 4] = [Self::Name, Self::Call, Self::Formula, Self::File];
}

/// A name in a formula.
pub(super) struct Hole {
    /// Its class.
    pub class: Class,
    /// Its bytes.
    pub name: Range<usize>,
    /// The end of its brackets, or of the name.
    pub call: usize,
    /// The end of its formula.
    pub end: usize,
    pub wanted: String,
}

impl Hole {
    /// The text without the name, and where it was.
    pub(super) fn text(&self, file: &File, cut: Cut, letters: &str) -> (String, usize) {
        let text = &file.text;
        let end = match cut {
            Cut::Name => self.name.end,
            Cut::Call => self.call,
            Cut::Formula => self.end,
            Cut::File => text.len(),
        };
        let rest = match cut {
            Cut::File if text[self.end..].starts_with("\"#") => "\"#",
            Cut::File => "\"",
            _ => &text[end..],
        };
        (format!("{}{letters}{rest}", &text[..self.name.start]), self.name.start + letters.len())
    }
}

/// The names in the formulas of a file, but those of deep paths, and definitions.
pub(super) fn holes(cx: Cx<'_>) -> Vec<Hole> {
    let mut found = Vec::new();
    for (text, formula) in formulas(cx) {
        let Some(place) = &text.place else { continue };
        for (index, word) in formula.words().iter().enumerate() {
            let says = formula.word(index);
            let Some(class) = class_of(&formula, index) else { continue };
            let dots = says.matches('.').count();
            let Some(name) = text.in_file(&word.range).filter(|_| dots < if class == Class::Param { 1 } else { 2 })
            else {
                continue;
            };
            let last = if class == Class::Function {
                closing(&formula, index + 1).expect("a short formula") - 1
            } else {
                index
            };
            let call = name.start - word.range.start + formula.words()[last].range.end;
            found.push(Hole { class, name, call, end: place.end, wanted: says.to_owned() });
        }
    }
    found
}

/// Number of holes, of names offered, and of those among the first three.
#[derive(Clone, Copy, Default)]
struct Share {
    asked: usize,
    offered: usize,
    first: usize,
}

/// Rank of the wanted name behind its first letters; components are offered behind their dot.
fn rank(workspace: &mut Workspace, file: &File, hole: &Hole, cut: Cut, typed: usize) -> Option<usize> {
    let mut rank = |letters: &str| {
        let (text, at) = hole.text(file, cut, letters);
        let file = workspace.open(&file.path, text);
        complete(Cx { world: workspace, file: &file }, at).iter().position(|one| one.label == hole.wanted)
    };
    let letters: String = hole.wanted.chars().take(typed).collect();
    rank(&letters).or_else(|| rank(&hole.wanted[..=hole.wanted.rfind('.')?]))
}

/// The least shares of names among the first three, without a letter and with one, in percent.
const LEAST: [(Cut, [f64; 2]); 4] =
    [(Cut::Name, [68.0, 92.0]), (Cut::Call, [57.0, 90.0]), (Cut::Formula, [53.0, 89.0]), (Cut::File, [44.0, 86.0])];

#[test]
fn offers_names_in_formulas() {
    let mut shares: BTreeMap<(Cut, usize, &str), Share> = BTreeMap::new();
    let registry = Arc::new(registry());
    let mut number = 0;
    for graph in shibo_library::graphs() {
        let mut workspace = Workspace::new(registry.clone(), vec![graphs()]).with_habits(habits_without(graph.path));
        let file = workspace.open(&graphs().join(graph.path), graph.text);
        for hole in holes(Cx { world: &workspace, file: &file }) {
            // Each name is deleted in one of the ways, and half of the time its first letter stays.
            number += 1;
            let (cut, typed) = (Cut::ALL[number % 4], number / 4 % 2);
            let rank = rank(&mut workspace, &file, &hole, cut, typed);
            for class in [hole.class.key(), "all"] {
                let share = shares.entry((cut, typed, class)).or_default();
                share.asked += 1;
                share.offered += usize::from(rank.is_some());
                share.first += usize::from(rank.is_some_and(|rank| rank < 3));
            }
        }
    }
    let percent = |part: usize, share: &Share| 100.0 * part as f64 / share.asked as f64;
    let mut table = String::from("| deleted | letters typed | class | how many | offered | among the first three |\n");
    for ((cut, typed, class), share) in &shares {
        let (offered, first) = (percent(share.offered, share), percent(share.first, share));
        let _ = writeln!(table, "| {cut:?} | {typed} | {class} | {} | {offered:.1} % | {first:.1} % |", share.asked);
    }
    println!("{table}");
    for (cut, least) in LEAST {
        for (typed, least) in least.into_iter().enumerate() {
            let share = &shares[&(cut, typed, "all")];
            assert!(share.asked > 1000, "{table}");
            assert!(percent(share.offered, share) >= 99.0, "{cut:?}, {typed} letters: {table}");
            assert!(percent(share.first, share) >= least, "{cut:?}, {typed} letters: {table}");
        }
    }
}
