//! [`HeightBlend`]: one height over another, the higher one on top.
//!
//! With c the contrast, w = smoothstep(−c/2, c/2, top + offset − base + (2·mask − 1)·(range + c/2)), times the opacity;
//! see [`kernel::layers`](shibo_kernel::surface::layers). `range` is a parameter and not measured, so a tile reads only
//! itself. Cost: O(pixels), bound by memory.
use crate::anywhere::pointwise;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::surface::layers::{ByHeight, HeightMode, mix_heights};
use shibo_node::{Context, Fact, In, Node, Number, Output, Outputs, node};
use shibo_value::{Planes, Stop, Type};

/// Blends two heights so that the higher one shows: mortar fills gaps, dust lies in grooves.
///
/// The mask shifts one height against the other: at ½ the heights alone decide, at 0 only the base shows and at 1 only
/// the top. To blend colours and other channels alike, use the output `weight` as the mask of `Blend`.
///
/// ```ron
/// "cells": Worley(size: 9),
/// "stones": Remap(input: "cells.border", from: (0, 2), to: (0, 1.5), clamp: true),
/// "noise": Fractal(size: 6, octaves: 6),
/// "sand": Remap(input: "noise", from: (0.3, 0.7), to: (0.4, 0.9)),
/// "blend": HeightBlend(base: "stones", top: "sand", contrast: 0.05),
/// "example": Relief(height: "blend"),
/// ```
///
/// Elsewhere: Substance Designer *Height Blend*, Houdini *HeightField Layer*.
#[node]
pub struct HeightBlend {
    /// The height below, mm.
    pub base: In<Number>,
    /// The height above, mm.
    pub top: In<Number>,
    /// Where the top shows, 0..1: at ½ where the top is higher, at 1 everywhere, at 0 nowhere.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    #[default(In::constant(0.5))]
    pub mask: In<Number>,
    /// Softness of the border, as a difference of height; 0 is a hard edge.
    #[schemars(range(min = 0, max = 1e4), extend("unit" = "mm"))]
    #[default(0.1)]
    pub contrast: f64,
    /// Added to the height above.
    #[schemars(range(min = -1e4, max = 1e4), extend("unit" = "mm"))]
    pub offset: f64,
    /// The largest difference of height that the mask can overcome; should be at least the largest difference between
    /// the two heights.
    #[schemars(range(min = 0, max = 1e4), extend("unit" = "mm"))]
    #[default(1.0)]
    pub range: f64,
    /// Opacity of the top where it shows, 0..1.
    #[schemars(range(min = 0, max = 1))]
    #[default(1.0)]
    pub opacity: f64,
    /// How the heights are combined where the top shows.
    #[default(HeightMode::Replace)]
    pub mode: HeightMode,
}

const PORTS: &[&str] = &["base", "top", "mask"];

impl Node for HeightBlend {
    const OUTPUTS: &'static [Output] = &[
        Output::number_of("height", PORTS, "The blended height.").in_unit("mm"),
        Output::number_of("weight", PORTS, "How much of the top shows, 0..1."),
    ];
    const FACTS: &'static [Fact] = &[];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let inputs = [(cx.get(&self.base)?, "base"), (cx.get(&self.top)?, "top"), (cx.get(&self.mask)?, "mask")];
        let by = ByHeight { contrast: narrow(self.contrast), offset: narrow(self.offset), range: narrow(self.range) };
        let (mode, opacity) = (self.mode, narrow(self.opacity));
        let weights = move |[base, top, mask]: [Planes<'_>; 3], out: &mut [f32]| {
            by.weights(mask.plane(0), base.plane(0), top.plane(0), out);
            out.iter_mut().for_each(|weight| *weight *= opacity);
        };
        let height = move |out: &mut [&mut [f32]], [base, top, mask]: [Planes<'_>; 3]| {
            let mut weight = vec![0.0; out[0].len()];
            weights([base, top, mask], &mut weight);
            mix_heights(mode, by.offset, &weight, base.plane(0), top.plane(0), &mut *out[0]);
        };
        let weight = move |out: &mut [&mut [f32]], inputs: [Planes<'_>; 3]| weights(inputs, &mut *out[0]);
        let height = pointwise(Type::Gray, inputs.clone(), height)?;
        Ok(Outputs::one(height).with("weight", pointwise(Type::Gray, inputs, weight)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, gray, pairs};
    use crate::testing::{lumps, port};
    use shibo_value::Field;

    fn node() -> HeightBlend {
        HeightBlend { base: port(0), top: port(1), ..HeightBlend::default() }
    }

    #[test]
    fn shows_higher_input_without_mask() {
        let node = HeightBlend { contrast: 0.0, ..node() };
        let inputs = [gray().into(), lumps().into()];
        let above = pairs(&lumps(), &field(&node, &inputs, "height"));
        let below = pairs(&gray(), &field(&node, &inputs, "height"));
        assert!(above.iter().zip(&below).all(|((top, out), (base, _))| *out == top.max(*base)));
    }

    #[test]
    fn masks_of_0_and_1_decide_alone() {
        let masked = HeightBlend { mask: port(2), range: 2.0, ..node() };
        for (mask, weight) in [(0.0, 0.0), (1.0, 1.0)] {
            let mask = Field::constant(Type::Gray, &[mask]);
            let inputs = [gray().into(), lumps().into(), mask.into()];
            let found = pairs(&gray(), &field(&masked, &inputs, "weight"));
            assert!(found.iter().all(|(_, w)| *w == weight));
        }
        for mode in [HeightMode::Replace, HeightMode::Add, HeightMode::Max] {
            for (contrast, offset) in [(0.0, 0.0), (1e4, -1e4)] {
                let node = HeightBlend { mode, contrast, offset, opacity: 0.3, ..masked.clone() };
                conforms(&node, &[gray().into(), lumps().into(), lumps().into()]);
            }
        }
    }
}
