//! Pinned graphs, end to end.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::Desk;

const GRAPH: &str = "// A.\n(\n  version: 1,\n  canvas: (size_mm: 20, resolution: 16),\n  nodes: {\n    \"a\": Perlin(size: 5),\n  },\n  outputs: { \"a\": \"a\" },\n)\n";

fn text(desk: &Desk) -> String {
    String::from_utf8(desk.read("a.ron")).unwrap()
}

#[test]
fn pins_a_graph_and_removes_the_pin() {
    let desk = Desk::new();
    desk.write("a.ron", GRAPH);
    let ran = desk.shibo("pin a.ron").expect(0);
    assert!(ran.stderr.contains("pinned at change 1: a.ron"), "{}", ran.stderr);
    let pinned = text(&desk);
    assert_eq!(pinned, GRAPH.replace("version: 1,", "version: 1,\n  pins: 1,"));
    desk.shibo("pin a.ron").expect(0);
    assert_eq!(text(&desk), pinned);
    desk.shibo("fmt --check a.ron").expect(0);
    desk.shibo("check a.ron").expect(0);
    desk.shibo("pin --remove a.ron").expect(0);
    assert_eq!(text(&desk), GRAPH);
}

#[test]
fn a_graph_with_an_error_is_not_pinned() {
    let desk = Desk::new();
    let wrong = GRAPH.replace("Perlin", "Perlim");
    desk.write("a.ron", &wrong);
    assert!(desk.shibo("pin a.ron").expect(1).stderr.contains("did you mean `Perlin`?"));
    assert_eq!(text(&desk), wrong);
    assert!(desk.shibo("pin --to 9999 a.ron").expect(2).stderr.contains("change 9999 is unknown"));
}

#[test]
fn a_pin_of_a_newer_program_is_an_error_but_can_be_ignored() {
    let desk = Desk::new();
    desk.write("a.ron", GRAPH.replace("version: 1,", "version: 1, pins: 9999,"));
    let ran = desk.shibo("check a.ron").expect(1);
    assert!(
        ran.stderr.contains("made with a newer Shibo: change 9999") && ran.stderr.contains("a.ron:3:21"),
        "{}",
        ran.stderr
    );
    desk.shibo("render a.ron --newest --no-cache -o out").expect(0);
    desk.shibo("pin a.ron").expect(0);
    desk.shibo("check a.ron").expect(0);
}
