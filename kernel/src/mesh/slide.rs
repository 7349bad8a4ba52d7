//! Straight paths over a surface, in space.
//!
//! At an edge the surface is unfolded: the path and the transported vector keep their components along the edge, and
//! their components across it continue in the plane of the next triangle. Nothing depends on the layout of the mesh.
use super::walk::{MOST, TOLERANCE, exit};
use glam::DVec3;
use shibo_value::Atlas;

/// End of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slid {
    /// The triangle.
    pub triangle: usize,
    /// The position, in its plane.
    pub place: DVec3,
    /// The transported vector.
    pub carried: DVec3,
    /// True if the surface ended before the path did.
    pub ended: bool,
}

/// Weights of a triangle's corners at a position, projected to its plane; `None` for a triangle without area.
pub fn weights([a, b, c]: [DVec3; 3], place: DVec3) -> Option<[f64; 3]> {
    let (e, f, d) = (b - a, c - a, place - a);
    let (ee, ef, ff) = (e.dot(e), e.dot(f), f.dot(f));
    let scale = 1.0 / (ee * ff - ef * ef);
    let (de, df) = (d.dot(e), d.dot(f));
    let (v, w) = ((de * ff - df * ef) * scale, (df * ee - de * ef) * scale);
    scale.is_finite().then_some([1.0 - v - w, v, w])
}

/// Projects a vector to the plane of a triangle.
pub fn flat(atlas: &Atlas, triangle: usize, v: DVec3) -> DVec3 {
    atlas.mesh.cross(triangle).try_normalize().map_or(v, |normal| v.reject_from_normalized(normal))
}

/// Moves by `way` from a position on a triangle, both in its plane, and transports a vector along.
pub fn slide(atlas: &Atlas, (mut triangle, mut place): (usize, DVec3), mut way: DVec3, mut carried: DVec3) -> Slid {
    let mut came = 3;
    for _ in 0..MOST {
        let corners = atlas.mesh.corners(triangle);
        let (Some(start), Some(end)) = (weights(corners, place), weights(corners, place + way)) else { break };
        if end.iter().all(|weight| *weight >= -TOLERANCE) {
            return Slid { triangle, place: place + way, carried, ended: false };
        }
        let Some((edge, share)) = exit(start, end, came) else {
            return Slid { triangle, place: place + way, carried, ended: false };
        };
        place += way * share;
        way *= 1.0 - share;
        let Some((next, beyond)) = atlas.across(triangle, edge) else { break };
        let there = atlas.mesh.corners(next);
        let along = (corners[(edge + 2) % 3] - corners[(edge + 1) % 3]).normalize_or_zero();
        let across = |side: DVec3| side.reject_from_normalized(along).normalize_or_zero();
        let out = -across(corners[edge] - corners[(edge + 1) % 3]);
        let into = across(there[beyond] - there[(beyond + 1) % 3]);
        let unfold = |v: DVec3| along * v.dot(along) + into * v.dot(out);
        (way, carried) = (unfold(way), unfold(carried));
        (triangle, came) = (next, beyond);
    }
    Slid { triangle, place, carried, ended: true }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::hash::Hash;
    use crate::mesh::fixture::{cube, plane, sphere, torus};

    /// A random position on a triangle, and a direction of length 1 in its plane.
    fn draw(atlas: &Atlas, n: u64) -> (usize, DVec3, DVec3) {
        let hash = Hash::new(5).with(n);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "below the number of triangles")]
        let triangle = (hash.unit(0) * atlas.mesh.triangles.len() as f64) as usize;
        let [a, b, c] = atlas.mesh.corners(triangle);
        let place = a * 0.3 + b * (0.3 + 0.2 * hash.unit(1)) + c * (0.4 - 0.2 * hash.unit(1));
        let angle = std::f64::consts::TAU * hash.unit(2);
        let x = (b - a).normalize();
        let y = atlas.mesh.cross(triangle).normalize().cross(x);
        (triangle, place, x * angle.cos() + y * angle.sin())
    }

    #[test]
    fn on_a_plane_ways_are_straight() {
        for name in ["plane_one", "plane_cut"] {
            let atlas = plane(name);
            let [low, high] = atlas.mesh.bounds();
            for n in 0..200 {
                let (triangle, place, way) = draw(&atlas, n);
                let target = place + way * 20.0;
                let slid = slide(&atlas, (triangle, place), way * 20.0, way);
                let inside = target.cmpge(low - 1e-9).all() && target.cmple(high + 1e-9).all();
                assert_eq!(slid.ended, !inside, "{name} {n}");
                if inside {
                    assert!(slid.place.distance(target) < 1e-9 && slid.carried.distance(way) < 1e-9);
                    assert!(weights(atlas.mesh.corners(slid.triangle), target).unwrap().iter().all(|w| *w > -1e-6));
                }
            }
        }
    }

    #[test]
    fn returns_on_closed_surfaces_without_stretch() {
        for atlas in [cube(), sphere(), torus(48, 24)] {
            for n in 0..200 {
                let (triangle, place, way) = draw(&atlas, n);
                let slid = slide(&atlas, (triangle, place), way * 70.0, way);
                assert!(!slid.ended && (slid.carried.length() - 1.0).abs() < 1e-9);
                // The transported vector stays tangential, and the position stays on the surface.
                let normal = atlas.mesh.cross(slid.triangle).normalize();
                assert!(slid.carried.dot(normal).abs() < 1e-9);
                let [corner, ..] = atlas.mesh.corners(slid.triangle);
                assert!((slid.place - corner).dot(normal).abs() < 1e-7);
                // Back along the same path.
                let back = slide(&atlas, (slid.triangle, slid.place), slid.carried * -70.0, slid.carried);
                assert!(back.place.distance(place) < 1e-6, "{n}: {}", back.place.distance(place));
            }
        }
    }
}
