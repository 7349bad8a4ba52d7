//! Tests of whole files, valid and invalid ones.
use super::*;
use crate::mesh::LoadMesh;
use std::fmt::Write as _;
use std::path::PathBuf;

pub(super) fn read_bytes(file: &[u8], buffer: Option<&[u8]>) -> Result<Contents, ReadError> {
    of_bytes(file, buffer, 0, &Watch::never())
}

/// A GLB with a document and a binary part.
pub(super) fn glb(json: &str, binary: &[u8]) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut binary = binary.to_vec();
    binary.resize(binary.len().next_multiple_of(4), 0);
    let word = |n: usize| u32::try_from(n).unwrap().to_le_bytes();
    let mut file = b"glTF\x02\x00\x00\x00".to_vec();
    file.extend(word(28 + json.len() + binary.len()));
    file.extend(word(json.len()));
    file.extend(b"JSON");
    file.extend(&json);
    file.extend(word(binary.len()));
    file.extend(b"BIN\0");
    file.extend(&binary);
    file
}

/// Four corners of a square, their UVs, and six indices of 16 bits.
pub(super) fn square() -> Vec<u8> {
    let mut bytes = Vec::new();
    for p in [[0.0f32, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 2.0, 0.0], [0.0, 2.0, 0.0]] {
        bytes.extend(p.iter().flat_map(|v| v.to_le_bytes()));
    }
    for uv in [[0.0f32, 1.0], [0.5, 1.0], [0.5, 0.0], [0.0, 0.0]] {
        bytes.extend(uv.iter().flat_map(|v| v.to_le_bytes()));
    }
    bytes.extend([0u16, 1, 2, 0, 2, 3].iter().flat_map(|v| v.to_le_bytes()));
    bytes
}

pub(super) const SQUARE: &str = r#"{"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
 "nodes": [{"name": "left", "mesh": 0}, {"name": "right", "children": [2]}, {"mesh": 0, "scale": [-2, 1, 1], "translation": [5, 0, 0]}],
 "materials": [{"name": "oak"}],
 "meshes": [{"name": "sheet", "primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "indices": 2, "material": 0}]}],
 "accessors": [{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 2, 0]},
  {"bufferView": 0, "byteOffset": 48, "componentType": 5126, "count": 4, "type": "VEC2"},
  {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"}],
 "bufferViews": [{"buffer": 0, "byteLength": 80}, {"buffer": 0, "byteOffset": 80, "byteLength": 12}],
 "buffers": [{"byteLength": 92}]}"#;

pub(super) fn message(file: &[u8]) -> String {
    read_bytes(file, None).unwrap_err().to_string()
}

#[test]
fn glb_is_read_with_its_nodes() {
    let contents = read_bytes(&glb(SQUARE, &square()), None).unwrap();
    let mesh = &contents.mesh;
    assert!(contents.metres && contents.left_out.is_empty());
    assert_eq!(mesh.part_names, ["left/sheet/oak", "sheet/oak"]);
    assert_eq!((mesh.triangles.len(), mesh.positions.len()), (4, 8));
    assert!(mesh.normals.as_flattened().iter().all(|normal| *normal == Vec3::ZERO));
    // The second instance is mirrored and moved, and faces the same way.
    assert_eq!(mesh.positions[5], Vec3::new(3.0, 0.0, 0.0));
    assert!((0..4).all(|n| mesh.cross(n).z > 0.0));
    assert_eq!(mesh.uvs[0], [[0.0, 1.0], [0.5, 1.0], [0.5, 0.0]].map(Vec2::from_array));
    assert_eq!(gltf::check(&glb(SQUARE, &square()), None, true, 0), Ok(()));
}

#[test]
fn documents_keep_their_numbers_inside_or_beside() {
    let beside = SQUARE.replace("\"byteLength\": 92", "\"byteLength\": 92, \"uri\": \"../../etc/passwd\"");
    assert!(matches!(read_bytes(beside.as_bytes(), None), Err(ReadError::NoBuffer(_))));
    let read = read_bytes(beside.as_bytes(), Some(&square())).unwrap();
    assert_eq!(read.mesh, read_bytes(&glb(SQUARE, &square()), None).unwrap().mesh);
    let text: String = square().chunks(3).fold(String::new(), |mut text, three| {
        let bits = (0..3).fold(0u32, |bits, k| bits << 8 | u32::from(three.get(k).copied().unwrap_or(0)));
        let letter = |k: u32| {
            b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/"[(bits >> (18 - 6 * k) & 63) as usize]
        };
        (0..4).for_each(|k| text.push(char::from(letter(k))));
        text
    });
    let inside = format!("\"byteLength\": 92, \"uri\": \"data:application/octet-stream;base64,{text}\"");
    let inside = read_bytes(SQUARE.replace("\"byteLength\": 92", &inside).as_bytes(), None).unwrap();
    assert_eq!(inside.mesh, read.mesh);
}

#[test]
fn strips_and_fans_are_unrolled() {
    for (mode, third) in [(4, [0, 2, 3]), (5, [1, 3, 2]), (6, [0, 2, 3])] {
        let json = SQUARE.replace("\"indices\": 2,", &format!("\"mode\": {mode},")).replace("\"indices\": 2", "");
        let bytes = if mode == 4 {
            read_bytes(&glb(SQUARE, &square()), None)
        } else {
            read_bytes(&glb(&json, &square()), None)
        };
        let mesh = bytes.unwrap().mesh;
        assert_eq!(
            (mesh.triangles[0], mesh.triangles[1]),
            ([0, 1, 2], if mode == 5 { [2, 1, 3] } else { third }),
            "{mode}"
        );
    }
    let lines =
        SQUARE.replace("\"material\": 0}", "\"material\": 0}, {\"attributes\": {\"POSITION\": 0}, \"mode\": 1}");
    assert_eq!(read_bytes(&glb(&lines, &square()), None).unwrap().left_out, ["points and lines"]);
}

#[test]
fn faults_of_documents_are_named() {
    for (from, to, words) in [
        ("\"indices\": 2", "\"indices\": 9", "primitives[0].indices: there is no accessor 9 of 3"),
        ("\"count\": 6", "\"count\": 7", "accessor 2 has 7 elements"),
        ("\"count\": 6", "\"count\": 18446744073709551615", "accessor 2 has 18446744073709551615 elements"),
        ("\"byteLength\": 12", "\"byteLength\": 13", "leaves its buffer"),
        ("\"byteLength\": 92", "\"byteLength\": 93", "truncated"),
        ("\"componentType\": 5123", "\"componentType\": 5121", "indices lie beyond"),
        ("\"children\": [2]", "\"children\": [1]", "within itself"),
        ("\"children\": [2]", "\"children\": [7]", "there are only 3 nodes"),
        ("\"mesh\": 0}", "\"mesh\": 4}", "there is no mesh 4"),
        ("\"TEXCOORD_0\": 1", "\"TEXCOORD_0\": 0", "holds Vec3 and must hold Vec2"),
        ("\"scene\": 0", "\"scene\": 5", "there is no scene 5"),
        ("\"scene\": 0", "\"extensionsRequired\": [\"KHR_draco_mesh_compression\"]", "KHR_draco_mesh_compression"),
        ("\"asset\"", "\"assets\"", "no glTF"),
        ("\"2.0\"", "\"9.0\"", "glTF of version 9.0"),
        ("\"2.0\"", "\"1.0\"", "glTF of version 1.0"),
        ("\"2.0\"", "\"two\"", "glTF of version two"),
        ("\"2.0\"", "\"2.1\", \"minVersion\": \"2.1\"", "needs a reader of glTF 2.1"),
    ] {
        let json = SQUARE.replacen(from, to, 1);
        assert_ne!(json, SQUARE);
        let file = if from.contains("5123") { json.replace("\"count\": 6", "\"count\": 12") } else { json };
        let mut numbers = square();
        if from.contains("5123") {
            numbers[80..].fill(9);
        }
        let found = message(&glb(&file, &numbers));
        assert!(found.contains(words), "{words}: {found}");
        assert!(gltf::check(&glb(&file, &numbers), None, true, 0).is_err());
    }
    let mut old = glb(SQUARE, &square());
    old[4] = 1;
    assert!(message(&old).contains("version 1"));
}

#[test]
fn quantized_numbers_are_read() {
    let mut bytes: Vec<u8> =
        [[0i16, 0, 0, 0], [100, 0, 0, 0], [100, 200, 0, 0]].iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
    bytes.extend([[0u8, 255, 0, 0], [255, 255, 0, 0], [255, 0, 0, 0]].as_flattened());
    let json = r#"{"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}], "extensionsRequired": ["KHR_mesh_quantization"],
 "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}}]}],
 "accessors": [{"bufferView": 0, "componentType": 5122, "count": 3, "type": "VEC3"},
  {"bufferView": 1, "componentType": 5121, "normalized": true, "count": 3, "type": "VEC2"}],
 "bufferViews": [{"buffer": 0, "byteLength": 24, "byteStride": 8}, {"buffer": 0, "byteOffset": 24, "byteLength": 12, "byteStride": 4}],
 "buffers": [{"byteLength": 36}]}"#;
    let mesh = read_bytes(&glb(json, &bytes), None).unwrap().mesh;
    assert_eq!(mesh.positions[2], Vec3::new(100.0, 200.0, 0.0));
    assert_eq!(mesh.uvs[0], [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0]].map(Vec2::from_array));
}

#[test]
fn reads_contents_of_obj() {
    let text = "mtllib ../../secret.mtl\nv 0 0 0\r\nv 2 0 0 1 0 0\nv 2 2 0\nv 0 2 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 2\n\
                l 1 2\nusemtl red oak\nf 1/1/1 2/2/1 3/3/1 4/4/1\nf -4/1/1 -2/3/1 -1/4/1\n";
    let contents = read_bytes(text.as_bytes(), None).unwrap();
    let mesh = contents.mesh;
    assert_eq!(contents.left_out, ["lines and points"]);
    assert_eq!((mesh.triangles.len(), mesh.part_names), (3, vec!["red oak".to_owned()]));
    assert_eq!(mesh.polygons, [0, 0, 1]);
    assert_eq!(mesh.uvs[0], [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0]].map(Vec2::from_array));
    assert_eq!(mesh.normals[0], [Vec3::Z; 3]);
    // A face without UVs and normals leaves those of other faces as they are.
    let bare = read_bytes(text.replace("-4/1/1 -2/3/1 -1/4/1", "-4 -2 -1").as_bytes(), None).unwrap().mesh;
    assert_eq!((&bare.uvs[..2], &bare.normals[..2]), (&mesh.uvs[..2], &mesh.normals[..2]));
    assert!(bare.uvs[2][0].is_nan() && bare.normals[2] == [Vec3::ZERO; 3]);
}

/// Small files that expand to large data are refused before the data is allocated.
#[test]
fn bombs_are_refused() {
    let faces = "v 0 0 0\nv 1 0 0\nv 0 1 0\n".to_owned() + &"f 1 2 3\n".repeat(MOST_TRIANGLES + 1);
    assert!(matches!(read_bytes(faces.as_bytes(), None), Err(ReadError::TooLarge(_))));
    let mut groups = "v 0 0 0\nv 1 0 0\nv 0 1 0\n".to_owned();
    for n in 0..100_001 {
        writeln!(groups, "o {n}").unwrap();
    }
    assert!(matches!(read_bytes((groups + "f 1 2 3\n").as_bytes(), None), Err(ReadError::TooLarge(_))));
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf".to_owned() + &" 1 2 3".repeat(22_000);
    assert!(message(corners.as_bytes()).contains("65535 corners at most"));
    let names = "v 0 0 0\nv 1 0 0\nv 0 1 0\no ".to_owned() + &"n".repeat(1 << 20);
    let names = (0..80).fold(names, |text, n| text + &format!("\nusemtl {n}\nf 1 2 3"));
    assert!(message(names.as_bytes()).contains("names of 64 MiB"));
    let objects = format!("{{\"asset\": {{\"version\": \"2.0\"}}, \"nodes\": [{}{{}}]}}", "{},".repeat(300_000));
    assert!(matches!(read_bytes(objects.as_bytes(), None), Err(ReadError::TooLarge(_))));
    // One accessor, used by many nodes.
    let nodes = (0..1500).map(|_| "{\"mesh\": 0}").collect::<Vec<_>>().join(",");
    let all = (0..1500).map(|n| n.to_string()).collect::<Vec<_>>().join(",");
    let json = format!(
        r#"{{"asset": {{"version": "2.0"}}, "nodes": [{nodes}], "scenes": [{{"nodes": [{all}]}}],
 "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}}}]}}],
 "accessors": [{{"bufferView": 0, "componentType": 5126, "count": 9000, "type": "VEC3"}}],
 "bufferViews": [{{"buffer": 0, "byteLength": 108000}}], "buffers": [{{"byteLength": 108000}}]}}"#
    );
    assert!(matches!(read_bytes(&glb(&json, &vec![0; 108_000]), None), Err(ReadError::TooLarge(_))));
}

/// A random number generator.
struct Chance(u64);

impl Chance {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        usize::try_from(self.0 >> 33).unwrap() % n.max(1)
    }

    /// A file with some bytes changed, left out, or repeated.
    fn damaged(&mut self, file: &[u8]) -> Vec<u8> {
        let mut out = file.to_vec();
        for _ in 0..=self.below(4) {
            let (at, other) = (self.below(out.len()), self.below(out.len()));
            match self.below(6) {
                0 => out[at] = u8::try_from(self.below(256)).unwrap(),
                1 => out[at] ^= 1 << self.below(8),
                2 => out[at] = b"0123456789-./ \n{}[],:\"fvtnogl"[self.below(29)],
                3 => out.truncate(at.max(1)),
                4 => drop(out.drain(at.min(other)..at.max(other))),
                _ => {
                    let some = out[at.min(other)..at.max(other)].to_vec();
                    let to = self.below(out.len());
                    out.splice(to..to, some.into_iter().take(200));
                }
            }
            if out.is_empty() {
                out.push(b'f');
            }
        }
        out
    }
}

/// Counts the damaged files, of `count`, that are read all the same. None may panic, and the mesh must be consistent.
fn survivors(files: &[Vec<u8>], count: usize) -> usize {
    let mut chance = Chance(20);
    let mut read = 0;
    for n in 0..count {
        let file = chance.damaged(&files[n % files.len()]);
        let Ok(contents) = read_bytes(&file, None) else { continue };
        let mesh = &contents.mesh;
        let all = mesh.triangles.len();
        assert!(mesh.triangles.iter().flatten().all(|v| (*v as usize) < mesh.positions.len()));
        assert!(mesh.parts.len() == all && mesh.parts.iter().all(|part| usize::from(*part) < mesh.part_names.len()));
        assert!([mesh.uvs.len(), mesh.normals.len(), mesh.polygons.len()].iter().all(|n| *n == 0 || *n == all));
        // Later stages must accept the contents, too.
        let made = LoadMesh::default().made(contents, &Watch::never());
        if let Ok((mesh, _)) = made {
            assert!(mesh.positions.iter().all(|p| p.is_finite()) && !mesh.triangles.is_empty());
        }
        read += 1;
    }
    read
}

/// Valid and broken files of all kinds: the seed corpus of `tests/fuzz`.
fn seeds() -> Vec<Vec<u8>> {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests");
    let corpus = root.join("fuzz/corpus/meshes").read_dir().unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<PathBuf> = corpus.chain([root.join("meshes/cube.obj")]).collect();
    files.sort();
    assert!(files.len() >= 10);
    files.iter().map(|file| std::fs::read(file).unwrap()).collect()
}

/// Number of damaged files to try; the variable `DAMAGED_MESHES` at compile time sets it for longer runs.
fn tries() -> usize {
    option_env!("DAMAGED_MESHES").and_then(|n| n.parse().ok()).unwrap_or(12_000)
}

/// Files with random damage are refused or read, and never crash the program.
#[test]
fn damaged_files_are_refused_or_read() {
    let tries = tries();
    let read = survivors(&seeds(), tries);
    assert!((tries / 60..tries / 2).contains(&read), "{read} of {tries}");
}
