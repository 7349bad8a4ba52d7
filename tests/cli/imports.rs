//! Search paths of imports besides the folder of the graph.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::support::{Desk, finish, number};

const PART: &str = r#"(version: 1, params: { "size": Number(default: 1, range: (0, 9)) },
  nodes: { "number": "= $size" }, outputs: { "number": "number" })"#;

#[test]
fn uses_nearest_settings_file_above() {
    let desk = Desk::new();
    for folder in ["work/deep/er", "far", "near"] {
        std::fs::create_dir_all(desk.path(folder)).unwrap();
    }
    let part = |value: u32| PART.replace("default: 1,", &format!("default: {value},"));
    let graph = |import: &str| {
        format!(
            "(version: 1, canvas: (size_mm: 16, resolution: 4), imports: {{ \"part\": {import:?} }}, nodes: {{ \"a\": Use(graph: \"part\") }}, outputs: {{ \"n\": \"a.number\" }})"
        )
    };
    desk.write("work/deep/er/main.ron", graph("part"));
    desk.write("far/part.ron", part(2));
    desk.write("near/part.ron", part(3));
    let value = |more: &[&str], variable: &str| {
        let mut command = desk.command([&["dump", "work/deep/er/main.ron", "a.number"], more].concat());
        command.env("SHIBO_IMPORT_PATH", variable);
        let ran = finish(command);
        if ran.code == Some(0) { Some(number(&ran.json()["values"][0])) } else { None }
    };
    assert_eq!(value(&[], ""), None);
    desk.write("work/shibo.toml", "[imports]\npaths = [\"../far\"]\n");
    assert_eq!(value(&[], ""), Some(2.0));
    desk.write("work/deep/shibo.toml", "[imports]\npaths = [\"../../near\"]\n");
    assert_eq!(value(&[], ""), Some(3.0), "the nearest");
    // Folders of a settings file farther up are not added.
    desk.write("work/deep/shibo.toml", "[imports]\npaths = []\n");
    assert_eq!(value(&[], ""), None);
    // Also when run within the folder, and with another path to the graph.
    std::fs::remove_file(desk.path("work/deep/shibo.toml")).unwrap();
    for (dir, graph) in
        [("work/deep/er", "main.ron"), ("work/deep", "./er/main.ron"), ("near", "../work/deep/er/main.ron")]
    {
        let mut command = desk.command(["check", graph]);
        command.current_dir(desk.path(dir));
        finish(command).expect(0);
    }
    // The flag and the variable come after the folder of the graph, and before the settings.
    let (far, near) = (desk.path("far"), desk.path("near"));
    let [far, near] = [far.to_str().unwrap(), near.to_str().unwrap()];
    assert_eq!(value(&["--import-path", near], ""), Some(3.0));
    assert_eq!(value(&[], &format!("{far}x:{near}")), Some(3.0));
    assert_eq!(value(&["--import-path", far], near), Some(2.0), "the flag comes first");
    desk.write("work/deep/er/part.ron", part(5));
    assert_eq!(value(&["--import-path", near], near), Some(5.0), "the folder of the graph comes first");
    let missing = desk.run(["check", "work/deep/er/main.ron", "--import-path"]).expect(2);
    assert!(missing.stderr.contains("DIR"), "{}", missing.stderr);
}
