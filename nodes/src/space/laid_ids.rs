//! [`LaidIds`]: moves the numbers of pieces; `Use` lays out the pieces of a sub-graph with it.
//!
//! Numbers are moved as by [`Transform`], but taken from the nearest pixel instead of interpolated. Graph files cannot
//! name this node: `Use(canvas: …)` makes it. Cost: O(pixels).
use super::Transform;
use shibo_node::{CanvasFacts, Context, Fact, IdsField, In, Node, Output, Outputs, Xy, node};
use shibo_value::{Stop, Tiling, Type};

/// Moves, rotates and scales numbers of pieces.
#[node]
pub struct LaidIds {
    /// Numbers to move.
    pub input: In<IdsField>,
    /// Shift of the features, to the right and down.
    pub offset: Xy,
    /// Rotation of the features, from +x towards +y.
    pub angle: f64,
    /// Factor on the size of the features.
    #[default(Xy::new(1.0, 1.0))]
    pub scale: Xy,
    /// The point about which features are rotated and scaled; the canvas' centre by default.
    pub pivot: Option<Xy>,
}

impl LaidIds {
    fn transform(&self) -> Transform {
        let Self { offset, angle, scale, pivot, .. } = *self;
        Transform { input: In::default(), offset, angle, scale, pivot }
    }
}

impl Node for LaidIds {
    const OUTPUTS: &'static [Output] = &[Output::new("result", Type::Ids, "The numbers, moved.")];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile];

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        self.transform().keeps(canvas)
    }

    fn no_op(&self) -> Option<&'static str> {
        self.transform().no_op()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        Ok(Outputs::one(self.transform().apply(&cx.get(&self.input)?, cx.size_mm())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{canvas, check_field, field, port, raster};
    use shibo_value::{Field, Tile};

    /// Stripes of 3 mm; neighbouring stripes have very different numbers.
    fn stripes() -> Field {
        Field::generate(Type::Ids, Tiling::BOTH, |out: &mut Tile, _| {
            let (grid, window) = (out.grid, out.window);
            for row in 0..out.height() {
                for (id, x) in out.row_mut(0, row).iter_mut().zip(window.x..) {
                    *id = if grid.center(x, 0).x.rem_euclid(8.0) < 4.0 { 100.0 } else { 9000.0 };
                }
            }
            Ok(())
        })
    }

    #[test]
    fn numbers_stay_whole_and_lie_where_they_are_moved() {
        let node = LaidIds { input: port(0), angle: 30.0, offset: Xy::new(1.3, 0.4), ..LaidIds::default() };
        let laid = field(&node, &[stripes().into()]);
        check_field(&laid);
        let (ids, grid) = (raster(&laid, &canvas()), canvas().grid(canvas().resolution));
        let (sin, cos) = (0.5, libm::cos(std::f64::consts::FRAC_PI_6));
        for (k, id) in (0..).zip(ids.plane(0)) {
            let p = grid.center(k % 64, k / 64);
            // The inverse by hand: subtract the offset, then rotate back about the middle.
            let (dx, dy) = (p.x - 1.3 - 16.0, p.y - 0.4 - 16.0);
            let x = (16.0 + cos * dx + sin * dy).rem_euclid(8.0);
            let far = (x - 4.0).abs().min(x.min(8.0 - x)) > 0.5;
            assert!(*id == 100.0 || *id == 9000.0, "{id}");
            assert!(!far || (*id == 100.0) == (x < 4.0), "{p}: {id} at {x}");
        }
    }
}
