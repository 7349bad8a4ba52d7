//! Meshes and atlases for tests.
use super::samples;
use glam::{DVec2, DVec3, Vec2, Vec3};
use shibo_value::{Atlas, Mesh};
use std::sync::Arc;

/// A mesh of one part.
pub(crate) fn mesh(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Mesh {
    let parts = vec![0; triangles.len()];
    Mesh { positions, triangles, parts, part_names: vec![String::new()], ..Mesh::default() }
}

/// The atlas of a mesh with these UVs, on a canvas of 100 mm.
pub(crate) fn atlas(mesh: Mesh, uvs: &[[Vec2; 3]]) -> Atlas {
    super::atlas::atlas(Arc::new(mesh), uvs, DVec2::splat(100.0)).expect("an atlas")
}

fn own(mesh: Mesh) -> Atlas {
    let uvs = mesh.uvs.clone();
    atlas(mesh, &uvs)
}

/// The plane of 64 mm with the UVs of one of the test meshes.
pub(crate) fn plane(name: &str) -> Atlas {
    own(match name {
        "plane_cut" => samples::plane_cut(),
        "plane_wild" => samples::plane_wild(),
        _ => samples::plane_one(),
    })
}

/// A cube of 60 mm, a chart for each face.
pub(crate) fn cube() -> Atlas {
    own(samples::cube())
}

/// A ball of 30 mm in 20 charts.
pub(crate) fn sphere() -> Atlas {
    own(samples::sphere())
}

/// A torus of n × m quads, R 40 mm and r 15 mm, z up; one chart that meets itself on all four sides.
pub(crate) fn torus(n: u32, m: u32) -> Atlas {
    let turn = |k: u32, n: u32| std::f64::consts::TAU * f64::from(k) / f64::from(n);
    let (mut positions, mut triangles, mut uvs) = (Vec::new(), Vec::new(), Vec::new());
    for (i, j) in (0..n).flat_map(|i| (0..m).map(move |j| (i, j))) {
        let ((sa, ca), (sb, cb)) = (libm::sincos(turn(i, n)), libm::sincos(turn(j, m)));
        positions.push(DVec3::new((40.0 + 15.0 * cb) * ca, (40.0 + 15.0 * cb) * sa, 15.0 * sb).as_vec3());
        let at = |i: u32, j: u32| (i % n) * m + j % m;
        let snap = |v: f64| (v * 16_777_216.0).round() / 16_777_216.0;
        let uv = |i: u32, j: u32| {
            let share = |k: u32, n: u32| f64::from(k) / f64::from(n);
            DVec2::new(snap(0.05 + 0.9 * share(i, n)), snap(0.95 - 0.5 * share(j, m))).as_vec2()
        };
        let (a, b, c, d) = ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1));
        for t in [[a, b, c], [a, c, d]] {
            triangles.push(t.map(|(i, j)| at(i, j)));
            uvs.push(t.map(|(i, j)| uv(i, j)));
        }
    }
    atlas(mesh(positions, triangles), &uvs)
}

/// Two squares of 8 mm at a right angle: the mesh of the indirection test vectors.
pub(crate) fn strip() -> Mesh {
    let v = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    let places = vec![v(0., 0., 0.), v(8., 0., 0.), v(8., 8., 0.), v(0., 8., 0.), v(8., 0., 8.), v(8., 8., 8.)];
    mesh(places, vec![[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]])
}
