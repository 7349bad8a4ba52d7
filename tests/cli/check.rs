//! `shibo check`, end to end.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::{Desk, GRAPH, finish};
use serde_json::json;

const BAD: &str = "(
  version: 1,
  nodes: {
    \"a\": Perlim(size: 5),
    \"b\": Perlin(sise: 5),
    \"c\": ConnectNeighbors(points: \"nope\"),
  },
  outputs: { \"b\": \"b\" },
)
";

#[test]
fn a_good_graph_is_silent() {
    let ran = Desk::with_graph().shibo("check a.ron").expect(0);
    assert_eq!((ran.stdout.as_str(), ran.stderr.as_str()), ("", ""));
    let ran = Desk::with_graph().shibo("check a.ron --format json").expect(0);
    assert_eq!(ran.json(), json!({ "errors": [], "warnings": [] }));
}

#[test]
fn prints_all_errors_with_places() {
    let desk = Desk::new();
    desk.write("bad.ron", BAD);
    let mut command = desk.command(["check", "bad.ron"]);
    command.env("COLUMNS", "20");
    let ran = finish(command).expect(1);
    assert_eq!(ran.stdout, "");
    for place in ["bad.ron:4:10", "bad.ron:5:17", "bad.ron:6:35", "did you mean `Perlin`?", "3 errors"] {
        assert!(ran.stderr.contains(place), "{place}: {}", ran.stderr);
    }
    assert!(!ran.stderr.contains('\u{1b}'), "colours without a terminal");
}

#[test]
fn prints_all_errors_as_json() {
    let desk = Desk::with_graph();
    desk.write("bad.ron", BAD);
    let ran = desk.shibo("check a.ron bad.ron missing.ron --format json").expect(1);
    assert_eq!(ran.stderr, "");
    let json = ran.json();
    let errors = json["errors"].as_array().unwrap();
    let codes: Vec<_> = errors.iter().map(|e| e["code"].as_str().unwrap()).collect();
    assert_eq!(codes, ["unknown-kind", "unknown-field", "unknown-node", "file-not-found"]);
    assert_eq!(errors[0]["file"], "bad.ron");
    let place = ["line", "column", "end_line", "end_column"].map(|k| errors[0][k].as_u64().unwrap());
    assert_eq!(place, [4, 10, 4, 16]);
    assert_eq!(errors[0]["help"], "did you mean `Perlin`?");
    assert_eq!(errors[0]["related"], json!([]));
    assert_eq!(
        (&errors[3]["file"], &errors[3]["line"], &errors[3]["column"]),
        (&json!("missing.ron"), &json!(1), &json!(1))
    );
}

#[test]
fn warnings_do_not_fail() {
    let desk = Desk::new();
    desk.write("w.ron", GRAPH.replace("Perlin(size: \"$size\")", "Gradient()"));
    let ran = desk.shibo("check w.ron --format json").expect(0);
    assert_eq!(ran.json()["errors"], json!([]));
    assert!(!ran.json()["warnings"].as_array().unwrap().is_empty(), "{}", ran.stdout);
    let ran = desk.shibo("check w.ron").expect(0);
    assert!(ran.stderr.contains("warning") && ran.stderr.contains("w.ron:"), "{}", ran.stderr);
}

#[test]
fn values_of_the_command_line_are_checked_too() {
    let desk = Desk::with_graph();
    desk.shibo("check a.ron --set size=6 --preset large").expect(0);
    for args in ["--set size=99", "--set sise=6", "--preset larg", "--set size=x"] {
        let ran = desk.shibo(&format!("check a.ron {args}")).expect(1);
        assert!(ran.stderr.contains("error["), "{}", ran.stderr);
    }
    desk.shibo("check a.ron --set size").expect(2);
    desk.shibo("check").expect(2);
}

#[test]
fn verifies_cached_results() {
    let desk = Desk::with_graph();
    desk.shibo("render a.ron").expect(0);
    let ran = desk.shibo("check a.ron --verify").expect(0);
    assert_eq!(ran.stdout, "");
}

#[test]
fn a_plain_check_opens_no_cache() {
    let desk = Desk::with_graph();
    desk.shibo("check a.ron").expect(0);
    assert!(!desk.path("cache").exists());
}

#[test]
fn refuses_files_that_are_no_graphs() {
    let desk = Desk::new();
    desk.write("empty.ron", "");
    desk.write("bom.ron", [b"\xef\xbb\xbf", GRAPH.as_bytes()].concat());
    desk.write("truncated.ron", &GRAPH[..GRAPH.len() / 2]);
    desk.write("binary.ron", [0, 159, 146, 150]);
    desk.write("deep.ron", "(".repeat(100_000));
    std::fs::create_dir(desk.path("folder.ron")).unwrap();
    for name in ["missing", "empty", "truncated", "binary", "deep", "folder"] {
        let file = format!("{name}.ron");
        let ran = desk.run(["check", &file, "--format", "json"]).expect(1);
        let errors = ran.json()["errors"].clone();
        assert!(errors[0]["file"] == json!(file) && errors[0]["line"].as_u64() >= Some(1), "{file}: {errors}");
        let ran = desk.run(["check", &file]).expect(1);
        assert!(ran.stderr.contains(&format!("{file}:")), "{}", ran.stderr);
        desk.run(["render", &file]).expect(1);
        assert!(!desk.path("out").exists(), "{file}");
    }
    // A byte order mark is skipped.
    assert_eq!(desk.shibo("check bom.ron").expect(0).stderr, "");
}

#[test]
#[cfg(unix)]
fn refuses_pipes_and_devices_without_blocking() {
    let desk = Desk::new();
    let made = std::process::Command::new("mkfifo").arg(desk.path("pipe.ron")).status();
    if !made.is_ok_and(|status| status.success()) {
        return;
    }
    for file in ["pipe.ron", "/dev/zero", "/dev/null"] {
        let ran = desk.run(["check", file, "--format", "json"]).expect(1);
        assert_eq!(ran.json()["errors"][0]["code"], "bad-file", "{file}");
    }
}

#[test]
#[cfg(target_os = "linux")]
fn control_characters_never_reach_the_terminal() {
    let desk = Desk::new();
    let name = "a\u{1b}]0;owned\u{7}\n.ron";
    desk.write(name, "( nodes: { \"\u{1b}[2J\u{9b}\u{202e}\": Perlin(), \"x\": \u{1b}c(), }, )");
    for args in
        [vec!["check", name], vec!["render", name], vec!["check", "no\u{1b}\n.ron"], vec!["dump", name, "\u{1b}c"]]
    {
        let ran = desk.run(&args);
        assert_ne!(ran.code, Some(0));
        let odd = |c: char| (c.is_control() && c != '\n') || c == '\u{202e}';
        assert!(!ran.stderr.contains(odd) && !ran.stderr.contains("\n.ron"), "{args:?}: {:?}", ran.stderr);
    }
    let ran = desk.run(["check", name, "--format", "json"]).expect(1);
    assert!(!ran.stdout.trim_end().contains(|c: char| c.is_control()), "{:?}", ran.stdout);
    assert_eq!(ran.json()["errors"][0]["file"], name);
    // A usage error repeats the argument.
    let ran = desk.run(["check", "--\u{1b}]0;owned\u{7}"]).expect(2);
    assert!(!ran.stderr.contains(['\u{1b}', '\u{7}']), "{:?}", ran.stderr);
}

/// Nodes that need the whole picture in memory are reported beforehand if it does not fit; all other nodes work in any
/// memory.
#[test]
fn warns_of_whole_pictures_that_exceed_memory() {
    let desk = Desk::new();
    desk.write(
        "w.ron",
        r#"( version: 1, canvas: (size_mm: 40, resolution: 512, tile: Both), nodes: {
            "noise": Perlin(size: 9), "pieces": FloodFill(mask: "noise"), "few": FloodFill(mask: "noise", resolution: 2048),
            "normal": HeightToNormal(input: "noise"), "height": NormalToHeight(input: "normal"),
            "mean": RegionAverage(input: "noise", ids: "pieces"), "unused": FloodFill(mask: "noise"),
            "last": RegionAverage(input: "noise", ids: "few"),
            "all": Blend(base: "mean", top: Blend(base: "height", top: "last")),
        }, outputs: { "o": "all" } )"#,
    );
    let told = |args: &str| {
        let ran = desk.shibo(&format!("check w.ron --format json {args}")).expect(0);
        let of = |w: &serde_json::Value| w["message"].as_str().unwrap().split('`').nth(1).unwrap().to_owned();
        let warnings = ran.json()["warnings"].as_array().unwrap().clone();
        warnings.iter().filter(|w| w["message"].as_str().unwrap().contains("whole picture")).map(of).collect::<Vec<_>>()
    };
    assert_eq!(told(""), Vec::<String>::new());
    // 10 bytes a pixel, 20 or more, 16 and 16.
    assert_eq!(told("--resolution 16384"), ["pieces", "height", "mean", "last"]);
    assert_eq!(told("--resolution 16384 --memory 4000"), ["height", "mean", "last"]);
    // `render` prints the same.
    let ran = desk.shibo("render w.ron --memory 16 --resolution 4096 --no-cache").expect(1);
    let text = ran.stderr.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(text.contains("an operation on the whole picture needs") && text.contains("too-large"), "{text}");
}

#[test]
fn repairs_sure_faults() {
    let desk = Desk::new();
    let faulty = BAD.replace("\"a\": Perlim(size: 5),", "// Kept.\n    \"a\": Perlin(size: 5mm)");
    desk.write("bad.ron", &faulty);
    let ran = desk.shibo("check --fix --dry-run bad.ron").expect(1);
    assert!(ran.stdout.contains("\n+    \"a\": Perlin(size: 5),\n"), "{}", ran.stdout);
    assert_eq!(std::fs::read_to_string(desk.path("bad.ron")).unwrap(), faulty);
    let ran = desk.shibo("check --fix bad.ron").expect(1);
    assert!(ran.stderr.starts_with("repaired bad.ron\n") && ran.stderr.contains("1 error"), "{}", ran.stderr);
    let text = std::fs::read_to_string(desk.path("bad.ron")).unwrap();
    assert_eq!(text, faulty.replace("Perlin(size: 5mm)", "Perlin(size: 5),").replace("sise", "size"));
}

#[test]
fn good_files_are_not_written() {
    let desk = Desk::with_graph();
    let before = std::fs::metadata(desk.path("a.ron")).unwrap().modified().unwrap();
    let ran = desk.shibo("check --fix=likely a.ron").expect(0);
    assert_eq!((ran.stdout.as_str(), ran.stderr.as_str()), ("", ""));
    assert_eq!(std::fs::metadata(desk.path("a.ron")).unwrap().modified().unwrap(), before);
}

#[test]
fn offers_versions_of_conflicts() {
    let desk = Desk::new();
    let seed = "<<<<<<< ours\n    seed: 1,\n||||||| base\n    seed: 2,\n=======\n    seed: 3,\n>>>>>>> theirs\n";
    let text = format!("(\n  nodes: {{ \"a\": Perlin(size: 5,\n{seed}  ) }},\n  outputs: {{ \"a\": \"a\" }},\n)\n");
    desk.write("bad.ron", &text);
    let ran = desk.shibo("check --fix=likely bad.ron --format json").expect(1);
    let fixes = ran.json()["errors"][0]["fixes"].as_array().unwrap().clone();
    let titles: Vec<_> =
        fixes.iter().map(|fix| (fix["title"].as_str().unwrap(), fix["applies"].as_str().unwrap())).collect();
    assert_eq!(titles, [("Keep ours", "choice"), ("Keep theirs", "choice"), ("Keep base", "choice")]);
    let theirs = &fixes[1]["edits"];
    assert_eq!((&theirs[0]["line"], &theirs[0]["end_line"]), (&json!(3), &json!(8)));
    assert_eq!((&theirs[1]["line"], &theirs[1]["end_line"]), (&json!(9), &json!(10)));
    assert_eq!(std::fs::read_to_string(desk.path("bad.ron")).unwrap(), text);
}

#[test]
fn says_that_not_all_fixes_were_tried() {
    let desk = Desk::new();
    let nodes = |count: usize| (0..count).map(|index| format!("\"n{index}\": Perlim(),\n")).collect::<String>();
    let graph = |count: usize| format!("(nodes: {{\n{}}}, outputs: {{ \"a\": \"n0\" }})\n", nodes(count));
    desk.write("few.ron", graph(3));
    assert!(desk.shibo("check few.ron --format json").expect(1).json().get("notes").is_none());
    desk.write("many.ron", graph(150));
    let json = desk.shibo("check many.ron --format json").expect(1).json();
    let note = json["notes"][0].as_str().unwrap();
    assert!(note.starts_with("many.ron: not all fixes were tried"), "{note}");
    assert_eq!(json["errors"].as_array().unwrap().len(), 150);
    let ran = desk.shibo("check many.ron --fix").expect(1);
    assert!(ran.stderr.contains("warning: many.ron: not all fixes were tried"), "{}", ran.stderr);
    assert!(String::from_utf8(desk.read("many.ron")).unwrap().contains("\"n0\": Perlin()"));
    let ran = desk.shibo("check few.ron --fix").expect(0);
    assert!(!ran.stderr.contains("fixes were tried"), "{}", ran.stderr);
}
