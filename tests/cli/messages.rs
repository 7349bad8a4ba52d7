//! Messages of `check` and other commands about small mistakes: place, text and help.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::support::{Desk, GRAPH};
use serde_json::Value as Json;

/// A graph of these nodes whose output is `n`.
fn graph(nodes: &str) -> String {
    format!(
        "(version: 1, canvas: (size_mm: 32, resolution: 32, seed: 1), nodes: {{\n{nodes}\n}}, outputs: {{ \"o\": \"n\" }})"
    )
}

/// Reports of `check` about the second line of a graph of these nodes: column, code, message and help.
fn told(nodes: &str) -> Vec<(u64, String, String, String)> {
    let desk = Desk::new();
    desk.write("a.ron", graph(nodes));
    let json = desk.run(["check", "a.ron", "--format", "json"]).json();
    let all = ["errors", "warnings"].iter().flat_map(|list| json[list].as_array().unwrap());
    let text = |one: &Json, key: &str| one[key].as_str().unwrap_or_default().to_owned();
    all.map(|one| {
        assert_eq!(one["line"], 2, "{json}");
        (one["column"].as_u64().unwrap(), text(one, "code"), text(one, "message"), text(one, "help"))
    })
    .collect()
}

/// Fails unless `check` reports exactly these.
#[track_caller]
fn tells(nodes: &str, expected: &[(u64, &str, &str, &str)]) {
    let found = told(nodes);
    assert_eq!(found.len(), expected.len(), "{nodes}: {found:#?}");
    for ((column, code, message, help), expected) in found.iter().zip(expected) {
        assert_eq!((*column, code.as_str()), (expected.0, expected.1), "{nodes}: {found:#?}");
        assert!(message.contains(expected.2) && help.contains(expected.3), "{nodes}: {found:#?}");
    }
}

#[test]
fn refuses_numbers_out_of_channel_range() {
    tells(
        r#""n": Material(roughness: 55, metallic: -3, height: 70, ior: 1.45, emission: (9, 2, 0))"#,
        &[
            (26, "out-of-range", "roughness is `55`; it must be between 0 and 1", ""),
            (40, "out-of-range", "metallic is `-3`; it must be between 0 and 1", ""),
        ],
    );
    tells(
        r#""m": Material(height: 0), "n": Material(from: "m", base_color: (0.5, 1.5, 0), anisotropy_angle: 400)"#,
        &[(70, "out-of-range", "base_color is `1.5`", ""), (97, "out-of-range", "between -360 and 360 °", "")],
    );
    tells(
        r##""n": Blend(base: 3, top: "#fff", opacity: 2, mask: 1)"##,
        &[(43, "out-of-range", "opacity is `2`; it must be between 0 and 1", "")],
    );
}

#[test]
fn tells_the_ranges_of_ports_in_the_manual() {
    let desk = Desk::new();
    let json = desk.shibo("nodes Material --format json").expect(0).json();
    let ports = json["nodes"][0]["ports"].as_array().unwrap();
    let port = |name: &str| ports.iter().find(|port| port["name"] == name).unwrap();
    assert_eq!(port("roughness")["range"], serde_json::json!([0.0, 1.0]));
    assert_eq!((&port("height")["range"], &port("height")["unit"]), (&Json::Null, &"mm".into()));
    assert!(desk.shibo("nodes Material").expect(0).stdout.contains("Number, optional, 0 to 1"));
    assert!(desk.shibo("nodes Material --format markdown").expect(0).stdout.contains("| Number, optional, 0 to 1 |"));
}

#[test]
fn names_the_material_without_a_channel() {
    let desk = Desk::new();
    desk.write("a.ron", graph(r#""m": Material(height: Perlin(size: 4), roughness: 0.4), "n": "= m.coat + 0.1""#));
    let shown = desk.run(["check", "a.ron"]).expect(0).stderr;
    assert!(shown.contains("`m` has no channel `coat`; its default, 0, is used"), "{shown}");
    assert!(shown.contains("it has `roughness`, `height`"), "{shown}");
}

#[test]
fn old_fields_are_migrated() {
    let desk = Desk::new();
    let old = r#""pith": TrunkNodes(height: (0, 400), count: 5), "s": FitSkeleton(curve: "pith"),
"t": TrunkTime(skeleton: "s"), "n": CutPlane(solid: "t", preset: FlatSawn)"#;
    desk.write("a.ron", graph(old));
    let json = desk.run(["check", "a.ron", "--format", "json"]).expect(1).json();
    let error = &json["errors"][0];
    assert_eq!(error["message"], "`TrunkTime` has no field `skeleton`", "{json}");
    assert_eq!(error["help"], "to replace it, run: shibo migrate FILE", "{json}");
    assert_eq!(json["errors"].as_array().unwrap().len(), 1, "{json}");
    desk.run(["migrate", "a.ron"]).expect(0);
    desk.run(["check", "a.ron"]).expect(0);
}

#[test]
fn names_the_kinds_that_take_a_material() {
    let material = r#""m": Material(base_color: 0.5), "n": "#;
    let takes = |node: &str, help: &str| {
        let found = told(&format!("{material}{node}"));
        assert!(found.len() == 1 && found[0].1 == "type-mismatch" && found[0].3.contains(help), "{found:#?}");
    };
    takes(r#"Blend(base: "m", top: 0.5)"#, "`BlendMaterials` does that with Material");
    takes(r#"Mirror(input: "m")"#, r#"write `"m.height"` for one of its channels"#);
    takes(r#"Transform(input: "m")"#, "`TransformMaterial` does that with Material");
}

#[test]
fn explains_wrong_values_in_lists() {
    tells(
        r##""n": GradientMap(input: 0.5, stops: ["#000", "#fff"])"##,
        &[(38, "type-mismatch", "each value of stops must be `(number, colour)`; found a text", "")],
    );
    tells(
        r##""n": GradientMap(input: 0.5, stops: [(0, "red"), (1, "#fff")])"##,
        &[(42, "type-mismatch", "stops must be a colour", r##"write `"#ff0000"`"##)],
    );
    tells(
        r#""m": Material(base_color: 0.4), "n": LayerMaterials(layers: [(base: "m")])"#,
        &[
            (62, "missing-input", "needs `material`", ""),
            (63, "unknown-field", "the `layers` of `LayerMaterials` have no field `base`", ""),
        ],
    );
}

#[test]
fn prints_short_numbers_with_units() {
    let path = r#""p": Path(points: [(0, 0), (9, 9)]), "n": "#;
    tells(
        &format!(r#"{path}Stitch(path: "p", pitch: 0.7, length: 3)"#),
        &[(81, "out-of-range", "length is `3` mm; it must be at most 1.05 mm, one and a half of the pitch", "")],
    );
    tells(&format!(r#"{path}Stitch(path: "p", pitch: 0.7, length: 1.05)"#), &[]);
}

#[test]
fn reads_typed_numbers_and_some() {
    tells(r#""n": Perlin(size: 3f32, seed: Some(2u64))"#, &[]);
    let desk = Desk::new();
    let text = "\u{FEFF}(version: 1, canvas: Some((size_mm: Some(10), tile: Some(Both))), nodes: { \"n\": Perlin(size: 4f64) }, \
                outputs: { \"o\": \"n\" })";
    desk.write("some.ron", text);
    desk.write(
        "plain.ron",
        graph(r#""n": Perlin(size: 4)"#).replace("size_mm: 32, resolution: 32, seed: 1", "size_mm: 10"),
    );
    assert_eq!(desk.shibo("check some.ron").expect(0).stderr, "");
    desk.shibo("render some.ron -o one --resolution 16").expect(0);
    desk.shibo("render plain.ron -o two --resolution 16").expect(0);
    assert_eq!(desk.read("one/o.png"), desk.read("two/o.png"));
    // The byte order mark counts as no column, and `fmt` removes it.
    desk.write("wrong.ron", "\u{FEFF}(nods: {})");
    let json = desk.run(["check", "wrong.ron", "--format", "json"]).expect(1).json();
    let wrong = json["errors"].as_array().unwrap().iter().find(|error| error["code"] == "unknown-field").unwrap();
    assert_eq!((&wrong["line"], &wrong["column"]), (&1.into(), &2.into()), "{json}");
    desk.shibo("fmt some.ron").expect(0);
    assert!(desk.read("some.ron").starts_with(b"("));
}

#[test]
fn tells_colours_in_the_notation_of_graphs() {
    tells(
        r#""n": Material(base_color: "red")"#,
        &[(27, "unknown-node", "there is no node `red`, and colours have no names", r##"write `"#ff0000"`"##)],
    );
    tells(
        r#""m": Material(roughness: 0.5), "n": AdjustMaterial(material: "m", tint: "0xff0000")"#,
        &[(73, "type-mismatch", "tint must be a colour", r##"write `"#ff0000"`"##)],
    );
}

#[test]
fn understands_the_former_name_of_gaps() {
    tells(
        r#""b": Brick(size: (7.5, 3.5), gap: 0.5), "n": Invert(input: "b.mask")"#,
        &[(60, "advice", "the output `mask` of `Brick` is called `gap` now", r#"write `"b.gap"`"#)],
    );
    for (kind, size) in [("Brick", "size: (7.5, 3.5)"), ("Hex", "size: 4.5"), ("Weave", "pitch: 1")] {
        let desk = Desk::new();
        let text = |port: &str| graph(&format!(r#""b": {kind}({size}), "n": Invert(input: "b.{port}")"#));
        desk.write("old.ron", text("mask"));
        desk.write("new.ron", text("gap"));
        desk.shibo("render old.ron -o old").expect(0);
        desk.shibo("render new.ron -o new").expect(0);
        assert_eq!(desk.read("old/o.png"), desk.read("new/o.png"), "{kind}");
        let values =
            |name: &str| desk.run(["dump", "new.ron", name, "--resolution", "4"]).expect(0).json()["values"].clone();
        assert_eq!(values("b.gap"), values("b.mask"), "{kind}");
    }
    tells(r#""b": Truchet(size: 8), "n": Invert(input: "b.mask")"#, &[]);
}

#[test]
fn warns_of_unused_nodes() {
    tells(
        r#""a": Perlin(), "b": Invert(input: "a"), "_c": Perlin(), "n": Perlin()"#,
        &[
            (1, "advice", "no output needs `a`", "leave it out, or call it `_a` if it shall stay"),
            (16, "advice", "no output needs `b`", ""),
        ],
    );
    // A node that a parameter can choose is needed.
    tells(r#""a": Perlin(), "b": Worley(), "n": Switch(inputs: ["a", "b"], which: 1)"#, &[]);
}

#[test]
fn reports_nodes_of_other_outputs_as_unused() {
    let desk = Desk::new();
    desk.write(
        "a.ron",
        GRAPH
            .replace("\"bumps\": \"bumps\",", "\"bumps\": \"bumps\", \"soft\": \"soft\",")
            .replace("\"points\":", "\"soft\": Blur(input: \"bumps\", radius: 1), \"points\":"),
    );
    let json = desk.shibo("render a.ron --output soft --stats json").expect(0).json();
    let state = |name: &str| {
        let nodes = json["nodes"].as_array().unwrap();
        nodes.iter().find(|node| node["name"] == name).unwrap()["state"].as_str().unwrap().to_owned()
    };
    assert_eq!((state("strokes"), state("points")), ("unused".to_owned(), "unused".to_owned()), "{json}");
    assert_ne!(state("bumps"), "unused");
    // The same holds when nothing is computed.
    let json = desk.shibo("render a.ron --output soft --stats json").expect(0).json();
    let states: Vec<_> = json["nodes"].as_array().unwrap().iter().map(|node| (&node["name"], &node["state"])).collect();
    assert!(states.contains(&(&"bumps".into(), &"folded".into())), "{states:?}");
    assert!(states.contains(&(&"strokes".into(), &"unused".into())), "{states:?}");
}

#[test]
fn advice_on_clipping_depends_on_kind_of_value() {
    let advice = |nodes: &str| {
        let desk = Desk::new();
        desk.write("a.ron", graph(nodes));
        let ran = desk.shibo("render a.ron --no-cache").expect(0);
        let words = ran.stderr.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(words.contains("clipped"), "{words}");
        words
    };
    let text = advice(r#""a": Remap(input: Perlin(), to: (0, 55)), "n": Material(roughness: "a")"#);
    assert!(text.contains("`roughness` ranges from 0 to 1") && !text.contains("range:"), "{text}");
    let text = advice(r#""n": Brick(size: (7.5, 3.5), gap: 0.5, depth: 3)"#);
    assert!(text.contains("range: (lowest, highest)") && !text.contains("clamp"), "{text}");
    let text = advice(r#""n": Remap(input: Perlin(), to: (0, 2))"#);
    assert!(text.contains("clamp: true") && text.contains("range: (lowest, highest)"), "{text}");
}

#[test]
fn writes_drawings_into_files() {
    let desk = Desk::with_graph();
    let printed = desk.shibo("graph a.ron --format svg").expect(0).stdout;
    let ran = desk.shibo("graph a.ron --format svg -o deep/a.svg").expect(0);
    assert!(ran.stdout.is_empty() && ran.stderr.contains("wrote deep/a.svg"), "{}", ran.stderr);
    assert_eq!(desk.read("deep/a.svg"), printed.as_bytes());
    desk.write("file", "");
    assert!(desk.shibo("graph a.ron --format dot -o file/a.dot").expect(1).stderr.contains("file/a.dot"));
}

#[test]
fn counts_single_files_in_the_singular() {
    let desk = Desk::with_graph();
    let ran = desk.shibo("render a.ron --output bumps --resolution 8 --sweep size=3..4").expect(0);
    assert!(ran.stderr.contains("wrote 1 file;") && ran.stderr.contains("2 variants rendered"), "{}", ran.stderr);
    let ran = desk.shibo("pack a.ron -o a.zip").expect(0);
    assert!(ran.stderr.trim_end().ends_with("a.zip, 1 file"), "{}", ran.stderr);
}

#[test]
fn suggests_template_for_unknown_name() {
    let ran = Desk::new().shibo("new a --from lether").expect(2);
    assert!(ran.stderr.contains("did you mean `leather`?; `shibo new --list` shows all"), "{}", ran.stderr);
}

#[test]
fn lists_use_and_each_among_kinds() {
    let desk = Desk::new();
    let people = desk.shibo("nodes").expect(0).stdout;
    let page = desk.shibo("nodes --format markdown").expect(0).stdout;
    assert!(people.contains("    Use ") && people.contains("    Each "), "{people}");
    assert!(page.contains("[Use](#use), [Each](#each)") && page.contains("\n### Use\n"));
}

#[test]
fn files_from_the_cache_tell_clipped_samples_again() {
    let desk = Desk::new();
    desk.write("a.ron", graph(r#""n": Remap(input: Perlin(), to: (0, 2))"#));
    let told = |out: &str, more: &str| {
        let ran = desk.shibo(&format!("render a.ron -o {out} {more}")).expect(0);
        ran.stderr.replace(&format!("{out}/"), "")
    };
    let first = told("first", "");
    assert!(first.contains("clipped"), "{first}");
    assert_eq!(told("again", ""), first);
    // Another range has another answer.
    assert!(!told("floats", "--format exr").contains("clipped"));
}
