//! [`AlongField`]: a blur along the lines of a field of directions.
//!
//! Line integral convolution (B. Cabral, L. Leedom, 1993), see [`kernel::along`](shibo_kernel::filter::along). The halo
//! of a tile is half the length. Cost: O(pixels · length in pixels), about 15 ns for each pixel of the length.
use crate::bounds::at_most_half;
use shibo_kernel::filter::along::{self, Directions, LineSpec};
use shibo_kernel::filter::paths::Reader;
use shibo_kernel::ground::tile;
use shibo_node::{AnyField, CanvasFacts, Context, Direction, Fact, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::Problem;
use shibo_value::{Field, FieldSource, Given, Grid, Read, Stop, Tile, Window};

/// Smears a field along the lines of a field of directions, through bends and eddies: combed hair, flowing grain, oil
/// on water.
///
/// `DirectionalBlur` smears along a straight line through each place; this node follows the field. A direction and
/// its opposite mean the same line.
///
/// ```ron
/// "noise": WhiteNoise(size: 0.35),
/// "flow": Curl(size: 20, octaves: 2),
/// "lines": AlongField(input: "noise", direction: "flow", length: 8),
/// "example": Levels(input: "lines", low: 0.32, high: 0.68),
/// ```
///
/// Elsewhere: Houdini *Streak Blur*; ParaView *Surface LIC*.
#[node]
pub struct AlongField {
    /// Field to smear.
    pub input: In<AnyField>,
    /// The directions: degrees from +x towards +y, or vectors.
    pub direction: In<Direction>,
    /// Length of the line over which the mean is taken; at most half the canvas' longer side. Beyond 512 pixels samples
    /// lie farther apart.
    #[schemars(range(min = 0, max = 5e5), extend("unit" = "mm"))]
    #[default(4.0)]
    pub length: f64,
}

/// A field smeared along lines.
struct Smeared {
    input: Field,
    direction: Field,
    length: f64,
}

impl FieldSource for Smeared {
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        let (dx, dy) = grid.pixels(0.5 * self.length);
        let big = window.grow(dx + 1, dy + 1);
        vec![Read::new(&self.input, grid, big), Read::new(&self.direction, grid, big)]
    }

    fn reaches_by(&self) -> Option<&'static str> {
        Some("length")
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let (input, rect) = (given.tile(0), out.window);
        let lines = Directions::new(&tile::view(given.tile(1), 0));
        given.check()?;
        let views: Vec<_> = (0..input.channels()).map(|k| tile::view(input, k)).collect();
        let spec = LineSpec::new(self.length, tile::step(&out.grid));
        along::along(&Reader::new(&views), &lines, rect, &spec, &mut out.planes_mut());
        given.check()
    }
}

impl Node for AlongField {
    const OUTPUTS: &'static [Output] = &[Output::like("result", &["input"], "The input, smeared.")];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        at_most_half("length", self.length, canvas)
    }

    fn no_op(&self) -> Option<&'static str> {
        (self.length == 0.0).then_some("input")
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (input, direction) = (cx.get(&self.input)?, cx.get(&self.direction)?);
        if self.no_op().is_some() || input.as_constant().is_some() {
            return Ok(Outputs::one(input));
        }
        let (ty, tiling) = (input.ty(), input.tiling().and(direction.tiling()));
        Ok(Outputs::one(Field::new(ty, tiling, Smeared { input, direction, length: self.length })))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{canvas, check_field, field, lumps, port, raster, render};
    use shibo_value::Type;

    fn node(length: f64) -> AlongField {
        AlongField { input: port(0), direction: port(1), length }
    }

    #[test]
    fn averages_along_a_row() {
        let input = raster(&lumps(), &canvas());
        let right = Field::constant(Type::Vec2, &[-2.0, 0.0]).to_angle();
        // 4 mm are 8 pixels: nine samples.
        let out = render(&node(4.0), &[lumps().into(), right.into()]);
        for x in 10..50 {
            let want = (x - 4..=x + 4).map(|x| input.row(0, 20)[x]).sum::<f32>() / 9.0;
            assert!((out.row(0, 20)[x] - want).abs() < 1e-4);
        }
    }

    #[test]
    fn holds_in_any_window() {
        for length in [0.0, 1e-6, 3.0, 16.0] {
            check_field(&field(&node(length), &[lumps().to_rgb().into(), lumps().into()]));
            check_field(&field(&node(length), &[lumps().into(), Field::constant(Type::Gray, &[25.0]).into()]));
        }
        let wild = Field::constant(Type::Gray, &[f32::MAX]);
        check_field(&field(&node(3.0), &[lumps().into(), wild.into()]));
    }
}
