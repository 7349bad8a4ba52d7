//! Tests of loading files, and of the messages about them.
use super::*;
use crate::testing::{Plain, canvas};
use shibo_node::{Call, DynNode};
use shibo_value::Value;
use std::path::{Path, PathBuf};
use std::sync::Arc;

fn data(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/meshes").join(name)
}

fn load(node: &LoadMesh, path: &Path) -> Result<Arc<Mesh>, Problem> {
    let files = [("path", path.into())];
    let canvas = canvas();
    let call = Call { kind: "LoadMesh", canvas: &canvas, inputs: &[], files: &files, evaluator: &Plain };
    match DynNode::evaluate(node, &call) {
        Ok(outputs) => match outputs.take("mesh", true) {
            Some(Value::Mesh(mesh)) => Ok(mesh.clone()),
            other => panic!("{other:?}"),
        },
        Err(Stop::Failed(problem)) => Err(*problem),
        Err(stop) => panic!("{stop:?}"),
    }
}

fn bounds(node: &LoadMesh, name: &str) -> [[f64; 3]; 2] {
    load(node, &data(name)).unwrap().bounds().map(|corner| corner.to_array())
}

#[test]
fn files_are_read() {
    for (name, triangles, vertices) in [
        ("cube.obj", 12, 8),
        ("plane_one.obj", 512, 289),
        ("plane_cut.obj", 512, 289),
        ("plane_wild.obj", 512, 289),
        ("sphere.obj", 1280, 642),
        ("open_strip.obj", 64, 51),
        ("moebius.obj", 256, 160),
    ] {
        let node = LoadMesh { up: UpAxis::Z, ..LoadMesh::default() };
        let mesh = load(&node, &data(name)).unwrap();
        assert_eq!(mesh.triangles.len(), triangles, "{name}");
        assert!(name == "moebius.obj" || mesh.positions.len() == vertices, "{name} {}", mesh.positions.len());
        assert!(mesh.polygons.is_empty() && mesh.parts.iter().all(|part| *part == 0));
        assert!(Node::check_files(&node, &[("path", (&data(name)).into())]).is_empty());
    }
}

#[test]
fn units_and_axes_are_turned() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("corner.obj");
    std::fs::write(&path, text).unwrap();
    let size = |node: LoadMesh| load(&node, &path).unwrap().bounds().map(|corner| corner.to_array());
    assert_eq!(size(LoadMesh { up: UpAxis::Z, ..LoadMesh::default() }), [[0.0; 3], [1.0, 2.0, 3.0]]);
    assert_eq!(size(LoadMesh::default()), [[0.0, -3.0, 0.0], [1.0, 0.0, 2.0]]);
    let inches = LoadMesh { unit: LengthUnit::Inch, up: UpAxis::Z, scale: 2.0, ..LoadMesh::default() };
    assert_eq!(size(inches)[1].map(|x| (x * 10.0).round()), [508.0, 1016.0, 1524.0]);
    let centered = LoadMesh { up: UpAxis::Z, center: Center::Bounds, ..LoadMesh::default() };
    assert_eq!(size(centered.clone()), [[-0.5, -1.0, -1.5], [0.5, 1.0, 1.5]]);
    assert_eq!(size(LoadMesh { center: Center::Base, ..centered }), [[-0.5, -1.0, 0.0], [0.5, 1.0, 3.0]]);
    // Rotated by 90° about x, so it is still seen from the same side.
    let mesh = load(&LoadMesh::default(), &path).unwrap();
    let volume: f64 = (0..4).map(|n| mesh.cross(n).dot(mesh.corners(n)[0])).sum();
    assert!(volume > 0.0);
    assert_eq!(bounds(&LoadMesh { up: UpAxis::Z, ..LoadMesh::default() }, "cube.obj"), [[-30.0; 3], [30.0; 3]]);
}

#[test]
fn one_part_can_be_taken() {
    let text = "v 0 0 0\nv 1 0 0\nv 0 2 0\nv 0 0 3\no arm\nusemtl wood\nf 1 3 2\nf 1 2 4\nusemtl brass\nf 1 4 3\no leg\nf 2 3 4\n";
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("chair.obj");
    std::fs::write(&path, text).unwrap();
    let of = |part: &str| load(&LoadMesh { part: part.into(), ..LoadMesh::default() }, &path);
    let all = of("").unwrap();
    assert_eq!(all.part_names, ["arm/wood", "arm/brass", "leg/brass"]);
    assert_eq!(all.parts, [0, 0, 1, 2]);
    for (part, count, names) in [("arm", 3, 2), ("brass", 2, 2), ("arm/wood", 2, 1), ("leg", 1, 1)] {
        let mesh = of(part).unwrap();
        assert_eq!((mesh.triangles.len(), mesh.part_names.len()), (count, names), "{part}");
        assert!(mesh.parts.iter().all(|n| usize::from(*n) < names));
    }
    let problem = of("arn").unwrap_err();
    assert_eq!((problem.code, problem.field.as_deref()), (Code::BadValue, Some("part")));
    assert!(problem.help.unwrap().contains("arm"));
}

#[test]
fn refuses_files_without_a_mesh() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    let refused = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        let problem = load(&LoadMesh::default(), &path).unwrap_err();
        let checked = Node::check_files(&LoadMesh::default(), &[("path", (&path).into())]);
        (problem, checked.len())
    };
    for (bytes, words) in [
        (&b"v 0 0 0\nv 1 0 0\nv 0 x 0\nf 1 2 3\n"[..], "line 3: `v 0 x 0`"),
        (b"v 0 0 0\nv 1 0 0\nv 0 nan 0\nf 1 2 3\n", "finite"),
        (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "line 4: `f 1 2 4`"),
        (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\n", "no "),
        (b"# nothing\n", "no "),
        (b"", "no "),
        (&[0x89, b'P', b'N', b'G', 0, 0, 0], "neither OBJ nor glTF"),
        (b"glTF\x02\x00\x00\x00\xff\x00\x00\x00", "truncated"),
        (b"{\"asset\": 3}", "no glTF"),
    ] {
        let (problem, checked) = refused(bytes);
        assert_eq!((problem.code, problem.field.as_deref()), (Code::BadFile, Some("path")), "{words}");
        assert!(problem.message.contains(words), "{}", problem.message);
        assert_eq!(checked, 1, "{words}");
    }
    let flat = b"v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n";
    assert!(refused(flat).0.message.contains("area"));
    let far = b"v 0 0 0\nv 1e8 0 0\nv 0 1 0\nf 1 2 3\n";
    assert!(refused(far).0.message.contains("within"));
    let none = load(&LoadMesh::default(), &folder.path().join("none.obj")).unwrap_err();
    assert_eq!(none.code, Code::FileNotFound);
    assert_eq!(load(&LoadMesh::default(), folder.path()).unwrap_err().code, Code::BadFile);
}

#[test]
fn advises_about_unusual_meshes() {
    let node = LoadMesh { up: UpAxis::Z, ..LoadMesh::default() };
    let of = |name: &str, node: &LoadMesh| {
        let contents = read::read(&(&data(name)).into(), None, 0, &Watch::never()).unwrap();
        let advice: Vec<String> =
            node.made(contents, &Watch::never()).unwrap().1.into_iter().map(|p| p.message).collect();
        advice.join("; ")
    };
    assert_eq!(of("cube.obj", &node), "");
    assert!(of("moebius.obj", &node).contains("Möbius"));
    assert!(of("cube.obj", &LoadMesh { scale: 1e-3, ..node.clone() }).contains("largest side"));
    assert!(of("cube.obj", &LoadMesh { unit: LengthUnit::M, ..node }).contains("largest side"));
}

/// A face without UVs or normals leaves those of other faces intact, and a warning reports it.
#[test]
fn leaves_uvs_and_normals_of_other_faces() {
    let text = "v 0 0 0\nv 90 0 0\nv 90 90 0\nv 0 90 0\nvt 0 0\nvt 1 0\nvt 1 1\nvn 1 0 0\n\
                f 1/1/1 2/2/1 3/3/1\nf 1 3 4\no bare\nf 2 1 4\n";
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    std::fs::write(&path, text).unwrap();
    let made = |part: &str| {
        let node = LoadMesh { up: UpAxis::Z, part: part.into(), ..LoadMesh::default() };
        let contents = read::read(&(&path).into(), None, 0, &Watch::never()).unwrap();
        let (mesh, advice) = node.made(contents, &Watch::never()).unwrap();
        (mesh, advice.into_iter().map(|problem| problem.message).collect::<Vec<_>>().join("; "))
    };
    let (mesh, told) = made("unnamed_object");
    assert_eq!(mesh.uvs[0], [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0]].map(glam::Vec2::from_array));
    assert_eq!((mesh.uvs[1], mesh.normals[0], mesh.normals[1]), ([mesh.uvs[0][0]; 3], [Vec3::X; 3], [Vec3::Z; 3]));
    assert!(told.contains("1 of 2 faces have no UVs") && told.contains("1 of 2 faces lack normals"), "{told}");
    // A part without any UVs or normals has none.
    let (mesh, told) = made("bare");
    assert!(mesh.uvs.is_empty() && mesh.normals.is_empty() && told.is_empty(), "{told}");
}

/// A vertex without a triangle is not part of the mesh: it may lie anywhere.
#[test]
fn unused_vertices_do_not_count() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.gltf");
    let bytes: Vec<u8> = [[0.0f32, 0.0, 0.0], [f32::NAN, 1.0, 0.0], [0.1, 0.0, 0.0], [1e30, 0.0, 0.0], [0.0, 0.1, 0.0]]
        .as_flattened()
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .chain([0, 2, 4])
        .collect();
    std::fs::write(folder.path().join("a.bin"), &bytes).unwrap();
    let text = r#"{"asset": {"version": "2.0"}, "nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
 "accessors": [{"bufferView": 0, "componentType": 5126, "count": 5, "type": "VEC3"}, {"bufferView": 1, "componentType": 5121, "count": 3, "type": "SCALAR"}],
 "bufferViews": [{"buffer": 0, "byteLength": 60}, {"buffer": 0, "byteOffset": 60, "byteLength": 3}], "buffers": [{"byteLength": 63, "uri": "a.bin"}]}"#;
    std::fs::write(&path, text).unwrap();
    let contents =
        read::read(&(&path).into(), Some(&(&folder.path().join("a.bin")).into()), 0, &Watch::never()).unwrap();
    let node = LoadMesh { up: UpAxis::Z, center: Center::Bounds, ..LoadMesh::default() };
    let (mesh, _) = node.made(contents, &Watch::never()).unwrap();
    assert_eq!(
        mesh.bounds().map(|corner| corner.as_vec3()),
        [Vec3::new(-50.0, -50.0, 0.0), Vec3::new(50.0, 50.0, 0.0)]
    );
}
