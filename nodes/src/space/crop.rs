//! [`Crop`]: a rectangle of a field, enlarged to the whole canvas.
//!
//! The input is evaluated with as many pixels as the rectangle has on the result, so the result stays sharp; see
//! [`Transform`](crate::space::Transform). Cost: that of the input on another grid.
use crate::moved::Placement;
use glam::DVec2;
use shibo_node::{AnyField, CanvasFacts, Context, Fact, In, Node, Output, Outputs, Xy, node};
use shibo_value::{Stop, Tiling};

/// Shows a rectangle of a field on the whole canvas. `Place` does the opposite.
///
/// The result tiles in a direction in which the rectangle spans a whole number of canvases; otherwise use `Wrap` or
/// `MakeTileable`.
///
/// ```ron
/// "cells": Worley(size: 6),
/// "example": Crop(input: "cells.value", position: (8, 8), size: (16, 16)),
/// ```
///
/// Elsewhere: Substance Designer *Crop Grayscale*, *Crop Color*; Houdini *Crop*; Blender *Crop Image*; Photoshop
/// *Crop*.
#[node]
pub struct Crop {
    /// Field to crop.
    pub input: In<AnyField>,
    /// Upper left corner of the rectangle.
    #[schemars(extend("minimum" = -1e6, "maximum" = 1e6, "unit" = "mm"))]
    pub position: Xy,
    /// Width and height of the rectangle; half the canvas if not given. A shape other than that of the canvas is
    /// stretched.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e6, "unit" = "mm"))]
    pub size: Option<Xy>,
}

impl Crop {
    fn placement(&self, canvas: DVec2) -> Placement {
        let size = self.size.map_or(0.5 * canvas, |size| DVec2::new(size.x, size.y));
        let scale = (canvas / size).clamp(DVec2::splat(1e-6), DVec2::splat(1e6));
        let offset = -DVec2::new(self.position.x, self.position.y) * scale;
        let (offset, scale) = (Xy::new(offset.x, offset.y), Xy::new(scale.x, scale.y));
        Placement { offset, angle: 0.0, scale, pivot: Some(Xy::new(0.0, 0.0)) }
    }
}

impl Node for Crop {
    const OUTPUTS: &'static [Output] = &[Output::like("result", &["input"], "The rectangle, on the whole canvas.")];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile];

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        self.placement(canvas.size_mm()).repeats(canvas.size_mm(), canvas.tile())
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let input = cx.get(&self.input)?;
        Ok(Outputs::one(self.placement(cx.size_mm()).place(&input, cx.size_mm())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{OnCanvas as _, canvas, check_field, field, lumps, port, raster};
    use shibo_value::Canvas;

    #[test]
    fn the_rectangle_fills_the_canvas() {
        let node = Crop { input: port(0), position: Xy::new(8.0, 4.0), size: Some(Xy::new(16.0, 16.0)) };
        let tile = raster(&field(&node, &[lumps().into()]), &canvas());
        // The same as the picture of twice the resolution, from pixel (32, 16) on.
        let fine = raster(&lumps(), &Canvas { resolution: canvas().resolution * 2, ..canvas() });
        for y in 0..64 {
            assert!(tile.row(0, y).iter().zip(&fine.row(0, y + 16)[32..]).all(|(a, b)| (a - b).abs() < 1e-5));
        }
    }

    #[test]
    fn holds_in_any_window_and_says_where_it_tiles() {
        for (x, y) in [(16.0, 32.0), (64.0, 5.0), (7.3, 1e4)] {
            let node = Crop { input: port(0), position: Xy::new(3.3, -5.0), size: Some(Xy::new(x, y)) };
            check_field(&field(&node, &[lumps().to_rgb().into()]));
            let whole = |side: f64| side % 32.0 == 0.0;
            assert_eq!(node.tiling_on(&canvas()), Tiling { x: whole(x), y: whole(y) });
        }
    }
}
