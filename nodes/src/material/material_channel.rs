//! [`MaterialChannel`]: one channel of a material.
//!
//! Cost: none for an unchanged channel; O(pixels) for the luminance of a colour.
use crate::values::LUMINANCE;
use shibo_node::{Context, Fact, In, Node, Output, Outputs, TakenChannel, node};
use shibo_value::{Channel, Field, Halo, Material, Stop, Type};

/// Extracts a channel from a material.
///
/// A channel that the material does not have is replaced by its default, and `check` warns of it: base colour 0.5,
/// roughness 0.5, ambient occlusion 1, opacity 1, a normal straight up, and 0 for all other channels.
///
/// ```ron
/// "cells":   Worley(size: 7),
/// "leather": Material(base_color: "#7a4526", height: "cells.value"),
/// "example": MaterialChannel(material: "leather", channel: Height),
/// ```
///
/// Elsewhere: Substance Designer *Material Switch*; Blender *Separate*; Houdini *Extract*; Unreal *Break Material
/// Attributes*.
#[node]
pub struct MaterialChannel {
    /// The material.
    pub material: In<Material>,
    /// The channel to extract.
    #[default(Channel::Height)]
    pub channel: Channel,
}

impl Node for MaterialChannel {
    const OUTPUTS: &'static [Output] = &[
        Output::new("value", Type::Gray, "The channel; its luminance if it is a colour or a normal."),
        Output::new("rgb", Type::Rgb, "The channel as a colour; grey if it is one number."),
    ];
    const FACTS: &'static [Fact] = &[];

    fn takes(&self) -> Vec<TakenChannel> {
        vec![TakenChannel { port: "material", field: "channel", channel: self.channel }]
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let field = cx.get(&self.material)?.or_default(self.channel);
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
    use shibo_value::Value;

    #[test]
    fn takes_a_channel_or_its_default() {
        let color = Field::constant(Type::Rgb, &[1.0, 0.5, 0.25]);
        let material = Material::new([(Channel::Height, lumps()), (Channel::BaseColor, color)]);
        let inputs = [material.into()];
        let node = |channel| MaterialChannel { material: port(0), channel };
        check_field(&field(&node(Channel::Height), &inputs));
        let value = crate::testing::raster(&field(&node(Channel::BaseColor), &inputs), &canvas());
        assert!((value.data()[0] - 0.58825).abs() < 1e-5);
        assert_eq!(field(&node(Channel::Ao), &inputs).as_constant(), Some(&[1.0][..]));
        let normal = outputs(&node(Channel::Normal), &inputs, &canvas()).unwrap();
        let Some(Value::Field(rgb)) = normal.take("rgb", false) else { panic!("no field") };
        assert_eq!(crate::testing::raster(rgb, &canvas()).plane(2)[0], 1.0);
        assert_eq!(node(Channel::Ao).takes()[0].channel, Channel::Ao);
    }
}
