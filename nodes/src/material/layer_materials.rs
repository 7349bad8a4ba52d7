//! [`LayerMaterials`]: any number of materials, one over the other.
//!
//! The same result as nested [`BlendMaterials`](super::BlendMaterials). Cost: O(pixels) for each layer that shows.
use super::layers::{BlendBy, BlendNormals, Over, layered};
use shibo_kernel::surface::layers::HeightMode;
use shibo_node::{AnyMaterial, CanvasFacts, Context, Fact, In, MaterialInputs, Node, Number, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{ChannelSet, Material, Stop};

/// Lays materials over each other, the lowest first. Each layer is blended over all layers before it, with the
/// parameters of `BlendMaterials`; the first layer needs only its material.
/// Layers are all on the canvas or all in space; a layer of constants goes with both.
///
/// ```ron
/// "cells":   Worley(size: 7),
/// "flat":    Remap(input: "cells.border", from: (0, 2), to: (0, 1), clamp: true),
/// "bump":    "= smoothstep(0, 1, flat)",
/// "stone":   Material(base_color: "#8a8276", roughness: 0.75, height: "bump"),
/// "grain":   Fractal(size: 1.5),
/// "sand_h":  Remap(input: "grain", from: (0, 1), to: (0, 0.12)),
/// "sand":    Material(base_color: "#c9ad7c", roughness: 0.9, height: "sand_h"),
/// "moss_h":  Remap(input: "grain", from: (0, 1), to: (0, 0.3)),
/// "moss":    Material(base_color: "#5d7038", roughness: 1, height: "moss_h"),
/// "damp":    Fractal(size: 12, octaves: 5, seed: 4),
/// "where":   Threshold(input: "damp", level: 0.55, softness: 0.1),
/// "all":     LayerMaterials(layers: [
///   (material: "stone"),
///   (material: "sand", by: Height, offset: 0.3),
///   (material: "moss", mask: "where", height: Add),
/// ]),
/// "example": Relief(material: "all"),
/// ```
///
/// Elsewhere: Substance Designer *Multi Material Blend*, Substance Painter layers, Unreal *Material Layers*, Houdini
/// *Layer Mix*.
#[node]
pub struct LayerMaterials {
    /// The layers, the lowest first.
    pub layers: Vec<Layer>,
}

/// A layer of [`LayerMaterials`].
#[node]
pub struct Layer {
    /// The material.
    pub material: In<AnyMaterial>,
    /// Where the layer shows, 0..1. If not given: everywhere, or, with `by: Height`, where it is higher.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub mask: Option<In<Number>>,
    /// Opacity of the layer, 0..1.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    #[default(In::constant(1.0))]
    pub opacity: In<Number>,
    /// How to decide whether the layer shows.
    pub by: BlendBy,
    /// With `by: Height`: the difference of heights over which the layer blends into the layers below; 0 is a sharp
    /// edge.
    #[schemars(range(min = 0.0, max = 1e4), extend("unit" = "mm"))]
    #[default(0.1)]
    pub contrast: f64,
    /// By how much the layer is raised.
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

impl Layer {
    fn over(&self) -> Over {
        let Self { by, contrast, offset, range, height, normals, .. } = *self;
        Over { by, contrast, offset, range, height, normals }
    }
}

impl Node for LayerMaterials {
    const OUTPUTS: &'static [Output] =
        &[Output::material_of("material", &["layers"], "All layers, with the channels of all.")];
    const VERSION: u32 = 2;
    const FACTS: &'static [Fact] = &[];

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        if !self.layers.is_empty() {
            return Vec::new();
        }
        let problem = Problem::new(Code::MissingInput, "`LayerMaterials` needs at least one layer").at("layers");
        vec![problem.help("write `layers: [(material: \"below\"), (material: \"above\", mask: \"where\")]`")]
    }

    fn channels(&self, inputs: &MaterialInputs<'_>) -> ChannelSet {
        let of = |number: usize| inputs.at(&format!("layers.{number}.material"));
        let above = (2..).zip(self.layers.iter().skip(1));
        above.fold(of(1), |base, (number, layer)| layer.over().channels(base, of(number)))
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let mut layers = self.layers.iter().enumerate();
        let Some((_, first)) = layers.next() else { return Ok(Outputs::one(Material::default())) };
        let mut all = cx.get(&first.material)?;
        for (number, layer) in layers {
            let top = cx.get(&layer.material)?;
            let names = [format!("layer {number}"), format!("weight {number}")];
            let numbers = [cx.get_opt(&layer.mask)?, Some(cx.get(&layer.opacity)?)];
            let port = |name: &str| format!("layers.{}.{name}", number + 1);
            let ports = ["1.material", "material", "mask", "opacity"].map(port);
            let names = names.each_ref().map(String::as_str);
            (all, _) = layered(cx, &layer.over(), names, [all, top], numbers, &ports)?;
        }
        Ok(Outputs::one(all))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::OnCanvas as _;
    use crate::testing::{canvas, outputs, port, raster};
    use shibo_value::{Channel, Field, Type, Value};

    #[test]
    fn later_layers_lie_over_earlier_ones() {
        let of =
            |red: f32| Value::from(Material::new([(Channel::BaseColor, Field::constant(Type::Rgb, &[red, 0.0, 0.0]))]));
        let layer =
            |slot, opacity: f32| Layer { material: port(slot), opacity: In::constant(opacity), ..Layer::default() };
        let node = LayerMaterials { layers: vec![layer(0, 0.1), layer(1, 0.5), layer(2, 0.25)] };
        let made = outputs(&node, &[of(0.0), of(1.0), of(0.1)], &canvas()).unwrap();
        let Some(Value::Material(all)) = made.take("material", true) else { panic!("no material") };
        let red = raster(all.get(Channel::BaseColor).unwrap(), &canvas()).plane(0)[0];
        // 0, then half of 1, then a quarter of 0.1 and three quarters of 0.5.
        assert!((red - 0.4).abs() < 1e-6, "{red}");
        assert_eq!(LayerMaterials::default().check_on(&canvas()).len(), 1);
    }
}
