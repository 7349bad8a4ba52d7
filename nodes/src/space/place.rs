//! [`Place`]: puts a whole field into a rectangle of the canvas.
//!
//! The field is placed in the middle of the canvas and moved from there; where the canvas tiles, parts that cross an
//! edge enter on the other side. Hidden parts of the base and of the input are not computed. Cost: that of the input on
//! another grid, and a blend at the border.
use crate::masked::{self, Masked, Mix};
use crate::moved::Placement;
use crate::torus::Torus;
use glam::DVec2;
use shibo_kernel::ground::math::lerp;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::tile::widest;
use shibo_node::{AnyField, CanvasFacts, Context, Fact, In, Node, Output, Outputs, Xy, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Field, Stop, Tiling, Type};

/// Puts the whole canvas of a field into a rectangle, over a base: a label, a sample on a sheet, a picture in its
/// frame. `Crop` does the opposite.
///
/// The border is one pixel sharp. On a canvas that tiles the rectangle may cross the edge.
///
/// ```ron
/// "cells": Worley(size: 8),
/// "noise": Perlin(size: 4),
/// "base": Remap(input: "noise", to: (0, 0.3)),
/// "example": Place(input: "cells.value", base: "base", position: (12, 14), size: (30, 30), angle: 12),
/// ```
///
/// Elsewhere: Substance Designer *Transformation 2D* without tiling; Photoshop *Place*; Blender *Alpha Over*.
#[node]
pub struct Place {
    /// Field to place.
    pub input: In<AnyField>,
    /// Field that shows around it.
    #[default(In::constant(0.0))]
    pub base: In<AnyField>,
    /// The upper left corner of the rectangle, before the rotation.
    #[schemars(extend("minimum" = -1e6, "maximum" = 1e6, "unit" = "mm"))]
    pub position: Xy,
    /// Width and height of the rectangle; half the canvas if not given.
    #[schemars(extend("exclusiveMinimum" = 0.0, "maximum" = 1e6, "unit" = "mm"))]
    pub size: Option<Xy>,
    /// Rotation of the rectangle about its middle, from +x towards +y.
    #[schemars(range(min = -360, max = 360), extend("unit" = "°"))]
    pub angle: f64,
}

impl Place {
    fn size(&self, canvas: DVec2) -> DVec2 {
        self.size.map_or(0.5 * canvas, |size| DVec2::new(size.x, size.y))
    }

    /// The share of each pixel that lies in the rectangle, for a rectangle in the middle of the canvas.
    fn mask(&self, canvas: DVec2) -> Field {
        let (half, (sin, cos)) = (0.5 * self.size(canvas), crate::degrees::sin_cos(self.angle));
        Field::generate(Type::Gray, Tiling::NONE, move |out, _| {
            let (grid, window) = (out.grid, out.window);
            let pixel = grid.step.element_product().sqrt();
            for (row, y) in (0..out.height()).zip(window.y..) {
                for (value, x) in out.row_mut(0, row).iter_mut().zip(window.x..) {
                    let from = grid.center(x, y) - 0.5 * canvas;
                    let at = DVec2::new(cos * from.x + sin * from.y, cos * from.y - sin * from.x);
                    let inside = ((half - at.abs()) / pixel + 0.5).clamp(DVec2::ZERO, DVec2::ONE);
                    *value = narrow(inside.element_product());
                }
            }
            Ok(())
        })
    }
}

impl Node for Place {
    const OUTPUTS: &'static [Output] = &[
        Output::like("result", &["input", "base"], "The base with the rectangle on it."),
        Output::new("mask", Type::Gray, "1 in the rectangle, 0 around it."),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        let (size, (sin, cos)) = (self.size(canvas.size_mm()), crate::degrees::sin_cos(self.angle));
        let needs =
            DVec2::new((size.x * cos).abs() + (size.y * sin).abs(), (size.x * sin).abs() + (size.y * cos).abs());
        let (tile, most) = (canvas.tile(), canvas.size_mm() * (1.0 + 1e-9));
        if (!tile.x || needs.x <= most.x) && (!tile.y || needs.y <= most.y) {
            return Vec::new();
        }
        let message = format!(
            "the rectangle is {:.4} × {:.4} mm; on a canvas that tiles it must be at most as large as the canvas, {} × {} mm",
            needs.x,
            needs.y,
            canvas.size_mm().x,
            canvas.size_mm().y
        );
        vec![Problem::new(Code::OutOfRange, message).at("size").help("`Crop` shows a part of a field")]
    }

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        canvas.tile()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (input, base, canvas) = (cx.get(&self.input)?, cx.get(&self.base)?, cx.size_mm());
        let (ty, size, wrap) = (widest([&input, &base]), self.size(canvas), cx.tiling());
        let scale = (size / canvas).clamp(DVec2::splat(1e-6), DVec2::splat(1e6));
        let still =
            Placement { offset: Xy::new(0.0, 0.0), angle: self.angle, scale: Xy::new(scale.x, scale.y), pivot: None };
        let offset = DVec2::new(self.position.x, self.position.y) + 0.5 * (size - canvas);
        let only_moved =
            Placement { offset: Xy::new(offset.x, offset.y), angle: 0.0, scale: Xy::new(1.0, 1.0), pivot: None };
        let moved = |field: Field| {
            let repeated = match wrap {
                Tiling::NONE => field,
                wrap => Field::new(field.ty(), wrap, Torus { input: field, size: canvas, wrap }),
            };
            only_moved.place(&repeated, canvas)
        };
        let mask = cx.shared_field("mask", moved(self.mask(canvas)));
        let placed = still.place(&input, canvas);
        let placed = if placed.as_constant().is_some() { placed } else { moved(placed) };
        let mix: Mix = Box::new(|out, weight, base, top| {
            for (k, plane) in out.iter_mut().enumerate() {
                let sides = masked::plane(&base[0], k).iter().zip(masked::plane(&top[0], k));
                for ((out, weight), (base, top)) in plane.iter_mut().zip(weight).zip(sides) {
                    *out = if *weight == 1.0 { *top } else { lerp(*base, *top, *weight) };
                }
            }
        });
        let tiling = wrap.and(base.tiling());
        let layers = Masked { weight: mask.clone(), base: vec![base], top: vec![placed], covering: Some(0.0), mix };
        Ok(Outputs::one(layers.field(ty).tiled(tiling)).with("mask", mask))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, gray, part, rgb};
    use crate::testing::{OnCanvas as _, canvas, port};

    fn node() -> Place {
        Place {
            input: port(0),
            base: port(1),
            position: Xy::new(24.0, 4.0),
            size: Some(Xy::new(16.0, 16.0)),
            angle: 0.0,
        }
    }

    #[test]
    fn the_canvas_lies_in_the_rectangle() {
        let inputs = [gray().into(), Field::constant(Type::Gray, &[9.0]).into()];
        let placed = part(&field(&node(), &inputs, "result"), &canvas(), 0, 0, 64, 64);
        // 24 to 40 mm are the last 16 pixels and the first 16; they show every second pixel of the input, computed from
        // its formula.
        let coarse = shibo_value::Canvas { resolution: glam::UVec2::splat(32), ..canvas() };
        let small = part(&gray(), &coarse, 0, 0, 32, 32);
        for y in 0..64usize {
            for x in 0..64usize {
                let (i, j) = ((x + 16) % 64, y.wrapping_sub(8));
                let want = if i < 32 && j < 32 { small.row(0, j)[i] } else { 9.0 };
                assert_eq!(placed.row(0, y)[x], want, "{x} {y}");
            }
        }
    }

    #[test]
    fn place_conforms() {
        for (angle, size) in [(0.0, 13.7), (30.0, 20.0), (-90.0, 0.01)] {
            let node = Place { angle, size: Some(Xy::new(size, 0.5 * size)), ..node() };
            conforms(&node, &[rgb().into(), gray().into()]);
            conforms(&node, &[gray().into(), rgb().into()]);
            conforms(&node, &[Field::constant(Type::Gray, &[1.0]).into(), rgb().into()]);
        }
    }

    #[test]
    fn refuses_rectangles_larger_than_tiling_canvas() {
        assert_eq!(node().check_on(&canvas()), []);
        let large = Place { size: Some(Xy::new(33.0, 1.0)), ..node() };
        assert_eq!(large.check_on(&canvas())[0].field.as_deref(), Some("size"));
        assert!(large.check_on(&shibo_value::Canvas { tile: Tiling::NONE, ..canvas() }).is_empty());
    }
}
