//! One material over another, channel by channel: the shared code of [`BlendMaterials`](super::BlendMaterials) and
//! [`LayerMaterials`](super::LayerMaterials).
//!
//! The weight is a field of its own that all channels read. A window in which the weight is 0 or 1 everywhere reads
//! only the side that shows (see [`Masked`]).
use crate::masked::{Masked, Mix, SideTiles};
use crate::normals::normals;
use shibo_kernel::ground::math::saturate;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::ground::tile;
use shibo_kernel::surface::layers::{self as kernel, ByHeight, Grain, HeightMode, Planes};
use shibo_node::{Context, choice};
use shibo_value::{
    Channel, ChannelSet, Cost, Field, FieldSource, Given, Grid, Material, Read, Stop, Tile, Tiling, Type, Window,
};

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

    /// The weight of the top layer, as a field that all channels share.
    pub(super) fn weight(&self, mask: Option<Field>, opacity: &Field, base: &Material, top: &Material) -> Field {
        let opaque = opacity.as_constant().map(|value| saturate(value.first().copied().unwrap_or(1.0)));
        let heights = (self.by == BlendBy::Height).then(|| {
            let by =
                ByHeight { contrast: narrow(self.contrast), offset: narrow(self.offset), range: narrow(self.range) };
            (by, [base.or_default(Channel::Height), top.or_default(Channel::Height)])
        });
        let unmasked = if heights.is_some() { 0.5 } else { 1.0 };
        let mask = mask.unwrap_or_else(|| Field::constant(Type::Gray, &[unmasked]));
        if let (None, Some(mask), Some(opacity)) = (&heights, mask.as_constant(), opaque) {
            return Field::constant(Type::Gray, &[saturate(mask.first().copied().unwrap_or(unmasked)) * opacity]);
        }
        let opacity = match opaque {
            Some(value) => Opacity::Number(value),
            None => Opacity::Field(opacity.clone()),
        };
        Weight { mask, opacity, heights }.field()
    }

    /// `top` over `base` where `weight` is 1.
    pub(super) fn blend(
        &self,
        cx: &Context<'_>,
        name: &str,
        base: &Material,
        top: &Material,
        weight: &Field,
    ) -> Material {
        let given = |channel| base.get(channel).is_some() || top.get(channel).is_some();
        let masked = |channel: Channel, covers: Option<f32>, beside: &[Channel], mix: Mix| {
            let of =
                |material: &Material| [&[channel], beside].concat().iter().map(|c| material.or_default(*c)).collect();
            Masked { weight: weight.clone(), base: of(base), top: of(top), covering: covers, mix }.field(channel.ty())
        };
        let offset = narrow(self.offset);
        let height = given(Channel::Height).then(|| {
            let how = self.height;
            let covers = (how == HeightMode::Replace).then_some(offset);
            let mix: Mix = Box::new(move |out, weight, base, top| {
                kernel::mix_heights(how, offset, weight, base[0].plane(0), top[0].plane(0), out.data_mut());
            });
            cx.shared_field(&format!("{name} height"), masked(Channel::Height, covers, &[], mix))
        });
        let adds = height.is_some() && self.height == HeightMode::Add;
        let channel = |channel: Channel| match channel {
            Channel::Height => height.clone(),
            Channel::Normal => match &height {
                Some(height) if self.normals == BlendNormals::FromHeight => Some(normals(height)),
                _ if !given(channel) => None,
                _ if self.normals == BlendNormals::Detail => {
                    Some(masked(channel, None, &[], normal(kernel::detail_normals)))
                }
                _ => Some(masked(channel, Some(0.0), &[], normal(kernel::mix_normals))),
            },
            _ if !given(channel) => None,
            Channel::CoatNormal => Some(masked(channel, Some(0.0), &[], normal(kernel::mix_normals))),
            Channel::Ao if adds => Some(masked(channel, None, &[], Box::new(occlusion))),
            Channel::Anisotropy => Some(masked(channel, Some(0.0), &[Channel::AnisotropyAngle], Box::new(strength))),
            Channel::AnisotropyAngle => Some(masked(channel, Some(0.0), &[Channel::Anisotropy], Box::new(angle))),
            _ => Some(masked(channel, Some(0.0), &[], Box::new(values))),
        };
        Material::new(Channel::ALL.iter().filter_map(|c| Some((*c, channel(*c)?))))
    }
}

fn normal(mix: fn(&[f32], Planes<'_>, Planes<'_>, [&mut [f32]; 3])) -> Mix {
    Box::new(move |out, weight, base, top| {
        let (base, top) = ([0, 1, 2].map(|k| base[0].plane(k)), [0, 1, 2].map(|k| top[0].plane(k)));
        mix(weight, base, top, tile::planes3(out));
    })
}

fn values(out: &mut Tile, weight: &[f32], base: SideTiles<'_>, top: SideTiles<'_>) {
    for (k, plane) in out.planes_mut().into_iter().enumerate() {
        kernel::mix_values(weight, base[0].plane(k), top[0].plane(k), plane);
    }
}

fn occlusion(out: &mut Tile, weight: &[f32], base: SideTiles<'_>, top: SideTiles<'_>) {
    kernel::multiply(weight, base[0].plane(0), top[0].plane(0), out.data_mut());
}

fn strength(out: &mut Tile, weight: &[f32], base: SideTiles<'_>, top: SideTiles<'_>) {
    let base = Grain { strength: base[0].plane(0), angle: base[1].plane(0) };
    let top = Grain { strength: top[0].plane(0), angle: top[1].plane(0) };
    kernel::mix_grain(false, weight, base, top, out.data_mut());
}

fn angle(out: &mut Tile, weight: &[f32], base: SideTiles<'_>, top: SideTiles<'_>) {
    let base = Grain { angle: base[0].plane(0), strength: base[1].plane(0) };
    let top = Grain { angle: top[0].plane(0), strength: top[1].plane(0) };
    kernel::mix_grain(true, weight, base, top, out.data_mut());
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
