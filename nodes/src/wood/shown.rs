//! Cuts through solids and through materials of solids.
use crate::normals::normals;
use shibo_node::{Context, SolidOrMaterial};
use shibo_value::{Channel, ChannelSet, Cut, Field, Material, Solid, Value};

/// What a cut shows: a field of a solid, or a material with the channels of a material of solids. If the material has a
/// height but no normal, the cut gets the normal of its height.
pub(crate) fn shown(
    solid: &SolidOrMaterial,
    cut: impl Fn(&Solid) -> Field,
    normals: impl Fn(&Field) -> Field,
) -> Value {
    match solid {
        SolidOrMaterial::Solid(solid) => cut(solid).into(),
        SolidOrMaterial::Material(material) => {
            let channels = material.channels().iter().map(|(channel, solid)| (*channel, cut(solid)));
            with_normals(channels.collect(), normals).into()
        }
    }
}

/// What a cut on a flat canvas shows.
pub(crate) fn shown_by(cx: &Context<'_>, solid: &SolidOrMaterial, cut: &Cut) -> Value {
    shown(solid, |solid| cx.cut(solid, cut), normals)
}

/// A material of these channels, with the normal of its height if it has none of its own.
pub(crate) fn with_normals(mut channels: Vec<(Channel, Field)>, normals: impl Fn(&Field) -> Field) -> Material {
    let has = |wanted: Channel| channels.iter().find(|(channel, _)| *channel == wanted);
    if let (None, Some((_, height))) = (has(Channel::Normal), has(Channel::Height)) {
        let normal = normals(height);
        channels.push((Channel::Normal, normal));
    }
    Material::new(channels)
}

/// The channels of a cut through a material of solids with these channels.
pub(crate) fn shown_channels(channels: ChannelSet) -> ChannelSet {
    if channels.has(Channel::Height) { channels.union([Channel::Normal].into_iter().collect()) } else { channels }
}
