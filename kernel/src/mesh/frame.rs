//! Frames on a surface, and their Jacobians: equation (4), `J = (t b)⁺ J_f` (rows C19 to C23).
//!
//! At a point of a triangle the directions of its corners are interpolated and made orthogonal to the smooth normal
//! there. Then the smallest rotation from that normal to the triangle's own turns them, so that they lie in the
//! triangle's plane and features keep their size at creases. Without a second direction, `b = t × n`: textures and
//! atlases have y down, so b points down if t points to the right.
use super::atlas::jacobian as parameterisation;
use super::walk::{barycentric, corners, flatten};
use glam::{DVec2, DVec3};
use shibo_value::{Atlas, Frames};

/// The two directions at a point in which the exemplar's x and y axes lie; their length is the size of features.
pub type Frame = [DVec3; 2];

/// `(t b)⁺ J_f` by rows; the transposed frame if its vectors are orthonormal (C23). A singular frame gives numbers that
/// are not finite.
pub fn jacobian(frame: Frame, jf: [DVec3; 2]) -> [f64; 4] {
    let [t, b] = frame;
    let off = (t.length_squared() - 1.0).abs().max((b.length_squared() - 1.0).abs()).max(t.dot(b).abs());
    let [x, y] = jf.map(|axis| if off < 1e-6 { DVec2::new(t.dot(axis), b.dot(axis)) } else { flatten(frame, axis) });
    [x.x, y.x, x.y, y.y]
}

/// Rotates a vector by the smallest rotation from the direction `from` to `to`, both of length 1.
pub fn least_turned(v: DVec3, from: DVec3, to: DVec3) -> DVec3 {
    let (axis, cosine) = (from.cross(to), from.dot(to));
    if cosine < -0.999_999 {
        // Half a turn, around any perpendicular axis.
        let across = from.any_orthonormal_vector();
        return across * (2.0 * across.dot(v)) - v;
    }
    let by = axis.cross(v);
    v + by + axis.cross(by) / (1.0 + cosine)
}

/// Rotates a vector around an axis of length 1.
pub fn turned(v: DVec3, axis: DVec3, angle: f64) -> DVec3 {
    let (s, c) = libm::sincos(angle);
    v * c + axis.cross(v) * s + axis * (axis.dot(v) * (1.0 - c))
}

/// Frames at the points of an atlas.
#[derive(Clone, Copy)]
pub struct Framing<'a> {
    /// The atlas.
    pub atlas: &'a Atlas,
    /// Frames on its mesh.
    pub frames: &'a Frames,
}

/// The part of a frame that is the same for all points of a triangle.
pub struct Face {
    corners: [DVec2; 3],
    /// The Jacobian of the parameterisation, in mm per unit of u and v.
    pub jf: [DVec3; 2],
    /// The triangle's normal, of length 1.
    pub normal: DVec3,
    normals: [DVec3; 3],
    t: [DVec3; 3],
    b: Option<[DVec3; 3]>,
}

impl Framing<'_> {
    /// Computes the constant part of a triangle.
    pub fn face(&self, triangle: usize) -> Face {
        let mesh = &self.atlas.mesh;
        let vertices = mesh.triangles[triangle].map(|v| v as usize);
        let normals = vertices.map(|v| self.atlas.smooth[v].as_dvec3());
        let corners = corners(self.atlas, triangle);
        Face {
            corners,
            jf: parameterisation(mesh.corners(triangle), corners),
            normal: mesh.cross(triangle).normalize_or_zero(),
            normals,
            t: self.combed(triangle, vertices.map(|v| self.frames.t[v].as_dvec3()), normals),
            b: (!self.frames.b.is_empty())
                .then(|| self.combed(triangle, vertices.map(|v| self.frames.b[v].as_dvec3()), normals)),
        }
    }

    /// The directions of a triangle's corners; those of the second and third are replaced by the equivalent direction
    /// that fits the first.
    fn combed(&self, triangle: usize, t: [DVec3; 3], normals: [DVec3; 3]) -> [DVec3; 3] {
        let Some(turns) = self.frames.turns.get(triangle) else { return t };
        let step = std::f64::consts::TAU / f64::from(self.frames.symmetry.max(1));
        let [_, from_last, to_next] = turns.map(|k| f64::from(k) * step);
        [t[0], turned(t[1], normals[1], -to_next), turned(t[2], normals[2], from_last)]
    }
}

impl Face {
    /// The frame at a point.
    pub fn frame(&self, uv: DVec2) -> Frame {
        let weights = barycentric(self.corners, uv);
        let sum = |of: &[DVec3; 3]| of[0] * weights[0] + of[1] * weights[1] + of[2] * weights[2];
        let mut smooth = sum(&self.normals).normalize_or_zero();
        if smooth == DVec3::ZERO {
            smooth = self.normal;
        }
        let across = |of: &[DVec3; 3]| {
            let length = of[0].length() * weights[0] + of[1].length() * weights[1] + of[2].length() * weights[2];
            let flat = |v: DVec3| v - smooth * smooth.dot(v);
            let mut mixed = flat(sum(of));
            if mixed.length() < 1e-6 * length {
                // Around a singular point directions cancel out.
                let nearest = (1..3).fold(0, |best, k| if weights[k] > weights[best] { k } else { best });
                mixed = flat(of[nearest]);
            }
            least_turned(mixed.normalize_or_zero() * length, smooth, self.normal)
        };
        let t = across(&self.t);
        [t, self.b.as_ref().map_or_else(|| t.cross(self.normal), across)]
    }

    /// The frame at a point, rotated by an angle from t towards b, and scaled.
    pub fn frame_turned(&self, uv: DVec2, angle: f64, scale: f64) -> Frame {
        let [t, b] = self.frame(uv);
        if angle == 0.0 {
            return [t * scale, b * scale];
        }
        let axis = t.cross(b).normalize_or_zero();
        [t, b].map(|v| turned(v, axis, angle) * scale)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::fixture::{cube, plane, sphere};
    use std::sync::Arc;

    fn vector(v: &serde_json::Value) -> DVec3 {
        DVec3::from_array([0, 1, 2].map(|k| v[k].as_f64().expect("a number")))
    }

    /// Rows C19, C22: the test vectors `surface_jacobian`.
    #[test]
    fn jacobians_are_those_of_the_vectors() {
        let all: serde_json::Value =
            serde_json::from_str(include_str!("../../tests/vectors/synthesis.json")).expect("JSON");
        let cases = all["surface_jacobian"].as_array().expect("a list");
        for case in cases {
            let corner = |k: usize| vector(&case["v"][k]);
            let uv = |k: usize| DVec2::new(case["uv"][k][0].as_f64().unwrap(), case["uv"][k][1].as_f64().unwrap());
            let jf = parameterisation([0, 1, 2].map(corner), [0, 1, 2].map(uv));
            let j = jacobian([vector(&case["t"]), vector(&case["b"])], jf);
            for k in 0..2 {
                for (d, v) in jf[k].to_array().into_iter().enumerate() {
                    assert!((v - case["Jf"][d][k].as_f64().unwrap()).abs() < 1e-9);
                }
                for d in 0..2 {
                    assert!((j[2 * d + k] - case["J"][d][k].as_f64().unwrap()).abs() < 1e-9, "{j:?}");
                }
            }
        }
        assert_eq!(cases.len(), 4);
    }

    /// Row C23: for orthonormal frames the transpose gives the same numbers.
    #[test]
    fn orthonormal_frames_may_be_transposed() {
        let t = DVec3::new(0.6, 0.64, 0.48);
        let b = t.cross(DVec3::new(0.0, 0.6, -0.8)).normalize();
        let jf = [DVec3::new(3.0, -1.0, 0.5), DVec3::new(0.2, 2.0, 1.0)];
        let short = jacobian([t, b], jf);
        for (k, axis) in jf.into_iter().enumerate() {
            let long = flatten([t, b], axis);
            assert!((short[k] - long.x).abs() < 1e-6 && (short[2 + k] - long.y).abs() < 1e-6);
            assert!((short[k] - t.dot(axis)).abs() < 1e-15, "the transpose itself");
        }
        assert!((jacobian([t * 2.0, b], jf)[0] - t.dot(jf[0]) / 2.0).abs() < 1e-9, "longer: features grow");
    }

    fn along_x(atlas: &Atlas) -> Frames {
        let n = atlas.mesh.positions.len();
        let (mesh, t) = (Arc::clone(&atlas.mesh), vec![glam::Vec3::X; n]);
        Frames { mesh, t, b: Vec::new(), symmetry: 1, turns: Vec::new(), singular: Vec::new() }
    }

    /// S-24: on a chart aligned with t, J is a positive multiple of 1.
    #[test]
    fn scales_only_on_plane_along_x() {
        let atlas = plane("plane_one");
        let frames = along_x(&atlas);
        let framing = Framing { atlas: &atlas, frames: &frames };
        for triangle in [0, 77, 511] {
            let face = framing.face(triangle);
            let j = jacobian(face.frame(face.corners[0]), face.jf);
            let wanted = [128.0, 0.0, 0.0, 128.0];
            assert!(j.iter().zip(wanted).all(|(a, b)| (a - b).abs() < 1e-6), "{j:?}");
            let [t, b] = face.frame_turned(face.corners[0], std::f64::consts::FRAC_PI_2, 2.0);
            assert!(t.distance(DVec3::new(0.0, -2.0, 0.0)) < 1e-6 && b.distance(DVec3::new(-2.0, 0.0, 0.0)) < 1e-6);
        }
    }

    /// Frames lie in the triangles' planes and keep their length, at creases too.
    #[test]
    fn frames_lie_in_the_plane_and_keep_their_length() {
        for atlas in [cube(), sphere()] {
            let mut frames = along_x(&atlas);
            for (t, n) in frames.t.iter_mut().zip(&atlas.smooth) {
                *t = (*t - *n * n.dot(*t)).normalize_or_zero() * 1.5;
            }
            let framing = Framing { atlas: &atlas, frames: &frames };
            let mut longest = 0.0f64;
            for triangle in 0..atlas.uvs.len() {
                let face = framing.face(triangle);
                let middle = (face.corners[0] + face.corners[1] + face.corners[2]) / 3.0;
                let [t, b] = face.frame(middle);
                assert!(t.dot(face.normal).abs() < 1e-9 && b.dot(face.normal).abs() < 1e-9 && t.dot(b).abs() < 1e-9);
                longest = longest.max((t.length() - 1.5).abs()).max((b.length() - 1.5).abs());
                assert!(t.cross(b).dot(face.normal) < 0.0, "y is down");
            }
            assert!(longest < 1e-6, "{longest}");
        }
    }

    #[test]
    fn opposite_normals_are_half_a_turn() {
        for (from, to) in [(DVec3::Z, -DVec3::Z), (DVec3::X, DVec3::Y), (DVec3::Z, DVec3::Z)] {
            let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|v| least_turned(v, from, to));
            let volume = x.cross(y).dot(z);
            assert!(least_turned(from, from, to).distance(to) < 1e-12 && (volume - 1.0).abs() < 1e-12, "{from} {to}");
        }
    }
}
