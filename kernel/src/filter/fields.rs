//! Wide filters as fields: their cost must not grow with their width.
//!
//! Tiles with a halo of hundreds of pixels would read the same surroundings again and again. So data that many tiles
//! share becomes a field of its own, whose tiles the engine caches. A wide blur reads the picture at a half, a quarter
//! … of the resolution, each level computed from the one before. A wide distance transform is split into its passes
//! along rows and columns, which have a halo in one direction only. The choice of the method depends only on the grid,
//! never on the window.

use super::distance::{self, DistanceSpec};
use super::{blur, pyramid};
use crate::ground::tile;
use crate::ground::window::{View, WindowExt};
use glam::{DVec2, UVec2};
use shibo_value::{Buffer, Canvas, Field, FieldSource, Given, Grid, Key, Read, Stop, Tile, Tiling, Type, Window};

/// `input` blurred by a Gaussian of `sigma` mm, on a canvas of `size` mm.
pub fn blurred(input: &Field, sigma: f64, size: DVec2) -> Field {
    let mut levels = vec![input.clone()];
    for _ in 0..MOST_LEVELS {
        let finer = levels.last().unwrap_or(input).clone();
        let key = finer.key().map(|key| Key::of("half", &[key.as_bytes()]));
        levels.push(keyed(Field::new(input.ty(), input.tiling(), Half { finer, size }), key));
    }
    Field::new(input.ty(), input.tiling(), Blurred { levels, sigma, size })
}

/// Maximum number of halvings, enough for any canvas: 2^16 pixels become 256.
const MOST_LEVELS: usize = 8;

/// Number of halvings that the blur does itself within a tile, which is faster.
const WITHIN: u32 = 3;

/// A visible part counts as at least this wide, in pixels: a blur of that width is fast enough.
const LEAST_PART: f64 = 64.0;

/// Maximum number of skipped halvings: up to there positions within a pixel are exact.
const MOST_SKIPPED: f64 = 20.0;

fn keyed(field: Field, key: Option<Key>) -> Field {
    match key {
        Some(key) => field.keyed(key),
        None => field,
    }
}

/// The grid with pixels twice as large.
fn coarser(grid: &Grid) -> Grid {
    let even = |p: &UVec2| p.x.is_multiple_of(2) && p.y.is_multiple_of(2);
    Grid { step: grid.step * 2.0, period: grid.period.filter(even).map(|p| p / 2), ..*grid }
}

/// The grid from which [`coarser`] made this one.
fn finer(grid: &Grid, size: DVec2) -> Grid {
    let step = grid.step * 0.5;
    let period = grid.period.map(|p| p * 2).or_else(|| {
        let pixels = (size / step).round().as_uvec2();
        let canvas = Canvas { size_mm: size, resolution: pixels, tile: Tiling::NONE, seed: 0 };
        (grid.shown.is_none() && canvas.grid(pixels).step == step).then_some(pixels)
    });
    Grid { step, period, ..*grid }
}

/// A field at half the resolution, seen on the grid with pixels half as large.
struct Half {
    finer: Field,
    size: DVec2,
}

impl FieldSource for Half {
    fn inputs(&self, grid: &Grid, at: Window) -> Vec<Read<'_>> {
        let read = pyramid::halve_reads(at);
        vec![Read::new(&self.finer, &finer(grid, self.size), read)]
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let rect = out.window;
        for (channel, plane) in out.planes_mut().into_iter().enumerate() {
            pyramid::halve(&tile::view(given.tile(0), channel), rect, plane);
        }
        Ok(())
    }
}

struct Blurred {
    /// The picture and its halved levels.
    levels: Vec<Field>,
    sigma: f64,
    size: DVec2,
}

/// The method for blurring on a grid.
struct Plan {
    /// Index of the level.
    level: u32,
    /// Number of halvings from the result's pixels to those of the grid that is blurred.
    coarser: u32,
    grid: Grid,
    /// Width in pixels of that grid.
    sigma: [f64; 2],
}

impl Plan {
    /// Pixels of its grid that are blurred to make `rect`.
    fn coarse(&self, rect: Window) -> Window {
        if self.coarser == 0 { rect } else { pyramid::magnify_reads(rect, self.coarser) }
    }
}

impl Blurred {
    /// Number of halvings that are skipped because the input is read directly on a coarser grid. In an enlarged part of
    /// the canvas, the blur can be much wider than the part, and the pixels it reads would be useful for that part
    /// only. The blur hides the loss of detail.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "limited to a few")]
    fn skipped(&self, grid: &Grid) -> u32 {
        let Some(shown) = grid.shown else { return 0 };
        let part = (shown / grid.step).max_element().max(LEAST_PART);
        let wide = self.sigma / grid.step.max_element();
        libm::log2(wide / part).floor().clamp(0.0, MOST_SKIPPED) as u32
    }

    fn plan(&self, grid: &Grid) -> Plan {
        let skipped = self.skipped(grid);
        let (result, grid) = (grid, &(0..skipped).fold(*grid, |grid, _| coarser(&grid)));
        let sigma = (self.sigma / grid.step).to_array();
        let halvings = blur::levels(sigma[0]).min(blur::levels(sigma[1]));
        // The tiles of a level should not be much larger than the canvas.
        let mut most = 0;
        while most + 1 < self.levels.len() && (self.size / grid.step).max_element() > f64::from(128 << most) {
            most += 1;
        }
        let level = halvings.saturating_sub(WITHIN).min(u32::try_from(most).unwrap_or(0));
        let coarser_by = skipped + level;
        if coarser_by == 0 {
            return Plan { level, coarser: 0, grid: *result, sigma };
        }
        let area = libm::exp2(2.0 * f64::from(level));
        let rest = sigma.map(|s| ((s * s - 0.25 * (area - 1.0)) / area - 1.0 / 3.0).sqrt());
        Plan { level, coarser: coarser_by, grid: (0..level).fold(*grid, |grid, _| coarser(&grid)), sigma: rest }
    }

    fn source(&self, plan: &Plan) -> &Field {
        &self.levels[plan.level as usize]
    }
}

impl FieldSource for Blurred {
    fn inputs(&self, grid: &Grid, at: Window) -> Vec<Read<'_>> {
        let plan = self.plan(grid);
        let read = plan.coarse(at).with_halo(plan.sigma.map(blur::halo));
        vec![Read::new(self.source(&plan), &plan.grid, read)]
    }

    fn reaches_by(&self) -> Option<&'static str> {
        Some("radius")
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let plan = self.plan(&out.grid);
        let rect = out.window;
        let (coarse, input) = (plan.coarse(rect), given.tile(0));
        let mut blurred = Buffer::zeros(if plan.coarser == 0 { 0 } else { coarse.len() });
        for (channel, plane) in out.planes_mut().into_iter().enumerate() {
            if plan.coarser == 0 {
                blur::blur(&tile::view(input, channel), rect, plan.sigma, plane);
                continue;
            }
            blur::blur(&tile::view(input, channel), coarse, plan.sigma, &mut blurred);
            pyramid::magnify(&View::new(&blurred, coarse), plan.coarser, rect, plane);
        }
        Ok(())
    }
}

/// Distance in mm from the region where the `Gray` field `input` is above `threshold`, up to `radius` mm; see
/// [`distance`].
pub fn distances(input: &Field, threshold: f32, radius: f64) -> Field {
    let part = |name: &str, down: bool| {
        let parts = [threshold.to_bits().to_le_bytes().to_vec(), radius.to_bits().to_le_bytes().to_vec()];
        let key = input.key().map(|key| Key::of(name, &[key.as_bytes(), &parts[0], &parts[1]]));
        let squares = Squares { input: input.clone(), threshold, radius, down };
        keyed(Field::new(Type::Gray, input.tiling(), squares), key)
    };
    let (rows, columns) = (part("distances along rows", false), part("distances along columns", true));
    Field::new(Type::Gray, input.tiling(), Distances { input: input.clone(), rows, columns, threshold, radius })
}

/// Up to this halo in pixels a single pass is faster.
const ONE_PASS: usize = 40;

struct Squares {
    input: Field,
    threshold: f32,
    radius: f64,
    down: bool,
}

fn spec(grid: &Grid, threshold: f32, radius: f64) -> DistanceSpec {
    DistanceSpec { threshold, radius, step: tile::step(grid) }
}

impl FieldSource for Squares {
    fn inputs(&self, grid: &Grid, at: Window) -> Vec<Read<'_>> {
        let [hx, hy] = spec(grid, self.threshold, self.radius).halo();
        let read = at.with_halo(if self.down { [0, hy] } else { [hx, 0] });
        vec![Read::new(&self.input, grid, read)]
    }

    fn reaches_by(&self) -> Option<&'static str> {
        Some("radius")
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let spec = spec(&out.grid, self.threshold, self.radius);
        let pass = if self.down { distance::column_squares } else { distance::row_squares };
        pass(&tile::view(given.tile(0), 0), out.window, &spec, out.plane_mut(0));
        Ok(())
    }
}

struct Distances {
    input: Field,
    rows: Field,
    columns: Field,
    threshold: f32,
    radius: f64,
}

impl FieldSource for Distances {
    fn inputs(&self, grid: &Grid, at: Window) -> Vec<Read<'_>> {
        let [hx, hy] = spec(grid, self.threshold, self.radius).halo();
        if hx.max(hy) <= ONE_PASS {
            return vec![Read::new(&self.input, grid, at.with_halo([hx, hy]))];
        }
        vec![Read::new(&self.rows, grid, at.with_halo([0, hy])), Read::new(&self.columns, grid, at.with_halo([hx, 0]))]
    }

    fn reaches_by(&self) -> Option<&'static str> {
        Some("radius")
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let rect = out.window;
        let spec = spec(&out.grid, self.threshold, self.radius);
        let [hx, hy] = spec.halo();
        let view = |number: usize| tile::view(given.tile(number), 0);
        if hx.max(hy) <= ONE_PASS {
            distance::distance(&view(0), rect, &spec, out.plane_mut(0));
        } else {
            distance::combine(&view(0), &view(1), rect, &spec, out.plane_mut(0));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wide_blur_of_a_small_part_reads_a_coarse_grid() {
        let size = DVec2::splat(32.0);
        let waves = Field::generate(Type::Gray, Tiling::NONE, |out, _| {
            let (grid, window, width) = (out.grid, out.window, out.window.width.cast_signed());
            for (k, v) in (0..).zip(out.plane_mut(0)) {
                let x = grid.center(window.x + k % width, window.y).x;
                #[expect(clippy::cast_possible_truncation, reason = "a test picture")]
                let value = libm::sin(x * std::f64::consts::TAU / 16.0) as f32;
                *v = value;
            }
            Ok(())
        });
        let (sigma, part) = (2.0, 0.01);
        let step = DVec2::splat(part / 64.0);
        let grid = Grid { origin: DVec2::splat(4.0), step, period: None, shown: Some(DVec2::splat(part)) };
        let window = Window { x: 0, y: 0, width: 64, height: 64 };
        let field = blurred(&waves, sigma, size);
        let reads = field.source().inputs(&grid, window);
        assert!(reads[0].window.len() < 1 << 20, "{:?}", reads[0].window);
        let mut tile = Tile::new(reads[0].grid, reads[0].window, 1);
        // The input itself, or the input halved from a grid that is coarse too.
        let mut source = reads[0].field.source();
        let (mut grids, mut at) = (vec![reads[0].grid], reads[0].window);
        while let Some(read) = source.inputs(&grids[grids.len() - 1], at).first().copied() {
            grids.push(read.grid);
            (source, at) = (read.field.source(), read.window);
        }
        assert!(at.len() < 1 << 22 && grids[grids.len() - 1].step.x > 16.0 * step.x, "{at:?}");
        let center = |x: i32| reads[0].grid.center(x, 0).x;
        let window_read = reads[0].window;
        for y in 0..window_read.rows() {
            for (x, v) in (window_read.x..).zip(tile.row_mut(0, y)) {
                #[expect(clippy::cast_possible_truncation, reason = "a test picture")]
                let value = libm::sin(center(x) * std::f64::consts::TAU / 16.0) as f32;
                *v = value;
            }
        }
        let mut out = Tile::new(grid, window, 1);
        field.source().fill(&Given::new(&[std::sync::Arc::new(tile)], None, &|| false), &mut out).unwrap();
        // A wave of 16 mm keeps exp(-σ²·k²/2) of its height, here at its crest, x = 4 mm.
        let k = std::f64::consts::TAU / 16.0;
        let want = libm::exp(-0.5 * sigma * sigma * k * k);
        assert!(out.plane(0).iter().all(|v| (f64::from(*v) - want).abs() < 0.003), "{} {want}", out.plane(0)[0]);
    }

    #[test]
    fn finer_inverts_coarser() {
        for resolution in [512, 300, 77] {
            let canvas = Canvas {
                resolution: UVec2::splat(resolution),
                size_mm: DVec2::splat(32.0),
                tile: Tiling::BOTH,
                seed: 1,
            };
            let mut grid = canvas.grid(canvas.resolution);
            for _ in 0..5 {
                let up = coarser(&grid);
                assert_eq!(finer(&up, canvas.size_mm), grid);
                grid = up;
            }
        }
    }
}
