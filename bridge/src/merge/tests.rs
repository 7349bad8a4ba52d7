//! Tests of the merge.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use super::*;
use crate::lock::Lock;
use crate::shape::canonical;
use crate::testing::{Dice, Edit, graphs, tools};

const BASE: &str = r#"(
  version: 1,
  nodes: {
    // The ground.
    "noise": Perlin(size: 9, octaves: 2),
    "soft": Blur(input: "noise", radius: 1.5),
    "both": "= noise + soft", // a sum
    "old": Perlin(size: 3),
  },
  outputs: { "bumps": "both", "mask": "soft" },
)
"#;

fn three(ours: &str, theirs: &str) -> Merged {
    merge(&tools(), &request(BASE, ours, theirs))
}

fn request(base: &str, ours: &str, theirs: &str) -> MergeRequest {
    let [base, ours, theirs] = [base, ours, theirs].map(str::to_owned);
    MergeRequest { base, ours, theirs, path: PathBuf::from("a.ron"), marker_size: 7 }
}

fn with(changes: &[(&str, &str)]) -> String {
    changes.iter().fold(BASE.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    })
}

#[test]
fn keeps_text_of_ours_and_inserts_changes_of_theirs() {
    let ours = with(&[("size: 9", "size: 8 /* mm */"), ("  outputs", "  // Results.\n  outputs")]);
    let theirs = with(&[
        ("radius: 1.5", "radius:  2.5"),
        (
            "\"old\": Perlin(size: 3),",
            "\"old\": Perlin(size: 3),\n    // New.\n    \"new\": Perlin( size: 1 ), // fine",
        ),
        ("// The ground.", "// The ground, in mm."),
    ]);
    let merged = three(&ours, &theirs);
    assert!(merged.is_clean(), "{merged:?}");
    let expected = ours
        .replace("radius: 1.5", "radius: 2.5")
        .replace(
            "\"old\": Perlin(size: 3),",
            "\"old\": Perlin(size: 3),\n    // New.\n    \"new\": Perlin( size: 1 ), // fine",
        )
        .replace("// The ground.", "// The ground, in mm.");
    assert_eq!(merged.text, expected);
}

#[test]
fn marks_one_field() {
    let merged =
        three(&with(&[("size: 9", "size: 8")]), &with(&[("size: 9", "size: 7"), ("radius: 1.5", "radius: 2")]));
    let places: Vec<_> = merged.conflicts.iter().map(|conflict| (conflict.path.join("."), conflict.line)).collect();
    assert_eq!(places, [("nodes.noise.size".to_owned(), 6)]);
    let marks = "    \"noise\": Perlin(\n<<<<<<< ours\n      size: 8,\n||||||| base\n      size: 9,\n=======\n      size: 7,\n>>>>>>> theirs\n      octaves: 2),\n";
    assert!(merged.text.contains(marks) && merged.text.contains("radius: 2)"), "{}", merged.text);
}

#[test]
fn takes_equal_and_single_changes() {
    let one = with(&[("size: 9", "size: 8")]);
    assert_eq!(three(&one, &one.replace("8", "8.0")).text, one);
    assert_eq!(three(BASE, &one).text, one);
    assert_eq!(three(&one, BASE).text, one);
    let removed = with(&[("    \"old\": Perlin(size: 3),\n", "")]);
    let merged = three(&one, &removed);
    assert_eq!((merged.is_clean(), merged.text), (true, removed.replace("size: 9", "size: 8")));
    assert_eq!(three(&removed, &with(&[("size: 3", "size: 4")])).conflicts[0].path, ["nodes", "old"]);
    assert_eq!(three(&with(&[("size: 3", "size: 4")]), &removed).conflicts.len(), 1);
}

#[test]
fn references_follow_renamed_nodes() {
    let renamed = with(&[("\"noise\": P", "\"ground\": P"), ("\"noise\",", "\"ground\","), ("noise +", "ground +")]);
    let reads = with(&[("\"old\": Perlin(size: 3),", "\"old\": Perlin(size: 3),\n    \"edge\": \"= noise - old\",")]);
    for (ours, theirs) in [(&renamed, &reads), (&reads, &renamed)] {
        let merged = three(ours, theirs);
        assert!(merged.is_clean(), "{merged:?}");
        assert!(merged.text.contains("= ground - old") && !merged.text.contains("\"noise\""), "{}", merged.text);
    }
    let other = renamed.replace("ground", "floor");
    assert!(!three(&renamed, &other).is_clean());
}

#[test]
fn marks_errors_that_neither_side_had() {
    // A cycle of two wires, and a node that one side removed and the other one reads.
    let ours = with(&[("\"noise\": Perlin(size: 9, octaves: 2)", "\"noise\": \"= 0.5 * old\"")]);
    let theirs = with(&[("\"old\": Perlin(size: 3)", "\"old\": Blur(input: \"soft\", radius: 1)")]);
    let merged = three(&ours, &theirs);
    assert!(!merged.conflicts.is_empty() && merged.conflicts[0].error.is_some(), "{merged:?}");
    let removed = with(&[("    \"old\": Perlin(size: 3),\n", "")]);
    let merged = three(&removed, &with(&[("noise + soft", "noise + old")]));
    assert_eq!(merged.conflicts.iter().map(|conflict| conflict.path.join(".")).collect::<Vec<_>>(), ["nodes.both"]);
}

#[test]
fn merges_lines_of_broken_texts() {
    let merged = three(&with(&[("size: 9", "size: ")]), &with(&[("radius: 1.5", "radius: 2")]));
    assert!(merged.by_lines.is_some() && !merged.is_clean(), "{merged:?}");
}

#[test]
fn keeps_line_ends_of_ours() {
    let ours = with(&[("size: 9", "size: 8")]).replace('\n', "\r\n");
    let merged =
        three(&ours, &with(&[("\"old\": Perlin(size: 3),", "\"old\": Perlin(size: 3),\n    \"new\": Perlin(),")]));
    assert!(merged.is_clean() && merged.text.contains("\"new\": Perlin(),\r\n"), "{merged:?}");
    assert_eq!(merged.text.matches('\n').count(), merged.text.matches("\r\n").count());
}

#[test]
fn merges_pins() {
    let with = |pins: &str| BASE.replace("version: 1,", &format!("version: 1, {pins}"));
    let held = |change: u32, version: u32| format!(r#"pins: (change: {change}, hold: {{ "Fractal": {version} }}),"#);
    for (base, ours, theirs, expected) in [
        // One side raises the pin, holds a version, or removes the pin.
        ("pins: 1,", "pins: 1,", "pins: 2,", "pins: 2,"),
        ("", "", "pins: 2,", "pins: 2,"),
        ("pins: 1,", "", "pins: 1,", ""),
        ("pins: 1,", "pins: 2,", "pins: 2,", "pins: 2,"),
        (&held(1, 2)[..], &held(2, 2)[..], &held(1, 3)[..], &held(2, 3)[..]),
    ] {
        // Both sides change something else, too.
        let ours = with(ours).replace("size: 9", "size: 8");
        let merged = merge(&tools(), &request(&with(base), &ours, &with(theirs).replace("radius: 1.5", "radius: 2")));
        let wanted = with(expected).replace("size: 9", "size: 8").replace("radius: 1.5", "radius: 2");
        let text = |text: &str| Tree::parse(text).value().map(canonical);
        assert_eq!((merged.is_clean(), text(&merged.text)), (true, text(&wanted)), "{merged:?}");
    }
    for (base, ours, theirs) in [
        ("pins: 1,", "pins: 2,", "pins: 3,"),
        ("pins: 1,", "", "pins: 3,"),
        ("", "pins: 2,", "pins: 3,"),
        ("pins: 1,", "pins: 2,", &held(1, 2)[..]),
    ] {
        let merged = merge(&tools(), &request(&with(base), &with(ours), &with(theirs)));
        let places: Vec<_> = merged.conflicts.iter().map(|conflict| conflict.path.join(".")).collect();
        assert_eq!(places, ["pins"], "{base} {ours} {theirs}: {}", merged.text);
    }
    let merged = merge(&tools(), &request(&with(&held(1, 2)), &with(&held(1, 3)), &with(&held(1, 4))));
    assert_eq!(
        merged.conflicts.iter().map(|conflict| conflict.path.join(".")).collect::<Vec<_>>(),
        ["pins.hold.Fractal"]
    );
}

/// One side has an earlier pin, the other uses a shipped graph that has changed since: together they make an error.
#[test]
fn a_pin_and_a_later_graph_conflict() {
    let base = BASE.replace("version: 1,", "version: 1, pins: 60,");
    let ours = base.replace("pins: 60,", "pins: 3,");
    let theirs = base
        .replace("nodes: {", "imports: { \"s\": \"shibo:starter\" },\n  nodes: {")
        .replace("\"old\": Perlin(size: 3),", "\"old\": Perlin(size: 3),\n    \"hide\": Use(graph: \"s\"),");
    for (ours, theirs) in [(&ours, &theirs), (&theirs, &ours)] {
        let merged = merge(&tools(), &request(&base, ours, theirs));
        assert!(!merged.is_clean(), "{}", merged.text);
        let errors: Vec<_> = merged.conflicts.iter().filter_map(|conflict| conflict.error.as_deref()).collect();
        assert!(
            errors.iter().any(|error| error.contains("`shibo:starter` of version 1 is not in this program")),
            "{merged:?}"
        );
    }
}

#[test]
fn locks_never_conflict() {
    let lock = |entries: &[(&str, u32)]| {
        let entry = |(name, pins): &(&str, u32)| format!("  {name:?}: (pins: {pins}, text: \"\", pictures: {{}}),\n");
        format!("{{\n{}}}\n", entries.iter().map(entry).collect::<String>())
    };
    let (base, ours) = (lock(&[("a.ron", 1), ("b.ron", 1)]), lock(&[("a.ron", 2), ("b.ron", 2)]));
    let theirs = lock(&[("a.ron", 1), ("b.ron", 3), ("c.ron", 3)]);
    let mut request = request(&base, &ours, &theirs);
    request.path = "graphs/shibo.lock".into();
    let merged = merge(&tools(), &request);
    let expected = Lock::read(&lock(&[("a.ron", 2), ("c.ron", 3)]));
    assert_eq!((merged.is_clean(), Lock::read(&merged.text)), (true, expected));
}

#[test]
fn locks_of_another_form_are_refused() {
    let lock = |pins: u32| format!("{{\n  \"a.ron\": (pins: {pins}, text: \"\", pictures: {{}}),\n}}\n");
    // A field that this program does not know, another form, and a file that was merged by lines.
    let newer = lock(3).replace("pins: 3", "pins: 3, views: 2");
    let other = format!("(form: 2, graphs: {})", lock(3));
    let marked = format!("<<<<<<< ours\n{}=======\n{}>>>>>>> theirs\n", lock(3), lock(4));
    for odd in [&newer, &other, &marked, &String::new()] {
        let sides: [(&str, [&str; 3]); 3] = [
            ("our version", [&lock(1), odd, &lock(2)]),
            ("their version", [&lock(1), &lock(2), odd]),
            ("the base", [odd, &lock(1), &lock(2)]),
        ];
        for (side, [base, ours, theirs]) in sides {
            let request = MergeRequest { path: "graphs/shibo.lock".into(), ..request(base, ours, theirs) };
            let merged = merge(&tools(), &request);
            if side == "the base" && odd.is_empty() {
                // Both sides added the file.
                assert!(merged.is_clean(), "{merged:?}");
                continue;
            }
            assert_eq!((merged.is_clean(), merged.text.as_str(), &merged.by_lines), (false, ours, &None), "{side}");
            let reason = merged.refused.unwrap();
            assert!(reason.starts_with(&format!("{side} is no lock that this program reads (")), "{reason}");
        }
        // A side that changed nothing is no reason to read anything.
        for (ours, theirs) in [(odd, &lock(1)), (&lock(1), odd)] {
            let merged =
                merge(&tools(), &MergeRequest { path: "shibo.lock".into(), ..request(&lock(1), ours, theirs) });
            assert_eq!((merged.is_clean(), &merged.text), (true, odd));
        }
    }
}

/// Returns whether two edits change one thing, or one a part of what the other changes. A renamed thing may be changed too, and
/// both sides may remove a thing.
fn overlap(one: &[Edit], other: &[Edit]) -> bool {
    let changes = |edit: &&Edit| !matches!(edit, Edit::Rename(..));
    one.iter().filter(changes).any(|a| {
        other.iter().filter(changes).filter(|b| a != *b).any(|b| match (a.touches(), b.touches()) {
            (Some(a), Some(b)) => a.starts_with(&b) || b.starts_with(&a),
            _ => false,
        })
    })
}

#[test]
fn merges_random_edits_of_shipped_graphs() {
    let (tools, graphs) = (tools(), graphs());
    let small: Vec<_> = graphs.iter().filter(|(_, text)| text.len() < 12_000).collect();
    let (mut clean, mut needless, mut merged_count, mut wrong) = (0, 0, 0, Vec::new());
    let mut seed = 0;
    while merged_count < 500 {
        seed += 1;
        let mut dice = Dice(seed);
        let (path, base) = small[dice.below(small.len())];
        let mut side = |who: &str| {
            let (mut text, mut edits) = (base.clone(), Vec::new());
            for _ in 0..=dice.below(3) {
                let edit = Edit::random(&text, who, &mut dice);
                if let Some(new) = edit.apply(&tools, path, &text) {
                    (text, edits) = (new, [edits, vec![edit]].concat());
                }
            }
            (text, edits)
        };
        let ((ours, our_edits), (theirs, their_edits)) = (side("ours"), side("theirs"));
        // Both orders must give the same graph, else the edits are not independent.
        let after = |text: &str, edits: &[Edit], done: &[Edit]| {
            // A thing that both sides remove is removed once.
            let edits = edits.iter().filter(|edit| !(matches!(edit, Edit::Remove(_)) && done.contains(edit)));
            edits.into_iter().try_fold(text.to_owned(), |text, edit| edit.apply(&tools, path, &text))
        };
        let (one, other) = (after(&ours, &their_edits, &our_edits), after(&theirs, &our_edits, &their_edits));
        let text = |text: &str| Tree::parse(text).value().map(canonical);
        let overlaps = overlap(&our_edits, &their_edits);
        let expected = one.zip(other).filter(|(one, other)| text(one) == text(other)).map(|(one, _)| text(&one));
        let mut request = request(base, &ours, &theirs);
        request.path.clone_from(path);
        let merged = merge(&tools, &request);
        merged_count += 1;
        match (&expected, merged.is_clean()) {
            (Some(expected), true) => {
                clean += 1;
                if text(&merged.text) != *expected {
                    wrong.push(format!("{seed} {}: {our_edits:?} {their_edits:?}", path.display()));
                }
            }
            (None, true) if !overlaps => {}
            (None, true) => wrong.push(format!("{seed} {} clean: {our_edits:?} {their_edits:?}", path.display())),
            (Some(_), false) if !overlaps && merged.conflicts.iter().all(|conflict| conflict.error.is_none()) => {
                needless += 1;
                println!(
                    "needless {seed} {}: {our_edits:?} {their_edits:?} {:?} {:?}",
                    path.display(),
                    merged.conflicts,
                    merged.by_lines
                );
            }
            _ => {}
        }
    }
    println!("{clean} of {merged_count} merged, {needless} marked needlessly");
    assert!(wrong.is_empty(), "{} wrong: {wrong:#?}", wrong.len());
    assert!(needless * 50 <= merged_count && clean > 300, "{needless} needless, {clean} clean");
}
