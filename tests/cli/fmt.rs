//! `shibo fmt`: the layout of graph files.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::{Desk, Ran};
use shibo_engine::eval::Keys;
use shibo_graph::syntax::{TokenKind, Tree, format};
use shibo_graph::{Graph, LoadOptions, load_text};
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Stdio;

const BEFORE: &str = "(nodes:{\"a\":Perlin( size:4 )}, // why\noutputs:{\"a\":\"a\"})";
const AFTER: &str = "(\n  nodes: {\n    \"a\": Perlin(size: 4),\n  }, // why\n  outputs: { \"a\": \"a\" },\n)\n";

/// Runs the command with a text on stdin.
fn piped(desk: &Desk, line: &str, text: &str) -> Ran {
    let mut command = desk.command(line.split_whitespace());
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    child.stdin.take().unwrap().write_all(text.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    Ran {
        code: output.status.code(),
        stdout: String::from_utf8(output.stdout).unwrap(),
        stderr: String::from_utf8(output.stderr).unwrap(),
    }
}

fn shipped() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("graphs");
    let mut graphs = Vec::new();
    for folder in [root.clone(), root.join("lib")] {
        let files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        graphs.extend(files.filter(|path| path.extension().is_some_and(|extension| extension == "ron")));
    }
    assert!(graphs.len() > 40);
    graphs
}

#[test]
fn files_are_laid_out_in_place() {
    let desk = Desk::new();
    desk.write("a.ron", BEFORE);
    desk.write("b.ron", AFTER);
    let listed = desk.shibo("fmt --check a.ron b.ron").expect(1);
    assert_eq!(listed.stdout, "a.ron\n");
    assert_eq!(desk.read("a.ron"), BEFORE.as_bytes(), "--check changes nothing");
    let changed = fs::metadata(desk.path("b.ron")).unwrap().modified().unwrap();
    desk.shibo("fmt a.ron b.ron").expect(0);
    assert_eq!(desk.read("a.ron"), AFTER.as_bytes());
    assert_eq!(fs::metadata(desk.path("b.ron")).unwrap().modified().unwrap(), changed, "what is good is not written");
    assert_eq!(desk.shibo("fmt --check a.ron b.ron").expect(0).stdout, "");
    assert_eq!(desk.names("."), ["a.ron", "b.ron"]);
}

#[test]
fn keeps_broken_file_and_formats_others() {
    let desk = Desk::new();
    let broken = "(nodes: { \"a\": Perlin(size: ) })";
    desk.write("a.ron", broken);
    desk.write("b.ron", BEFORE);
    desk.write("mark.ron", format!("\u{FEFF}{AFTER}"));
    // Semantic errors do not matter.
    desk.write("c.ron", "(nodes:{\"a\":Nothing()})");
    let ran = desk.shibo("fmt a.ron nowhere.ron b.ron c.ron mark.ron").expect(1);
    assert!(ran.stderr.contains("expected a value") && ran.stderr.contains("nowhere.ron"), "{}", ran.stderr);
    assert_eq!(desk.read("mark.ron"), AFTER.as_bytes());
    assert_eq!(desk.read("a.ron"), broken.as_bytes());
    assert_eq!(desk.read("b.ron"), AFTER.as_bytes());
    assert!(desk.read("c.ron").ends_with(b"\n)\n"));
}

#[test]
fn formats_stdin() {
    let desk = Desk::new();
    let ran = piped(&desk, "fmt --stdin", BEFORE).expect(0);
    assert_eq!((ran.stdout.as_str(), ran.stderr.as_str()), (AFTER, ""));
    assert_eq!(piped(&desk, "fmt --stdin --check", AFTER).expect(0).stdout, "");
    assert_eq!(piped(&desk, "fmt --stdin --check", BEFORE).expect(1).stdout, "");
    let ran = piped(&desk, "fmt --stdin", "(nodes: {").expect(1);
    assert!(ran.stdout.is_empty() && ran.stderr.contains("ends too early"), "{}", ran.stderr);
    desk.shibo("fmt").expect(2);
    desk.shibo("fmt --stdin a.ron").expect(2);
}

#[cfg(unix)]
#[test]
fn links_are_followed_and_permissions_and_line_ends_kept() {
    use std::os::unix::fs::PermissionsExt;
    let desk = Desk::new();
    desk.write("real.ron", BEFORE.replace('\n', "\r\n"));
    fs::set_permissions(desk.path("real.ron"), fs::Permissions::from_mode(0o640)).unwrap();
    std::os::unix::fs::symlink("real.ron", desk.path("link.ron")).unwrap();
    desk.shibo("fmt link.ron").expect(0);
    assert!(fs::symlink_metadata(desk.path("link.ron")).unwrap().is_symlink());
    assert_eq!(desk.read("real.ron"), AFTER.replace('\n', "\r\n").as_bytes());
    assert_eq!(fs::metadata(desk.path("real.ron")).unwrap().permissions().mode() & 0o777, 0o640);
}

#[test]
fn folders_are_searched_for_graphs() {
    let desk = Desk::new();
    fs::create_dir_all(desk.path("in/lib")).unwrap();
    desk.write("in/a.ron", BEFORE);
    desk.write("in/lib/b.ron", BEFORE);
    desk.write("in/settings.ron", "(a:1)");
    desk.write("in/a.txt", BEFORE);
    let listed = desk.shibo("fmt --check in").expect(1);
    assert_eq!(listed.stdout, "in/a.ron\nin/lib/b.ron\n");
}

#[test]
fn shipped_graphs_are_laid_out() {
    for path in shipped() {
        let text = fs::read_to_string(&path).unwrap();
        let laid_out = format(&text).unwrap();
        assert!(laid_out == text, "{} is not laid out: run `shibo fmt graphs`", path.display());
        assert!(text.lines().all(|line| line.chars().count() <= 120 || line.contains("//") || line.contains('"')));
    }
}

/// The text with other blanks and optional trailing commas, chosen by a hash for each token.
fn shaken(text: &str, seed: usize) -> String {
    let tree = Tree::parse(text);
    let pieces = tree.tokens();
    let mut out = String::new();
    for (i, token) in pieces.iter().enumerate() {
        let choice = (i + 1).wrapping_mul(seed * 2 + 1).wrapping_mul(0x9E37_79B9) >> 7;
        let next = pieces.get(i + 1).map(|next| next.kind());
        let last = token.kind() == TokenKind::Comma && next == Some(TokenKind::Close);
        if last && choice % 2 == 0 {
            continue;
        }
        out.push_str(&text[token.range()]);
        let value = !matches!(token.kind(), TokenKind::Open | TokenKind::Comma | TokenKind::Colon);
        if value && next == Some(TokenKind::Close) && choice % 3 == 0 {
            out.push(',');
        }
        out.push_str(["", " ", "\n", " /* c */ ", "\n\n\n  ", " // d\n"][choice % 6]);
    }
    out
}

#[test]
fn the_layout_changes_no_key() {
    let registry = shibo_nodes::registry();
    let loaded =
        |path: &Path, text: &str| -> Option<Graph> { load_text(path, text, &registry, &LoadOptions::default()).graph };
    let keys = |graph: &Graph| {
        let keys = Keys::of(graph).unwrap();
        graph.outputs.iter().map(|output| keys.output(output.node, output.output)).collect::<Vec<_>>()
    };
    for (seed, path) in shipped().iter().enumerate() {
        let text = fs::read_to_string(path).unwrap();
        let Some(graph) = loaded(path, &text) else { panic!("{}", path.display()) };
        let shaken = shaken(&text, seed);
        let laid_out = format(&shaken).unwrap();
        assert_eq!(format(&laid_out).as_deref(), Ok(laid_out.as_str()), "{}", path.display());
        let again = loaded(path, &laid_out).unwrap();
        assert_eq!(keys(&graph), keys(&again), "{}", path.display());
    }
}
