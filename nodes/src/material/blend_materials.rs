//! [`BlendMaterials`]: one material over another.
//!
//! Weight: the mask times the opacity, or `smoothstep(-c/2, c/2, top + offset - base + (2·mask - 1)·(range + c/2))`
//! times the opacity, `c` being the contrast. Colours are mixed scene-linear, normals by their slopes or by
//! reorientation (C. Barré-Brisebois and S. Hill, *Blending in Detail*, 2012), anisotropy by twice its angle. Cost:
//! O(pixels), bound by memory; a tile in which only one layer shows does not compute the other.
use super::layers::{BlendBy, BlendNormals, Over, layered};
use shibo_kernel::surface::layers::HeightMode;
use shibo_node::{AnyMaterial, Context, Fact, In, MaterialInputs, Node, Number, Output, Outputs, node};
use shibo_value::{ChannelSet, Stop};

/// Lays one material over another, all channels at once.
///
/// The result has every channel that either layer has; a layer without a channel uses its default. Areas that a mask
/// hides are not computed: a floor of many materials costs about as much as one.
///
/// With `by: Height` the higher layer shows, as mortar fills the gaps between stones and dust lies in grooves. The mask
/// then lifts the top layer (above ½) or lowers it (below ½) by up to `range`. A mask of 0 always shows the base and a
/// mask of 1 the top.
///
/// `opacity` is applied last, to the weight. `offset` moves the top layer up, both for the choice by height and in the
/// result. By default normals are made from the blended height, so that the step from one layer to the other has an
/// edge that catches light.
///
/// Materials in space are blended in space, by a mask in space: stain that follows the rings, another wood in the knots.
/// A material of constants, such as paint, goes with both.
///
/// ```ron
/// "cells":   Worley(size: 7),
/// "flat":    Remap(input: "cells.border", from: (0, 2), to: (0, 1), clamp: true),
/// "bump":    "= smoothstep(0, 1, flat)",
/// "stone":   Material(base_color: "#8a8276", roughness: 0.75, height: "bump"),
/// "grain":   Fractal(size: 1.5),
/// "sand_h":  Remap(input: "grain", from: (0, 1), to: (0, 0.12)),
/// "sand":    Material(base_color: "#c9ad7c", roughness: 0.9, height: "sand_h"),
/// "both":    BlendMaterials(base: "stone", top: "sand", by: Height, offset: 0.3, contrast: 0.1),
/// "example": Relief(material: "both"),
/// ```
///
/// Elsewhere: Substance Designer *Material Blend* and *Material Height Blend*, Material Maker *Blend* of materials,
/// Blender *Mix Shader*, Houdini *Layer Mix*, Unreal *Material Layer Blend*.
#[node]
pub struct BlendMaterials {
    /// The layer below.
    pub base: In<AnyMaterial>,
    /// The layer above.
    pub top: In<AnyMaterial>,
    /// Where the layer above shows, 0..1; values are clamped to that range. If not given: everywhere, or, with `by:
    /// Height`, where it is higher.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub mask: Option<In<Number>>,
    /// Opacity of the layer above, 0..1.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    #[default(In::constant(1.0))]
    pub opacity: In<Number>,
    /// How to decide which layer shows.
    pub by: BlendBy,
    /// With `by: Height`: the difference of heights over which one layer blends into the other; 0 is a sharp edge.
    #[schemars(range(min = 0.0, max = 1e4), extend("unit" = "mm"))]
    #[default(0.1)]
    pub contrast: f64,
    /// By how much the layer above is raised.
    #[schemars(range(min = -1e4, max = 1e4), extend("unit" = "mm"))]
    pub offset: f64,
    /// With `by: Height`: the largest difference of heights that the mask can overcome.
    #[schemars(range(min = 0.0, max = 1e4), extend("unit" = "mm"))]
    #[default(1.0)]
    pub range: f64,
    /// How the heights are combined.
    pub height: HeightMode,
    /// Source of the normals.
    pub normals: BlendNormals,
}

impl BlendMaterials {
    fn over(&self) -> Over {
        let Self { by, contrast, offset, range, height, normals, .. } = *self;
        Over { by, contrast, offset, range, height, normals }
    }
}

/// The ports whose values are all on the canvas or all in space.
const PORTS: &[&str] = &["base", "top", "mask", "opacity"];

impl Node for BlendMaterials {
    const OUTPUTS: &'static [Output] = &[
        Output::material_of("material", PORTS, "The blend, with the channels of both."),
        Output::number_of("weight", PORTS, "How much of the layer above shows, 0..1."),
    ];
    const VERSION: u32 = 2;
    const FACTS: &'static [Fact] = &[];

    fn channels(&self, inputs: &MaterialInputs<'_>) -> ChannelSet {
        self.over().channels(inputs.at("base"), inputs.at("top"))
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (base, top) = (cx.get(&self.base)?, cx.get(&self.top)?);
        let [mask, opacity] = [cx.get_opt(&self.mask)?, Some(cx.get(&self.opacity)?)];
        let names = ["base", "top", "mask", "opacity"].map(str::to_owned);
        let (blend, weight) = layered(cx, &self.over(), ["blend", "weight"], [base, top], [mask, opacity], &names)?;
        Ok(Outputs::one(blend).with("weight", weight))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{canvas, lumps, outputs, port, raster};
    use shibo_value::{Channel, Field, Material, Type, Value};

    fn number(value: f32) -> Field {
        Field::constant(Type::Gray, &[value])
    }

    fn blend(node: &BlendMaterials, inputs: &[Value]) -> Material {
        let made = outputs(node, inputs, &canvas()).unwrap();
        let Some(Value::Material(material)) = made.take("material", true) else { panic!("no material") };
        let known =
            node.channels(&MaterialInputs::new(&[("base", channels(&inputs[0])), ("top", channels(&inputs[1]))]));
        assert_eq!(known.iter().collect::<Vec<_>>(), material.channels().iter().map(|c| c.0).collect::<Vec<_>>());
        (**material).clone()
    }

    fn channels(value: &Value) -> ChannelSet {
        let Value::Material(material) = value else { return ChannelSet::NONE };
        material.channels().iter().map(|c| c.0).collect()
    }

    fn first(material: &Material, channel: Channel) -> Vec<f32> {
        let tile = raster(material.get(channel).unwrap(), &canvas());
        (0..tile.channels()).map(|k| tile.plane(k)[0]).collect()
    }

    fn node() -> BlendMaterials {
        BlendMaterials { base: port(0), top: port(1), mask: Some(port(2)), ..BlendMaterials::default() }
    }

    #[test]
    fn mixes_channels_of_both_with_defaults() {
        let base = Material::new([
            (Channel::BaseColor, Field::constant(Type::Rgb, &[1.0, 0.0, 0.0])),
            (Channel::Roughness, number(0.2)),
        ]);
        let top = Material::new([(Channel::Metallic, number(1.0)), (Channel::Roughness, number(0.6))]);
        let blend = blend(&node(), &[base.into(), top.into(), number(0.25).into()]);
        assert_eq!(first(&blend, Channel::BaseColor), [0.875, 0.125, 0.125]);
        assert!((first(&blend, Channel::Roughness)[0] - 0.3).abs() < 1e-6);
        assert_eq!(first(&blend, Channel::Metallic), [0.25]);
        assert!(blend.get(Channel::Normal).is_none() && blend.get(Channel::Height).is_none());
    }

    #[test]
    fn makes_normals_from_blended_heights() {
        let with = |height| Material::new([(Channel::Height, height)]);
        let inputs = [with(lumps()).into(), with(number(0.5)).into(), number(0.0).into()];
        let blended = blend(&node(), &inputs);
        let plain = raster(&lumps(), &canvas());
        assert_eq!(raster(blended.get(Channel::Height).unwrap(), &canvas()).data(), plain.data());
        assert!(blended.get(Channel::Normal).is_some());
        // `BlendNormals::Mix` needs normals.
        let mixed = BlendMaterials { normals: BlendNormals::Mix, ..node() };
        assert!(blend(&mixed, &inputs).get(Channel::Normal).is_none());
        // Raised by 0.25, the top layer lies at 0.75 where it shows; the sum is 1.25 with a base of 0.5.
        let raised = |height| BlendMaterials { offset: 0.25, height, ..node() };
        let level = [with(number(0.5)).into(), with(number(0.5)).into(), number(1.0).into()];
        for (height, expected) in [(HeightMode::Replace, 0.75), (HeightMode::Add, 1.25), (HeightMode::Max, 0.75)] {
            assert_eq!(first(&blend(&raised(height), &level), Channel::Height), [expected]);
        }
    }

    #[test]
    fn by_height_the_higher_layer_shows_its_color() {
        let of = |height: f32, red: f32| {
            let color = Field::constant(Type::Rgb, &[red, 0.0, 0.0]);
            Value::from(Material::new([(Channel::Height, number(height)), (Channel::BaseColor, color)]))
        };
        let node = BlendMaterials { by: BlendBy::Height, mask: None, ..node() };
        let red = |base, top| first(&blend(&node, &[of(base, 0.0), of(top, 1.0)]), Channel::BaseColor)[0];
        assert_eq!((red(0.0, 1.0), red(1.0, 0.0), red(0.3, 0.3)), (1.0, 0.0, 0.5));
    }
}
