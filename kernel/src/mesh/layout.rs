//! Checks the layout of an atlas: overlaps of charts, and the distance between them.
use super::texels::{centers, held, owners};
use crate::ground::stop::Watch;
use glam::DVec2;
use shibo_value::{Atlas, Grid, Window};

/// Minimum barycentric coordinate of a centre in two triangles to count as covered twice.
const INSIDE: f64 = 1e-4;

/// Findings on a grid of texels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Layout {
    /// Share of the texels in charts that several triangles cover, and two of these triangles.
    pub overlap: Option<(f64, [usize; 2])>,
    /// True if the distance of two charts is less than two texels, so that their gutters meet.
    pub close: bool,
}

/// Number of rows between two checks of a cancellation.
const ROWS: u32 = 32;

/// Checks an atlas with `side` texels along each side. O(side²).
///
/// Unwinds when `watch` says so.
pub fn layout(atlas: &Atlas, side: u32, watch: &Watch<'_>) -> Layout {
    let step = atlas.size_mm / f64::from(side);
    let grid = Grid { origin: DVec2::ZERO, step, period: None, shown: None };
    let mut owned = Vec::with_capacity((side * side) as usize);
    for y in (0..side).step_by(ROWS as usize) {
        watch.check();
        let strip = Window { x: 0, y: y.cast_signed(), width: side, height: ROWS.min(side - y) };
        owned.extend(owners(atlas, &grid, strip));
    }
    Layout { overlap: overlap(atlas, &grid, &owned, watch), close: close(atlas, &owned, side as usize, watch) }
}

/// Share of the texels that several triangles cover.
fn overlap(atlas: &Atlas, grid: &Grid, owned: &[u32], watch: &Watch<'_>) -> Option<(f64, [usize; 2])> {
    let side = owned.len().isqrt();
    let us = centers(grid.origin.x, grid.step.x, atlas.size_mm.x, 0, side);
    let vs = centers(grid.origin.y, grid.step.y, atlas.size_mm.y, 0, side);
    let (mut first, mut twice) = (None, vec![false; owned.len()]);
    let mut inside = vec![0u32; owned.len()];
    for n in watch.over(0..atlas.uvs.len()) {
        held(atlas, n, (&us, &vs), INSIDE, |row, columns| {
            let start = row * us.len();
            for k in start + columns.start..start + columns.end {
                if inside[k] == 0 {
                    inside[k] = u32::try_from(n + 1).unwrap_or(u32::MAX);
                } else {
                    twice[k] = true;
                    first.get_or_insert([inside[k] as usize - 1, n]);
                }
            }
        });
    }
    let count = |all: usize| twice.iter().filter(|twice| **twice).count() as f64 / all.max(1) as f64;
    first.map(|pair| (count(owned.iter().filter(|owner| **owner > 0).count()), pair))
}

/// Returns whether texels of two charts are at most two texels apart.
fn close(atlas: &Atlas, owned: &[u32], side: usize, watch: &Watch<'_>) -> bool {
    let chart = |k: usize| (owned[k] > 0).then(|| atlas.charts[owned[k] as usize - 1]);
    watch.over(0..owned.len()).any(|k| {
        let Some(own) = chart(k) else { return false };
        let (x, y) = (k % side, k / side);
        let other = |dx: usize, dy: usize| {
            x + dx < side && y + dy < side && chart(k + dy * side + dx).is_some_and(|c| c != own)
        };
        other(1, 0) || other(2, 0) || other(0, 1) || other(0, 2) || other(1, 1) || other(2, 2)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::atlas::atlas;
    use crate::mesh::{samples, shapes};
    use glam::{DVec3, Vec2};
    use shibo_value::Mesh;
    use std::sync::Arc;

    fn of(mesh: Mesh) -> Atlas {
        let uvs = mesh.uvs.clone();
        atlas(Arc::new(mesh), &uvs, DVec2::new(90.0, 60.0)).unwrap()
    }

    #[test]
    fn charts_beside_each_other_do_not_overlap() {
        for mesh in [samples::cube(), samples::plane_cut(), samples::sphere(), shapes::cylinder(DVec3::splat(9.0), 64)]
        {
            assert_eq!(layout(&of(mesh), 512, &Watch::never()).overlap, None);
        }
        // With few texels, charts are close.
        assert!(!layout(&of(shapes::cube(DVec3::splat(60.0), 8)), 256, &Watch::never()).close);
        assert!(layout(&of(shapes::cube(DVec3::splat(60.0), 8)), 32, &Watch::never()).close);
    }

    #[test]
    fn finds_overlapping_charts() {
        let mut mesh = samples::cube();
        // Lay the first side over the third.
        for uv in mesh.uvs[..2].as_flattened_mut() {
            *uv += Vec2::new(0.625, 0.0);
        }
        let found = layout(&of(mesh), 256, &Watch::never());
        let (share, [a, b]) = found.overlap.unwrap();
        assert!((share - 0.2).abs() < 0.02 && a < 2 && (4..6).contains(&b), "{share} {a} {b}");
    }
}
