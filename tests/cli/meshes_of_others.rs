//! Meshes of other programs, end to end.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use crate::support::Desk;

/// A sheet of 10 by 10 mm with UVs, and more lines.
fn sheet(more: &str) -> String {
    format!("v 0 0 0\nv 10 0 0\nv 10 10 0\nv 0 10 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n{more}")
}

const FACE: &str = "f 1/1 2/2 3/3 4/4\n";

/// A graph with `LoadMesh` in line 3 and `MeshAtlas` in line 4, with extra parameters for both.
fn graph(file: &str, mesh: &str, atlas: &str) -> String {
    format!(
        "(version: 1, canvas: (size_mm: 10, resolution: 8, tile: None),\n  nodes: {{\n    \"m\": LoadMesh(path: \"{file}\", up: Z{mesh}),\n    \
         \"at\": MeshAtlas(mesh: \"m\"{atlas}),\n    \"where\": BakePosition(atlas: \"at\"),\n  }},\n  outputs: {{ \"mask\": \"at.mask\" }},\n)\n"
    )
}

/// The words of a text, separated by single spaces.
fn words(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// The area of a mesh, and the warnings about it.
fn area(desk: &Desk, file: &str) -> (f64, String) {
    desk.write("g.ron", graph(file, "", ""));
    desk.shibo("check g.ron").expect(0);
    let ran = desk.shibo("dump g.ron m --no-cache").expect(0);
    (ran.json()["area"].as_f64().unwrap(), words(&ran.stderr))
}

#[test]
fn reads_obj_with_marks_joined_lines_and_latin1() {
    let desk = Desk::new();
    let files: [(&str, Vec<u8>); 7] = [
        ("mark.obj", format!("\u{feff}{}", sheet(&format!("v 5 5 20\n{FACE}"))).into()),
        ("joined.obj", sheet("f 1/1 2/2 \\\r\n 3/3 4/4\r\n").into()),
        ("comment.obj", sheet("f 1/1 2/2 3/3 4/4 # quad\n").into()),
        ("mac.obj", sheet(FACE).replace('\n', "\r").into()),
        ("latin1.obj", [b"# caf\xe9\no St\xfchl\n", sheet(FACE).as_bytes()].concat()),
        ("unused.obj", format!("v nan 0 0\n{}", sheet("f 2/1 3/2 4/3 5/4\n")).into()),
        ("line.obj", sheet(FACE).replace("vt 0 0", "vt 0").into()),
    ];
    for (name, bytes) in files {
        desk.write(name, bytes);
        assert_eq!(area(&desk, name), (100.0, String::new()), "{name}");
    }
    let wide: Vec<u8> = format!("\u{feff}{}", sheet(FACE)).encode_utf16().flat_map(u16::to_le_bytes).collect();
    desk.write("wide.obj", wide);
    desk.write("g.ron", graph("wide.obj", "", ""));
    let told = words(&desk.shibo("check g.ron").expect(1).stderr);
    assert!(told.contains("text in UTF-16: save it as UTF-8") && told.contains("g.ron:3:"), "{told}");
}

#[test]
fn warns_of_faces_without_uvs_or_normals() {
    let desk = Desk::new();
    desk.write("hole.obj", sheet("v 3 3 0\nv 3 7 0\nv 7 7 0\nv 7 3 0\nf 1 2 3 4 1 5 6 7 8 5\n"));
    assert_eq!(area(&desk, "hole.obj").0, 84.0);
    desk.write("bare.obj", sheet(&format!("{FACE}v 0 0 5\nv 10 0 5\nv 0 10 5\nf 5 6 7\nf 1/1 2/2\n")));
    let (sum, told) = area(&desk, "bare.obj");
    assert_eq!(sum, 150.0);
    assert!(told.contains("1 of 2 faces have no UVs and get no place in the picture"), "{told}");
    assert!(told.contains("1 faces have fewer than three corners and are left out"), "{told}");
    // The other face keeps its UVs, which cover the whole picture.
    let mask = desk.shibo("dump g.ron at.mask --no-cache").expect(0).json();
    assert!(mask["values"].as_array().unwrap().iter().all(|v| v == 1.0), "{mask}");
    desk.write("normals.obj", "v 0 0 0\nv 10 0 0\nv 10 10 0\nvt 0 0\nvt 1 0\nvt 1 1\nf 1/1/1 2/2/2 3/3/3\n");
    let (sum, told) = area(&desk, "normals.obj");
    assert_eq!(sum, 50.0);
    assert!(told.contains("faces refer to normals, as in line 7, and there are none"), "{told}");
}

/// Writes a sheet of 10 by 10 mm as `.gltf`, with replacements in its JSON, and `.bin`.
fn gltf(desk: &Desk, changes: &[(&str, &str)]) {
    let mut bytes: Vec<u8> = Vec::new();
    let floats = |numbers: &[f32]| numbers.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    bytes.extend(floats(&[0.0, 0.0, 0.0, 0.01, 0.0, 0.0, 0.01, 0.01, 0.0, 0.0, 0.01, 0.0]));
    bytes.extend(floats(&[0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]));
    bytes.extend([0u16, 1, 2, 0, 2, 3].iter().flat_map(|v| v.to_le_bytes()));
    bytes.extend(floats(&[0.0, 0.0, 0.0, 0.02, 0.0, 0.0, 0.04, 0.0, 0.0]));
    bytes.extend([0u16, 4095, 4095, 4095, 4095, 0, 0, 0].iter().flat_map(|v| v.to_le_bytes()));
    desk.write("a.bin", &bytes);
    let text = r#"{"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
 "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1, "TEXCOORD_1": 4}, "indices": 2, "material": 0}]}], "materials": [{}],
 "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}, {"bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2"},
  {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"}, {"bufferView": 3, "componentType": 5126, "count": 3, "type": "VEC3"},
  {"bufferView": 4, "componentType": 5123, "count": 4, "type": "VEC2"}],
 "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 32}, {"buffer": 0, "byteOffset": 80, "byteLength": 12},
  {"buffer": 0, "byteOffset": 92, "byteLength": 36}, {"buffer": 0, "byteOffset": 128, "byteLength": 16}], "buffers": [{"byteLength": 144, "uri": "a.bin"}]}"#;
    let text = changes.iter().fold(text.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replacen(from, to, 1)
    });
    desk.write("a.gltf", text);
}

#[test]
fn shows_all_instances_of_a_gltf() {
    let desk = Desk::new();
    let instances =
        "{\"mesh\": 0, \"extensions\": {\"EXT_mesh_gpu_instancing\": {\"attributes\": {\"TRANSLATION\": 3}}}}";
    gltf(&desk, &[("{\"mesh\": 0}", instances)]);
    desk.write("g.ron", graph("a.gltf", ", buffer: \"a.bin\"", ", charts: New"));
    let mesh = desk.shibo("dump g.ron m --no-cache").expect(0).json();
    let bounds = mesh["bounds"].as_array().unwrap()[1].as_array().unwrap()[0].as_f64().unwrap();
    let area = mesh["area"].as_f64().unwrap();
    assert!((area - 300.0).abs() < 1e-3 && (bounds - 50.0).abs() < 1e-3 && mesh["pieces"] == 3, "{area} {bounds}");
}

#[test]
fn refuses_versions_and_extensions_by_name() {
    let desk = Desk::new();
    desk.write("g.ron", graph("a.gltf", ", buffer: \"a.bin\"", ""));
    for (from, to, told) in [
        ("\"2.0\"", "\"9.0\"", "it is glTF of version 9.0"),
        ("\"2.0\"", "\"2.0\", \"minVersion\": \"2.7\"", "it needs a reader of glTF 2.7"),
        (
            "\"scene\": 0",
            "\"scene\": 0, \"extensionsRequired\": [\"KHR_draco_mesh_compression\"]",
            "`KHR_draco_mesh_compression`",
        ),
    ] {
        gltf(&desk, &[(from, to)]);
        let said = words(&desk.shibo("check g.ron").expect(1).stderr);
        assert!(said.contains(told) && said.contains("g.ron:3:") && said.contains("bad-file"), "{said}");
    }
    gltf(&desk, &[("\"scene\": 0", "\"scene\": 0, \"extensionsUsed\": [\"MSFT_lod\"]")]);
    let said = words(&desk.shibo("render g.ron --no-cache --quiet").expect(0).stderr);
    assert!(said.contains("left out: extension `MSFT_lod`"), "{said}");
}

#[test]
fn reads_chosen_uv_set() {
    let desk = Desk::new();
    let transform = "\"materials\": [{\"pbrMetallicRoughness\": {\"baseColorTexture\": {\"index\": 0, \"texCoord\": 1, \"extensions\": \
        {\"KHR_texture_transform\": {\"scale\": [0.0002442002442002442, 0.0002442002442002442]}}}}}]";
    gltf(&desk, &[("\"materials\": [{}]", transform)]);
    for set in ["", ", uv_set: 1"] {
        desk.write("g.ron", graph("a.gltf", &format!(", buffer: \"a.bin\"{set}"), ""));
        let mask = desk.shibo("dump g.ron at.mask --no-cache").expect(0).json();
        assert!(mask["values"].as_array().unwrap().iter().all(|v| v == 1.0), "{set}");
    }
    desk.write("g.ron", graph("a.gltf", ", buffer: \"a.bin\", uv_set: 2", ""));
    let told = words(&desk.shibo("check g.ron").expect(1).stderr);
    assert!(told.contains("no UVs of set 2; take `uv_set: 0`, `uv_set: 1`") && told.contains("g.ron:3:"), "{told}");
}

/// Sheets of 10 by 10 mm, one in each UDIM tile; a sheet's z is the number of its tile.
fn tiles(numbers: &[u32]) -> String {
    let mut text = String::new();
    for (n, number) in numbers.iter().enumerate() {
        let (u, v) = ((number - 1001) % 10, (number - 1001) / 10);
        for (x, y) in [(0, 0), (1, 0), (1, 1), (0, 1)] {
            text += &format!("v {} {} {number}\nvt {} {}\n", 10 * x, 10 * y, u + x, v + y);
        }
        let at = |k: usize| format!("{0}/{0}", 4 * n + k);
        text += &format!("f {} {} {} {}\n", at(1), at(2), at(3), at(4));
    }
    text
}

/// Tile numbers in a picture of four by four pixels, row by row from the top, and the messages.
fn shown(desk: &Desk, atlas: &str) -> (Vec<u32>, String) {
    desk.write("g.ron", graph("a.obj", "", atlas).replace("resolution: 8", "resolution: 4"));
    let ran = desk.shibo("dump g.ron where --no-cache").expect(0);
    #[expect(clippy::cast_possible_truncation, reason = "numbers of tiles")]
    let tile = |value: &serde_json::Value| value.as_f64().unwrap().round() as u32;
    let values = ran.json()["values"].as_array().unwrap().iter().map(tile).collect::<Vec<_>>();
    (values.chunks(3).map(|place| place[2]).collect(), words(&ran.stderr))
}

#[test]
fn lays_udim_tiles_beside_each_other() {
    let desk = Desk::new();
    desk.write("a.obj", tiles(&[1001, 1002, 1012]));
    let (all, told) = shown(&desk, "");
    let upper = [0, 0, 1012, 1012];
    // Tile 1011 is empty except for the gutter of its neighbours, two pixels wide.
    assert_eq!(all[2..4], upper[2..], "{all:?}");
    assert_eq!(all[8..], [1001, 1001, 1002, 1002, 1001, 1001, 1002, 1002]);
    assert!(!told.contains("udim"), "{told}");
    assert_eq!(shown(&desk, ", udim: Tile(1002)").0, [1002; 16]);
    let (wide, told) = shown(&desk, ", udim: Tiles(4, 1)");
    assert_eq!(wide[..4], [1001, 1002, 0, 0].map(|n| if n == 0 { wide[2] } else { n }));
    assert!(told.contains("the UDIM tiles 1012 of the mesh are not on the canvas"), "{told}");
    // A single tile that is not the first, on a canvas only one tile wide.
    desk.write("a.obj", tiles(&[1002]));
    let (one, told) = shown(&desk, "");
    assert_eq!(one[2..4], [1002, 1002]);
    assert!(
        told.contains("the canvas holds 2 × 1 UDIM tiles (the mesh uses 1002)") && told.contains("udim: Tile(1002)"),
        "{told}"
    );
}

#[test]
fn refuses_crossed_and_missing_udim_tiles() {
    let desk = Desk::new();
    let refused = |mesh: &str, atlas: &str, told: &str| {
        desk.write("a.obj", mesh);
        desk.write("g.ron", graph("a.obj", "", atlas));
        let said = words(&desk.shibo("render g.ron --no-cache --quiet").expect(1).stderr);
        assert!(said.contains(told) && said.contains("g.ron:4:"), "{told}: {said}");
    };
    let repeats = sheet(FACE).replace("vt 1", "vt 2");
    refused(&repeats, "", "`charts: Repack` lays the charts out anew");
    refused(&sheet(FACE).replace("vt 1", "vt -1"), "", "`charts: Repack` lays the charts out anew");
    // Two faces of one chart that meet at the border of two tiles.
    let floor = "v 0 0 0\nv 10 0 0\nv 20 0 0\nv 0 10 0\nv 10 10 0\nv 20 10 0\nvt 0 0\nvt 1 0\nvt 2 0\nvt 0 1\nvt 1 1\nvt 2 1\n\
                 f 1/1 2/2 5/5 4/4\nf 2/2 3/3 6/6 5/5\n";
    refused(floor, "", "cross the border of a UDIM tile");
    refused(
        &tiles(&[1001, 1011]),
        ", udim: Tile(1005)",
        "no triangle lies in these UDIM tiles; the mesh uses 1001, 1011",
    );
    refused(&tiles(&[1001]), ", udim: Tile(999)", "UDIM tiles are numbered from 1001 to 2000");
    refused(&tiles(&[1001]), ", udim: Tiles(0, 1)", "1 to 10 across and 1 to 100 up");
}
