//! [`DirectionalBlur`]: a blur along a direction.
//!
//! The mean over a straight line through each pixel, two samples a pixel, linear between pixels. A constant direction
//! is turned into a kernel once; see [`kernel::paths`](shibo_kernel::filter::paths). Cost: O(pixels · length in
//! pixels); where the angle is a field about 6 ns for each pixel of the length.
use super::around::Around;
use crate::bounds::at_most_half;
use shibo_kernel::filter::paths::{self, Line, Reader};
use shibo_kernel::ground::math::{cos_degrees, sin_degrees};
use shibo_kernel::ground::tile;
use shibo_node::{AnyField, CanvasFacts, Context, Direction, Fact, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::Problem;
use shibo_value::{Field, Grid, Halo, Stop, Tile};

/// Smears a field along a direction, which may differ from place to place: brushed metal, streaks, fibres along a
/// field.
///
/// ```ron
/// "noise": Perlin(size: 0.4),
/// "hills": Perlin(size: 25),
/// "angle": Remap(input: "hills", to: (0, 360)),
/// "streaks": DirectionalBlur(input: "noise", angle: "angle", length: 4),
/// "example": Levels(input: "streaks", low: 0.35, high: 0.65),
/// ```
///
/// Elsewhere: Substance Designer *Directional Blur*, Material Maker *Directional Blur*, Blender *Directional Blur*,
/// Houdini *Streak Blur*.
#[node]
pub struct DirectionalBlur {
    /// Field to smear.
    pub input: In<AnyField>,
    /// The direction in degrees, from +x towards +y: a number or a field; or vectors.
    #[default(In::constant(0.0))]
    pub angle: In<Direction>,
    /// Length of the line over which the mean is taken; at most half the canvas' longer side. Beyond 255 pixels samples
    /// lie farther apart.
    #[schemars(range(min = 0, max = 5e5), extend("unit" = "mm"))]
    #[default(2.0)]
    pub length: f64,
}

/// The line in pixels for a length in mm and an angle.
fn line(length: f64, angle: f32, grid: &Grid) -> Line {
    let [x, y] = tile::step(grid);
    Line::new([length * f64::from(cos_degrees(angle)) / x, length * f64::from(sin_degrees(angle)) / y])
}

impl Node for DirectionalBlur {
    const OUTPUTS: &'static [Output] = &[Output::like("result", &["input"], "The input, smeared.")];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        at_most_half("length", self.length, canvas)
    }

    fn no_op(&self) -> Option<&'static str> {
        (self.length == 0.0).then_some("input")
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (input, angle, length) = (cx.get(&self.input)?, cx.get(&self.angle)?, self.length);
        if self.no_op().is_some() || input.as_constant().is_some() {
            return Ok(Outputs::one(input));
        }
        let ty = input.ty();
        if let Some(&[angle]) = angle.as_constant() {
            let halo = Halo::new(move |grid| line(length, angle, grid).halo()).from_parameter("length");
            return Ok(Outputs::one(Field::map(ty, [input], halo, move |out: &mut Tile, [input]: [&Tile; 1]| {
                let (line, rect) = (line(length, angle, &out.grid), out.window);
                for (k, out) in out.planes_mut().into_iter().enumerate() {
                    line.apply(&tile::view(input, k), rect, out);
                }
                Ok(())
            })));
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number of pixels")]
        let halo = Halo::new(move |grid| {
            tile::step(grid).map(|step| ((0.5 * length / step).ceil() as usize).saturating_add(1))
        })
        .from_parameter("length");
        let fill = move |out: &mut Tile, input: &Tile, others: &[&Tile]| {
            let (rect, [sx, sy]) = (out.window, tile::step(&out.grid));
            let views: Vec<_> = (0..input.channels()).map(|k| tile::view(input, k)).collect();
            let count = paths::samples(length / sx.min(sy));
            #[expect(clippy::cast_possible_truncation, reason = "places in pixels need no more than f32")]
            let (lx, ly) = ((length / sx) as f32, (length / sy) as f32);
            let angle = others[0].plane(0);
            let path = |_: i32, _: i32, k: usize| {
                let (x, y) = (lx * cos_degrees(angle[k]), ly * sin_degrees(angle[k]));
                (count, move |at: f32| [at * x, at * y])
            };
            paths::mean_along(&Reader::new(&views), rect, path, &mut out.planes_mut());
        };
        let source = Around { input, halo, others: vec![angle], fill };
        Ok(Outputs::one(Field::new(ty, source.tiling(), source)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{canvas, check_field, field, lumps, port, raster, render};
    use shibo_value::{Tiling, Type};

    fn node(length: f64) -> DirectionalBlur {
        DirectionalBlur { input: port(0), angle: port(1), length }
    }

    fn degrees(angle: f32) -> Field {
        Field::constant(Type::Gray, &[angle])
    }

    /// A field of one angle that is not marked as a constant.
    fn spread(angle: f32) -> Field {
        Field::generate(Type::Gray, Tiling::BOTH, move |out, _| {
            out.data_mut().fill(angle);
            Ok(())
        })
    }

    #[test]
    fn averages_along_rows() {
        let input = raster(&lumps(), &canvas());
        // 4 mm are 8 pixels: 17 samples, half a pixel apart.
        let out = render(&node(4.0), &[lumps().into(), degrees(0.0).into()]);
        for x in 10..50 {
            let at = |i: usize| f64::from(input.row(0, 20)[i]);
            let samples = (0..=16).map(|s| {
                let place = x * 2 + s - 8;
                if place % 2 == 0 { at(place / 2) } else { 0.5 * (at(place / 2) + at(place / 2 + 1)) }
            });
            let want = samples.sum::<f64>() / 17.0;
            assert!((f64::from(out.row(0, 20)[x]) - want).abs() < 1e-5);
        }
    }

    #[test]
    fn fields_and_numbers_agree() {
        for angle in [0.0, 90.0, 33.0, -120.0] {
            let known = render(&node(5.0), &[lumps().into(), degrees(angle).into()]);
            let unknown = render(&node(5.0), &[lumps().into(), spread(angle).into()]);
            let worst = known.data().iter().zip(unknown.data()).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
            // Diagonals take fewer samples if the angle is a constant.
            assert!(worst < 0.02, "{angle}: {worst}");
        }
    }

    #[test]
    fn holds_in_any_window() {
        for length in [0.0, 1e-6, 3.0, 16.0] {
            check_field(&field(&node(length), &[lumps().to_rgb().into(), degrees(25.0).into()]));
            check_field(&field(&node(length), &[lumps().to_rgb().into(), lumps().into()]));
        }
        let wild = spread(f32::MAX);
        check_field(&field(&node(3.0), &[lumps().into(), wild.into()]));
    }
}
