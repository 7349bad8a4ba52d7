//! Rigid motions of the parts of a mesh, for solid textures: as if each board of a piece of furniture had been cut from
//! another position in the tree.
use crate::ground::hash::Hash;
use glam::{DMat3, DQuat, DVec3};
use shibo_value::Mesh;

/// A rigid motion: maps a point `p` to `turn · p + shift`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RigidMotion {
    /// Rotation.
    pub turn: DMat3,
    /// Shift after the rotation.
    pub shift: DVec3,
}

impl RigidMotion {
    /// The identity.
    pub const NONE: Self = Self { turn: DMat3::IDENTITY, shift: DVec3::ZERO };
}

/// Settings of random motions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scatter {
    /// Maximum shift along each axis, in either direction.
    pub spread: DVec3,
    /// Maximum rotation about the z axis, in either direction, in radians.
    pub turn: f64,
    /// True if the longest axis of each part is first rotated to z.
    pub upright: bool,
    /// Random numbers.
    pub hash: Hash,
}

/// The longest axis of a part, in which its surface varies most; pointing up or, if level, to positive x or y.
fn longest(mesh: &Mesh, triangles: &[usize], middle: DVec3) -> DVec3 {
    let mut spread = DMat3::ZERO;
    for &n in triangles {
        let corners = mesh.corners(n).map(|p| p - middle);
        let area = mesh.cross(n).length();
        let sum: DVec3 = corners.iter().sum();
        // The mean of the products of coordinates over a triangle.
        for p in corners.into_iter().chain([sum]) {
            spread += DMat3::from_cols(p * p.x, p * p.y, p * p.z) * area;
        }
    }
    // The dominant eigenvector, by power iteration.
    let mut power = spread * (1.0 / spread.to_cols_array().iter().fold(f64::MIN_POSITIVE, |most, v| most.max(v.abs())));
    for _ in 0..24 {
        power *= power;
        let most = power.to_cols_array().iter().fold(f64::MIN_POSITIVE, |most, v| most.max(v.abs()));
        power *= 1.0 / most;
    }
    let columns = [power.x_axis, power.y_axis, power.z_axis];
    let axis =
        columns.into_iter().fold(DVec3::ZERO, |best, c| if c.length() > best.length() * 1.000_001 { c } else { best });
    let axis = axis.normalize_or(DVec3::Z);
    let first = [axis.z, axis.x, axis.y].into_iter().find(|c| c.abs() > 1e-6).unwrap_or(1.0);
    axis * first.signum()
}

/// The motions of all parts; `of` holds the part of each triangle. Each part is rotated about the middle of its
/// bounding box, and shifted.
pub fn motions(mesh: &Mesh, of: &[u32], scatter: &Scatter) -> Vec<RigidMotion> {
    let count = of.iter().max().map_or(0, |most| *most as usize + 1);
    let mut triangles = vec![Vec::new(); count];
    of.iter().enumerate().for_each(|(n, part)| triangles[*part as usize].push(n));
    let one = |(part, triangles): (u64, &Vec<usize>)| {
        let corners = || triangles.iter().flat_map(|n| mesh.corners(*n));
        let low = corners().fold(DVec3::MAX, DVec3::min);
        let high = corners().fold(DVec3::MIN, DVec3::max);
        let middle = if triangles.is_empty() { DVec3::ZERO } else { 0.5 * (low + high) };
        let chance = |k: u64| 2.0 * f64::from(scatter.hash.unit_f32(4 * part + k)) - 1.0;
        let up = if scatter.upright {
            DQuat::from_rotation_arc(longest(mesh, triangles, middle), DVec3::Z)
        } else {
            DQuat::IDENTITY
        };
        let (sin, cos) = libm::sincos(0.5 * scatter.turn * chance(3));
        let turn = DMat3::from_quat(DQuat::from_xyzw(0.0, 0.0, sin, cos) * up);
        let to = middle + scatter.spread * DVec3::new(chance(0), chance(1), chance(2));
        RigidMotion { turn, shift: to - turn * middle }
    };
    (0..).zip(&triangles).map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;

    #[test]
    fn parts_are_turned_upright_about_their_middles() {
        let scatter = Scatter { spread: DVec3::ZERO, turn: 0.0, upright: true, hash: Hash::new(1) };
        for (size, turned) in [
            (DVec3::new(10.0, 80.0, 20.0), DVec3::Y),
            (DVec3::new(90.0, 8.0, 20.0), DVec3::X),
            (DVec3::new(9.0, 8.0, 20.0), DVec3::Z),
        ] {
            let mesh = shapes::cube(size, 16);
            let of = vec![0; mesh.triangles.len()];
            let motion = motions(&mesh, &of, &scatter)[0];
            assert!((motion.turn * turned).distance(DVec3::Z) < 1e-9 && motion.shift.length() < 1e-9);
        }
    }

    #[test]
    fn parts_are_scattered_within_bounds() {
        let mesh = shapes::cube(DVec3::splat(60.0), 8);
        // Each side is a part.
        let of: Vec<u32> = (0..12).map(|n| n / 2).collect();
        let spread = DVec3::new(5.0, 50.0, 0.0);
        let scatter = Scatter { spread, turn: 0.5, upright: false, hash: Hash::new(7) };
        let all = motions(&mesh, &of, &scatter);
        assert_eq!(all.len(), 6);
        for (n, motion) in all.iter().enumerate() {
            assert!((motion.turn.determinant() - 1.0).abs() < 1e-12);
            assert!(motion.turn.x_axis.x >= 0.87 && motion.turn.z_axis == DVec3::Z);
            // The diagonal of a side's two triangles.
            let middle = 0.5 * (mesh.corners(2 * n)[0] + mesh.corners(2 * n)[2]);
            let away = (motion.turn * middle + motion.shift - middle).abs();
            assert!(away.cmple(spread + 1e-9).all());
            assert!(all.iter().skip(n + 1).all(|other| other != motion));
        }
        assert_eq!(motions(&mesh, &of, &scatter), all);
    }
}
