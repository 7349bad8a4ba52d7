//! Shared code of [`EdgeWear`](super::EdgeWear) and [`Dirt`](super::Dirt): a material that shows where another one
//! rises above its surroundings, or lies below them.
use super::layers::{BlendBy, BlendNormals, Over};
use crate::values::pairs;
use shibo_kernel::filter::fields::blurred;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::surface::layers::HeightMode;
use shibo_kernel::surface::wear::WearSpec;
use shibo_node::{Context, Gray, In, Outputs, TakenChannel};
use shibo_value::{Channel, ChannelSet, Field, Halo, Material, Stop, Tile, Type};

/// The parameters of both nodes.
pub(super) struct Wear<'a> {
    pub(super) height: &'a Option<In<Gray>>,
    pub(super) noise: &'a Option<In<Gray>>,
    pub(super) mask: &'a Option<In<Gray>>,
    /// Standard deviation of the Gaussian that defines the surroundings, mm.
    pub(super) radius: f64,
    pub(super) depth: f64,
    pub(super) amount: f64,
    pub(super) softness: f64,
    pub(super) breakup: f64,
}

impl Wear<'_> {
    /// The outputs: `top` over `material` where the height rises above (`sign` 1) or lies below (-1) its surroundings,
    /// and the weight.
    pub(super) fn outputs(
        &self,
        cx: &Context<'_>,
        material: &Material,
        top: &Material,
        sign: f32,
    ) -> Result<Outputs, Stop> {
        let worn = Worn {
            height: cx.get_opt(self.height)?.unwrap_or_else(|| material.or_default(Channel::Height)),
            radius: self.radius,
            noise: cx.get_opt(self.noise)?,
            mask: cx.get_opt(self.mask)?,
            spec: WearSpec {
                sign,
                depth: narrow(self.depth),
                amount: narrow(self.amount),
                softness: narrow(self.softness),
                breakup: narrow(self.breakup),
            },
        };
        let weight = cx.shared_field("weight", worn.weight(cx));
        Ok(Outputs::one(cover(cx, material, top, &weight)).with("weight", weight))
    }

    /// The channels that are read from the material.
    pub(super) fn takes(&self) -> Vec<TakenChannel> {
        let taken = TakenChannel { port: "material", field: "material", channel: Channel::Height };
        if self.height.is_none() { vec![taken] } else { Vec::new() }
    }
}

/// The channels of a material that is partly covered by another.
pub(super) fn channels(material: ChannelSet, top: ChannelSet) -> ChannelSet {
    material.union(top.iter().filter(|channel| !matches!(channel, Channel::Height | Channel::Normal)).collect())
}

/// A weight from the difference between a height and its surroundings.
struct Worn {
    height: Field,
    /// mm.
    radius: f64,
    noise: Option<Field>,
    mask: Option<Field>,
    spec: WearSpec,
}

impl Worn {
    /// The weight, shared by all channels.
    fn weight(self, cx: &Context<'_>) -> Field {
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
            Some(mask) => pairs([&worn, &mask], |worn, mask| worn * mask.clamp(0.0, 1.0)),
        }
    }
}

/// `top` over `base`; height and normal of `base` stay.
fn cover(cx: &Context<'_>, base: &Material, top: &Material, weight: &Field) -> Material {
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
    let blend = over.blend(cx, "cover", [&flat(base), &flat(top)], weight);
    let kept = base.channels().iter().filter(|(channel, _)| form(channel));
    Material::new(blend.channels().iter().chain(kept).cloned())
}
