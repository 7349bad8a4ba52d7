//! [`Material`]: combines fields to a material.
//!
//! Channels as in the glTF and OpenPBR models. Nothing is computed here. Cost: none.
use super::channels::with_channels;
use crate::anywhere::{field, is_in_space, is_solid, solid, solids};
use shibo_node::{
    AnyMaterial, CanvasFacts, Context, Fact, In, MaterialAnywhere, MaterialInputs, Node, Output, Outputs,
};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{self as value, ChannelSet, SolidMaterial, Stop};

with_channels! {
    /// Combines channels to a material, which is written as one file per channel. Channels that are not connected are
    /// left out, or taken from the material `from`. A normal is not made from the height automatically: connect
    /// `HeightToNormal`.
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
    /// `Material(from: "leather", coat: 1)` is `leather` with another coat; all other channels stay.
    ///
    /// A material of solids is a material in space, a `SolidMaterial`: a wood. `CutPlane`, `CutSurface`, `Board` and
    /// `BakeSolid` cut it with all its channels, and make normals from the height of the cut. Constants, such as
    /// `roughness: 0.4`, go with fields and with solids; fields and solids do not go together.
    ///
    /// Elsewhere: Substance Designer *Output*, *Base Material*, *Material Override*; Blender *Principled BSDF*,
    /// *Material Output*; Material Maker *Static PBR Material*; Unreal *Make Material Attributes*, *Set Material
    /// Attributes*.
    pub struct Material {
        /// A material whose channels are kept where no other is given.
        from: Option<In<AnyMaterial>>,
    }
}

impl Node for Material {
    const OUTPUTS: &'static [Output] =
        &[Output::material_of("material", Self::PORTS, "The channels that are connected.")];
    const FACTS: &'static [Fact] = &[];

    fn advice(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        if self.connected() != ChannelSet::NONE {
            return Vec::new();
        }
        let message = match &self.from {
            Some(_) => "no channel is given; the material stays as it is",
            None => "no channel is connected; the material is empty",
        };
        let problem = Problem::new(Code::Advice, message);
        vec![problem.help("write for example `base_color: \"#7a4526\", roughness: 0.5`")]
    }

    fn channels(&self, inputs: &MaterialInputs<'_>) -> ChannelSet {
        inputs.at("from").union(self.connected())
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (old, new) = (cx.get_opt(&self.from)?, self.given(cx)?);
        if !old.as_ref().is_some_and(is_in_space) && !new.iter().any(|(_, value)| is_solid(value)) {
            let new: Vec<_> = new
                .into_iter()
                .map(|(channel, value)| Ok((channel, field(value, channel.name())?)))
                .collect::<Result<_, Stop>>()?;
            let old = old.iter().flat_map(|old| match old {
                MaterialAnywhere::Canvas(old) => old.channels().to_vec(),
                MaterialAnywhere::Space(_) => Vec::new(),
            });
            return Ok(Outputs::one(value::Material::new(new.into_iter().chain(old))));
        }
        let new: Vec<_> = new
            .into_iter()
            .map(|(channel, value)| Ok((channel, solid(value, channel.solid_type(), channel.name())?)))
            .collect::<Result<_, Stop>>()?;
        let old = old.map(|old| solids(&old, "from")).transpose()?;
        let old = old.iter().flat_map(|old| old.channels().iter().cloned());
        Ok(Outputs::one(SolidMaterial::new(new.into_iter().chain(old))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::OnCanvas as _;
    use crate::testing::{canvas, lumps, outputs, port};
    use shibo_node::KindInfo;
    use shibo_value::{Channel, Field, Type, Value};

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
    fn replaces_and_adds_channels() {
        let old = value::Material::new([
            (Channel::Roughness, Field::constant(Type::Gray, &[0.9])),
            (Channel::Height, lumps()),
        ]);
        let node = Material {
            from: Some(port(0)),
            roughness: Some(In::constant(0.25)),
            coat: Some(In::constant(1.0)),
            ..Material::default()
        };
        let made = outputs(&node, &[old.into()], &canvas()).unwrap();
        let Some(Value::Material(new)) = made.take("material", true) else { panic!("no material") };
        let found: Vec<_> = new.channels().iter().map(|(c, field)| (*c, field.as_constant().map(|v| v[0]))).collect();
        assert_eq!(found, [(Channel::Roughness, Some(0.25)), (Channel::Height, None), (Channel::Coat, Some(1.0))]);
    }

    #[test]
    fn has_a_port_for_every_channel() {
        let info = KindInfo::of::<Material>("Material");
        let ports = info.ports().filter(|(field, _)| field.name != "from");
        for ((field, port), channel) in ports.zip(Channel::ALL) {
            assert_eq!(field.name, channel.name());
            for ty in [channel.ty(), channel.solid_type()] {
                assert!(ty.fits(port.ty), "{} {ty}", field.name);
            }
        }
        assert_eq!(info.ports().count(), 1 + Channel::ALL.len());
    }
}
