//! [`Blend`]: one layer over another.
//!
//! Source of the modes: the compositing rules of the W3C and of picture editors; see
//! [`kernel::blend`](shibo_kernel::pointwise::blend). Unlike there, colours are blended scene-linear and results are
//! not clamped to 0..1. Cost: O(pixels), bound by memory; a layer that a mask hides in a whole tile is not computed
//! there.
use crate::anywhere::{field, is_constant, is_solid, pointwise, widest_type};
use crate::chosen::Chosen;
use crate::masked::{self, Masked, Mix};
use shibo_kernel::ground::math::saturate;
use shibo_kernel::ground::tile::{channel, widest};
use shibo_kernel::pointwise::blend::{self as kernel, BlendMode};
use shibo_node::{Anywhere, Context, EveryFieldOrSolid, Fact, In, Node, Number, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Field, Halo, Planes, Stop, Tile, Type};

/// Lays one field over another, everywhere or through a mask; or one solid over another, through a solid.
///
/// Vectors and matrices are blended component by component, and only with their own type. Numbers of pieces are never
/// mixed: those of the top layer show where `mask` times `opacity` is at least ½, and `mode` must be `Normal`.
///
/// ```ron
/// "clouds": Fractal(size: 14),
/// "land": GradientMap(input: "clouds", stops: [(0.3, "#2f4a2a"), (0.6, "#b9a06a"), (0.8, "#f4f0e6")]),
/// "sea": GradientMap(input: "clouds", stops: [(0.2, "#0d2b4a"), (0.5, "#3f8ea8")]),
/// "shore": Threshold(input: "clouds", level: 0.48, softness: 0.02),
/// "example": Blend(base: "sea", top: "land", mask: "shore"),
/// ```
///
/// Elsewhere: Substance Designer *Blend*; Blender *Mix Color*; Material Maker *Blend*; Photoshop *Layer*; Houdini
/// *Blend*.
#[node]
pub struct Blend {
    /// The layer below, a.
    pub base: In<EveryFieldOrSolid>,
    /// The layer above, b.
    pub top: In<EveryFieldOrSolid>,
    /// Where the top layer shows, 0..1; values are clamped to that range. Everywhere if not given.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    pub mask: Option<In<Number>>,
    /// Opacity of the top layer, 0..1; multiplied with the mask.
    #[schemars(extend("minimum" = 0.0, "maximum" = 1.0))]
    #[default(In::constant(1.0))]
    pub opacity: In<Number>,
    /// How the two layers are combined where the top layer shows.
    #[default(BlendMode::Normal)]
    pub mode: BlendMode,
}

/// Parameters that are the same for all pixels.
#[derive(Clone, Copy)]
struct Layers {
    mode: BlendMode,
    opacity: f32,
}

impl Layers {
    fn fill(self, out: &mut Tile, base: &Tile, top: &Tile, mask: Option<&[f32]>) {
        for (k, out) in out.planes_mut().into_iter().enumerate() {
            kernel::blend(self.mode, channel(base, k), channel(top, k), mask, self.opacity, out);
        }
    }

    /// `top` over `base` through a mask. A window in which only one of them shows computes only that one.
    fn masked(self, mask: Field, base: Field, top: Field, ty: Type) -> Field {
        let covering = (self.mode == BlendMode::Normal && self.opacity == 1.0).then_some(0.0);
        let mix: Mix = Box::new(move |out, mask, base, top| {
            for (k, out) in out.iter_mut().enumerate() {
                let (base, top) = (masked::plane(&base[0], k), masked::plane(&top[0], k));
                kernel::blend(self.mode, base, top, Some(mask), self.opacity, out);
            }
        });
        Masked { weight: mask, base: vec![base], top: vec![top], covering, mix }.field(ty)
    }
}

impl Blend {
    /// The blend of numbers of pieces.
    fn pieces(&self, [base, top]: [Field; 2], mask: Option<Field>, opacity: Field) -> Result<Field, Problem> {
        if self.mode != BlendMode::Normal {
            let message = "`base` and `top` are numbers of pieces, which are not computed with";
            return Err(Problem::new(Code::BadValue, message).at("mode").help("write `mode: Normal`"));
        }
        let shown = match mask {
            None => opacity,
            Some(mask) => {
                Field::map(Type::Gray, [mask, opacity], Halo::NONE, |out: &mut Tile, [mask, opacity]: [&Tile; 2]| {
                    kernel::both_masks(mask.plane(0), opacity.plane(0), out.data_mut());
                    Ok(())
                })
            }
        };
        Ok(Chosen::field(&shown, vec![base, top], |shown| usize::from(shown >= 0.5)))
    }

    /// The blend of solids, or of constants.
    fn by_place(
        &self,
        base: Anywhere,
        top: Anywhere,
        mask: Option<Anywhere>,
        opacity: Anywhere,
    ) -> Result<Anywhere, Stop> {
        let (mode, ty) = (self.mode, widest_type([base.ty(), top.ty()]));
        let mask = mask.unwrap_or_else(|| Anywhere::Field(Field::constant(Type::Gray, &[1.0])));
        let inputs = [(base, "base"), (top, "top"), (mask, "mask"), (opacity, "opacity")];
        let fill = move |out: &mut [&mut [f32]], [base, top, mask, opacity]: [Planes<'_>; 4]| {
            for (k, out) in out.iter_mut().enumerate() {
                let mut shown = vec![0.0; out.len()];
                kernel::both_masks(mask.plane(0), opacity.plane(0), &mut shown);
                kernel::blend(mode, masked::plane(&base, k), masked::plane(&top, k), Some(&shown), 1.0, out);
            }
        };
        pointwise(ty, inputs, fill)
    }
}

impl Node for Blend {
    const OUTPUTS: &'static [Output] =
        &[Output::value_of("result", &["base", "top"], "The blend; a colour if one of the two is.")];
    const FACTS: &'static [Fact] = &[];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (base, top) = (cx.get(&self.base)?, cx.get(&self.top)?);
        let (mask, opacity) = (cx.get_opt(&self.mask)?, cx.get(&self.opacity)?);
        let all = [&base, &top, &opacity];
        let pieces = base.ty() == Type::Ids || top.ty() == Type::Ids;
        let constant = !pieces && all.into_iter().chain(&mask).all(is_constant);
        if constant || all.into_iter().chain(&mask).any(is_solid) {
            return Ok(Outputs::one(self.by_place(base, top, mask, opacity)?));
        }
        let (base, top) = (field(base, "base")?, field(top, "top")?);
        let (mask, opacity) = (mask.map(|mask| field(mask, "mask")).transpose()?, field(opacity, "opacity")?);
        let ty = widest([&base, &top]);
        if ty == Type::Ids {
            return Ok(Outputs::one(self.pieces([base, top], mask, opacity)?));
        }
        let mut layers = Layers { mode: self.mode, opacity: 1.0 };
        let mut masks = Vec::new();
        for field in mask.into_iter().chain([opacity]) {
            match field.as_constant() {
                Some(value) => layers.opacity *= value.first().map_or(1.0, |value| saturate(*value)),
                None => masks.push(field),
            }
        }
        let field = match masks.as_slice() {
            _ if layers.opacity == 0.0 => as_type(base, ty),
            [] => Field::map(ty, [base, top], Halo::NONE, move |out: &mut Tile, [base, top]: [&Tile; 2]| {
                layers.fill(out, base, top, None);
                Ok(())
            }),
            [mask] => layers.masked(mask.clone(), base, top, ty),
            [mask, opacity, ..] => {
                let inputs = [mask.clone(), opacity.clone()];
                let both = Field::map(Type::Gray, inputs, Halo::NONE, |out: &mut Tile, [mask, opacity]: [&Tile; 2]| {
                    kernel::both_masks(mask.plane(0), opacity.plane(0), out.data_mut());
                    Ok(())
                });
                layers.masked(cx.shared_field("mask", both), base, top, ty)
            }
        };
        Ok(Outputs::one(field))
    }
}

/// A field converted to a type of more channels, or unchanged if it has that type.
fn as_type(field: Field, ty: Type) -> Field {
    if field.ty() == ty {
        return field;
    }
    Field::map(ty, [field], Halo::NONE, |out: &mut Tile, [input]: [&Tile; 1]| {
        out.planes_mut().into_iter().enumerate().for_each(|(k, plane)| plane.copy_from_slice(channel(input, k)));
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, gray, part, rgb};
    use crate::testing::{canvas, port};
    use shibo_value::{Type, Value};

    fn number(value: f32) -> Field {
        Field::constant(Type::Gray, &[value])
    }

    /// Values of the blend of `inputs`: base, top and, if there are more, mask and opacity.
    fn blend(mode: BlendMode, inputs: &[Field]) -> Vec<f32> {
        let mut node = Blend { base: port(0), top: port(1), mode, ..Blend::default() };
        node.mask = inputs.get(2).map(|_| port(2));
        if inputs.len() > 3 {
            node.opacity = port(3);
        }
        let inputs: Vec<Value> = inputs.iter().cloned().map(Value::from).collect();
        conforms(&node, &inputs);
        values(&field(&node, &inputs, "result"))
    }

    fn values(field: &Field) -> Vec<f32> {
        part(field, &canvas(), 0, 0, 64, 64).data().to_vec()
    }

    #[test]
    fn masks_and_opacity_multiply() {
        let top = number(2.0);
        let expected = |weight: f32| move |x: &f32| x + (2.0 - x) * weight;
        let (a, b) = (values(&gray()), values(&gray()));
        let close = |got: Vec<f32>, want: Vec<f32>| got.iter().zip(want).all(|(a, b)| (a - b).abs() < 1e-5);
        assert!(close(blend(BlendMode::Normal, &[gray(), top.clone()]), vec![2.0; 4096]));
        let half = blend(BlendMode::Normal, &[gray(), top.clone(), number(0.5), number(0.5)]);
        assert!(close(half, a.iter().map(expected(0.25)).collect()));
        let both = blend(BlendMode::Normal, &[gray(), top.clone(), gray(), gray()]);
        let weights = b.iter().map(|m| m.clamp(0.0, 1.0).powi(2));
        assert!(close(both, a.iter().zip(weights).map(|(x, w)| expected(w)(x)).collect()));
        let one = blend(BlendMode::Normal, &[gray(), top, gray(), number(7.0)]);
        let weights = b.iter().map(|m| m.clamp(0.0, 1.0));
        assert!(close(one, a.iter().zip(weights).map(|(x, w)| expected(w)(x)).collect()));
    }

    #[test]
    fn grey_and_colour_mix() {
        let mixed = blend(BlendMode::Multiply, &[gray(), rgb()]);
        let (grey, color) = (values(&gray()), values(&rgb()));
        assert_eq!(mixed.len(), 3 * grey.len());
        assert!(mixed.iter().enumerate().all(|(k, v)| *v == grey[k % grey.len()] * color[k]));
        assert_eq!(blend(BlendMode::Add, &[rgb(), gray(), number(0.0)]), color);
        assert_eq!(blend(BlendMode::Add, &[gray(), rgb(), number(0.0)])[4096..8192], grey);
    }

    #[test]
    fn vectors_mix_and_numbers_of_pieces_are_chosen() {
        let vector = |x: f32, y: f32| Field::constant(Type::Vec2, &[x, y]);
        let mixed = blend(BlendMode::Normal, &[vector(1.0, 2.0), vector(3.0, -2.0), gray(), number(1.0)]);
        let weights: Vec<f32> = values(&gray()).iter().map(|m| m.clamp(0.0, 1.0)).collect();
        for (k, weight) in weights.iter().enumerate() {
            assert!(
                (mixed[k] - 1.0 - 2.0 * weight).abs() < 1e-5 && (mixed[4096 + k] - 2.0 + 4.0 * weight).abs() < 1e-5
            );
        }
        assert_eq!(blend(BlendMode::Add, &[vector(1.0, 2.0), vector(3.0, -2.0)])[4095..4097], [4.0, 0.0]);
        let ids = |id: f32| Field::constant(Type::Ids, &[id]);
        let chosen = blend(BlendMode::Normal, &[ids(7.0), ids(900.0), gray(), number(0.9)]);
        for (id, weight) in chosen.iter().zip(&weights) {
            assert_eq!(*id, if weight * 0.9 >= 0.5 { 900.0 } else { 7.0 }, "{weight}");
        }
        assert_eq!(blend(BlendMode::Normal, &[ids(7.0), ids(900.0)])[0], 900.0);
        let add = Blend { base: port(0), top: port(1), mode: BlendMode::Add, ..Blend::default() };
        assert!(crate::testing::outputs(&add, &[ids(7.0).into(), ids(9.0).into()], &canvas()).is_err());
    }

    #[test]
    fn every_mode_conforms() {
        use BlendMode as M;
        for mode in [M::Divide, M::Screen, M::Overlay, M::HardLight, M::SoftLight, M::PinLight, M::ColorDodge] {
            assert!(blend(mode, &[rgb(), gray(), gray()]).iter().all(|v| v.is_finite()));
        }
    }
}
