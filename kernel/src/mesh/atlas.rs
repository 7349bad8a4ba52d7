//! Atlases: the layout of a mesh on the canvas, with everything derived from it.
//!
//! Row C19: the Jacobian of a triangle, `J_f = [P1-P0  P2-P0]·[U1-U0  U2-U0]⁻¹`. Cost: O(n).
use super::charts::{Charts, charts, cross, snap};
use super::topology::{watched, watched_normals};
use crate::ground::number::index_u32;
use crate::ground::stop::Watch;
use glam::{DVec2, DVec3, Vec2, Vec3};
use rayon::prelude::*;
use shibo_value::{Atlas, Bins, Key, Mesh};
use std::sync::Arc;

/// Reasons why UVs make no atlas.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum AtlasError {
    /// The mesh has no UVs.
    #[error("it has no UVs")]
    Missing,
    /// UVs leave the unit square.
    #[error("its UVs reach from ({:.4}, {:.4}) to ({:.4}, {:.4}); they must lie between 0 and 1", low.x, low.y, high.x, high.y)]
    Outside {
        /// The smallest u and v.
        low: Vec2,
        /// The largest u and v.
        high: Vec2,
    },
    /// The UVs cover no area of the canvas.
    #[error("its UVs cover nothing: each triangle lies on a line or a point")]
    Flat,
    /// There are too many charts.
    #[error("its UVs fall into {0} charts; there may be 65535 at the most")]
    Charts(usize),
}

/// Number of triangles between two checks of a cancellation.
const AT_ONCE: usize = 1 << 15;

/// Distance by which UVs may leave the unit square without an error.
pub(super) const SLACK: f32 = 1e-4;

/// Change of the point on the surface per unit of u, and of v (row C19); 0 if the triangle has no area in the unit
/// square.
pub fn jacobian(places: [DVec3; 3], uvs: [DVec2; 3]) -> [DVec3; 2] {
    let (p, q) = (places[1] - places[0], places[2] - places[0]);
    let (u, v) = (uvs[1] - uvs[0], uvs[2] - uvs[0]);
    let det = u.perp_dot(v);
    if det == 0.0 { [DVec3::ZERO; 2] } else { [(p * v.y - q * u.y) / det, (q * u.x - p * v.x) / det] }
}

/// Builds the atlas of a mesh with these UVs, v down, on a canvas of `size_mm`.
///
/// # Errors
/// Returns an error if UVs leave the unit square or cover nothing, or if there are too many charts.
pub fn atlas(mesh: Arc<Mesh>, uvs: &[[Vec2; 3]], size_mm: DVec2) -> Result<Atlas, AtlasError> {
    laid_out(mesh, uvs, size_mm, &Watch::never())
}

/// Like [`atlas`], but can be cancelled: unwinds when `watch` says so.
///
/// # Errors
/// As [`atlas`].
pub fn laid_out(mesh: Arc<Mesh>, uvs: &[[Vec2; 3]], size_mm: DVec2, watch: &Watch<'_>) -> Result<Atlas, AtlasError> {
    let uvs = snapped(uvs, mesh.triangles.len(), watch)?;
    let across = watched(&mesh.triangles, watch).across;
    let Charts { of, count, inner } = charts(&uvs, &across, watch);
    let number = |chart: u32| u16::try_from(chart).map_err(|_| AtlasError::Charts(count));
    let charts = of.into_iter().map(number).collect::<Result<_, _>>()?;
    let used = uvs.iter().map(|uvs| 0.5 * cross(*uvs).abs()).sum();
    if used <= 0.0 {
        return Err(AtlasError::Flat);
    }
    let of = |n: usize| jacobian(mesh.corners(n), uvs[n].map(Vec2::as_dvec2)).map(DVec3::as_vec3);
    let mut jacobians = Vec::with_capacity(uvs.len());
    for some in (0..uvs.len()).step_by(AT_ONCE) {
        watch.check();
        let some = (some..uvs.len().min(some + AT_ONCE)).into_par_iter().map(of);
        jacobians.par_extend(some.map(|axes| if finite(axes) { axes } else { [Vec3::ZERO; 2] }));
    }
    Ok(Atlas {
        charts,
        across,
        inner,
        smooth: watched_normals(&mesh, watch),
        jacobians,
        bins: bins(&uvs, watch),
        key: key(&mesh, &uvs, size_mm, watch),
        area: mesh.area(),
        used,
        size_mm,
        uvs,
        mesh,
    })
}

/// Key of all inputs of an atlas.
fn key(mesh: &Mesh, uvs: &[[Vec2; 3]], size_mm: DVec2, watch: &Watch<'_>) -> [u8; 16] {
    let places = bytes(&mesh.positions, |p| p.to_array().map(f32::to_le_bytes), watch);
    let normals = bytes(mesh.normals.as_flattened(), |n| n.to_array().map(f32::to_le_bytes), watch);
    let corners = bytes(uvs.as_flattened(), |uv| uv.to_array().map(f32::to_le_bytes), watch);
    let triangles = bytes(&mesh.triangles, |triangle| triangle.map(u32::to_le_bytes), watch);
    let parts = bytes(&mesh.parts, |part| [part.to_le_bytes()], watch);
    let size: Vec<u8> = size_mm.to_array().iter().flat_map(|side| side.to_le_bytes()).collect();
    *Key::of("atlas", &[&places, &normals, &corners, &triangles, &parts, &size]).as_bytes()
}

/// The bytes of all items, concatenated.
fn bytes<T, const N: usize, const B: usize>(
    items: &[T],
    of: impl Fn(&T) -> [[u8; B]; N],
    watch: &Watch<'_>,
) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(items.len() * N * B);
    for items in items.chunks(AT_ONCE) {
        watch.check();
        items.iter().for_each(|item| bytes.extend_from_slice(of(item).as_flattened()));
    }
    bytes
}

fn finite(axes: [Vec3; 2]) -> bool {
    axes.iter().all(|axis| axis.is_finite())
}

/// Returns whether all UVs lie in the unit square.
pub fn fits(uvs: &[[Vec2; 3]]) -> bool {
    let inside = |uv: &Vec2| uv.cmpge(Vec2::splat(-SLACK)).all() && uv.cmple(Vec2::splat(1.0 + SLACK)).all();
    uvs.iter().flatten().all(inside)
}

/// The error for UVs outside the unit square.
pub(super) fn outside(uvs: &[[Vec2; 3]]) -> AtlasError {
    let ends = uvs.iter().flatten().fold([Vec2::MAX, Vec2::MIN], |[low, high], uv| [low.min(*uv), high.max(*uv)]);
    AtlasError::Outside { low: ends[0], high: ends[1] }
}

/// Rounds the UVs to multiples of 2⁻²⁴ in the unit square.
fn snapped(uvs: &[[Vec2; 3]], triangles: usize, watch: &Watch<'_>) -> Result<Vec<[Vec2; 3]>, AtlasError> {
    if uvs.len() != triangles || triangles == 0 {
        return Err(AtlasError::Missing);
    }
    if !fits(uvs) {
        return Err(outside(uvs));
    }
    Ok(watch.over(uvs).map(|uvs| uvs.map(snap)).collect())
}

/// Number of cells along a side, so that a cell holds about two triangles if all have the same size.
fn side(triangles: usize) -> u32 {
    let cells = (triangles / 2).max(1);
    1 << (cells.ilog2() / 2).min(11)
}

/// The cells that the bounding box of a triangle touches: first and last column, first and last row.
fn cells(uvs: &[Vec2; 3], side: u32) -> [usize; 4] {
    let [a, b, c] = *uvs;
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    // `side` is a power of two, so products are exact.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 0 and side")]
    let cell = |x: f32| ((x * side as f32) as usize).min(side as usize - 1);
    [cell(low.x), cell(high.x), cell(low.y), cell(high.y)]
}

/// Sorts the triangles into the cells that they touch.
fn bins(uvs: &[[Vec2; 3]], watch: &Watch<'_>) -> Bins {
    let mut side = side(uvs.len());
    let entries = |side: u32| -> usize {
        let one = |[left, right, top, bottom]: [usize; 4]| (right - left + 1) * (bottom - top + 1);
        watch.over(uvs).map(|uvs| one(cells(uvs, side))).sum()
    };
    // Large overlapping triangles lie in many cells each; use larger cells then.
    while side > 1 && entries(side) > 8 * uvs.len() + 4096 {
        side /= 2;
    }
    let across = side as usize;
    let mut starts = vec![0u32; across * across + 1];
    let each = |uvs: &[Vec2; 3], body: &mut dyn FnMut(usize)| {
        let [left, right, top, bottom] = cells(uvs, side);
        for row in top..=bottom {
            (row * across + left..=row * across + right).for_each(&mut *body);
        }
    };
    for uvs in watch.over(uvs) {
        each(uvs, &mut |cell| starts[cell + 1] += 1);
    }
    for cell in 1..starts.len() {
        starts[cell] += starts[cell - 1];
    }
    let mut next = starts.clone();
    let mut triangles = vec![0u32; starts[across * across] as usize];
    for (n, uvs) in watch.over(uvs.iter().enumerate()) {
        each(uvs, &mut |cell| {
            triangles[next[cell] as usize] = index_u32(n);
            next[cell] += 1;
        });
    }
    Bins { side, starts, triangles }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples;

    /// Row C19: random triangles, and their Jacobians computed with another program.
    #[test]
    fn matches_jacobians_of_formula() {
        let cases = [
            (
                [
                    [0.42286866022102826, -0.3488517229783176, -0.9074109487329648],
                    [-0.6098023610345127, 0.3731266471985694, 0.8783161961413751],
                    [1.7892132306522461, -0.04208425944242476, 0.5296188834503356],
                ],
                [
                    [1.2029913998308854, -0.909443243600842],
                    [0.6504522328072876, -0.3910586145255392],
                    [-0.3116688246867913, 0.7823565620954586],
                ],
                [
                    [16.41186958575693, 15.501095669623403],
                    [-7.101302619301617, -6.1764359595033795],
                    [-15.21404121774155, -12.771648975104002],
                ],
            ),
            (
                [
                    [1.0856784578799203, 2.073253354154361, 0.5120966803012147],
                    [0.5860003513323648, 1.6894622955124312, 0.1488610819290379],
                    [0.5105889819415711, -0.5014697759719956, -0.05786138455946333],
                ],
                [
                    [-0.6812412426702342, 2.2609923508027148],
                    [0.8703965114444586, 0.7798140510800349],
                    [-0.9091914779194697, 0.2035397632065932],
                ],
                [
                    [-0.04992950775350077, 0.28504711239147285],
                    [0.8566413890058461, 1.156503697010261],
                    [0.02744134771844927, 0.27398094448986465],
                ],
            ),
        ];
        for (places, uvs, wanted) in cases {
            let axes = jacobian(places.map(DVec3::from_array), uvs.map(DVec2::from_array));
            for (row, want) in wanted.iter().enumerate() {
                for (axis, want) in axes.iter().zip(want) {
                    assert!((axis[row] - want).abs() < 1e-9 * want.abs().max(1.0), "{axis} {want}");
                }
            }
        }
        assert_eq!(jacobian([DVec3::X, DVec3::Y, DVec3::Z], [DVec2::X, DVec2::X, DVec2::Y]), [DVec3::ZERO; 2]);
    }

    fn of(mesh: Mesh) -> Atlas {
        let uvs = mesh.uvs.clone();
        atlas(Arc::new(mesh), &uvs, DVec2::splat(100.0)).unwrap()
    }

    #[test]
    fn builds_atlas_of_cube() {
        let cube = of(samples::cube());
        assert_eq!((cube.chart_count(), cube.area, cube.used), (6, 21_600.0, 6.0 / 16.0));
        assert!((cube.scale() - (21_600.0_f64 / 3750.0).sqrt()).abs() < 1e-12);
        for n in 0..12 {
            for k in 0..3 {
                let place = cube.place(n, cube.uvs[n][k].as_dvec2());
                assert!(place.distance(cube.mesh.corners(n)[k]) < 1e-5);
            }
            let [u, v] = cube.jacobians[n].map(|axis| axis.length());
            assert!((u - 240.0).abs() < 1e-3 && (v - 240.0).abs() < 1e-3);
        }
    }

    #[test]
    fn bins_hold_the_triangles_that_touch_them() {
        for mesh in [samples::cube(), samples::plane_wild(), samples::sphere()] {
            let atlas = of(mesh);
            let bins = &atlas.bins;
            let size = 1.0 / bins.side as f32;
            for row in 0..bins.side {
                for column in 0..bins.side {
                    let corner = Vec2::new(column as f32, row as f32) * size;
                    let touches = |n: &u32| {
                        let [a, b, c] = atlas.uvs[*n as usize];
                        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
                        low.cmplt(corner + size).all() && high.cmpge(corner).all()
                    };
                    let want: Vec<u32> = (0..index_u32(atlas.uvs.len())).filter(touches).collect();
                    assert_eq!(bins.cell(column, row), want, "{column} {row}");
                }
            }
        }
    }

    #[test]
    fn overlapping_triangles_take_little_memory() {
        let corners = [Vec2::ZERO, Vec2::X, Vec2::ONE];
        let bins = bins(&vec![corners; 20_000], &Watch::never());
        assert!(bins.triangles.len() <= 8 * 20_000 + 4096, "{}", bins.triangles.len());
    }

    #[test]
    fn rejects_uvs_without_atlas() {
        let cube = samples::cube();
        let make = |uvs: &[[Vec2; 3]]| atlas(Arc::new(cube.clone()), uvs, DVec2::ONE).unwrap_err();
        assert_eq!(make(&[]), AtlasError::Missing);
        let mut uvs = cube.uvs.clone();
        uvs[3][1] = Vec2::new(3.5, -1.0);
        let AtlasError::Outside { low, high } = make(&uvs) else { panic!() };
        assert_eq!((low.y, high.x), (-1.0, 3.5));
        uvs[3][1].x = f32::NAN;
        uvs[3][1].y = 0.5;
        assert!(matches!(make(&uvs), AtlasError::Outside { .. }));
        assert_eq!(make(&[[Vec2::splat(0.5); 3]; 12]), AtlasError::Flat);
    }
}
