//! [`AmbientOcclusion`]: approximate share of the sky that a point sees.
//!
//! Compares the height with itself blurred at three scales, 0.35, 1 and 2 times the radius; see
//! [`kernel::occlusion`](shibo_kernel::surface::occlusion). The result is smooth, the same in all directions and
//! without noise, unlike that of ray tracing; but it ignores the shape of the surroundings. Cost: three blurs,
//! O(pixels), nearly independent of the radius.
use crate::bounds::at_most_half;
use crate::on_atlas;
use shibo_kernel::filter::fields;
use shibo_kernel::surface::occlusion;
use shibo_node::{CanvasFacts, Context, Fact, Gray, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::Problem;
use shibo_value::{Atlas, Field, Halo, Stop, Type};
use std::sync::Arc;

/// Ambient occlusion of a height: 1 on plains and hills, darker in hollows and grooves.
///
/// ```ron
/// "cells":   Worley(size: 6),
/// "grooves": Remap(input: "cells.border", from: (0, 0.6), to: (1, 0), clamp: true),
/// "dome":    Pillow(input: "grooves", radius: 1.5),
/// "example": AmbientOcclusion(input: "dome", radius: 2, strength: 3),
/// ```
///
/// Elsewhere: Substance Designer *Ambient Occlusion* (HBAO, RTAO); Blender *Ambient Occlusion*; Material Maker
/// *Occlusion*.
#[node]
pub struct AmbientOcclusion {
    /// Height in mm.
    pub input: In<Gray>,
    /// Size of the hollows that darken; at most half the canvas' longer side.
    #[schemars(range(max = 5e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(0.5)]
    pub radius: f64,
    /// Strength: 1 is natural, more is darker; with 0 the result is 1 everywhere.
    #[schemars(range(min = 0, max = 1e3))]
    #[default(1.0)]
    pub strength: f64,
    /// The atlas on which the height lies. If given, `radius` is measured on the surface, and hollows continue across
    /// borders of charts. This reads the whole picture; six times `radius` may be 64 texels at most.
    pub atlas: Option<In<Atlas>>,
}

impl Node for AmbientOcclusion {
    const OUTPUTS: &'static [Output] =
        &[Output::new("ao", Type::Gray, "1 where the surface is open, 0 where it is closed.")];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        at_most_half("radius", self.radius, canvas)
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let height = cx.get(&self.input)?;
        let atlas = cx.get_opt(&self.atlas)?;
        let [a, b, c] = occlusion::widths(self.radius).map(|sigma| match &atlas {
            Some(atlas) => on_atlas::blurred(height.clone(), Arc::clone(atlas), sigma),
            None => fields::blurred(&height, sigma, cx.size_mm()),
        });
        let spec = occlusion::OcclusionSpec { radius: self.radius, strength: self.strength, step: [1.0; 2] };
        Ok(Outputs::one(Field::map(Type::Gray, [height, a, b, c], Halo::NONE, move |out, [height, a, b, c]| {
            occlusion::openness(height.data(), [a.data(), b.data(), c.data()], &spec, out.data_mut());
            Ok(())
        })))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{check_field, field, lumps, port, render};

    #[test]
    fn hollows_are_darker_than_hills() {
        let node = AmbientOcclusion { input: port(0), radius: 2.0, ..AmbientOcclusion::default() };
        let inputs = [lumps().into()];
        let (ao, height) = (render(&node, &inputs), crate::testing::raster(&lumps(), &crate::testing::canvas()));
        let mean = |low: f32, high: f32| {
            let picked =
                ao.data().iter().zip(height.data()).filter(|(_, h)| **h >= low && **h <= high).map(|(a, _)| *a);
            let (n, sum) = picked.fold((0.0, 0.0), |(n, sum), v| (n + 1.0, sum + v));
            sum / n
        };
        assert!(mean(0.9, 1.0) > mean(0.0, 0.1) + 0.05, "{} {}", mean(0.9, 1.0), mean(0.0, 0.1));
        assert!(ao.data().iter().all(|v| (0.0..=1.0).contains(v)));
        for (radius, strength) in [(1e-9, 1.0), (16.0, 1e3), (1.0, 0.0)] {
            check_field(&field(&AmbientOcclusion { radius, strength, ..node.clone() }, &inputs));
        }
    }
}
