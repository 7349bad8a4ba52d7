//! [`MakeTileable`]: a field that repeats, from one that does not.
//!
//! Along the border the result shows a copy shifted by half the canvas, so that places that meet at the edge are
//! neighbours in the input. In corners, where both directions meet, four copies are blended. The blend follows E. Heitz
//! and F. Neyret, "High-performance by-example noise using a histogram-preserving blending operator" (2018): values are
//! mapped to a normal distribution, weighted by w / √Σw², and mapped back; see
//! [`kernel::normal_scores`](shibo_kernel::pointwise::normal_scores). Cost: O(pixels), plus once the input at 512
//! pixels.
use crate::measured;
use crate::torus::Torus;
use glam::DVec2;
use shibo_kernel::ground::math::smooth;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::pointwise::normal_scores::NormalScores;
use shibo_node::{AnyField, CanvasFacts, Context, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Field, FieldSource, Given, Grid, Pictures, Read, Stop, Tile, Tiling, Window};
use std::sync::OnceLock;

/// Makes a field repeat with the canvas: photographs, crops, anything that has an edge.
///
/// The middle stays unchanged. Along the edges across which the canvas tiles, another part of the input is blended in,
/// without loss of contrast. It suits irregular textures; lines and patterns do not continue.
///
/// A whole-picture operation: the input is measured on the canvas, at 512 pixels along its longer side, before anything
/// is drawn.
///
/// ```ron
/// "noise": Fractal(size: 5, octaves: 5, kind: Ridged),
/// "turned": Transform(input: "noise", angle: 33),
/// "whole": MakeTileable(input: "turned"),
/// "example": Transform(input: "whole", offset: (20, 20)),
/// ```
///
/// Elsewhere: Substance Designer *Make It Tile Photo*, *Make It Tile Patch*; Material Maker *Make Tileable*.
#[node]
pub struct MakeTileable {
    /// Field to make tileable.
    pub input: In<AnyField>,
    /// Width of the border along which the other part is blended in; at most half the canvas in each direction in which
    /// it tiles. A quarter of its shorter side if not given.
    #[schemars(range(max = 5e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    pub width: Option<f64>,
    /// True if the blend keeps the contrast and colours of the input; false for a plain mixture, which is softer and
    /// cheaper.
    #[default(true)]
    pub keep_contrast: bool,
}

/// A field and copies of it, blended along the border of the canvas.
struct Blended {
    input: Field,
    /// The input on the canvas, repeated.
    torus: Field,
    size: DVec2,
    wrap: Tiling,
    width: f64,
    keep_contrast: bool,
    scores: OnceLock<NormalScores>,
}

impl Blended {
    /// Tells for each copy in which directions it is shifted by half the canvas; the first copy is not shifted.
    fn copies(&self) -> impl Iterator<Item = [bool; 2]> {
        let Tiling { x, y } = self.wrap;
        [[false, false], [true, false], [false, true], [true, true]]
            .into_iter()
            .filter(move |[a, b]| x >= *a && y >= *b)
    }

    /// The read of a copy for a window.
    fn read(&self, grid: &Grid, window: Window, shifted: [bool; 2]) -> Read<'_> {
        let (mut grid, mut window) = (*grid, window);
        let pixels = Torus::pixels(self.size, &grid);
        for (k, _) in shifted.into_iter().enumerate().filter(|(_, shifted)| *shifted) {
            if pixels[k] % 2 == 0 {
                *(if k == 0 { &mut window.x } else { &mut window.y }) += pixels[k] / 2;
            } else {
                grid.origin[k] += 0.5 * self.size[k];
                grid.period = None;
            }
        }
        Read::new(&self.torus, &grid, window)
    }

    /// Weights of the unshifted copy in `count` columns or rows, from `first` on.
    fn weights(&self, grid: &Grid, axis: usize, first: i32, count: usize) -> Vec<f32> {
        let wrap = if axis == 0 { self.wrap.x } else { self.wrap.y };
        let weight = |at: i32| {
            let place = grid.origin[axis] + (f64::from(at) + 0.5) * grid.step[axis];
            let inside = place.rem_euclid(self.size[axis]);
            smooth(narrow(inside.min(self.size[axis] - inside) / self.width))
        };
        (first..).take(count).map(|at| if wrap { weight(at) } else { 1.0 }).collect()
    }

    /// The blend of pixel `i` of all copies, with these weights.
    fn blend(&self, scores: Option<&NormalScores>, copies: &[(&Tile, f32)], i: usize) -> [f32; 3] {
        let mut sum = [0.0; 3];
        let mut squares = 0.0;
        for (tile, weight) in copies.iter().filter(|(_, weight)| *weight > 0.0) {
            let value = [0, 1, 2].map(|k| if k < tile.channels() { tile.plane(k)[i] } else { 0.0 });
            let value = scores.map_or(value, |scores| scores.scores(value));
            sum.iter_mut().zip(value).for_each(|(sum, v)| *sum += weight * v);
            squares += weight * weight;
        }
        match scores {
            Some(scores) => scores.value(sum.map(|sum| sum / squares.max(1e-12).sqrt())),
            None => sum,
        }
    }
}

impl FieldSource for Blended {
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        self.copies().map(|shifted| self.read(grid, window, shifted)).collect()
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let scores = if self.keep_contrast { Some(measured::known(&self.scores)?) } else { None };
        let across = self.weights(&out.grid, 0, out.window.x, out.width());
        let down = self.weights(&out.grid, 1, out.window.y, out.height());
        let (n, channels, width) = (out.window.len(), out.channels(), out.width());
        for i in 0..n {
            let (x, y) = (across[i % width], down[i / width]);
            if x * y == 1.0 {
                (0..channels).for_each(|k| out.data_mut()[k * n + i] = given.tile(0).plane(k)[i]);
                continue;
            }
            let weight = |[a, b]: [bool; 2]| (if a { 1.0 - x } else { x }) * if b { 1.0 - y } else { y };
            let mut copies = [(given.tile(0), 0.0); 4];
            let mut count = 0;
            for (tile, shifted) in given.tiles().zip(self.copies()) {
                copies[count] = (tile, weight(shifted));
                count += 1;
            }
            let value = self.blend(scores, &copies[..count], i);
            (0..channels).for_each(|k| out.data_mut()[k * n + i] = value[k]);
        }
        given.check()
    }

    fn whole(&self, _grid: &Grid) -> Vec<Read<'_>> {
        let (grid, window) = measured::grid(self.size);
        if self.keep_contrast { vec![Read::new(&self.input, &grid, window)] } else { Vec::new() }
    }

    fn prepare(&self, _grid: &Grid, pictures: &dyn Pictures) -> Result<Option<Tile>, Stop> {
        if self.keep_contrast && self.scores.get().is_none() {
            let tile = pictures.read(0, measured::grid(self.size).1)?;
            pictures.check()?;
            let planes: Vec<&[f32]> = (0..tile.channels()).map(|k| tile.plane(k)).collect();
            let scores = NormalScores::of(&planes);
            self.scores.get_or_init(|| scores);
        }
        Ok(None)
    }

    fn prepare_bytes(&self, _grid: &Grid) -> u64 {
        let done = !self.keep_contrast || self.scores.get().is_some();
        if done { 0 } else { 8 * (self.input.channels() * measured::grid(self.size).1.len()) as u64 }
    }
}

impl MakeTileable {
    fn width(&self, size: DVec2) -> f64 {
        self.width.unwrap_or(0.25 * size.min_element())
    }
}

impl Node for MakeTileable {
    const OUTPUTS: &'static [Output] = &[Output::like("result", &["input"], "The input, repeating with the canvas.")];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let (size, tile, width) = (canvas.size_mm(), canvas.tile(), self.width(canvas.size_mm()));
        let most =
            [(tile.x, size.x), (tile.y, size.y)].into_iter().filter(|(wraps, _)| *wraps).map(|(_, side)| 0.5 * side);
        let most = most.fold(f64::INFINITY, f64::min);
        if width <= most {
            return Vec::new();
        }
        let message = format!("width is `{width}` mm; it must be at most half the canvas where it tiles, {most} mm");
        vec![Problem::new(Code::OutOfRange, message).at("width")]
    }

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        canvas.tile()
    }

    fn makes_tile(&self, _port: &str) -> bool {
        true
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (input, size, wanted) = (cx.get(&self.input)?, cx.size_mm(), cx.tiling());
        // A direction in which the input repeats already needs no blend.
        let wrap = Tiling { x: wanted.x && !input.tiling().x, y: wanted.y && !input.tiling().y };
        if wrap == Tiling::NONE {
            return Ok(Outputs::one(input));
        }
        let tiling = Tiling { x: wrap.x || input.tiling().x, y: wrap.y || input.tiling().y };
        let torus = Field::new(input.ty(), tiling, Torus { input: input.clone(), size, wrap });
        let (ty, keep_contrast) = (input.ty(), self.keep_contrast);
        let width = self.width(size);
        let source = Blended { input, torus, size, wrap, width, keep_contrast, scores: OnceLock::new() };
        Ok(Outputs::one(Field::new(ty, tiling, source)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::OnCanvas as _;
    use crate::testing::{canvas, check_field, crop, field, port, raster};
    use shibo_kernel::ground::hash::Hash;
    use shibo_value::{Canvas, Halo, Type};

    /// White noise that does not repeat; its distribution is skewed, so that plain means would show.
    fn noise() -> Field {
        Field::generate(Type::Gray, Tiling::NONE, |out, _| {
            let (window, width) = (out.window, out.window.width.cast_signed());
            for (k, v) in (0..).zip(out.plane_mut(0)) {
                let (x, y) = (window.x + k % width, window.y + k / width);
                let key = (x + 5000).unsigned_abs() * 20_000 + (y + 5000).unsigned_abs();
                *v = Hash::new(1).unit_f32(u64::from(key)).powi(3);
            }
            Ok(())
        })
    }

    fn node(width: f64) -> MakeTileable {
        MakeTileable { input: port(0), width: Some(width), ..MakeTileable::default() }
    }

    #[test]
    fn keeps_middle_and_joins_neighbours_at_edge() {
        let inputs = [noise().into()];
        let made = field(&node(8.0), &inputs);
        assert_eq!(made.tiling(), Tiling::BOTH);
        check_field(&made);
        let (out, input) = (raster(&made, &canvas()), raster(&noise(), &canvas()));
        for y in 16..48 {
            assert_eq!(out.row(0, y)[16..48], input.row(0, y)[16..48]);
        }
        // At the left and the right edge nearly all of the value comes from the two columns in the middle, which are
        // neighbours.
        let off = |x: usize, from: usize| {
            (20..44).map(|y| (out.row(0, y)[x] - input.row(0, y)[from]).abs()).fold(0.0, f32::max)
        };
        assert!(off(0, 32) < 0.03 && off(63, 31) < 0.03, "{} {}", off(0, 32), off(63, 31));
    }

    #[test]
    fn keeps_contrast() {
        let spread = |keep_contrast: bool| {
            let node = MakeTileable { keep_contrast, ..node(16.0) };
            let fine = Canvas { resolution: glam::UVec2::splat(256), ..canvas() };
            let out = raster(&field(&node, &[noise().into()]), &fine);
            let mean = out.data().iter().sum::<f32>() / out.data().len() as f32;
            let square = out.data().iter().map(|v| (v - mean) * (v - mean)).sum::<f32>() / out.data().len() as f32;
            (mean, square.sqrt())
        };
        // The third power of 0..1 has the mean ¼ and the deviation √(1/7 - 1/16) = 0.2836.
        let ((mean, kept), (_, lost)) = (spread(true), spread(false));
        assert!((mean - 0.25).abs() < 0.01 && (kept - 0.2836).abs() < 0.01, "{mean} {kept}");
        assert!(lost < 0.24, "{lost}");
    }

    #[test]
    fn handles_colours_odd_sizes_and_single_directions() {
        let color = Field::map(Type::Rgb, [noise()], Halo::NONE, |out: &mut Tile, [input]: [&Tile; 1]| {
            for (k, plane) in out.planes_mut().into_iter().enumerate() {
                plane.iter_mut().zip(input.plane(0)).for_each(|(out, v)| *out = v * (k as f32 + 0.5));
            }
            Ok(())
        });
        check_field(&field(&node(5.0), &[color.into()]));
        let odd = Canvas { resolution: glam::UVec2::new(63, 65), ..canvas() };
        let made = field(&node(5.0), &[noise().into()]);
        let whole = crop(&made, &odd, Window { x: -63, y: -65, width: 126, height: 130 });
        for y in 0..65 {
            for x in 0..63 {
                assert!((whole.row(0, y)[x] - whole.row(0, y + 65)[x + 63]).abs() < 1e-5);
            }
        }
        let too_wide = node(17.0).check_on(&canvas());
        assert_eq!(too_wide[0].field.as_deref(), Some("width"));
        assert!(node(17.0).check_on(&Canvas { tile: Tiling::NONE, ..canvas() }).is_empty());
    }
}
