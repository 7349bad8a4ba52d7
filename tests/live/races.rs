//! A page writes into the graph file while an editor saves it.
#![cfg(any(target_os = "linux", target_vendor = "apple"))]
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::watching::{self, Place, Watch};
use serde_json::json;
use std::fs;
use std::time::Duration;

/// A graph that takes some time to check.
fn graph(comment: &str) -> String {
    let nodes: String = (0..1500).map(|node| format!("    \"n{node}\": Perlin(size: 2),\n")).collect();
    format!(
        "( // {comment}\n  version: 1,\n  canvas: (size_mm: 8, resolution: 8),\n  params: {{ \"depth\": Number(default: 1.0, range: (0, 4)) }},\n  \
         nodes: {{\n{nodes}    \"height\": Remap(input: \"n0\", to: (0, \"$depth\")),\n  }},\n  outputs: {{ \"height\": \"height\" }},\n)\n"
    )
}

#[test]
fn page_keeps_concurrent_saves_of_editor() {
    let place = Place::new(&graph("first"));
    let watch = Watch::start(&place.graph, &[]);
    let (mut refused, mut first) = (0, 0);
    for round in 0..40_u32 {
        place.write(&graph("before"));
        let (base, saved) = (watching::sha256(place.text().as_bytes()), graph(&format!("round {round}")));
        let change = json!({ "values": { "set": [["depth", "2"]], "preset": null } });
        let wish = json!({ "base": base, "change": change, "then": null }).to_string();
        let status = std::thread::scope(|scope| {
            let (path, saved) = (&place.graph, &saved);
            scope.spawn(move || {
                // The delays cover the whole time that a change takes.
                std::thread::sleep(Duration::from_micros(u64::from(round) * 600));
                if round % 2 == 0 {
                    fs::write(path, saved).unwrap();
                } else {
                    fs::write(path.with_extension("new"), saved).unwrap();
                    fs::rename(path.with_extension("new"), path).unwrap();
                }
            });
            watch.post("change", &wish).0
        });
        // Either the save came first and the page is refused, or the save came later.
        assert!(matches!(status, 200 | 409), "{status}");
        assert!(place.text() == saved, "the save of round {round} is lost: {status}");
        if status == 409 { refused += 1 } else { first += 1 }
    }
    let names: Vec<_> = place.dir.path().read_dir().unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert!(names.iter().all(|name| !name.to_string_lossy().ends_with(".tmp")), "{names:?}");
    assert_eq!(refused + first, 40);
}
