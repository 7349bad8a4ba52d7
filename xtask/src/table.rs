//! `cargo xtask table`: the table of changes and the digests of pictures only grow. A graph may be pinned at any line.
use crate::root;
use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;

/// The files, by their paths from the root.
const FILES: [&str; 2] = ["library/changes.ron", "tests/golden/digests.ron"];

/// Compares the files with a revision; the merge base with `main` if none is given.
///
/// # Errors
/// The entries that were changed or removed since, as a message.
pub(crate) fn check(revision: Option<&str>) -> Result<(), String> {
    let base = match revision {
        Some(revision) => revision.to_owned(),
        None => git(&["merge-base", "HEAD", "main"])?.trim().to_owned(),
    };
    let mut lost = Vec::new();
    for file in FILES {
        // A file that the revision does not have has lost nothing.
        let Ok(before) = git(&["show", &format!("{base}:{file}")]) else { continue };
        let after = std::fs::read_to_string(root().join(file)).map_err(|error| format!("{file}: {error}"))?;
        let after = entries(&after);
        for (place, values) in entries(&before) {
            let known = after.get(&place).cloned().unwrap_or_default();
            lost.extend(values.difference(&known).map(|value| format!("{file}: {place} {value}")));
        }
    }
    if lost.is_empty() { Ok(()) } else { Err(format!("changed or removed since {base}:\n{}", lost.join("\n"))) }
}

/// The values of a file by their places: the names of the sections around them, and the key.
fn entries(text: &str) -> BTreeMap<String, BTreeSet<String>> {
    let (mut around, mut entries): (Vec<&str>, BTreeMap<String, BTreeSet<String>>) = (Vec::new(), BTreeMap::new());
    for line in text.lines().map(str::trim).filter(|line| !line.starts_with("//")) {
        if let Some(name) = line.strip_suffix(": {") {
            around.push(name);
        } else if line == "}," {
            around.pop();
        } else if line.len() > 2 {
            let (key, values) = match line.split_once("\": { ") {
                Some((key, values)) => (key, values.trim_end_matches(" },").split(", ").collect()),
                None => ("", vec![line]),
            };
            let place = [&around[..], &[key]].concat().join(" ");
            entries.entry(place).or_default().extend(values.into_iter().map(str::to_owned));
        }
    }
    entries
}

fn git(args: &[&str]) -> Result<String, String> {
    let output =
        Command::new("git").args(args).current_dir(root()).output().map_err(|error| format!("git: {error}"))?;
    let said = String::from_utf8_lossy(&output.stderr).trim().to_owned();
    if output.status.success() { Ok(String::from_utf8_lossy(&output.stdout).into_owned()) } else { Err(said) }
}

#[cfg(test)]
mod tests {
    use super::entries;

    #[test]
    fn finds_changed_and_removed_entries() {
        let before = "(\n  kinds: {\n    \"A\": {\n      \"size: 3\": { 1: \"a\" },\n    },\n  },\n  graphs: {\n    \"g\": {\n      1: {\n        \"lit\": \"b\",\n      },\n    },\n  },\n)\n";
        let lost = |after: &str| {
            let after = entries(after);
            let lost = |(place, values): &(String, std::collections::BTreeSet<String>)| {
                values.iter().any(|value| !after.get(place).is_some_and(|known| known.contains(value)))
            };
            entries(before).into_iter().filter(lost).count()
        };
        assert_eq!(lost(before), 0);
        assert_eq!(lost(&before.replace("1: \"a\"", "1: \"a\", 2: \"c\"")), 0);
        assert_eq!(lost(&before.replace("\"a\"", "\"c\"")), 1);
        assert_eq!(lost(&before.replace("        \"lit\": \"b\",\n", "")), 1);
        assert_eq!(lost(&before.replace("1: {", "2: {")), 1);
    }
}
