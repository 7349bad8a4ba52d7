//! Names of mesh parts in files for other programs, and channels that share a picture.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::export::text;
use crate::support::Desk;
use std::collections::BTreeSet;

/// Adjacent triangles, each a part of its own.
fn mesh(parts: &[&str]) -> String {
    let corners = "v 0 0 0\nv 10 0 0\nv 0 10 0\nv 20 0 0\nv 30 0 0\nv 20 10 0\nv 40 0 0\nv 50 0 0\nv 40 10 0\n";
    let uvs = "vt 0 0\nvt 0.3 0\nvt 0 0.3\nvt 0.4 0.4\nvt 0.6 0.4\nvt 0.4 0.6\nvt 0.7 0.7\nvt 1 0.7\nvt 0.7 1\n";
    let face = |(n, part): (usize, &&str)| {
        let [a, b, c] = [1, 2, 3].map(|k| 3 * n + k);
        format!("g {part}\nf {a}/{a} {b}/{b} {c}/{c}\n")
    };
    format!("{corners}{uvs}{}", parts.iter().enumerate().map(face).collect::<String>())
}

fn written(parts: &[&str]) -> Desk {
    let desk = Desk::new();
    desk.write("m.obj", mesh(parts));
    desk.write(
        "a.ron",
        r#"(canvas: (size_mm: 40, resolution: 16, tile: None),
            nodes: { "m": LoadMesh(path: "m.obj"), "a": MeshAtlas(mesh: "m"), "n": Perlin(size: 5), "mat": Material(base_color: "n") },
            outputs: { "s": Usd(material: "mat", mesh: "a"), "o": Obj(material: "mat", mesh: "a"),
                       "g": Gltf(material: "mat", mesh: "a", embed: false) })"#,
    );
    desk.shibo("render a.ron -o out -q").expect(0);
    desk
}

/// The names of the prims below the first one.
fn prims(usd: &str) -> Vec<String> {
    let named = |line: &str| Some(line.strip_prefix("    def ")?.split('"').nth(1)?.to_owned());
    usd.lines().filter_map(named).collect()
}

#[test]
fn gives_each_part_a_name_of_its_own() {
    for (parts, usd, obj) in [
        (["右脚", "左脚", "Materials"], ["__", "___2", "Materials_2"], ["右脚", "左脚", "Materials"]),
        (["a.b", "a_b", "a-b"], ["a_b", "a_b_2", "a_b_3"], ["a.b", "a_b", "a-b"]),
        (["1", "_1", "_1_2"], ["_1", "_1_2", "_1_2_2"], ["1", "_1", "_1_2"]),
    ] {
        let desk = written(&parts);
        let stage = text(&desk, "out/s.usda");
        let found = prims(&stage);
        assert_eq!(found[..3], usd, "{stage}");
        assert_eq!(found[3], "Materials");
        let valid = |name: &String| {
            let mut characters = name.chars();
            characters.next().is_some_and(|c| c.is_ascii_alphabetic() || c == '_')
                && characters.all(|c| c.is_ascii_alphanumeric() || c == '_')
        };
        assert!(found.iter().all(valid) && found.iter().collect::<BTreeSet<_>>().len() == found.len(), "{found:?}");
        // The original name is kept as the display name.
        for (part, name) in parts.iter().zip(usd) {
            let said = stage.contains(&format!("def Mesh \"{name}\" (\n        displayName = \"{part}\"\n"));
            assert_eq!(said, *part != name, "{part}");
        }
        let lines = text(&desk, "out/o.obj");
        assert_eq!(lines.lines().filter_map(|line| line.strip_prefix("o ")).collect::<Vec<_>>(), obj);
        let document: serde_json::Value = serde_json::from_str(&text(&desk, "out/g.gltf")).unwrap();
        let nodes: Vec<&str> = (0..3).filter_map(|n| document["nodes"][n]["name"].as_str()).collect();
        assert_eq!(nodes, parts, "names of glTF may be any");
    }
}

/// Godot and Unity read opacity from the alpha of the colour picture.
#[test]
fn stores_opacity_with_the_colour_where_programs_read_it() {
    let graph = |channels: &str| {
        let desk = Desk::new();
        desk.write(
            "a.ron",
            format!(
                "(canvas: (size_mm: 8, resolution: 8), nodes: {{ \"n\": Perlin(size: 4), \"m\": Material({channels}) }},
                  outputs: {{ \"m\": \"m\" }})"
            ),
        );
        let said = desk.shibo("render a.ron --as godot -o out").expect(0).stderr;
        assert!(!said.contains("opacity"), "{said}");
        desk
    };
    let desk = graph("base_color: \"#ff0000\", opacity: \"n\"");
    let stored = image::open(desk.path("out/m_albedo.png")).unwrap();
    assert!(stored.color().has_alpha());
    desk.write("b.ron", text(&desk, "a.ron").replace("\"m\": \"m\"", "\"m\": File(from: \"m\", format: Png)"));
    desk.shibo("render b.ron --output m.opacity -o out").expect(0);
    let opacity = image::open(desk.path("out/m_opacity.png")).unwrap().to_luma8();
    for (albedo, opacity) in stored.to_rgba8().pixels().zip(opacity.pixels()) {
        assert_eq!(albedo.0, [255, 0, 0, opacity.0[0]]);
    }
    // Opacity alone stays beside a material without colour; colour alone has no opacity.
    assert!(image::open(graph("opacity: \"n\"").path("out/m_albedo.png")).unwrap().color().has_alpha());
    assert!(!image::open(graph("base_color: \"n\"").path("out/m_albedo.png")).unwrap().color().has_alpha());
}
