//! [`WarpMaterial`]: displaces all channels of a material alike.
//!
//! Each channel is warped as by [`Warp`](crate::space::Warp): a point p of the result shows the material at p + d(p).
//! Normals keep their directions. Cost: O(pixels) for each channel.
use crate::bounds::at_most_half;
use crate::values::each;
use crate::warped::Warped;
use shibo_kernel::ground::number::narrow;
use shibo_node::{CanvasFacts, Context, Fact, Gray, In, MaterialInputs, Node, Output, Outputs, Vec2Field, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{ChannelSet, Field, Halo, Material, Stop, Tile, Type};

/// Warps a material, all its channels at once, by displacements from fields.
///
/// ```ron
/// "wave":    Gradient(times: 8, repeat: Mirror),
/// "bump":    Remap(input: "wave", from: (0, 1), to: (0, 0.8)),
/// "ribs":    Material(base_color: "#6a7d8a", roughness: 0.4, height: "bump"),
/// "bend":    Perlin(size: 12),
/// "bent":    WarpMaterial(material: "ribs", x: "bend", amount: 4),
/// "example": Relief(material: "bent"),
/// ```
///
/// Elsewhere: Substance Designer *Warp* on every channel, Material Maker *Warp*, Blender *Vector Math* on texture
/// coordinates.
#[node]
pub struct WarpMaterial {
    /// Material to warp.
    pub material: In<Material>,
    /// Displacements in mm, instead of `x` and `y`; displacements longer than `amount` are shortened to it.
    pub by: Option<In<Vec2Field>>,
    /// Displacement to the right: 0 is `-amount`, ½ is none, 1 is `amount`.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub x: Option<In<Gray>>,
    /// Displacement down, encoded like `x`.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub y: Option<In<Gray>>,
    /// Largest displacement in x and in y; at most half the canvas' longer side.
    #[schemars(range(min = 0, max = 5e5), extend("unit" = "mm"))]
    #[default(1.0)]
    pub amount: f64,
}

impl Node for WarpMaterial {
    const OUTPUTS: &'static [Output] = &[Output::new("material", Type::Material, "The material, bent.")];
    const FACTS: &'static [Fact] = &[Fact::Size];

    fn check(&self, canvas: &CanvasFacts) -> Vec<Problem> {
        at_most_half("amount", self.amount, canvas)
    }

    fn advice(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        if self.by.is_some() || self.x.is_some() || self.y.is_some() {
            return Vec::new();
        }
        let problem = Problem::new(Code::Advice, "no displacement is connected; the material stays as it is");
        vec![problem.help("write for example `x: \"noise\"`")]
    }

    fn channels(&self, inputs: &MaterialInputs<'_>) -> ChannelSet {
        inputs.at("material")
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let material = cx.get(&self.material)?;
        let amount = narrow(self.amount);
        let by = match cx.get_opt(&self.by)? {
            Some(by) => each(&by, move |mm| mm.clamp(-amount, amount)),
            None => {
                let none = || Field::constant(Type::Gray, &[0.5]);
                let sides = [cx.get_opt(&self.x)?.unwrap_or_else(none), cx.get_opt(&self.y)?.unwrap_or_else(none)];
                Field::map(Type::Vec2, sides, Halo::NONE, move |out: &mut Tile, [x, y]| {
                    for (k, side) in [x, y].into_iter().enumerate() {
                        for (out, value) in out.plane_mut(k).iter_mut().zip(side.plane(0)) {
                            *out = (value * 2.0 - 1.0).clamp(-1.0, 1.0) * amount;
                        }
                    }
                    Ok(())
                })
            }
        };
        let by = cx.shared_field("displacements", by);
        let bend = |input: &Field| {
            if input.as_constant().is_some() || self.amount == 0.0 {
                return input.clone();
            }
            let tiling = input.tiling().and(by.tiling());
            Field::new(input.ty(), tiling, Warped { input: input.clone(), by: by.clone(), limit: self.amount })
        };
        Ok(Outputs::one(Material::new(material.channels().iter().map(|(channel, field)| (*channel, bend(field))))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{canvas, check_field, lumps, outputs, port, raster};
    use shibo_value::{Channel, Value};

    #[test]
    fn all_channels_move_together() {
        let constant = |v: f32| Value::from(Field::constant(Type::Gray, &[v]));
        let material = Material::new([(Channel::Height, lumps()), (Channel::Roughness, lumps())]);
        let node = WarpMaterial { material: port(0), x: Some(port(1)), amount: 2.0, ..WarpMaterial::default() };
        let made = outputs(&node, &[material.into(), constant(0.75)], &canvas()).unwrap();
        let Some(Value::Material(bent)) = made.take("material", true) else { panic!("no material") };
        check_field(bent.get(Channel::Height).unwrap());
        let tile = |channel| raster(bent.get(channel).unwrap(), &canvas());
        let (height, roughness, plain) = (tile(Channel::Height), tile(Channel::Roughness), raster(&lumps(), &canvas()));
        assert_eq!(height.data(), roughness.data());
        // ¾ is half of 2 mm: it reads two pixels of half a mm further to the right.
        for y in 0..64 {
            assert!((0..60).all(|x| (height.row(0, y)[x] - plain.row(0, y)[x + 2]).abs() < 1e-5));
        }
    }
}
