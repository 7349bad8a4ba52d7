//! [`Coordinates`]: the position of a pixel. Cost: O(pixels).
use glam::DVec2;
use shibo_kernel::ground::math::atan2_degrees;
use shibo_kernel::ground::number::narrow;
use shibo_node::{CanvasFacts, Context, Fact, Node, Output, Outputs, Xy, node};
use shibo_value::{Field, Stop, Tiling, Type};

/// The position of each pixel: in mm, as shares of the canvas, and as distance and direction from a point.
///
/// Coordinates jump from one edge of the canvas to the other, so results computed from them tile only if the graph
/// makes them tile.
///
/// ```ron
/// "at": Coordinates(),
/// "example": "= 0.5 + 0.5 * sin(90 * at.radius + 3 * at.angle)",
/// ```
///
/// Elsewhere: Blender *Texture Coordinate*, Material Maker *UV*, Substance Designer `$pos`, Unreal *TexCoord*,
/// Houdini *UV Coords*.
#[node]
pub struct Coordinates {
    /// The point from which `radius`, `angle` and `vector` are measured; the middle of the canvas by default.
    #[schemars(extend("minimum" = -1e6, "maximum" = 1e6, "unit" = "mm"))]
    pub center: Option<Xy>,
}

impl Node for Coordinates {
    const OUTPUTS: &'static [Output] = &[
        Output::new("x", Type::Gray, "Distance from the left edge.").in_unit("mm"),
        Output::new("y", Type::Gray, "Distance from the upper edge.").in_unit("mm"),
        Output::new("u", Type::Gray, "Share of the canvas from the left edge, 0..1."),
        Output::new("v", Type::Gray, "Share of the canvas from the upper edge, 0..1."),
        Output::new("radius", Type::Gray, "Distance from the centre.").in_unit("mm"),
        Output::new("angle", Type::Gray, "Direction from the centre, -180..180, from +x towards +y.").in_unit("°"),
        Output::new("vector", Type::Vec2, "The vector from the centre.").in_unit("mm"),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn tiling(&self, _canvas: &CanvasFacts) -> Tiling {
        Tiling::NONE
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let size = cx.size_mm();
        let center = self.center.map_or(0.5 * size, |center| DVec2::new(center.x, center.y));
        let field = |of: fn(DVec2, DVec2, DVec2) -> f32| {
            Field::generate(Type::Gray, Tiling::NONE, move |out, _| {
                let (grid, window) = (out.grid, out.window);
                for (row, y) in (0..out.height()).zip(window.y..) {
                    for (value, x) in out.row_mut(0, row).iter_mut().zip(window.x..) {
                        let at = grid.center(x, y);
                        *value = of(at, at - center, size);
                    }
                }
                Ok(())
            })
        };
        let vector = Field::generate(Type::Vec2, Tiling::NONE, move |out, _| {
            let (grid, window) = (out.grid, out.window);
            for axis in 0..2 {
                for (row, y) in (0..out.height()).zip(window.y..) {
                    for (value, x) in out.row_mut(axis, row).iter_mut().zip(window.x..) {
                        *value = narrow((grid.center(x, y) - center)[axis]);
                    }
                }
            }
            Ok(())
        });
        Ok(Outputs::one(field(|at, _, _| narrow(at.x)))
            .with("y", field(|at, _, _| narrow(at.y)))
            .with("u", field(|at, _, size| narrow(at.x / size.x)))
            .with("v", field(|at, _, size| narrow(at.y / size.y)))
            .with("radius", field(|_, from, _| narrow(from.length())))
            .with("angle", field(|_, from, _| atan2_degrees(narrow(from.y), narrow(from.x))))
            .with("vector", vector))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field};
    use crate::testing::{canvas, raster};

    #[test]
    fn gives_positions_in_every_form() {
        let node = Coordinates { center: Some(Xy::new(4.25, 3.25)) };
        conforms(&node, &[]);
        conforms(&Coordinates::default(), &[]);
        let at = |name: &str| raster(&field(&node, &[], name), &canvas()).row(0, 14)[16];
        // The middle of pixel (16, 14) of ½ mm lies at (8.25, 7.25): 4 and 4 mm from the centre.
        assert_eq!(["x", "y", "u", "v"].map(at), [8.25, 7.25, 8.25 / 32.0, 7.25 / 32.0]);
        assert!((at("radius") - 32f32.sqrt()).abs() < 1e-5);
        assert_eq!((at("angle"), at("vector")), (45.0, 4.0));
    }
}
