//! One material over another, channel by channel: the shared code of [`BlendMaterials`](super::BlendMaterials) and
//! [`LayerMaterials`](super::LayerMaterials).
//!
//! The weight is a field of its own that all channels read. A window in which the weight is 0 or 1 everywhere reads
//! only the side that shows (see [`Masked`]).
use crate::anywhere::{field, is_solid, solid, solids};
use crate::masked::{Masked, Mix, Side, mixed_solids};
use crate::normals::normals;
use shibo_kernel::ground::math::saturate;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::surface::layers::{self as kernel, ByHeight, Grain, HeightMode};
use shibo_kernel::wood::solids::Code;
use shibo_node::{Anywhere, Context, MaterialAnywhere, choice};
use shibo_value::{
    Channel, ChannelSet, ChannelValue, Channels, Cost, Field, FieldSource, Given, Grid, Material, Read, Solid,
    SolidMaterial, Stop, Tile, Tiling, Type, Window,
};
use std::sync::Arc;

/// How to decide which layer shows.
#[choice]
pub enum BlendBy {
    /// The mask alone.
    #[default]
    Mask,
    /// The heights: the higher layer shows, and the mask lifts or lowers the top one. Where the mask is 0 the base
    /// shows and where it is 1 the top layer; ½, the default, leaves the choice to the heights.
    Height,
}

/// Source of the normals of a blend.
#[choice]
pub enum BlendNormals {
    /// From the blended height, steps between the layers included. The same as `Mix` if neither layer has a height.
    #[default]
    FromHeight,
    /// The slopes of both are mixed by the weight; steps between the layers do not show.
    Mix,
    /// The normal of the top layer is tilted by that of the base: detail over a form.
    Detail,
}

/// Parameters for laying one material over another.
pub(super) struct Over {
    pub(super) by: BlendBy,
    /// mm.
    pub(super) contrast: f64,
    /// mm.
    pub(super) offset: f64,
    /// mm.
    pub(super) range: f64,
    pub(super) height: HeightMode,
    pub(super) normals: BlendNormals,
}

impl Over {
    /// The channels of the blend.
    pub(super) fn channels(&self, base: ChannelSet, top: ChannelSet) -> ChannelSet {
        let both = base.union(top);
        let normal = self.normals == BlendNormals::FromHeight && both.has(Channel::Height);
        if normal { both.union([Channel::Normal].into_iter().collect()) } else { both }
    }

    /// `top` over `base` where `weight` is 1.
    pub(super) fn blend<T: Layered>(
        &self,
        cx: &Context<'_>,
        name: &str,
        [base, top]: [&Channels<T>; 2],
        weight: &T,
    ) -> Channels<T> {
        let given = |channel| base.get(channel).is_some() || top.get(channel).is_some();
        let masked = |channel: Channel, covering: Option<f32>, beside: &[Channel], mix: Mix| {
            let of = |side: &Channels<T>| [&[channel], beside].concat().iter().map(|c| side.or_default(*c)).collect();
            T::mixed(channel, weight, [of(base), of(top)], covering, mix)
        };
        let offset = narrow(self.offset);
        let height = given(Channel::Height).then(|| {
            let how = self.height;
            let covers = (how == HeightMode::Replace).then_some(offset);
            let mix: Mix = Box::new(move |out, weight, base, top| {
                kernel::mix_heights(how, offset, weight, base[0].plane(0), top[0].plane(0), &mut *out[0]);
            });
            masked(Channel::Height, covers, &[], mix).shared(cx, &format!("{name} height"))
        });
        let adds = height.is_some() && self.height == HeightMode::Add;
        let made = height.as_ref().filter(|_| self.normals == BlendNormals::FromHeight).and_then(T::normals_of);
        let channel = |channel: Channel| match channel {
            Channel::Height => height.clone(),
            Channel::Normal if made.is_some() => made.clone(),
            _ if !given(channel) => None,
            Channel::Normal if self.normals == BlendNormals::Detail => {
                Some(masked(channel, None, &[], normal(kernel::detail_normals)))
            }
            Channel::Normal | Channel::CoatNormal => Some(masked(channel, Some(0.0), &[], normal(kernel::mix_normals))),
            Channel::Ao if adds => Some(masked(channel, None, &[], Box::new(occlusion))),
            Channel::Anisotropy => Some(masked(channel, Some(0.0), &[Channel::AnisotropyAngle], Box::new(strength))),
            Channel::AnisotropyAngle => Some(masked(channel, Some(0.0), &[Channel::Anisotropy], Box::new(angle))),
            _ => Some(masked(channel, Some(0.0), &[], Box::new(values))),
        };
        Channels::new(Channel::ALL.iter().filter_map(|c| Some((*c, channel(*c)?))))
    }

    fn by_height(&self) -> ByHeight {
        ByHeight { contrast: narrow(self.contrast), offset: narrow(self.offset), range: narrow(self.range) }
    }

    /// The mask of a layer without one.
    fn unmasked(&self) -> f32 {
        if self.by == BlendBy::Height { 0.5 } else { 1.0 }
    }
}

/// Values that layers are made of: fields or solids.
pub(super) trait Layered: ChannelValue {
    /// The weight of the top layer, which all channels share.
    fn weight(over: &Over, mask: Option<Self>, opacity: &Self, sides: [&Channels<Self>; 2]) -> Self;
    /// A channel of the base and the top, mixed by the weight; see [`Masked`].
    fn mixed(channel: Channel, weight: &Self, sides: [Vec<Self>; 2], covering: Option<f32>, mix: Mix) -> Self;
    /// The normals of a height; a height in space has none.
    fn normals_of(height: &Self) -> Option<Self>;
    /// Gives it a key, since several outputs share it.
    fn shared(self, cx: &Context<'_>, name: &str) -> Self;
}

impl Layered for Field {
    fn weight(over: &Over, mask: Option<Self>, opacity: &Self, [base, top]: [&Material; 2]) -> Self {
        let opaque = opacity.as_constant().map(|value| saturate(value.first().copied().unwrap_or(1.0)));
        let heights = (over.by == BlendBy::Height)
            .then(|| (over.by_height(), [base.or_default(Channel::Height), top.or_default(Channel::Height)]));
        let mask = mask.unwrap_or_else(|| Self::constant(Type::Gray, &[over.unmasked()]));
        if let (Some(&[mask]), Some(opacity)) = (mask.as_constant(), opaque) {
            let levels = |heights: &[Self; 2]| match heights.each_ref().map(Self::as_constant) {
                [Some(base), Some(top)] => Some([base.to_vec(), top.to_vec()]),
                _ => None,
            };
            let constant = |weight: f32| Self::constant(Type::Gray, &[weight * opacity]);
            match &heights {
                None => return constant(saturate(mask)),
                Some((by, heights)) => {
                    if let Some([base, top]) = levels(heights) {
                        let mut weight = [0.0];
                        by.weights(&[mask], &base, &top, &mut weight);
                        return constant(weight[0]);
                    }
                }
            }
        }
        let opacity = match opaque {
            Some(value) => Opacity::Number(value),
            None => Opacity::Field(opacity.clone()),
        };
        Weight { mask, opacity, heights }.field()
    }

    fn mixed(channel: Channel, weight: &Self, [base, top]: [Vec<Self>; 2], covering: Option<f32>, mix: Mix) -> Self {
        Masked { weight: weight.clone(), base, top, covering, mix }.field(channel.ty())
    }

    fn normals_of(height: &Self) -> Option<Self> {
        Some(normals(height))
    }

    fn shared(self, cx: &Context<'_>, name: &str) -> Self {
        cx.shared_field(name, self)
    }
}

impl Layered for Solid {
    fn weight(over: &Over, mask: Option<Self>, opacity: &Self, sides: [&SolidMaterial; 2]) -> Self {
        let heights = (over.by == BlendBy::Height).then(|| over.by_height());
        let mut inputs = vec![mask.unwrap_or_else(|| Self::constant(Type::Solid, &[over.unmasked()])), opacity.clone()];
        if heights.is_some() {
            inputs.extend(sides.map(|side| side.or_default(Channel::Height)));
        }
        let code = Code::of_inputs(move |_, inputs, out| {
            let (mask, out) = (inputs[0].plane(0), &mut *out[0]);
            match &heights {
                Some(by) => by.weights(mask, inputs[2].plane(0), inputs[3].plane(0), out),
                None => out.iter_mut().zip(mask).for_each(|(out, mask)| *out = saturate(*mask)),
            }
            out.iter_mut().zip(inputs[1].plane(0)).for_each(|(out, opacity)| *out *= saturate(*opacity));
        });
        code.solid(Type::Solid, inputs)
    }

    fn mixed(channel: Channel, weight: &Self, [base, top]: [Vec<Self>; 2], _: Option<f32>, mix: Mix) -> Self {
        mixed_solids(channel.solid_type(), weight, base, top, mix)
    }

    fn normals_of(_height: &Self) -> Option<Self> {
        None
    }

    fn shared(self, cx: &Context<'_>, name: &str) -> Self {
        cx.shared(name, self)
    }
}

/// The layer `top` over `base`, and its weight. All values are on the canvas, or all in space. `ports` are the names of
/// the base, the top, the mask and the opacity, for errors.
pub(super) fn layered(
    cx: &Context<'_>,
    over: &Over,
    [name, weight_name]: [&str; 2],
    [base, top]: [MaterialAnywhere; 2],
    [mask, opacity]: [Option<Anywhere>; 2],
    ports: &[String; 4],
) -> Result<(MaterialAnywhere, Anywhere), Stop> {
    let opacity = opacity.unwrap_or_else(|| Anywhere::Field(Field::constant(Type::Gray, &[1.0])));
    if let (MaterialAnywhere::Canvas(base), MaterialAnywhere::Canvas(top)) = (&base, &top)
        && !mask.iter().chain([&opacity]).any(is_solid)
    {
        let mask = mask.map(|mask| field(mask, &ports[2])).transpose()?;
        let weight = Field::weight(over, mask, &field(opacity, &ports[3])?, [base, top]).shared(cx, weight_name);
        let blend = over.blend(cx, name, [base, top], &weight);
        return Ok((MaterialAnywhere::Canvas(Arc::new(blend)), Anywhere::Field(weight)));
    }
    let (base, top) = (solids(&base, &ports[0])?, solids(&top, &ports[1])?);
    let mask = mask.map(|mask| solid(mask, Type::Solid, &ports[2])).transpose()?;
    let opacity = solid(opacity, Type::Solid, &ports[3])?;
    let weight = Solid::weight(over, mask, &opacity, [&base, &top]).shared(cx, weight_name);
    let blend = over.blend(cx, name, [&*base, &*top], &weight);
    Ok((MaterialAnywhere::Space(Arc::new(blend)), Anywhere::Solid(weight)))
}

fn normal(mix: fn(&[f32], kernel::Planes<'_>, kernel::Planes<'_>, [&mut [f32]; 3])) -> Mix {
    Box::new(move |out, weight, base, top| {
        let (base, top) = ([0, 1, 2].map(|k| base[0].plane(k)), [0, 1, 2].map(|k| top[0].plane(k)));
        if let [x, y, z] = out {
            mix(weight, base, top, [&mut **x, &mut **y, &mut **z]);
        }
    })
}

fn values(out: &mut [&mut [f32]], weight: &[f32], base: Side<'_>, top: Side<'_>) {
    for (k, plane) in out.iter_mut().enumerate() {
        kernel::mix_values(weight, base[0].plane(k), top[0].plane(k), plane);
    }
}

fn occlusion(out: &mut [&mut [f32]], weight: &[f32], base: Side<'_>, top: Side<'_>) {
    kernel::multiply(weight, base[0].plane(0), top[0].plane(0), &mut *out[0]);
}

fn strength(out: &mut [&mut [f32]], weight: &[f32], base: Side<'_>, top: Side<'_>) {
    let base = Grain { strength: base[0].plane(0), angle: base[1].plane(0) };
    let top = Grain { strength: top[0].plane(0), angle: top[1].plane(0) };
    kernel::mix_grain(false, weight, base, top, &mut *out[0]);
}

fn angle(out: &mut [&mut [f32]], weight: &[f32], base: Side<'_>, top: Side<'_>) {
    let base = Grain { angle: base[0].plane(0), strength: base[1].plane(0) };
    let top = Grain { angle: top[0].plane(0), strength: top[1].plane(0) };
    kernel::mix_grain(true, weight, base, top, &mut *out[0]);
}

enum Opacity {
    Number(f32),
    Field(Field),
}

/// The weight of the top layer. Heights and opacity are read only where the mask does not decide alone.
struct Weight {
    mask: Field,
    opacity: Opacity,
    heights: Option<(ByHeight, [Field; 2])>,
}

impl Weight {
    fn field(self) -> Field {
        let reads = self.reads().into_iter().chain([&self.mask]);
        let tiling = reads.fold(Tiling::BOTH, |tiling, field| tiling.and(field.tiling()));
        Field::new(Type::Gray, tiling, self)
    }

    /// Fields that are read besides the mask: the heights, then the opacity.
    fn reads(&self) -> Vec<&Field> {
        let heights = self.heights.iter().flat_map(|(_, heights)| heights);
        let opacity = match &self.opacity {
            Opacity::Number(_) => None,
            Opacity::Field(field) => Some(field),
        };
        heights.chain(opacity).collect()
    }
}

impl FieldSource for Weight {
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        vec![Read::new(&self.mask, grid, window)]
    }

    fn later(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        self.reads().into_iter().map(|field| Read::new(field, grid, window)).collect()
    }

    fn narrow(&self, given: &Given<'_>, _grid: &Grid, window: Window) -> Vec<Window> {
        let (low, high) = kernel::bounds(given.tile(0).data());
        let part = |wanted: bool| if wanted { window } else { Window { width: 0, height: 0, ..window } };
        let open = self.heights.iter().flat_map(|_| [part(low < 1.0 && high > 0.0); 2]);
        let opacity = self.reads().len() - 2 * usize::from(self.heights.is_some());
        open.chain((0..opacity).map(|_| part(high > 0.0))).collect()
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        let mask = given.tile(0).plane(0);
        let out = out.data_mut();
        let heights = usize::from(self.heights.is_some());
        match &self.heights {
            Some((by, _)) if !given.tile(1).window.is_empty() => {
                by.weights(mask, given.tile(1).plane(0), given.tile(2).plane(0), out);
            }
            _ => out.iter_mut().zip(mask).for_each(|(out, mask)| *out = saturate(*mask)),
        }
        match &self.opacity {
            Opacity::Number(value) => out.iter_mut().for_each(|out| *out *= value),
            Opacity::Field(_) => {
                let opacity = given.tile(1 + 2 * heights);
                if !opacity.window.is_empty() {
                    out.iter_mut().zip(opacity.plane(0)).for_each(|(out, opacity)| *out *= saturate(*opacity));
                }
            }
        }
        Ok(())
    }

    fn cost(&self) -> Cost {
        Cost::Pointwise
    }
}
