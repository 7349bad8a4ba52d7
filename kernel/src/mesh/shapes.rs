//! Meshes of simple shapes, with UVs: no chart is mirrored, and none touches another.
//!
//! Each is made of patches, which are grids of quads cut into triangles, and welded afterwards. Cost: O(triangles).
use super::topology::weld;
use crate::ground::number::index_u32;
use crate::ground::stop::Watch;
use glam::{DVec2, DVec3};
use shibo_value::Mesh;
use std::f64::consts::{FRAC_PI_4, PI, TAU};

/// Free margin around charts, in units of the unit square.
const MARGIN: f64 = 1.0 / 64.0;

/// A corner of a patch.
struct Corner {
    place: DVec3,
    normal: DVec3,
    /// Position in the unit square, v down.
    uv: DVec2,
}

/// Builds a mesh from patches.
#[derive(Default)]
struct Patches {
    mesh: Mesh,
    quads: u32,
}

impl Patches {
    /// Adds a grid of `columns` × `rows` quads; seen from outside, columns go to the right and rows go up.
    fn add(&mut self, [columns, rows]: [u32; 2], corner: impl Fn(u32, u32) -> Corner) {
        let first = index_u32(self.mesh.positions.len());
        let corners: Vec<Corner> =
            (0..=rows).flat_map(|j| (0..=columns).map(move |i| (i, j))).map(|(i, j)| corner(i, j)).collect();
        self.mesh.positions.extend(corners.iter().map(|c| c.place.as_vec3()));
        for (i, j) in (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j))) {
            let at = |i: u32, j: u32| j * (columns + 1) + i;
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            for triangle in [[a, b, c], [a, c, d]] {
                self.mesh.triangles.push(triangle.map(|v| first + v));
                self.mesh.uvs.push(triangle.map(|v| corners[v as usize].uv.as_vec2()));
                self.mesh.normals.push(triangle.map(|v| corners[v as usize].normal.as_vec3()));
                self.mesh.polygons.push(self.quads);
                self.mesh.parts.push(0);
            }
            self.quads += 1;
        }
    }

    /// Returns the mesh; positions that differ only by rounding are merged.
    fn done(mut self, name: &str) -> Mesh {
        let [low, high] = self.mesh.bounds();
        weld(&mut self.mesh, 1e-6 * (high - low).max_element(), &Watch::never());
        self.mesh.part_names.push(name.into());
        self.mesh
    }
}

/// Step `i` of `n` as a share; exactly 1 at the end.
fn share(i: u32, n: u32) -> f64 {
    f64::from(i) / f64::from(n)
}

/// The direction in the xy-plane at step `i` of `n` around the circle; the last is the same as the first.
fn around(i: u32, n: u32) -> DVec2 {
    let angle = TAU * share(i % n, n);
    DVec2::new(libm::cos(angle), libm::sin(angle))
}

/// A flat sheet that faces up; its longer side is as wide as the unit square.
pub fn plane(size: DVec2, segments: u32) -> Mesh {
    let n = (segments / 4).max(1);
    let mut patches = Patches::default();
    patches.add([n, n], |i, j| {
        let at = DVec2::new(share(i, n), share(j, n));
        let uv = DVec2::new(at.x, 1.0 - at.y) * size / size.max_element();
        Corner { place: (size * (at - 0.5)).extend(0.0), normal: DVec3::Z, uv }
    });
    patches.done("plane")
}

/// The six sides of a box: the directions to the right, up and outwards.
const SIDES: [[DVec3; 3]; 6] = [
    [DVec3::Y, DVec3::Z, DVec3::X],
    [DVec3::NEG_X, DVec3::Z, DVec3::Y],
    [DVec3::NEG_Y, DVec3::Z, DVec3::NEG_X],
    [DVec3::X, DVec3::Z, DVec3::NEG_Y],
    [DVec3::X, DVec3::Y, DVec3::Z],
    [DVec3::X, DVec3::NEG_Y, DVec3::NEG_Z],
];

/// Six patches in three columns and two rows; `corner` returns position and normal of a side at (-1..1, -1..1).
fn six(name: &str, n: u32, lengths: DVec3, corner: impl Fn([DVec3; 3], DVec2) -> (DVec3, DVec3)) -> Mesh {
    let mut patches = Patches::default();
    for (number, side) in (0u32..).zip(SIDES) {
        let extent = DVec2::new(lengths.dot(side[0].abs()), lengths.dot(side[1].abs())) / lengths.max_element();
        let cell = DVec2::new(f64::from(number % 3), f64::from(number / 3));
        patches.add([n, n], |i, j| {
            let at = DVec2::new(share(i, n), share(j, n));
            let (place, normal) = corner(side, 2.0 * at - 1.0);
            let within = DVec2::new(at.x, 1.0 - at.y) * extent * (1.0 / 3.0 - 2.0 * MARGIN);
            Corner { place, normal, uv: cell / 3.0 + MARGIN + within }
        });
    }
    patches.done(name)
}

/// A box; each side is a chart.
pub fn cube(size: DVec3, segments: u32) -> Mesh {
    six("cube", (segments / 8).max(1), size, |[right, up, out], at| {
        ((right * at.x + up * at.y + out) * 0.5 * size, out)
    })
}

/// A sphere or ellipsoid: the sides of a box projected outwards, with even angles to keep the stretch of charts low.
pub fn sphere(size: DVec3, segments: u32) -> Mesh {
    six("sphere", (segments / 4).max(2), DVec3::ONE, |[right, up, out], at| {
        let unit = (right * libm::tan(at.x * FRAC_PI_4) + up * libm::tan(at.y * FRAC_PI_4) + out).normalize();
        (unit * 0.5 * size, (unit / size).normalize())
    })
}

/// A torus with a round tube about the z axis: one chart, which meets itself on all four sides.
pub fn torus(size: DVec2, tube: f64, segments: u32) -> Mesh {
    let n = [segments.max(3), (segments / 2).max(3)];
    let mean = 0.25 * (size.x + size.y);
    let room = 1.0 - 2.0 * MARGIN;
    let extent = DVec2::new(mean, tube) * (room / mean.max(tube));
    let mut patches = Patches::default();
    patches.add(n, |i, j| {
        let (ring, round) = (around(i, n[0]), around(j, n[1]));
        let normal = (ring * round.x).extend(round.y);
        let uv = DVec2::new(share(i, n[0]), 1.0 - share(j, n[1])) * extent + MARGIN;
        Corner { place: (0.5 * size * ring).extend(0.0) + tube * normal, normal, uv }
    });
    patches.done("torus")
}

/// A cylinder about the z axis: its side, cut once, and two caps.
pub fn cylinder(size: DVec3, segments: u32) -> Mesh {
    let n = segments.max(3);
    let radius = 0.5 * size.truncate();
    let mean = 0.5 * radius.element_sum();
    // Layout: the side above, the caps below it.
    let height = size.z + radius.y * 2.0;
    let scale = ((1.0 - 2.0 * MARGIN) / (TAU * mean)).min((1.0 - 4.0 * MARGIN) / height);
    let rows = (f64::from(n) * size.z / (TAU * mean)).round().clamp(1.0, f64::from(n.min(512)));
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the segments")]
    let rows = rows as u32;
    let mut patches = Patches::default();
    patches.add([n, rows], |i, j| {
        let (ring, up) = (around(i, n), share(j, rows));
        let uv = DVec2::new(TAU * mean * share(i, n), size.z * (1.0 - up)) * scale + MARGIN;
        let normal = (ring / radius).normalize().extend(0.0);
        Corner { place: (ring * radius).extend(size.z * (up - 0.5)), normal, uv }
    });
    for (side, column) in [(1.0, 1.0), (-1.0, 3.5)] {
        let middle = DVec2::new(column * radius.x, size.z + radius.y) * scale + MARGIN * DVec2::new(column, 2.0);
        // A cap is a patch whose first row is the rim, and whose last row is the middle.
        patches.add([n, 1], |i, j| {
            let ring = if j == 0 { around(if side > 0.0 { i } else { n - i }, n) } else { DVec2::ZERO };
            let flat = ring * radius;
            let uv = middle + DVec2::new(flat.x, -side * flat.y) * scale;
            Corner { place: flat.extend(side * 0.5 * size.z), normal: DVec3::Z * side, uv }
        });
    }
    patches.done("cylinder")
}

/// Angle from which a corner of a profile is an edge.
const EDGE: f64 = 40.0 * PI / 180.0;

/// A body of rotation about the z axis: rotates a profile of (radius, z) around it. Corners of the profile of less than
/// 40° are smooth. Inside is the side on which the profile encloses the axis, whichever way the profile runs.
pub fn lathe(profile: &[DVec2], segments: u32) -> Mesh {
    let n = segments.max(3);
    let mut profile = profile.to_vec();
    let volume: f64 = profile.windows(2).map(|p| (p[1].y - p[0].y) * (p[0].x + p[1].x).powi(2)).sum();
    if volume < 0.0 {
        profile.reverse();
    }
    let lengths: Vec<f64> = profile.windows(2).map(|p| p[0].distance(p[1])).collect();
    let widest = profile.iter().fold(0.0, |most: f64, p| most.max(p.x));
    let (width, height) = (TAU * widest, lengths.iter().sum::<f64>());
    let scale = (1.0 - 2.0 * MARGIN) / width.max(height);
    let mut patches = Patches::default();
    let mut below = 0.0;
    for (k, length) in lengths.iter().enumerate() {
        let normals = [0, 1].map(|end| profile_normal(&profile, k, end));
        patches.add([n, 1], |i, j| {
            let (ring, p) = (around(i, n), profile[k + j as usize]);
            let uv = DVec2::new(width * share(i, n), height - below - f64::from(j) * length) * scale + MARGIN;
            let normal = normals[j as usize];
            Corner { place: (ring * p.x).extend(p.y), normal: (ring * normal.x).extend(normal.y), uv }
        });
        below += length;
    }
    patches.done("lathe")
}

/// The normal of segment `k` of a profile at its end 0 or 1: the mean of both segments there, if the corner is smooth.
fn profile_normal(profile: &[DVec2], k: usize, end: usize) -> DVec2 {
    let normal =
        |k: usize| Some((*profile.get(k + 1)? - *profile.get(k)?).normalize_or_zero()).map(|d| DVec2::new(d.y, -d.x));
    let own = normal(k).unwrap_or_default();
    let other = if end == 1 { normal(k + 1) } else { k.checked_sub(1).and_then(normal) };
    let other = other.filter(|other| own.dot(*other) > libm::cos(EDGE)).unwrap_or(own);
    (own + other).normalize_or(own)
}

/// A profile through these points, smooth except at corners of 40° and more, in segments of at most `piece`.
pub fn smooth_profile(points: &[DVec2], piece: f64) -> Vec<DVec2> {
    let tangent = |k: usize| -> Option<DVec2> {
        let (a, b, c) = (points[k.checked_sub(1)?], points[k], *points.get(k + 1)?);
        let (back, on) = (b - a, c - b);
        let smooth = libm::atan2(back.perp_dot(on), back.dot(on)).abs() < EDGE;
        smooth.then(|| (back.normalize() * on.length() + on.normalize() * back.length()).normalize_or_zero())
    };
    let mut out = Vec::from(&points[..points.len().min(1)]);
    for (k, ends) in points.windows(2).enumerate() {
        let chord = ends[1] - ends[0];
        let length = chord.length();
        let (from, to) = (tangent(k), tangent(k + 1));
        if from.is_none() && to.is_none() {
            out.push(ends[1]);
            continue;
        }
        // At a corner, the tangent mirrors that of the other end.
        let mirrored = |t: DVec2| 2.0 * chord.dot(t) / (length * length) * chord - t;
        let a = length * from.or(to.map(mirrored)).unwrap_or_default();
        let b = length * to.or(from.map(mirrored)).unwrap_or_default();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped")]
        let count = (length / piece).ceil().clamp(1.0, 256.0) as u32;
        for step in 1..=count {
            let t = share(step, count);
            let (t2, t3) = (t * t, t * t * t);
            let ways = ends[0] * (2.0 * t3 - 3.0 * t2 + 1.0) + ends[1] * (3.0 * t2 - 2.0 * t3);
            let at = ways + a * (t3 - 2.0 * t2 + t) + b * (t3 - t2);
            out.push(if step == count { ends[1] } else { DVec2::new(at.x.max(0.0), at.y) });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::atlas::atlas;
    use crate::mesh::charts::cross;
    use crate::mesh::texels::owners;
    use crate::mesh::topology::topology;
    use glam::UVec2;
    use shibo_value::{Atlas, Grid, Window};
    use std::sync::Arc;

    fn bowl() -> Vec<DVec2> {
        [(0.0, 0.0), (30.0, 0.0), (50.0, 30.0), (60.0, 45.0), (55.0, 45.0), (40.0, 20.0), (0.0, 6.0)]
            .map(DVec2::from)
            .into()
    }

    /// Each mesh, its Euler characteristic, its number of charts, and whether it has a boundary.
    fn shapes(segments: u32) -> Vec<(Mesh, i64, usize, bool)> {
        let size = DVec3::new(60.0, 60.0, 60.0);
        vec![
            (plane(DVec2::new(60.0, 40.0), segments), 1, 1, true),
            (cube(size, segments), 2, 6, false),
            (cube(DVec3::new(60.0, 20.0, 5.0), segments), 2, 6, false),
            (sphere(size, segments), 2, 6, false),
            (torus(size.truncate(), 15.0, segments), 0, 1, false),
            (torus(size.truncate(), 29.0, segments), 0, 1, false),
            (cylinder(size, segments), 2, 3, false),
            (cylinder(DVec3::new(10.0, 20.0, 300.0), segments), 2, 3, false),
            (lathe(&bowl(), segments), 2, 1, false),
        ]
    }

    #[test]
    fn shapes_are_closed_and_face_outwards() {
        for segments in [3, 8, 64] {
            for (mesh, euler, charts, open) in shapes(segments) {
                let name = &mesh.part_names[0];
                let found = topology(&mesh.triangles);
                assert_eq!((found.crowded, found.twisted), (0, 0), "{name}");
                assert_eq!(found.across.iter().flatten().any(|other| *other == Atlas::END), open, "{name}");
                let edges: usize =
                    found.across.iter().flatten().map(|other| if *other == Atlas::END { 2 } else { 1 }).sum();
                let count = |n: usize| i64::try_from(n).unwrap();
                let own = count(mesh.positions.len()) - count(edges) / 2 + count(mesh.triangles.len());
                assert_eq!(own, euler, "{name} {segments}");
                let volume: f64 = (0..mesh.triangles.len()).map(|n| mesh.cross(n).dot(mesh.corners(n)[0]) / 6.0).sum();
                assert!(open || volume > 0.0, "{name}");
                for (n, normals) in mesh.normals.iter().enumerate() {
                    assert!(normals.iter().all(|normal| (normal.length() - 1.0).abs() < 1e-5), "{name}");
                    let mean = normals.iter().map(|normal| normal.as_dvec3()).sum::<DVec3>();
                    assert!(mean.dot(mesh.cross(n)) > 0.0, "{name} {n}");
                }
                let uvs = mesh.uvs.clone();
                let atlas = atlas(Arc::new(mesh.clone()), &uvs, DVec2::ONE).unwrap();
                assert_eq!(atlas.chart_count(), charts, "{name} {segments}");
            }
        }
    }

    /// Each texel has one triangle, charts keep apart, and seen from outside none is mirrored.
    #[test]
    fn keeps_charts_apart_and_unmirrored() {
        for (mesh, ..) in shapes(32) {
            let name = mesh.part_names[0].clone();
            assert!(mesh.uvs.iter().all(|uvs| cross(*uvs) < 0.0), "{name}");
            let uvs = mesh.uvs.clone();
            let atlas = atlas(Arc::new(mesh), &uvs, DVec2::ONE).unwrap();
            let grid = Grid { origin: DVec2::ZERO, step: DVec2::splat(1.0 / 256.0), period: None, shown: None };
            let owned = owners(&atlas, &grid, Window::full(UVec2::splat(256)));
            let count = owned.iter().filter(|owner| **owner > 0).count() as f64 / 65536.0;
            assert!((count - atlas.used).abs() < 0.01, "{name} {count} {}", atlas.used);
            let chart = |owner: u32| (owner > 0).then(|| atlas.charts[owner as usize - 1]);
            for (n, owner) in owned.iter().enumerate().filter(|(n, _)| n % 256 > 1 && *n > 512) {
                for other in [n - 1, n - 2, n - 256, n - 512] {
                    let pair = chart(*owner).zip(chart(owned[other]));
                    assert!(pair.is_none_or(|(a, b)| a == b), "{name}");
                }
            }
        }
    }

    #[test]
    fn matches_areas_of_shapes() {
        let (size, n) = (DVec3::splat(60.0), 256);
        for (mesh, area) in [
            (plane(DVec2::new(60.0, 40.0), n), 2400.0),
            (cube(size, n), 21_600.0),
            (sphere(size, n), 4.0 * PI * 900.0),
            (torus(size.truncate(), 15.0, n), 4.0 * PI * PI * 450.0),
            (cylinder(size, n), PI * (1800.0 + 3600.0)),
            (lathe(&[DVec2::new(0.0, -30.0), DVec2::new(40.0, 0.0)], n), PI * 40.0 * 50.0),
        ] {
            assert!((mesh.area() / area - 1.0).abs() < 2e-3, "{} {area}", mesh.area());
        }
    }

    #[test]
    fn profiles_are_smooth_but_for_corners() {
        let points = [(0.0, 0.0), (30.0, 0.0), (38.0, 14.0), (40.0, 30.0), (38.0, 46.0), (0.0, 50.0)].map(DVec2::from);
        let curve = smooth_profile(&points, 1.0);
        assert!(points.iter().all(|p| curve.contains(p)));
        let ways: Vec<DVec2> = curve.windows(2).map(|p| p[1] - p[0]).collect();
        let sharp = ways.windows(2).filter(|w| w[0].angle_to(w[1]).abs() > 0.25).count();
        assert_eq!(sharp, 2, "the corners at the foot and the rim");
        assert_eq!(smooth_profile(&points[..2], 1.0), &points[..2]);
    }
}
