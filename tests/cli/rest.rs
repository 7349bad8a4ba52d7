//! `shibo new`, `graph`, `cache`, `completions`, and the command itself.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::Desk;

#[test]
fn templates_make_valid_graphs() {
    let desk = Desk::new();
    let list = desk.shibo("new").expect(0).stdout;
    let names: Vec<&str> = list.lines().filter_map(|line| line.split_whitespace().next()).collect();
    assert_eq!(names, ["starter", "leather", "noise"]);
    for name in names {
        let ran = desk.run(["new", &format!("my_{name}"), "--from", name]).expect(0);
        assert_eq!(ran.stdout, "");
        desk.run(["check", &format!("my_{name}.ron")]).expect(0);
    }
}

/// A copy of a shipped graph finds its imports wherever it is.
#[test]
fn copies_of_shipped_graphs_are_valid() {
    let desk = Desk::new();
    let mut line = vec!["check".to_owned()];
    for graph in shibo_library::graphs() {
        let ran = desk.run(["new", graph.name, "--from", graph.name, "--no-pin"]);
        if ran.stderr.contains("it cannot be copied") {
            continue;
        }
        ran.expect(0);
        line.push(format!("{}.ron", graph.name));
    }
    assert!(line.len() > 120, "{}", line.len());
    desk.run(line).expect(0);
}

#[test]
fn nothing_is_overwritten() {
    let desk = Desk::new();
    desk.write("a.ron", "mine");
    let ran = desk.shibo("new a --from starter").expect(1);
    assert!(ran.stderr.contains("a.ron") && ran.stderr.contains("exists"), "{}", ran.stderr);
    desk.shibo("new a.ron --from starter").expect(1);
    assert_eq!(desk.read("a.ron"), b"mine");
    desk.shibo("new b --from startr").expect(2);
    desk.shibo("new b").expect(2);
    desk.shibo("new --from starter").expect(2);
    desk.shibo("new no/folder --from starter").expect(1);
    assert_eq!(desk.names("."), ["a.ron"]);
}

#[test]
fn graphs_are_drawn() {
    let desk = Desk::with_graph();
    let dot = desk.shibo("graph a.ron --format dot").expect(0).stdout;
    assert!(dot.starts_with("digraph \"a.ron\" {") && dot.contains("label=\"Perlin\\nbumps\"") && dot.ends_with("}\n"));
    assert_eq!(dot.matches(" -> ").count(), 8);
    let svg = desk.shibo("graph a.ron --format svg").expect(0).stdout;
    assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>\n"));
    assert_eq!((svg.matches("<rect ").count(), svg.matches("<path ").count()), (10, 8));
    assert!(svg.contains("<title>strokes.mask → mask: Gray</title>"), "{svg}");
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
    desk.write("bad.ron", "(");
    let ran = desk.shibo("graph bad.ron --format svg").expect(1);
    assert_eq!(ran.stdout, "");
    desk.shibo("graph a.ron --format png").expect(2);
}

#[test]
fn the_cache_is_counted_and_emptied() {
    let desk = Desk::with_graph();
    let empty = desk.shibo("cache stat").expect(0).json();
    assert_eq!((empty["entries"].as_u64(), empty["bytes"].as_u64()), (Some(0), Some(0)));
    assert!(!desk.path("cache").exists(), "looking makes nothing");
    desk.shibo("render a.ron").expect(0);
    assert!(desk.shibo("cache stat").expect(0).json()["entries"].as_u64() > Some(0));
    let ran = desk.shibo("cache clear").expect(0);
    assert_eq!(ran.stdout, "");
    assert_eq!(desk.shibo("cache stat").expect(0).json()["entries"], 0);
    desk.shibo("render a.ron --cache-dir mine").expect(0);
    assert!(desk.shibo("cache stat --cache-dir mine").expect(0).json()["bytes"].as_u64() > Some(0));
}

#[test]
fn the_command_explains_itself() {
    let desk = Desk::new();
    assert!(desk.shibo("--version").expect(0).stdout.starts_with("shibo 0."));
    for command in ["render", "check", "fmt", "migrate", "nodes", "dump", "new", "graph", "cache", "completions"] {
        let ran = desk.run([command, "--help"]).expect(0);
        assert!(ran.stderr.is_empty() && ran.stdout.contains("Usage: shibo"), "{command}");
    }
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        assert!(desk.run(["completions", shell]).expect(0).stdout.contains("shibo"), "{shell}");
    }
    desk.shibo("man pages").expect(0);
    let pages = desk.names("pages");
    assert!(
        ["shibo.1", "shibo-render.1", "shibo-cache-stat.1"].iter().all(|page| pages.contains(&(*page).into())),
        "{pages:?}"
    );
    let page = String::from_utf8(desk.read("pages/shibo-render.1")).unwrap();
    assert!(page.contains(".TH") && page.contains("\\-\\-resolution") && page.contains("Examples"), "{page}");
    for line in ["", "paint", "completions tcsh"] {
        let ran = desk.shibo(line).expect(2);
        assert!(ran.stdout.is_empty() && !ran.stderr.is_empty(), "{line}");
    }
}
