//! [`Svg`]: a vector picture.
//!
//! Read by `usvg` and drawn by `resvg` at the resolution of the grid, in blocks of 64 pixels that do not depend on the
//! window, with 8 bits for each channel. Colours are blended in sRGB, as SVG defines, and then made scene-linear. Cost:
//! drawing the picture once for each block.
use super::vector::Vector;
use glam::DVec2;
use shibo_kernel::ground::number::narrow;
use shibo_node::{CanvasFacts, Color, Context, Fact, FilePath, Node, Output, Outputs, Xy, choice, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::files::FileHandle;
use shibo_value::{Field, FieldSource, Given, Grid, Read, Stop, Tile, Tiling, Type, Window, srgb_to_linear};
use std::sync::Arc;

/// How a picture fills its rectangle.
#[choice]
pub enum Fit {
    /// As large as possible within the rectangle.
    #[default]
    Contain,
    /// As small as possible without leaving a part of the rectangle empty; parts beyond it are cut off.
    Cover,
    /// Width and height are scaled separately.
    Stretch,
}

/// A vector picture from an SVG file, drawn sharply at every resolution: ornaments, logos, drawings.
///
/// Shapes, strokes, gradients, clips and masks are drawn. Text, pictures, filters, patterns and markers are errors,
/// with their place in the file, if they would be drawn; unused and hidden ones are ignored. Colours may have all forms
/// of CSS 3; a colour that cannot be resolved, such as `var(--c)`, is an error and never black. Nothing outside of the
/// file is read. On a canvas that tiles, the picture repeats with it. With a black `background`, `color + ground·(1 -
/// alpha)` lays the picture on a ground without dark edges, as in the example.
///
/// ```ron
/// "drawing": Svg(path: "leaf.svg", size_mm: 34),
/// "rest": Invert(input: "drawing.alpha"),
/// "example": "= drawing + 0.75 * rest",
/// ```
///
/// Elsewhere: Substance Designer *SVG*; Blender *Import SVG*.
#[node]
#[derive(PartialEq)]
pub struct Svg {
    /// The file, SVG or SVGZ, up to 16 MiB also when unpacked; relative to the graph file.
    pub path: FilePath,
    /// Size of the rectangle to fill; the whole canvas by default.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e6, "unit" = "mm"))]
    pub size_mm: Option<Xy>,
    /// How the picture fills its rectangle.
    #[default(Fit::Contain)]
    pub fit: Fit,
    /// Centre of the rectangle; the canvas' centre by default.
    #[schemars(extend("minimum" = -1e6, "maximum" = 1e6, "unit" = "mm"))]
    pub center: Option<Xy>,
    /// The colour of the background.
    pub background: Color,
}

impl Node for Svg {
    const VERSION: u32 = 2;
    const OUTPUTS: &'static [Output] = &[
        Output::new("color", Type::Rgb, "The picture on `background`, scene-linear."),
        Output::new("alpha", Type::Gray, "How much of the place is drawn on, 0..1."),
        Output::new("mask", Type::Gray, "How light it is, 0..1, as the eye sees it; 0 where nothing is drawn."),
        Output::new("path", Type::Path, "The outlines of its shapes; not cut at its place."),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let most = 4.0 * canvas.size_mm().max_element();
        let largest = self.size_mm.map_or(0.0, |size| size.x.max(size.y));
        if largest <= most {
            return Vec::new();
        }
        let message = format!("size_mm is `{largest}` mm; it must be at most {most} mm");
        vec![Problem::new(Code::OutOfRange, message).at("size_mm").help("that is four times the canvas")]
    }

    fn files(&self) -> Vec<(&'static str, &FilePath)> {
        vec![("path", &self.path)]
    }

    fn check_files(&self, files: &[(&'static str, FileHandle)]) -> Vec<Problem> {
        files.iter().filter_map(|(_, file)| Vector::read(file).err()).collect()
    }

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        canvas.tile()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let missing = || Problem::new(Code::MissingInput, "`path` is not given; it must name an SVG file");
        let vector = Arc::new(Vector::read(cx.file("path").ok_or_else(missing)?)?);
        let place = self.size_mm.map_or(cx.size_mm(), |size| DVec2::new(size.x, size.y));
        let center = self.center.map_or(cx.size_mm() * 0.5, |c| DVec2::new(c.x, c.y));
        let each = place / vector.size;
        let scale = match self.fit {
            Fit::Contain => DVec2::splat(each.min_element()),
            Fit::Cover => DVec2::splat(each.max_element()),
            Fit::Stretch => each,
        };
        let corner = center - 0.5 * scale * vector.size;
        // Half the visible part.
        let half = 0.5 * place.min(scale * vector.size);
        let tiling = cx.tiling();
        let period =
            DVec2::new(if tiling.x { cx.size_mm().x } else { 0.0 }, if tiling.y { cx.size_mm().y } else { 0.0 });
        let drawn = Arc::new(Drawn { vector, scale, corner, low: center - half, high: center + half, period });
        let Color(background) = self.background;
        let (pen, all) = drawn.vector.outlines(scale, corner);
        if !all {
            let message = "the picture has too many outlines: the output `path` holds only the first of them";
            cx.evaluator.warn(Problem::new(Code::Advice, message).at("path"));
        }
        let path = pen.finish(cx.size_mm(), tiling);
        let field = |ty: Type, what: What| Field::new(ty, tiling, Shown { drawn: drawn.clone(), what, background });
        Ok(Outputs::one(field(Type::Rgb, What::Color))
            .with("alpha", field(Type::Gray, What::Alpha))
            .with("mask", field(Type::Gray, What::Mask))
            .with("path", path))
    }
}

/// A picture on the canvas.
struct Drawn {
    vector: Arc<Vector>,
    /// Millimetres per unit of the picture.
    scale: DVec2,
    /// Position of its origin, mm.
    corner: DVec2,
    /// The part of the canvas that shows the picture, mm.
    low: DVec2,
    high: DVec2,
    /// Distance from one copy to the next, mm; 0 for a single copy.
    period: DVec2,
}

/// Supersampling per axis: `resvg` knows the coverage of a single pixel only in steps of 1/16.
const FINE: usize = 2;
/// Drawn pixels along a side of a block.
const DRAWN: u32 = 128;
/// Pixels along a side of a block.
const SIDE: usize = 64;

impl Drawn {
    /// The numbers of the copies along axis `k` that reach into `first..last` mm.
    fn copies(&self, k: usize, first: f64, last: f64) -> Vec<f64> {
        let period = self.period[k];
        if period <= 0.0 {
            return vec![0.0];
        }
        let to = ((last - self.low[k]) / period).floor();
        let from = ((first - self.high[k]) / period).ceil();
        std::iter::successors(Some(from), |n| Some(n + 1.0)).take_while(|n| *n <= to).collect()
    }

    /// The block whose first pixel is (x, y): premultiplied red, green, blue and opacity, 0..1; `None` if it is empty.
    fn block(&self, grid: &Grid, x: i32, y: i32) -> Result<Option<Vec<[f32; 4]>>, Stop> {
        let side = i32::try_from(SIDE).unwrap_or(i32::MAX);
        let corner = |x: i32, y: i32| grid.origin + DVec2::new(f64::from(x), f64::from(y)) * grid.step;
        let (first, last) = (corner(x, y), corner(x + side, y + side));
        let mut all: Option<Vec<[f32; 4]>> = None;
        for j in self.copies(1, first.y, last.y) {
            for i in self.copies(0, first.x, last.x) {
                let shift = DVec2::new(i, j) * self.period;
                let (low, high) = (self.low + shift, self.high + shift);
                if low.cmpgt(last).any() || high.cmplt(first).any() {
                    continue;
                }
                let fine = grid.step / FINE as f64;
                let place = (self.scale / fine, (self.corner + shift - first) / fine);
                let pixels = self.vector.draw(place, DRAWN).ok_or_else(|| {
                    Problem::new(Code::BadFile, "the picture cannot be drawn: its decoder gave up").at("path")
                })?;
                let out = all.get_or_insert_with(|| vec![[0.0; 4]; SIDE * SIDE]);
                for (k, out) in out.iter_mut().enumerate() {
                    // Share of the pixel that lies in the visible part.
                    let at = corner(x, y) + (DVec2::new((k % SIDE) as f64, (k / SIDE) as f64) + 0.5) * grid.step;
                    let within = ((at - low).min(high - at) / grid.step + 0.5).clamp(DVec2::ZERO, DVec2::ONE);
                    let cover = narrow(within.element_product());
                    let first = (k / SIDE * FINE * SIDE + k % SIDE) * FINE;
                    let mut sum = [0_u32; 4];
                    for row in pixels[4 * first..].chunks(4 * FINE * SIDE).take(FINE) {
                        for part in row[..4 * FINE].chunks_exact(4) {
                            sum.iter_mut().zip(part).for_each(|(sum, part)| *sum += u32::from(*part));
                        }
                    }
                    let scale = cover / (255 * FINE * FINE) as f32;
                    let above = sum.map(|sum| sum as f32 * scale);
                    let rest = 1.0 - above[3];
                    out.iter_mut().zip(above).for_each(|(out, above)| *out = *out * rest + above);
                }
            }
        }
        Ok(all)
    }
}

/// The quantity that a field shows.
#[derive(Clone, Copy, PartialEq, Eq)]
enum What {
    Color,
    Alpha,
    Mask,
}

struct Shown {
    drawn: Arc<Drawn>,
    what: What,
    background: [f32; 3],
}

impl Shown {
    /// The values of a pixel.
    fn values(&self, [r, g, b, a]: [f32; 4]) -> [f32; 3] {
        match self.what {
            What::Alpha => [a; 3],
            // Luma of the encoded colour.
            What::Mask => [0.2126 * r + 0.7152 * g + 0.0722 * b; 3],
            What::Color => {
                let drawn = [r, g, b].map(|v| if a > 0.0 { a * srgb_to_linear((v / a).min(1.0)) } else { 0.0 });
                std::array::from_fn(|c| drawn[c] + (1.0 - a) * self.background[c])
            }
        }
    }
}

impl FieldSource for Shown {
    fn inputs(&self, _grid: &Grid, _window: Window) -> Vec<Read<'_>> {
        Vec::new()
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let (grid, window) = (out.grid, out.window);
        let side = i32::try_from(SIDE).unwrap_or(i32::MAX);
        let background = self.values([0.0; 4]);
        for by in window.y.div_euclid(side)..=(window.bottom() - 1).div_euclid(side) {
            for bx in window.x.div_euclid(side)..=(window.right() - 1).div_euclid(side) {
                given.check()?;
                let block = self.drawn.block(&grid, bx * side, by * side)?;
                let (left, right) = ((bx * side).max(window.x), ((bx + 1) * side).min(window.right()));
                for y in (by * side).max(window.y)..((by + 1) * side).min(window.bottom()) {
                    let row = y.abs_diff(window.y) as usize * window.width as usize;
                    for x in left..right {
                        let values = match &block {
                            Some(block) => {
                                let place = y.abs_diff(by * side) as usize * SIDE + x.abs_diff(bx * side) as usize;
                                self.values(block[place])
                            }
                            None => background,
                        };
                        let at = row + x.abs_diff(window.x) as usize;
                        let planes = out.channels();
                        let n = window.len();
                        (0..planes).for_each(|c| out.data_mut()[c * n + at] = values[c]);
                    }
                }
            }
        }
        Ok(())
    }

    fn bytes(&self) -> usize {
        self.drawn.vector.bytes()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Plain, canvas, check_field, raster};
    use shibo_node::{Call, DynNode};
    use shibo_value::Value;

    const PICTURE: &str = r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 20 10">
        <rect x="5" width="10" height="10" fill="#808080"/><circle cx="10" cy="5" r="2" fill="#ffffff" opacity="0.5"/></svg>"##;

    fn fields(node: &Svg, text: &str) -> Result<[Field; 3], Stop> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.svg");
        std::fs::write(&path, text).unwrap();
        let call =
            Call { kind: "Svg", canvas: &canvas(), inputs: &[], files: &[("path", (&path).into())], evaluator: &Plain };
        let outputs = DynNode::evaluate(node, &call)?;
        Ok(["color", "alpha", "mask"].map(|name| match outputs.take(name, name == "color") {
            Some(Value::Field(field)) => field.clone(),
            other => panic!("{name}: {other:?}"),
        }))
    }

    #[test]
    fn shapes_lie_where_they_should() {
        // 20 × 10 units on 32 × 32 mm: 1.6 mm per unit, with 8 mm empty above and below; pixels are ½ mm.
        let [color, alpha, mask] = fields(&Svg::default(), PICTURE).unwrap();
        let [color, alpha, mask] = [color, alpha, mask].map(|field| raster(&field, &canvas()));
        let at = |tile: &Tile, x: usize, y: usize| tile.row(0, y)[x];
        // The rectangle from 8 to 24 mm and from 8 to 24 mm.
        assert_eq!(
            (at(&alpha, 15, 32), at(&alpha, 16, 32), at(&alpha, 20, 15), at(&alpha, 20, 16)),
            (0.0, 1.0, 0.0, 1.0)
        );
        let gray = srgb_to_linear(128.0 / 255.0);
        assert!((at(&color, 18, 20) - gray).abs() < 1e-5 && at(&color, 2, 2) == 0.0);
        assert!((at(&mask, 18, 20) - 128.0 / 255.0).abs() < 1e-5 && at(&mask, 2, 2) == 0.0);
        assert!((at(&mask, 32, 32) - 192.0 / 255.0).abs() < 6e-3, "half of white over grey");
        assert!((alpha.data().iter().sum::<f32>() - 1024.0).abs() < 1.0);
    }

    #[test]
    fn pictures_are_cut_to_their_place_and_repeat() {
        let node = Svg {
            size_mm: Some(Xy::new(12.0, 16.0)),
            fit: Fit::Cover,
            center: Some(Xy::new(1.0, 30.0)),
            ..Svg::default()
        };
        let [color, alpha, mask] = fields(&node, PICTURE).unwrap();
        let area = raster(&alpha, &canvas()).data().iter().sum::<f32>() * 0.25;
        assert!((area - 192.0).abs() < 1.0, "{area}");
        for field in [&color, &alpha, &mask] {
            check_field(field);
        }
        let [_, alpha, _] = fields(&Svg { fit: Fit::Stretch, ..node }, PICTURE).unwrap();
        let area = raster(&alpha, &canvas()).data().iter().sum::<f32>() * 0.25;
        assert!((area - 96.0).abs() < 1.0, "half of its place: {area}");
    }

    #[test]
    fn refuses_invalid_files() {
        assert!(matches!(fields(&Svg::default(), "no svg"), Err(Stop::Failed(_))));
    }
}
