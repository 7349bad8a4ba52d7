//! Tests of files as other programs write them: unusual, but valid.
use super::tests::{SQUARE, glb, message, read_bytes, square};
use super::*;

/// A sheet of 10 by 10 with UVs, followed by the lines `more`.
fn sheet(more: &str) -> String {
    format!("v 0 0 0\nv 10 0 0\nv 10 10 0\nv 0 10 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n{more}")
}

const FACE: &str = "f 1/1 2/2 3/3 4/4\n";

/// The area and the contents of a file.
fn area(file: &[u8]) -> (f64, Contents) {
    let contents = read_bytes(file, None).unwrap_or_else(|error| panic!("{error}: {}", String::from_utf8_lossy(file)));
    (contents.mesh.area(), contents)
}

/// Number of triangles with UVs.
fn with_uvs(contents: &Contents) -> usize {
    contents.mesh.uvs.iter().filter(|uvs| uvs[0].is_finite()).count()
}

#[test]
fn reads_obj_with_any_marks_line_ends_and_comments() {
    let plain = read_bytes(sheet(FACE).as_bytes(), None).unwrap();
    assert_eq!(plain.mesh.area(), 100.0);
    let same = |file: &[u8]| {
        let found = read_bytes(file, None).unwrap();
        assert_eq!((found.mesh, found.notes), (plain.mesh.clone(), Vec::new()), "{}", String::from_utf8_lossy(file));
        assert_eq!(obj::check(unmarked(file)), Ok(()));
    };
    same(format!("\u{feff}{}", sheet(FACE)).as_bytes());
    // An unused vertex is dropped, so the number of vertices stays.
    let spare = read_bytes(format!("\u{feff}{}", sheet("v 5 5 20\nf 1/1 2/2 3/3 4/4\n")).as_bytes(), None).unwrap();
    assert_eq!((spare.mesh.area(), spare.mesh.positions.len()), (100.0, 4));
    same(sheet(FACE).replace('\n', "\r").as_bytes());
    same(sheet(FACE).replace('\n', "\r\n").as_bytes());
    same(sheet("f 1/1 2/2 \\\n 3/3 \\\n 4/4\n").as_bytes());
    same(sheet("f 1/1 2/2 \\\r\n 3/3 4/4\r\n").as_bytes());
    same(sheet("f 1/1 2/2 3/3 4/4 # a quad\n").as_bytes());
    same(sheet(FACE).replace("0\nv", "0 # corner\nv").as_bytes());
    same(&[b"# caf\xe9 \xe8\n", sheet(FACE).as_bytes()].concat());
    same(sheet(&format!("v nan nan nan\nv 1.#QNAN 0 inf\n{FACE}")).as_bytes());
    let named = read_bytes(&[b"o St\xfchl\n", sheet(FACE).as_bytes()].concat(), None).unwrap();
    assert_eq!(named.mesh.part_names, ["St\u{fc}hl"]);
    // Errors still name the right line.
    let bad = sheet("f 1 \\\n 2 \\\n x\nf 1 2 3\n").replace('\n', "\r");
    assert!(message(bad.as_bytes()).starts_with("line 9: `f 1   2   x`"), "{}", message(bad.as_bytes()));
    let nan = sheet("v 1 nan 2\nf 1 2 5\n");
    assert!(message(nan.as_bytes()).starts_with("line 9: `v 1 nan 2`: a face has this vertex"));
}

#[test]
fn refuses_utf16_with_a_clear_message() {
    let text = sheet(FACE);
    for mark in ["\u{feff}", ""] {
        let wide = || mark.encode_utf16().chain(text.encode_utf16());
        let [little, big] =
            [wide().flat_map(u16::to_le_bytes).collect::<Vec<u8>>(), wide().flat_map(u16::to_be_bytes).collect()];
        for file in [little, big] {
            assert_eq!(message(&file), "it is text in UTF-16: save it as UTF-8");
        }
    }
    let marked =
        [b"\xef\xbb\xbf", SQUARE.replace("\"byteLength\": 92", "\"byteLength\": 92, \"uri\": \"a.bin\"").as_bytes()]
            .concat();
    assert_eq!(read_bytes(&marked, Some(&square())).unwrap().mesh.triangles.len(), 4);
}

#[test]
fn keeps_all_attributes_of_obj_faces() {
    // Normals that are not finite, zero, or missing.
    let (sum, found) = area(sheet("vn nan nan nan\nvn 0 0 0\nvn 0 0 3\nf 1/1/1 2/2/2 3/3/3 4/4/3\n").as_bytes());
    assert_eq!((sum, with_uvs(&found)), (100.0, 2));
    assert_eq!(found.mesh.normals[0], [Vec3::ZERO, Vec3::ZERO, Vec3::Z]);
    for references in ["f 1/1/1 2/2/2 3/3/3 4/4/3\n", "f -4/-4/-1 -3/-3/-1 -2/-2/-1 -1/-1/-1\n"] {
        let (sum, found) = area(sheet(references).as_bytes());
        assert_eq!((sum, with_uvs(&found)), (100.0, 2));
        assert_eq!(found.notes, ["faces refer to normals, as in line 9, and there are none"]);
    }
    let (_, found) = area(b"v 0 0 0\nv 9 0 0\nv 0 9 0\nf 1/1 2/2 3/3\n");
    assert_eq!(
        (with_uvs(&found), &found.notes[..]),
        (0, &["faces refer to UVs, as in line 4, and there are none".to_owned()][..])
    );
    // A face without UVs, or with a bad one, leaves those of other faces as they are.
    let (sum, found) = area(sheet("vt nan 0\nf 1/1 2/2 3/3\nf 1 3 4\nf 1/1 2/5 3/3\n").as_bytes());
    assert_eq!((sum, with_uvs(&found)), (150.0, 1));
    assert_eq!(found.notes, ["1 triangles have UVs that are not finite, which are left out"]);
    assert_eq!(found.mesh.uvs[0], [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0]].map(Vec2::from_array));
    // A UV of one number is valid: a coordinate along a line.
    let (_, found) = area(sheet(FACE).replace("vt 1 1", "vt 1").as_bytes());
    assert_eq!(found.mesh.uvs[0][2], Vec2::ONE);
    // Faces with too few corners.
    let (sum, found) = area(sheet(&format!("{FACE}f 1/1 2/2\nf 1\nf\n")).as_bytes());
    assert_eq!(
        (sum, &found.notes[..]),
        (100.0, &["3 faces have fewer than three corners and are left out".to_owned()][..])
    );
    let (_, found) = area(sheet(&format!("{FACE}l 1 2\nsurf 0 1 0 1 1 2 3 4\n")).as_bytes());
    assert_eq!(found.left_out, ["lines and points", "curved surfaces"]);
}

#[test]
fn obj_faces_may_have_thousands_of_corners_and_holes() {
    let n = 2000;
    let mut text = String::new();
    for k in 0..n {
        let angle = std::f64::consts::TAU * f64::from(k) / f64::from(n);
        text += &format!("v {} {} 0\n", 50.0 * angle.cos(), 50.0 * angle.sin());
    }
    text += "f";
    (1..=n).for_each(|k| text += &format!(" {k}"));
    let (sum, found) = area(text.as_bytes());
    assert_eq!(found.mesh.triangles.len(), 1998);
    assert!((sum - std::f64::consts::PI * 2500.0).abs() < 0.1, "{sum}");
    let hole = "v 3 3 0\nv 3 7 0\nv 7 7 0\nv 7 3 0\nf 1 2 3 4 1 5 6 7 8 5\n";
    assert_eq!(area(sheet(hole).as_bytes()).0, 84.0);
}

/// The GLB of the square with changes in its document, and more bytes.
fn changed(changes: &[(&str, &str)], more: &[u8]) -> Vec<u8> {
    let json = changes.iter().fold(SQUARE.to_owned(), |json, (from, to)| {
        assert!(json.contains(from), "{from}");
        json.replacen(from, to, 1)
    });
    let bytes = [square(), more.to_vec()].concat();
    glb(&json.replace("\"byteLength\": 92}]", &format!("\"byteLength\": {}}}]", bytes.len())), &bytes)
}

/// Numbers as little-endian bytes.
fn floats(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

/// Accessors and views that follow those of the square; additional bytes start at 92.
const MORE: [(&str, &str); 2] = [
    ("\"count\": 6, \"type\": \"SCALAR\"}", "\"count\": 6, \"type\": \"SCALAR\"}, ACCESSORS"),
    ("\"byteOffset\": 80, \"byteLength\": 12}", "\"byteOffset\": 80, \"byteLength\": 12}, VIEWS"),
];

#[test]
fn reads_sparse_accessors() {
    // A sparse accessor that moves corner 2; once based on the positions, once on zeros.
    let more = [&[2u8, 0, 0, 0][..], &floats(&[1.0, 4.0, 0.0])].concat();
    let sparse = "\"sparse\": {\"count\": 1, \"indices\": {\"bufferView\": 2, \"componentType\": 5121}, \"values\": {\"bufferView\": 3}}";
    let views = (MORE[1].0, MORE[1].1.replace("VIEWS", "{\"buffer\": 0, \"byteOffset\": 92, \"byteLength\": 4}, {\"buffer\": 0, \"byteOffset\": 96, \"byteLength\": 12}"));
    let positions = ("\"max\": [1, 2, 0]}", format!("\"max\": [1, 2, 0], {sparse}}}"));
    let mesh = |changes: &[(&str, &str)]| read_bytes(&changed(changes, &more), None);
    let all = [(positions.0, &*positions.1), (views.0, &*views.1)];
    let read = mesh(&all).unwrap().mesh;
    assert_eq!(&read.positions[1..3], [Vec3::X, Vec3::new(1.0, 4.0, 0.0)]);
    let zeros = ("{\"bufferView\": 0, \"componentType\"", "{\"componentType\"");
    let read = mesh(&[zeros, all[0], all[1]]).unwrap().mesh;
    assert_eq!(&read.positions[1..3], [Vec3::ZERO, Vec3::new(1.0, 4.0, 0.0)]);
    for (from, to, words) in [
        ("\"sparse\": {\"count\": 1", "\"sparse\": {\"count\": 5", "has no room"),
        ("\"sparse\": {\"count\": 1", "\"sparse\": {\"count\": 18446744073709551615", "has no room"),
        ("\"values\": {\"bufferView\": 3}", "\"values\": {\"bufferView\": 9}", "refers to view 9 of 4"),
        (
            "\"indices\": {\"bufferView\": 2",
            "\"indices\": {\"byteOffset\": 2, \"bufferView\": 3",
            "has the sparse index",
        ),
        (
            "\"count\": 4, \"type\": \"VEC3\"",
            "\"count\": 9000000000000000000, \"type\": \"VEC3\"",
            "has more than 6000000 elements",
        ),
    ] {
        let found = mesh(&[zeros, all[0], all[1], (from, to)]).unwrap_err().to_string();
        assert!(found.contains(words), "{words}: {found}");
    }
}

/// The square's node `left` with instances, and accessors and bytes for them.
fn instanced(attributes: &str, accessors: &str, more: &[u8]) -> Vec<u8> {
    let node = format!(
        "\"mesh\": 0, \"extensions\": {{\"EXT_mesh_gpu_instancing\": {{\"attributes\": {{{attributes}}}}}}}}},"
    );
    let view = format!("{{\"buffer\": 0, \"byteOffset\": 92, \"byteLength\": {}}}", more.len());
    let changes = [
        ("\"mesh\": 0},", &*node),
        (MORE[0].0, &*MORE[0].1.replace("ACCESSORS", accessors)),
        (MORE[1].0, &*MORE[1].1.replace("VIEWS", &view)),
    ];
    changed(&changes, more)
}

#[test]
fn all_instances_are_made() {
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let more = floats(&[
        0.0, 0.0, 0.0, 10.0, 0.0, 0.0, 0.0, 0.0, 7.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, half, half, 0.0, 0.0, 0.0, 1.0,
    ]);
    let three = |at: usize, ty: &str| {
        format!(
            "{{\"bufferView\": 2, \"byteOffset\": {at}, \"componentType\": 5126, \"count\": 3, \"type\": \"{ty}\"}}"
        )
    };
    let accessors = format!("{}, {}", three(0, "VEC3"), three(36, "VEC4"));
    let moved = read_bytes(&instanced("\"TRANSLATION\": 3", &accessors, &more), None).unwrap();
    assert!(moved.left_out.is_empty() && moved.notes.is_empty());
    // Three instances, and the mesh of the other node.
    assert_eq!(moved.mesh.triangles.len(), 8);
    let at = |mesh: &Mesh, n: usize| mesh.positions[4 * n + 1];
    assert_eq!([0, 1, 2].map(|n| at(&moved.mesh, n)), [Vec3::X, Vec3::new(11.0, 0.0, 0.0), Vec3::new(1.0, 0.0, 7.0)]);
    let turned = instanced("\"TRANSLATION\": 3, \"ROTATION\": 4, \"SCALE\": 3", &accessors, &more);
    let turned = read_bytes(&turned, None).unwrap().mesh;
    // The second instance is ten times as wide, turned towards y and moved.
    assert!(at(&turned, 1).distance(Vec3::new(10.0, 10.0, 0.0)) < 1e-5, "{}", at(&turned, 1));
    let fault = |attributes: &str, accessors: &str| message(&instanced(attributes, accessors, &more));
    assert!(fault("", &accessors).contains("nodes[0].extensions.EXT_mesh_gpu_instancing.attributes: they must place"));
    assert!(fault("\"TRANSLATION\": 3, \"SCALE\": 0", &accessors).contains("[3, 4]"));
    assert!(fault("\"ROTATION\": 3", &accessors).contains("holds Vec3 and must hold Vec4"));
    assert!(fault("\"TRANSLATION\": 77", &accessors).contains("there is no accessor 77"));
    assert!(fault("\"TRANSLATION\": \"a\"", &accessors).contains("its extensions cannot be read"));
}

#[test]
fn too_many_instances_are_refused_before_any_is_made() {
    let sparse = "\"sparse\": {\"count\": 0, \"indices\": {\"bufferView\": 2, \"componentType\": 5121}, \"values\": {\"bufferView\": 2}}";
    for count in [2_000_000_u64, 5_999_999, u64::MAX] {
        let accessor = format!("{{\"componentType\": 5126, \"count\": {count}, \"type\": \"VEC3\", {sparse}}}");
        let file = instanced("\"TRANSLATION\": 3", &accessor, &[0; 4]);
        let found = read_bytes(&file, None).unwrap_err();
        let large = matches!(&found, ReadError::TooLarge(_)) || found.to_string().contains("has more than 6000000");
        assert!(large && gltf::check(&file, None, true, 0).is_err(), "{found}");
    }
}

#[test]
fn textures_of_quantized_uvs_are_followed() {
    // As `gltfpack` writes it: UVs of 12 bits, and a texture that divides by 4095.
    let more: Vec<u8> = [0u16, 4095, 2048, 4095, 2048, 0, 0, 0].iter().flat_map(|n| n.to_le_bytes()).collect();
    let transform = "{\"name\": \"oak\", \"pbrMetallicRoughness\": {\"baseColorTexture\": {\"index\": 0, \"extensions\": {\"KHR_texture_transform\": {\"scale\": [0.0002442002442002442, 0.0002442002442002442]}}}}}";
    let read = |transform: &str| {
        let changes = [
            ("\"TEXCOORD_0\": 1", "\"TEXCOORD_0\": 3"),
            ("{\"name\": \"oak\"}", transform),
            (
                MORE[0].0,
                &*MORE[0].1.replace(
                    "ACCESSORS",
                    "{\"bufferView\": 2, \"componentType\": 5123, \"count\": 4, \"type\": \"VEC2\"}",
                ),
            ),
            (MORE[1].0, &*MORE[1].1.replace("VIEWS", "{\"buffer\": 0, \"byteOffset\": 92, \"byteLength\": 16}")),
        ];
        read_bytes(&changed(&changes, &more), None).unwrap()
    };
    let found = read(transform);
    assert!(found.notes.is_empty());
    for (uv, wanted) in found.mesh.uvs[0].iter().zip([[0.0, 1.0], [2048.0 / 4095.0, 1.0], [2048.0 / 4095.0, 0.0]]) {
        assert!(uv.distance(Vec2::from_array(wanted)) < 1e-6, "{uv}");
    }
    assert_eq!(read("{\"name\": \"oak\"}").mesh.uvs[0][0], Vec2::new(0.0, 4095.0));
    // A texture that repeats four times does not move UVs.
    let repeats = [(
        "{\"name\": \"oak\"}",
        "{\"name\": \"oak\", \"normalTexture\": {\"index\": 0, \"extensions\": {\"KHR_texture_transform\": {\"scale\": [4, 4]}}}}",
    )];
    let found = read_bytes(&changed(&repeats, &[]), None).unwrap();
    assert_eq!(found.mesh.uvs[0][1], Vec2::new(0.5, 1.0));
    assert!(found.notes.len() == 1 && found.notes[0].ends_with("of `oak`"), "{:?}", found.notes);
}

#[test]
fn chooses_set_of_uvs() {
    let second = [
        ("\"TEXCOORD_0\": 1", "\"TEXCOORD_0\": 1, \"TEXCOORD_1\": 3"),
        (
            MORE[0].0,
            &*MORE[0]
                .1
                .replace("ACCESSORS", "{\"bufferView\": 2, \"componentType\": 5126, \"count\": 4, \"type\": \"VEC2\"}"),
        ),
        (MORE[1].0, &*MORE[1].1.replace("VIEWS", "{\"buffer\": 0, \"byteOffset\": 92, \"byteLength\": 32}")),
    ];
    let file = changed(&second, &floats(&[0.25; 8]));
    let of = |file: &[u8], uv_set: u32| of_bytes(file, None, uv_set, &Watch::never());
    assert_eq!(of(&file, 0).unwrap().mesh.uvs[0][1], Vec2::new(0.5, 1.0));
    assert_eq!(of(&file, 1).unwrap().mesh.uvs[0][1], Vec2::splat(0.25));
    let refused = of(&file, 2).unwrap_err();
    assert_eq!(refused, ReadError::NoUvs("it has no UVs of set 2; take `uv_set: 0`, `uv_set: 1`".into()));
    assert_eq!(gltf::check(&file, None, true, 2), Err(refused));
    let other = changed(&[("\"TEXCOORD_0\": 1", "\"TEXCOORD_1\": 1")], &[]);
    assert_eq!(of(&other, 0).unwrap().notes, ["it has no UVs of set 0; others are there: `uv_set: 1`"]);
    assert!(matches!(of(sheet(FACE).as_bytes(), 1), Err(ReadError::NoUvs(_))));
}

#[test]
fn reports_ignored_extensions() {
    let used = "\"extensionsUsed\": [\"MSFT_lod\", \"KHR_materials_ior\", \"EXT_mesh_gpu_instancing\", \"FB_ngon_encoding\"], \"scene\": 0";
    let found = read_bytes(&changed(&[("\"scene\": 0", used)], &[]), None).unwrap();
    assert_eq!(found.left_out, ["extension `FB_ngon_encoding`", "extension `MSFT_lod`"]);
}
