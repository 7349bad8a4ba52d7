//! [`Wrap`]: repeats the canvas of a field. Cost: a copy.
use crate::torus::Torus;
use shibo_node::{AnyField, CanvasFacts, Context, In, Node, Output, Outputs, node};
use shibo_value::{Field, Stop, Tiling};

/// Repeats a field with the canvas, ignoring its values beyond the edge: to the right of the right edge, the left edge
/// follows.
///
/// Use it for a field that tiles although no node can know it: because it is masked out near the border, or is the same
/// at opposite edges. Other fields get a seam: use `MakeTileable`, which blends them. In directions in which the canvas
/// does not tile nothing changes.
///
/// ```ron
/// "at": Coordinates(),
/// "fade": Remap(input: "at.radius", from: (28, 10), clamp: true),
/// "rings": "= fade * (0.5 + 0.5 * sin(60 * at.radius))",
/// "tiles": Wrap(input: "rings"),
/// "example": Transform(input: "tiles", offset: (20, 14)),
/// ```
///
/// Elsewhere: Substance Designer *Tiling Mode*; Blender *Image Texture* (Repeat); Photoshop *Offset* (Wrap Around).
#[node]
pub struct Wrap {
    /// Field to repeat.
    pub input: In<AnyField>,
}

impl Node for Wrap {
    const OUTPUTS: &'static [Output] = &[Output::like("result", &["input"], "The input, repeated.")];

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        canvas.tile()
    }

    fn makes_tile(&self, _port: &str) -> bool {
        true
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let input = cx.get(&self.input)?;
        let (ty, tiled, canvas) = (input.ty(), input.tiling(), cx.tiling());
        let wrap = Tiling { x: canvas.x && !tiled.x, y: canvas.y && !tiled.y };
        if wrap == Tiling::NONE {
            return Ok(Outputs::one(input));
        }
        let tiling = Tiling { x: canvas.x || tiled.x, y: canvas.y || tiled.y };
        Ok(Outputs::one(Field::new(ty, tiling, Torus { input, size: cx.size_mm(), wrap })))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{canvas, check_field, crop, field, lumps, port};
    use shibo_value::{Type, Window};

    #[test]
    fn the_canvas_is_repeated() {
        let ramp = Field::generate(Type::Gray, Tiling::NONE, |out, _| {
            let (window, width) = (out.window, out.window.width.cast_signed());
            for (k, v) in (0..).zip(out.plane_mut(0)) {
                *v = (window.x + k % width + 100 * (window.y + k / width)) as f32;
            }
            Ok(())
        });
        let node = Wrap { input: port(0) };
        let wrapped = field(&node, &[ramp.into()]);
        assert_eq!(wrapped.tiling(), Tiling::BOTH);
        check_field(&wrapped);
        let tile = crop(&wrapped, &canvas(), Window { x: 60, y: -2, width: 8, height: 4 });
        assert_eq!(tile.row(0, 0), [6260.0, 6261.0, 6262.0, 6263.0, 6200.0, 6201.0, 6202.0, 6203.0]);
        assert_eq!(tile.row(0, 2)[3..6], [63.0, 0.0, 1.0]);
        // A field that repeats already is passed on.
        check_field(&field(&node, &[lumps().to_rgb().into()]));
    }
}
