//! [`SetChannels`]: a material with some of its channels replaced.
//!
//! Nothing is computed here. Cost: none.
use super::Material;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_engine::diagnostics::{Code, Problem};
use shibo_engine::node::{
    CanvasFacts, Context, Fact, Gray, In, MaterialInputs, Node, NormalField, Output, Outputs, Rgb,
};
use shibo_engine::value::{self, ChannelSet, Stop, Type};

/// Replaces channels of a material, or adds them; all others stay.
///
/// ```ron
/// "cells":   Worley(size: 7),
/// "clay":    Material(base_color: "#9a5a3c", roughness: 0.8, height: "cells"),
/// "glazed":  SetChannels(material: "clay", roughness: 0.15, coat: 1),
/// "example": Relief(material: "glazed"),
/// ```
///
/// Elsewhere: Substance Designer *Material Override*, Unreal *Set Material Attributes*, Houdini *Layer Unpack* and *Pack*.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SetChannels {
    /// The material.
    pub material: In<value::Material>,
    /// Diffuse or metal colour, scene-linear.
    pub base_color: Option<In<Rgb>>,
    /// Roughness, 0 (mirror) to 1.
    pub roughness: Option<In<Gray>>,
    /// 0 for dielectrics, 1 for metals.
    pub metallic: Option<In<Gray>>,
    /// Tangent-space normal.
    pub normal: Option<In<NormalField>>,
    /// Height in mm.
    pub height: Option<In<Gray>>,
    /// Ambient occlusion: 1 is open, 0 is shut.
    pub ao: Option<In<Gray>>,
    /// Opacity, 0..1.
    pub opacity: Option<In<Gray>>,
    /// Sheen, 0..1.
    pub sheen: Option<In<Gray>>,
    /// Clear coat, 0..1.
    pub coat: Option<In<Gray>>,
    /// Anisotropy, 0..1.
    pub anisotropy: Option<In<Gray>>,
    /// Angle of the anisotropy in degrees, from +x towards +y.
    pub anisotropy_angle: Option<In<Gray>>,
    /// Roughness of the clear coat, 0..1.
    pub coat_roughness: Option<In<Gray>>,
    /// Normal of the clear coat; if it is left out, a coat lies level.
    pub coat_normal: Option<In<NormalField>>,
    /// Light that the surface gives off, scene-linear.
    pub emission: Option<In<Rgb>>,
    /// Index of refraction.
    pub ior: Option<In<Gray>>,
    /// Strength of the reflections of a dielectric, 0..1.
    pub specular: Option<In<Gray>>,
    /// How much light is scattered below the surface, 0..1.
    pub subsurface: Option<In<Gray>>,
}

impl SetChannels {
    /// The channels that are connected.
    fn connected(&self) -> Material {
        let Self {
            material: _,
            base_color,
            roughness,
            metallic,
            normal,
            height,
            ao,
            opacity,
            sheen,
            coat,
            anisotropy,
            anisotropy_angle,
            coat_roughness,
            coat_normal,
            emission,
            ior,
            specular,
            subsurface,
        } = self.clone();
        Material {
            base_color,
            roughness,
            metallic,
            normal,
            height,
            ao,
            opacity,
            sheen,
            coat,
            anisotropy,
            anisotropy_angle,
            coat_roughness,
            coat_normal,
            emission,
            ior,
            specular,
            subsurface,
        }
    }
}

impl Node for SetChannels {
    const OUTPUTS: &'static [Output] =
        &[Output::new("material", Type::Material, "The material with its new channels.")];
    const FACTS: &'static [Fact] = &[];

    fn advice(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        if self.connected().is_connected() {
            return Vec::new();
        }
        let problem = Problem::new(Code::Advice, "no channel is given; the material stays as it is");
        vec![problem.help("write for example `roughness: 0.2`")]
    }

    fn channels(&self, inputs: &MaterialInputs<'_>) -> ChannelSet {
        inputs.at("material").union(self.connected().channels(inputs))
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (old, new) = (cx.get(&self.material)?, self.connected().given(cx)?);
        // Of two that are alike the first is kept.
        Ok(Outputs::one(value::Material::new(new.into_iter().chain(old.channels().iter().cloned()))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{canvas, lumps, outputs, port};
    use shibo_engine::node::KindInfo;
    use shibo_engine::value::{Channel, Field, Value};

    #[test]
    fn replaces_and_adds() {
        let old = value::Material::new([
            (Channel::Roughness, Field::constant(Type::Gray, &[0.9])),
            (Channel::Height, lumps()),
        ]);
        let node = SetChannels {
            material: port(0),
            roughness: Some(In::constant(0.25)),
            coat: Some(In::constant(1.0)),
            ..SetChannels::default()
        };
        let made = outputs(&node, &[old.into()], &canvas()).unwrap();
        let Some(Value::Material(new)) = made.take("material", true) else { panic!("no material") };
        let found: Vec<_> = new.channels().iter().map(|(c, field)| (*c, field.as_constant().map(|v| v[0]))).collect();
        assert_eq!(found, [(Channel::Roughness, Some(0.25)), (Channel::Height, None), (Channel::Coat, Some(1.0)),]);
    }

    #[test]
    fn has_a_port_for_every_channel() {
        let ports: Vec<_> =
            KindInfo::of::<SetChannels>("Material").ports().map(|(field, _)| field.name.clone()).collect();
        let channels: Vec<_> = Channel::ALL.iter().map(|c| c.name().to_owned()).collect();
        assert_eq!(ports[1..], channels);
    }
}
