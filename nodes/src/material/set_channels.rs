//! [`SetChannels`]: a material with some of its channels replaced.
//!
//! Nothing is computed here. Cost: none.
use super::channels::with_channels;
use shibo_node::{CanvasFacts, Context, Fact, In, MaterialInputs, Node, Output, Outputs};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{self as value, ChannelSet, Stop, Type};

with_channels! {
    /// Replaces channels of a material, or adds them; all other channels stay.
    ///
    /// ```ron
    /// "cells":   Worley(size: 7),
    /// "clay":    Material(base_color: "#9a5a3c", roughness: 0.8, height: "cells"),
    /// "glazed":  SetChannels(material: "clay", roughness: 0.15, coat: 1),
    /// "example": Relief(material: "glazed"),
    /// ```
    ///
    /// Elsewhere: Substance Designer *Material Override*, Unreal *Set Material Attributes*, Houdini *Layer Unpack* and
    /// *Pack*.
    pub struct SetChannels {
        /// The material.
        material: In<value::Material>,
    }
}

impl Node for SetChannels {
    const OUTPUTS: &'static [Output] =
        &[Output::new("material", Type::Material, "The material with its new channels.")];
    const FACTS: &'static [Fact] = &[];

    fn advice(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        if self.connected() != ChannelSet::NONE {
            return Vec::new();
        }
        let problem = Problem::new(Code::Advice, "no channel is given; the material stays as it is");
        vec![problem.help("write for example `roughness: 0.2`")]
    }

    fn channels(&self, inputs: &MaterialInputs<'_>) -> ChannelSet {
        inputs.at("material").union(self.connected())
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (old, new) = (cx.get(&self.material)?, self.given(cx)?);
        // If a channel is given twice, the first one is kept.
        let new: Vec<_> = new
            .into_iter()
            .map(|(channel, value)| Ok((channel, crate::anywhere::field(value, channel.name())?)))
            .collect::<Result<_, Stop>>()?;
        Ok(Outputs::one(value::Material::new(new.into_iter().chain(old.channels().iter().cloned()))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{canvas, lumps, outputs, port};
    use shibo_node::KindInfo;
    use shibo_value::{Channel, Field, Value};

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
