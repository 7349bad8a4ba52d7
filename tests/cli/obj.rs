//! Materials on meshes as Wavefront OBJ, end to end.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use crate::export::{GRAPH, desk, files, text};
use crate::support::Desk;

/// Another reader gets the mesh, and the library describes the material.
#[test]
fn an_obj_names_its_library_and_its_pictures() {
    let desk =
        desk("Both", "{ \"o\": Obj(material: \"skin\", mesh: Cube), \"j\": Obj(material: \"skin\", colors: Jpeg) }");
    let said = desk.shibo("render a.ron -o out").expect(0).stderr;
    assert!(said.contains("no texture for the channel `anisotropy_angle`"), "{said}");
    let library = text(&desk, "out/o.mtl");
    for line in [
        "newmtl o",
        "map_Pr o_roughness.png",
        "map_Pm o_metallic.png",
        "Pc 0.25",
        "norm o_normal.png",
        "disp o_height.exr",
    ] {
        assert!(library.lines().any(|has| has == line), "{line} is not in\n{library}");
    }
    let pictures = library.lines().filter_map(|line| line.split_once(' ')).filter(|(_, file)| file.starts_with("o_"));
    assert_eq!(pictures.map(|(_, file)| files(&desk, "out").contains(file)).collect::<Vec<_>>(), [true; 5]);
    let mesh = text(&desk, "out/o.obj");
    let count = |word: &str| mesh.lines().filter(|line| line.split(' ').next() == Some(word)).count();
    // Corners are shared: each position, normal and texture coordinate is listed once.
    assert_eq!((count("v"), count("vn"), count("f"), count("o")), (8, 6, 12, 1));
    assert!(mesh.contains("mtllib o.mtl\n") && mesh.contains("usemtl o\n"), "{mesh}");
    let heights = mesh.lines().filter_map(|line| line.strip_prefix("v ")?.split(' ').nth(1)?.parse::<f32>().ok());
    assert_eq!(heights.fold([0.0, 0.0], |[low, high]: [f32; 2], y| [low.min(y), high.max(y)]), [-500.0, 500.0]);
    // A canvas that does not tile shows once on the square metre.
    let desk = self::desk("X", "{ \"p\": Obj(material: \"skin\", mesh: Plane), \"v\": \"skin\" }");
    desk.shibo("render a.ron -o out").expect(0);
    assert!(text(&desk, "out/p.mtl").contains("norm -clamp on p_normal.png"));
    desk.shibo("render a.ron -o as --as obj --output v").expect(0);
    assert!(files(&desk, "as").contains("v.obj") && text(&desk, "as/v.obj").contains("vt 16.666666 1\n"));
    desk.write("b.ron", GRAPH.replace("TILE", "X").replace("OUTPUTS", "{ \"o\": Obj(material: \"height\") }"));
    let told = desk.shibo("check b.ron").expect(1).stderr;
    assert!(told.contains("`Obj` takes a material; `height` is Gray"), "{told}");
}

/// The file contains the original mesh, with the coordinates of its atlas.
#[test]
fn an_obj_is_read_back_as_the_same_mesh() {
    let desk = Desk::new();
    let graph = |mesh: &str, output: &str| {
        format!(
            "(canvas: (size_mm: 60, resolution: 32, tile: None), nodes: {{ \"m\": {mesh}, \"a\": MeshAtlas(mesh: \"m\"),
              \"n\": BakeNormal(atlas: \"a\"), \"s\": Material(base_color: \"n\") }}, outputs: {{ {output} }})"
        )
    };
    desk.write("a.ron", graph("MeshShape(shape: Torus, segments: 24)", "\"t\": Obj(material: \"s\", mesh: \"a\")"));
    desk.shibo("render a.ron -o out").expect(0);
    assert_eq!(files(&desk, "out").into_iter().collect::<Vec<_>>(), ["t.mtl", "t.obj", "t_base_color.png"]);
    desk.write("b.ron", graph("LoadMesh(path: \"out/t.obj\")", "\"n\": \"n\""));
    let dumped = |graph: &str, node: &str| desk.shibo(&format!("dump {graph} {node}")).expect(0).json();
    let (first, second) = (dumped("a.ron", "m"), dumped("b.ron", "m"));
    for list in ["positions", "triangles", "uvs", "normals"] {
        let count = |json: &serde_json::Value| json[list].as_array().map(Vec::len);
        assert!(count(&second).is_some_and(|count| count > 100), "{list}");
        if list != "normals" {
            assert_eq!(count(&first), count(&second), "{list}");
        }
    }
    let numbers = |json: &serde_json::Value| {
        let mut open = vec![json.clone()];
        let mut all = Vec::new();
        while let Some(json) = open.pop() {
            match json {
                serde_json::Value::Array(items) => open.extend(items),
                json => all.extend(json.as_f64()),
            }
        }
        all
    };
    let close = |list: &str, from: &serde_json::Value, to: &serde_json::Value, by: f64| {
        let far = numbers(from).iter().zip(numbers(to)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(far <= by, "{list}: {far}");
    };
    close("area", &first["area"], &second["area"], 1e-2);
    // Triangles keep their order and their coordinates.
    close("uvs", &dumped("a.ron", "a")["uvs"], &dumped("b.ron", "a")["uvs"], 1e-7);
    assert_eq!(
        dumped("a.ron", "a")["charts"].as_array().map(Vec::len),
        dumped("b.ron", "a")["charts"].as_array().map(Vec::len)
    );
}
