//! [`AutoLevels`]: stretches the input to the whole range.
//!
//! The minimum and the maximum are measured on the whole canvas, at 512 pixels along its longer side for every
//! resolution of the picture, so a preview looks like the final picture. Values of finer detail beyond them are
//! clamped. Cost: O(pixels), plus once the input at that resolution.
use crate::measured::Measured;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::pointwise::{histogram, tone};
use shibo_node::{AnyField, Context, Fact, In, Linear, Node, Output, Outputs, node};
use shibo_value::{Field, Stop, Tile};
use std::sync::OnceLock;

/// Stretches the contrast to the full range: the minimum becomes black and the maximum white.
///
/// A whole-picture operation: the input is measured on the canvas, at 512 pixels along its longer side, before anything
/// is drawn. An input that is the same everywhere becomes the lower end of `output`.
///
/// ```ron
/// "clouds": Fractal(size: 14),
/// "dull": Remap(input: "clouds", to: (0.4, 0.6)),
/// "example": AutoLevels(input: "dull", clip: 0.01),
/// ```
///
/// Elsewhere: Substance Designer *Auto Levels*, Blender *Normalize*, Houdini *Equalize*.
#[node]
pub struct AutoLevels {
    /// Field to stretch.
    pub input: In<AnyField>,
    /// The share of the pixels that is clamped at each end.
    #[schemars(range(min = 0, max = 0.49))]
    pub clip: f64,
    /// True to stretch the channels of a colour separately, which removes a colour cast; false to stretch them alike.
    pub separate: bool,
    /// New values of black and white, `(black, white)`.
    #[schemars(extend("minimum" = -1e9, "maximum" = 1e9))]
    #[default(Linear::new(0.0, 1.0))]
    pub output: Linear,
}

/// Number of quantiles for cutting off a share.
const QUANTILES: usize = 4096;

/// The values between which a share `1 - 2·clip` of the pixels lies, for each channel of a tile.
fn ends(tile: &Tile, clip: f64, separate: bool) -> Vec<[f32; 2]> {
    let of = |values: &[f32]| {
        if clip == 0.0 {
            let (low, high) = values.iter().fold((f32::MAX, f32::MIN), |(l, h), v| (l.min(*v), h.max(*v)));
            return [low, high];
        }
        let quantiles = histogram::quantiles(&mut values.to_vec(), QUANTILES);
        [histogram::quantile(&quantiles, clip), histogram::quantile(&quantiles, 1.0 - clip)]
    };
    if separate {
        (0..tile.channels()).map(|k| of(tile.plane(k))).collect()
    } else {
        vec![of(tile.data()); tile.channels()]
    }
}

impl Node for AutoLevels {
    const OUTPUTS: &'static [Output] = &[Output::like("result", &["input"], "The input on the full range.")];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let input = cx.get(&self.input)?;
        let (clip, separate) = (self.clip, self.separate);
        let output = [narrow(self.output.at0), narrow(self.output.at1)];
        let (ty, tiling) = (input.ty(), input.tiling());
        let source = Measured {
            fields: vec![input],
            size: cx.size_mm(),
            measure: move |tiles: &[Tile]| ends(&tiles[0], clip, separate),
            fill: move |ends: &Vec<[f32; 2]>, input: &Tile, out: &mut Tile| {
                for (k, (out, ends)) in out.planes_mut().into_iter().zip(ends).enumerate() {
                    match *ends {
                        [low, high] if high > low => tone::remap(input.plane(k), out, *ends, output, true),
                        _ => out.fill(output[0]),
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
    use crate::testing::{port, render};
    use shibo_value::Type;

    fn node() -> AutoLevels {
        AutoLevels { input: port(0), ..AutoLevels::default() }
    }

    #[test]
    fn the_whole_range_is_used() {
        // The test field has the values -0.5 … 1.46875, all equally often.
        let wanted = |x: f32, low: f32, high: f32| ((x - low) / (high - low)).clamp(0.0, 1.0);
        for (clip, [low, high]) in [(0.0, [-0.5, 1.468_75]), (0.25, [-0.0, 0.968_75])] {
            let node = AutoLevels { clip, ..node() };
            conforms(&node, &[gray().into()]);
            let pairs = pairs(&gray(), &field(&node, &[gray().into()], "result"));
            let worst = pairs.iter().map(|(x, y)| (y - wanted(*x, low, high)).abs()).fold(0.0, f32::max);
            assert!(worst < 0.03, "{clip}: {worst}");
        }
    }

    #[test]
    fn stretches_channels_together_or_separately() {
        let tinted = Field::map(Type::Rgb, [gray()], shibo_value::Halo::NONE, |out, [input]| {
            for (k, plane) in out.planes_mut().into_iter().enumerate() {
                plane.iter_mut().zip(input.plane(0)).for_each(|(o, v)| *o = (0.5 + v) * (k + 1) as f32);
            }
            Ok(())
        });
        let ends = |node: &AutoLevels| {
            let out = render(node, &[tinted.clone().into()]);
            [0, 1, 2].map(|k| out.plane(k).iter().copied().fold(0.0, f32::max))
        };
        assert!(ends(&AutoLevels { separate: true, ..node() }).iter().all(|end| (end - 1.0).abs() < 1e-6));
        let alike = ends(&node());
        assert!((alike[0] - 1.0 / 3.0).abs() < 1e-6 && (alike[2] - 1.0).abs() < 1e-6, "{alike:?}");
        conforms(&AutoLevels { separate: true, clip: 0.1, ..node() }, &[rgb().into()]);
    }

    #[test]
    fn keeps_flat_input() {
        let flat = Field::constant(Type::Gray, &[7.0]);
        let out = render(&AutoLevels { output: Linear::new(0.25, 1.0), ..node() }, &[flat.into()]);
        assert!(out.data().iter().all(|v| *v == 0.25));
    }
}
