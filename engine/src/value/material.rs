//! Materials: named channels of a surface.
use super::{Field, Type};
use serde::{Deserialize, Serialize};

macro_rules! channels {
    ($($(#[$doc:meta])* $name:ident $text:literal $ty:ident,)*) => {
        /// A channel of a material.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, schemars::JsonSchema)]
        pub enum Channel { $($(#[$doc])* $name,)* }

        impl Channel {
            /// All channels, in the order in which they are written.
            pub const ALL: &'static [Channel] = &[$(Channel::$name,)*];

            /// The name in file names and references.
            pub const fn name(self) -> &'static str {
                match self { $(Channel::$name => $text,)* }
            }

            /// What it carries.
            pub const fn ty(self) -> Type {
                match self { $(Channel::$name => Type::$ty,)* }
            }
        }
    };
}

channels! {
    /// Diffuse or metal colour, scene-linear.
    BaseColor "base_color" Rgb,
    /// Roughness, 0 (mirror) to 1.
    Roughness "roughness" Gray,
    /// 0 for dielectrics, 1 for metals.
    Metallic "metallic" Gray,
    /// Tangent-space normal.
    Normal "normal" Normal,
    /// Height in mm.
    Height "height" Gray,
    /// Ambient occlusion: 1 is open, 0 is shut.
    Ao "ao" Gray,
    /// Opacity, 0..1.
    Opacity "opacity" Gray,
    /// Sheen, 0..1.
    Sheen "sheen" Gray,
    /// Clear coat, 0..1.
    Coat "coat" Gray,
    /// Anisotropy, 0..1.
    Anisotropy "anisotropy" Gray,
    /// Angle of the anisotropy in degrees.
    AnisotropyAngle "anisotropy_angle" Gray,
}

impl Channel {
    /// The channel of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|c| c.name() == name)
    }
}

/// The channels of a surface that are given, in the order of [`Channel::ALL`].
#[derive(Clone, Debug, Default)]
pub struct Material {
    channels: Vec<(Channel, Field)>,
}

impl Material {
    /// A material of these channels.
    pub fn new(channels: impl IntoIterator<Item = (Channel, Field)>) -> Self {
        let mut channels: Vec<_> = channels.into_iter().collect();
        channels.sort_by_key(|c| c.0);
        channels.dedup_by_key(|c| c.0);
        Self { channels }
    }

    /// The channels.
    pub fn channels(&self) -> &[(Channel, Field)] {
        &self.channels
    }

    /// One channel, if it is given.
    pub fn get(&self, channel: Channel) -> Option<&Field> {
        self.channels.iter().find(|c| c.0 == channel).map(|c| &c.1)
    }
}
