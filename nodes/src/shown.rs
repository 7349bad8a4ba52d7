//! Cuts through solids and through materials of solids.
use crate::normals::{blended, normals};
use shibo_kernel::surface::combine_normals::NormalBlend;
use shibo_node::{Context, SolidOrMaterial};
use shibo_value::{Channel, ChannelSet, Cut, Field, Material, Solid, SolidMaterial, Type, Value};

/// Cuts a solid or a material of solids: gives a field of a solid, or a material with the channels of a material of solids, which are cut in
/// their order. If the material has a height, the cut gets the normal of its height; a normal of the material's own lies over it as detail.
pub(crate) fn shown(
    solid: &SolidOrMaterial,
    mut cut: impl FnMut(&Solid) -> Field,
    normals: impl Fn(&Field) -> Field,
) -> Value {
    match solid {
        SolidOrMaterial::Solid(solid) => cut(solid).into(),
        SolidOrMaterial::Material(material) => shown_material(material, cut, normals).into(),
    }
}

/// The material on the canvas that a cut through a material of solids shows, with the normal of its height.
pub fn cut_material(material: &SolidMaterial, cut: &Cut) -> Material {
    shown_material(material, |solid| solid.cut(cut), normals)
}

fn shown_material(
    material: &SolidMaterial,
    mut cut: impl FnMut(&Solid) -> Field,
    normals: impl Fn(&Field) -> Field,
) -> Material {
    let channels = material.channels().iter().map(|(channel, solid)| (*channel, cut(solid)));
    with_normals(channels.collect(), normals)
}

/// Cuts a solid or a material of solids for a flat canvas.
pub(crate) fn shown_by(cx: &Context<'_>, solid: &SolidOrMaterial, cut: &Cut) -> Value {
    shown(solid, |solid| cx.cut(solid, cut), normals)
}

/// A material of these channels, with the normal of its height below its own.
pub(crate) fn with_normals(channels: Vec<(Channel, Field)>, normals: impl Fn(&Field) -> Field) -> Material {
    let material = Material::new(channels);
    let Some(height) = material.get(Channel::Height) else { return material };
    let of_height = normals(height);
    let normal = match material.get(Channel::Normal) {
        Some(own) => blended(NormalBlend::default(), [of_height, own.clone(), Field::constant(Type::Gray, &[1.0])]),
        None => of_height,
    };
    Material::new([(Channel::Normal, normal)].into_iter().chain(material.channels().iter().cloned()))
}

/// The channels of a cut through a material of solids with these channels.
pub(crate) fn shown_channels(channels: ChannelSet) -> ChannelSet {
    if channels.has(Channel::Height) { channels.union([Channel::Normal].into_iter().collect()) } else { channels }
}
