//! [`SolidMath`]: arithmetic with solids. Cost: about 1 ns a point.
use shibo_kernel::ground::math;
use shibo_kernel::ground::number::narrow;
use shibo_kernel::wood::solids::Code;
use shibo_node::{Context, Fact, In, Node, Output, Outputs, SolidNumber, choice, node};
use shibo_value::{Solid, Stop, Type};

/// What to compute.
#[choice]
pub enum SolidOperation {
    /// a + b.
    Add,
    /// a - b.
    Subtract,
    /// a · b.
    #[default]
    Multiply,
    /// a · b + c.
    MultiplyAdd,
    /// a / b; 0 where b is 0.
    Divide,
    /// The smaller of a and b.
    Min,
    /// The larger of a and b.
    Max,
    /// a to the power of b; 0 where a is below 0.
    Power,
    /// The part of a after its whole part, 0 to 1.
    Fraction,
    /// The whole part of a.
    Floor,
    /// The absolute value of a.
    Absolute,
    /// 0 at a ≤ b, 1 at a ≥ c, with a smooth step between.
    SmoothStep,
    /// sin(2π a / b).
    Sine,
}

/// Computes with numbers at every point in space.
///
/// ```ron
/// "clouds": SolidNoise(size: 14, octaves: 2),
/// "bands": SolidMath(operation: Sine, a: "clouds", b_value: 0.08),
/// "example": CutPlane(solid: "bands"),
/// ```
///
/// Elsewhere: Blender *Math*, *Vector Math*; Houdini *Volume VOP*.
#[node]
pub struct SolidMath {
    /// What to compute.
    #[default(SolidOperation::Multiply)]
    pub operation: SolidOperation,
    /// The first number.
    pub a: In<SolidNumber>,
    /// The second number; `b_value` if not given.
    pub b: Option<In<SolidNumber>>,
    /// The third number; `c_value` if not given.
    pub c: Option<In<SolidNumber>>,
    /// The second number where nothing is connected to `b`.
    #[schemars(range(min = -1e9, max = 1e9))]
    #[default(1.0)]
    pub b_value: f64,
    /// The third number where nothing is connected to `c`.
    #[schemars(range(min = -1e9, max = 1e9))]
    pub c_value: f64,
}

fn single(operation: SolidOperation, a: f32, b: f32, c: f32) -> f32 {
    match operation {
        SolidOperation::Add => a + b,
        SolidOperation::Subtract => a - b,
        SolidOperation::Multiply => a * b,
        SolidOperation::MultiplyAdd => a * b + c,
        SolidOperation::Divide => {
            if b == 0.0 {
                0.0
            } else {
                a / b
            }
        }
        SolidOperation::Min => math::min(a, b),
        SolidOperation::Max => math::max(a, b),
        SolidOperation::Power => math::pow(a, b),
        SolidOperation::Fraction => a - a.floor(),
        SolidOperation::Floor => a.floor(),
        SolidOperation::Absolute => a.abs(),
        SolidOperation::SmoothStep => {
            if c > b {
                math::smooth((a - b) / (c - b))
            } else if a >= b {
                1.0
            } else {
                0.0
            }
        }
        SolidOperation::Sine => {
            if b == 0.0 {
                0.0
            } else {
                math::sin(std::f32::consts::TAU * (a / b))
            }
        }
    }
}

/// In double precision, since growth times differ in their fractions.
fn double(operation: SolidOperation, a: f64, b: f64, c: f64) -> f64 {
    match operation {
        SolidOperation::Add => a + b,
        SolidOperation::Subtract => a - b,
        SolidOperation::Multiply => a * b,
        SolidOperation::MultiplyAdd => a * b + c,
        SolidOperation::Divide => {
            if b == 0.0 {
                0.0
            } else {
                a / b
            }
        }
        SolidOperation::Min => a.min(b),
        SolidOperation::Max => a.max(b),
        SolidOperation::Fraction => a - a.floor(),
        SolidOperation::Floor => a.floor(),
        SolidOperation::Absolute => a.abs(),
        SolidOperation::Power | SolidOperation::SmoothStep | SolidOperation::Sine => {
            f64::from(single(operation, narrow(a), narrow(b), narrow(c)))
        }
    }
}

impl Node for SolidMath {
    const OUTPUTS: &'static [Output] = &[Output::new("value", Type::Solid, "The result.")];
    const FACTS: &'static [Fact] = &[];

    fn evaluate(&self, cx: &Context<'_>) -> Result<Outputs, Stop> {
        let or = |port: &Option<In<SolidNumber>>, value: f64| {
            Ok::<Solid, Stop>(cx.get_opt(port)?.unwrap_or_else(|| Solid::constant(Type::Solid, &[narrow(value)])))
        };
        let inputs = vec![cx.get(&self.a)?, or(&self.b, self.b_value)?, or(&self.c, self.c_value)?];
        let operation = self.operation;
        let code = Code::of_inputs(move |_, inputs, out| {
            let [a, b, c] = [0, 1, 2].map(|i: usize| inputs[i].plane(0));
            for (((out, a), b), c) in out[0].iter_mut().zip(a).zip(b).zip(c) {
                *out = single(operation, *a, *b, *c);
            }
        })
        .with_exact(move |_, inputs| {
            (0..inputs[0].len()).map(|i| double(operation, inputs[0][i], inputs[1][i], inputs[2][i])).collect()
        });
        Ok(Outputs::one(code.solid(Type::Solid, inputs)))
    }
}
