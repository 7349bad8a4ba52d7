//! Tests of fixes: faults are made in shipped graphs and repaired.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::faults::{FAULTS, spoil};
use crate::fix::ROUNDS;
use crate::shape::canonical;
use crate::testing::{Dice, graphs, tools};
use crate::{CheckRequest, FixRequest, GraphText, Tools, check, fix};
use shibo_graph::syntax::Tree;
use shibo_ide::fixes::Applies;
use std::path::{Path, PathBuf};

/// Graphs per sort of fault.
const PER_KIND: usize = 4;
/// Graphs with two or three faults.
const SEVERAL: usize = 50;
/// Longest graph in bytes.
const LONGEST: usize = 5000;

/// Counts of repaired graphs.
#[derive(Clone, Copy, Default)]
struct Score {
    all: usize,
    same: usize,
    clean: usize,
}

impl Score {
    fn add(&mut self, same: bool, clean: bool) {
        self.all += 1;
        self.same += usize::from(same);
        self.clean += usize::from(clean);
    }
}

fn meaning(text: &str) -> String {
    Tree::parse(text).value().map(canonical).unwrap_or_default()
}

fn repaired(tools: &Tools, path: &Path, text: &str, applies: Applies) -> (String, bool, Vec<String>) {
    let graph = GraphText { path: path.to_owned(), text: text.to_owned() };
    let fixed = fix(tools, &FixRequest { graph, applies, rounds: ROUNDS });
    let clean = fixed.diagnostics.iter().all(|one| one.warning);
    (fixed.text, clean, fixed.applied)
}

fn is_valid(tools: &Tools, path: &Path, text: &str) -> bool {
    let graph = GraphText { path: path.to_owned(), text: text.to_owned() };
    check(tools, &CheckRequest { graph }).diagnostics.iter().all(|one| one.warning)
}

#[test]
fn repairs_faults() {
    let tools = tools();
    let graphs: Vec<(PathBuf, String)> = graphs().into_iter().filter(|(_, text)| text.len() < LONGEST).collect();
    let mut jobs: Vec<(usize, PathBuf, String, String)> = Vec::new();
    let mut dice = Dice(7);
    for (kind, (_, fault)) in FAULTS.iter().enumerate() {
        let mut made = 0;
        for _ in 0..60 {
            let (path, text) = &graphs[dice.below(graphs.len())];
            let Some(spoilt) = spoil(&tools.registry, text, *fault, &mut dice) else { continue };
            if made < PER_KIND && meaning(&spoilt) != meaning(text) && !is_valid(&tools, path, &spoilt) {
                jobs.push((kind, path.clone(), text.clone(), spoilt));
                made += 1;
            }
        }
    }
    for _ in 0..SEVERAL {
        let (path, text) = &graphs[dice.below(graphs.len())];
        let mut spoilt = text.clone();
        for _ in 0..2 + dice.below(2) {
            let (_, fault) = FAULTS[dice.below(FAULTS.len())];
            // A fault is made in a text that can be read.
            if Tree::parse(spoilt.as_str()).errors().is_empty() {
                spoilt = spoil(&tools.registry, &spoilt, fault, &mut dice).unwrap_or(spoilt);
            }
        }
        if !is_valid(&tools, path, &spoilt) {
            jobs.push((FAULTS.len(), path.clone(), text.clone(), spoilt));
        }
    }
    let mut scores = vec![Score::default(); FAULTS.len() + 1];
    let half = jobs.len() / 2;
    let work = |jobs: &[(usize, PathBuf, String, String)]| {
        let each = |(kind, path, text, spoilt): &(usize, PathBuf, String, String)| {
            let (likely, clean, applied) = repaired(&tools, path, spoilt, Applies::Likely);
            let same = meaning(&likely) == meaning(text);
            let name = FAULTS.get(*kind).map_or("several", |(name, _)| name);
            if !same || !clean {
                let changed = crate::fix::unified(&path.display().to_string(), text, spoilt);
                let after = crate::fix::unified("repaired", text, &likely);
                println!("{name}: {}\n{changed}{after}{applied:?}\n", if clean { "other" } else { "errors" });
            }
            (*kind, same, clean)
        };
        jobs.iter().map(each).collect::<Vec<_>>()
    };
    let done = std::thread::scope(|scope| {
        let other = scope.spawn(|| work(&jobs[half..]));
        let mut done = work(&jobs[..half]);
        done.extend(other.join().unwrap());
        done
    });
    for (kind, same, clean) in done {
        scores[kind].add(same, clean);
    }
    let mut total = Score::default();
    for (kind, score) in scores.iter().enumerate() {
        let name = FAULTS.get(kind).map_or("two or three faults", |(name, _)| name);
        println!("{name:30} {:3} of {:3} as before, {:3} without errors", score.same, score.all, score.clean);
        total = Score { all: total.all + score.all, same: total.same + score.same, clean: total.clean + score.clean };
    }
    println!("{:30} {:3} of {:3} as before, {:3} without errors", "all", total.same, total.all, total.clean);
    assert!(total.same * 10 >= total.all * 9, "{} of {}", total.same, total.all);
}
