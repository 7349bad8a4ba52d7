//! Test meshes: the files of `tests/meshes`, with triangles, quads and UVs.
use glam::{Vec2, Vec3};
use shibo_value::Mesh;

/// The middle of [`cube`].
pub(crate) const CUBE_MIDDLE: Vec3 = Vec3::ZERO;

/// A cube of 60 mm with six charts, four of them turned or mirrored.
pub(crate) fn cube() -> Mesh {
    obj(include_str!("../../../tests/meshes/cube.obj"))
}

/// A plane of 64 mm in one chart.
pub(crate) fn plane_one() -> Mesh {
    obj(include_str!("../../../tests/meshes/plane_one.obj"))
}

/// The same plane in five charts, moved and turned.
pub(crate) fn plane_cut() -> Mesh {
    obj(include_str!("../../../tests/meshes/plane_cut.obj"))
}

/// The same plane in three charts, turned by any angle and scaled.
pub(crate) fn plane_wild() -> Mesh {
    obj(include_str!("../../../tests/meshes/plane_wild.obj"))
}

/// A sphere of radius 30 mm in 20 charts.
pub(crate) fn sphere() -> Mesh {
    obj(include_str!("../../../tests/meshes/sphere.obj"))
}

/// Reads the subset of OBJ that the files use.
fn obj(text: &str) -> Mesh {
    let mut mesh = Mesh { part_names: vec!["mesh".into()], ..Mesh::default() };
    let mut uvs: Vec<Vec2> = Vec::new();
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let number = |n: usize| words[n].parse::<f32>().unwrap();
        match words.first() {
            Some(&"v") => mesh.positions.push(Vec3::new(number(1), number(2), number(3))),
            Some(&"vt") => uvs.push(Vec2::new(number(1), 1.0 - number(2))),
            Some(&"f") => {
                let corner = |word: &&str| {
                    let mut numbers = word.split('/').map(|n| n.parse::<u32>().unwrap());
                    let mut next = || numbers.next().unwrap() - 1;
                    (next(), uvs[next() as usize])
                };
                let corners: Vec<_> = words[1..].iter().map(corner).collect();
                for k in 2..corners.len() {
                    let three = [corners[0], corners[k - 1], corners[k]];
                    mesh.triangles.push(three.map(|c| c.0));
                    mesh.uvs.push(three.map(|c| c.1));
                    mesh.parts.push(0);
                }
            }
            _ => {}
        }
    }
    mesh
}
