//! The tutorial of hybrids: the command runs every step without a warning and gives the picture on the page.
//!
//! `BLESS=1 cargo test --release --test shipped tutorial` rewrites `docs/hybrids/N.png`.
#![allow(dead_code, clippy::unwrap_used, reason = "support has more than is used; tests fail by panicking")]
use crate::golden;

use crate::picture::Picture;
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
            .args(["render", "inlay.ron", "-o", "out", "--output", "lit", "--resolution", "320", "-q"])
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

#[test]
fn tutorial_warns_of_mask_in_place_of_distance() {
    let folder = tempfile::tempdir().unwrap();
    let (from, to) = (r#"a: "panel.distance", amount"#, r#"a: "panel", amount"#);
    assert!(steps()[8].contains(from));
    std::fs::write(folder.path().join("inlay.ron"), steps()[8].replacen(from, to, 1)).unwrap();
    let run = Command::new(assert_cmd::cargo::cargo_bin!("shibo"))
        .args(["check", "inlay.ron"])
        .current_dir(folder.path())
        .env("XDG_CACHE_HOME", folder.path().join("cache"))
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&run.stderr);
    assert!(run.status.success() && said.contains("connect the output `distance`"), "{said}");
}

/// Likely mistakes of readers in the ninth step: original, mistake, and the remedy in the message.
const MISTAKES: [(&str, &str, &str); 27] = [
    (r#""shibo:walnut""#, r#""shibo:wallnut""#, "did you mean `walnut`?"),
    (r#""shibo:walnut""#, r#""walnut""#, "write `\"shibo:walnut\"`"),
    (r#"Use(graph: "wood")"#, r#"Use(graph: "shibo:walnut")"#, "`imports: { \"walnut\": \"shibo:walnut\" }`"),
    (r#"Use(graph: "wood")"#, r#"Use("wood")"#, "`shibo nodes Use` tells its fields"),
    (r#"Use(graph: "wood")"#, r#"Use(graph: "wood", preset: "drak")"#, "presets: `"),
    (r#"Use(graph: "wood")"#, r#"Use(graph: "wood", with: { "colour": 3 })"#, "names: `"),
    (r#"top: "leather""#, r#"top: "calf.lit""#, "`calf.material` is Material"),
    (r#"top: "leather""#, r#"top: "lether""#, "did you mean `leather`?"),
    (r#"top: "leather", "#, "", "write `top: \"node\"`"),
    (r#"mask: "panel""#, r#"mask: "calf.lit""#, r#"`"= luminance(calf.lit)"`"#),
    ("form: Box", "form: \"Box\"", "write `Box` without quotes"),
    ("form: Box", "form: Square", "choices: `Circle`"),
    ("size: 76", "size: \"76mm\"", "write `76`, without quotes and unit"),
    ("size: 76", "size: 76mm", "write numbers without a unit"),
    ("size: 76", "size: \"= panel * 2\"", "formulas of nodes stand in ports"),
    ("size: 76", "size: \"= 2 * (3\"", "a closing bracket is missing"),
    ("radius: 14),", "radius: 14,", "close the bracket before it"),
    (r#"a: "panel.distance", amount"#, "a: panel.distance, amount", "in quotes"),
    ("calf.material.height", "calf.material.hight", "did you mean `height`?"),
    ("radius: 0.35", "radius: \"0.35\"", "write `0.35`, without quotes"),
    ("size_mm: 110", "size: 110", "did you mean `size_mm`?"),
    ("outputs: {", "output: {", "did you mean `outputs`?"),
    (r#""leather": Material"#, r#""leather" Material"#, "write `\"name\": value`"),
    (r#"material: "inlay", environment"#, r#"material: "level", environment"#, "Material comes from `"),
    ("BlendMaterials", "MaterialBlend", "here it is called `BlendMaterials`"),
    (r#""gap": "="#, r#""panel": "="#, "give one of them another name"),
    (r#""lit": "picture""#, r#""lit": picture"#, "write `\"picture\"`"),
];

#[test]
fn every_mistake_gets_a_remedy() {
    let steps = steps();
    let folder = tempfile::tempdir().unwrap();
    let mut silent = Vec::new();
    for (from, to, help) in MISTAKES {
        assert!(steps[8].contains(from), "{from}");
        std::fs::write(folder.path().join("inlay.ron"), steps[8].replacen(from, to, 1)).unwrap();
        let run = Command::new(assert_cmd::cargo::cargo_bin!("shibo"))
            .args(["check", "inlay.ron"])
            .current_dir(folder.path())
            .env("XDG_CACHE_HOME", folder.path().join("cache"))
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&run.stderr);
        if run.status.code() != Some(1) || !said.contains(help) {
            silent.push(format!("{to}: {help}\n{said}"));
        }
    }
    assert!(silent.is_empty(), "{}", silent.join("\n"));
}
