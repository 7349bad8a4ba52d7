//! Tests of fixes: faults are made in shipped graphs and repaired.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::faults::{FAULTS, Fault, RAW, spoil};
use crate::fix::{ROUNDS, repair};
use crate::shape::canonical;
use crate::testing::{Dice, graphs, tools};
use crate::{CheckRequest, FixRequest, GraphText, Tools, check, fix};
use shibo_graph::syntax::{Tree, marks};
use shibo_graph::{LoadOptions, load_text};
use shibo_ide::fixes::{Applies, Budget, Errors, FINDINGS, TRIALS, counted};
use std::path::{Path, PathBuf};

/// Graphs per sort of fault.
const PER_KIND: usize = 4;
/// Graphs with two or three faults.
const SEVERAL: usize = 50;
/// Longest graph in bytes.
const LONGEST: usize = 5000;

/// Graphs per sort of raw fault.
const PER_RAW: usize = 8;

/// A graph with a fault.
struct Job {
    sort: usize,
    path: PathBuf,
    text: String,
    spoilt: String,
}

/// The result of a repair.
#[derive(Clone, Copy)]
struct Done {
    sort: usize,
    /// The meaning of the original is back with `likely` fixes.
    same: bool,
    /// No error is left.
    clean: bool,
    /// The meaning is back with `sure` fixes alone.
    sure: bool,
    /// `sure` fixes alone left no error.
    sole: bool,
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

fn errors_of(tools: &Tools, path: &Path, text: &str) -> Errors {
    let loaded = load_text(path, text, &tools.registry, &LoadOptions::default());
    counted(loaded.diagnostics.iter().filter(|one| !one.warning))
}

fn is_valid(tools: &Tools, path: &Path, text: &str) -> bool {
    let graph = GraphText { path: path.to_owned(), text: text.to_owned() };
    check(tools, &CheckRequest { graph }).diagnostics.iter().all(|one| one.warning)
}

/// Repairs graphs on two threads, and prints those that are not as before.
fn done(tools: &Tools, jobs: &[Job], names: &[&str]) -> Vec<Done> {
    let each = |job: &Job| {
        let Job { sort, path, text, spoilt } = job;
        let (likely, clean, applied) = repaired(tools, path, spoilt, Applies::Likely);
        let (sure, sole, _) = repaired(tools, path, spoilt, Applies::Sure);
        for text in [&likely, &sure] {
            let (before, after) = (errors_of(tools, path, spoilt), errors_of(tools, path, text));
            assert!(text == spoilt || after.is_better_than(&before), "{}: {before:?} {after:?}", path.display());
        }
        let expected = meaning(text);
        let done =
            Done { sort: *sort, same: meaning(&likely) == expected, clean, sure: meaning(&sure) == expected, sole };
        if !done.same || !clean || (sole && !done.sure) {
            let changed = crate::fix::unified(&path.display().to_string(), text, spoilt);
            let after = crate::fix::unified("repaired", text, if done.same { &sure } else { &likely });
            println!("{}: {}\n{changed}{after}{applied:?}\n", names[*sort], if clean { "other" } else { "errors" });
        }
        done
    };
    let half = jobs.len() / 2;
    std::thread::scope(|scope| {
        let other = scope.spawn(|| jobs[half..].iter().map(each).collect::<Vec<_>>());
        let mut done: Vec<Done> = jobs[..half].iter().map(each).collect();
        done.extend(other.join().unwrap());
        done
    })
}

/// Prints a table of results and returns five numbers: all graphs, graphs as before, graphs without errors after `sure` fixes alone,
/// graphs as before after `sure` fixes alone, and graphs without errors.
fn table(done: &[Done], names: &[&str]) -> [usize; 5] {
    let count = |done: &[&Done]| {
        let of = |is: fn(&Done) -> bool| done.iter().filter(|one| is(one)).count();
        [of(|_| true), of(|one| one.same), of(|one| one.sole), of(|one| one.sole && one.sure), of(|one| one.clean)]
    };
    let line = |name: &str, done: &[&Done]| {
        let [all, same, sole, sure, clean] = count(done);
        println!(
            "{name:30} {same:3} of {all:3} as before, {clean:3} without errors; by sure fixes alone {sure:3} of {sole:3}"
        );
        [all, same, sole, sure, clean]
    };
    for (sort, name) in names.iter().enumerate() {
        line(name, &done.iter().filter(|one| one.sort == sort).collect::<Vec<_>>());
    }
    line("all", &done.iter().collect::<Vec<_>>())
}

/// 90 % of all graphs must be as before, 95 % without errors, and `least` percent of those that `sure` fixes alone leave without errors
/// must be as before.
fn assert_shares([all, same, sole, sure, clean]: [usize; 5], least: usize) {
    let percent = |part: usize, of: usize| 100.0 * part as f64 / of.max(1) as f64;
    println!(
        "as before: {:.1} % of all by likely fixes, {:.1} % of all by sure fixes alone, {:.1} % of those whose faults have sure fixes",
        percent(same, all),
        percent(sure, all),
        percent(sure, sole)
    );
    assert!(same * 10 >= all * 9, "{same} of {all}");
    assert!(clean * 100 >= all * 95, "{clean} of {all} without errors");
    assert!(sure * 100 >= sole * least, "{sure} of {sole} by sure fixes");
}

/// Graphs with a fault of a sort each.
fn single(
    tools: &Tools,
    graphs: &[(PathBuf, String)],
    sorts: &[(&str, Fault)],
    per_sort: usize,
    dice: &mut Dice,
) -> Vec<Job> {
    let mut jobs = Vec::new();
    for (sort, (_, fault)) in sorts.iter().enumerate() {
        let mut made = 0;
        for _ in 0..60 {
            let (path, text) = &graphs[dice.below(graphs.len())];
            let Some(spoilt) = spoil(&tools.registry, text, *fault, dice) else { continue };
            if made < per_sort && !is_valid(tools, path, &spoilt) {
                jobs.push(Job { sort, path: path.clone(), text: text.clone(), spoilt });
                made += 1;
            }
        }
    }
    jobs
}

fn short() -> Vec<(PathBuf, String)> {
    graphs().into_iter().filter(|(_, text)| text.len() < LONGEST).collect()
}

#[test]
fn repairs_faults() {
    let (tools, graphs) = (tools(), short());
    let mut dice = Dice(7);
    let mut jobs = single(&tools, &graphs, &FAULTS, PER_KIND, &mut dice);
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
            jobs.push(Job { sort: FAULTS.len(), path: path.clone(), text: text.clone(), spoilt });
        }
    }
    let mut names = FAULTS.map(|(name, _)| name).to_vec();
    names.push("two or three faults");
    assert_shares(table(&done(&tools, &jobs, &names), &names), 97);
}

#[test]
fn repairs_raw_faults() {
    let (tools, graphs) = (tools(), short());
    let jobs = single(&tools, &graphs, &RAW, PER_RAW, &mut Dice(11));
    let names = RAW.map(|(name, _)| name);
    assert_shares(table(&done(&tools, &jobs, &names), &names), 95);
}

#[test]
fn sure_fixes_stay_sure_beside_other_faults() {
    for (text, after) in [
        ("Perlim(size: 5mm)", "Perlim(size: 5)"),
        ("Blur(input: \"b\", radius: \"3\", xyzzy: 4)", "Blur(input: \"b\", radius: 3, xyzzy: 4)"),
    ] {
        let graph = |node: &str| format!("(nodes: {{ \"b\": Perlin(), \"a\": {node} }}, outputs: {{ \"a\": \"a\" }})");
        let request = GraphText { path: PathBuf::from("/nowhere/a.ron"), text: graph(text) };
        let fixed = fix(&tools(), &FixRequest { graph: request, applies: Applies::Sure, rounds: 1 });
        assert_eq!(fixed.text, graph(after), "{:?}", fixed.applied);
    }
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

#[test]
fn keeps_fixes_that_uncover_errors() {
    let graph = |node: &str| format!("(nodes: {{ \"a\": {node} }}, outputs: {{ \"a\": \"a\" }})");
    for (before, after) in [
        // The fields of an unknown kind are not checked.
        ("Perlim(xyzzy: 3)", "Perlin(xyzzy: 3)"),
        ("Perlim(sise: 3, sead: 4, xyzzy: 3, plugh: 3)", "Perlin(size: 3, seed: 4, xyzzy: 3, plugh: 3)"),
        // A lost bracket hides the fields behind it.
        ("Perlin(size: 3, xyzzy: 4", "Perlin(size: 3, xyzzy: 4)"),
    ] {
        let (text, clean, applied) = repaired(&tools(), Path::new("/nowhere/a.ron"), &graph(before), Applies::Likely);
        assert!(text == graph(after) && !clean, "{applied:?}\n{text}");
    }
    // Nothing in a map was checked.
    let map = r#"{"nodes": {"a": Perlin(xyzzy: 3)}, "outputs": {"a": "a"}}"#;
    let (text, clean, _) = repaired(&tools(), Path::new("/nowhere/a.ron"), map, Applies::Likely);
    assert_eq!((text.as_str(), clean), (r#"(nodes: {"a": Perlin(xyzzy: 3)}, outputs: {"a": "a"})"#, false));
}

/// A graph of nodes with faults.
fn faulty(nodes: usize) -> String {
    let node = |index: usize| format!("    \"n{index}\": Perlim(sise: {index}, sead: \"x\"),\n");
    let nodes: String = (0..nodes).map(node).collect();
    format!("(\n  nodes: {{\n{nodes}  }},\n  outputs: {{ \"a\": \"n0\" }},\n)\n")
}

#[test]
fn bounds_work_for_many_faults() {
    let tools = tools();
    for nodes in [60, 400] {
        let graph = GraphText { path: PathBuf::from("/nowhere/a.ron"), text: faulty(nodes) };
        let before = errors_of(&tools, &graph.path, &graph.text);
        let mut budget = Budget::default();
        let request = FixRequest { graph: graph.clone(), applies: Applies::Likely, rounds: ROUNDS };
        let repaired = repair(&tools, &request, &mut budget);
        assert!(budget.tried() <= TRIALS, "{} trials", budget.tried());
        assert!(errors_of(&tools, &graph.path, &repaired.text).is_better_than(&before), "{:?}", repaired.applied);
        assert!(repaired.applied.len() > 4, "{:?}", repaired.applied);
        let fixed = fix(&tools, &request);
        assert!(fixed.note.is_some_and(|note| note.contains("not all fixes were tried")));
        let checked = check(&tools, &CheckRequest { graph });
        let with_fixes = checked.diagnostics.iter().filter(|one| !one.fixes.is_empty()).count();
        assert!((1..=FINDINGS).contains(&with_fixes), "{with_fixes} findings with fixes");
    }
}

#[test]
fn a_few_faults_need_no_note() {
    let graph = GraphText { path: PathBuf::from("/nowhere/a.ron"), text: faulty(2) };
    let fixed = fix(&tools(), &FixRequest { graph, applies: Applies::Likely, rounds: ROUNDS });
    assert_eq!(fixed.note, None);
    assert!(fixed.text.contains("Perlin(size: 1"), "{}", fixed.text);
}

#[test]
fn fixes_leave_conflicts_alone() {
    let tools = tools();
    let between = |text: &str| {
        let marks = marks(text);
        text[marks[0].first.start..marks[0].rest.end].to_owned()
    };
    let graph = |ours: &str, after: &str| {
        format!(
            "(\n  nodes: {{\n    \"a\": Perlin(\n<<<<<<< ours\n{ours}=======\n      size: 6,\n>>>>>>> theirs\n{after}  }},\n  \
             outputs: {{ \"a\": \"a\" }},\n)\n"
        )
    };
    for (ours, after, fixed) in [
        ("      sise: 5,\n", "      sead: 2),\n", "      seed: 2),\n"),
        ("      size: 5,\n      seed: 3\n", "      aspect: 2\n", ""),
        ("      size: 5mm,\n", "      aspect: 2),\n", ""),
    ] {
        let text = graph(ours, after);
        let (repaired, clean, applied) = repaired(&tools, Path::new("/nowhere/a.ron"), &text, Applies::Likely);
        assert!(!clean && between(&repaired) == between(&text), "{applied:?}\n{repaired}");
        assert!(repaired.contains(fixed), "{applied:?}\n{repaired}");
        let request = CheckRequest { graph: GraphText { path: PathBuf::from("/nowhere/a.ron"), text: text.clone() } };
        let (first, last) = (4, 4 + between(&text).matches('\n').count());
        let (mut kept, mut seen) = (0, 0);
        for one in check(&tools, &request).diagnostics {
            for fix in &one.fixes {
                let touches = |edit: &crate::check::FixEdit| edit.line <= last && edit.end_line >= first;
                kept += usize::from(one.code == "conflict");
                assert!(one.code == "conflict" || !fix.edits.iter().any(touches), "{one:?}");
            }
            seen += usize::from(one.code != "conflict");
        }
        assert!(kept == 2 && seen > 0, "{kept} versions, {seen} other findings");
    }
}
