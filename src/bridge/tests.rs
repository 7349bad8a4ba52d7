//! A session without a process. `tests/cli/bridge.rs` has sessions of all messages.
use super::*;
use shibo_engine::session::{Session, Settings};

#[test]
fn keeps_the_files_of_the_last_render() {
    let session = Session::new(library::registry(), &Settings { threads: 1, ..Settings::default() }).unwrap();
    let files = Files::new().unwrap();
    let folder = files.folder().to_owned();
    let text = r#"(version: 1, canvas: (size_mm: (8, 8), resolution: (8, 8)), nodes: { "a": Perlin() }, outputs: { "a": "a" })"#;
    let open = json!({ "id": 1, "op": "open", "text": text });
    let render = |id: u32| json!({ "id": id, "op": "render", "graph": "g1", "sizes": [16] });
    let input = format!("{open}\n{}\n{}\n", render(2), render(3));
    let mut output = Vec::new();
    serve(Host::new(session, library::tools()), files, &mut input.as_bytes(), &mut output).unwrap();
    let lines = output.split(|byte| *byte == b'\n').filter(|line| !line.is_empty());
    let lines: Vec<Json> = lines.map(|line| serde_json::from_slice(line).unwrap()).collect();
    let ids: Vec<u64> =
        lines.iter().filter(|line| line["event"] != "ending").filter_map(|line| line["id"].as_u64()).collect();
    assert_eq!(ids, [1, 2, 2, 3, 3], "{lines:?}");
    assert_ne!(lines[1]["file"], lines[3]["file"]);
    assert!(lines[1]["file"].as_str().unwrap().starts_with(folder.to_str().unwrap()));
    assert!(!folder.exists(), "the folder is removed at the end");
}
