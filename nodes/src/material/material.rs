//! [`Material`]: fields put together to a surface.
//!
//! Channels as in the glTF and OpenPBR models. Nothing is computed here. Cost: none.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_engine::diagnostics::{Code, Problem};
use shibo_engine::node::{
    CanvasFacts, Context, Fact, Gray, In, MaterialInputs, Node, NormalField, Output, Outputs, Rgb,
};
use shibo_engine::value::{self, Channel, ChannelSet, Field, Stop, Type};

/// Puts channels together to a material, which is written as one file per channel. Channels that are not connected are
/// left out. A normal is not made from the height by itself: connect `HeightToNormal`.
///
/// ```ron
/// "cells":   Worley(size: 4),
/// "grooves": Remap(input: "cells.border", from: (0, 0.5), to: (1, 0), clamp: true),
/// "dome":    Pillow(input: "grooves", radius: 1.2),
/// "normal":  HeightToNormal(input: "dome", strength: 0.4),
/// "leather": Material(base_color: "#7a2a1c", roughness: 0.5, height: "dome", normal: "normal"),
/// "example": Relief(material: "leather", strength: 0.4),
/// ```
///
/// Elsewhere: Substance Designer *Output*, *Base Material*; Blender *Principled BSDF*, *Material Output*; Material
/// Maker *Static PBR Material*; Unreal *Make Material Attributes*.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Material {
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

impl Material {
    /// Every channel, and whether it is connected.
    fn connected(&self) -> [(Channel, bool); 17] {
        [
            (Channel::BaseColor, self.base_color.is_some()),
            (Channel::Roughness, self.roughness.is_some()),
            (Channel::Metallic, self.metallic.is_some()),
            (Channel::Normal, self.normal.is_some()),
            (Channel::Height, self.height.is_some()),
            (Channel::Ao, self.ao.is_some()),
            (Channel::Opacity, self.opacity.is_some()),
            (Channel::Sheen, self.sheen.is_some()),
            (Channel::Coat, self.coat.is_some()),
            (Channel::Anisotropy, self.anisotropy.is_some()),
            (Channel::AnisotropyAngle, self.anisotropy_angle.is_some()),
            (Channel::CoatRoughness, self.coat_roughness.is_some()),
            (Channel::CoatNormal, self.coat_normal.is_some()),
            (Channel::Emission, self.emission.is_some()),
            (Channel::Ior, self.ior.is_some()),
            (Channel::Specular, self.specular.is_some()),
            (Channel::Subsurface, self.subsurface.is_some()),
        ]
    }
}

impl Material {
    /// Whether any channel is connected.
    pub(super) fn is_connected(&self) -> bool {
        self.connected().iter().any(|(_, connected)| *connected)
    }

    /// The channels that are connected.
    pub(super) fn given(&self, cx: &Context<'_>) -> Result<Vec<(Channel, Field)>, Stop> {
        let channels: [(Channel, Option<Field>); 17] = [
            (Channel::BaseColor, cx.get_opt(&self.base_color)?),
            (Channel::Roughness, cx.get_opt(&self.roughness)?),
            (Channel::Metallic, cx.get_opt(&self.metallic)?),
            (Channel::Normal, cx.get_opt(&self.normal)?),
            (Channel::Height, cx.get_opt(&self.height)?),
            (Channel::Ao, cx.get_opt(&self.ao)?),
            (Channel::Opacity, cx.get_opt(&self.opacity)?),
            (Channel::Sheen, cx.get_opt(&self.sheen)?),
            (Channel::Coat, cx.get_opt(&self.coat)?),
            (Channel::Anisotropy, cx.get_opt(&self.anisotropy)?),
            (Channel::AnisotropyAngle, cx.get_opt(&self.anisotropy_angle)?),
            (Channel::CoatRoughness, cx.get_opt(&self.coat_roughness)?),
            (Channel::CoatNormal, cx.get_opt(&self.coat_normal)?),
            (Channel::Emission, cx.get_opt(&self.emission)?),
            (Channel::Ior, cx.get_opt(&self.ior)?),
            (Channel::Specular, cx.get_opt(&self.specular)?),
            (Channel::Subsurface, cx.get_opt(&self.subsurface)?),
        ];
        Ok(channels.into_iter().filter_map(|(channel, field)| Some((channel, field?))).collect())
    }
}

impl Node for Material {
    const OUTPUTS: &'static [Output] = &[Output::new("material", Type::Material, "The channels that are connected.")];
    const FACTS: &'static [Fact] = &[];

    fn advice(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        if self.is_connected() {
            return Vec::new();
        }
        let problem = Problem::new(Code::Advice, "no channel is connected; the material is empty");
        vec![problem.help("write for example `base_color: \"#7a4526\", roughness: 0.5`")]
    }

    fn channels(&self, _inputs: &MaterialInputs<'_>) -> ChannelSet {
        self.connected().into_iter().filter_map(|(channel, connected)| connected.then_some(channel)).collect()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        Ok(Outputs::one(value::Material::new(self.given(cx)?)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::OnCanvas as _;
    use crate::testing::{canvas, lumps, outputs, port};
    use shibo_engine::node::KindInfo;
    use shibo_engine::value::Value;

    #[test]
    fn holds_what_is_connected() {
        let node = Material { height: Some(port(0)), base_color: Some(port(1)), ..Material::default() };
        let outputs = outputs(&node, &[lumps().into(), lumps().into()], &canvas()).unwrap();
        let Some(Value::Material(material)) = outputs.take("material", true) else { panic!("no material") };
        let found: Vec<_> = material.channels().iter().map(|(channel, field)| (*channel, field.ty())).collect();
        assert_eq!(found, [(Channel::BaseColor, Type::Rgb), (Channel::Height, Type::Gray)]);
        let known = node.channels(&MaterialInputs::new(&[]));
        assert_eq!(known.iter().collect::<Vec<_>>(), [Channel::BaseColor, Channel::Height]);
        assert_eq!(Material::default().advice_on(&canvas()).len(), 1);
        assert_eq!(node.advice_on(&canvas()), []);
    }

    #[test]
    fn has_a_port_for_every_channel() {
        let info = KindInfo::of::<Material>("Material");
        let ports: Vec<_> = info.ports().map(|(field, port)| (field.name.clone(), port.ty)).collect();
        let channels: Vec<_> = Channel::ALL.iter().map(|c| (c.name().to_owned(), c.ty().into())).collect();
        assert_eq!(ports, channels);
    }
}
