//! What [`EdgeWear`](super::EdgeWear) and [`Dirt`](super::Dirt) have in common: a material that shows where another stands
//! out of its surroundings, or lies below them.
use super::layers::{BlendBy, BlendNormals, Over};
use shibo_engine::node::Context;
use shibo_engine::value::{Channel, Field, Halo, Material, Tile, Type};
use shibo_kernel::filter::fields::blurred;
use shibo_kernel::surface::layers::HeightMode;
use shibo_kernel::surface::wear::WearSpec;

/// A weight from the difference between a height and its surroundings.
pub(super) struct Worn {
    pub(super) height: Field,
    /// Standard deviation of the Gaussian that gives the surroundings, mm.
    pub(super) radius: f64,
    pub(super) noise: Option<Field>,
    pub(super) mask: Option<Field>,
    pub(super) spec: WearSpec,
}

impl Worn {
    /// The weight, to be shared by all channels.
    pub(super) fn weight(self, cx: &Context<'_>) -> Field {
        if self.height.as_constant().is_some() {
            return Field::constant(Type::Gray, &[0.0]);
        }
        let around = cx.shared_field("around", blurred(&self.height, self.radius, cx.size_mm()));
        let spec = self.spec;
        let worn = match self.noise {
            None => {
                Field::map(Type::Gray, [self.height, around], Halo::NONE, move |out: &mut Tile, [height, around]| {
                    spec.weights(height.plane(0), around.plane(0), None, out.data_mut());
                    Ok(())
                })
            }
            Some(noise) => {
                let inputs = [self.height, around, noise];
                Field::map(Type::Gray, inputs, Halo::NONE, move |out: &mut Tile, [height, around, noise]| {
                    spec.weights(height.plane(0), around.plane(0), Some(noise.plane(0)), out.data_mut());
                    Ok(())
                })
            }
        };
        match self.mask {
            None => worn,
            Some(mask) => Field::map(Type::Gray, [worn, mask], Halo::NONE, |out: &mut Tile, [worn, mask]| {
                for (out, (worn, mask)) in out.data_mut().iter_mut().zip(worn.data().iter().zip(mask.data())) {
                    *out = worn * mask.clamp(0.0, 1.0);
                }
                Ok(())
            }),
        }
    }
}

/// `top` over `base`, whose height and normal stay.
pub(super) fn cover(cx: &Context<'_>, base: &Material, top: &Material, weight: &Field) -> Material {
    let over = Over {
        by: BlendBy::Mask,
        contrast: 0.0,
        offset: 0.0,
        range: 0.0,
        height: HeightMode::Replace,
        normals: BlendNormals::Mix,
    };
    let form = |channel: &Channel| matches!(channel, Channel::Height | Channel::Normal);
    let flat =
        |material: &Material| Material::new(material.channels().iter().filter(|(channel, _)| !form(channel)).cloned());
    let blend = over.blend(cx, "cover", &flat(base), &flat(top), weight);
    let kept = base.channels().iter().filter(|(channel, _)| form(channel));
    Material::new(blend.channels().iter().chain(kept).cloned())
}

/// The height to look at: the one that is connected, or that of the material.
pub(super) fn height(given: Option<Field>, material: &Material) -> Field {
    given.unwrap_or_else(|| material.or_default(Channel::Height))
}
