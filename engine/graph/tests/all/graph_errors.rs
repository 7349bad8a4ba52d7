//! In the graph files of `errors/`, a mark after each fault states the expected report: `//~ COLUMN CODE`, then, after
//! `|`, parts of the message, the help, or the message of a related place. `//~v` means the next line.
use crate::bless;
use crate::graph_nodes;

use shibo_graph::{LoadOptions, load};
use shibo_value::diagnostics::{Diagnostic, SourceMap};
use std::path::{Path, PathBuf};

#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Expected {
    file: PathBuf,
    line: usize,
    column: usize,
    code: String,
    says: Vec<String>,
}

/// A mark in a line, without the `//~` before it.
fn mark(path: &Path, number: usize, mark: &str) -> Expected {
    let (number, mark) = match mark.strip_prefix('v') {
        Some(mark) => (number + 1, mark),
        None => (number, mark),
    };
    let mut parts = mark.split('|').map(|part| part.trim().to_owned());
    let place = parts.next().expect("a mark has a place");
    let (column, code) = place.split_once(' ').expect("`//~ COLUMN CODE`");
    Expected {
        file: path.to_owned(),
        line: number,
        column: column.parse().expect("a column is a number"),
        code: code.trim().to_owned(),
        says: parts.collect(),
    }
}

fn expected(path: &Path, text: &str) -> Vec<Expected> {
    let marks = (1..).zip(text.lines()).flat_map(|(number, line)| line.split("//~").skip(1).map(move |m| (number, m)));
    marks.map(|(number, text)| mark(path, number, text)).collect()
}

impl Expected {
    fn is_at(&self, other: &Self) -> bool {
        (&self.file, self.line, self.column, &self.code) == (&other.file, other.line, other.column, &other.code)
    }

    /// True if this report contains all texts that a mark expects.
    fn says_all_of(&self, mark: &Self) -> bool {
        mark.says.iter().all(|part| self.says.iter().any(|text| text.contains(part)))
    }
}

/// Updates the marks of a text: correct marks stay, wrong ones are removed, and reports without a mark get one.
fn remarked(path: &Path, text: &str, found: &[Expected]) -> String {
    let mut left: Vec<&Expected> = found.iter().filter(|found| found.file == path).collect();
    let mut lines: Vec<String> = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let mut marks = line.split("//~");
        let mut kept = marks.next().unwrap_or_default().to_owned();
        for text in marks {
            let mark = mark(path, number, text);
            if let Some(index) = left.iter().position(|found| found.is_at(&mark) && found.says_all_of(&mark)) {
                left.remove(index);
                kept.extend(["//~", text]);
            }
        }
        lines.push(kept.trim_end().to_owned());
    }
    for found in left {
        let message = found.says.first().map_or("", |message| message.split('|').next().unwrap_or(message));
        let mark = format!(" //~ {} {} | {message}", found.column, found.code);
        if let Some(line) = lines.get_mut(found.line - 1) {
            line.push_str(&mark);
        }
    }
    lines.join("\n") + if text.ends_with('\n') { "\n" } else { "" }
}

fn found(diagnostic: &Diagnostic, sources: &SourceMap) -> Expected {
    let at = sources.position(diagnostic.span.file, diagnostic.span.start);
    let mut says = vec![diagnostic.message.clone()];
    says.extend(diagnostic.help.clone());
    says.extend(diagnostic.related.iter().map(|related| {
        let at = sources.position(related.span.file, related.span.start);
        format!("{}:{}: {}", at.line, at.column, related.message)
    }));
    Expected {
        file: sources.path(diagnostic.span.file).to_owned(),
        line: at.line,
        column: at.column,
        code: diagnostic.code.to_string(),
        says,
    }
}

fn check(path: &Path) -> Vec<String> {
    let loaded = load(path, &graph_nodes::registry(), &LoadOptions::default());
    let mut wanted: Vec<_> =
        loaded.sources.sources().iter().flat_map(|source| expected(&source.path, &source.text)).collect();
    let mut got: Vec<_> = loaded.diagnostics.iter().map(|d| found(d, &loaded.sources)).collect();
    wanted.sort();
    got.sort();
    let mut wrong = Vec::new();
    for source in loaded.sources.sources().iter().filter(|_| bless::blessing()) {
        wrong.extend(bless::compare(&source.path, remarked(&source.path, &source.text, &got).as_bytes()).err());
    }
    if bless::blessing() {
        return wrong;
    }
    if loaded.graph.is_some() != got.iter().all(|g| g.code == "advice") {
        wrong.push(format!("{}: a graph although there are errors, or none without", path.display()));
    }
    for want in &wanted {
        let same = |g: &&Expected| g.is_at(want);
        let says = |g: &Expected| g.says_all_of(want);
        match got.iter().find(|g| same(g) && says(g)).or_else(|| got.iter().find(same)) {
            None => wrong.push(format!("missing: {want:?}")),
            Some(g) if !says(g) => wrong.push(format!("says something else: {want:?}\n   found: {g:?}")),
            Some(_) => {}
        }
    }
    for g in &got {
        let same = |w: &&Expected| w.is_at(g);
        let count = |list: &[Expected]| list.iter().filter(same).count();
        if count(&wanted) != count(&got) {
            wrong.push(format!("not expected: {g:?}"));
        }
    }
    wrong
}

#[test]
fn corrects_marks() {
    let path = Path::new("a.ron");
    let found = |line, column, says: &str| Expected {
        file: path.to_owned(),
        line,
        column,
        code: "syntax".to_owned(),
        says: vec![says.to_owned()],
    };
    let text = "good //~ 3 syntax | is\nwrong //~ 4 syntax\nnew\n";
    let right = remarked(path, text, &[found(1, 3, "what it is"), found(3, 1, "what else")]);
    assert_eq!(right, "good //~ 3 syntax | is\nwrong\nnew //~ 1 syntax | what else\n");
}

#[test]
fn reports_every_error_at_its_mark() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/errors");
    let mut wrong = Vec::new();
    let mut codes = std::collections::BTreeSet::new();
    let mut files: Vec<_> = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    for path in files.iter().filter(|path| path.extension().is_some_and(|e| e == "ron")) {
        let problems = check(path);
        wrong.extend(problems.iter().map(|p| format!("{}: {p}", path.file_name().unwrap().display())));
        let text = std::fs::read_to_string(path).unwrap();
        codes.extend(expected(path, &text).into_iter().map(|e| e.code));
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    for code in [
        "syntax",
        "unknown-kind",
        "unknown-field",
        "unknown-node",
        "unknown-port",
        "unknown-variant",
        "unknown-param",
        "bad-expression",
        "type-mismatch",
        "missing-input",
        "duplicate-key",
        "cycle",
        "out-of-range",
        "not-finite",
        "file-not-found",
        "bad-file",
        "too-large",
        "unknown-version",
        "bad-name",
        "bad-value",
        "advice",
    ] {
        assert!(codes.contains(code), "no file in `errors/` shows `{code}`");
    }
}
