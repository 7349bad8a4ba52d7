//! Counts habits of English that make sentences hard to read, by folder. `tests/cli/structure/prose.txt` holds the allowed counts,
//! which may only go down: `BLESS=1` lowers them.

use super::root;
use crate::bless::blessing;
use regex_lite::Regex;
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// A sentence that opens with a noun clause; one that names no thing; three relative pronouns; old words.
const HABITS: [(&str, &str); 4] = [
    (
        "opener",
        r"^(What|Whether|Which|How (many|far|much|often)|Of (what|those|the)|That which|Whoever|Where .* is,)\b",
    ),
    ("what-clause", r"\bwhat (is|was|are|has|had|it|they|lies|reads|comes|belongs|others|nobody)\b"),
    (
        "stacked",
        r"\b(what|that|which|those|one|whose)\b[^.;:]{0,60}\b(what|that|which|those|whose)\b[^.;:]{0,60}\b(what|that|which|those|whose)\b",
    ),
    (
        "archaic",
        r"\b(nobody|somebody|anybody|whoever|anew|dear|dearer|dearest|heed|thereof|therein|so that it shall|be it)\b",
    ),
];

/// The sentences of a folder that show each habit, with their files.
type Found = [Vec<String>; 4];

/// The blocks of prose in a file: comments, or the paragraphs of a document.
fn blocks(name: &str, text: &str) -> Vec<String> {
    let marks: &[&str] = match name.rsplit_once('.').map(|(_, ending)| ending) {
        Some("rs") => &["///", "//!", "//"],
        Some("js" | "ts") => &["//", "*"],
        Some("py") => &["#"],
        _ => &[""],
    };
    let (mut blocks, mut block, mut fence) = (Vec::new(), Vec::<&str>::new(), false);
    for line in text.lines() {
        let line = line
            .trim_start_matches(|c: char| c.is_whitespace() && name.rsplit_once('.').is_some_and(|(_, e)| e != "md"));
        let part = marks.iter().find_map(|mark| line.strip_prefix(mark));
        let comment = part.is_some();
        let mut part = part.map_or("", |part| part.strip_prefix(' ').unwrap_or(part));
        if part.starts_with("```") {
            fence = !fence;
            part = "";
        }
        fence &= comment;
        let new = ["- ", "* ", "#", "|"].iter().any(|mark| part.starts_with(mark));
        if part.trim().is_empty() || new || fence {
            blocks.push(std::mem::take(&mut block).join(" "));
        }
        if !part.trim().is_empty() && !fence && !part.starts_with(['#', '|']) {
            block.push(part.trim_start_matches(['-', '*', ' ']));
        }
    }
    blocks.push(block.join(" "));
    blocks
}

/// Sentences of at least four words.
fn sentences(block: &str) -> Vec<String> {
    let words: Vec<&str> = block.split_whitespace().collect();
    let (mut sentences, mut begin) = (Vec::new(), 0);
    for end in 1..=words.len() {
        let ends = end == words.len()
            || words[end - 1].ends_with(['.', ':', ';', '!', '?'])
                && words[end].starts_with(|c: char| c.is_ascii_uppercase() || "`\"“".contains(c));
        if ends {
            sentences.push(words[begin..end].join(" "));
            begin = end;
        }
    }
    sentences.retain(|sentence| sentence.split(' ').count() >= 4);
    sentences
}

/// The folder by which a file is counted: a family, a room, a crate of the engine, or `eval` and `session`; else the top folder.
fn folder(path: &str) -> String {
    let parts: Vec<&str> = path.split('/').collect();
    let deep = matches!(parts[..], ["engine" | "kernel" | "nodes", "src", ..] | ["engine", _, "src", ..]);
    let depth = if deep { 3 } else { 1 }.min(parts.len() - 1);
    parts[..depth].join("/")
}

/// All files with prose below a folder, by their paths within the tree.
fn files(dir: &Path, prefix: &str, found: &mut Vec<String>) {
    for entry in fs::read_dir(dir).unwrap().map(Result::unwrap) {
        let name = entry.file_name().to_str().unwrap().to_owned();
        let path = format!("{prefix}{name}");
        if entry.file_type().unwrap().is_dir() {
            if !name.starts_with('.') && !["target", "golden", "node_modules", "out"].contains(&name.as_str()) {
                files(&entry.path(), &format!("{path}/"), found);
            }
        } else if [".rs", ".js", ".ts", ".py", ".md"].iter().any(|ending| name.ends_with(ending))
            && path != "docs/nodes.md"
        {
            found.push(path);
        }
    }
}

fn find() -> BTreeMap<String, Found> {
    let habits = HABITS.map(|(_, pattern)| Regex::new(pattern).unwrap());
    let (mut table, mut paths) = (BTreeMap::<String, Found>::new(), Vec::new());
    files(&root(""), "", &mut paths);
    for path in paths {
        let text = fs::read_to_string(root(&path)).unwrap();
        let found = table.entry(folder(&path)).or_default();
        for sentence in blocks(&path, &text).iter().flat_map(|block| sentences(block)) {
            for (found, habit) in found.iter_mut().zip(&habits) {
                if habit.is_match(&sentence) {
                    found.push(format!("{path}: {sentence}"));
                }
            }
        }
    }
    table
}

/// The table as text: a line for each folder with its four counts.
fn write(table: &BTreeMap<String, [usize; 4]>) -> String {
    let head = HABITS.map(|(name, _)| format!("{name:>12}")).concat();
    let mut text = format!("{:34}{head}\n", "folder");
    for (folder, counts) in table {
        let folder = if folder.is_empty() { "." } else { folder };
        text += &format!("{folder:34}{}\n", counts.map(|count| format!("{count:>12}")).concat());
    }
    text
}

fn read(text: &str) -> BTreeMap<String, [usize; 4]> {
    let row = |line: &str| {
        let mut words = line.split_whitespace();
        let folder = words.next().unwrap();
        let counts: Vec<usize> = words.map(|word| word.parse().unwrap()).collect();
        (if folder == "." { String::new() } else { folder.to_owned() }, counts.try_into().unwrap())
    };
    text.lines().skip(1).map(row).collect()
}

#[test]
fn habits_of_prose_go_down() {
    let path = root("tests/cli/structure/prose.txt");
    let allowed = read(&fs::read_to_string(&path).unwrap());
    let mut lowered = BTreeMap::new();
    let mut worse = Vec::new();
    for (folder, found) in find() {
        // A folder that the table lacks may have one sentence of each habit.
        let allowed = allowed.get(&folder).copied().unwrap_or([1; 4]);
        for ((sentences, allowed), (habit, _)) in found.iter().zip(allowed).zip(HABITS) {
            if sentences.len() > allowed {
                let list = sentences.join("\n  ");
                worse.push(format!("{folder}: `{habit}` {} times, {allowed} allowed:\n  {list}", sentences.len()));
            }
        }
        lowered.insert(folder, std::array::from_fn(|i| found[i].len().min(allowed[i])));
    }
    assert!(worse.is_empty(), "plain sentences begin with their subject (CONTRIBUTING.md):\n{}", worse.join("\n"));
    if blessing() {
        fs::write(&path, write(&lowered)).unwrap();
    }
}

#[test]
fn habits_of_prose_are_found() {
    let text =
        "/// What it returns is a list. It holds one thing.\n// A comment\n// goes on: nobody reads it.\nlet x = 1;\n";
    let found: Vec<String> = blocks("a.rs", text).iter().flat_map(|block| sentences(block)).collect();
    assert_eq!(found, ["What it returns is a list.", "It holds one thing.", "A comment goes on: nobody reads it."]);
    let habits = |sentence: &str| HABITS.map(|(_, pattern)| Regex::new(pattern).unwrap().is_match(sentence));
    assert_eq!(habits(&found[0]), [true, false, false, false]);
    assert_eq!(habits(&found[2]), [false, false, false, true]);
    assert_eq!(
        habits("It tells what is read by those that others left and which of them end."),
        [false, true, true, false]
    );
}
