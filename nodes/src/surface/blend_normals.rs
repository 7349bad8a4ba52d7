//! [`BlendNormals`]: fine detail on a coarse surface.
//!
//! Source: C. Barré-Brisebois, S. Hill, "Blending in detail" (2012); see
//! [`kernel::combine_normals`](shibo_kernel::surface::combine_normals). Cost: O(pixels), bound by memory.
use crate::normals::blended;
use shibo_kernel::surface::combine_normals::NormalBlend;
use shibo_node::{Context, Fact, Gray, In, Node, NormalField, Output, Outputs, node};
use shibo_value::{Stop, Type};

/// Lays one normal map over another, so that the detail follows the shape below.
///
/// Both maps must have green in the same direction.
///
/// ```ron
/// "cells": Worley(size: 10),
/// "grooves": Remap(input: "cells.border", from: (0, 1), to: (1, 0), clamp: true),
/// "dome": Pillow(input: "grooves", radius: 3),
/// "coarse": HeightToNormal(input: "dome", strength: 2),
/// "grain": Fractal(size: 2, octaves: 4),
/// "fine": HeightToNormal(input: "grain", strength: 0.5),
/// "example": BlendNormals(base: "coarse", detail: "fine"),
/// ```
///
/// Elsewhere: Substance Designer *Normal Combine*, *Normal Blend*.
#[node]
pub struct BlendNormals {
    /// The coarse surface.
    pub base: In<NormalField>,
    /// The detail that lies on it.
    pub detail: In<NormalField>,
    /// Factor on the slopes of the detail, a number or a mask: 0 leaves the base.
    #[default(In::constant(1.0))]
    pub strength: In<Gray>,
    /// How the two normals are combined.
    #[default(NormalBlend::Reoriented)]
    pub mode: NormalBlend,
}

impl Node for BlendNormals {
    const OUTPUTS: &'static [Output] = &[Output::new("normal", Type::Normal, "The normal of both.")];
    const FACTS: &'static [Fact] = &[];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let inputs = [cx.get(&self.base)?, cx.get(&self.detail)?, cx.get(&self.strength)?];
        Ok(Outputs::one(blended(self.mode, inputs)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{check_field, field, lumps, port, render};
    use shibo_value::{Field, Value};

    fn node(mode: NormalBlend) -> BlendNormals {
        BlendNormals { base: port(0), detail: port(1), strength: port(2), mode }
    }

    fn normal(x: f32, y: f32) -> Value {
        let length = (x * x + y * y + 1.0).sqrt();
        let encoded = [-x / length, -y / length, 1.0 / length].map(|n| 0.5 + 0.5 * n);
        Field::constant(Type::Normal, &encoded).into()
    }

    #[test]
    fn slopes_of_a_flat_base_are_those_of_the_detail() {
        for mode in [NormalBlend::Reoriented, NormalBlend::Slopes, NormalBlend::Whiteout] {
            let half = Field::constant(Type::Gray, &[0.5]);
            let out = render(&node(mode), &[normal(0.0, 0.0), normal(0.8, -0.4), half.into()]);
            let [x, y, z] = [0, 1, 2].map(|k| 2.0 * out.plane(k)[9] - 1.0);
            assert!((-x / z - 0.4).abs() < 1e-5 && (-y / z + 0.2).abs() < 1e-5, "{mode:?}");
        }
    }

    #[test]
    fn holds_in_any_window() {
        for mode in [NormalBlend::Reoriented, NormalBlend::Slopes, NormalBlend::Whiteout] {
            // Inputs that are not valid normals.
            let inputs = [lumps().to_rgb().into(), lumps().to_rgb().into(), lumps().into()];
            check_field(&field(&node(mode), &inputs));
        }
    }
}
