//! Charts: parts of a surface that are connected in the unit square.
use crate::ground::stop::Watch;
use glam::{DVec2, Vec2};
use shibo_value::Atlas;

/// UVs are multiples of 1/2²⁴. Then `f32` holds them exactly, and the two sides of an edge can be compared exactly.
const STEPS: f64 = 16_777_216.0;

/// Rounds a UV to a multiple of 2⁻²⁴ in the unit square.
pub fn snap(uv: Vec2) -> Vec2 {
    // Adding 0 turns -0 into 0.
    (((uv.as_dvec2() * STEPS).round() / STEPS).clamp(DVec2::ZERO, DVec2::ONE) + 0.0).as_vec2()
}

/// Twice the area of a triangle in the unit square; negative if it is mirrored there.
pub fn cross(uvs: [Vec2; 3]) -> f64 {
    let [a, b, c] = uvs.map(Vec2::as_dvec2);
    (b - a).perp_dot(c - a)
}

/// The charts of a surface.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Charts {
    /// Chart index of each triangle; charts are sorted by their lowest triangles.
    pub of: Vec<u32>,
    /// Number of charts.
    pub count: usize,
    /// For each triangle the edges beyond which its chart continues in the unit square, as bits.
    pub inner: Vec<u8>,
}

/// Finds the charts of a surface: triangles belong together if both sides of a common edge have the same UVs.
///
/// Where the UVs fold over at such an edge, as with mirrored UVs, the two sides are separate charts. Triangles without
/// area in the unit square belong to a chart, but no chart continues across them.
pub fn charts(uvs: &[[Vec2; 3]], across: &[[u32; 3]], watch: &Watch<'_>) -> Charts {
    let areas: Vec<f64> = watch.over(uvs).map(|uvs| cross(*uvs)).collect();
    let mut inner = vec![0u8; uvs.len()];
    let mut joined = vec![0u8; uvs.len()];
    for (n, of) in watch.over(across.iter().enumerate()) {
        for (k, &other) in of.iter().enumerate().filter(|(_, other)| **other != Atlas::END) {
            let (m, l) = ((other >> 2) as usize, (other & 3) as usize);
            let (here, there) = (uvs[n], uvs[m]);
            if here[(k + 1) % 3] == there[(l + 2) % 3] && here[(k + 2) % 3] == there[(l + 1) % 3] {
                let sides = areas[n] * areas[m];
                inner[n] |= u8::from(sides > 0.0) << k;
                joined[n] |= u8::from(sides >= 0.0) << k;
            }
        }
    }
    let (of, count) = components(across, &joined, watch);
    Charts { of, count, inner }
}

/// Numbers the components that edges of `joined` connect.
fn components(across: &[[u32; 3]], joined: &[u8], watch: &Watch<'_>) -> (Vec<u32>, usize) {
    let mut of = vec![u32::MAX; across.len()];
    let mut count = 0;
    let mut open = Vec::new();
    for first in watch.over(0..across.len()) {
        if of[first] != u32::MAX {
            continue;
        }
        of[first] = count;
        open.push(first);
        while let Some(n) = open.pop() {
            watch.tick();
            for k in (0..3).filter(|k| joined[n] & (1 << k) != 0) {
                let m = (across[n][k] >> 2) as usize;
                if of[m] == u32::MAX {
                    of[m] = count;
                    open.push(m);
                }
            }
        }
        count += 1;
    }
    (of, count as usize)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::samples;
    use crate::mesh::topology::topology;

    #[test]
    fn matches_charts_of_files() {
        for (mesh, count) in [
            (samples::cube(), 6),
            (samples::plane_one(), 1),
            (samples::plane_cut(), 5),
            (samples::plane_wild(), 3),
            (samples::sphere(), 20),
        ] {
            let uvs: Vec<_> = mesh.uvs.iter().map(|uvs| uvs.map(snap)).collect();
            let charts = charts(&uvs, &topology(&mesh.triangles).across, &Watch::never());
            assert_eq!(charts.count, count);
            // Charts are numbered by their lowest triangles.
            let mut most = 0;
            for chart in charts.of {
                assert!(chart <= most);
                most = most.max(chart + 1);
            }
        }
    }

    #[test]
    fn splits_folded_uvs_into_two_charts() {
        let corners = [Vec2::new(0.25, 0.25), Vec2::new(0.75, 0.25), Vec2::new(0.25, 0.75)];
        let triangles = [[0, 1, 2], [3, 2, 1]];
        let across = topology(&triangles).across;
        let flat = charts(&[corners, [Vec2::splat(0.75), corners[2], corners[1]]], &across, &Watch::never());
        assert_eq!((flat.count, &flat.inner[..]), (1, &[1, 1][..]));
        let folded = charts(&[corners, [Vec2::splat(0.375), corners[2], corners[1]]], &across, &Watch::never());
        assert_eq!((folded.count, &folded.inner[..]), (2, &[0, 0][..]));
        let thin = charts(&[corners, [Vec2::splat(0.5), corners[2], corners[1]]], &across, &Watch::never());
        assert_eq!((thin.count, &thin.inner[..]), (1, &[0, 0][..]));
        let apart = charts(
            &[corners, [Vec2::splat(0.75), corners[2], corners[1] + Vec2::new(0.0, 1e-7)]],
            &across,
            &Watch::never(),
        );
        assert_eq!((apart.count, &apart.inner[..]), (2, &[0, 0][..]));
    }

    #[test]
    fn snaps_uvs_to_multiples() {
        assert_eq!(snap(Vec2::new(1.00005, -1e-5)), Vec2::new(1.0, 0.0));
        let uv = snap(Vec2::new(0.123_456_79, 0.987_654_3)).as_dvec2() * STEPS;
        assert_eq!(uv.fract(), DVec2::ZERO);
    }
}
