//! [`TransformMaterial`]: moves, rotates and scales all channels of a material.
//!
//! Each channel is transformed as by [`Transform`](crate::space::Transform). Normals and the angle of the anisotropy
//! are rotated; slopes become flatter if features become larger but the height does not. Cost: that of a transform for
//! each channel.
use crate::moved::Placement;
use crate::values::each;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::tile::planes3;
use shibo_kernel::surface::layers::scale_slopes;
use shibo_node::{CanvasFacts, Context, Fact, In, MaterialInputs, Node, Output, Outputs, Xy, node};
use shibo_value::{Channel, ChannelSet, Field, Halo, Material, Stop, Tile, Tiling, Type};

/// Moves, rotates and scales a material, all its channels at once.
///
/// On a canvas that tiles, the result tiles if the canvas then holds a whole number of repeats of the material: always
/// if the material is only moved, and for example with `scale: 0.5`, or with `angle: 90` on a square canvas.
///
/// ```ron
/// "wave":    Gradient(times: 8, repeat: Mirror),
/// "bump":    Remap(input: "wave", from: (0, 1), to: (0, 0.8)),
/// "normal":  HeightToNormal(input: "bump"),
/// "ribs":    Material(base_color: "#6a7d8a", roughness: 0.4, height: "bump", normal: "normal"),
/// "small":   TransformMaterial(material: "ribs", scale: 0.5, angle: 90, scale_height: true),
/// "example": Relief(material: "small"),
/// ```
///
/// Elsewhere: Substance Designer *Material Transform*, Material Maker *Transform*, Blender *Mapping*, Houdini *UV
/// Transform*.
#[node]
pub struct TransformMaterial {
    /// Material to move.
    pub material: In<Material>,
    /// Shift of the features, to the right and down.
    #[schemars(extend("minimum" = -1e6, "maximum" = 1e6, "unit" = "mm"))]
    pub offset: Xy,
    /// Rotation of the features, from +x towards +y.
    #[schemars(range(min = -360, max = 360), extend("unit" = "°"))]
    pub angle: f64,
    /// Factor on the size of the features: 2 is twice as large. Applied before the rotation.
    #[schemars(extend("minimum" = 1e-3, "maximum" = 1e3))]
    #[default(Xy::new(1.0, 1.0))]
    pub scale: Xy,
    /// The point about which features are rotated and scaled; the canvas' centre by default.
    #[schemars(extend("minimum" = -1e6, "maximum" = 1e6, "unit" = "mm"))]
    pub pivot: Option<Xy>,
    /// True to scale heights with the features, by the mean of both scales: slopes then stay the same. If false,
    /// heights stay, and larger features are flatter.
    pub scale_height: bool,
    /// True to mirror the features left to right, and top to bottom, before they are rotated.
    pub mirror: (bool, bool),
}

impl TransformMaterial {
    fn placement(&self) -> Placement {
        let Self { offset, angle, pivot, .. } = *self;
        Placement { offset, angle, scale: self.signed_scale(), pivot }
    }

    /// The scale, below 0 in a direction that is mirrored.
    fn signed_scale(&self) -> Xy {
        let sign = |mirrored: bool| if mirrored { -1.0 } else { 1.0 };
        Xy::new(sign(self.mirror.0) * self.scale.x, sign(self.mirror.1) * self.scale.y)
    }

    fn channel(&self, channel: Channel, field: &Field, cx: &Context<'_>) -> Field {
        let place = |field: &Field| self.placement().place(field, cx.size_mm());
        let height = if self.scale_height { (self.scale.x * self.scale.y).sqrt() } else { 1.0 };
        let change = |field: &Field, change: fn(f32, f32) -> f32, by: f64| {
            let by = narrow(by);
            each(field, move |value| change(value, by))
        };
        match channel {
            Channel::Height if height != 1.0 => change(&place(field), |value, by| value * by, height),
            // A mirrored direction runs the other way; fibres have no front, so both ways of mirroring agree.
            Channel::AnisotropyAngle if self.mirror.0 != self.mirror.1 => {
                change(&place(field), |value, by| by - value, self.angle)
            }
            Channel::AnisotropyAngle if self.angle != 0.0 => change(&place(field), |value, by| value + by, self.angle),
            Channel::Normal | Channel::CoatNormal => {
                let scale = self.signed_scale();
                let by = [narrow(height / scale.x), narrow(height / scale.y)];
                if by == [1.0, 1.0] {
                    return place(field);
                }
                let scaled = Field::map(Type::Normal, [field.clone()], Halo::NONE, move |out: &mut Tile, [normal]| {
                    scale_slopes(by, [0, 1, 2].map(|k| normal.plane(k)), planes3(out));
                    Ok(())
                });
                place(&scaled)
            }
            _ => place(field),
        }
    }
}

impl Node for TransformMaterial {
    const OUTPUTS: &'static [Output] = &[Output::new("material", Type::Material, "The material, moved.")];
    const FACTS: &'static [Fact] = &[Fact::Size, Fact::Tile];

    fn tiling(&self, canvas: &CanvasFacts) -> Tiling {
        self.placement().repeats(canvas.size_mm(), canvas.tile())
    }

    fn channels(&self, inputs: &MaterialInputs<'_>) -> ChannelSet {
        inputs.at("material")
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let material = cx.get(&self.material)?;
        let moved = material.channels().iter().map(|(channel, field)| (*channel, self.channel(*channel, field, cx)));
        Ok(Outputs::one(Material::new(moved)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{canvas, lumps, outputs, port, raster};
    use shibo_value::Value;

    fn made(node: &TransformMaterial, material: Material) -> Material {
        let made = outputs(node, &[material.into()], &canvas()).unwrap();
        let Some(Value::Material(material)) = made.take("material", true) else { panic!("no material") };
        (**material).clone()
    }

    #[test]
    fn rotates_normals_and_anisotropy() {
        let slope = |x: f32, y: f32| {
            let z = 1.0 / (1.0 + x * x + y * y).sqrt();
            Field::constant(Type::Normal, &[0.5 + 0.5 * x * z, 0.5 + 0.5 * y * z, 0.5 + 0.5 * z])
        };
        let angle = Field::constant(Type::Gray, &[10.0]);
        let material = Material::new([(Channel::Normal, slope(1.0, 0.0)), (Channel::AnisotropyAngle, angle)]);
        let node = TransformMaterial {
            material: port(0),
            angle: 90.0,
            scale: Xy::new(2.0, 2.0),
            ..TransformMaterial::default()
        };
        let turned = made(&node, material.clone());
        let normal = |material: &Material| {
            let tile = raster(material.get(Channel::Normal).unwrap(), &canvas());
            [0, 1, 2].map(|k| 2.0 * tile.plane(k)[0] - 1.0)
        };
        // Twice as large at the same height is half as steep: a slope of ½, which pointed right and now points down (y
        // is up).
        let n = normal(&turned);
        assert!((n[1] / n[2] + 0.5).abs() < 1e-5 && n[0].abs() < 1e-5, "{n:?}");
        let angle = raster(turned.get(Channel::AnisotropyAngle).unwrap(), &canvas()).data()[0];
        assert!((angle - 100.0).abs() < 1e-4);
        // As steep as before if the height grows too.
        let n = normal(&made(&TransformMaterial { scale_height: true, ..node }, material));
        assert!((n[1] / n[2] + 1.0).abs() < 1e-5, "{n:?}");
    }

    #[test]
    fn mirrors_slopes_and_directions() {
        let slope = Field::constant(Type::Normal, &[0.8, 0.5, 0.9]);
        let angle = Field::constant(Type::Gray, &[10.0]);
        let material =
            Material::new([(Channel::Normal, slope), (Channel::AnisotropyAngle, angle), (Channel::Height, lumps())]);
        let node = TransformMaterial { material: port(0), mirror: (true, false), ..TransformMaterial::default() };
        let mirrored = made(&node, material.clone());
        let first = |channel| {
            let tile = raster(mirrored.get(channel).unwrap(), &canvas());
            (0..tile.channels()).map(|k| tile.plane(k)[0]).collect::<Vec<_>>()
        };
        let normal = first(Channel::Normal);
        assert!(normal[0] < 0.5 && (normal[1] - 0.5).abs() < 1e-6, "{normal:?}");
        assert_eq!(first(Channel::AnisotropyAngle), [-10.0]);
        let (before, after) = (raster(&lumps(), &canvas()), raster(mirrored.get(Channel::Height).unwrap(), &canvas()));
        for y in 0..before.height() {
            let backwards: Vec<f32> = after.row(0, y).iter().rev().copied().collect();
            assert_eq!(before.row(0, y), backwards);
        }
        // Twice mirrored is as before.
        let again = made(&node, mirrored);
        assert_eq!(raster(again.get(Channel::Height).unwrap(), &canvas()).data(), before.data());
    }

    #[test]
    fn scales_heights_on_request() {
        let material = || Material::new([(Channel::Height, lumps())]);
        let plain = TransformMaterial { material: port(0), scale: Xy::new(0.5, 0.5), ..TransformMaterial::default() };
        let height = |node: &TransformMaterial| raster(made(node, material()).get(Channel::Height).unwrap(), &canvas());
        let (same, scaled) = (height(&plain), height(&TransformMaterial { scale_height: true, ..plain.clone() }));
        assert!(same.data().iter().zip(scaled.data()).all(|(a, b)| (0.5 * a - b).abs() < 1e-6));
    }
}
