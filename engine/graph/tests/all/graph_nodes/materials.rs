//! Nodes of materials and of lists of structs.
use super::count;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use shibo_node::{CanvasFacts, Context, Gray, In, MaterialInputs, Node, Output, Outputs, Rgb, TakenChannel};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Channel, ChannelSet, Material, Stop, Type};

/// A material.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Surface {
    /// Colour.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub(crate) base_color: Option<In<Rgb>>,
    /// Roughness.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub(crate) roughness: Option<In<Gray>>,
    /// Height.
    pub(crate) height: Option<In<Gray>>,
}

impl Node for Surface {
    const OUTPUTS: &'static [Output] = &[Output::new("material", Type::Material, "M.")];

    fn channels(&self, _inputs: &MaterialInputs<'_>) -> ChannelSet {
        let connected = [
            (Channel::BaseColor, self.base_color.is_some()),
            (Channel::Roughness, self.roughness.is_some()),
            (Channel::Height, self.height.is_some()),
        ];
        connected.into_iter().filter_map(|(channel, connected)| connected.then_some(channel)).collect()
    }

    fn evaluate(&self, _cx: &Context<'_>) -> Result<Outputs, Stop> {
        Err(Stop::Cancelled)
    }
}

/// Materials on top of each other.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Layers {
    /// Materials.
    pub(crate) materials: Vec<In<Material>>,
}
node!(Layers, [Output::new("material", Type::Material, "M.")]);

/// A layer.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Layer {
    /// Material.
    pub(crate) material: In<Material>,
    /// Mask.
    pub(crate) mask: Option<In<Gray>>,
    /// Opacity.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub(crate) opacity: In<Gray>,
    /// Count.
    pub(crate) count: u32,
}

impl Default for Layer {
    fn default() -> Self {
        Self { material: In::default(), mask: None, opacity: In::constant(1.0), count: 1 }
    }
}

/// Layers with ports.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Stack {
    /// Lowest material.
    pub(crate) base: Option<In<Material>>,
    /// Layers.
    pub(crate) layers: Vec<Layer>,
    /// Highest material.
    pub(crate) top: Option<In<Material>>,
}

impl Node for Stack {
    const OUTPUTS: &'static [Output] = &[Output::new("material", Type::Material, "M.")];

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        count();
        // Reports the slots of each layer to the tests.
        let slots = self.layers.iter().map(|layer| {
            let mask = layer.mask.as_ref().and_then(In::slot);
            format!("{:?} {mask:?} {:?} {}", layer.material.slot(), layer.opacity.slot(), layer.count)
        });
        let text = format!(
            "{:?} {:?} {:?}",
            self.base.as_ref().and_then(In::slot),
            slots.collect::<Vec<_>>(),
            self.top.as_ref().and_then(In::slot)
        );
        let told = self.layers.iter().any(|layer| layer.count == 77);
        if told { vec![Problem::new(Code::BadValue, text).at("layers")] } else { Vec::new() }
    }

    fn evaluate(&self, _cx: &Context<'_>) -> Result<Outputs, Stop> {
        Err(Stop::Cancelled)
    }
}

/// A channel of a material.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Take {
    /// The material.
    pub(crate) material: In<Material>,
    /// Its channel.
    pub(crate) channel: Channel,
}

impl Default for Take {
    fn default() -> Self {
        Self { material: In::default(), channel: Channel::Height }
    }
}

impl Node for Take {
    const OUTPUTS: &'static [Output] = &[Output::new("value", Type::Gray, "C.")];

    fn takes(&self) -> Vec<TakenChannel> {
        vec![TakenChannel { port: "material", field: "channel", channel: self.channel }]
    }

    fn evaluate(&self, _cx: &Context<'_>) -> Result<Outputs, Stop> {
        Err(Stop::Cancelled)
    }
}
