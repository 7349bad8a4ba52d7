//! [`EdgeWear`]: shows another material where edges are worn.
//!
//! An edge is where the height rises above its Gaussian surroundings: a cheap measure of convex curvature at the scale
//! of `radius`. Cost: that of a blur of the height, and O(pixels).
use super::worn::{Wear, channels};
use crate::bounds::at_most_half;
use shibo_node::{CanvasFacts, Context, Fact, Gray, In, MaterialInputs, Node, Output, Outputs, TakenChannel, node};
use shibo_value::diagnostics::Problem;
use shibo_value::{ChannelSet, Material, Stop, Type};

/// Shows the material under a coat where edges are worn: places above their surroundings wear first.
///
/// Height and normal of the material stay unchanged; all other channels are blended. Connect a noise to break up the
/// border.
///
/// ```ron
/// "cells":   Worley(size: 9),
/// "tiles":   Remap(input: "cells.border", from: (0, 0.7), to: (0, 0.6), clamp: true),
/// "normal":  HeightToNormal(input: "tiles"),
/// "paint":   Material(base_color: "#2c4a5a", roughness: 0.35, height: "tiles", normal: "normal"),
/// "brass":   Material(base_color: "#c9a253", roughness: 0.3, metallic: 1),
/// "noise":   Fractal(size: 3, octaves: 5),
/// "worn":    EdgeWear(material: "paint", under: "brass", noise: "noise", radius: 0.8, depth: 0.1, amount: 0.45),
/// "example": Relief(material: "worn"),
/// ```
///
/// Elsewhere: Substance Designer *Metal Edge Wear*, Substance Painter *Edges Wear* masks, Blender *Geometry:
/// Pointiness*, Houdini *Curvature* masks.
#[node]
pub struct EdgeWear {
    /// The material that is worn.
    pub material: In<Material>,
    /// Material that shows where the coat is worn. Its height and normal are not used.
    pub under: In<Material>,
    /// The height whose edges are worn, in mm, instead of the material's height.
    pub height: Option<In<Gray>>,
    /// Where wear is allowed, 0..1.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub mask: Option<In<Gray>>,
    /// Noise that breaks up the border, 0..1: bright places wear first.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub noise: Option<In<Gray>>,
    /// Size of the surroundings: the standard deviation of a Gaussian. At most half the canvas' longer side.
    #[schemars(range(max = 5e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(0.5)]
    pub radius: f64,
    /// Height above the surroundings at which an edge wears with the smallest `amount`.
    #[schemars(range(max = 1e4), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(0.1)]
    pub depth: f64,
    /// Amount of wear: 0 is none, 1 is everything that rises above its surroundings at all.
    #[schemars(range(min = 0.0, max = 1.0))]
    #[default(0.5)]
    pub amount: f64,
    /// Softness of the border, in units of `depth`.
    #[schemars(range(min = 0.0, max = 100.0))]
    #[default(0.3)]
    pub softness: f64,
    /// Amount by which the noise moves the border, in units of `depth`.
    #[schemars(range(min = 0.0, max = 100.0))]
    #[default(0.5)]
    pub breakup: f64,
}

impl EdgeWear {
    fn wear(&self) -> Wear<'_> {
        let Self { height, noise, mask, radius, depth, amount, softness, breakup, .. } = self;
        let [radius, depth, amount, softness, breakup] = [radius, depth, amount, softness, breakup].map(|v| *v);
        Wear { height, noise, mask, radius, depth, amount, softness, breakup }
    }
}

impl Node for EdgeWear {
    const OUTPUTS: &'static [Output] = &[
        Output::new("material", Type::Material, "The worn material."),
        Output::new("weight", Type::Gray, "Where it is worn, 0..1."),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        at_most_half("radius", self.radius, canvas)
    }

    fn channels(&self, inputs: &MaterialInputs<'_>) -> ChannelSet {
        channels(inputs.at("material"), inputs.at("under"))
    }

    fn takes(&self) -> Vec<TakenChannel> {
        self.wear().takes()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (material, under) = (cx.get(&self.material)?, cx.get(&self.under)?);
        self.wear().outputs(cx, &material, &under, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{canvas, check_field, lumps, outputs, port, raster};
    use shibo_value::{Channel, Field, Value};

    #[test]
    fn wears_raised_places_and_keeps_height() {
        let gray = |v: f32| Field::constant(Type::Gray, &[v]);
        let material = Material::new([(Channel::Height, lumps()), (Channel::Roughness, gray(0.8))]);
        let under = Material::new([(Channel::Metallic, gray(1.0)), (Channel::Height, gray(7.0))]);
        let node = EdgeWear { material: port(0), under: port(1), radius: 2.0, amount: 0.9, ..EdgeWear::default() };
        let made = outputs(&node, &[material.into(), under.into()], &canvas()).unwrap();
        let Some(Value::Material(worn)) = made.take("material", true) else { panic!("no material") };
        let Some(Value::Field(weight)) = made.take("weight", false) else { panic!("no weight") };
        check_field(weight);
        let (height, weight) = (raster(&lumps(), &canvas()), raster(weight, &canvas()));
        assert_eq!(raster(worn.get(Channel::Height).unwrap(), &canvas()).data(), height.data());
        let metallic = raster(worn.get(Channel::Metallic).unwrap(), &canvas());
        assert_eq!(metallic.data(), weight.data());
        // The highest place is worn, the lowest is not.
        let at = |find: fn(f32, f32) -> bool| {
            (0..height.data().len())
                .fold(0, |best, i| if find(height.data()[i], height.data()[best]) { i } else { best })
        };
        assert!(weight.data()[at(|a, b| a > b)] > 0.9 && weight.data()[at(|a, b| a < b)] == 0.0);
    }
}
