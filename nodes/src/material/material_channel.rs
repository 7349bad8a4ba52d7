//! [`MaterialChannel`]: one channel of a material.
//!
//! Cost: none for the channel as it is; O(pixels) for the luminance of a colour.
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_engine::diagnostics::{Code, Problem};
use shibo_engine::node::{Context, Fact, In, Node, Output, Outputs};
use shibo_engine::value::{Channel, Field, Halo, Material, Stop, Type};

/// Takes a channel out of a material.
///
/// ```ron
/// "cells":   Worley(size: 7),
/// "leather": Material(base_color: "#7a4526", height: "cells.value"),
/// "example": MaterialChannel(material: "leather", channel: Height),
/// ```
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct MaterialChannel {
    /// The material.
    pub material: In<Material>,
    /// Which of its channels.
    pub channel: Channel,
}

impl Default for MaterialChannel {
    fn default() -> Self {
        Self { material: In::default(), channel: Channel::Height }
    }
}

/// Weights of linear red, green and blue in luminance (Rec. 709).
const LUMINANCE: [f32; 3] = [0.2126, 0.7152, 0.0722];

impl Node for MaterialChannel {
    const OUTPUTS: &'static [Output] = &[
        Output::new("value", Type::Gray, "The channel; its luminance if it is a colour or a normal."),
        Output::new("rgb", Type::Rgb, "The channel as a colour; grey if it is one number."),
    ];
    const FACTS: &'static [Fact] = &[];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let material = cx.get(&self.material)?;
        let Some(field) = material.get(self.channel) else {
            let there: Vec<_> =
                material.channels().iter().map(|(channel, _)| format!("`{}`", channel.name())).collect();
            let message =
                format!("the material has no `{}`; it must be one of {}", self.channel.name(), there.join(", "));
            return Err(Problem::new(Code::BadValue, message).at("channel").into());
        };
        let gray = if field.channels() == 1 {
            field.clone()
        } else {
            Field::map(Type::Gray, [field.clone()], Halo::NONE, |out, [color]| {
                let planes = color.plane(0).iter().zip(color.plane(1)).zip(color.plane(2));
                for (out, ((r, g), b)) in out.data_mut().iter_mut().zip(planes) {
                    *out = r * LUMINANCE[0] + g * LUMINANCE[1] + b * LUMINANCE[2];
                }
                Ok(())
            })
        };
        Ok(Outputs::one(gray).with("rgb", field.to_rgb()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{canvas, check_field, field, lumps, outputs, port};

    #[test]
    fn takes_a_channel_or_names_those_there_are() {
        let color = Field::constant(Type::Rgb, &[1.0, 0.5, 0.25]);
        let material = Material::new([(Channel::Height, lumps()), (Channel::BaseColor, color)]);
        let inputs = [material.into()];
        let node = |channel| MaterialChannel { material: port(0), channel };
        check_field(&field(&node(Channel::Height), &inputs));
        let value = crate::testing::raster(&field(&node(Channel::BaseColor), &inputs), &canvas());
        assert!((value.data()[0] - 0.58825).abs() < 1e-5);
        let Err(Stop::Failed(problem)) = outputs(&node(Channel::Ao), &inputs, &canvas()) else { panic!("no error") };
        assert_eq!(problem.message, "the material has no `ao`; it must be one of `base_color`, `height`");
    }
}
