//! [`JacobianMultiply`]: one Jacobian after another.
//!
//! Source: JP5149288B2 III (row C3). Cost: O(pixels).
use shibo_kernel::synthesis::jacobian::multiply;
use shibo_node::{Context, Fact, In, JacobianField, Node, Output, Outputs, node};
use shibo_value::{Field, Halo, Stop, Tile, Type};

/// The product A·B: features are first changed by `a`, and then, as a whole, by `b`.
///
/// ```ron
/// "turned": JacobianFromAngleScale(angle: 30),
/// "hills": Perlin(size: 30),
/// "bent": JacobianFromWarp(x: "hills", amount: 10),
/// "jacobian": JacobianMultiply(a: "turned", b: "bent"),
/// "cells": Worley(size: 4),
/// "exemplar": Exemplar(input: "cells", size: (64, 64), periodic: Yes),
/// "coords": Synthesize(exemplar: "exemplar", jacobian: "jacobian", size: (200, 200)),
/// "example": SampleExemplar(coords: "coords", input: "cells", jacobian: "jacobian"),
/// ```
#[node]
pub struct JacobianMultiply {
    /// The factor next to the exemplar.
    pub a: In<JacobianField>,
    /// The factor next to the output.
    pub b: In<JacobianField>,
}

impl Node for JacobianMultiply {
    const FACTS: &'static [Fact] = &[];
    const OUTPUTS: &'static [Output] = &[Output::new("jacobian", Type::Jacobian, "The product.")];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (a, b) = (cx.get(&self.a)?, cx.get(&self.b)?);
        if let (Some(&[a0, a1, a2, a3]), Some(&[b0, b1, b2, b3])) = (a.as_constant(), b.as_constant()) {
            let product = multiply(&[a0, a1, a2, a3], &[b0, b1, b2, b3]);
            return Ok(Outputs::one(Field::constant(Type::Jacobian, &product)));
        }
        let fill = |out: &mut Tile, [a, b]: [&Tile; 2]| {
            let n = out.window.len();
            for p in 0..n {
                let at = |t: &Tile| std::array::from_fn(|c| t.plane(c)[p]);
                let j = multiply(&at(a), &at(b));
                (0..4).for_each(|c| out.data_mut()[c * n + p] = j[c]);
            }
            Ok(())
        };
        Ok(Outputs::one(Field::map(Type::Jacobian, [a, b], Halo::NONE, fill)))
    }
}
