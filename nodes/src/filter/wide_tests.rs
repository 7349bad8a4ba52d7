//! Wide filters, which use several fields, give the same result as one call of the kernel.
use crate::testing::{canvas, crop, raster};
use glam::{DVec2, UVec2};
use shibo_kernel::filter::blur;
use shibo_kernel::filter::distance::{self, DistanceSpec};
use shibo_kernel::filter::fields::{blurred, distances};
use shibo_kernel::ground::tile;
use shibo_kernel::ground::window::WindowExt;
use shibo_value::{Canvas, Field, Tiling, Type, Window};

/// A disc, periodic with the canvas of unit tests.
fn input() -> Field {
    Field::generate(Type::Gray, Tiling::BOTH, |out, _| {
        let (grid, window) = (out.grid, out.window);
        for (k, v) in (0..).zip(out.plane_mut(0)) {
            let (x, y) = (window.x + k % window.width.cast_signed(), window.y + k / window.width.cast_signed());
            let at = grid.center(x, y).rem_euclid(DVec2::splat(32.0));
            *v = if (at - DVec2::new(20.0, 11.0)).length() < 4.0 { 1.0 } else { 0.0 };
        }
        Ok(())
    })
}

#[test]
fn wide_blurs_are_gaussian_on_every_level() {
    for resolution in [256, 250, 1000] {
        let canvas = Canvas { resolution: UVec2::splat(resolution), ..canvas() };
        let narrow = raster(&blurred(&input(), 4.0, canvas.size_mm), &canvas);
        let grid = canvas.grid(canvas.resolution);
        let rect = Window::full(canvas.resolution);
        let sigma = [4.0 / grid.step.x; 2];
        let big = rect.with_halo(sigma.map(blur::halo));
        let whole = crop(&input(), &canvas, big);
        let mut direct = vec![0.0; rect.len()];
        blur::blur(&tile::view(&whole, 0), rect, sigma, &mut direct);
        let worst = direct.iter().zip(narrow.data()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(worst < 0.003, "{resolution}: {worst}");
    }
}

#[test]
fn distances_of_fields_and_kernel_agree() {
    let canvas = Canvas { resolution: UVec2::splat(512), ..canvas() };
    let field = distances(&input(), 0.5, 7.0);
    let wide = raster(&field, &canvas);
    let grid = canvas.grid(canvas.resolution);
    let spec = DistanceSpec { threshold: 0.5, radius: 7.0, step: grid.step.to_array() };
    // Wide enough to need two passes.
    assert!(spec.halo()[0] > 40);
    let rect = Window::full(canvas.resolution);
    let whole = crop(&input(), &canvas, rect.with_halo(spec.halo()));
    let mut direct = vec![0.0; rect.len()];
    distance::distance(&tile::view(&whole, 0), rect, &spec, &mut direct);
    assert_eq!(wide.data(), direct);
}
