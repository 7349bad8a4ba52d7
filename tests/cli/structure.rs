//! The dependency rules of ARCHITECTURE.md, checked by reading the `use` lines.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
mod prose;

use std::collections::{BTreeMap, BTreeSet};
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

/// The crates of the engine, lowest first.
const ENGINE: [&str; 5] =
    ["engine/value/src", "engine/picture/src", "engine/node/src", "engine/graph/src", "engine/src"];

/// The crates that the command and the Python module are made of.
fn below_the_command() -> impl Iterator<Item = &'static str> {
    ENGINE.into_iter().chain(["kernel/src", "nodes/src", "library/src", "ide/src", "bridge/src", "fit/src"])
}

fn all_crates() -> impl Iterator<Item = &'static str> {
    below_the_command().chain(["src", "python/src", "python/binding/src", "wasm/src"])
}

/// All source files of the engine.
fn engine() -> Vec<PathBuf> {
    ENGINE.iter().flat_map(|source| sources(&root(source))).collect()
}

pub(crate) fn root(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// The code of a file above its unit tests, without comments.
fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).unwrap();
    let code = text.split("#[cfg(test)]\nmod tests").next().unwrap();
    code.lines().filter(|line| !line.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n")
}

/// The words that follow each occurrence of `prefix`: one word, or those of a list in braces.
fn words_after(text: &str, prefix: &str) -> Vec<String> {
    let word = |rest: &str| rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
    let mut words = Vec::new();
    for (i, _) in text.match_indices(prefix) {
        // `ParamType::` is not `Type::`, and `super::super::` is another folder than `super::`.
        let is_longer = text[..i].ends_with(|c: char| c.is_alphanumeric() || c == '_');
        if is_longer || prefix.starts_with("super::") && text[..i].ends_with("super::") {
            continue;
        }
        let rest = &text[i + prefix.len()..];
        let Some(list) = rest.strip_prefix('{') else {
            words.push(word(rest));
            continue;
        };
        let mut depth = 1;
        let mut begins = true;
        for (i, c) in list.char_indices() {
            match c {
                '{' => depth += 1,
                '}' => depth -= 1,
                ',' => begins = depth == 1,
                _ if begins && !c.is_whitespace() => {
                    words.push(word(&list[i..]));
                    begins = false;
                }
                _ => {}
            }
            if depth == 0 {
                break;
            }
        }
    }
    words
}

/// The folder or file right below `dir` that contains `file`.
fn module(dir: &Path, file: &Path) -> String {
    let inside = file.strip_prefix(dir).unwrap().components().next().unwrap();
    inside.as_os_str().to_str().unwrap().trim_end_matches(".rs").to_owned()
}

/// Names on a cycle of `uses` (name to used names) or leading to one; `None` without a cycle.
fn circle(uses: &BTreeMap<String, BTreeSet<String>>) -> Option<Vec<String>> {
    // A name that uses no remaining name is on no cycle.
    let mut left: BTreeMap<_, _> = uses.clone();
    while let Some(name) =
        left.iter().find(|(_, used)| !used.iter().any(|u| uses.contains_key(u) && left.contains_key(u)))
    {
        let name = name.0.clone();
        left.remove(&name);
    }
    (!left.is_empty()).then(|| left.into_keys().collect())
}

#[test]
fn engine_names_no_node() {
    for file in engine() {
        let code = code(&file);
        for kind in ["SimulateSprings", "PoissonPoints", "DrawWrinkles", "Perlin"] {
            assert!(!code.contains(kind), "{} names the kind {kind}", file.display());
        }
    }
}

#[test]
fn types_of_objects_are_named_in_one_table() {
    let table = code(&root("engine/value/src/lib.rs"));
    let lines = table.lines().map(str::split_whitespace).filter_map(|mut words| Some((words.next()?, words.next()?)));
    let objects: Vec<&str> = lines.filter(|(_, color)| color.starts_with("\"#")).map(|(name, _)| name).collect();
    assert!(objects.len() > 5, "{objects:?}");
    let inside = root("engine/value/src");
    for file in engine().into_iter().chain(sources(&root("ide/src"))).chain(sources(&root("src"))) {
        let code = code(&file);
        for word in words_after(&code, "Type::").into_iter().chain(words_after(&code, "Value::")) {
            let named = objects.contains(&word.as_str()) && !file.starts_with(&inside);
            assert!(!named, "{} knows the type {word}: let its `Object` say what it must know", file.display());
        }
    }
}

#[test]
fn serve_does_not_use_watch() {
    for file in sources(&root("src/serve")) {
        assert!(
            !words_after(&code(&file), "crate::").contains(&"watch".to_owned()),
            "{} uses crate::watch",
            file.display()
        );
    }
    let declarations = code(&root("src/watch/mod.rs"));
    assert!(!declarations.contains("fn "), "the logic of `watch` has files of its own");
}

#[test]
fn node_families_do_not_use_each_other() {
    let nodes = root("nodes/src");
    let families: Vec<String> = fs::read_dir(&nodes)
        .unwrap()
        .map(|e| e.unwrap().path())
        .filter(|p| p.join("mod.rs").exists())
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

/// Only `files` reads input files from disk. The others here write, or read again what Shibo itself has written: the cache, bands,
/// parts, temporary files and exports.
#[test]
fn input_files_are_read_by_files_alone() {
    let allowed = [
        "engine/value/src/files.rs",
        "engine/picture/src/atomic.rs",
        "engine/picture/src/atomic/memory.rs",
        "engine/picture/src/atomic/owner.rs",
        "engine/picture/src/part/join.rs",
        "engine/picture/src/part/read.rs",
        "engine/src/eval/disk.rs",
        "engine/src/eval/disk/folder.rs",
        "engine/src/eval/disk/size.rs",
        "engine/src/eval/store.rs",
        "engine/src/session/render.rs",
    ];
    let folders = ENGINE.into_iter().chain(["kernel/src", "nodes/src", "library/src"]);
    for file in folders.flat_map(|folder| sources(&root(folder))).filter(|file| !file.ends_with("tests.rs")) {
        let known = allowed.iter().any(|allowed| file == root(allowed));
        for word in ["std::fs", "File::open", ".canonicalize()", ".metadata()", ".is_file()", ".exists()"] {
            // `Facts` has a function of this name.
            let of_facts = word == ".is_file()" && code(&file).contains("facts");
            assert!(known || of_facts || !code(&file).contains(word), "{} uses {word}: take `files`", file.display());
        }
    }
    for file in allowed {
        assert!(code(&root(file)).contains("std::fs"), "{file} does not use std::fs");
    }
}

#[test]
fn rooms_of_the_kernel_use_only_rooms_before_them() {
    let kernel = root("kernel/src");
    // The order of `kernel/src/lib.rs`.
    let order = [
        "ground",
        "noise",
        "filter",
        "pointwise",
        "strokes",
        "shape",
        "path",
        "pattern",
        "region",
        "scatter",
        "mesh",
        "surface",
        "leather",
        "springs",
        "wood",
        "deposits",
        "fracture",
        "reaction",
        "yarn",
        "synthesis",
        "body",
    ];
    let folders: BTreeSet<String> = fs::read_dir(&kernel)
        .unwrap()
        .map(|e| e.unwrap().path())
        .filter(|p| p.is_dir())
        .map(|p| p.file_name().unwrap().to_str().unwrap().to_owned())
        .collect();
    assert_eq!(folders, order.map(str::to_owned).into(), "each folder has its place in the order");
    for (rank, room) in order.iter().enumerate() {
        for file in sources(&kernel.join(room)) {
            for used in words_after(&code(&file), "crate::") {
                assert!(order[..=rank].contains(&used.as_str()), "{} uses crate::{used}", file.display());
            }
        }
    }
}

/// The modules of a folder, each with the other modules that its files import. `mod.rs` does not count as a module.
fn uses_in(dir: &Path, source: &Path) -> BTreeMap<String, BTreeSet<String>> {
    let inside = dir.strip_prefix(source).unwrap().iter().map(|name| name.to_str().unwrap());
    let here: String = ["crate"].into_iter().chain(inside).flat_map(|name| [name, "::"]).collect();
    let mut uses: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for file in sources(dir) {
        let name = file.file_name().unwrap().to_str().unwrap();
        let declares = file.parent() == Some(dir) && ["mod.rs", "lib.rs", "main.rs"].contains(&name);
        if declares || name.ends_with("tests.rs") {
            continue;
        }
        // The folder as this file names it.
        let below = file.strip_prefix(dir).unwrap().iter().count() - usize::from(name == "mod.rs");
        let (code, own) = (code(&file), module(dir, &file));
        let used = [words_after(&code, &"super::".repeat(below)), words_after(&code, &here)].concat();
        uses.entry(own.clone()).or_default().extend(used.into_iter().filter(|used| *used != own));
    }
    uses
}

#[test]
fn files_of_a_folder_have_no_cycles() {
    // The order of the modules in `src` and `nodes/src` has tests of its own, or none.
    let flat = |source: &str| ENGINE.contains(&source) || ["ide/src", "fit/src"].contains(&source);
    for source in all_crates() {
        let files = sources(&root(source));
        let folders: BTreeSet<&Path> = files.iter().filter_map(|file| file.parent()).collect();
        for folder in folders.into_iter().filter(|folder| flat(source) || *folder != root(source)) {
            assert_eq!(circle(&uses_in(folder, &root(source))), None, "in {}", folder.display());
        }
    }
}

#[test]
fn finds_cycles() {
    let uses = |pairs: &[(&str, &str)]| {
        let set = |(from, to): &(&str, &str)| ((*from).to_owned(), BTreeSet::from([(*to).to_owned()]));
        pairs.iter().map(set).collect::<BTreeMap<_, _>>()
    };
    assert_eq!(circle(&uses(&[("a", "b"), ("b", "c"), ("c", "elsewhere")])), None);
    let found = circle(&uses(&[("a", "b"), ("b", "c"), ("c", "b"), ("d", "elsewhere")]));
    assert_eq!(found.map(|names| names.join(" ")), Some("a b c".to_owned()));
    assert_eq!(words_after("use super::{a::{b, c}, d, e::f}; super::g::h", "super::"), ["a", "d", "e", "g"]);
    assert_eq!(words_after("use super::super::a;", "super::"), ["super"]);
    assert_eq!(words_after("super::Type::Gray", "Type::"), ["Gray"]);
}

#[test]
fn files_have_at_most_500_lines() {
    for dir in all_crates().chain(["tests"]) {
        for file in sources(&root(dir)) {
            let lines = fs::read_to_string(&file).unwrap().lines().count();
            assert!(lines <= 500, "{} has {lines} lines", file.display());
        }
    }
}

#[test]
fn crates_below_the_command_read_no_environment() {
    // Thread-local state for freeing memory and for expected panics of decoders holds no results.
    let allowed = [("engine/value/src/link.rs", "thread_local!"), ("engine/picture/src/guard.rs", "thread_local!")];
    for dir in below_the_command() {
        let tests = root(dir).join("tests");
        for file in sources(&root(dir)).into_iter().filter(|file| !file.starts_with(&tests)) {
            for word in ["env::var", "env::current_dir", "static mut", "thread_local!"] {
                let known = allowed.iter().any(|(path, allowed)| file.ends_with(path) && word == *allowed);
                assert!(known || !code(&file).contains(word), "{} uses {word}", file.display());
            }
        }
    }
}

#[test]
fn time_is_read_by_the_clock_alone() {
    let clock = root("engine/value/src/clock.rs");
    // Editors ask for files on disk again after a while.
    for dir in below_the_command().filter(|dir| *dir != "ide/src") {
        let files = sources(&root(dir)).into_iter().filter(|file| *file != clock);
        for file in files.filter(|file| !file.to_str().unwrap().ends_with("tests.rs")) {
            for word in ["cpu_time", "Instant::now", "SystemTime::now"] {
                assert!(!code(&file).contains(word), "{} uses {word}: take `clock`", file.display());
            }
        }
    }
}

#[test]
fn fingerprint_counts_each_crate_once() {
    let text = |dir: &str| sources(&root(dir)).iter().map(|file| code(file)).collect::<String>();
    let all: String = below_the_command().map(text).collect();
    for dir in ENGINE.into_iter().chain(["kernel/src", "nodes/src"]) {
        let folder = root(dir).parent().unwrap().to_owned();
        let script = fs::read_to_string(folder.join("build.rs")).unwrap();
        assert!(script.contains("shibo_fingerprint::emit()"), "{dir} has no fingerprint");
        let manifest = fs::read_to_string(folder.join("Cargo.toml")).unwrap();
        let name = manifest.lines().find_map(|line| line.strip_prefix("name = ")).unwrap().trim_matches('"');
        let elsewhere = all.matches(&format!("{}::CODE", name.replace('-', "_"))).count();
        let here = text(dir).matches("crate::CODE").count();
        assert_eq!(elsewhere + here, 1, "the code of {name} is in the key of the code once");
    }
}
