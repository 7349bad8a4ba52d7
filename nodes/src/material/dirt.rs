//! [`Dirt`]: dirt in grooves and corners.
//!
//! Dirt gathers where the height lies below its Gaussian surroundings: a cheap measure of concave curvature at the
//! scale of `radius`. Cost: that of a blur of the height, and O(pixels).
use super::worn::{Wear, channels};
use crate::bounds::at_most_half;
use shibo_node::{
    CanvasFacts, Color, Context, Fact, Gray, In, MaterialInputs, Node, Output, Outputs, TakenChannel, node,
};
use shibo_value::diagnostics::Problem;
use shibo_value::{Channel, ChannelSet, Field, Material, Stop, Type};

/// Adds dirt where the surface lies below its surroundings: grooves, pores, inner corners.
///
/// Height and normal of the material stay unchanged; all other channels are blended. Connect a noise to make the dirt
/// patchy, or the inverse of an occlusion as `mask`.
///
/// ```ron
/// "cells":   Worley(size: 9),
/// "tiles":   Remap(input: "cells.border", from: (0, 0.7), to: (0, 0.6), clamp: true),
/// "normal":  HeightToNormal(input: "tiles"),
/// "stone":   Material(base_color: "#a39a88", roughness: 0.5, height: "tiles", normal: "normal"),
/// "noise":   Fractal(size: 3, octaves: 5),
/// "dirty":   Dirt(material: "stone", noise: "noise", radius: 0.8, depth: 0.2, amount: 0.45),
/// "example": Relief(material: "dirty"),
/// ```
///
/// Elsewhere: Substance Designer *Dirt* masks, Substance Painter *Dirt* generator, Blender *Dirty Vertex Colors*,
/// Houdini *Ambient Occlusion* masks.
#[node]
pub struct Dirt {
    /// The material that gets dirty.
    pub material: In<Material>,
    /// Material of the dirt; if not given, dark earth, rough and without coat or metal. Its height and normal are not
    /// used.
    pub dirt: Option<In<Material>>,
    /// The height in whose grooves dirt gathers, in mm, instead of the material's height.
    pub height: Option<In<Gray>>,
    /// Where dirt is allowed, 0..1.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub mask: Option<In<Gray>>,
    /// Noise that makes the dirt patchy, 0..1: bright places get dirty first.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub noise: Option<In<Gray>>,
    /// Size of the surroundings: the standard deviation of a Gaussian. At most half the canvas' longer side.
    #[schemars(range(max = 5e5), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(0.5)]
    pub radius: f64,
    /// Depth below the surroundings at which a place gets dirty with the smallest `amount`.
    #[schemars(range(max = 1e4), extend("exclusiveMinimum" = 0.0, "unit" = "mm"))]
    #[default(0.1)]
    pub depth: f64,
    /// Amount of dirt: 0 is none, 1 covers everything that lies below its surroundings at all.
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

/// Default dirt: dark, rough and dull.
fn earth() -> Material {
    let color = Color::srgb([0x3a, 0x2f, 0x24]).0;
    let gray = |value: f32| Field::constant(Type::Gray, &[value]);
    Material::new([
        (Channel::BaseColor, Field::constant(Type::Rgb, &color)),
        (Channel::Roughness, gray(0.9)),
        (Channel::Metallic, gray(0.0)),
        (Channel::Coat, gray(0.0)),
    ])
}

impl Dirt {
    fn wear(&self) -> Wear<'_> {
        let Self { height, noise, mask, radius, depth, amount, softness, breakup, .. } = self;
        let [radius, depth, amount, softness, breakup] = [radius, depth, amount, softness, breakup].map(|v| *v);
        Wear { height, noise, mask, radius, depth, amount, softness, breakup }
    }

    fn dirt_channels(&self, inputs: &MaterialInputs<'_>) -> ChannelSet {
        if self.dirt.is_some() { inputs.at("dirt") } else { earth().channels().iter().map(|c| c.0).collect() }
    }
}

impl Node for Dirt {
    const OUTPUTS: &'static [Output] = &[
        Output::new("material", Type::Material, "The dirty material."),
        Output::new("weight", Type::Gray, "Where the dirt lies, 0..1."),
    ];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        at_most_half("radius", self.radius, canvas)
    }

    fn channels(&self, inputs: &MaterialInputs<'_>) -> ChannelSet {
        channels(inputs.at("material"), self.dirt_channels(inputs))
    }

    fn takes(&self) -> Vec<TakenChannel> {
        self.wear().takes()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let material = cx.get(&self.material)?;
        let dirt = cx.get_opt(&self.dirt)?;
        let dirt = dirt.as_deref().cloned().unwrap_or_else(earth);
        self.wear().outputs(cx, &material, &dirt, -1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{canvas, check_field, lumps, outputs, port, raster};
    use shibo_value::Value;

    #[test]
    fn gathers_in_hollows_and_keeps_height() {
        let material = Material::new([(Channel::Height, lumps())]);
        let node = Dirt { material: port(0), radius: 2.0, amount: 0.9, ..Dirt::default() };
        let made = outputs(&node, &[material.into()], &canvas()).unwrap();
        let Some(Value::Material(dirty)) = made.take("material", true) else { panic!("no material") };
        let Some(Value::Field(weight)) = made.take("weight", false) else { panic!("no weight") };
        check_field(weight);
        let (height, weight) = (raster(&lumps(), &canvas()), raster(weight, &canvas()));
        assert_eq!(raster(dirty.get(Channel::Height).unwrap(), &canvas()).data(), height.data());
        let roughness = raster(dirty.get(Channel::Roughness).unwrap(), &canvas());
        for (rough, weight) in roughness.data().iter().zip(weight.data()) {
            // From 0.5, the default of a material without roughness, to 0.9.
            assert!((rough - (0.5 + 0.4 * weight)).abs() < 1e-6);
        }
        let at = |find: fn(f32, f32) -> bool| {
            (0..height.data().len())
                .fold(0, |best, i| if find(height.data()[i], height.data()[best]) { i } else { best })
        };
        assert!(weight.data()[at(|a, b| a < b)] > 0.9 && weight.data()[at(|a, b| a > b)] == 0.0);
    }
}
