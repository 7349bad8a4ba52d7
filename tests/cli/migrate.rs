//! `shibo migrate`: graph files with kinds of nodes that formulas replace.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::Desk;
use std::fs;

const BEFORE: &str = r#"(
  nodes: {
    "a": Perlin(size: 4),
    "h1": Math(operation: Multiply, a: "a", b: 0.5),
    "h2": Math(operation: Add, a: "h1", b: 1),
    "r": Blur(input: "h2"),
  },
  outputs: { "r": "r" },
)
"#;

fn after() -> String {
    let lines = BEFORE.lines().filter(|line| !line.contains("Math(")).map(|line| format!("{line}\n"));
    lines.collect::<String>().replace("Blur(input: \"h2\")", "Blur(input: \"= 0.5 * a + 1\")")
}

#[test]
fn rewrites_files_in_place() {
    let desk = Desk::new();
    desk.write("old.ron", BEFORE);
    desk.write("new.ron", after());
    let listed = desk.shibo("migrate --check old.ron new.ron").expect(1);
    assert_eq!((listed.stdout.as_str(), desk.read("old.ron")), ("old.ron\n", BEFORE.as_bytes().to_vec()));
    let shown = desk.shibo("migrate --dry-run old.ron new.ron").expect(0);
    assert_eq!((shown.stdout, desk.read("old.ron")), (after(), BEFORE.as_bytes().to_vec()));
    let changed = fs::metadata(desk.path("new.ron")).unwrap().modified().unwrap();
    let ran = desk.shibo("migrate .").expect(0);
    assert!(ran.stderr.contains("rewrote") && !ran.stderr.contains("new.ron"), "{}", ran.stderr);
    assert_eq!(String::from_utf8(desk.read("old.ron")).unwrap(), after());
    assert_eq!(fs::metadata(desk.path("new.ron")).unwrap().modified().unwrap(), changed);
    assert_eq!(desk.shibo("migrate --check old.ron new.ron").expect(0).stdout, "");
}

#[test]
fn errors_tell_what_replaces_old_kinds() {
    let desk = Desk::new();
    desk.write("old.ron", BEFORE);
    let ran = desk.shibo("check old.ron").expect(1);
    let told = ["`Math` is no longer a kind of node", "write `\"= 0.5 * a\"` instead", "write `\"= h1 + 1\"` instead"];
    assert!(told.iter().all(|text| ran.stderr.contains(text)), "{}", ran.stderr);
    assert!(ran.stderr.matches("error[").count() == 2 && ran.stderr.contains("shibo migrate FILE"), "{}", ran.stderr);
}

#[test]
fn names_files_of_several_new_texts() {
    let desk = Desk::new();
    desk.write("one.ron", BEFORE);
    desk.write("two.ron", BEFORE);
    let shown = desk.shibo("migrate --dry-run one.ron two.ron").expect(0).stdout;
    assert_eq!(shown, format!("// one.ron\n{0}// two.ron\n{0}", after()));
}

#[test]
fn keeps_broken_file_and_rewrites_others() {
    let desk = Desk::new();
    let broken = "(nodes: { \"a\": Math(a: ) })";
    desk.write("broken.ron", broken);
    desk.write("old.ron", BEFORE);
    let ran = desk.shibo("migrate broken.ron nowhere.ron old.ron").expect(1);
    assert!(ran.stderr.contains("expected a value") && ran.stderr.contains("nowhere.ron"), "{}", ran.stderr);
    assert_eq!(desk.read("broken.ron"), broken.as_bytes());
    assert_eq!(String::from_utf8(desk.read("old.ron")).unwrap(), after());
}

#[test]
fn warns_of_what_it_leaves() {
    let desk = Desk::new();
    desk.write("old.ron", BEFORE.replace("operation: Add", "operation: Sum"));
    let ran = desk.shibo("migrate old.ron").expect(0);
    assert!(ran.stderr.contains("not rewritten: there is no operation `Sum`"), "{}", ran.stderr);
    assert!(ran.stderr.contains("old.ron:5:"), "{}", ran.stderr);
    let text = String::from_utf8(desk.read("old.ron")).unwrap();
    assert!(
        text.contains("\"h2\": Math(operation: Sum, a: \"h1\", b: 1)") && text.contains("\"h1\": \"= 0.5 * a\""),
        "{text}"
    );
    desk.shibo("migrate").expect(2);
    desk.shibo("migrate --check --dry-run old.ron").expect(2);
}
