//! The rules of ARCHITECTURE.md on who may know whom, kept by reading the `use` lines.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use std::fs;
use std::path::{Path, PathBuf};

fn sources(dir: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(sources(&path));
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
    files
}

fn root(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// The code of a file above its unit tests, without comments.
fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).unwrap();
    let code = text.split("#[cfg(test)]\nmod tests").next().unwrap();
    code.lines().filter(|line| !line.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n")
}

/// The word that follows each occurrence of `prefix`.
fn words_after(text: &str, prefix: &str) -> Vec<String> {
    let word = |rest: &str| rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
    text.match_indices(prefix).map(|(i, _)| word(&text[i + prefix.len()..])).collect()
}

#[test]
fn the_engine_knows_no_node() {
    for file in sources(&root("engine/src")) {
        let code = code(&file);
        assert!(!code.contains("shibo_nodes"), "{}", file.display());
        for kind in ["SimulateSprings", "PoissonPoints", "DrawWrinkles", "Perlin"] {
            assert!(!code.contains(kind), "{} names the kind {kind}", file.display());
        }
    }
}

#[test]
fn arrows_in_the_engine_point_down() {
    let order = ["session", "eval", "graph", "registry", "node", "value"];
    // What stands beside `value` may be used by all and uses only `value`.
    let beside = ["diagnostics", "picture"];
    for file in sources(&root("engine/src")) {
        let inside = file.strip_prefix(root("engine/src")).unwrap();
        let module = inside.components().next().unwrap().as_os_str().to_str().unwrap().trim_end_matches(".rs");
        for used in words_after(&code(&file), "crate::") {
            if beside.contains(&used.as_str()) || used == module {
                continue;
            }
            let rank = |name: &str| order.iter().position(|m| *m == name);
            let (Some(from), Some(to)) = (rank(module).or(beside.contains(&module).then_some(4)), rank(&used)) else {
                continue;
            };
            assert!(from < to, "{} uses crate::{used}", file.display());
        }
    }
}

#[test]
fn families_do_not_know_each_other() {
    let nodes = root("nodes/src");
    let families: Vec<String> = fs::read_dir(&nodes)
        .unwrap()
        .map(|e| e.unwrap().path())
        .filter(|p| p.is_dir() && !p.ends_with("kernel"))
        .map(|p| p.file_name().unwrap().to_str().unwrap().to_owned())
        .collect();
    assert!(families.len() > 3);
    for family in &families {
        for file in sources(&nodes.join(family)) {
            for used in words_after(&code(&file), "crate::") {
                assert!(!families.contains(&used) || used == *family, "{} uses crate::{used}", file.display());
            }
        }
    }
}

#[test]
fn kernels_know_only_values() {
    for file in sources(&root("nodes/src/kernel")) {
        let code = code(&file);
        for used in words_after(&code, "shibo_engine::") {
            assert_eq!(used, "value", "{}", file.display());
        }
        for used in words_after(&code, "crate::") {
            assert_eq!(used, "kernel", "{}", file.display());
        }
        for other in ["serde::", "std::fs"] {
            assert!(!code.contains(other), "{} uses {other}", file.display());
        }
    }
}

#[test]
fn files_can_be_read_in_one_sitting() {
    for dir in ["src", "engine/src", "nodes/src"] {
        for file in sources(&root(dir)) {
            let lines = fs::read_to_string(&file).unwrap().lines().count();
            assert!(lines <= 500, "{} has {lines} lines", file.display());
        }
    }
}

#[test]
fn nothing_is_read_from_the_environment_below_the_command() {
    for dir in ["engine/src", "nodes/src"] {
        for file in sources(&root(dir)) {
            for word in ["env::var", "env::current_dir", "static mut", "thread_local!"] {
                assert!(!code(&file).contains(word), "{} uses {word}", file.display());
            }
        }
    }
}
