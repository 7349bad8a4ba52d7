//! `shibo schema`, and `shibo fmt --to`: graphs as JSON, for programs.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::support::{Desk, GRAPH};
use serde_json::Value as Json;
use std::path::Path;
use std::process::Command;

/// The largest schema in bytes.
const MOST: usize = 1_500_000;

#[test]
fn schema_describes_all_kinds() {
    let desk = Desk::new();
    let ran = desk.shibo("schema").expect(0);
    assert!(ran.stdout.len() <= MOST, "{}", ran.stdout.len());
    let schema = ran.json();
    let perlin = &schema["$defs"]["Perlin"];
    assert!(perlin["description"].as_str().unwrap().len() > 20);
    let size = &perlin["properties"]["size"];
    assert_eq!(size["unit"], "mm");
    let nodes = desk.shibo("nodes --format json").expect(0).json();
    for node in nodes["nodes"].as_array().unwrap() {
        let kind = node["kind"].as_str().unwrap();
        let fields = ["ports", "parameters"].map(|list| node[list].as_array().unwrap()).into_iter().flatten();
        for field in fields {
            let (name, doc) = (field["name"].as_str().unwrap(), &field["doc"]);
            let described = &schema["$defs"][kind]["properties"][name]["description"];
            assert_eq!(described.as_str().unwrap_or_default(), doc.as_str().unwrap().trim(), "{kind}.{name}");
        }
    }
}

#[test]
fn schema_of_one_kind_stands_alone() {
    let desk = Desk::new();
    let schema = desk.shibo("schema --kind Blur").expect(0).json();
    assert_eq!(schema["required"], serde_json::json!(["input"]));
    assert!(schema["$defs"]["Perlin"].is_null());
    assert_eq!(desk.shibo("schema --kind Each").expect(0).json()["title"], "Each");
    let wrong = desk.shibo("schema --kind Blurr").expect(2);
    assert!(wrong.stderr.contains("did you mean `Blur`"), "{}", wrong.stderr);
}

/// Writes what `tests/readers/schema.py` reads, and returns its folder.
fn for_readers(desk: &Desk) -> std::path::PathBuf {
    let folder = desk.path("schema");
    std::fs::create_dir(&folder).unwrap();
    std::fs::write(folder.join("schema.json"), desk.shibo("schema").expect(0).stdout).unwrap();
    std::fs::write(folder.join("nodes.json"), desk.shibo("nodes --format json").expect(0).stdout).unwrap();
    let graphs = Path::new(env!("CARGO_MANIFEST_DIR")).join("graphs");
    for path in [graphs.clone(), graphs.join("lib")].into_iter().flat_map(|folder| std::fs::read_dir(folder).unwrap()) {
        let path = path.unwrap().path();
        if path.extension().is_some_and(|ending| ending == "ron") {
            let json = desk.run(["fmt".as_ref(), "--to".as_ref(), "json".as_ref(), path.as_os_str()]).expect(0);
            let name = format!("{}.graph.json", path.file_stem().unwrap().to_string_lossy());
            std::fs::write(folder.join(name), json.stdout).unwrap();
        }
    }
    folder
}

#[test]
fn schema_accepts_shipped_graphs_and_refuses_faults() {
    let has_library = Command::new("python3").args(["-c", "import jsonschema"]).output();
    if !has_library.is_ok_and(|ran| ran.status.success()) {
        eprintln!("skipped: jsonschema, python3 cannot import it here; tests/readers/run installs it");
        return;
    }
    let desk = Desk::new();
    let folder = for_readers(&desk);
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/readers/schema.py");
    let ran = Command::new("python3").arg(script).arg(&folder).output().unwrap();
    let said = String::from_utf8_lossy(&ran.stdout).into_owned() + &String::from_utf8_lossy(&ran.stderr);
    assert!(ran.status.success() && said.contains(", 0 wrong answers"), "{said}");
    // The command agrees that some of these graphs are faulty, and names the same code.
    let mut faults: Vec<_> =
        std::fs::read_dir(folder.join("faults")).unwrap().map(|file| file.unwrap().path()).collect();
    faults.sort();
    for path in faults.iter().step_by(faults.len() / 24) {
        let ron = desk.run(["fmt".as_ref(), "--to".as_ref(), "ron".as_ref(), path.as_os_str()]).expect(0);
        desk.write("fault.ron", ron.stdout);
        let checked = desk.shibo("check fault.ron --format json").expect(1).json();
        let name = path.file_stem().unwrap().to_string_lossy();
        let code = name.rsplit('.').next().unwrap();
        let codes: Vec<&Json> = checked["errors"].as_array().unwrap().iter().map(|error| &error["code"]).collect();
        assert!(codes.iter().any(|found| *found == code), "{name}: {codes:?}");
    }
}

#[test]
fn graphs_become_json_and_ron_again() {
    let desk = Desk::with_graph();
    let json = desk.shibo("fmt --to json a.ron").expect(0).stdout;
    let parsed: Json = serde_json::from_str(&json).unwrap();
    assert_eq!(parsed["nodes"]["bumps"]["Perlin"]["size"], "$size");
    assert_eq!(parsed["canvas"]["tile"], "Both");
    desk.write("a.json", &json);
    let ron = desk.shibo("fmt --to ron a.json").expect(0).stdout;
    desk.write("b.ron", &ron);
    assert!(!desk.shibo("diff a.ron b.ron --exit-code").expect(0).stdout.contains("nodes"));
    desk.shibo("fmt --check b.ron").expect(0);
    assert_eq!(desk.shibo("fmt --to ron --to json a.ron").expect(2).stdout, "");
    desk.shibo("fmt --to json a.ron b.ron").expect(2);
    assert_eq!(desk.read("a.ron"), GRAPH.as_bytes());
}

#[test]
fn json_has_errors_with_places_and_is_no_graph() {
    let desk = Desk::with_graph();
    desk.write("a.json", desk.shibo("fmt --to json a.ron").expect(0).stdout);
    for line in
        ["render a.json", "check a.json", "fmt a.json", "graph a.json --format svg", "dump a.json bumps", "pin a.json"]
    {
        let ran = desk.shibo(line);
        assert_ne!(ran.code, Some(0), "{line}");
        assert!(ran.stderr.contains("`shibo fmt --to ron a.json` converts it"), "{line}: {}", ran.stderr);
    }
    desk.write("b.json", "{\n  \"nodes\": { \"a\": { \"Perlin\": {} },\n    \"a\": 3 }\n}\n");
    let ran = desk.shibo("fmt --to ron b.json").expect(1);
    assert!(ran.stderr.contains("b.json:3:5") && ran.stderr.contains("`a` is given twice"), "{}", ran.stderr);
    desk.write("b.json", "{\n  \"nodes\": { \"a\" 3 }\n}\n");
    let ran = desk.shibo("fmt --to ron b.json").expect(1);
    assert!(ran.stderr.contains("b.json:2:18") && ran.stderr.contains("expected `:`"), "{}", ran.stderr);
}
