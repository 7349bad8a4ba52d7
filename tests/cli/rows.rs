//! The pages of the methods list every row of the source once and in order, and name tests that exist.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

fn sources(dir: &Path, found: &mut String) {
    let mut entries: Vec<PathBuf> = std::fs::read_dir(dir).unwrap().map(|e| e.unwrap().path()).collect();
    entries.sort();
    for path in entries {
        if path.is_dir() && !path.ends_with("target") {
            sources(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push_str(&std::fs::read_to_string(&path).unwrap());
        }
    }
}

/// The names of all tests.
fn tests() -> BTreeSet<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut text = String::new();
    for dir in ["src", "engine", "kernel", "nodes", "tests"] {
        sources(&root.join(dir), &mut text);
    }
    let mut names = BTreeSet::new();
    let mut test = false;
    for line in text.lines().map(str::trim) {
        // In `proptest!` the attribute also stands before the function.
        test |= line == "#[test]";
        if let (true, Some(rest)) = (test, line.strip_prefix("fn ")) {
            names.insert(rest.split('(').next().unwrap().to_owned());
            test = false;
        }
    }
    names
}

/// Checks the table of a page whose rows are `letter` with the numbers `rows`.
fn check(page: &str, letter: char, rows: impl Iterator<Item = u32>) {
    let text = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(page)).unwrap();
    let tests = tests();
    let table = text.lines().filter_map(|line| {
        let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
        let number = cells[0].strip_prefix(letter)?.parse::<u32>().ok()?;
        Some((number, cells.last().copied().unwrap_or_default().to_owned()))
    });
    let table: Vec<_> = table.collect();
    assert_eq!(table.iter().map(|row| row.0).collect::<Vec<_>>(), rows.collect::<Vec<_>>(), "{page}");
    for (number, cell) in table {
        let named: Vec<&str> = cell.split('`').skip(1).step_by(2).collect();
        assert!(!named.is_empty(), "{page}: {letter}{number} names no test");
        for name in named {
            assert!(tests.contains(name), "{page}: {letter}{number} names the test `{name}`, which does not exist");
        }
    }
}

#[test]
fn rows_of_synthesis() {
    check("docs/synthesis.md", 'C', 1..=34);
}

#[test]
fn rows_of_leather() {
    check("docs/leather.md", 'A', 1..=68);
}

#[test]
fn rows_of_wood() {
    check("docs/wood.md", 'B', 1..=38);
}
