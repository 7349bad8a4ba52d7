//! Values on the canvas or in space, for nodes that work on both. Constants exist in space, too; other fields do not.
use shibo_kernel::wood::solids::Code as SolidCode;
use shibo_node::{Anywhere, MaterialAnywhere};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Field, Halo, Planes, Solid, SolidMaterial, Stop, Tile, Type};
use std::sync::Arc;

/// Values that depend only on the values of `inputs`, given with their ports, at the same place: solids if one of these
/// is a solid, a constant if all are constant, else a field. `ty` is the type of the field, or of the solid. `fill` sets
/// all planes of the result from those of the inputs.
pub(crate) fn pointwise<const N: usize>(
    ty: Type,
    inputs: [(Anywhere, &str); N],
    fill: impl Fn(&mut [&mut [f32]], [Planes<'_>; N]) + Send + Sync + 'static,
) -> Result<Anywhere, Stop> {
    if inputs.iter().any(|(value, _)| is_solid(value)) {
        let of_inputs = |(value, port): (Anywhere, &str)| {
            let ty = value.ty().in_space();
            solid(value, ty, port)
        };
        let inputs = inputs.into_iter().map(of_inputs).collect::<Result<_, _>>()?;
        let code = SolidCode::of_inputs(move |_, inputs, out| {
            if let Ok(inputs) = inputs.try_into() {
                fill(out, inputs);
            }
        });
        return Ok(Anywhere::Solid(code.solid(ty.in_space(), inputs)));
    }
    let fields: Vec<Field> = inputs.into_iter().map(|(value, port)| field(value, port)).collect::<Result<_, _>>()?;
    let constants: Option<Vec<_>> = fields.iter().map(Field::as_constant).collect();
    if let Some(Ok(constants)) = constants.map(<[&[f32]; N]>::try_from) {
        return Ok(Anywhere::Field(constant(ty, |out| fill(out, constants.map(|values| Planes::new(values, 1))))));
    }
    let Ok(fields) = <[Field; N]>::try_from(fields) else { return Err(mixed("input", "is missing").into()) };
    let fill = move |out: &mut Tile, inputs: [&Tile; N]| {
        fill(&mut out.planes_mut(), inputs.map(|tile| Planes::new(tile.data(), tile.window.len())));
        Ok(())
    };
    Ok(Anywhere::Field(Field::map(ty, fields, Halo::NONE, fill).overwriting()))
}

/// Each value of `input` changed by `change`, which gets the values of a channel.
pub(crate) fn changed(
    input: Anywhere,
    change: impl Fn(&[f32], &mut [f32]) + Send + Sync + 'static,
) -> Result<Anywhere, Stop> {
    pointwise(input.ty(), [(input, "input")], move |out, [input]| {
        out.iter_mut().enumerate().for_each(|(k, out)| change(input.plane(k), out));
    })
}

/// A constant field of the values that `fill` sets in planes of one value.
pub(crate) fn constant(ty: Type, fill: impl FnOnce(&mut [&mut [f32]])) -> Field {
    let mut values = vec![0.0; ty.channels()];
    fill(&mut values.iter_mut().map(std::slice::from_mut).collect::<Vec<_>>());
    Field::constant(ty, &values)
}

/// The widest of two types: numbers, colours, or vectors and normals; in space if one of them is.
pub(crate) fn widest_type(types: [Type; 2]) -> Type {
    let in_space = types.iter().any(|ty| ty.is_solid());
    let types = types.map(|ty| if in_space { ty.in_space() } else { ty });
    let wide = [Type::SolidVector, Type::Normal, Type::SolidColor, Type::Rgb];
    wide.into_iter().find(|ty| types.contains(ty)).unwrap_or(types[0])
}

/// The three channels of a colour.
pub(crate) fn rgb<'a>(planes: &Planes<'a>) -> [&'a [f32]; 3] {
    [0, 1, 2].map(|k| planes.plane(k))
}

/// The three planes of a colour, if there are three.
pub(crate) fn rgb_mut<'a>(out: &'a mut [&mut [f32]]) -> Option<[&'a mut [f32]; 3]> {
    match out {
        [r, g, b] => Some([&mut **r, &mut **g, &mut **b]),
        _ => None,
    }
}

/// True for solids.
pub(crate) fn is_solid(value: &Anywhere) -> bool {
    matches!(value, Anywhere::Solid(_))
}

/// True for fields that are constant.
pub(crate) fn is_constant(value: &Anywhere) -> bool {
    matches!(value, Anywhere::Field(field) if field.as_constant().is_some())
}

/// True for materials of solids.
pub(crate) fn is_in_space(material: &MaterialAnywhere) -> bool {
    matches!(material, MaterialAnywhere::Space(_))
}

/// The value as a solid of type `ty`; an error at `port` for a field that is not constant.
pub(crate) fn solid(value: Anywhere, ty: Type, port: &str) -> Result<Solid, Stop> {
    match value {
        Anywhere::Solid(solid) => Ok(solid),
        Anywhere::Field(field) => {
            let values = field.as_constant().ok_or_else(|| mixed(port, "is a field"))?;
            Ok(Solid::constant(ty, values))
        }
    }
}

/// The value as a field; an error at `port` for a solid.
pub(crate) fn field(value: Anywhere, port: &str) -> Result<Field, Stop> {
    match value {
        Anywhere::Field(field) => Ok(field),
        Anywhere::Solid(_) => Err(mixed(port, "is a solid, other values are on the canvas").into()),
    }
}

/// The material as a material of solids; an error at `port` if it has a channel that is not constant on the canvas.
pub(crate) fn solids(material: &MaterialAnywhere, port: &str) -> Result<Arc<SolidMaterial>, Stop> {
    match material {
        MaterialAnywhere::Space(material) => Ok(material.clone()),
        MaterialAnywhere::Canvas(material) => {
            let problem = |channel: shibo_value::Channel| mixed(port, &format!("has a field as `{}`", channel.name()));
            Ok(Arc::new(material.in_space().map_err(problem)?))
        }
    }
}

fn mixed(port: &str, what: &str) -> Problem {
    let message = format!("`{port}` {what}; values on the canvas and in space do not go together");
    Problem::new(Code::TypeMismatch, message).at(port.to_owned()).help("cut what is in space first, by `CutPlane`")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::combine::{Blend, HeightBlend, Switch};
    use crate::testing::{canvas, outputs, port};
    use crate::tone::{
        ConvertColor, Curve, GradientMap, Hsv, Invert, Levels, Quantize, Remap, ReplaceColor, Threshold,
    };
    use glam::DVec3;
    use shibo_node::{Linear, Node};
    use shibo_value::Value;

    /// Nodes give constants of constants, and the same values in space, where constants go with solids.
    fn agrees(node: &impl Node, inputs: &[&[f32]]) {
        let ty = |values: &[f32]| if values.len() == 1 { Type::Gray } else { Type::Rgb };
        let canvas_values: Vec<Value> = inputs.iter().map(|v| Field::constant(ty(v), v).into()).collect();
        let solids: Vec<Value> = inputs.iter().map(|v| Solid::constant(ty(v).in_space(), v).into()).collect();
        let mixed = [&solids[..1], &canvas_values[1..]].concat();
        let made = outputs(node, &canvas_values, &canvas()).unwrap();
        for inputs in [solids, mixed] {
            let in_space = outputs(node, &inputs, &canvas()).unwrap();
            for (number, output) in outputs_of(node).iter().enumerate() {
                let Some(Value::Field(field)) = made.take(output, number == 0) else { panic!("{output}: no field") };
                let Some(Value::Solid(solid)) = in_space.take(output, number == 0) else {
                    panic!("{output}: no solid")
                };
                let constant = field.as_constant().unwrap_or_else(|| panic!("{output} is not constant"));
                assert_eq!(solid.ty(), field.ty().in_space(), "{output}");
                let there = solid.at(&[DVec3::ONE]);
                assert_eq!(constant.iter().map(|v| f64::from(*v)).collect::<Vec<_>>(), there, "{output}");
            }
        }
    }

    fn outputs_of<N: Node>(_: &N) -> Vec<&'static str> {
        N::OUTPUTS.iter().map(|output| output.name).collect()
    }

    #[test]
    fn nodes_agree_on_the_canvas_and_in_space() {
        let (number, color): (&[f32], &[f32]) = (&[0.3], &[0.5, 0.2, 0.1]);
        for input in [number, color] {
            agrees(&Levels { input: port(0), high: 0.7, gamma: 1.5, ..Levels::default() }, &[input]);
            agrees(&Invert { input: port(0) }, &[input]);
            agrees(&Quantize { input: port(0), levels: 4, softness: 0.5, ..Quantize::default() }, &[input]);
            agrees(&Remap { input: port(0), to: Linear::new(1.0, 3.0), ..Remap::default() }, &[input]);
            let points = vec![(0.0, 0.2), (1.0, 0.9)];
            agrees(&Curve { input: port(0), points, encoded: true, ..Curve::default() }, &[input]);
        }
        agrees(&Threshold { input: port(0), level: 0.31, ..Threshold::default() }, &[number]);
        agrees(&GradientMap { input: port(0), ..GradientMap::default() }, &[number]);
        agrees(&ConvertColor { input: port(0), ..ConvertColor::default() }, &[color]);
        agrees(&ReplaceColor { input: port(0), tolerance: 0.4, ..ReplaceColor::default() }, &[color]);
        let hsv = Hsv { input: port(0), hue: port(1), saturation: port(2), value: port(3) };
        agrees(&hsv, &[color, &[40.0], &[0.4], &[0.9]]);
        agrees(
            &HeightBlend { base: port(0), top: port(1), mask: port(2), ..HeightBlend::default() },
            &[number, &[0.32], &[0.6]],
        );
        let blend = Blend { base: port(0), top: port(1), mask: Some(port(2)), opacity: port(3), ..Blend::default() };
        agrees(&blend, &[number, color, &[0.4], &[0.5]]);
        agrees(&blend, &[color, number, &[0.4], &[0.5]]);
    }

    #[test]
    fn solids_choose_solids() {
        let switch = |by| Switch { inputs: vec![port(0), port(1)], by: Some(port(by)), which: 0 };
        let number = |value: f32| Value::from(Solid::constant(Type::Solid, &[value]));
        let color = Value::from(Field::constant(Type::Rgb, &[0.1, 0.2, 0.3]));
        let made = |by: f32| {
            let outputs = outputs(&switch(2), &[number(0.5), color.clone(), number(by)], &canvas()).unwrap();
            let Some(Value::Solid(solid)) = outputs.take("result", true) else { panic!("no solid") };
            solid.at(&[DVec3::ZERO]).into_iter().map(|v| (v * 1e3).round()).collect::<Vec<_>>()
        };
        assert_eq!((made(0.2), made(0.8)), (vec![500.0; 3], vec![100.0, 200.0, 300.0]));
        let field = Value::from(Field::generate(Type::Gray, shibo_value::Tiling::BOTH, |_, _| Ok(())));
        assert!(outputs(&switch(2), &[number(0.5), field, number(1.0)], &canvas()).is_err());
    }
}
