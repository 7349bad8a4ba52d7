//! The cache folder in use: several runs at once, exchanged entries, full disks. The pictures are the same, and no
//! warning is printed.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::{Desk, finish};
use std::path::{Path, PathBuf};

/// The small graph with a material among its outputs, as the shipped leathers have.
fn desk() -> Desk {
    let desk = Desk::with_graph();
    let graph = String::from_utf8(desk.read("a.ron")).unwrap();
    let nodes = "\"normal\": HeightToNormal(input: \"strokes\"),\n    \
                 \"leather\": Material(base_color: \"#7a4526\", height: \"strokes\", normal: \"normal\"),\n  },\n  outputs: {";
    // Makes the simulation long enough that its result is kept.
    let graph = graph.replace("steps: 20,", "steps: 4000,");
    let graph = graph.replace("},\n  outputs: {", &format!("{nodes} \"leather\": \"leather\","));
    desk.write("a.ron", graph);
    desk
}

fn entries(dir: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() { found.extend(entries(&path)) } else { found.push(path) }
    }
    found.sort();
    found
}

#[track_caller]
fn same(desk: &Desk, one: &str, two: &str) {
    assert_eq!(desk.names(one), desk.names(two));
    for name in desk.names(one) {
        assert!(desk.read(&format!("{one}/{name}")) == desk.read(&format!("{two}/{name}")), "{two}/{name}");
    }
}

/// Gives every entry of a shelf the content of the next entry.
fn turn(shelf: &Path) -> usize {
    let all = entries(shelf);
    let contents: Vec<Vec<u8>> = all.iter().map(|path| std::fs::read(path).unwrap()).collect();
    for (path, content) in all.iter().zip(contents.iter().cycle().skip(1)) {
        std::fs::write(path, content).unwrap();
    }
    all.len()
}

#[test]
fn exchanged_entries_never_reach_a_picture() {
    let desk = desk();
    desk.shibo("render a.ron -o right --no-cache").expect(0);
    for (i, shelf) in ["files", "objects", "tiles", "channels"].into_iter().enumerate() {
        let out = format!("out{i}");
        desk.shibo(&format!("render a.ron --cache-dir c{i} -o first")).expect(0);
        let cache = desk.path(format!("c{i}"));
        if shelf != "files" {
            // Otherwise only the encoded files are read.
            std::fs::remove_dir_all(cache.join("files")).unwrap();
        }
        // The kept tiles depend on the machine; the other shelves always have entries.
        let exchanged = if cache.join(shelf).exists() { turn(&cache.join(shelf)) } else { 0 };
        assert!(exchanged > 0 || shelf == "tiles", "{shelf}");
        let ran = desk.shibo(&format!("render a.ron --cache-dir c{i} -o {out}")).expect(0);
        assert!(!ran.stderr.contains("warning") && !ran.stderr.contains("error"), "{}", ran.stderr);
        same(&desk, "right", &out);
    }
}

#[test]
fn runs_at_the_same_time_share_a_cache() {
    let desk = desk();
    desk.shibo("render a.ron -o right --no-cache").expect(0);
    let outs = ["a", "b", "c"];
    let runs = outs.map(|out| {
        let mut command = desk.command(["render", "a.ron", "--cache-dir", "both", "-o", out]);
        command.stdout(std::process::Stdio::null()).stderr(std::process::Stdio::piped()).spawn().unwrap()
    });
    for run in runs {
        let output = run.wait_with_output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    outs.into_iter().for_each(|out| same(&desk, "right", out));
    // The shared cache is intact: a fourth run computes nothing.
    let stats = desk.shibo("render a.ron --cache-dir both -o d --stats json").expect(0).json();
    assert!(stats["nodes"].as_array().unwrap().iter().all(|node| node["state"] != "computed"), "{stats}");
    same(&desk, "right", "d");
    assert!(entries(&desk.path("both")).iter().all(|path| path.extension().is_none_or(|e| e != "tmp")));
}

/// Files are limited to 8 kB: small objects fit, tiles do not; the pictures fit as well.
#[test]
#[cfg(unix)]
fn renders_without_cache_on_full_disk() {
    let desk = desk();
    desk.shibo("render a.ron -o right --no-cache --resolution 24").expect(0);
    let shibo = assert_cmd::cargo::cargo_bin!("shibo");
    let mut limited = std::process::Command::new("sh");
    // Blocks of 512 bytes.
    let run = "render a.ron --resolution 24 --cache-dir full -o out";
    limited
        .current_dir(desk.path("."))
        .arg("-c")
        .arg(format!("trap '' XFSZ; ulimit -f 16; exec '{}' {run}", shibo.display()));
    let ran = finish(limited).expect(0);
    assert!(!ran.stderr.contains("error"), "{}", ran.stderr);
    same(&desk, "right", "out");
    assert!(entries(&desk.path("full")).iter().all(|path| path.extension().is_none_or(|e| e != "tmp")));
}
