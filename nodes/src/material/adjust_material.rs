//! [`AdjustMaterial`]: adjusts colours, roughness and relief of a material.
//!
//! Colours change as by [`Hsv`](crate::tone::Hsv) (A. Smith, 1978) on sRGB-encoded values; slopes of the normal follow
//! the height. A channel without changes is passed on as it is. Cost: O(pixels) for each channel that changes, about 15
//! ns for colours.
use crate::anywhere::{changed, field, pointwise, rgb, rgb_mut, solid};
use shibo_kernel::ground::math::saturate;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::pointwise::color;
use shibo_kernel::surface::layers::scale_slopes;
use shibo_node::{
    AnyMaterial, Anywhere, Color, Context, Fact, In, Linear, MaterialAnywhere, MaterialInputs, Node, Output, Outputs,
    node,
};
use shibo_value::{Channel, ChannelSet, Field, Material, Solid, SolidMaterial, Stop, Type};

/// Changes the look of a material: hue, saturation and lightness, a tint, roughness, and the height of the relief.
///
/// Only channels that the material has are changed. To change them only in some places, blend the result over the
/// material by a mask.
///
/// ```ron
/// "cells":   Worley(size: 7),
/// "relief":  Remap(input: "cells.border", to: (0, 0.4)),
/// "normal":  HeightToNormal(input: "relief"),
/// "clay":    Material(base_color: "#9a5a3c", roughness: 0.8, height: "relief", normal: "normal"),
/// "glazed":  AdjustMaterial(material: "clay", hue: 170, saturation: 0.8, roughness: (0.1, 0.3), height_scale: 0.5),
/// "example": Relief(material: "glazed"),
/// ```
///
/// Elsewhere: Substance Designer *Material Adjustment Blend*, *HSL* on each channel; Material Maker *Adjust HSV*;
/// Blender *Hue/Saturation/Value*.
#[node]
pub struct AdjustMaterial {
    /// Material to change, on the canvas or in space.
    pub material: In<AnyMaterial>,
    /// Rotation of the hue of the base colour in degrees: red, yellow, green, cyan, blue, magenta are 60° apart.
    #[schemars(range(min = -360, max = 360), extend("unit" = "°"))]
    pub hue: f64,
    /// Factor on the saturation of the base colour: 0 is grey. The result is clamped to full saturation.
    #[schemars(range(min = 0, max = 100))]
    #[default(1.0)]
    pub saturation: f64,
    /// Factor on the lightness of the base colour, the largest of its encoded channels: 0 is black.
    #[schemars(range(min = 0, max = 100))]
    #[default(1.0)]
    pub lightness: f64,
    /// Colour that the base colour is multiplied by; white changes nothing.
    #[default(Color([1.0; 3]))]
    pub tint: Color,
    /// New values for a roughness of 0 and of 1; values between are interpolated.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    #[default(Linear::new(0.0, 1.0))]
    pub roughness: Linear,
    /// Factor on the height. The slopes of normals get the same factor.
    #[schemars(range(min = -1e3, max = 1e3))]
    #[default(1.0)]
    pub height_scale: f64,
    /// Added to the height.
    #[schemars(range(min = -1e6, max = 1e6), extend("unit" = "mm"))]
    pub height_offset: f64,
    /// Factor on the slopes of the normal, in addition to `height_scale`: 0 is flat.
    #[schemars(range(min = -1e3, max = 1e3))]
    #[default(1.0)]
    pub normal_strength: f64,
}

impl AdjustMaterial {
    fn color(&self, color: Anywhere) -> Result<Anywhere, Stop> {
        let change = [self.hue, self.saturation, self.lightness].map(narrow);
        let (same, tint) = (change == [0.0, 1.0, 1.0], self.tint.0);
        if same && tint == [1.0; 3] {
            return Ok(color);
        }
        pointwise(Type::Rgb, [(color, "material")], move |out, [color]| {
            let Some(mut out) = rgb_mut(out) else { return };
            if same {
                out.iter_mut().zip(rgb(&color)).for_each(|(out, color)| out.copy_from_slice(color));
            } else {
                let planes = change.map(|value| vec![value; out[0].len()]);
                color::adjust_hsv(
                    rgb(&color),
                    planes.each_ref().map(|plane| &plane[..]),
                    out.each_mut().map(|out| &mut **out),
                );
            }
            for (plane, tint) in out.into_iter().zip(tint).filter(|(_, tint)| *tint != 1.0) {
                plane.iter_mut().for_each(|value| *value *= tint);
            }
        })
    }

    fn channel(&self, channel: Channel, value: Anywhere) -> Result<Anywhere, Stop> {
        match channel {
            Channel::BaseColor => self.color(value),
            Channel::Roughness if self.roughness != Linear::new(0.0, 1.0) => {
                let (low, span) = (narrow(self.roughness.at0), narrow(self.roughness.at1 - self.roughness.at0));
                each(value, move |value| saturate(low + span * saturate(value)))
            }
            Channel::Height if self.height_scale != 1.0 || self.height_offset != 0.0 => {
                let (scale, offset) = (narrow(self.height_scale), narrow(self.height_offset));
                each(value, move |value| value * scale + offset)
            }
            Channel::Normal => {
                let by = narrow(self.height_scale * self.normal_strength);
                if by == 1.0 {
                    return Ok(value);
                }
                pointwise(Type::Normal, [(value, "material")], move |out, [normal]| {
                    if let Some(out) = rgb_mut(out) {
                        scale_slopes([by, by], rgb(&normal), out);
                    }
                })
            }
            _ => Ok(value),
        }
    }
}

/// A value with `change` applied to each number.
fn each(value: Anywhere, change: impl Fn(f32) -> f32 + Send + Sync + 'static) -> Result<Anywhere, Stop> {
    changed(value, move |values, out| out.iter_mut().zip(values).for_each(|(out, value)| *out = change(*value)))
}

impl Node for AdjustMaterial {
    const OUTPUTS: &'static [Output] = &[Output::material_of("material", &["material"], "The changed material.")];
    const FACTS: &'static [Fact] = &[];

    fn channels(&self, inputs: &MaterialInputs<'_>) -> ChannelSet {
        inputs.at("material")
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        Ok(match cx.get(&self.material)? {
            MaterialAnywhere::Canvas(material) => {
                let change = |(channel, of): &(Channel, Field)| {
                    let made = self.channel(*channel, Anywhere::Field(of.clone()))?;
                    Ok((*channel, field(made, "material")?))
                };
                let channels: Vec<_> = material.channels().iter().map(change).collect::<Result<_, Stop>>()?;
                Outputs::one(Material::new(channels))
            }
            MaterialAnywhere::Space(material) => {
                let change = |(channel, of): &(Channel, Solid)| {
                    let made = self.channel(*channel, Anywhere::Solid(of.clone()))?;
                    Ok((*channel, solid(made, channel.solid_type(), "material")?))
                };
                let channels: Vec<_> = material.channels().iter().map(change).collect::<Result<_, Stop>>()?;
                Outputs::one(SolidMaterial::new(channels))
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{canvas, check_field, lumps, outputs, port, raster};
    use shibo_value::Value;

    fn made(node: &AdjustMaterial, channels: &[(Channel, Field)]) -> Material {
        let outputs = outputs(node, &[Material::new(channels.to_vec()).into()], &canvas()).unwrap();
        let Some(Value::Material(material)) = outputs.take("material", true) else { panic!("no material") };
        (**material).clone()
    }

    fn values(material: &Material, channel: Channel) -> Vec<f32> {
        let tile = raster(material.get(channel).unwrap(), &canvas());
        (0..tile.channels()).map(|k| tile.plane(k)[70]).collect()
    }

    fn node() -> AdjustMaterial {
        AdjustMaterial { material: port(0), ..AdjustMaterial::default() }
    }

    #[test]
    fn changes_each_channel() {
        let slope = |x: f32| {
            let z = 1.0 / (1.0 + x * x).sqrt();
            Field::constant(Type::Normal, &[0.5 + 0.5 * x * z, 0.5, 0.5 + 0.5 * z])
        };
        let channels = [
            (Channel::BaseColor, Field::constant(Type::Rgb, &[0.8, 0.0, 0.0])),
            (Channel::Roughness, Field::constant(Type::Gray, &[0.25])),
            (Channel::Height, lumps()),
            (Channel::Normal, slope(0.5)),
            (Channel::Coat, Field::constant(Type::Gray, &[0.3])),
        ];
        let node = AdjustMaterial {
            hue: 120.0,
            tint: Color([1.0, 0.5, 1.0]),
            roughness: Linear::new(0.2, 0.6),
            height_scale: 2.0,
            height_offset: -1.0,
            normal_strength: 0.5,
            ..node()
        };
        let changed = made(&node, &channels);
        let color = values(&changed, Channel::BaseColor);
        assert!(color[0].abs() < 1e-5 && (color[1] - 0.4).abs() < 1e-4 && color[2].abs() < 1e-5, "{color:?}");
        assert!((values(&changed, Channel::Roughness)[0] - 0.3).abs() < 1e-6);
        let (before, after) = (raster(&lumps(), &canvas()), raster(changed.get(Channel::Height).unwrap(), &canvas()));
        assert!(before.data().iter().zip(after.data()).all(|(a, b)| (2.0 * a - 1.0 - b).abs() < 1e-6));
        // Twice the height at half the strength: normals as steep as before.
        assert_eq!(values(&changed, Channel::Normal), values(&Material::new(channels.to_vec()), Channel::Normal));
        let flat = AdjustMaterial { normal_strength: 0.0, ..node };
        assert!((values(&made(&flat, &channels), Channel::Normal)[0] - 0.5).abs() < 1e-6);
        assert_eq!(values(&changed, Channel::Coat), [0.3]);
        changed.channels().iter().for_each(|(_, field)| check_field(field));
    }

    #[test]
    fn passes_on_unchanged_channels() {
        let channels =
            [(Channel::BaseColor, lumps().to_rgb()), (Channel::Height, lumps()), (Channel::Roughness, lumps())];
        let same = made(&node(), &channels);
        assert!(channels.iter().all(|(channel, field)| same.get(*channel).unwrap().id() == field.id()));
        let grey = made(&AdjustMaterial { saturation: 0.0, ..node() }, &channels[..1]);
        let color = values(&grey, Channel::BaseColor);
        assert!((color[0] - color[1]).abs() < 1e-5 && (color[0] - color[2]).abs() < 1e-5);
    }
}
