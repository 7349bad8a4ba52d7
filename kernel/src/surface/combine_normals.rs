//! Blends a detail normal map over a base normal map.

use crate::ground::math::max;
use crate::ground::simd;
use shibo_macros::choice;

/// Blending of two normals.
#[choice]
pub enum NormalBlend {
    /// The detail is rotated by the rotation from straight up to the base: as if it lay on that surface
    #[default]
    Reoriented,
    /// The slopes of both are added: as in the sum of two heights
    Slopes,
    /// Horizontal parts are added, vertical ones multiplied: as slopes, but gentler where both are steep
    Whiteout,
}

/// Fills `out` with `detail` over `base`; all are stored as ½ + ½n. The slopes of the detail are multiplied by
/// `strength`.
///
/// # Panics
/// If the planes differ in length.
pub fn combine(mode: NormalBlend, base: [&[f32]; 3], detail: [&[f32]; 3], strength: &[f32], out: [&mut [f32]; 3]) {
    simd::dispatch(
        #[inline(always)]
        || match mode {
            NormalBlend::Reoriented => each(base, detail, strength, out, reoriented),
            NormalBlend::Slopes => each(base, detail, strength, out, |[bx, by, bz], [dx, dy, dz]| {
                [bx * dz + dx * bz, by * dz + dy * bz, bz * dz]
            }),
            NormalBlend::Whiteout => {
                each(base, detail, strength, out, |[bx, by, bz], [dx, dy, dz]| [bx + dx, by + dy, bz * dz])
            }
        },
    );
}

/// After C. Barré-Brisebois and S. Hill, "Blending in detail" (2012).
#[inline(always)]
fn reoriented([bx, by, bz]: [f32; 3], [dx, dy, dz]: [f32; 3]) -> [f32; 3] {
    let t = [bx, by, max(bz + 1.0, 1e-4)];
    let u = [-dx, -dy, dz];
    let along = (t[0] * u[0] + t[1] * u[1] + t[2] * u[2]) / t[2];
    [t[0] * along - u[0], t[1] * along - u[1], t[2] * along - u[2]]
}

#[inline(always)]
fn unit([x, y, z]: [f32; 3]) -> [f32; 3] {
    let square = x * x + y * y + z * z;
    let scale = 1.0 / max(square, 1e-20).sqrt();
    if square > 1e-20 { [x * scale, y * scale, z * scale] } else { [0.0, 0.0, 1.0] }
}

#[inline(always)]
fn each(
    base: [&[f32]; 3],
    detail: [&[f32]; 3],
    strength: &[f32],
    [x, y, z]: [&mut [f32]; 3],
    f: impl Fn([f32; 3], [f32; 3]) -> [f32; 3],
) {
    let n = x.len();
    let ([bx, by, bz], [dx, dy, dz]) = (base.map(|p| &p[..n]), detail.map(|p| &p[..n]));
    let (strength, y, z) = (&strength[..n], &mut y[..n], &mut z[..n]);
    for i in 0..n {
        let decode = |v: f32| 2.0 * v - 1.0;
        let b = unit([decode(bx[i]), decode(by[i]), decode(bz[i])]);
        // Clamp overhanging normals to nearly vertical slopes: a height has no overhangs.
        let d = [decode(dx[i]) * strength[i], decode(dy[i]) * strength[i], max(decode(dz[i]), 1e-3)];
        let r = unit(f(b, unit(d)));
        (x[i], y[i], z[i]) = (0.5 + 0.5 * r[0], 0.5 + 0.5 * r[1], 0.5 + 0.5 * r[2]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Quat, Vec3};

    fn one(mode: NormalBlend, base: Vec3, detail: Vec3, strength: f32) -> Vec3 {
        let [b, d] = [base, detail].map(|n| (n * 0.5 + 0.5).to_array());
        let [mut x, mut y, mut z] = [[0.0]; 3];
        let planes = |v: &[f32; 3]| v.map(|v| [v]);
        let (b, d) = (planes(&b), planes(&d));
        combine(mode, [&b[0], &b[1], &b[2]], [&d[0], &d[1], &d[2]], &[strength], [&mut x, &mut y, &mut z]);
        Vec3::new(x[0], y[0], z[0]) * 2.0 - 1.0
    }

    fn of_slopes(x: f32, y: f32) -> Vec3 {
        Vec3::new(-x, -y, 1.0).normalize()
    }

    #[test]
    fn the_detail_is_turned_with_the_base() {
        for (base, detail) in [((0.0, 0.0), (0.4, -0.2)), ((0.8, 0.3), (0.0, 0.0)), ((0.8, -1.3), (-0.5, 0.7))] {
            let (base, detail) = (of_slopes(base.0, base.1), of_slopes(detail.0, detail.1));
            let want = Quat::from_rotation_arc(Vec3::Z, base) * detail;
            let got = one(NormalBlend::Reoriented, base, detail, 1.0);
            assert!((got - want).length() < 1e-5, "{got} {want}");
        }
    }

    #[test]
    fn slopes_add_up() {
        let got = one(NormalBlend::Slopes, of_slopes(0.8, 0.1), of_slopes(-0.3, 0.4), 0.5);
        assert!((got - of_slopes(0.65, 0.3)).length() < 1e-5, "{got}");
        for mode in [NormalBlend::Reoriented, NormalBlend::Slopes, NormalBlend::Whiteout] {
            let base = of_slopes(-0.4, 0.9);
            assert!((one(mode, base, of_slopes(3.0, 1.0), 0.0) - base).length() < 1e-5);
            assert!((one(mode, Vec3::Z, of_slopes(1.0, 2.0), 1.0) - of_slopes(1.0, 2.0)).length() < 1e-5);
            assert!(one(mode, -Vec3::Z, -Vec3::ONE, 1.0).is_finite());
        }
    }
}
