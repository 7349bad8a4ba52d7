//! A real editor: headless neovim with the files of `editors/nvim`.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use std::fs;
use std::path::Path;
use std::process::Command;

const A: &str = "(
  canvas: (size_mm: 20, resolution: 64),
  nodes: {
    \"noise\": Perlim( size:4 ),
    \"points\": PoissonPoints(pitch: 2),
    \"dots\": Dots(points: \"\", diameter: 1),
    \"both\": \"= max(noise, dots)\",
  },
  outputs: { \"height\": \"both\" },
)
";
/// A graph that is never opened in the editor.
const LAYER: &str = "(nodes: { \"a\": Perlin() }, outputs: { \"depth\": \"a\", \"sum\": \"= a * 2\" })\n";
const C: &str = "(
  imports: { \"layer\": \"layer\" },
  nodes: {
    \"layer\": Use(graph: \"layer\"),
    \"b\": Blur(input: \"layer.\", radius: 1),
  },
  outputs: { \"o\": \"b\" },
)
";
const B: &str = "(imports: { \"a\": \"a\" }, nodes: { \"a\": Use(graph: \"a\"), \"soft\": Blur(input: \"a.height\", radius: 1) }, outputs: { \"o\": \"soft\" })\n";

#[test]
fn runs_editing_session_in_neovim() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().canonicalize().unwrap();
    fs::write(root.join("a.ron"), A).unwrap();
    fs::write(root.join("b.ron"), B).unwrap();
    fs::write(root.join("layer.ron"), LAYER).unwrap();
    fs::write(root.join("c.ron"), C).unwrap();
    let repository = Path::new(env!("CARGO_MANIFEST_DIR"));
    let run = Command::new("nvim")
        .args(["--headless", "-u", "NONE", "-i", "NONE", "-S"])
        .arg(repository.join("tests/neovim/session.lua"))
        .env("FOLDER", &root)
        .env("SHIBO", assert_cmd::cargo::cargo_bin!("shibo"))
        .env("PLUGIN", repository.join("editors/nvim"))
        .env("XDG_CACHE_HOME", root.join(".cache"))
        .output()
        .expect("neovim is installed (apt-get install neovim)");
    assert!(run.status.success(), "{}{}", String::from_utf8_lossy(&run.stdout), String::from_utf8_lossy(&run.stderr));
    let expected = A
        .replace("Perlim( size:4 )", "Perlin(size: 4)")
        .replace("points: \"\"", "points: \"points\"")
        .replace("\"height\"", "\"relief\"");
    assert_eq!(fs::read_to_string(root.join("a.ron")).unwrap(), expected);
    assert_eq!(fs::read_to_string(root.join("c.ron")).unwrap(), C.replace("layer.\"", "layer.depth\""));
    assert_eq!(fs::read_to_string(root.join("b.ron")).unwrap(), B.replace("a.height", "a.relief"));
}
