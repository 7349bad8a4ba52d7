//! Compares owners and gutters with a search over all triangles.
use super::*;
use crate::ground::number::index_u32;
use crate::mesh::atlas::atlas;
use crate::mesh::samples;
use glam::{UVec2, Vec2};
use shibo_value::Mesh;
use std::sync::Arc;

fn of(mesh: Mesh, size: DVec2) -> Atlas {
    let uvs = mesh.uvs.clone();
    atlas(Arc::new(mesh), &uvs, size).unwrap()
}

fn grid(size: DVec2, pixels: u32) -> Grid {
    Grid { origin: DVec2::ZERO, step: size / f64::from(pixels), period: Some(UVec2::splat(pixels)), shown: None }
}

fn meshes() -> [Mesh; 5] {
    [samples::cube(), samples::plane_one(), samples::plane_cut(), samples::plane_wild(), samples::sphere()]
}

fn values(atlas: &Atlas, grid: &Grid, window: Window) -> Vec<f32> {
    let mut out = vec![f32::NAN; window.len()];
    fill(atlas, grid, window, &mut out);
    out
}

#[test]
fn owners_are_the_lowest_triangles_that_hold_centers() {
    for mesh in meshes() {
        for (size, pixels) in [(DVec2::splat(64.0), 64), (DVec2::new(80.0, 50.0), 97)] {
            let (atlas, grid) = (of(mesh.clone(), size), grid(size, pixels));
            let window = Window { x: -5, y: 3, width: pixels + 9, height: pixels };
            let all: Vec<_> = atlas.uvs.iter().map(|uvs| Barycentric::new(uvs.map(Vec2::as_dvec2)).unwrap()).collect();
            for (n, owner) in owners(&atlas, &grid, window).into_iter().enumerate() {
                let (x, y) = (n % window.columns(), n / window.columns());
                let at = grid.center(-5 + i32::try_from(x).unwrap(), 3 + i32::try_from(y).unwrap()) / size;
                let want = all.iter().position(|b| b.holds(at)).map_or(0, |n| index_u32(n) + 1);
                assert_eq!(owner, want, "{at}");
            }
        }
    }
}

/// Also if edges of triangles pass through the centres of pixels.
#[test]
fn a_plane_without_gaps_is_covered() {
    let size = DVec2::splat(64.0);
    let atlas = of(samples::plane_one(), size);
    for pixels in [16, 64, 128, 512] {
        let grid = grid(size, pixels);
        let owners = owners(&atlas, &grid, Window::full(UVec2::splat(pixels)));
        let [low, high] = [Vec2::MAX, Vec2::MIN];
        let low = atlas.uvs.iter().flatten().fold(low, |a, b| a.min(*b)).as_dvec2();
        let high = atlas.uvs.iter().flatten().fold(high, |a, b| a.max(*b)).as_dvec2();
        for (n, owner) in (0i32..).zip(owners) {
            let side = pixels.cast_signed();
            let at = grid.center(n % side, n / side) / size;
            let inside = at.cmpge(low).all() && at.cmple(high).all();
            assert_eq!(owner > 0, inside, "{at}");
            if let Some(n) = (owner as usize).checked_sub(1) {
                let place = atlas.place(n, at);
                let share = (at - low) / (high - low);
                // The plane's y points up on the canvas or down; x points to the right.
                assert!((place.x - 64.0 * share.x).abs() < 1e-4, "{place}");
                assert!((place.y - 64.0 * share.y).abs().min((place.y - 64.0 + 64.0 * share.y).abs()) < 1e-4);
            }
        }
    }
}

#[test]
fn gutters_are_two_pixels_wide_and_belong_to_the_nearest() {
    for mesh in meshes() {
        let (size, pixels) = (DVec2::splat(64.0), 80);
        let (atlas, grid) = (of(mesh, size), grid(size, pixels));
        let window = Window { x: -4, y: -4, width: pixels + 8, height: pixels + 8 };
        let (owned, values) = (owners(&atlas, &grid, window), values(&atlas, &grid, window));
        let side = window.columns();
        for (n, value) in values.iter().enumerate() {
            if owned[n] > 0 {
                assert_eq!(*value, owned[n] as f32);
                continue;
            }
            let (x, y) = (n % side, n / side);
            let around = |reach: usize| {
                let rows = y.saturating_sub(reach)..=(y + reach).min(side - 1);
                let columns = x.saturating_sub(reach)..=(x + reach).min(side - 1);
                rows.flat_map(move |y| columns.clone().map(move |x| y * side + x))
            };
            let near = around(2).any(|m| owned[m] > 0);
            assert_eq!(*value < 0.0, near);
            assert!(*value <= 0.0);
            // In the first ring, the nearest of the triangles around.
            let candidates: Vec<u32> = around(1).map(|m| owned[m]).filter(|id| *id > 0).collect();
            if let Some(own) = triangle(*value).filter(|_| !candidates.is_empty()) {
                let at = grid.center(-4 + i32::try_from(x).unwrap(), -4 + i32::try_from(y).unwrap());
                let of = |n: usize| distance(atlas.uvs[n].map(|uv| uv.as_dvec2() * size), at);
                let least = candidates.iter().map(|id| of(*id as usize - 1)).fold(f64::INFINITY, f64::min);
                assert!(candidates.contains(&(index_u32(own) + 1)) && of(own) == least);
            }
        }
    }
}

#[test]
fn windows_have_the_same_bits() {
    for mesh in meshes() {
        let (size, pixels) = (DVec2::new(64.0, 48.0), 100);
        let (atlas, grid) = (of(mesh, size), grid(size, pixels));
        let all = Window { x: -10, y: -10, width: 120, height: 120 };
        let whole = values(&atlas, &grid, all);
        for window in [(-10, 17, 1, 30), (30, 30, 40, 40), (55, -3, 17, 1), (99, 99, 8, 8)] {
            let (x, y, width, height) = window;
            let part = values(&atlas, &grid, Window { x, y, width, height });
            for (row, line) in part.chunks(width as usize).enumerate() {
                let start = (y + 10) as usize * 120 + row * 120 + (x + 10) as usize;
                assert_eq!(line, &whole[start..start + width as usize], "{window:?}");
            }
        }
    }
}

#[test]
fn flat_triangles_hold_nothing() {
    let mut mesh = samples::plane_one();
    let count = mesh.triangles.len();
    mesh.uvs[3] = [Vec2::new(0.5, 0.5), Vec2::new(0.75, 0.75), Vec2::new(0.25, 0.25)];
    let atlas = of(mesh, DVec2::splat(64.0));
    let owners = owners(&atlas, &grid(atlas.size_mm, 64), Window::full(UVec2::splat(64)));
    assert!(owners.iter().all(|owner| *owner != 4 && *owner as usize <= count));
    assert_eq!(triangle(0.0), None);
    assert_eq!((triangle(4.0), triangle(-1.0)), (Some(3), Some(0)));
}
