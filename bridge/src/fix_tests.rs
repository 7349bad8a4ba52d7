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
            if made < PER_KIND && !is_valid(&tools, path, &spoilt) {
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

#[test]
fn valid_graphs_stay() {
    let tools = tools();
    for (path, text) in graphs() {
        let (after, clean, applied) = repaired(&tools, &path, &text, Applies::Likely);
        assert!(clean && applied.is_empty() && after == text, "{}: {applied:?}", path.display());
    }
}

/// The fixes of the only error of a graph: titles and certainties, and the text after each.
fn offered(text: &str) -> Vec<(String, Applies, String)> {
    let graph = GraphText { path: PathBuf::from("/nowhere/a.ron"), text: text.to_owned() };
    let found = check(&tools(), &CheckRequest { graph }).diagnostics;
    let errors: Vec<_> = found.into_iter().filter(|one| !one.warning).collect();
    assert_eq!(errors.len(), 1, "{errors:?}");
    let at = |line: usize, column: usize| {
        let start: usize = text.split_inclusive('\n').take(line - 1).map(str::len).sum();
        start + text[start..].char_indices().nth(column - 1).map_or(text.len() - start, |(at, _)| at)
    };
    let after = |fix: &crate::check::Fix| {
        let edits = fix.edits.iter().map(|edit| shibo_ide::rename::Edit {
            range: at(edit.line, edit.column)..at(edit.end_line, edit.end_column),
            text: edit.text.clone(),
        });
        shibo_ide::rename::apply(text, &edits.collect::<Vec<_>>())
    };
    errors[0].fixes.iter().map(|fix| (fix.title.clone(), fix.applies, after(fix))).collect()
}

#[test]
fn offers_choices() {
    let cycle = "(nodes: { \"a\": Blur(input: \"b\"), \"b\": Blur(input: \"a\") }, outputs: { \"a\": \"a\" })";
    let cuts = offered(cycle);
    assert_eq!(cuts.len(), 2, "{cuts:?}");
    assert!(cuts.iter().all(|(_, applies, _)| *applies == Applies::Choice));
    let twice = "(nodes: { \"a\": Perlin(size: 2), \"a\": Perlin(size: 3) }, outputs: { \"a\": \"a\" })";
    let kept: Vec<String> = offered(twice).into_iter().map(|(.., after)| after).collect();
    let of = |size: u8| format!("(nodes: {{ \"a\": Perlin(size: {size}) }}, outputs: {{ \"a\": \"a\" }})");
    let tidy: Vec<String> = kept.iter().map(|text| shibo_graph::syntax::format(text).unwrap()).collect();
    assert_eq!(tidy, [2, 3].map(|size| shibo_graph::syntax::format(&of(size)).unwrap()));
}

#[test]
fn adds_missing_ports_and_keeps_ranges() {
    let missing = "(nodes: { \"a\": Perlin(), \"b\": Blur(radius: 2) }, outputs: { \"b\": \"b\" })";
    let (_, applies, after) = offered(missing).remove(0);
    assert_eq!((applies, after), (Applies::Likely, missing.replace("radius: 2", "radius: 2, input: \"a\"")));
    let large =
        "(nodes: { \"a\": Perlin(), \"b\": Blend(base: \"a\", top: 1, opacity: 30) }, outputs: { \"b\": \"b\" })";
    let texts: Vec<String> = offered(large).into_iter().map(|(.., after)| after).collect();
    assert_eq!(texts, ["0.3", "1"].map(|number| large.replace("30", number)));
}

#[test]
fn reads_other_notations() {
    let json = r#"```json
{
  # A comment.
  "version": 1,
  "canvas": { "size_mm": 20, "resolution": 64 },
  "nodes": {
    "waves": { "type": "Perlin", "size": 3, "seed": 2 },
    'soft': Blur { input = "waves"; radius: 0.5mm },
  },
  "outputs": { "soft": "soft" }
}
```
"#;
    let (text, clean, applied) = repaired(&tools(), Path::new("/nowhere/a.ron"), json, Applies::Sure);
    assert!(clean, "{applied:?}\n{text}");
    assert!(text.contains("// A comment.") && text.contains("Blur(input: \"waves\", radius: 0.5)"), "{text}");
}
