//! The mean curvature of a surface at its vertices.
//!
//! `H = ½·|Σ ½(cot α + cot β)(x_j - x_i)|/A` with A the mixed Voronoi area of the vertex; positive on convex parts.
//! Diffusion along the surface removes the noise of the triangulation. Cost: O(n · rounds), a few dozen rounds.
use glam::DVec3;
use shibo_value::Mesh;

/// Upper bound of cotangents: angles count as at least about 0.06°.
const STEEPEST: f64 = 1e3;
/// Maximum number of rounds of the solver, and its target error.
const ROUNDS: usize = 400;
const ERROR: f64 = 1e-7;

/// The edge weights and areas of a mesh.
struct Weights {
    /// Offset of each vertex' entries in `to`.
    starts: Vec<u32>,
    /// Neighbours with ½ cot of one opposite angle; most appear twice.
    to: Vec<(u32, f64)>,
    areas: Vec<f64>,
}

impl Weights {
    fn new(mesh: &Mesh) -> Self {
        let n = mesh.positions.len();
        let mut starts = vec![0u32; n + 1];
        // Each triangle has two edges at each of its corners.
        for v in mesh.triangles.iter().flatten() {
            starts[*v as usize + 1] += 2;
        }
        for v in 0..n {
            starts[v + 1] += starts[v];
        }
        let mut next = starts.clone();
        let mut to = vec![(0, 0.0); 6 * mesh.triangles.len()];
        let mut areas = vec![0.0; n];
        for (number, triangle) in mesh.triangles.iter().enumerate() {
            let corners = mesh.corners(number);
            let cot = [0, 1, 2].map(|k| cotangent(corners, k));
            for k in 0..3 {
                let (a, b) = (triangle[(k + 1) % 3], triangle[(k + 2) % 3]);
                for (from, other) in [(a, b), (b, a)] {
                    let at = &mut next[from as usize];
                    to[*at as usize] = (other, 0.5 * cot[k]);
                    *at += 1;
                }
                areas[triangle[k] as usize] += share(corners, cot, k);
            }
        }
        Self { starts, to, areas }
    }

    fn around(&self, v: usize) -> &[(u32, f64)] {
        &self.to[self.starts[v] as usize..self.starts[v + 1] as usize]
    }
}

/// The cotangent of the angle at a corner.
fn cotangent(corners: [DVec3; 3], k: usize) -> f64 {
    let (a, b) = (corners[(k + 1) % 3] - corners[k], corners[(k + 2) % 3] - corners[k]);
    let across = a.cross(b).length();
    if across > 0.0 { (a.dot(b) / across).clamp(-STEEPEST, STEEPEST) } else { 0.0 }
}

/// The part of a triangle's area that belongs to a corner: its Voronoi region, or fixed shares if an angle is obtuse.
fn share(corners: [DVec3; 3], cot: [f64; 3], k: usize) -> f64 {
    let (a, b) = (corners[(k + 1) % 3] - corners[k], corners[(k + 2) % 3] - corners[k]);
    let area = 0.5 * a.cross(b).length();
    match cot.iter().position(|cot| *cot < 0.0) {
        Some(obtuse) if obtuse == k => 0.5 * area,
        Some(_) => 0.25 * area,
        None => (a.length_squared() * cot[(k + 2) % 3] + b.length_squared() * cot[(k + 1) % 3]) / 8.0,
    }
}

/// Mean curvature at each vertex in 1/mm, smoothed over about `radius` mm; `normals` are those of the vertices.
pub fn mean_curvature(mesh: &Mesh, normals: &[glam::Vec3], radius: f64) -> Vec<f32> {
    let weights = Weights::new(mesh);
    let sharp = |v: usize| {
        let at = mesh.positions[v].as_dvec3();
        let way = |(to, w): &(u32, f64)| *w * (mesh.positions[*to as usize].as_dvec3() - at);
        let sum: DVec3 = weights.around(v).iter().map(way).sum();
        let area = weights.areas[v];
        if area > 0.0 { -sum.dot(normals[v].as_dvec3()) / (2.0 * area) } else { 0.0 }
    };
    let start: Vec<f64> = (0..mesh.positions.len()).map(sharp).collect();
    #[expect(clippy::cast_possible_truncation, reason = "fields are single precision")]
    diffused(&weights, &start, 0.5 * radius * radius).into_iter().map(|h| h as f32).collect()
}

/// Diffuses values for a time: solves (A + time·L)·h = A·start by conjugate gradients.
fn diffused(weights: &Weights, start: &[f64], time: f64) -> Vec<f64> {
    let n = start.len();
    let positive = |w: f64| w.max(1e-6);
    let apply = |x: &[f64], v: usize| {
        let flow: f64 = weights.around(v).iter().map(|(to, w)| positive(*w) * (x[v] - x[*to as usize])).sum();
        weights.areas[v] * x[v] + time * flow
    };
    let diagonal: Vec<f64> = (0..n)
        .map(|v| weights.areas[v] + time * weights.around(v).iter().map(|(_, w)| positive(*w)).sum::<f64>())
        .map(|d| if d > 0.0 { d } else { 1.0 })
        .collect();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut x = start.to_vec();
    let mut rest: Vec<f64> = (0..n).map(|v| weights.areas[v] * start[v] - apply(&x, v)).collect();
    let mut eased: Vec<f64> = rest.iter().zip(&diagonal).map(|(r, d)| r / d).collect();
    let mut way = eased.clone();
    let mut size = dot(&rest, &eased);
    let goal = size * ERROR * ERROR;
    for _ in 0..ROUNDS {
        if size <= goal || size <= 0.0 {
            break;
        }
        let moved: Vec<f64> = (0..n).map(|v| apply(&way, v)).collect();
        let step = size / dot(&way, &moved);
        if !step.is_finite() {
            break;
        }
        x.iter_mut().zip(&way).for_each(|(x, w)| *x += step * w);
        rest.iter_mut().zip(&moved).for_each(|(r, m)| *r -= step * m);
        eased = rest.iter().zip(&diagonal).map(|(r, d)| r / d).collect();
        let next = dot(&rest, &eased);
        way = eased.iter().zip(&way).map(|(e, w)| e + next / size * w).collect();
        size = next;
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;
    use crate::mesh::topology::smooth_normals;

    fn of(mesh: &Mesh, radius: f64) -> Vec<f32> {
        mean_curvature(mesh, &smooth_normals(mesh), radius)
    }

    /// 1/r on a sphere, 1/2r on a cylinder, and (R + 2r cos)/(2r(R + r cos)) on a torus.
    #[test]
    fn curvatures_are_those_of_the_shapes() {
        let size = DVec3::splat(60.0);
        let sphere = shapes::sphere(size, 128);
        for h in of(&sphere, 6.0) {
            assert!((f64::from(h) * 30.0 - 1.0).abs() < 0.03, "{h}");
        }
        let cylinder = shapes::cylinder(DVec3::new(60.0, 60.0, 120.0), 96);
        for (p, h) in cylinder.positions.iter().zip(of(&cylinder, 1.0)).filter(|(p, _)| p.z.abs() < 40.0) {
            assert!((f64::from(h) * 60.0 - 1.0).abs() < 0.03, "{p} {h}");
        }
        let torus = shapes::torus(size.truncate(), 15.0, 128);
        for (p, h) in torus.positions.iter().zip(of(&torus, 0.5)) {
            let across = f64::from(p.truncate().length());
            let cos = (across - 30.0) / 15.0;
            let want = (30.0 + 30.0 * cos) / (30.0 * (30.0 + 15.0 * cos));
            assert!((f64::from(h) - want).abs() < 0.03 * want.abs().max(1.0 / 30.0), "{h} {want}");
        }
    }

    #[test]
    fn gives_zero_on_flat_sheets_and_negative_in_hollows() {
        let plane = shapes::plane(glam::DVec2::splat(40.0), 32);
        assert!(of(&plane, 2.0).iter().all(|h| h.abs() < 1e-6));
        let mut hollow = shapes::sphere(DVec3::splat(60.0), 32);
        hollow.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        assert!(of(&hollow, 3.0).iter().all(|h| *h < 0.0));
    }

    /// Diffusion keeps the mean and makes differences smaller.
    #[test]
    fn a_larger_radius_is_smoother() {
        let cube = shapes::cube(DVec3::splat(60.0), 64);
        let span = |values: &[f32]| {
            values.iter().fold(f32::MIN, |a, b| a.max(*b)) - values.iter().fold(f32::MAX, |a, b| a.min(*b))
        };
        let [fine, soft, round] = [0.01, 15.0, 1000.0].map(|radius| of(&cube, radius));
        assert!(span(&fine) > 2.0 * span(&soft) && span(&round) < 0.05 * span(&soft));
    }
}
