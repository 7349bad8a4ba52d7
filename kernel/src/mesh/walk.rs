//! Straight paths over a surface, drawn in its atlas.
//!
//! Within a chart a path is straight in the atlas. At a border it continues in the chart beyond: the two triangles are
//! unfolded at their shared edge, and the path goes straight on. Cost: O(triangles crossed).
use super::atlas::jacobian;
use glam::{DMat2, DVec2, DVec3};
use shibo_value::Atlas;

/// Distance outside a triangle at which a point still counts as inside, in barycentric coordinates.
pub const TOLERANCE: f64 = 1e-9;

/// Maximum number of edges that a path may cross.
pub(super) const MOST: usize = 4096;

/// A point on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// The triangle.
    pub triangle: usize,
    /// The point of the atlas; it may lie outside of the triangle, whose plane is then continued.
    pub uv: DVec2,
}

/// End of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrival {
    /// The end point.
    pub spot: SurfacePoint,
    /// True if a border of a chart was crossed.
    pub crossed: bool,
}

/// The corners of a triangle in the atlas.
pub fn corners(atlas: &Atlas, triangle: usize) -> [DVec2; 3] {
    atlas.uvs[triangle].map(|uv| uv.as_dvec2())
}

/// The barycentric coordinates of a point; not finite if the triangle has no area in the atlas.
#[inline]
pub fn barycentric([a, b, c]: [DVec2; 3], uv: DVec2) -> [f64; 3] {
    let (e, f) = (b - a, c - a);
    let scale = 1.0 / e.perp_dot(f);
    let d = uv - a;
    let (v, w) = (d.perp_dot(f) * scale, e.perp_dot(d) * scale);
    [1.0 - v - w, v, w]
}

/// The vector of the atlas that leads to `v` on the surface; a vector out of the plane is projected.
#[inline]
pub fn flatten([u, v]: [DVec3; 2], to: DVec3) -> DVec2 {
    let (uu, uv, vv) = (u.dot(u), u.dot(v), v.dot(v));
    let scale = 1.0 / (uu * vv - uv * uv);
    let (a, b) = (u.dot(to), v.dot(to));
    DVec2::new((a * vv - b * uv) * scale, (b * uu - a * uv) * scale)
}

/// Moves by `d` from a point. `None` if the surface ends before.
pub fn walk(atlas: &Atlas, from: SurfacePoint, d: DVec2) -> Option<Arrival> {
    go(atlas, from, d, |_| ())
}

/// Like [`walk`], and returns how vectors of the atlas are rotated along the path.
pub fn walk_turning(atlas: &Atlas, from: SurfacePoint, d: DVec2) -> Option<(Arrival, DMat2)> {
    let mut turn = DMat2::IDENTITY;
    let arrival = go(atlas, from, d, |carry| turn = carry * turn)?;
    Some((arrival, turn))
}

/// The edge by which a path leaves a triangle, and the share of the path inside. `start` and `end` are the barycentric
/// coordinates of its ends; `came` is the edge of its entry.
pub(super) fn exit(start: [f64; 3], end: [f64; 3], came: usize) -> Option<(usize, f64)> {
    let mut leaves: Option<(usize, f64)> = None;
    for k in (0..3).filter(|k| *k != came && end[*k] < -TOLERANCE && end[*k] < start[*k]) {
        let inside = start[k].max(0.0);
        let share = inside / (inside - end[k]);
        if leaves.is_none_or(|(_, least)| share < least) {
            leaves = Some((k, share));
        }
    }
    leaves
}

fn go(atlas: &Atlas, from: SurfacePoint, mut d: DVec2, mut carried: impl FnMut(DMat2)) -> Option<Arrival> {
    let SurfacePoint { mut triangle, uv: mut at } = from;
    let (mut came, mut crossed) = (3, false);
    for _ in 0..MOST {
        let corners = corners(atlas, triangle);
        let end = barycentric(corners, at + d);
        if end.iter().all(|b| *b >= -TOLERANCE) {
            return Some(Arrival { spot: SurfacePoint { triangle, uv: at + d }, crossed });
        }
        let start = barycentric(corners, at);
        let Some((edge, share)) = exit(start, end, came) else {
            // A triangle without area in the atlas has no inside.
            let found = end.iter().all(|b| b.is_finite());
            return found.then_some(Arrival { spot: SurfacePoint { triangle, uv: at + d }, crossed });
        };
        at += d * share;
        d *= 1.0 - share;
        let (next, beyond) = atlas.across(triangle, edge)?;
        if !atlas.is_inner(triangle, edge) {
            crossed = true;
            let carry = carry(atlas, (triangle, edge), (next, beyond))?;
            at = entry(atlas, (triangle, edge), (next, beyond), at);
            d = carry * d;
            carried(carry);
        }
        (triangle, came) = (next, beyond);
    }
    None
}

/// The two vertices of an edge, in the order of the triangle.
fn ends(atlas: &Atlas, (triangle, edge): (usize, usize)) -> [u32; 2] {
    let corners = atlas.mesh.triangles[triangle];
    [corners[(edge + 1) % 3], corners[(edge + 2) % 3]]
}

/// The point of an edge, in the triangle beyond it.
fn entry(atlas: &Atlas, from: (usize, usize), to: (usize, usize), at: DVec2) -> DVec2 {
    let [here, there] = [from, to].map(|(triangle, edge)| {
        let uvs = corners(atlas, triangle);
        [uvs[(edge + 1) % 3], uvs[(edge + 2) % 3]]
    });
    let along = here[1] - here[0];
    let share = ((at - here[0]).dot(along) / along.length_squared()).clamp(0.0, 1.0);
    // Neighbours list an edge in opposite order, unless one of them is flipped.
    let share = if ends(atlas, from)[0] == ends(atlas, to)[0] { share } else { 1.0 - share };
    there[0] + (there[1] - there[0]) * share
}

/// The transform of vectors of the atlas across a border: the surface is unfolded at the edge.
pub fn carry(atlas: &Atlas, from: (usize, usize), to: (usize, usize)) -> Option<DMat2> {
    let [here, there] = [from, to].map(|(triangle, _)| atlas.mesh.corners(triangle));
    let (k, edge) = (from.1, here[(from.1 + 2) % 3] - here[(from.1 + 1) % 3]);
    let along = edge.normalize_or_zero();
    // Perpendicular to the edge: out of one triangle, into the other.
    let across = |middle: DVec3| (middle - along * middle.dot(along)).normalize_or_zero();
    let out = -across(here[k] - here[(k + 1) % 3]);
    let into = across(there[to.1] - there[(to.1 + 1) % 3]);
    let [before, after] =
        [from, to].map(|(triangle, _)| jacobian(atlas.mesh.corners(triangle), corners(atlas, triangle)));
    let column = |axis: DVec3| flatten(after, along * axis.dot(along) + into * axis.dot(out));
    let carry = DMat2::from_cols(column(before[0]), column(before[1]));
    carry.is_finite().then_some(carry)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::hash::Hash;
    use crate::mesh::fixture::{atlas, cube, plane, sphere};

    /// A surface point of a triangle by its barycentric coordinates.
    fn spot(atlas: &Atlas, triangle: usize, hash: Hash) -> SurfacePoint {
        let [a, b, c] = corners(atlas, triangle);
        let (mut v, mut w) = (hash.unit(0), hash.unit(1));
        if v + w > 1.0 {
            (v, w) = (1.0 - v, 1.0 - w);
        }
        SurfacePoint { triangle, uv: a + (b - a) * v + (c - a) * w }
    }

    fn point(atlas: &Atlas, spot: SurfacePoint) -> DVec3 {
        let [p, q, r] = atlas.mesh.corners(spot.triangle);
        let b = barycentric(corners(atlas, spot.triangle), spot.uv);
        p * b[0] + q * b[1] + r * b[2]
    }

    /// Row C24: over any charts of a plane a path is a straight line, and transported vectors keep their direction.
    #[test]
    fn on_a_plane_ways_are_straight_lines() {
        for name in ["plane_one", "plane_cut", "plane_wild"] {
            let atlas = plane(name);
            // Rounded to 2⁻²⁴, the rotated charts are affine only to a few millionths.
            let near = if name == "plane_wild" { 1e-3 } else { 1e-9 };
            let (mut arrived, mut crossed) = (0, 0);
            for n in 0..4000u64 {
                let hash = Hash::new(n);
                let from = spot(&atlas, (hash.u64(9) % 512) as usize, hash);
                let wish = DVec3::new(hash.unit(5) - 0.5, hash.unit(6) - 0.5, 0.0) * 40.0;
                let jf = jacobian(atlas.mesh.corners(from.triangle), corners(&atlas, from.triangle));
                let to = point(&atlas, from) + wish;
                let inside = to.x.min(to.y) > 1e-6 && to.x.max(to.y) < 64.0 - 1e-6;
                let way = walk_turning(&atlas, from, flatten(jf, wish));
                assert_eq!(way.is_some(), inside, "{name} {n}: {to}");
                let Some((way, turn)) = way else { continue };
                assert!(point(&atlas, way.spot).distance(to) < near, "{name} {n}: {to} {way:?}");
                let beyond = jacobian(atlas.mesh.corners(way.spot.triangle), corners(&atlas, way.spot.triangle));
                let carried = turn * flatten(jf, wish);
                assert!((beyond[0] * carried.x + beyond[1] * carried.y).distance(wish) < near, "{name} {n}");
                arrived += 1;
                crossed += usize::from(way.crossed);
            }
            assert!(arrived > 2000 && (crossed > 500) == (name != "plane_one"), "{name}: {arrived} {crossed}");
        }
    }

    /// On a closed surface no path ends, and a path back along the same line leads to its start.
    #[test]
    fn closed_surfaces_have_no_ends_and_keep_lengths() {
        for atlas in [cube(), sphere()] {
            for n in 0..2000u64 {
                let hash = Hash::new(n);
                let from = spot(&atlas, usize::try_from(hash.u64(9) % atlas.uvs.len() as u64).unwrap_or(0), hash);
                let jf = jacobian(atlas.mesh.corners(from.triangle), corners(&atlas, from.triangle));
                let normal = jf[0].cross(jf[1]).normalize();
                let wish = DVec3::new(hash.unit(5) - 0.5, hash.unit(6) - 0.5, hash.unit(7) - 0.5) * 30.0;
                let wish = wish - normal * wish.dot(normal);
                let d = flatten(jf, wish);
                let (way, turn) = walk_turning(&atlas, from, d).expect("no end");
                let at = way.spot.triangle;
                let beyond = jacobian(atlas.mesh.corners(at), corners(&atlas, at));
                // Across inner edges the distortion of the atlas counts; the cube's faces are flat.
                if atlas.uvs.len() == 12 {
                    let carried = turn * d;
                    let length = (beyond[0] * carried.x + beyond[1] * carried.y).length();
                    assert!((length / wish.length() - 1.0).abs() < 1e-6, "{n}: {length}");
                }
                let back = walk(&atlas, way.spot, turn * -d).expect("no end");
                assert!(point(&atlas, back.spot).distance(point(&atlas, from)) < 1e-5, "{n}");
            }
        }
    }

    #[test]
    fn a_triangle_without_area_in_the_atlas_is_an_end() {
        let mesh = crate::mesh::fixture::strip();
        let mut uvs = vec![[glam::Vec2::ZERO; 3]; 4];
        uvs[0] = [glam::Vec2::ZERO, glam::Vec2::new(0.5, 0.0), glam::Vec2::new(0.5, 0.5)];
        let atlas = atlas(mesh, &uvs);
        let from = SurfacePoint { triangle: 0, uv: DVec2::new(0.4, 0.2) };
        assert_eq!(walk(&atlas, from, DVec2::new(0.3, 0.0)), None);
        assert!(walk(&atlas, from, DVec2::new(0.05, 0.0)).is_some());
    }
}
