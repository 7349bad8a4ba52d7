//! The channels of materials, derived from node to node without evaluating any node.
use crate::value::{Channel, ChannelSet};

/// The channels of the materials at a node's ports.
#[derive(Clone, Copy, Debug)]
pub struct MaterialInputs<'a> {
    slots: &'a [(&'a str, ChannelSet)],
}

impl<'a> MaterialInputs<'a> {
    /// Takes the slots of a node: for each slot the name of its port, and the channels of the material there.
    pub fn new(slots: &'a [(&'a str, ChannelSet)]) -> Self {
        Self { slots }
    }

    /// The channels of the materials at a port: none if it is not connected, the union if it takes a list.
    pub fn at(&self, port: &str) -> ChannelSet {
        let slots = self.slots.iter().filter(|(name, _)| *name == port);
        slots.fold(ChannelSet::NONE, |all, (_, channels)| all.union(*channels))
    }

    /// The channels of one material at a port that takes a list.
    pub fn one(&self, port: &str, number: usize) -> ChannelSet {
        let mut slots = self.slots.iter().filter(|(name, _)| *name == port);
        slots.nth(number).map_or(ChannelSet::NONE, |(_, channels)| *channels)
    }

    /// The channels of the materials at all ports.
    pub fn all(&self) -> ChannelSet {
        self.slots.iter().fold(ChannelSet::NONE, |all, (_, channels)| all.union(*channels))
    }
}

/// A channel that a node reads from a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TakenChannel {
    /// The port of the material.
    pub port: &'static str,
    /// The parameter that names the channel.
    pub field: &'static str,
    /// The channel.
    pub channel: Channel,
}
