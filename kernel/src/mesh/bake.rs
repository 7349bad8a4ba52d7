//! Properties of the surface at each texel of its atlas: positions, normals, values per triangle or vertex.
//!
//! All functions read the [`texels`](super::texels) of a window. Charts and their gutters have a value; elsewhere it is
//! 0 unless the function says otherwise. Values depend on the position on the canvas alone, so the bits of a window are
//! those of the whole picture.
use super::motion::RigidMotion;
use super::texels::{Barycentric, triangle};
use crate::ground::number::narrow;
use crate::ground::simd::dispatch;
use glam::{DVec2, DVec3, Vec3};
use shibo_value::{Atlas, Grid, Window};
use std::ops::Range;

/// The texels of a window.
#[derive(Clone, Copy, Debug)]
pub struct Texels<'a> {
    /// The surface.
    pub atlas: &'a Atlas,
    /// The grid.
    pub grid: &'a Grid,
    /// The window on it.
    pub window: Window,
    /// The values of the texel field, by rows.
    pub values: &'a [f32],
}

impl Texels<'_> {
    /// Calls `body(v, triangle, pixels)` for each run of pixels in a row that belong to one triangle or to none. `v` is
    /// the coordinate of their centres in the unit square.
    pub fn runs(&self, mut body: impl FnMut(f64, Option<usize>, Range<usize>)) {
        let width = self.window.width as usize;
        for (row, y) in self.values.chunks(width.max(1)).zip(self.window.y..) {
            let v = self.grid.center(0, y).y / self.atlas.size_mm.y;
            let start = (y - self.window.y).unsigned_abs() as usize * width;
            let mut from = 0;
            while from < width {
                let own = row[from].abs();
                let count = row[from..].iter().take_while(|value| value.abs() == own).count();
                body(v, triangle(own), start + from..start + from + count);
                from += count;
            }
        }
    }

    /// The u of the centres of all columns.
    pub fn columns(&self) -> Vec<f64> {
        let center = |x: i32| self.grid.center(x, 0).x / self.atlas.size_mm.x;
        (self.window.x..self.window.right()).map(center).collect()
    }

    /// The column of the first pixel of a run.
    fn column(&self, pixels: &Range<usize>) -> usize {
        pixels.start % self.window.width.max(1) as usize
    }
}

/// Positions of texels on the surface, transformed by the `motion` of their triangle; 0 without a surface. In the
/// gutter, the plane of the triangle is continued.
pub fn places(texels: &Texels<'_>, motion: impl Fn(usize) -> RigidMotion, out: [&mut [f32]; 3]) {
    let us = texels.columns();
    let [x, y, z] = out;
    texels.runs(|v, triangle, pixels| {
        let Some(n) = triangle else {
            return [&mut *x, &mut *y, &mut *z].into_iter().for_each(|plane| plane[pixels.clone()].fill(0.0));
        };
        let first = texels.column(&pixels);
        let us = &us[first..first + pixels.len()];
        let RigidMotion { turn, shift } = motion(n);
        let [along, down] = texels.atlas.jacobians[n].map(|axis| turn * axis.as_dvec3());
        let corner = texels.atlas.uvs[n][0].as_dvec2();
        let start = turn * texels.atlas.mesh.corners(n)[0] + shift + down * (v - corner.y);
        let planes = [&mut *x, &mut *y, &mut *z].into_iter().zip(along.to_array()).zip(start.to_array());
        for ((plane, along), start) in planes {
            #[expect(clippy::cast_possible_truncation, reason = "fields are single precision")]
            plane[pixels.clone()]
                .iter_mut()
                .zip(us)
                .for_each(|(out, u)| *out = (start + along * (u - corner.x)) as f32);
        }
    });
}

/// Inverse of the metric of `Patch::metric`, in 1/mm²; 0 where there is no surface or its area is 0.
pub fn metric(texels: &Texels<'_>, out: [&mut [f32]; 3]) {
    let [a, b, c] = out;
    let step = texels.grid.step / texels.atlas.size_mm;
    texels.runs(|_, triangle, pixels| {
        let [u, v] = triangle.map_or([DVec3::ZERO; 2], |n| texels.atlas.jacobians[n].map(Vec3::as_dvec3));
        let (u, v) = (u * step.x, v * step.y);
        let det = u.length_squared() * v.length_squared() - u.dot(v) * u.dot(v);
        let inverse = [v.length_squared(), -u.dot(v), u.length_squared()].map(|x| narrow(x / det));
        let inverse = if inverse.iter().all(|x| x.is_finite()) { inverse } else { [0.0; 3] };
        [&mut *a, &mut *b, &mut *c].into_iter().zip(inverse).for_each(|(plane, x)| plane[pixels.clone()].fill(x));
    });
}

/// The normals of a triangle's corners: from the file, or of the vertices.
fn corner_normals(atlas: &Atlas, n: usize) -> [DVec3; 3] {
    let own = || atlas.mesh.triangles[n].map(|v| atlas.smooth[v as usize]);
    atlas.mesh.normals.get(n).copied().unwrap_or_else(own).map(Vec3::as_dvec3)
}

/// Weights of a triangle's corners at a point of the unit square; for a point outside, those of a nearby point on the
/// border.
pub fn weights(atlas: &Atlas, n: usize, at: DVec2) -> [f64; 3] {
    let inside = Barycentric::new(atlas.uvs[n].map(|uv| uv.as_dvec2())).map_or([1.0, 0.0, 0.0], |b| b.at(at));
    let inside = inside.map(|w| w.max(0.0));
    let sum: f64 = inside.iter().sum();
    inside.map(|w| w / sum)
}

/// Calls `body(pixel, normal)` for all pixels. The normal is interpolated between `corners`, or is the triangle's own
/// if `corners` returns `None`; without a surface it points up.
fn each_normal(texels: &Texels<'_>, corners: impl Fn(usize) -> Option<[DVec3; 3]>, mut body: impl FnMut(usize, DVec3)) {
    let us = texels.columns();
    texels.runs(|v, triangle, pixels| {
        let first = texels.column(&pixels);
        let flat = triangle.map_or(DVec3::Z, |n| texels.atlas.mesh.cross(n).normalize_or(DVec3::Z));
        let corners = triangle.and_then(|n| Some((n, corners(n)?)));
        for (k, u) in pixels.clone().zip(&us[first..]) {
            let normal = corners.map_or(flat, |(n, corners)| {
                let w = weights(texels.atlas, n, DVec2::new(*u, v));
                (corners[0] * w[0] + corners[1] * w[1] + corners[2] * w[2]).normalize_or(flat)
            });
            body(k, normal);
        }
    });
}

/// The normals of texels as ½ + ½n, in space. `smooth`: interpolated between corners, using the file's normals if it
/// has any; else one per triangle. Without a surface they point up.
pub fn normals(texels: &Texels<'_>, smooth: bool, out: [&mut [f32]; 3]) {
    let [x, y, z] = out;
    let corners = |n: usize| smooth.then(|| corner_normals(texels.atlas, n));
    each_normal(texels, corners, |k, normal| {
        let stored = (0.5 + 0.5 * normal).as_vec3();
        (x[k], y[k], z[k]) = (stored.x, stored.y, stored.z);
    });
}

/// Components of the interpolated [`normals`] along the axes of their facet, in the form of `Patch::rounded`; 0 without
/// a surface.
pub fn rounded(texels: &Texels<'_>, out: [&mut [f32]; 3]) {
    let us = texels.columns();
    let [x, y, z] = out;
    // Cache facets: a row meets the triangles of the row above again.
    let mut known: Vec<Option<(usize, Facet)>> = vec![None; FACETS];
    texels.runs(|v, triangle, pixels| {
        let planes = [&mut *x, &mut *y, &mut *z].map(|plane| &mut plane[pixels.clone()]);
        let Some(n) = triangle else { return planes.into_iter().for_each(|plane| plane.fill(0.0)) };
        let place = &mut known[slot(n)];
        let facet = match place {
            Some((same, facet)) if *same == n => facet,
            _ => &mut place.insert((n, Facet::new(texels.atlas, n))).1,
        };
        let first = texels.column(&pixels);
        facet.mixed(v, &us[first..first + pixels.len()], planes);
    });
}

/// Number of cached facets, 2⁸.
const FACETS: usize = 1 << 8;

/// Cache slot of a triangle. Hashed, since neighbours may differ by any number.
#[expect(clippy::cast_possible_truncation, reason = "any bits do")]
fn slot(n: usize) -> usize {
    ((n as u32).wrapping_mul(0x9E37_79B1) >> 24) as usize
}

/// The data of a triangle for [`rounded`]: the normals of its corners in its axes, and its barycentric coordinates.
#[derive(Clone, Copy)]
struct Facet {
    corners: [Vec3; 3],
    inside: Option<Barycentric>,
}

impl Facet {
    fn new(atlas: &Atlas, n: usize) -> Self {
        let [u, v] = atlas.jacobians[n].map(Vec3::as_dvec3);
        let (right, normal) = (u.normalize_or_zero(), v.cross(u).normalize_or_zero());
        let down = right.cross(normal);
        let on_facet = |n: DVec3| DVec3::new(n.dot(right), n.dot(down), n.dot(normal)).as_vec3();
        let corners = corner_normals(atlas, n).map(on_facet);
        Self { corners, inside: Barycentric::new(atlas.uvs[n].map(|uv| uv.as_dvec2())) }
    }

    /// Interpolates the directions of the corners, at the coordinates `us` of a row.
    fn mixed(&self, v: f64, us: &[f64], [x, y, z]: [&mut [f32]; 3]) {
        let corners = self.corners;
        // Without area, the first corner has the whole weight.
        let row = self.inside.map_or([[0.0, 0.0, 1.0], [0.0; 3], [0.0; 3]], |inside| inside.row(v));
        dispatch(
            #[inline(always)]
            || {
                for (((u, x), y), z) in us.iter().zip(x).zip(y).zip(z) {
                    // Clamp beyond the triangle: only the direction counts.
                    let [a, b, c] = row.map(|[slope, from, base]| narrow((slope * (u - from) + base).max(0.0)));
                    let mean = corners[0] * a + corners[1] * b + corners[2] * c;
                    let inverse = 1.0 / (mean.x * mean.x + mean.y * mean.y + mean.z * mean.z).sqrt();
                    let fits = inverse.is_finite() & (inverse > 0.0);
                    *x = if fits { mean.x * inverse } else { 0.0 };
                    *y = if fits { mean.y * inverse } else { 0.0 };
                    *z = if fits { mean.z * inverse } else { 1.0 };
                }
            },
        );
    }
}

/// The normals of texels, interpolated between those of vertices.
pub fn vertex_normals(texels: &Texels<'_>, out: [&mut [f32]; 3]) {
    let [x, y, z] = out;
    let atlas = texels.atlas;
    let corners = |n: usize| Some(atlas.mesh.triangles[n].map(|v| atlas.smooth[v as usize].as_dvec3()));
    each_normal(texels, corners, |k, normal| {
        let normal = normal.as_vec3();
        (x[k], y[k], z[k]) = (normal.x, normal.y, normal.z);
    });
}

/// Positions of texels on the surface, and the normals there, interpolated between those of vertices.
pub fn places_and_normals(texels: &Texels<'_>) -> [[Vec<f32>; 3]; 2] {
    let [mut place, mut normal] = [0, 1].map(|_| [0, 1, 2].map(|_| vec![0.0; texels.values.len()]));
    places(texels, |_| RigidMotion::NONE, place.each_mut().map(Vec::as_mut_slice));
    vertex_normals(texels, normal.each_mut().map(Vec::as_mut_slice));
    [place, normal]
}

/// Positions of texels; those of the gutter are moved to the nearest border of their triangle. Where the surface bends,
/// its continued plane would lie inside the body.
pub fn places_on_triangles(texels: &Texels<'_>, out: [&mut [f32]; 3]) {
    let us = texels.columns();
    let [x, y, z] = out;
    texels.runs(|v, triangle, pixels| {
        let first = texels.column(&pixels);
        let corners = triangle.map(|n| (n, texels.atlas.mesh.corners(n)));
        for (k, u) in pixels.zip(&us[first..]) {
            let place = corners.map_or(DVec3::ZERO, |(n, corners)| {
                let w = weights(texels.atlas, n, DVec2::new(*u, v));
                corners[0] * w[0] + corners[1] * w[1] + corners[2] * w[2]
            });
            [x[k], y[k], z[k]] = place.as_vec3().to_array();
        }
    });
}

/// Looks up a value per triangle; 0 without a surface.
pub fn of_triangles(texels: &Texels<'_>, values: &[f32], out: &mut [f32]) {
    texels.runs(|_, triangle, pixels| out[pixels].fill(triangle.map_or(0.0, |n| values[n])));
}

/// Interpolates a value per vertex; 0 without a surface.
pub fn of_vertices(texels: &Texels<'_>, values: &[f32], out: &mut [f32]) {
    let us = texels.columns();
    texels.runs(|v, triangle, pixels| {
        let first = texels.column(&pixels);
        let Some(n) = triangle else { return out[pixels].fill(0.0) };
        let corners = texels.atlas.mesh.triangles[n].map(|v| f64::from(values[v as usize]));
        for (k, u) in pixels.zip(&us[first..]) {
            let w = weights(texels.atlas, n, DVec2::new(*u, v));
            #[expect(clippy::cast_possible_truncation, reason = "fields are single precision")]
            let value = (corners[0] * w[0] + corners[1] * w[1] + corners[2] * w[2]) as f32;
            out[k] = value;
        }
    });
}

/// 1 in charts and 0 elsewhere, gutters included.
pub fn mask(texels: &[f32], out: &mut [f32]) {
    out.iter_mut().zip(texels).for_each(|(out, texel)| *out = f32::from(u8::from(*texel > 0.0)));
}

/// Singular values of a triangle's map from the canvas to the surface, both in mm, the larger one first: the scales of
/// lengths. 0 for a triangle without area.
pub fn stretch(atlas: &Atlas, n: usize) -> [f64; 2] {
    let [u, v] = atlas.jacobians[n];
    let (a, b) = (u.as_dvec3() / atlas.size_mm.x, v.as_dvec3() / atlas.size_mm.y);
    let (sum, difference) = (0.5 * (a.dot(a) + b.dot(b)), 0.5 * (a.dot(a) - b.dot(b)));
    let root = libm::hypot(difference, a.dot(b));
    // The product has less rounding error than the difference.
    let large = (sum + root).sqrt();
    let area = a.cross(b).length();
    [large, if large > 0.0 { area / large } else { 0.0 }]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::atlas::atlas;
    use crate::mesh::{samples, shapes, texels};
    use glam::UVec2;
    use shibo_value::Mesh;
    use std::sync::Arc;

    fn of(mesh: Mesh) -> Atlas {
        let uvs = mesh.uvs.clone();
        atlas(Arc::new(mesh), &uvs, DVec2::splat(100.0)).unwrap()
    }

    /// Calls `body` with the texels of the whole canvas, `n` pixels wide.
    fn with<T>(atlas: &Atlas, n: u32, body: impl FnOnce(&Texels<'_>) -> T) -> T {
        let grid = Grid { origin: DVec2::ZERO, step: DVec2::splat(100.0 / f64::from(n)), period: None, shown: None };
        let window = Window::full(UVec2::splat(n));
        let mut values = vec![0.0; window.len()];
        texels::fill(atlas, &grid, window, &mut values);
        body(&Texels { atlas, grid: &grid, window, values: &values })
    }

    fn three(n: usize) -> [Vec<f32>; 3] {
        std::array::from_fn(|_| vec![f32::NAN; n])
    }

    /// Positions lie on the shapes, up to the error of flat triangles.
    #[test]
    fn places_texels_on_shapes() {
        let size = DVec3::splat(60.0);
        type Distance = fn(DVec3) -> f64;
        let cases: [(Mesh, Distance, f64); 3] = [
            (shapes::cube(size, 64), |p| p.abs().max_element() - 30.0, 1e-4),
            (shapes::sphere(size, 96), |p| p.length() - 30.0, 0.08),
            (shapes::torus(size.truncate(), 15.0, 96), |p| (p.truncate().length() - 30.0).hypot(p.z) - 15.0, 0.06),
        ];
        for (mesh, distance, most) in cases {
            let atlas = of(mesh);
            with(&atlas, 200, |texels| {
                let mut out = three(texels.values.len());
                let [x, y, z] = &mut out;
                places(texels, |_| RigidMotion::NONE, [x, y, z]);
                let mut found = 0;
                for k in (0..texels.values.len()).filter(|k| texels.values[*k] > 0.0) {
                    let p = DVec3::new(f64::from(out[0][k]), f64::from(out[1][k]), f64::from(out[2][k]));
                    assert!(distance(p).abs() < most, "{p} {}", distance(p));
                    found += 1;
                }
                assert!(found > 10_000);
                assert!(out.iter().flatten().all(|v| v.is_finite()));
            });
        }
    }

    #[test]
    fn matches_normals_of_shapes() {
        let size = DVec3::splat(60.0);
        let mut plain = shapes::sphere(size, 96);
        plain.normals.clear();
        for (mesh, smooth, most) in
            [(shapes::sphere(size, 96), true, 0.002), (plain, true, 0.03), (shapes::sphere(size, 96), false, 0.06)]
        {
            let atlas = of(mesh);
            with(&atlas, 200, |texels| {
                let (mut at, mut out) = (three(texels.values.len()), three(texels.values.len()));
                let ([x, y, z], [a, b, c]) = (&mut at, &mut out);
                places(texels, |_| RigidMotion::NONE, [x, y, z]);
                normals(texels, smooth, [a, b, c]);
                for k in (0..texels.values.len()).filter(|k| texels.values[*k] > 0.0) {
                    let p = Vec3::new(at[0][k], at[1][k], at[2][k]);
                    let n = 2.0 * Vec3::new(out[0][k], out[1][k], out[2][k]) - 1.0;
                    assert!(n.distance(p.normalize()) < most && (n.length() - 1.0).abs() < 1e-5, "{p} {n}");
                }
                assert!(out.iter().flatten().all(|v| (0.0..=1.0).contains(v)));
            });
        }
    }

    #[test]
    fn rounded_facets_have_the_normals_between_corners() {
        let atlas = of(shapes::sphere(DVec3::splat(60.0), 32));
        with(&atlas, 150, |texels| {
            let (mut on, mut smooth) = (three(texels.values.len()), three(texels.values.len()));
            let ([x, y, z], [a, b, c]) = (&mut on, &mut smooth);
            rounded(texels, [x, y, z]);
            normals(texels, true, [a, b, c]);
            let mut least = 1.0_f32;
            for k in (0..texels.values.len()).filter(|k| texels.values[*k] > 0.0) {
                let own = triangle(texels.values[k].abs()).unwrap();
                let [u, v] = atlas.jacobians[own];
                let (right, normal) = (u.normalize(), v.cross(u).normalize());
                let back = right * on[0][k] + right.cross(normal) * on[1][k] + normal * on[2][k];
                let wanted = 2.0 * Vec3::new(smooth[0][k], smooth[1][k], smooth[2][k]) - 1.0;
                assert!(back.distance(wanted) < 1e-5, "{back} {wanted}");
                least = least.min(on[2][k]);
            }
            // Facets of a sphere lean away from it by some degrees, and never face inwards.
            assert!(least > 0.98 && least < 0.999, "{least}");
        });
    }

    /// Gutters end at the border of triangles, and texels in charts stay where they are.
    #[test]
    fn places_on_triangles_stay_on_the_surface() {
        let atlas = of(shapes::cube(DVec3::splat(60.0), 16));
        with(&atlas, 150, |texels| {
            let (mut on, mut plane) = (three(texels.values.len()), three(texels.values.len()));
            let ([x, y, z], [a, b, c]) = (&mut on, &mut plane);
            places_on_triangles(texels, [x, y, z]);
            places(texels, |_| RigidMotion::NONE, [a, b, c]);
            let mut beyond = 0;
            for k in (0..texels.values.len()).filter(|k| texels.values[*k] != 0.0) {
                let [p, q] = [&on, &plane].map(|from| Vec3::new(from[0][k], from[1][k], from[2][k]));
                assert!((p.abs().max_element() - 30.0).abs() < 1e-4, "{p}");
                assert!(texels.values[k] < 0.0 || p.distance(q) < 1e-4);
                beyond += usize::from(q.abs().max_element() > 30.001);
            }
            assert!(beyond > 100);
        });
    }

    #[test]
    fn interpolates_values_of_vertices() {
        let atlas = of(samples::plane_wild());
        let values: Vec<f32> = atlas.mesh.positions.iter().map(|p| 2.0 * p.x - 3.0 * p.y + 1.0).collect();
        with(&atlas, 128, |texels| {
            let (mut at, mut out) = (three(texels.values.len()), vec![f32::NAN; texels.values.len()]);
            let [x, y, z] = &mut at;
            places(texels, |_| RigidMotion::NONE, [x, y, z]);
            of_vertices(texels, &values, &mut out);
            for k in (0..texels.values.len()).filter(|k| texels.values[*k] > 0.0) {
                assert!((out[k] - (2.0 * at[0][k] - 3.0 * at[1][k] + 1.0)).abs() < 1e-3);
            }
            let mut inside = out.clone();
            mask(texels.values, &mut inside);
            let share = inside.iter().sum::<f32>() / inside.len() as f32;
            assert!((f64::from(share) - atlas.used).abs() < 0.01);
        });
    }

    #[test]
    fn matches_stretch_of_charts() {
        // Scaled by 1, 1.4 and 0.8, equally in both directions.
        let atlas = of(samples::plane_wild());
        for n in 0..atlas.uvs.len() {
            let [large, small] = stretch(&atlas, n);
            assert!((large / small - 1.0).abs() < 1e-4);
        }
        let torus = of(shapes::torus(DVec2::splat(60.0), 15.0, 64));
        let ratios = (0..torus.uvs.len()).map(|n| stretch(&torus, n)).map(|[a, b]| a / b);
        let (low, high) = ratios.fold((f64::MAX, 0.0_f64), |(low, high), r| (low.min(r), high.max(r)));
        // From 15 mm to 45 mm from the axis; the scale of the chart is right at 30 mm.
        assert!(low < 1.1 && (1.9..2.1).contains(&high), "{low} {high}");
    }
}
