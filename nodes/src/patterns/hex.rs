//! [`Hex`]: regular hexagons.
//!
//! The hexagons of [`kernel::layout`](shibo_kernel::pattern::layout). Cost: O(pixels).
use super::pieces;
use crate::degrees::sin_cos;
use crate::fitted;
use glam::DVec2;
use shibo_kernel::pattern::finish::{BevelProfile, Finish, degrees};
use shibo_kernel::pattern::layout::{Grid, Layout, PieceSpec};
use shibo_node::{CanvasFacts, Context, Fact, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Stop, Tiling};

/// Regular hexagons: honeycombs, tiles, scales.
///
/// `size` and `gap` add up to the distance from one hexagon to the next. At angle 0 two sides of each hexagon are
/// horizontal, and two corners lie left and right. On a canvas that tiles, hexagons are stretched a little so that a
/// whole number fits, and a warning gives the change. A canvas whose height is 1.732 times its width fits exactly.
///
/// The main output is a height: 0 on the hexagons, `depth` lower in the gaps. `ids` gives each hexagon a number: the
/// formula `"= random(comb.ids)"` is another grey for each of them, and `RegionGradient` tilts each another way.
/// `local` is the place within a hexagon in mm, for a picture in each. `Brick(layout: Hexagonal)` lays longer ones.
///
/// ```ron
/// "comb": Hex(size: 3.5, gap: 0.5, bevel: 1.2, profile: Round, depth: 0.8),
/// "tone": "= mix(#6b4a2a, #d9a441, random(comb.ids))",
/// "color": Blend(base: "tone", top: "#2a2320", mask: "comb.gap"),
/// "example": Relief(height: "comb", base_color: "color"),
/// ```
///
/// Elsewhere: Material Maker *Beehive*.
#[node]
#[derive(PartialEq)]
pub struct Hex {
    /// Distance between opposite sides of a hexagon, without the gap.
    #[schemars(range(max = 1e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(4.5)]
    pub size: f64,
    /// Width of the gap between hexagons.
    #[schemars(range(min = 0, max = 1e5), extend("unit" = "mm"))]
    #[default(0.5)]
    pub gap: f64,
    /// Width of the slope at the edge of a hexagon; 0 is a sharp edge.
    #[schemars(range(min = 0, max = 1e5), extend("unit" = "mm"))]
    #[default(0.5)]
    pub bevel: f64,
    /// The cross-section of the slope.
    #[default(BevelProfile::Chamfer)]
    pub profile: BevelProfile,
    /// Depth of the gap below the hexagons.
    #[schemars(range(min = -1e4, max = 1e4), extend("unit" = "mm"))]
    #[default(0.5)]
    pub depth: f64,
    /// Rotation of the whole pattern, from +x towards +y.
    #[schemars(range(min = -360, max = 360), extend("unit" = "°"))]
    pub angle: f64,
}

impl Hex {
    fn pieces(&self) -> PieceSpec {
        let size = DVec2::new(self.size * 2.0 / 3f64.sqrt(), self.size);
        PieceSpec { layout: Layout::Hexagonal, size, gap: self.gap, stagger: 0.0, slant: 0.0 }
    }

    fn lay(&self, canvas: &CanvasFacts) -> Option<Grid> {
        self.pieces().lay(sin_cos(self.angle), (canvas.size_mm(), canvas.tile()))
    }
}

impl Node for Hex {
    const OUTPUTS: &'static [Output] = pieces::OUTPUTS;
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        match self.lay(canvas) {
            None => vec![fitted::too_many("size")],
            Some(grid) if self.pieces().laid(&grid).min_element() <= 0.0 => {
                let message = format!("gap is `{}` mm; nothing is left of hexagons that fit the canvas", self.gap);
                vec![Problem::new(Code::OutOfRange, message).at("gap").help("make it smaller")]
            }
            Some(_) => Vec::new(),
        }
    }

    fn advice(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let Some(grid) = self.lay(canvas) else { return Vec::new() };
        let (pieces, turned) = (self.pieces(), degrees(grid.directions[0]));
        let laid = pieces.laid(&grid);
        // A canvas of another shape always stretches the pattern; advise only if the change is visible.
        if ((laid - pieces.size) / pieces.size).abs().max_element() < 0.05 && (turned - self.angle).abs() < 0.05 {
            return Vec::new();
        }
        fitted::advice(("size", "pieces"), [pieces.size, laid], [self.angle, turned], fitted::FITS)
    }

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        canvas.tile()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let grid = self.lay(cx.canvas).ok_or_else(|| fitted::too_many("size"))?;
        let finish = Finish { gap: self.gap, bevel: self.bevel, profile: self.profile, radius: 0.0 };
        Ok(pieces::outputs(grid, finish, self.depth, cx.tiling()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::conforms;
    use crate::testing::{OnCanvas as _, canvas};

    #[test]
    fn hexagons_conform() {
        for angle in [0.0, 30.0, 77.0] {
            conforms(&Hex { angle, ..Hex::default() }, &[]);
        }
        assert_eq!(Hex { gap: 40.0, ..Hex::default() }.check_on(&canvas()).len(), 1);
        assert_eq!(Hex { size: 30.0, ..Hex::default() }.advice_on(&canvas()).len(), 1);
    }
}
