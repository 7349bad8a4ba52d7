//! Ray casting against a surface: occlusion of light, and the thickness of a body.
//!
//! The bounding boxes use the crate `obvhs`, which no other file uses. The ray-triangle test is done here, so that no
//! ray slips through between two triangles that share an edge (Woop, Benthin & Wald, 2013). Cost: about 0.4 µs per ray.
use glam::{DVec3, Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::leaf_collapser::collapse;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::PlocBuilder;
use obvhs::ray::Ray;
use obvhs::{Boundable, BvhBuildParams};
use shibo_value::Mesh;

/// The triangles of a surface in a bounding volume hierarchy.
pub struct Rays {
    boxes: Bvh2,
    /// Corners of the triangles, in the order of the boxes.
    triangles: Vec<[Vec3; 3]>,
}

/// The bounding box of a triangle, slightly enlarged, so that rounding never loses a ray.
struct Wide(Aabb);

impl Boundable for Wide {
    fn aabb(&self) -> Aabb {
        self.0
    }
}

/// A ray with the axes of a shear that aligns it with the last of them.
struct Sheared {
    axes: [usize; 3],
    shear: Vec3,
    origin: Vec3,
}

impl Sheared {
    fn new(origin: Vec3, direction: Vec3) -> Self {
        let size = direction.abs();
        let z = if size.x > size.y && size.x > size.z {
            0
        } else if size.y > size.z {
            1
        } else {
            2
        };
        let (mut x, mut y) = ((z + 1) % 3, (z + 2) % 3);
        if direction[z] < 0.0 {
            std::mem::swap(&mut x, &mut y);
        }
        let shear = Vec3::new(direction[x] / direction[z], direction[y] / direction[z], 1.0 / direction[z]);
        Self { axes: [x, y, z], shear, origin }
    }

    /// Distance along the ray to a triangle; infinity if the ray misses it.
    fn meet(&self, triangle: &[Vec3; 3]) -> f32 {
        let [x, y, z] = self.axes;
        let at = triangle.map(|p| {
            let p = p - self.origin;
            [p[x] - self.shear.x * p[z], p[y] - self.shear.y * p[z], self.shear.z * p[z]]
        });
        let [a, b, c] = at;
        let side = |p: [f32; 3], q: [f32; 3]| f64::from(p[0]) * f64::from(q[1]) - f64::from(p[1]) * f64::from(q[0]);
        let (u, v, w) = (side(c, b), side(a, c), side(b, a));
        let det = u + v + w;
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) || det == 0.0 {
            return f32::INFINITY;
        }
        #[expect(clippy::cast_possible_truncation, reason = "computed from single precision")]
        let t = ((u * f64::from(a[2]) + v * f64::from(b[2]) + w * f64::from(c[2])) / det) as f32;
        if t > 0.0 { t } else { f32::INFINITY }
    }
}

/// The steps of `obvhs::bvh2::builder::build_bvh2`, which reads a clock. WebAssembly has none.
fn hierarchy(boxes: &[Wide]) -> Bvh2 {
    let params = BvhBuildParams::medium_build();
    let count = u32::try_from(boxes.len()).unwrap_or(u32::MAX);
    let mut made = PlocBuilder::with_capacity(boxes.len()).build(
        params.ploc_search_distance,
        boxes,
        (0..count).collect(),
        params.sort_precision,
        params.search_depth_threshold,
    );
    let mut optimizer = ReinsertionOptimizer::default();
    optimizer.run(&mut made, params.reinsertion_batch_ratio, None);
    collapse(&mut made, params.max_prims_per_leaf.clamp(1, 255), params.collapse_traversal_cost);
    let later = params.reinsertion_batch_ratio * params.post_collapse_reinsertion_batch_ratio_multiplier;
    optimizer.run(&mut made, later, None);
    made
}

impl Rays {
    /// Builds the hierarchy of a mesh. O(n log n).
    pub fn new(mesh: &Mesh) -> Self {
        let [low, high] = mesh.bounds();
        #[expect(clippy::cast_possible_truncation, reason = "a little more or less")]
        let room = Vec3A::splat(1e-6 * (high - low).max_element() as f32);
        let all: Vec<[Vec3; 3]> =
            mesh.triangles.iter().map(|corners| corners.map(|v| mesh.positions[v as usize])).collect();
        let wide = |[a, b, c]: &[Vec3; 3]| {
            Wide(Aabb::new(Vec3A::from(a.min(*b).min(*c)) - room, Vec3A::from(a.max(*b).max(*c)) + room))
        };
        let boxes: Vec<Wide> = all.iter().map(wide).collect();
        let boxes = hierarchy(&boxes);
        let triangles = boxes.primitive_indices.iter().map(|n| all[*n as usize]).collect();
        Self { boxes, triangles }
    }

    /// Returns whether a ray meets nothing within a distance; `direction` has length 1.
    pub fn escapes(&self, origin: Vec3, direction: Vec3, distance: f32) -> bool {
        let sheared = Sheared::new(origin, direction);
        let ray = Ray::new(origin.into(), direction.into(), 0.0, distance);
        self.boxes.ray_traverse_miss(ray, |_, n| sheared.meet(&self.triangles[n]))
    }

    /// Distance along a ray to the surface, at most `most`.
    pub fn reach(&self, origin: Vec3, direction: Vec3, most: f32) -> f32 {
        self.nearest(origin, direction, most).map_or(most, |(distance, _)| distance)
    }

    /// The nearest triangle that a ray meets before `most`: the distance along the ray, and the index in the mesh.
    pub fn nearest(&self, origin: Vec3, direction: Vec3, most: f32) -> Option<(f32, usize)> {
        let sheared = Sheared::new(origin, direction);
        let ray = Ray::new(origin.into(), direction.into(), 0.0, most);
        let mut nearest: Option<(f32, usize)> = None;
        let mut hit = obvhs::ray::RayHit::none();
        self.boxes.ray_traverse(ray, &mut hit, |_, n| {
            let t = sheared.meet(&self.triangles[n]);
            if t < nearest.map_or(most, |(nearest, _)| nearest) {
                nearest = Some((t, self.boxes.primitive_indices[n] as usize));
            }
            t
        });
        nearest
    }
}

/// Directions around z, the same for each point, with a density proportional to the cosine, up to the angle whose
/// squared sine is `spread`. From the Hammersley set.
pub fn directions(count: u32, spread: f64) -> Vec<Vec3> {
    let one = |i: u32| {
        let (share, angle) = ((f64::from(i) + 0.5) / f64::from(count), f64::from(i.reverse_bits()) / 4_294_967_296.0);
        let (sin2, angle) = (share * spread, std::f64::consts::TAU * angle);
        let sin = sin2.sqrt();
        DVec3::new(sin * libm::cos(angle), sin * libm::sin(angle), (1.0 - sin2).sqrt()).as_vec3()
    };
    (0..count).map(one).collect()
}

/// Rotates directions so that their z axis becomes `normal`; depends on the normal alone (Duff et al., 2017).
pub fn turned(normal: Vec3) -> impl Fn(Vec3) -> Vec3 {
    let n = normal;
    let sign = 1.0f32.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    let x = Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x);
    let y = Vec3::new(b, sign + n.y * n.y * a, -n.y);
    move |d| x * d.x + y * d.y + n * d.z
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::hash::Hash;
    use crate::mesh::shapes;

    fn unit(hash: Hash, n: u64) -> Vec3 {
        let r = |k: u64| 2.0 * hash.unit_f32(4 * n + k) - 1.0;
        Vec3::new(r(0), r(1), r(2)).normalize_or(Vec3::X)
    }

    /// From inside a closed body no ray escapes, not even through edges and corners.
    #[test]
    fn lets_no_ray_slip_through_edges() {
        let size = DVec3::splat(60.0);
        for mesh in [shapes::cube(size, 64), shapes::sphere(size, 64), shapes::cylinder(size, 64)] {
            let rays = Rays::new(&mesh);
            for n in 0..20_000 {
                assert!(!rays.escapes(Vec3::ZERO, unit(Hash::new(5), n), 1e6));
            }
            for p in &mesh.positions {
                assert!(!rays.escapes(Vec3::ZERO, p.normalize(), 1e6), "{p}");
                assert!(rays.escapes(*p * 1.001, p.normalize(), 1e6), "{p}");
            }
            // Middles of edges.
            for triangle in &mesh.triangles {
                let [a, b, _] = triangle.map(|v| mesh.positions[v as usize]);
                assert!(!rays.escapes(Vec3::ZERO, (a + b).normalize(), 1e6));
            }
        }
    }

    #[test]
    fn returns_lengths_of_rays() {
        let rays = Rays::new(&shapes::cube(DVec3::splat(60.0), 32));
        for n in 0..1000 {
            let d = unit(Hash::new(9), n);
            let want = 30.0 / d.abs().max_element();
            assert!((rays.reach(Vec3::ZERO, d, 1e6) - want).abs() < 1e-3);
            assert_eq!(rays.reach(Vec3::ZERO, d, 20.0), 20.0);
            assert!(rays.escapes(Vec3::ZERO, d, 29.9) && rays.escapes(Vec3::splat(40.0), Vec3::ONE.normalize(), 1e6));
        }
    }

    #[test]
    fn directions_are_spread_evenly() {
        let all = directions(256, 1.0);
        let mean: Vec3 = all.iter().sum::<Vec3>() / 256.0;
        // The mean of a cosine-weighted direction is (0, 0, 2/3).
        assert!(mean.distance(Vec3::Z * 2.0 / 3.0) < 0.01, "{mean}");
        for n in 0..200 {
            let normal = unit(Hash::new(2), n);
            let turn = turned(normal);
            assert!(turn(Vec3::Z).distance(normal) < 1e-6 && turn(Vec3::X).dot(normal).abs() < 1e-5);
            assert!((turn(Vec3::X).cross(turn(Vec3::Y)) - normal).length() < 1e-5);
        }
        let narrow = directions(64, 0.25);
        assert!(narrow.iter().all(|d| d.z >= (0.75f32).sqrt() - 1e-6));
    }
}
