//! Materials: named channels of a surface, on the canvas or in space.
//!
//! The channels of a material are known without evaluating it ([`ChannelSet`], which every node derives from its
//! inputs). A missing channel has the value [`Channel::default_values`] everywhere.
use super::{Field, Solid, Type};
use serde::{Deserialize, Serialize};

macro_rules! channels {
    ($($(#[$doc:meta])* $name:ident $text:literal $ty:ident $default:expr,)*) => {
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

            /// Type of its field.
            pub const fn ty(self) -> Type {
                match self { $(Channel::$name => Type::$ty,)* }
            }

            /// Its value in a material that lacks it.
            pub const fn default_values(self) -> &'static [f32] {
                match self { $(Channel::$name => &$default,)* }
            }
        }
    };
}

channels! {
    /// Diffuse or metal colour, scene-linear; default 0.5, middle grey.
    BaseColor "base_color" Rgb [0.5; 3],
    /// Roughness, 0 (mirror) to 1; default 0.5.
    Roughness "roughness" Gray [0.5],
    /// 0 for dielectrics, 1 for metals; default 0.
    Metallic "metallic" Gray [0.0],
    /// Tangent-space normal, ½ + ½n; default straight up, (0.5, 0.5, 1).
    Normal "normal" Normal [0.5, 0.5, 1.0],
    /// Height in mm; default 0.
    Height "height" Gray [0.0],
    /// Ambient occlusion, 0 (closed) to 1 (open); default 1.
    Ao "ao" Gray [1.0],
    /// Opacity, 0..1; default 1.
    Opacity "opacity" Gray [1.0],
    /// Sheen, 0..1; default 0.
    Sheen "sheen" Gray [0.0],
    /// Clear coat, 0..1; default 0.
    Coat "coat" Gray [0.0],
    /// Anisotropy, 0..1; default 0.
    Anisotropy "anisotropy" Gray [0.0],
    /// Direction of brush lines or fibres in degrees, from +x towards +y on the canvas; highlights are wide across it.
    /// Default 0.
    AnisotropyAngle "anisotropy_angle" Gray [0.0],
    /// Roughness of the clear coat, 0..1; default 0.
    CoatRoughness "coat_roughness" Gray [0.0],
    /// Normal of the clear coat, which can be flat over a rough base; default straight up, (0.5, 0.5, 1).
    CoatNormal "coat_normal" Normal [0.5, 0.5, 1.0],
    /// Light that the surface emits, scene-linear; default black.
    Emission "emission" Rgb [0.0; 3],
    /// Index of refraction; default 1.5.
    Ior "ior" Gray [1.5],
    /// Strength of the reflections of a dielectric, 0..1; default 1.
    Specular "specular" Gray [1.0],
    /// Amount of subsurface scattering, 0..1; default 0.
    Subsurface "subsurface" Gray [0.0],
}

impl Channel {
    /// The channel with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|c| c.name() == name)
    }

    /// Type of its solid, in a material in space.
    pub const fn solid_type(self) -> Type {
        self.ty().in_space()
    }

    /// [`default_values`](Self::default_values) as a field.
    pub fn default_field(self) -> Field {
        Field::constant(self.ty(), self.default_values())
    }

    /// [`default_values`](Self::default_values) as text: `0.5`, or `(0.5, 0.5, 1)`.
    pub fn default_text(self) -> String {
        match self.default_values() {
            [one] => one.to_string(),
            several => format!("({})", several.iter().map(f32::to_string).collect::<Vec<_>>().join(", ")),
        }
    }
}

/// A set of channels, such as those of a material before its evaluation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ChannelSet(u32);

impl ChannelSet {
    /// No channel.
    pub const NONE: Self = Self(0);

    /// Every channel.
    pub const ALL: Self = Self((1 << Channel::ALL.len()) - 1);

    /// True if a channel is in the set.
    pub const fn has(self, channel: Channel) -> bool {
        self.0 & (1 << channel as u32) != 0
    }

    /// The channels in either set.
    #[must_use]
    pub const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// The channels that are not in another set.
    #[must_use]
    pub const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// The channels, in the order of [`Channel::ALL`].
    pub fn iter(self) -> impl Iterator<Item = Channel> {
        Channel::ALL.iter().copied().filter(move |channel| self.has(*channel))
    }
}

impl FromIterator<Channel> for ChannelSet {
    fn from_iter<I: IntoIterator<Item = Channel>>(channels: I) -> Self {
        Self(channels.into_iter().fold(0, |set, channel| set | (1 << channel as u32)))
    }
}

/// A value of a channel: a field, or a solid.
pub trait ChannelValue: Clone {
    /// The value of a channel that a material lacks.
    fn default_of(channel: Channel) -> Self;
}

impl ChannelValue for Field {
    fn default_of(channel: Channel) -> Self {
        channel.default_field()
    }
}

impl ChannelValue for Solid {
    fn default_of(channel: Channel) -> Self {
        Self::constant(channel.solid_type(), channel.default_values())
    }
}

/// The channels that a material has, in the order of [`Channel::ALL`].
#[derive(Clone, Debug)]
pub struct Channels<T> {
    channels: Vec<(Channel, T)>,
}

/// A material on the canvas: its channels are fields.
pub type Material = Channels<Field>;

/// A material in space: its channels are solids. A cut through it is a [`Material`].
pub type SolidMaterial = Channels<Solid>;

impl<T> Default for Channels<T> {
    fn default() -> Self {
        Self { channels: Vec::new() }
    }
}

impl<T: ChannelValue> Channels<T> {
    /// A material of these channels. If a channel is given twice, the first value is kept.
    pub fn new(channels: impl IntoIterator<Item = (Channel, T)>) -> Self {
        let mut channels: Vec<_> = channels.into_iter().collect();
        channels.sort_by_key(|c| c.0);
        channels.dedup_by_key(|c| c.0);
        Self { channels }
    }

    /// The channels.
    pub fn channels(&self) -> &[(Channel, T)] {
        &self.channels
    }

    /// The value of a channel, if the material has it.
    pub fn get(&self, channel: Channel) -> Option<&T> {
        self.channels.iter().find(|c| c.0 == channel).map(|c| &c.1)
    }

    /// The value of a channel, or its default.
    pub fn or_default(&self, channel: Channel) -> T {
        self.get(channel).cloned().unwrap_or_else(|| T::default_of(channel))
    }
}

impl Material {
    /// The same material in space, if all channels are constant; else the first channel that is not.
    ///
    /// # Errors
    /// A channel that is not constant.
    pub fn in_space(&self) -> Result<SolidMaterial, Channel> {
        let solid = |(channel, field): &(Channel, Field)| {
            let values = field.as_constant().ok_or(*channel)?;
            Ok((*channel, Solid::constant(channel.solid_type(), values)))
        };
        self.channels.iter().map(solid).collect::<Result<Vec<_>, _>>().map(SolidMaterial::new)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_channel_has_a_default_of_its_type() {
        for channel in Channel::ALL {
            assert_eq!(channel.default_values().len(), channel.ty().channels(), "{}", channel.name());
            assert_eq!(Material::default().or_default(*channel).as_constant(), Some(channel.default_values()));
        }
        assert_eq!(Channel::Normal.default_text(), "(0.5, 0.5, 1)");
        assert_eq!(Channel::Ao.default_text(), "1");
    }

    #[test]
    fn constant_materials_exist_in_space() {
        let constant = Material::new([(Channel::Roughness, Field::constant(Type::Gray, &[0.25]))]);
        let solid = constant.in_space().unwrap();
        let at = |channel| solid.or_default(channel).at(&[glam::DVec3::ONE]);
        assert_eq!((at(Channel::Roughness), at(Channel::Coat)), (vec![0.25], vec![0.0]));
        assert_eq!(at(Channel::Normal), [0.5, 0.5, 1.0]);
        for channel in Channel::ALL {
            assert_eq!(solid.or_default(*channel).ty(), channel.solid_type());
        }
        let field = Field::generate(Type::Gray, crate::Tiling::BOTH, |_, _| Ok(()));
        assert_eq!(Material::new([(Channel::Height, field)]).in_space().unwrap_err(), Channel::Height);
    }

    #[test]
    fn channel_sets_hold_their_channels() {
        let set: ChannelSet = [Channel::Ao, Channel::BaseColor].into_iter().collect();
        assert_eq!(set.iter().collect::<Vec<_>>(), [Channel::BaseColor, Channel::Ao]);
        assert!(set.has(Channel::Ao) && !set.has(Channel::Height));
        assert_eq!(ChannelSet::ALL.iter().collect::<Vec<_>>(), Channel::ALL);
        assert_eq!(set.union(ChannelSet::NONE), set);
    }
}
