//! [`RegionGradient`]: a slope over every piece.
//!
//! The x of [`RegionCoordinates`](super::RegionCoordinates) from 0 to 1. Cost: O(pixels).
use super::per_piece::of_pieces;
use super::region_coordinates::{Coordinates, PieceAxis};
use glam::UVec2;
use shibo_kernel::ground::hash::Hash;
use shibo_node::{CanvasFacts, Context, Fact, IdsField, In, Node, Output, Outputs, node};
use shibo_value::{Stop, Type};

/// A gradient from 0 to 1 over each piece, in one direction or in a separate one for each piece: slabs that lie askew,
/// shaded veneers, scales.
///
/// A whole-picture operation. Every piece of any size has 0 at one end and 1 at the other. Where the numbers tile, a
/// piece that crosses the border is one piece.
///
/// ```ron
/// "floor": Brick(size: (9.6, 4.6), gap: 0.4),
/// "slope": RegionGradient(ids: "floor.ids"),
/// "tilted": "= floor + 1.5 * slope",
/// "example": Relief(height: "tilted"),
/// ```
///
/// Elsewhere: Substance Designer *Flood Fill to Gradient*; Material Maker *Fill to Gradient*.
#[node]
pub struct RegionGradient {
    /// The numbers of the pieces.
    pub ids: In<IdsField>,
    /// Reference of `angle`: the x axis of the canvas, or the long side of each piece.
    #[default(PieceAxis::Canvas)]
    pub axis: PieceAxis,
    /// Direction in which values rise, from +x towards +y.
    #[schemars(range(min = -360, max = 360), extend("unit" = "°"))]
    pub angle: f64,
    /// Largest random change of the direction, either way: with 180° all directions are equally likely.
    #[schemars(range(min = 0, max = 180), extend("unit" = "°"))]
    #[default(180.0)]
    pub vary: f64,
    /// Another seed gives other directions.
    pub seed: u64,
}

impl Node for RegionGradient {
    const OUTPUTS: &'static [Output] = &[Output::new("value", Type::Gray, "The gradient, 0..1.")];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Seed];

    fn whole_bytes(&self, pixels: UVec2, _canvas: &CanvasFacts) -> u64 {
        of_pieces(pixels, 1)
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let hash = Hash::new(cx.seed(self.seed));
        let (ids, size) = (cx.get(&self.ids)?, cx.size_mm());
        let own = Coordinates { ids, size, axis: self.axis, angle: self.angle, vary: self.vary, hash };
        Ok(Outputs::one(own.unit(Type::Gray)))
    }
}

#[cfg(test)]
mod tests {
    use super::super::stand_in::slabs;
    use super::*;
    use crate::conform::conforms;
    use crate::testing::{port, render};

    #[test]
    fn gradients_conform() {
        conforms(&RegionGradient { ids: port(0), ..RegionGradient::default() }, &[slabs().into()]);
    }

    #[test]
    fn every_piece_has_the_whole_range() {
        let node = RegionGradient { ids: port(0), vary: 0.0, ..RegionGradient::default() };
        let out = render(&node, &[slabs().into()]);
        let near = |x: usize, y: usize, want: f32| assert!((out.row(0, y)[x] - want).abs() < 1e-4, "{x} {y}");
        // Pixels of ½ mm; gradients over 16 mm, over 4 mm, and across the border from 26 to 34 mm.
        near(0, 3, 0.25 / 16.0);
        near(31, 3, 15.75 / 16.0);
        near(0, 30, 0.25 / 4.0);
        near(7, 30, 3.75 / 4.0);
        near(52, 10, 0.25 / 8.0);
        near(3, 10, 7.75 / 8.0);
        let down = render(&RegionGradient { angle: 90.0, ..node }, &[slabs().into()]);
        assert!((down.row(0, 24)[2] - 0.25 / 16.0).abs() < 1e-3 && (down.row(0, 7)[9] - 3.75 / 4.0).abs() < 1e-3);
    }
}
