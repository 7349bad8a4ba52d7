//! Subdivides meshes to shorter edges; the shape stays the same.
use crate::ground::number::index_u32;
use glam::{Vec2, Vec3};
use shibo_value::Mesh;
use std::collections::HashMap;

/// The error if more triangles are needed than allowed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("this needs at least {0} triangles")]
pub struct TooMany(pub usize);

/// Middle vertices of split edges, by the vertices at their ends.
type Middles = HashMap<[u32; 2], u32>;

/// A corner of a triangle, with its attributes.
#[derive(Clone, Copy)]
struct Corner {
    vertex: u32,
    uv: Vec2,
    normal: Vec3,
}

/// Splits edges at their middles, repeatedly, until none is longer than `edge` mm. Shape, UVs, parts and polygons do
/// not change. O(triangles of the result).
///
/// # Errors
/// Returns an error if this takes more than `most` triangles.
pub fn subdivide(mesh: &Mesh, edge: f64, most: usize) -> Result<Mesh, TooMany> {
    let mut mesh = mesh.clone();
    // Each round halves all edges that are too long.
    loop {
        let middles = middles(&mut mesh, edge);
        if middles.is_empty() {
            return Ok(mesh);
        }
        let splits = |triangle: &[u32; 3]| (0..3).filter(|k| middles.contains_key(&ends(triangle, *k))).count();
        let count = mesh.triangles.iter().map(|triangle| 1 + splits(triangle)).sum();
        if count > most {
            return Err(TooMany(count));
        }
        mesh = split(&mesh, &middles);
    }
}

/// The vertices of an edge, the lower one first.
fn ends(triangle: &[u32; 3], edge: usize) -> [u32; 2] {
    let [a, b] = [triangle[(edge + 1) % 3], triangle[(edge + 2) % 3]];
    [a.min(b), a.max(b)]
}

/// Adds the middles of all edges that are too long.
fn middles(mesh: &mut Mesh, edge: f64) -> Middles {
    let mut middles = Middles::new();
    for triangle in &mesh.triangles {
        for k in 0..3 {
            let [a, b] = ends(triangle, k);
            let [from, to] = [a, b].map(|v| mesh.positions[v as usize].as_dvec3());
            let middle = (0.5 * (from + to)).as_vec3();
            // If rounding moves a middle to an end, the edge could be split forever.
            let apart = [a, b].iter().all(|v| mesh.positions[*v as usize] != middle);
            if from.distance(to) > edge && apart && !middles.contains_key(&[a, b]) {
                middles.insert([a, b], index_u32(mesh.positions.len()));
                mesh.positions.push(middle);
            }
        }
    }
    middles
}

/// Cuts all triangles at the middles of their edges.
fn split(mesh: &Mesh, middles: &Middles) -> Mesh {
    let mut out = Mesh { positions: mesh.positions.clone(), part_names: mesh.part_names.clone(), ..Mesh::default() };
    for (n, triangle) in mesh.triangles.iter().enumerate() {
        let corner = |k: usize| Corner {
            vertex: triangle[k],
            uv: mesh.uvs.get(n).map_or(Vec2::ZERO, |uvs| uvs[k]),
            normal: mesh.normals.get(n).map_or(Vec3::ZERO, |normals| normals[k]),
        };
        let corners = [0, 1, 2].map(corner);
        let middle = |k: usize| {
            let (a, b) = (corners[(k + 1) % 3], corners[(k + 2) % 3]);
            middles.get(&ends(triangle, k)).map(|vertex| Corner {
                vertex: *vertex,
                uv: 0.5 * (a.uv + b.uv),
                normal: (a.normal + b.normal).normalize_or(a.normal),
            })
        };
        cut(corners, [0, 1, 2].map(middle), |corners| {
            out.triangles.push(corners.map(|c| c.vertex));
            if !mesh.uvs.is_empty() {
                out.uvs.push(corners.map(|c| c.uv));
            }
            if !mesh.normals.is_empty() {
                out.normals.push(corners.map(|c| c.normal));
            }
            out.parts.extend(mesh.parts.get(n));
            out.polygons.extend(mesh.polygons.get(n));
        });
    }
    out
}

/// Calls `add` with the parts of a triangle that is cut at some middles of its edges.
fn cut(c: [Corner; 3], middles: [Option<Corner>; 3], mut add: impl FnMut([Corner; 3])) {
    match middles {
        [None, None, None] => add(c),
        [Some(x), Some(y), Some(z)] => {
            [[c[0], z, y], [c[1], x, z], [c[2], y, x], [x, y, z]].into_iter().for_each(add);
        }
        _ => {
            let count = middles.iter().flatten().count();
            // Rotate so that a single middle lies on edge 0, and of two middles none does.
            let k = (0..3).find(|k| middles[*k].is_some() == (count == 1)).unwrap_or(0);
            let at = |n: usize| c[(k + n) % 3];
            let middle = |n: usize| middles[(k + n) % 3];
            match (middle(0), middle(1), middle(2)) {
                (Some(x), ..) => [[at(0), at(1), x], [at(0), x, at(2)]].into_iter().for_each(add),
                (None, Some(y), Some(z)) => {
                    [[at(0), z, y], [z, at(1), at(2)], [z, at(2), y]].into_iter().for_each(add);
                }
                _ => add(c),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::atlas::atlas;
    use crate::mesh::topology::topology;
    use crate::mesh::{samples, shapes};
    use glam::{DVec2, DVec3};
    use shibo_value::Atlas;
    use std::sync::Arc;

    #[test]
    fn shortens_edges_and_keeps_shape() {
        for mesh in [
            samples::cube(),
            shapes::cylinder(DVec3::new(60.0, 60.0, 100.0), 16),
            shapes::torus(DVec2::splat(60.0), 9.0, 12),
        ] {
            let fine = subdivide(&mesh, 5.0, 1_000_000).unwrap();
            for n in 0..fine.triangles.len() {
                let c = fine.corners(n);
                assert!((0..3).all(|k| c[k].distance(c[(k + 1) % 3]) <= 5.0));
            }
            assert!((fine.area() / mesh.area() - 1.0).abs() < 1e-5);
            let found = topology(&fine.triangles);
            assert_eq!((found.crowded, found.twisted), (0, 0));
            assert!(found.across.iter().flatten().all(|other| *other != Atlas::END), "no cracks");
            assert_eq!(fine.triangles.len(), fine.parts.len());
            let of = |mesh: &Mesh| atlas(Arc::new(mesh.clone()), &mesh.uvs, DVec2::ONE).unwrap();
            let (before, after) = (of(&mesh), of(&fine));
            assert_eq!(before.chart_count(), after.chart_count());
            assert!((before.used - after.used).abs() < 1e-6);
        }
    }

    #[test]
    fn rejects_too_many_triangles() {
        assert!(matches!(subdivide(&samples::cube(), 0.01, 10_000), Err(TooMany(n)) if n > 10_000));
        assert_eq!(subdivide(&samples::cube(), 100.0, 12).unwrap(), samples::cube());
        // An edge shorter than the resolution of numbers stops the splitting, too.
        let mut far = samples::cube();
        far.positions.iter_mut().for_each(|p| *p = *p * 1e-5 + Vec3::splat(9e6));
        assert!(subdivide(&far, 1e-6, 1_000_000).is_ok());
    }
}
