//! Meshes and atlases for tests.
use super::walk::parameterisation;
use glam::{DVec2, DVec3, Vec2, Vec3};
use shibo_engine::value::{Atlas, Bins, Mesh};
use std::collections::HashMap;
use std::sync::Arc;

/// The mesh of an OBJ text of triangles, and its UVs, v down.
pub(crate) fn read(text: &str) -> (Mesh, Vec<[Vec2; 3]>) {
    let (mut places, mut points) = (Vec::new(), Vec::new());
    let (mut triangles, mut uvs) = (Vec::new(), Vec::new());
    let number = |word: &str| word.parse::<f32>().expect("a number");
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.first() {
            Some(&"v") => places.push(Vec3::new(number(words[1]), number(words[2]), number(words[3]))),
            Some(&"vt") => {
                let snap = |v: f64| (v * 16_777_216.0).round() / 16_777_216.0;
                let uv = DVec2::new(snap(f64::from(number(words[1]))), snap(1.0 - f64::from(number(words[2]))));
                points.push(uv.as_vec2());
            }
            Some(&"f") => {
                let corner = |word: &str| -> (u32, Vec2) {
                    let mut parts = word.split('/').map(|part| part.parse::<usize>().unwrap_or(1) - 1);
                    let place = u32::try_from(parts.next().expect("a vertex")).expect("few");
                    (place, parts.next().and_then(|n| points.get(n)).copied().unwrap_or_default())
                };
                let corners = [corner(words[1]), corner(words[2]), corner(words[3])];
                triangles.push(corners.map(|c| c.0));
                uvs.push(corners.map(|c| c.1));
            }
            _ => {}
        }
    }
    (mesh(places, triangles), uvs)
}

/// A mesh of one part.
pub(crate) fn mesh(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Mesh {
    let parts = vec![0; triangles.len()];
    Mesh { positions, triangles, parts, part_names: vec![String::new()], ..Mesh::default() }
}

/// The atlas of a mesh with these UVs, on a canvas of 100 mm.
pub(crate) fn atlas(mesh: Mesh, uvs: Vec<[Vec2; 3]>) -> Atlas {
    let n = mesh.triangles.len();
    let mut edges: HashMap<[u32; 2], Vec<(usize, usize)>> = HashMap::new();
    let key = |triangle: usize, k: usize| {
        let [a, b] = [1, 2].map(|d| mesh.triangles[triangle][(k + d) % 3]);
        [a.min(b), a.max(b)]
    };
    (0..3 * n).for_each(|e| edges.entry(key(e / 3, e % 3)).or_default().push((e / 3, e % 3)));
    let mut across = vec![[Atlas::END; 3]; n];
    let mut inner = vec![0u8; n];
    let mut charts: Vec<usize> = (0..n).collect();
    for e in 0..3 * n {
        let (triangle, k) = (e / 3, e % 3);
        let others: Vec<_> = edges[&key(triangle, k)].iter().filter(|other| **other != (triangle, k)).collect();
        let [&(next, beyond)] = others[..] else { continue };
        across[triangle][k] = u32::try_from(4 * next + beyond).expect("few");
        let ends = |t: usize, k: usize| [uvs[t][(k + 1) % 3], uvs[t][(k + 2) % 3]];
        let [a, b] = ends(next, beyond);
        if ends(triangle, k) == [b, a] {
            inner[triangle] |= 1 << k;
            let (low, high) = (charts[triangle].min(charts[next]), charts[triangle].max(charts[next]));
            charts.iter_mut().filter(|chart| **chart == high).for_each(|chart| *chart = low);
        }
    }
    let mut names = charts.clone();
    names.sort_unstable();
    names.dedup();
    let chart = |c: &usize| u16::try_from(names.binary_search(c).expect("listed")).expect("few");
    let charts = charts.iter().map(chart).collect();
    let jacobian = |t: usize| parameterisation(mesh.corners(t), uvs[t].map(|uv| uv.as_dvec2())).map(|v| v.as_vec3());
    let used = uvs.iter().map(|[a, b, c]| f64::from((*b - *a).perp_dot(*c - *a)).abs() / 2.0).sum();
    Atlas {
        charts,
        across,
        inner,
        smooth: smooth(&mesh),
        jacobians: (0..n).map(jacobian).collect(),
        bins: Bins::default(),
        area: mesh.area(),
        used,
        size_mm: DVec2::splat(100.0),
        mesh: Arc::new(mesh),
        uvs,
    }
}

fn smooth(mesh: &Mesh) -> Vec<Vec3> {
    let mut sums = vec![DVec3::ZERO; mesh.positions.len()];
    for (t, triangle) in mesh.triangles.iter().enumerate() {
        let corners = mesh.corners(t);
        for k in 0..3 {
            let angle = (corners[(k + 1) % 3] - corners[k]).angle_between(corners[(k + 2) % 3] - corners[k]);
            sums[triangle[k] as usize] += mesh.cross(t).normalize_or_zero() * angle;
        }
    }
    sums.iter().map(|n| n.normalize_or_zero().as_vec3()).collect()
}

/// The plane of 64 mm with the UVs of one of the test meshes.
pub(crate) fn plane(name: &str) -> Atlas {
    let (mesh, uvs) = read(match name {
        "plane_cut" => include_str!("../../../tests/meshes/plane_cut.obj"),
        "plane_wild" => include_str!("../../../tests/meshes/plane_wild.obj"),
        _ => include_str!("../../../tests/meshes/plane_one.obj"),
    });
    atlas(mesh, uvs)
}

/// A cube of 60 mm, a chart for each face.
pub(crate) fn cube() -> Atlas {
    let (mesh, uvs) = read(include_str!("../../../tests/meshes/cube.obj"));
    atlas(mesh, uvs)
}

/// A ball of 30 mm in 20 charts.
pub(crate) fn sphere() -> Atlas {
    let (mesh, uvs) = read(include_str!("../../../tests/meshes/sphere.obj"));
    atlas(mesh, uvs)
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
    atlas(mesh(positions, triangles), uvs)
}

/// Two squares of 8 mm at a right angle: the mesh of the vectors for indirection.
pub(crate) fn strip() -> Mesh {
    let v = |x: f32, y: f32, z: f32| Vec3::new(x, y, z);
    let places = vec![v(0., 0., 0.), v(8., 0., 0.), v(8., 8., 0.), v(0., 8., 0.), v(8., 0., 8.), v(8., 8., 8.)];
    mesh(places, vec![[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]])
}
