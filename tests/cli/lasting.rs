//! The commands of docs/lasting.md print the text that the page shows: `BLESS=1` rewrites the page.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::bless;
use crate::support::Desk;
use std::path::Path;
use std::process::{Command, Stdio};

/// The graph of the page.
const HIDE: &str = r##"(
  version: 1,
  canvas: (size_mm: 20, resolution: 256, tile: Both),
  params: {
    "pitch": Number(default: 0.62, range: (0.3, 2), unit: "mm", doc: "Size of a cell"),
    "color": Color(default: "#623a28", doc: "Colour of the hide"),
  },
  nodes: {
    // Smooth areas lie beside crisp ones.
    "grain": Fractal(size: "= 8 * $pitch", octaves: 3, seed: 1),
    "fold": Perlin(size: 4, seed: 2),
    "height": "= 0.1 * grain + 0.3 * fold",
    "lit": Relief(height: "height", azimuth: 120),
  },
  outputs: { "height": "height", "lit": "lit" },
)
"##;

/// Runs a line of the page in a shell. Returns all output, in the order of stdout and stderr.
fn run(desk: &Desk, line: &str) -> String {
    let program = assert_cmd::cargo::cargo_bin!("shibo").parent().unwrap().to_owned();
    let paths = std::env::join_paths(
        std::iter::once(program).chain(std::env::split_paths(&std::env::var_os("PATH").unwrap_or_default())),
    );
    let mut command = Command::new("sh");
    command.args(["-c", line]).current_dir(desk.path("")).stdin(Stdio::null()).env("PATH", paths.unwrap());
    command.env("HOME", desk.path("")).env("GIT_CONFIG_NOSYSTEM", "1").env_remove("XDG_CONFIG_HOME");
    for who in ["AUTHOR", "COMMITTER"] {
        command.env(format!("GIT_{who}_NAME"), "a").env(format!("GIT_{who}_EMAIL"), "a@b");
    }
    let output = command.output().unwrap();
    let text = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
    // Folders of this run.
    let folder = desk.path("").canonicalize().unwrap();
    text.replace(&format!("{}/", folder.display()), "")
}

#[test]
fn page_shows_real_output() {
    let desk = Desk::new();
    let hide = |changes: &[(&str, &str)]| {
        desk.write("hide.ron", changes.iter().fold(HIDE.to_owned(), |text, (from, to)| text.replace(from, to)));
    };
    hide(&[]);
    run(&desk, "git init -q -b main . && git add hide.ron && git commit -qm Hide");
    let page_path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/lasting.md");
    let page = std::fs::read_to_string(&page_path).unwrap();
    let (mut made, mut console) = (String::new(), false);
    for line in page.lines() {
        if console && line.starts_with("```") {
            console = false;
        }
        if console && !line.starts_with("$ ") {
            continue;
        }
        made += &format!("{line}\n");
        console |= line == "```console";
        let Some(command) = line.strip_prefix("$ ").filter(|_| console) else { continue };
        match command {
            // The changes of the page.
            "shibo diff HEAD:hide.ron hide.ron" => hide(&[
                ("0.62", "0.7"),
                ("\"fold\"", "\"folds\""),
                ("* fold\"", "* folds\""),
                (", azimuth: 120", ""),
                ("    \"height\": \"=", "    \"soft\": Blur(input: \"grain\", radius: 0.4),\n    \"height\": \"="),
            ]),
            "git merge -q -m \"Merge coarse grain\" coarse" => {
                let commit = |branch: &str, base: &str, from: &str, to: &str| {
                    run(&desk, &format!("git checkout -qf {base} && git checkout -qb {branch}"));
                    let text = String::from_utf8(desk.read("hide.ron")).unwrap();
                    desk.write("hide.ron", text.replace(from, to));
                    run(&desk, "git commit -qam Change");
                };
                commit("coarse", "main", "octaves: 3", "octaves: 2");
                commit("paler", "main", "#623a28", "#a67c5a");
                commit("dark", "main", "#623a28", "#2b2a2c");
                commit("fine", "dark", "8 * $pitch", "6 * $pitch");
            }
            _ => {}
        }
        made += &run(&desk, command);
    }
    bless::compare(&page_path, made.as_bytes()).unwrap();
}
