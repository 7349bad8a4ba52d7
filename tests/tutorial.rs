//! The tutorial of hybrids: the real command runs every step, without a warning, and gives the picture that is shown.
//!
//! `BLESS=1 cargo test --release --test tutorial` writes `docs/hybrids/N.png` anew.
#![allow(dead_code, clippy::unwrap_used, reason = "support has more than is used; tests fail by panicking")]
#[path = "support/bless.rs"]
mod bless;
#[path = "support/golden.rs"]
mod golden;
#[path = "support/picture.rs"]
mod picture;

use picture::Picture;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// The graphs of the page, in their order.
fn steps() -> Vec<String> {
    let page = std::fs::read_to_string(root("docs/hybrids.md")).unwrap();
    page.split("```ron\n").skip(1).map(|rest| rest.split("```").next().unwrap().to_owned()).collect()
}

#[test]
fn every_step_gives_its_picture() {
    let steps = steps();
    assert_eq!(steps.len(), 10);
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir_all(root("docs/hybrids")).unwrap();
    let mut problems = Vec::new();
    for (number, text) in (1..).zip(&steps) {
        let path = folder.path().join("inlay.ron");
        std::fs::write(&path, text).unwrap();
        let run = Command::new(assert_cmd::cargo::cargo_bin!("shibo"))
            .args(["render", "inlay.ron", "-o", "out", "--no-cache", "--output", "lit", "--resolution", "320", "-q"])
            .current_dir(folder.path())
            .env("XDG_CACHE_HOME", folder.path().join("cache"))
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&run.stderr);
        assert!(run.status.success() && said.is_empty(), "step {number}: {said}");
        let picture = Picture::read(&folder.path().join("out/lit.png")).unwrap();
        problems.extend(golden::compare(&root(&format!("docs/hybrids/{number}.png")), &picture).err());
    }
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}
