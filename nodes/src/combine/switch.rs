//! [`Switch`] and [`SwitchMaterial`]: one of several inputs. The other inputs are not computed.
//!
//! If a number chooses, the input is passed on unchanged, with its cache key. If a field chooses, a tile reads of each
//! input only the part that shows in it. Cost: none, or a copy.
use crate::anywhere::{field, is_in_space, is_solid, solid, solids};
use crate::chosen::Chosen;
use shibo_kernel::wood::solids::Code as SolidCode;
use shibo_node::{
    AnyMaterial, Anywhere, CanvasFacts, Context, EveryFieldOrSolid, Fact, In, MaterialAnywhere, MaterialInputs, Node,
    Number, Output, Outputs, node,
};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Channel, ChannelSet, ChannelValue, Channels, Field, Solid, Stop, Type};
use std::collections::BTreeSet;

/// Passes on one of several fields or solids, chosen by a number or, place by place, by a field or a solid.
///
/// Inputs that are not chosen cost nothing: neither they nor the nodes before them are computed, unless a number is
/// chosen among colours. Connect `which` to a parameter to let presets choose between variants of a graph.
/// `SwitchMaterial` does the same with materials.
///
/// ```ron
/// "cells": Worley(size: 9, normalize: true),
/// "noise": Fractal(size: 9),
/// "steps": Remap(input: "cells.value", to: (0, 2)),
/// "example": Switch(inputs: ["noise", "cells.border", "cells.f1"], by: "steps"),
/// ```
///
/// Elsewhere: Substance Designer *Switch*, *Multi Switch*; Material Maker *Switch*; Houdini *Switch*; Blender
/// *Switch*, *Index Switch*.
#[node]
pub struct Switch {
    /// Inputs to choose from: all of one type, or numbers and colours.
    pub inputs: Vec<In<EveryFieldOrSolid>>,
    /// The number of the input at every place, rounded: 0 is the first one. Numbers below 0 choose the first input and
    /// numbers that are too large the last. If `by` is given, `which` has no effect.
    pub by: Option<In<Number>>,
    /// Number of the input: 0 is the first one.
    pub which: u32,
}

/// Passes on one of several materials, chosen by a number or, place by place, by a field or a solid.
///
/// Materials that are not chosen cost nothing. If a number chooses, the result has the channels of the chosen material.
/// Otherwise it has the channels of all of them, with defaults where a material lacks one. Materials in space are chosen
/// by a number or a solid. Edges are hard; use `BlendMaterials` for soft ones.
///
/// ```ron
/// "clay": Material(base_color: "#9a5a3c", roughness: 0.8),
/// "glaze": Material(base_color: "#20505a", roughness: 0.15),
/// "cells": Worley(size: 9),
/// "both": SwitchMaterial(inputs: ["clay", "glaze"], by: "cells.value"),
/// "example": Relief(material: "both", height: "cells.border"),
/// ```
///
/// Elsewhere: Substance Designer *Material Switch*; Material Maker *Switch*; Houdini *Switch*; Blender *Mix Shader*
/// with a whole factor.
#[node]
pub struct SwitchMaterial {
    /// Materials to choose from.
    pub inputs: Vec<In<AnyMaterial>>,
    /// The number of the material at every place, rounded: 0 is the first one. Numbers below 0 choose the first
    /// material and numbers that are too large the last. If `by` is given, `which` has no effect.
    pub by: Option<In<Number>>,
    /// Number of the material: 0 is the first one.
    pub which: u32,
}

/// Index of the input, of `count`, that a value chooses.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "limited to the inputs")]
fn nearest(value: f32, count: usize) -> usize {
    value.round().clamp(0.0, count.saturating_sub(1) as f32) as usize
}

/// Reports a number that is not the number of an input.
fn too_large(which: u32, count: usize, by: bool) -> Vec<Problem> {
    if by || (which as usize) < count {
        return Vec::new();
    }
    let message =
        format!("which is `{which}`; there are {count} inputs, so it must be at most {}", count.saturating_sub(1));
    vec![Problem::new(Code::OutOfRange, message).at("which").help("the first input is 0")]
}

fn idle(which: u32, by: bool) -> Vec<Problem> {
    let problem = Problem::new(Code::Advice, "`which` has no effect: `by` is connected").at("which");
    if by && which != 0 { vec![problem] } else { Vec::new() }
}

/// The type that all inputs share: numbers and colours may be mixed; other types only with themselves.
fn common(types: impl IntoIterator<Item = Type>) -> Option<Type> {
    types.into_iter().map(|ty| if ty == Type::Picture { Type::Rgb } else { ty }).try_fold(None, |common, ty| match (
        common, ty,
    ) {
        (None, ty) => Some(Some(ty)),
        (Some(a), b) if a == b => Some(common),
        (Some(Type::Gray | Type::Rgb), Type::Gray | Type::Rgb) => Some(Some(Type::Rgb)),
        (Some(Type::Solid | Type::SolidColor), Type::Solid | Type::SolidColor) => Some(Some(Type::SolidColor)),
        _ => None,
    })?
}

/// The solid that another solid chooses at every point; all have this type.
fn chosen_solid(ty: Type, by: &Solid, inputs: Vec<Solid>) -> Solid {
    let count = inputs.len();
    let code = SolidCode::of_inputs(move |_, inputs, out| {
        let Some((by, inputs)) = inputs.split_first() else { return };
        for (k, out) in out.iter_mut().enumerate() {
            for (i, (out, by)) in out.iter_mut().zip(by.plane(0)).enumerate() {
                *out = inputs[nearest(*by, count)].plane(k)[i];
            }
        }
    });
    code.solid(ty, [vec![by.clone()], inputs].concat())
}

/// The material with the channels of all materials, each of them made by `choose` from those of the materials.
fn chosen_material<T: ChannelValue>(
    materials: &[impl std::ops::Deref<Target = Channels<T>>],
    choose: impl Fn(Channel, Vec<T>) -> T,
) -> Channels<T> {
    let all: BTreeSet<Channel> = materials.iter().flat_map(|m| m.channels().iter().map(|(c, _)| *c)).collect();
    let of = |channel| materials.iter().map(|material| material.or_default(channel)).collect();
    Channels::new(all.into_iter().map(|channel| (channel, choose(channel, of(channel)))))
}

impl Node for Switch {
    const OUTPUTS: &'static [Output] = &[Output::told("result", "The chosen input.")];
    const FACTS: &'static [Fact] = &[];

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        too_large(self.which, self.inputs.len(), self.by.is_some())
    }

    fn advice(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        idle(self.which, self.by.is_some())
    }

    fn type_of_output(&self, inputs: &[(&str, Type)]) -> Result<Type, Vec<Problem>> {
        let in_space = inputs.iter().any(|(_, ty)| ty.is_solid());
        let own = inputs.iter().filter(|(port, _)| *port == "inputs").map(|(_, ty)| *ty);
        let types: Vec<Type> = own.map(|ty| if in_space { ty.in_space() } else { ty }).collect();
        common(types.iter().copied()).ok_or_else(|| {
            let names: BTreeSet<&str> = types.iter().map(|ty| ty.name()).collect();
            let names: Vec<String> = names.into_iter().map(|name| format!("`{name}`")).collect();
            let message =
                format!("inputs are {}; they must be of one type, or numbers and colours", names.join(" and "));
            vec![Problem::new(Code::TypeMismatch, message).at("inputs")]
        })
    }

    fn no_op(&self) -> Option<&'static str> {
        self.by.is_none().then_some("inputs")
    }

    fn no_op_item(&self) -> usize {
        self.which as usize
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let (inputs, by) = (cx.get_all(&self.inputs)?, cx.get_opt(&self.by)?);
        if inputs.iter().chain(&by).any(is_solid) {
            return self.in_space(inputs, by);
        }
        let fields: Vec<Field> = inputs.into_iter().map(|input| field(input, "inputs")).collect::<Result<_, _>>()?;
        let colours = common(fields.iter().map(Field::ty)) == Some(Type::Rgb);
        let fields: Vec<Field> =
            fields.iter().map(|field| if colours { field.to_rgb() } else { field.clone() }).collect();
        if let Some(by) = by {
            let (by, count) = (field(by, "by")?, fields.len());
            return Ok(Outputs::one(Chosen::field(&by, fields, move |value| nearest(value, count))));
        }
        let Some(chosen) = fields.get(self.which as usize) else {
            return Err(missing());
        };
        Ok(Outputs::one(chosen.clone()))
    }
}

impl Switch {
    fn in_space(&self, inputs: Vec<Anywhere>, by: Option<Anywhere>) -> Result<Outputs, Stop> {
        let ty = common(inputs.iter().map(|input| input.ty().in_space())).unwrap_or(Type::Solid);
        let of = |input: Anywhere| {
            let own = input.ty().in_space();
            let input = solid(input, own, "inputs")?;
            Ok(if ty == Type::SolidColor { input.to_color() } else { input })
        };
        let inputs: Vec<Solid> = inputs.into_iter().map(of).collect::<Result<_, Stop>>()?;
        match by {
            Some(by) => Ok(Outputs::one(chosen_solid(ty, &solid(by, Type::Solid, "by")?, inputs))),
            None => inputs.get(self.which as usize).cloned().map(Outputs::one).ok_or_else(missing),
        }
    }
}

fn missing() -> Stop {
    Problem::new(Code::OutOfRange, "there is no such input").at("which").into()
}

impl Node for SwitchMaterial {
    const OUTPUTS: &'static [Output] = &[Output::material_of("material", &["inputs", "by"], "The chosen material.")];
    const FACTS: &'static [Fact] = &[];

    fn check(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        too_large(self.which, self.inputs.len(), self.by.is_some())
    }

    fn advice(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        idle(self.which, self.by.is_some())
    }

    fn channels(&self, inputs: &MaterialInputs<'_>) -> ChannelSet {
        if self.by.is_some() { inputs.at("inputs") } else { inputs.one("inputs", self.which as usize) }
    }

    fn no_op(&self) -> Option<&'static str> {
        self.by.is_none().then_some("inputs")
    }

    fn no_op_item(&self) -> usize {
        self.which as usize
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let materials = cx.get_all(&self.inputs)?;
        let Some(by) = cx.get_opt(&self.by)? else {
            return materials.get(self.which as usize).cloned().map(Outputs::one).ok_or_else(missing);
        };
        if materials.iter().any(is_in_space) || is_solid(&by) {
            let by = solid(by, Type::Solid, "by")?;
            let materials: Vec<_> =
                materials.iter().map(|material| solids(material, "inputs")).collect::<Result<_, _>>()?;
            let choose = |channel: Channel, of| chosen_solid(channel.solid_type(), &by, of);
            return Ok(Outputs::one(chosen_material::<Solid>(&materials, choose)));
        }
        let by = field(by, "by")?;
        let on_canvas = |material| match material {
            MaterialAnywhere::Canvas(material) => Some(material),
            MaterialAnywhere::Space(_) => None,
        };
        let materials: Vec<_> = materials.into_iter().filter_map(on_canvas).collect();
        let count = materials.len();
        let choose = |_, of| Chosen::field(&by, of, move |value| nearest(value, count));
        Ok(Outputs::one(chosen_material::<Field>(&materials, choose)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, gray, rgb};
    use crate::testing::{OnCanvas as _, canvas, field, outputs, port, render};
    use shibo_value::{Material, Value};

    fn node(by: bool, which: u32) -> Switch {
        Switch { inputs: vec![port(0), port(1)], by: by.then(|| port(2)), which }
    }

    fn number(value: f32) -> Field {
        Field::constant(Type::Gray, &[value])
    }

    #[test]
    fn chooses_by_number_or_by_field() {
        let inputs = [gray().into(), number(7.0).into(), gray().into()];
        assert_eq!(render(&node(false, 0), &inputs), crate::testing::raster(&gray(), &canvas()));
        assert_eq!(field(&node(false, 1), &inputs).as_constant(), Some(&[7.0][..]));
        conforms(&node(true, 0), &inputs);
        let plain = render(&node(false, 0), &inputs);
        let chosen = render(&node(true, 0), &inputs);
        assert!(plain.data().iter().zip(chosen.data()).all(|(by, v)| *v == if *by >= 0.5 { 7.0 } else { *by }));
    }

    #[test]
    fn mixes_only_colours_and_numbers() {
        let types =
            |types: &[Type]| node(false, 0).type_of_output(&types.iter().map(|ty| ("inputs", *ty)).collect::<Vec<_>>());
        assert_eq!(types(&[Type::Gray, Type::Gray]), Ok(Type::Gray));
        assert_eq!(types(&[Type::Gray, Type::Picture]), Ok(Type::Rgb));
        assert_eq!(types(&[Type::Vec2, Type::Vec2]), Ok(Type::Vec2));
        assert!(types(&[Type::Vec2, Type::Gray]).unwrap_err()[0].message.contains("`Gray` and `Vec2`"));
        let made = field(&node(true, 0), &[gray().into(), rgb().into(), gray().into()]);
        assert_eq!(made.ty(), Type::Rgb);
    }

    #[test]
    fn numbers_beyond_the_inputs_are_refused() {
        assert_eq!(node(false, 1).check_on(&canvas()), []);
        assert_eq!(node(false, 2).check_on(&canvas())[0].field.as_deref(), Some("which"));
        assert_eq!((node(true, 2).check_on(&canvas()).len(), node(true, 2).advice_on(&canvas()).len()), (0, 1));
        assert_eq!([-4.0, 0.4, 0.6, 9.0, f32::NAN].map(|v| nearest(v, 3)), [0, 0, 1, 2, 0]);
    }

    #[test]
    fn keeps_channels_of_chosen_material_or_joins_them() {
        let material = |channel, value| Value::from(Material::new([(channel, number(value))]));
        let inputs = [material(Channel::Coat, 0.25), material(Channel::Roughness, 0.75), number(1.0).into()];
        let made = |by: bool| {
            let node = SwitchMaterial { inputs: vec![port(0), port(1)], by: by.then(|| port(2)), which: 1 };
            let outputs = outputs(&node, &inputs, &canvas()).unwrap();
            let Some(Value::Material(material)) = outputs.take("material", true) else { panic!("no material") };
            material.clone()
        };
        assert_eq!(made(false).channels().len(), 1);
        let shared = made(true);
        let value = |channel| crate::testing::raster(shared.get(channel).unwrap(), &canvas()).data()[9];
        assert_eq!((value(Channel::Coat), value(Channel::Roughness)), (0.0, 0.75));
    }
}
