//! [`MatchHistogram`]: gives a field the distribution of values of another.
//!
//! Matches quantiles, each channel separately: the value below which a share of the input lies becomes the value below
//! which the same share of the other picture lies (R. Gonzalez, R. Woods, "Digital image processing", §3.3). Both are
//! measured on the whole canvas at 512 pixels along its longer side, by 1024 quantiles. Cost: O(pixels), about 10 ns
//! per pixel.
use crate::measured::Measured;
use crate::values::LUMINANCE;
use shibo_kernel::ground::math::lerp;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::tile::channel;
use shibo_kernel::pointwise::histogram::{self, Transfer};
use shibo_node::{AnyField, Context, Fact, In, Node, Output, Outputs, node};
use shibo_value::{Field, Halo, Stop, Tile, Type};
use std::sync::OnceLock;

/// Changes values so that they have the distribution of another picture: its brightness, contrast and colours.
///
/// A whole-picture operation: both are measured on the canvas, at 512 pixels along its longer side, before anything is
/// drawn. The order of values does not change.
///
/// ```ron
/// "cells": Worley(size: 9),
/// "noise": Fractal(size: 8, octaves: 6),
/// "levels": Levels(input: "noise", low: 0.35, high: 0.75),
/// "example": MatchHistogram(input: "cells.f1", to: "levels"),
/// ```
///
/// Elsewhere: Substance Designer *Color Match*.
#[node]
pub struct MatchHistogram {
    /// Field to change.
    pub input: In<AnyField>,
    /// Field with the wanted distribution. For a grey input the distribution of its luminance is used.
    pub to: In<AnyField>,
    /// Strength: 0 changes nothing, 1 matches.
    #[schemars(range(min = 0, max = 1))]
    #[default(1.0)]
    pub amount: f64,
}

/// Number of quantiles that are matched.
const QUANTILES: usize = 1024;

fn luminance(color: Field) -> Field {
    Field::map(Type::Gray, [color], Halo::NONE, |out: &mut Tile, [color]: [&Tile; 1]| {
        for (k, weight) in LUMINANCE.into_iter().enumerate() {
            out.data_mut().iter_mut().zip(color.plane(k)).for_each(|(out, v)| *out += weight * v);
        }
        Ok(())
    })
}

impl Node for MatchHistogram {
    const OUTPUTS: &'static [Output] = &[Output::like("result", &["input"], "The input with the other distribution.")];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn no_op(&self) -> Option<&'static str> {
        (self.amount == 0.0).then_some("input")
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (input, to) = (cx.get(&self.input)?, cx.get(&self.to)?);
        if self.no_op().is_some() {
            return Ok(Outputs::one(input));
        }
        let to = if input.channels() == 1 && to.channels() == 3 { luminance(to) } else { to };
        let (ty, tiling, amount) = (input.ty(), input.tiling(), narrow(self.amount));
        let source = Measured {
            fields: vec![input, to],
            size: cx.size_mm(),
            measure: |tiles: &[Tile]| {
                let quantiles = |plane: &[f32]| histogram::quantiles(&mut plane.to_vec(), QUANTILES);
                let transfer = |k| Transfer::new(&quantiles(tiles[0].plane(k)), &quantiles(channel(&tiles[1], k)));
                (0..tiles[0].channels()).map(transfer).collect::<Vec<_>>()
            },
            fill: move |transfers: &Vec<Transfer>, input: &Tile, out: &mut Tile| {
                for (k, (out, transfer)) in out.planes_mut().into_iter().zip(transfers).enumerate() {
                    for (out, x) in out.iter_mut().zip(input.plane(k)) {
                        *out = lerp(*x, transfer.at(*x), amount);
                    }
                }
            },
            made: OnceLock::new(),
        };
        Ok(Outputs::one(Field::new(ty, tiling, source)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, gray, pairs, rgb};
    use crate::testing::{lumps, port, raster};

    fn node(amount: f64) -> MatchHistogram {
        MatchHistogram { input: port(0), to: port(1), amount }
    }

    #[test]
    fn matches_quantiles() {
        let inputs = [gray().into(), lumps().into()];
        conforms(&node(1.0), &inputs);
        let canvas = crate::testing::canvas();
        let made = raster(&field(&node(1.0), &inputs, "result"), &canvas);
        let wanted = raster(&lumps(), &canvas);
        let share = |tile: &Tile, level: f32| tile.data().iter().filter(|v| **v < level).count() as f32 / 4096.0;
        for level in [0.05, 0.2, 0.4, 0.6, 0.8, 0.95] {
            let (a, b) = (share(&made, level), share(&wanted, level));
            assert!((a - b).abs() < 0.03, "{a} instead of {b} below {level}");
        }
        let mut pairs = pairs(&gray(), &made_field(&inputs));
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        assert!(pairs.windows(2).all(|p| p[0].1 <= p[1].1), "the order of values changes");
    }

    fn made_field(inputs: &[shibo_value::Value]) -> Field {
        field(&node(1.0), inputs, "result")
    }

    #[test]
    fn grey_and_colours_mix() {
        conforms(&node(0.5), &[rgb().into(), gray().into()]);
        conforms(&node(1.0), &[gray().into(), rgb().into()]);
        let flat = Field::constant(Type::Gray, &[3.0]);
        conforms(&node(1.0), &[flat.clone().into(), gray().into()]);
        let out = pairs(&gray(), &field(&node(1.0), &[gray().into(), flat.into()], "result"));
        assert!(out.iter().all(|(_, y)| *y == 3.0));
    }
}
