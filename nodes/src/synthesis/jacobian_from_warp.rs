//! [`JacobianFromWarp`]: features bent as a warp bends a picture.
//!
//! Source: JP5149288B2 III (rows C3, C15). Where `Warp` shows its input at `p + d(p)`, the Jacobian is `1 + ∂d/∂p`, by
//! central differences. Cost: O(pixels).
use shibo_node::{Context, Fact, Gray, In, Node, Output, Outputs, Vec2Field, node};
use shibo_value::{Field, Halo, Stop, Tile, Type};

/// Bends features as `Warp` with the same displacements would bend a picture, but without stretching pixels.
///
/// ```ron
/// "x": Perlin(size: 30),
/// "jacobian": JacobianFromWarp(x: "x", amount: 12),
/// "cells": Worley(size: 4),
/// "exemplar": Exemplar(input: "cells", size: (64, 64), periodic: Yes),
/// "coords": Synthesize(exemplar: "exemplar", jacobian: "jacobian", size: (200, 200)),
/// "example": SampleExemplar(coords: "coords", input: "cells", jacobian: "jacobian"),
/// ```
#[node]
pub struct JacobianFromWarp {
    /// Displacements in mm; instead of `x` and `y`.
    pub by: Option<In<Vec2Field>>,
    /// Displacement along x: 0 is -amount, 1 is +amount.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    #[default(In::constant(0.5))]
    pub x: In<Gray>,
    /// Displacement along y: 0 is -amount, 1 is +amount.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    #[default(In::constant(0.5))]
    pub y: In<Gray>,
    /// Displacement for the value 1 of `x` and `y`; the value 0 is its negative.
    #[schemars(range(min = 0, max = 1e5), extend("unit" = "mm"))]
    #[default(1.0)]
    pub amount: f64,
}

impl Node for JacobianFromWarp {
    const FACTS: &'static [Fact] = &[];
    const OUTPUTS: &'static [Output] =
        &[Output::new("jacobian", Type::Jacobian, "From output to exemplar: J00 J01 J10 J11.")];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let scale = shibo_kernel::ground::number::narrow(2.0 * self.amount);
        let by = match cx.get_opt(&self.by)? {
            Some(by) => by,
            None => {
                let fill = move |out: &mut Tile, [x, y]: [&Tile; 2]| {
                    out.plane_mut(0).iter_mut().zip(x.data()).for_each(|(o, v)| *o = (v - 0.5) * scale);
                    out.plane_mut(1).iter_mut().zip(y.data()).for_each(|(o, v)| *o = (v - 0.5) * scale);
                    Ok(())
                };
                Field::map(Type::Vec2, [cx.get(&self.x)?, cx.get(&self.y)?], Halo::NONE, fill)
            }
        };
        let fill = |out: &mut Tile, [by]: [&Tile; 1]| {
            let step = (out.grid.step * 2.0).as_vec2();
            let (w, n) = (out.width(), out.window.len());
            for p in 0..n {
                let (x, y) = (p % w + 1, p / w + 1);
                let slope = |c: usize| {
                    [
                        (by.row(c, y)[x + 1] - by.row(c, y)[x - 1]) / step.x,
                        (by.row(c, y + 1)[x] - by.row(c, y - 1)[x]) / step.y,
                    ]
                };
                let (a, b) = (slope(0), slope(1));
                let j = [1.0 + a[0], a[1], b[0], 1.0 + b[1]];
                (0..4).for_each(|c| out.data_mut()[c * n + p] = j[c]);
            }
            Ok(())
        };
        Ok(Outputs::one(Field::map(Type::Jacobian, [by], Halo::px(1), fill)))
    }
}
