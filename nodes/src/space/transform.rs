//! [`Transform`]: moves, rotates and scales a field.
//!
//! A point q of the result shows the input at `p = pivot + S⁻¹·R⁻¹·(q - pivot - offset)`. The pixels of the input have
//! the size of the result's pixels mapped into it: an enlarged field is evaluated on finer pixels and stays sharp, a
//! reduced one on coarser pixels and does not alias. Without rotation pixels are copied. With rotation they are
//! interpolated by Catmull-Rom, exactly at multiples of 90°. A picture with pixels of that size is read at its own
//! pixels, so that it is filtered only once. Cost: O(pixels), and that of the input on another grid.
use crate::moved::Placement;
use glam::DVec2;
use shibo_node::{CanvasFacts, Context, EveryField, Fact, In, Node, Output, Outputs, Xy, node};
use shibo_value::{Field, Stop, Tiling};

/// Moves, rotates and scales a field. Normals and vectors are rotated with it; vectors keep their length. Numbers of
/// pieces stay whole: each pixel takes the nearest one. Matrices (`Jacobian`) turn and stretch features with the field.
///
/// On a canvas that tiles, the result tiles if the canvas then holds a whole number of repeats of the input: always if
/// the input is only moved, and for example with `scale: 0.5`, or with `angle: 90` on a square canvas.
///
/// ```ron
/// "cells":   Worley(size: 10),
/// "example": Transform(input: "cells.value", scale: 0.5, angle: 90),
/// ```
///
/// Elsewhere: Substance Designer *Transformation 2D*; Blender *Mapping*; Material Maker *Transform*; Houdini
/// *Transform*.
#[node]
pub struct Transform {
    /// Field to move.
    pub input: In<EveryField>,
    /// Shift of the features, to the right and down.
    #[schemars(extend("minimum" = -1e6, "maximum" = 1e6, "unit" = "mm"))]
    pub offset: Xy,
    /// Rotation of the features, from +x towards +y.
    #[schemars(range(min = -360, max = 360), extend("unit" = "°"))]
    pub angle: f64,
    /// Factor on the size of the features: 2 is twice as large. Applied before the rotation.
    #[schemars(extend("minimum" = 1e-3, "maximum" = 1e3))]
    #[default(Xy::new(1.0, 1.0))]
    pub scale: Xy,
    /// The point about which features are rotated and scaled; the canvas' centre by default.
    #[schemars(extend("minimum" = -1e6, "maximum" = 1e6, "unit" = "mm"))]
    pub pivot: Option<Xy>,
}

impl Transform {
    fn placement(&self) -> Placement {
        let Self { offset, angle, scale, pivot, .. } = *self;
        Placement { offset, angle, scale, pivot }
    }

    /// A field, transformed on a canvas of this size.
    pub(super) fn apply(&self, input: &Field, size: DVec2) -> Field {
        self.placement().place(input, size)
    }

    /// The directions in which a field that repeats with the canvas still repeats.
    pub(super) fn keeps(&self, canvas: &CanvasFacts) -> Tiling {
        self.placement().repeats(canvas.size_mm(), canvas.tile())
    }
}

impl Node for Transform {
    const OUTPUTS: &'static [Output] = &[Output::like("result", &["input"], "The input, moved.")];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile];
    const VERSION: u32 = 2;

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        self.keeps(canvas)
    }

    fn no_op(&self) -> Option<&'static str> {
        self.placement().is_identity().then_some("input")
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        Ok(Outputs::one(self.apply(&cx.get(&self.input)?, cx.size_mm())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{canvas, check_field, field, lumps, pieces, port, raster, render};
    use glam::DVec2;
    use shibo_value::{Canvas, Field, Type, Value};

    fn node() -> Transform {
        Transform { input: port(0), ..Transform::default() }
    }

    #[test]
    fn offsets_move_to_the_right_and_down() {
        let inputs = [lumps().into()];
        let (before, after) =
            (render(&node(), &inputs), render(&Transform { offset: Xy::new(2.0, 1.0), ..node() }, &inputs));
        for y in 2..64 {
            assert_eq!(before.row(0, y - 2)[..60], after.row(0, y)[4..]);
        }
    }

    #[test]
    fn a_quarter_turn_is_exact() {
        let inputs = [lumps().into()];
        let (before, after) = (render(&node(), &inputs), render(&Transform { angle: 90.0, ..node() }, &inputs));
        for y in 0..64 {
            for x in 0..64 {
                // The rotation is from +x towards +y.
                assert!((before.row(0, y)[x] - after.row(0, x)[63 - y]).abs() < 1e-5);
            }
        }
        let normal = Field::constant(Type::Normal, &[1.0, 0.5, 0.5]);
        let turned = raster(&field(&Transform { angle: 90.0, ..node() }, &[normal.into()]), &canvas());
        assert_eq!([turned.plane(0)[0], turned.plane(1)[0], turned.plane(2)[0]], [0.5, 0.0, 0.5]);
    }

    #[test]
    fn vectors_turn_and_matrices_follow_the_features() {
        let constant = |ty, values: &[f32]| Value::from(Field::constant(ty, values));
        let at = |node: Transform, input: Value| {
            let tile = raster(&field(&node, &[input]), &canvas());
            (0..tile.channels()).map(|k| (tile.plane(k)[77] * 1e4).round() / 1e4).collect::<Vec<_>>()
        };
        let turned = || Transform { angle: 90.0, scale: Xy::new(2.0, 2.0), ..node() };
        assert_eq!(at(turned(), constant(Type::Vec2, &[3.0, 1.0])), [-1.0, 3.0]);
        // Features turned from +x to +y and twice as large: a step down in the canvas is half a step to the right there.
        assert_eq!(at(turned(), constant(Type::Jacobian, &[1.0, 0.0, 0.0, 1.0])), [0.0, 0.5, -0.5, 0.0]);
        assert_eq!(at(node(), constant(Type::Vec2, &[3.0, 1.0])), [3.0, 1.0]);
    }

    #[test]
    fn numbers_of_pieces_stay_whole_and_lie_where_they_are_moved() {
        let node = Transform { angle: 30.0, offset: Xy::new(1.3, 0.4), ..node() };
        let laid = field(&node, &[pieces().into()]);
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

    #[test]
    fn enlarging_is_as_sharp_as_a_finer_picture() {
        let node = Transform { scale: Xy::new(2.0, 2.0), pivot: Some(Xy::new(0.0, 0.0)), ..node() };
        let large = render(&node, &[lumps().into()]);
        let fine = Canvas { resolution: canvas().resolution * 2, ..canvas() };
        let fine = raster(&lumps(), &fine);
        for y in 0..64 {
            assert!(large.row(0, y).iter().zip(&fine.row(0, y)[..64]).all(|(a, b)| (a - b).abs() < 1e-5));
        }
    }

    #[test]
    fn says_where_it_tiles() {
        let (square, wide) = (DVec2::splat(32.0), DVec2::new(64.0, 32.0));
        let tiles = |node: Transform, size| node.placement().repeats(size, Tiling::BOTH);
        assert_eq!(tiles(Transform { offset: Xy::new(1.3, 7.7), ..node() }, wide), Tiling::BOTH);
        assert_eq!(tiles(Transform { angle: 90.0, ..node() }, square), Tiling::BOTH);
        assert_eq!(tiles(Transform { angle: 90.0, ..node() }, wide), Tiling { x: true, y: false });
        assert_eq!(tiles(Transform { angle: 180.0, ..node() }, wide), Tiling::BOTH);
        assert_eq!(tiles(Transform { scale: Xy::new(0.5, 1.0 / 3.0), ..node() }, wide), Tiling::BOTH);
        assert_eq!(tiles(Transform { scale: Xy::new(2.0, 1.0), ..node() }, wide), Tiling { x: false, y: true });
        assert_eq!(tiles(Transform { angle: 30.0, ..node() }, square), Tiling::NONE);
        let diagonal = Xy::new(0.5f64.sqrt(), 0.5f64.sqrt());
        assert_eq!(tiles(Transform { angle: 45.0, scale: diagonal, ..node() }, square), Tiling::BOTH);
        let only_x = Tiling { x: true, y: false };
        assert_eq!(
            Transform { angle: 90.0, ..node() }.placement().repeats(square, only_x),
            Tiling { x: false, y: true }
        );
    }

    #[test]
    fn holds_in_any_window() {
        let diagonal = Xy::new(0.5f64.sqrt(), 0.5f64.sqrt());
        for (angle, scale, offset) in [
            (0.0, Xy::new(0.5, 0.25), 1.234),
            (90.0, Xy::new(1.0, 1.0), 0.3),
            (45.0, diagonal, -5.0),
            (33.0, Xy::new(0.7, 3.0), 1e6),
            (-360.0, Xy::new(1e3, 1e-3), 0.0),
        ] {
            let node = Transform { angle, scale, offset: Xy::new(offset, 0.7), ..node() };
            check_field(&field(&node, &[lumps().into()]));
            check_field(&field(&node, &[lumps().to_rgb().into()]));
        }
        assert_eq!(node().no_op(), Some("input"));
    }
}
