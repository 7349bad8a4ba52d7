//! `cargo xtask lines`: lines of code by crate, without blank lines, comments and tests.
use crate::root;
use std::path::Path;
use std::{fs, io};

/// Folders with the code of the programs.
const FOLDERS: [&str; 13] = [
    "engine/value/src",
    "engine/picture/src",
    "engine/node/src",
    "engine/graph/src",
    "engine/src",
    "kernel/src",
    "nodes/src",
    "library/src",
    "ide/src",
    "macros/src",
    "fingerprint/src",
    "python/binding/src",
    "src",
];

/// Prints the table.
///
/// # Errors
/// A folder or a file that cannot be read.
pub(crate) fn print() -> io::Result<()> {
    let mut sum = 0;
    for folder in FOLDERS {
        let lines = of_folder(&root().join(folder))?;
        println!("{folder:20}{lines:8}");
        sum += lines;
    }
    println!("{:20}{sum:8}", "all");
    Ok(())
}

fn of_folder(folder: &Path) -> io::Result<usize> {
    let mut lines = 0;
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        if path.is_dir() {
            lines += if ["tests", "node_modules"].contains(&name) { 0 } else { of_folder(&path)? };
        } else if name.ends_with(".rs") && !is_test(name) {
            lines += of_text(&fs::read_to_string(&path)?);
        }
    }
    Ok(lines)
}

/// True for files that are test modules as a whole.
fn is_test(name: &str) -> bool {
    name == "tests.rs" || name.ends_with("_tests.rs") || ["testing.rs", "conform.rs"].contains(&name)
}

/// Lines of code above the unit tests.
fn of_text(text: &str) -> usize {
    let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    code.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with("//")).count()
}

#[cfg(test)]
mod tests {
    use super::of_text;

    #[test]
    fn counts_code_without_comments_blanks_and_tests() {
        let text = "//! Text.\nuse a;\n\n/// Doc.\nfn f() {\n    // Note.\n    g()\n}\n\n#[cfg(test)]\nmod tests {\n    use a;\n}\n";
        assert_eq!(of_text(text), 4);
    }
}
