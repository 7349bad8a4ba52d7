//! [`ChannelOf`]: the node of `"material.channel"`. Cost: none.
use shibo_node::{AnyMaterial, Context, Fact, In, MaterialAnywhere, Node, Output, Outputs, TakenChannel, node};
use shibo_value::{Channel, Stop};

/// Takes a channel of a material, or the default of the channel if the material lacks it.
#[node]
pub struct ChannelOf {
    /// The material.
    pub material: In<AnyMaterial>,
    /// The channel.
    #[default(Channel::Height)]
    pub channel: Channel,
}

impl Node for ChannelOf {
    const OUTPUTS: &'static [Output] = &[Output::told("value", "The channel.")];
    const FACTS: &'static [Fact] = &[];

    fn takes(&self) -> Vec<TakenChannel> {
        vec![TakenChannel { port: "material", field: "channel", channel: self.channel }]
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        Ok(match cx.get(&self.material)? {
            MaterialAnywhere::Canvas(material) => Outputs::one(material.or_default(self.channel)),
            MaterialAnywhere::Space(material) => Outputs::one(material.or_default(self.channel)),
        })
    }
}
