//! `shibo pin` and `shibo merge` on a full disk, in a folder that cannot be written, and when they are killed: a file is the old one
//! or the new one, and nothing is left beside it.
#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::support::{Desk, Ran, finish};
use std::fs::Permissions;
use std::os::unix::fs::PermissionsExt;
use std::process::{Command, Stdio};
use std::time::Duration;

/// A graph of more than 20 kB with a number.
fn graph(size: u32) -> String {
    let comment =
        "// A line of a long comment, so that the file has more bytes than the limit of the test allows.\n".repeat(220);
    format!(
        "{comment}(\n  version: 1,\n  canvas: (size_mm: 20, resolution: 16),\n  nodes: {{\n    \"a\": Perlin(size: {size}),\n    \
         \"b\": Perlin(size: 3),\n  }},\n  outputs: {{ \"a\": \"a\" }},\n)\n"
    )
}

/// Runs a command that may write at most 8 kB into a file, as if the disk were full.
fn on_a_full_disk(desk: &Desk, line: &str) -> Ran {
    let shibo = assert_cmd::cargo::cargo_bin!("shibo");
    let mut limited = Command::new("sh");
    limited.current_dir(desk.path("")).arg("-c");
    limited.arg(format!("trap '' XFSZ; ulimit -f 8; exec '{}' {line}", shibo.display()));
    finish(limited)
}

fn versions(desk: &Desk) {
    desk.write("base.ron", graph(5));
    desk.write("ours.ron", graph(6));
    desk.write("theirs.ron", graph(5).replace("size: 3", "size: 4"));
}

#[test]
fn a_full_disk_leaves_the_graph_that_is_pinned() {
    let desk = Desk::new();
    desk.write("a.ron", graph(5));
    let ran = on_a_full_disk(&desk, "pin a.ron --no-cache").expect(1);
    assert!(ran.stderr.contains("cannot write `a.ron`"), "{}", ran.stderr);
    assert_eq!((desk.read("a.ron"), desk.names("")), (graph(5).into_bytes(), vec!["a.ron".to_owned()]));
}

#[test]
fn a_full_disk_leaves_the_lock() {
    let desk = Desk::new();
    let outputs: String = (0..80).map(|index| format!("\"an_output_with_a_long_name_{index}\": \"a\", ")).collect();
    let few = "(canvas: (size_mm: 20, resolution: 16), nodes: { \"a\": Perlin(size: 5) }, outputs: { \"a\": \"a\" })";
    desk.write("few.ron", few);
    desk.write("many.ron", few.replace("\"a\": \"a\" }", &format!("{outputs} }}")));
    desk.shibo("pin --lock-only few.ron").expect(0);
    let lock = desk.read("shibo.lock");
    let ran = on_a_full_disk(&desk, "pin --lock-only many.ron --no-cache").expect(1);
    assert!(ran.stderr.contains("cannot write `shibo.lock`"), "{}", ran.stderr);
    assert_eq!(desk.read("shibo.lock"), lock);
    desk.shibo("verify few.ron").expect(0);
    assert!(!desk.names("").iter().any(|name| name.ends_with(".tmp")), "{:?}", desk.names(""));
}

#[test]
fn a_full_disk_leaves_the_version_that_is_merged() {
    let desk = Desk::new();
    versions(&desk);
    desk.write("old.ron", "old");
    let names = desk.names("");
    for (line, file) in [("", "ours.ron"), (" -o old.ron", "old.ron"), (" -o new.ron", "new.ron")] {
        let before = std::fs::read(desk.path(file)).ok();
        let ran = on_a_full_disk(&desk, &format!("merge base.ron ours.ron theirs.ron{line}")).expect(129);
        assert!(ran.stderr.contains(&format!("cannot write `{file}`")), "{}", ran.stderr);
        assert_eq!(std::fs::read(desk.path(file)).ok(), before, "{file}");
    }
    assert_eq!(desk.names(""), names);
    desk.shibo("merge base.ron ours.ron theirs.ron").expect(0);
    assert_eq!(desk.read("ours.ron"), graph(6).replace("size: 3", "size: 4").into_bytes());
}

#[test]
fn a_folder_that_cannot_be_written_stays_as_it_is() {
    let desk = Desk::new();
    std::fs::create_dir(desk.path("closed")).unwrap();
    for (name, text) in [("base.ron", graph(5)), ("ours.ron", graph(6)), ("theirs.ron", graph(7))] {
        desk.write(&format!("closed/{name}"), text);
    }
    std::fs::set_permissions(desk.path("closed"), Permissions::from_mode(0o555)).unwrap();
    if std::fs::write(desk.path("closed/probe"), "").is_ok() {
        eprintln!("skipped: a folder that cannot be written, this user may write everywhere");
        return;
    }
    desk.shibo("pin closed/base.ron --no-cache").expect(1);
    desk.shibo("pin --lock-only closed/base.ron --no-cache").expect(1);
    desk.shibo("merge closed/base.ron closed/ours.ron closed/theirs.ron").expect(129);
    let read = |name: &str| String::from_utf8(desk.read(name)).unwrap();
    assert_eq!((read("closed/base.ron"), read("closed/ours.ron")), (graph(5), graph(6)));
    assert_eq!(desk.names("closed"), ["base.ron", "ours.ron", "theirs.ron"]);
    std::fs::set_permissions(desk.path("closed"), Permissions::from_mode(0o755)).unwrap();
}

/// Starts a command and kills it after a while.
fn killed(desk: &Desk, line: &str, after: Duration) {
    let mut child = desk.command(line.split_whitespace()).stderr(Stdio::null()).stdout(Stdio::null()).spawn().unwrap();
    std::thread::sleep(after);
    let _ = child.kill();
    child.wait().unwrap();
}

#[test]
fn a_killed_command_leaves_whole_files() {
    let desk = Desk::new();
    let pinned = |text: &str| text.replace("version: 1,", "version: 1,\n  pins: 1,");
    for step in 0..8 {
        let after = Duration::from_millis(step * step * 4);
        desk.write("a.ron", graph(5));
        versions(&desk);
        killed(&desk, "pin --to 1 a.ron --no-cache", after);
        let text = String::from_utf8(desk.read("a.ron")).unwrap();
        assert!(text == graph(5) || text == pinned(&graph(5)), "after {after:?}");
        if desk.path("shibo.lock").exists() {
            let lock = String::from_utf8(desk.read("shibo.lock")).unwrap();
            assert!(lock.ends_with("}\n"), "after {after:?}");
        }
        killed(&desk, "merge base.ron ours.ron theirs.ron", after);
        let text = String::from_utf8(desk.read("ours.ron")).unwrap();
        assert!(text == graph(6) || text == graph(6).replace("size: 3", "size: 4"), "after {after:?}");
    }
    // The next run is not disturbed by what a killed one left.
    desk.write("a.ron", graph(5));
    desk.shibo("pin --to 1 a.ron").expect(0);
    desk.shibo("verify a.ron").expect(0);
}
