//! [`Math`]: arithmetic on fields.
//!
//! Every operation has a finite result for every input; see [`kernel::math_ops`](shibo_kernel::pointwise::math_ops). Operands that
//! the operation does not use are not computed, and numbers are not read pixel by pixel. Cost: O(pixels), bound by memory
//! except for powers, logarithms and angles (1 to 3 ns each).
use shibo_kernel::ground::tile::{channel, widest};
use shibo_kernel::pointwise::math_ops::{self as kernel, Operand, Operation};
use shibo_node::{AnyField, CanvasFacts, Context, Fact, In, Node, Output, Outputs, node};
use shibo_value::diagnostics::{Code, Problem};
use shibo_value::{Field, Halo, Stop, Tile, Type};

/// Computes with fields and numbers, channel by channel. Results that are not finite become 0.
///
/// The value comes first, `a`: `Smoothstep` of `a` between the edges `b` and `c`, `Step` of `a` at the edge `b`. In `Expression` the order is that of
/// GLSL, `smoothstep(e0, e1, x)` and `step(edge, x)`. `Expression` says in one line what takes several of these nodes.
///
/// ```ron
/// "cells": Worley(size: 9),
/// "gap": Math(operation: Subtract, a: "cells.f2", b: "cells.f1"),
/// "waves": Math(operation: MultiplyAdd, a: "cells.f1", b: 7, c: "gap"),
/// "angle": Math(operation: Multiply, a: "waves", b: 57.29578),
/// "sine": Math(operation: Sin, a: "angle"),
/// "example": Math(operation: Smoothstep, a: "sine", b: -0.6, c: 0.6),
/// ```
///
/// Elsewhere: Blender *Math*, *Vector Math*; Substance Designer *Pixel Processor*; Houdini *Math*; Material Maker
/// *Math*; Unreal *Add*, *Multiply*.
#[node]
pub struct Math {
    /// The first operand.
    pub a: In<AnyField>,
    /// The second operand, where the operation has one.
    #[default(In::constant(0.0))]
    pub b: In<AnyField>,
    /// The third operand, where the operation has one.
    #[default(In::constant(1.0))]
    pub c: In<AnyField>,
    /// What is computed of them.
    #[default(Operation::Add)]
    pub operation: Operation,
}

/// An operand: a place among the fields that are read, or the channels of a constant.
#[derive(Clone, Copy)]
enum Source {
    Read(usize),
    Value([f32; 4]),
}

#[derive(Clone, Copy)]
struct Arithmetic {
    operation: Operation,
    sources: [Source; 3],
}

impl Arithmetic {
    fn fill(self, out: &mut Tile, read: &[&Tile]) -> Result<(), Stop> {
        for (k, out) in out.planes_mut().into_iter().enumerate() {
            let operands = self.sources.map(|source| match source {
                Source::Read(i) => Operand::Plane(channel(read[i], k)),
                Source::Value(values) => Operand::Value(values[k]),
            });
            kernel::math(self.operation, operands, out);
        }
        Ok(())
    }

    fn of_constants(self, ty: Type) -> Field {
        let mut values = vec![0.0; ty.channels()];
        for (k, value) in values.iter_mut().enumerate() {
            let operands = self.sources.map(|source| match source {
                Source::Value(values) => Operand::Value(values[k]),
                Source::Read(_) => Operand::Value(0.0),
            });
            kernel::math(self.operation, operands, std::slice::from_mut(value));
        }
        Field::constant(ty, &values)
    }
}

/// The four channels of a constant; a grey one is the same in all.
fn channels(constant: &[f32]) -> [f32; 4] {
    std::array::from_fn(|k| constant.get(k).or(constant.first()).copied().unwrap_or(0.0))
}

impl Node for Math {
    const VERSION: u32 = 2;
    const OUTPUTS: &'static [Output] =
        &[Output::like("result", &["a", "b", "c"], "The result; a colour if an operand is.")];
    const FACTS: &'static [Fact] = &[];

    fn advice(&self, _canvas: &CanvasFacts) -> Vec<Problem> {
        if matches!(self.operation, Operation::Clamp | Operation::Smoothstep) {
            return Vec::new();
        }
        let operands = self.operation.operands();
        let given = [("a", &self.a), ("b", &self.b), ("c", &self.c)];
        let missing = given.iter().take(operands).filter(|(_, port)| port.slot().is_none());
        let advice = |(name, port): &(&str, &In<AnyField>)| {
            let value = port.default_value()?;
            let message = format!("`{:?}` without `{name}` takes {value} for it", self.operation);
            Some(Problem::new(Code::Advice, message).help(format!("write `{name}: {value}` if that is meant")))
        };
        missing.filter_map(advice).collect()
    }

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let fields = [cx.get(&self.a)?, cx.get(&self.b)?, cx.get(&self.c)?];
        let ty = widest(&fields);
        let operation = self.operation;
        let mut read = Vec::new();
        let mut sources = [Source::Value([0.0; 4]); 3];
        for (source, field) in sources.iter_mut().zip(fields).take(operation.operands()) {
            *source = match field.as_constant() {
                Some(values) => Source::Value(channels(values)),
                None => Source::Read(read.len()),
            };
            if matches!(source, Source::Read(_)) {
                read.push(field);
            }
        }
        let math = Arithmetic { operation, sources };
        let field = match read.as_slice() {
            [] => math.of_constants(ty),
            [a] => Field::map(ty, [a.clone()], Halo::NONE, move |out: &mut Tile, read| math.fill(out, &read)),
            [a, b] => {
                Field::map(ty, [a.clone(), b.clone()], Halo::NONE, move |out: &mut Tile, read| math.fill(out, &read))
            }
            [a, b, c, ..] => {
                let all = [a.clone(), b.clone(), c.clone()];
                Field::map(ty, all, Halo::NONE, move |out: &mut Tile, read| math.fill(out, &read))
            }
        };
        Ok(Outputs::one(field))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conform::{conforms, field, gray, part, rgb};
    use crate::testing::OnCanvas as _;
    use crate::testing::{canvas, port};
    use shibo_value::{Value, Window};

    fn math(operation: Operation, inputs: &[Field]) -> Field {
        let mut node = Math { a: port(0), operation, ..Math::default() };
        if inputs.len() > 1 {
            node.b = port(1);
        }
        if inputs.len() > 2 {
            node.c = port(2);
        }
        let inputs: Vec<Value> = inputs.iter().cloned().map(Value::from).collect();
        conforms(&node, &inputs);
        field(&node, &inputs, "result")
    }

    fn values(field: &Field) -> Vec<f32> {
        part(field, &canvas(), 0, 0, 64, 64).data().to_vec()
    }

    fn number(value: f32) -> Field {
        Field::constant(Type::Gray, &[value])
    }

    #[test]
    fn fields_and_numbers_mix() {
        let a = values(&gray());
        let b = values(&rgb());
        let scaled = values(&math(Operation::MultiplyAdd, &[gray(), number(3.0), number(1.0)]));
        assert!(a.iter().zip(scaled).all(|(x, y)| y == 3.0 * x + 1.0));
        let mixed = values(&math(Operation::MultiplyAdd, &[gray(), rgb(), gray()]));
        assert!(mixed.iter().enumerate().all(|(k, y)| *y == a[k % 4096] * b[k] + a[k % 4096]));
        let tinted = values(&math(Operation::Multiply, &[gray(), Field::constant(Type::Rgb, &[1.0, 2.0, 3.0])]));
        assert!((0..3).all(|c| tinted[c * 4096 + 9] == a[9] * (c + 1) as f32));
    }

    #[test]
    fn constants_stay_constant() {
        assert_eq!(math(Operation::Power, &[number(3.0), number(2.0)]).as_constant(), Some(&[9.0][..]));
        let color = math(Operation::Add, &[Field::constant(Type::Rgb, &[1.0, 2.0, 3.0]), number(1.0)]);
        assert_eq!(color.as_constant(), Some(&[2.0, 3.0, 4.0][..]));
    }

    #[test]
    fn idle_operands_are_not_read_but_count_for_the_type() {
        let abs = math(Operation::Abs, &[gray(), rgb()]);
        let pixel = Window { x: 0, y: 0, width: 1, height: 1 };
        let reads = abs.source().inputs(&canvas().grid(canvas().resolution), pixel).len();
        assert_eq!((abs.ty(), reads), (Type::Rgb, 1));
    }

    #[test]
    fn a_forgotten_operand_is_pointed_out() {
        let advice = |operation| Math { a: port(0), operation, ..Math::default() }.advice_on(&canvas()).len();
        let found = [Operation::Multiply, Operation::MultiplyAdd, Operation::Abs, Operation::Clamp].map(advice);
        assert_eq!(found, [1, 2, 0, 0]);
    }
}
