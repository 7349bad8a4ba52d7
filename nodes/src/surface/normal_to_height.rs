//! [`NormalToHeight`]: the height for a normal map.
//!
//! Solves Poisson's equation by Fourier transforms (R. Frankot, R. Chellappa, 1988); see
//! [`kernel::poisson`](shibo_kernel::surface::poisson). Every height depends on all normals, so this is an operation on
//! the whole picture; it is solved once per resolution. Cost: O(n log n), and 16 bytes of memory a pixel; for each
//! direction in which the result does not tile, twice as much.
use glam::{DVec2, UVec2};
use rayon::prelude::*;
use shibo_kernel::filter::sample::{Filter, Outside, Sampler};
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::tile;
use shibo_kernel::surface::poisson::Poisson;
use shibo_node::{CanvasFacts, Context, Fact, In, Node, NormalField, Output, Outputs, node};
use shibo_value::{Canvas, Field, FieldSource, Given, Grid, Pictures, Read, Stop, TILE, Tile, Tiling, Type, Window};

/// Computes the height whose slopes fit a normal map best. Its mean is 0.
///
/// A whole-picture operation. If the canvas tiles and the normals repeat, the result repeats and is exact; otherwise
/// the surface is assumed to be flat across its edges.
///
/// ```ron
/// "noise": Fractal(size: 12, octaves: 5),
/// "hills": Remap(input: "noise", to: (0, 4)),
/// "normal": HeightToNormal(input: "hills"),
/// "height": NormalToHeight(input: "normal"),
/// "example": Relief(height: "height"),
/// ```
///
/// Elsewhere: Substance Designer *Normal to Height*, *Normal to Height HQ*.
#[node]
pub struct NormalToHeight {
    /// The tangent-space normals.
    pub input: In<NormalField>,
    /// Factor on the height: 1 is true to scale.
    #[schemars(range(min = -1e6, max = 1e6))]
    #[default(1.0)]
    pub strength: f64,
    /// True if green points up the picture (OpenGL, glTF, Blender), false if down (DirectX).
    #[default(true)]
    pub y_up: bool,
}

/// Minimum z of a normal: a flatter one counts as a slope of 100.
const FLATTEST: f32 = 0.01;

/// The height computed from normals.
struct Integrated {
    input: Field,
    /// The canvas, mm.
    size: DVec2,
    wrap: Tiling,
    strength: f64,
    y_up: bool,
}

impl Integrated {
    /// The grid of the canvas, with pixels of the size of those of `grid`.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "limited to the pixels of a canvas")]
    fn canvas(&self, grid: &Grid) -> (Grid, UVec2) {
        let side = |n: f64| n.round().clamp(1.0, f64::from(Canvas::MAX_RESOLUTION)) as u32;
        let pixels = grid.period.unwrap_or_else(|| {
            let pixels = self.size / grid.step;
            UVec2::new(side(pixels.x), side(pixels.y))
        });
        (Grid { origin: DVec2::ZERO, step: self.size / pixels.as_dvec2(), period: Some(pixels), shown: None }, pixels)
    }

    /// Slopes to the right and down, from normals stored as ½ + ½n.
    fn slopes(&self, normals: &Tile, row: usize) -> [Vec<f32>; 2] {
        let [x, y, z] = [0, 1, 2].map(|k| normals.row(k, row));
        let up = narrow(self.strength) * if self.y_up { 1.0 } else { -1.0 };
        let slope = |n: &[f32], factor: f32| {
            let slope = |(n, z): (&f32, &f32)| factor * (2.0 * n - 1.0) / (2.0 * z - 1.0).max(FLATTEST);
            n.iter().zip(z).map(slope).collect()
        };
        [slope(x, -narrow(self.strength)), slope(y, up)]
    }
}

impl FieldSource for Integrated {
    fn inputs(&self, _grid: &Grid, _window: Window) -> Vec<Read<'_>> {
        Vec::new()
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let Some(height) = given.prepared() else { return Ok(()) };
        let view = tile::view(height, 0);
        let outside = [self.wrap.x, self.wrap.y].map(|wrap| if wrap { Outside::Wrap } else { Outside::Clamp });
        let same = out.grid.origin == DVec2::ZERO && out.grid.step == height.grid.step;
        let filter = if same { Filter::Nearest } else { Filter::CatmullRom };
        let sampler = Sampler::new(view, filter, outside);
        let (grid, window, width) = (out.grid, out.window, out.width());
        for (row, y) in (window.y..window.bottom()).enumerate() {
            given.check()?;
            let at = |x: i32| ((grid.center(x, y)) / height.grid.step).as_vec2();
            let line = &mut out.plane_mut(0)[row * width..(row + 1) * width];
            line.iter_mut().zip(window.x..).for_each(|(out, x)| *out = sampler.at(at(x).x, at(x).y));
        }
        Ok(())
    }

    fn whole(&self, grid: &Grid) -> Vec<Read<'_>> {
        let (grid, pixels) = self.canvas(grid);
        vec![Read::new(&self.input, &grid, Window::full(pixels))]
    }

    fn prepare(&self, grid: &Grid, pictures: &dyn Pictures) -> Result<Option<Tile>, Stop> {
        let (grid, pixels) = self.canvas(grid);
        let size = pixels.to_array().map(|n| n as usize);
        let mut poisson = Poisson::new(size, tile::step(&grid), [self.wrap.x, self.wrap.y]);
        for y in (0..pixels.y).step_by(TILE as usize) {
            let band = Window { x: 0, y: y.cast_signed(), width: pixels.x, height: TILE.min(pixels.y - y) };
            let normals = pictures.read(0, band)?;
            let slopes: Vec<_> = (0..normals.height()).into_par_iter().map(|row| self.slopes(&normals, row)).collect();
            for (row, [p, q]) in slopes.iter().enumerate() {
                poisson.set_row(y as usize + row, p, q);
            }
        }
        pictures.check()?;
        let height = poisson.solve(&|| pictures.check().is_err());
        pictures.check()?;
        let mut out = Tile::new(grid, Window::full(pixels), 1);
        if let Some(height) = height {
            out.data_mut().copy_from_slice(&height);
        }
        Ok(Some(out))
    }

    fn prepare_bytes(&self, grid: &Grid) -> u64 {
        let pixels = self.canvas(grid).1.to_array().map(|n| n as usize);
        Poisson::bytes(pixels, [self.wrap.x, self.wrap.y]) + 4 * (pixels[0] * pixels[1]) as u64
    }
}

impl Node for NormalToHeight {
    const OUTPUTS: &'static [Output] = &[Output::new("height", Type::Gray, "The height; its mean is 0.").in_unit("mm")];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn whole_bytes(&self, pixels: UVec2, _canvas: &CanvasFacts) -> u64 {
        // For normals that repeat; otherwise the picture is mirrored and needs more.
        Poisson::bytes(pixels.to_array().map(|n| n as usize), [true; 2]) + 4 * u64::from(pixels.x) * u64::from(pixels.y)
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (input, size) = (cx.get(&self.input)?, cx.size_mm());
        let (wrap, strength, y_up) = (input.tiling(), self.strength, self.y_up);
        Ok(Outputs::one(Field::new(Type::Gray, wrap, Integrated { input, size, wrap, strength, y_up })))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{canvas, check_field, crop, field, port, raster};
    use std::f64::consts::TAU;

    /// Normals of 2·sin(x)·cos(2y), with as many waves as fit 32 mm; y up or down.
    fn normals(y_up: bool, tiling: Tiling) -> Field {
        Field::generate(Type::Normal, tiling, move |out, _| {
            let (grid, window, width) = (out.grid, out.window, out.window.width.cast_signed());
            let n = window.len();
            for i in 0..n {
                let k = i32::try_from(i).unwrap();
                let at = grid.center(window.x + k % width, window.y + k / width) * TAU / 32.0;
                let (p, q) = (2.0 * at.x.cos() * (2.0 * at.y).cos(), -4.0 * at.x.sin() * (2.0 * at.y).sin());
                let slope = DVec2::new(p, q) * TAU / 32.0;
                let normal = glam::DVec3::new(-slope.x, if y_up { slope.y } else { -slope.y }, 1.0).normalize();
                for (c, v) in normal.to_array().into_iter().enumerate() {
                    out.data_mut()[c * n + i] = narrow(0.5 + 0.5 * v);
                }
            }
            Ok(())
        })
    }

    fn want(at: DVec2) -> f64 {
        2.0 * (at.x * TAU / 32.0).sin() * (2.0 * at.y * TAU / 32.0).cos()
    }

    #[test]
    fn recovers_heights() {
        for y_up in [true, false] {
            let node = NormalToHeight { input: port(0), y_up, ..NormalToHeight::default() };
            let made = field(&node, &[normals(y_up, Tiling::BOTH).into()]);
            check_field(&made);
            // Also at other resolutions, between pixels, and beyond the canvas.
            for resolution in [64, 45] {
                let canvas = Canvas { resolution: UVec2::splat(resolution), ..canvas() };
                let (out, grid) = (raster(&made, &canvas), canvas.grid(canvas.resolution));
                for (k, v) in (0..).zip(out.data()) {
                    let at = grid.center(k % resolution.cast_signed(), k / resolution.cast_signed());
                    assert!((f64::from(*v) - want(at)).abs() < 1e-4);
                }
            }
            let grid = canvas().grid(canvas().resolution).centered_at(DVec2::new(40.3, -7.1));
            let one = Window { x: 0, y: 0, width: 1, height: 1 };
            let point = shibo_value::Evaluator::raster(&crate::testing::Plain, &made, &grid, one).unwrap();
            assert!((f64::from(point.data()[0]) - want(DVec2::new(40.3, -7.1))).abs() < 2e-3);
        }
    }

    #[test]
    fn is_flat_at_edges_without_repeats() {
        let made = field(
            &NormalToHeight { input: port(0), ..NormalToHeight::default() },
            &[normals(true, Tiling::NONE).into()],
        );
        assert_eq!(made.tiling(), Tiling::NONE);
        check_field(&made);
        let whole = raster(&made, &canvas());
        let beyond = crop(&made, &canvas(), Window { x: -5, y: 0, width: 1, height: 64 });
        assert!((0..64).all(|y| beyond.row(0, y)[0] == whole.row(0, y)[0]));
        assert!(whole.data().iter().sum::<f32>().abs() < 0.05);
    }
}
