//! `shibo nodes`, end to end.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::{Desk, finish};
use serde_json::{Value as Json, json};

#[test]
fn families_and_kinds_are_listed() {
    let ran = Desk::new().shibo("nodes").expect(0);
    assert_eq!(ran.stderr, "");
    for word in ["Generators", "Perlin", "Leather", "SimulateSprings"] {
        assert!(ran.stdout.contains(word), "{word}");
    }
}

#[test]
fn prints_manual_of_a_kind() {
    let ran = Desk::new().shibo("nodes DrawWrinkles").expect(0);
    for word in [
        "segments  Segments, required",
        "profile: Gaussian",
        "- Flat: ",
        "height  Gray, mm, the main output",
        "width: (0.15, 0.35)",
    ] {
        assert!(ran.stdout.contains(word), "{word}: {}", ran.stdout);
    }
    let ran = Desk::new().shibo("nodes DrowWrinkles").expect(2);
    assert!(ran.stderr.contains("did you mean `DrawWrinkles`?") && ran.stdout.is_empty(), "{}", ran.stderr);
    let desk = Desk::new();
    let mut colored = desk.command(["nodes", "Perlin"]);
    colored.env("CLICOLOR_FORCE", "1");
    assert!(!finish(colored).stdout.contains('\u{1b}'), "colours without a terminal");
}

#[test]
fn lists_changes_of_kinds_and_graphs() {
    let desk = Desk::new();
    let ran = desk.shibo("changes").expect(0);
    assert!(ran.stdout.starts_with("   1  everything: nodes and graphs as they are"), "{}", ran.stdout);
    let json = desk.shibo("changes Perlin calf --format json").expect(0).json();
    assert_eq!(json["changes"][0]["change"], 1);
    assert!(desk.shibo("changes Perlim").expect(2).stderr.contains("did you mean `Perlin`?"));
    assert!(desk.shibo("changes --since 4000").expect(2).stderr.contains("change 4000 is unknown: the newest is"));
    let all = desk.shibo("changes --format json").expect(0).json();
    let newest = all["changes"].as_array().unwrap().last().unwrap()["change"].clone();
    assert_eq!(desk.shibo(&format!("changes --since {newest}")).expect(0).stdout, "");
}

#[test]
fn prints_manual_as_json() {
    let json = Desk::new().shibo("nodes --format json").expect(0).json();
    let nodes = json["nodes"].as_array().unwrap();
    let draw = nodes.iter().find(|n| n["kind"] == "DrawWrinkles").unwrap();
    assert_eq!(draw["family"], "Leather");
    let find =
        |list: &str, name: &str| draw[list].as_array().unwrap().iter().find(|f| f["name"] == name).unwrap().clone();
    let port = find("ports", "segments");
    assert_eq!((port["type"].as_str(), port["required"].as_bool()), (Some("Segments"), Some(true)));
    assert_eq!(find("ports", "depth_field")["required"], false);
    let width = find("parameters", "width");
    assert_eq!((width["type"].as_str(), width["unit"].as_str()), (Some("Range"), Some("mm")));
    assert_eq!(width["default"], serde_json::json!([0.15, 0.35]));
    assert_eq!(width["range"][0], 0.0);
    let profile = find("parameters", "profile");
    assert!(profile["choices"].as_array().unwrap().contains(&"Gaussian".into()) && profile["default"] == "Gaussian");
    assert_eq!(find("outputs", "mask")["type"], "Gray");
    for node in nodes {
        for list in ["ports", "parameters", "outputs"] {
            for field in node[list].as_array().unwrap() {
                assert!(field["doc"].as_str().is_some_and(|doc| !doc.is_empty()), "{} {}", node["kind"], field["name"]);
            }
        }
    }
    assert_eq!(find("outputs", "height")["unit"], "mm");
    assert_eq!(profile["choices"].as_array().unwrap().len(), profile["choice_docs"].as_array().unwrap().len());
    let k = nodes.iter().find(|n| n["kind"] == "BlendTimes").unwrap()["parameters"].as_array().unwrap();
    let k = k.iter().find(|p| p["name"] == "k").unwrap();
    assert_eq!((&k["default"], &k["written"], &k["infinite"]), (&Json::Null, &json!("None"), &json!(true)));
    let one = Desk::new().shibo("nodes Perlin --format json").expect(0).json();
    assert_eq!(one["nodes"].as_array().unwrap().len(), 1);
}

#[test]
fn prints_reference_as_markdown() {
    let page = Desk::new().shibo("nodes --format markdown").expect(0).stdout;
    assert!(page.starts_with("# Nodes\n"));
    for word in
        ["## Leather\n", "### Perlin\n", "![Perlin](nodes/Perlin.png)", "[Perlin](#perlin)", "```ron\n", "| `size` |"]
    {
        assert!(page.contains(word), "{word}");
    }
    // Every default is printed as written in a graph, and every choice is explained.
    let mut choices = 0;
    let registry = shibo_nodes::registry();
    for info in registry.kinds().filter_map(|kind| registry.info(kind)) {
        let manual = Desk::new().shibo(&format!("nodes {}", info.kind)).expect(0).stdout;
        let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
        let manual = words(&manual);
        for (field, param) in info.params().filter(|(_, param)| !param.required) {
            let row = format!("| `{}` | {} | `{}` | ", field.name, param.ty, param.written);
            assert!(page.contains(&row), "{} {row}", info.kind);
            assert!(manual.contains(&format!("{}: {}", field.name, param.written)), "{} {}", info.kind, field.name);
            for choice in &param.choices {
                choices += 1;
                let in_table = format!("<br>`{choice}`: {}", words(&choice.doc).replace('|', "\\|"));
                assert!(page.contains(&in_table), "{in_table}");
                assert!(manual.contains(&format!("- {choice}: {}", words(&choice.doc))), "{choice}");
            }
        }
    }
    assert!(choices > 200, "{choices}");
    let rows = page.lines().filter(|line| line.starts_with('|'));
    assert!(rows.into_iter().all(|row| row.ends_with('|')));
}
