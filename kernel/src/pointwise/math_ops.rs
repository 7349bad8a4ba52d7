//! Arithmetic on planes. Every operation has a result for every finite input.

use crate::ground::math::{self, clamp, lerp, max, min, saturate};
use crate::ground::simd;
use shibo_macros::choice;

/// The operation on a, b and c.
#[choice]
pub enum Operation {
    /// a + b
    #[default]
    Add,
    /// a - b
    Subtract,
    /// a·b
    Multiply,
    /// a / b; 0 where b is 0
    Divide,
    /// a·b + c
    MultiplyAdd,
    /// The smaller of a and b
    Min,
    /// The larger of a and b
    Max,
    /// The smaller of a and b, rounded over a width c
    SmoothMin,
    /// The larger of a and b, rounded over a width c
    SmoothMax,
    /// a to the power b; 0 where a is not above 0 (1 if b is 0)
    Power,
    /// The square root of a; 0 below 0
    // √a; 0 below 0
    Sqrt,
    /// e to the power a
    Exp,
    /// The logarithm of a to base 2; -126 at and below 0
    Log2,
    /// |a|
    Abs,
    /// -1, 0 or 1
    Sign,
    /// The remainder of a / b, in 0..b; 0 where b is 0
    // a - b·floor(a/b), in 0..b; 0 where b is 0
    Modulo,
    /// From 0 to b and back as a grows; 0 where b is 0
    PingPong,
    /// The largest integer not above a
    Floor,
    /// The smallest integer not below a
    Ceil,
    /// The integer nearest to a
    Round,
    /// The fractional part of a, in 0..1
    Fract,
    /// a rounded down to a multiple of b; a where b is 0
    Snap,
    /// The sine of a degrees
    Sin,
    /// The cosine of a degrees
    Cos,
    /// The tangent of a degrees; 0 where it is infinite
    Tan,
    /// The angle of the vector (b, a) in degrees, from -180 to 180
    Atan2,
    /// √(a² + b²)
    Hypot,
    /// 0 up to a = b, 1 from a = c on, and the cubic step between
    Smoothstep,
    /// 1 where a is not below b, else 0
    Step,
    /// a limited to b..c
    Clamp,
    /// a + (b - a)·c
    Mix,
    /// 1 where a < b, else 0
    Less,
    /// 1 where a > b, else 0
    Greater,
}

impl Operation {
    /// Number of operands that it uses.
    pub const fn operands(self) -> usize {
        use Operation as O;
        match self {
            O::Sqrt
            | O::Exp
            | O::Log2
            | O::Abs
            | O::Sign
            | O::Floor
            | O::Ceil
            | O::Round
            | O::Fract
            | O::Sin
            | O::Cos
            | O::Tan => 1,
            O::MultiplyAdd | O::SmoothMin | O::SmoothMax | O::Smoothstep | O::Clamp | O::Mix => 3,
            _ => 2,
        }
    }
}

/// An operand: a plane or one number for all pixels.
#[derive(Clone, Copy, Debug)]
pub enum Operand<'a> {
    /// One value per pixel.
    Plane(&'a [f32]),
    /// One value for all pixels.
    Value(f32),
}

const BLOCK: usize = 64;

impl Operand<'_> {
    #[inline(always)]
    fn block(&self, start: usize, n: usize, block: &mut [f32; BLOCK]) {
        match self {
            Self::Plane(plane) => block[..n].copy_from_slice(&plane[start..start + n]),
            Self::Value(value) => block.fill(*value),
        }
    }
}

/// out = operation(a, b, c). Infinite or undefined results become 0, so that they do not spread through a graph.
///
/// # Panics
/// If a plane is shorter than `out`.
pub fn math(operation: Operation, [a, b, c]: [Operand<'_>; 3], out: &mut [f32]) {
    simd::dispatch(
        #[inline(always)]
        || {
            let mut blocks = [[0.0; BLOCK]; 3];
            for (k, out) in out.chunks_mut(BLOCK).enumerate() {
                for (operand, block) in [a, b, c].iter().zip(&mut blocks) {
                    operand.block(k * BLOCK, out.len(), block);
                }
                let [a, b, c] = &blocks;
                let mut result = [0.0; BLOCK];
                run(operation, a, b, c, &mut result);
                for (out, x) in out.iter_mut().zip(&result) {
                    *out = if x.abs() < f32::INFINITY { *x } else { 0.0 };
                }
            }
        },
    );
}

type Block = [f32; BLOCK];

#[inline(always)]
fn apply(a: &Block, b: &Block, c: &Block, out: &mut Block, f: impl Fn(f32, f32, f32) -> f32) {
    for k in 0..BLOCK {
        out[k] = f(a[k], b[k], c[k]);
    }
}

#[inline(always)]
fn run(operation: Operation, a: &Block, b: &Block, c: &Block, out: &mut Block) {
    use Operation as O;
    match operation {
        O::Add => apply(a, b, c, out, |a, b, _| a + b),
        O::Subtract => apply(a, b, c, out, |a, b, _| a - b),
        O::Multiply => apply(a, b, c, out, |a, b, _| a * b),
        O::Divide => apply(a, b, c, out, |a, b, _| a / b),
        O::MultiplyAdd => apply(a, b, c, out, |a, b, c| a * b + c),
        O::Min => apply(a, b, c, out, |a, b, _| min(a, b)),
        O::Max => apply(a, b, c, out, |a, b, _| max(a, b)),
        O::SmoothMin => apply(a, b, c, out, smooth_min),
        O::SmoothMax => apply(a, b, c, out, |a, b, c| -smooth_min(-a, -b, c)),
        O::Power => apply(a, b, c, out, |a, b, _| math::pow(a, b)),
        O::Sqrt => apply(a, b, c, out, |a, _, _| max(a, 0.0).sqrt()),
        O::Exp => apply(a, b, c, out, |a, _, _| math::exp(a)),
        O::Log2 => apply(a, b, c, out, |a, _, _| math::log2(a)),
        O::Abs => apply(a, b, c, out, |a, _, _| a.abs()),
        O::Sign => apply(a, b, c, out, |a, _, _| step(a > 0.0) - step(a < 0.0)),
        O::Modulo => apply(a, b, c, out, |a, b, _| a - b * (a / b).floor()),
        O::PingPong => apply(a, b, c, out, |a, b, _| {
            let t = a / (2.0 * b);
            b * (1.0 - (2.0 * (t - t.floor()) - 1.0).abs())
        }),
        O::Floor => apply(a, b, c, out, |a, _, _| a.floor()),
        O::Ceil => apply(a, b, c, out, |a, _, _| a.ceil()),
        O::Round => apply(a, b, c, out, |a, _, _| (a + 0.5).floor()),
        O::Fract => apply(a, b, c, out, |a, _, _| a - a.floor()),
        O::Snap => apply(a, b, c, out, |a, b, _| if b == 0.0 { a } else { b * (a / b).floor() }),
        O::Sin => apply(a, b, c, out, |a, _, _| math::sin_degrees(a)),
        O::Cos => apply(a, b, c, out, |a, _, _| math::cos_degrees(a)),
        O::Tan => apply(a, b, c, out, |a, _, _| math::sin_degrees(a) / math::cos_degrees(a)),
        O::Atan2 => apply(a, b, c, out, |a, b, _| math::atan2_degrees(a, b)),
        O::Hypot => apply(a, b, c, out, |a, b, _| (a * a + b * b).sqrt()),
        O::Smoothstep => apply(a, b, c, out, |a, b, c| {
            let t = saturate((a - b) / (c - b));
            if b == c { step(a >= b) } else { t * t * (3.0 - 2.0 * t) }
        }),
        O::Step => apply(a, b, c, out, |a, b, _| step(a >= b)),
        O::Clamp => apply(a, b, c, out, clamp),
        O::Mix => apply(a, b, c, out, lerp),
        O::Less => apply(a, b, c, out, |a, b, _| step(a < b)),
        O::Greater => apply(a, b, c, out, |a, b, _| step(a > b)),
    }
}

#[inline(always)]
fn step(yes: bool) -> f32 {
    if yes { 1.0 } else { 0.0 }
}

/// The quadratic smooth minimum (I. Quilez): up to c/4 below the minimum where a = b, equal to it from |a-b| = c on.
#[inline(always)]
fn smooth_min(a: f32, b: f32, c: f32) -> f32 {
    let c = max(c.abs(), 1e-20);
    let h = max(c - (a - b).abs(), 0.0) / c;
    min(a, b) - h * h * c * 0.25
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Operation; 33] = {
        use Operation as O;
        [
            O::Add,
            O::Subtract,
            O::Multiply,
            O::Divide,
            O::MultiplyAdd,
            O::Min,
            O::Max,
            O::SmoothMin,
            O::SmoothMax,
            O::Power,
            O::Sqrt,
            O::Exp,
            O::Log2,
            O::Abs,
            O::Sign,
            O::Modulo,
            O::PingPong,
            O::Floor,
            O::Ceil,
            O::Round,
            O::Fract,
            O::Snap,
            O::Sin,
            O::Cos,
            O::Tan,
            O::Atan2,
            O::Hypot,
            O::Smoothstep,
            O::Step,
            O::Clamp,
            O::Mix,
            O::Less,
            O::Greater,
        ]
    };

    #[test]
    fn results_are_finite() {
        let values = [0.0, -0.0, 1.0, -1.5, 1e30, -1e30, f32::NAN, f32::INFINITY, f32::MIN_POSITIVE];
        for operation in ALL {
            for a in values {
                for b in values {
                    let mut out = [1.0; 70];
                    math(operation, [Operand::Plane(&[a; 70]), Operand::Value(b), Operand::Value(0.5)], &mut out);
                    assert!(
                        out.iter().all(|x| x.is_finite() && x.to_bits() == out[0].to_bits()),
                        "{operation:?} {a} {b}"
                    );
                }
            }
        }
    }

    #[test]
    fn ignores_operands_beyond_its_count() {
        for operation in ALL {
            let run = |b, c| {
                let mut out = [0.0];
                math(operation, [Operand::Value(0.7), Operand::Value(b), Operand::Value(c)], &mut out);
                out[0]
            };
            let (b, c) = ([0.3, 0.9, -2.0], [0.2, 1.7, 0.6]);
            let reads_b = b.iter().any(|b| c.iter().any(|c| run(*b, *c) != run(0.3, *c)));
            let reads_c = c.iter().any(|c| b.iter().any(|b| run(*b, *c) != run(*b, 0.2)));
            let operands = if reads_c { 3 } else { 1 + usize::from(reads_b) };
            assert_eq!(operands, operation.operands(), "{operation:?}");
        }
    }

    #[test]
    fn known_values() {
        let one = |operation, a, b, c| {
            let mut out = [0.0];
            math(operation, [a, b, c].map(Operand::Value), &mut out);
            out[0]
        };
        assert_eq!(one(Operation::Modulo, -0.25, 1.0, 0.0), 0.75);
        assert_eq!(one(Operation::PingPong, 1.25, 1.0, 0.0), 0.75);
        assert_eq!(one(Operation::SmoothMin, 1.0, 1.0, 0.4), 0.9);
        assert_eq!(one(Operation::Divide, 1.0, 0.0, 0.0), 0.0);
        assert_eq!(one(Operation::Smoothstep, 0.5, 0.0, 1.0), 0.5);
        assert_eq!(one(Operation::Round, 2.5, 0.0, 0.0), 3.0);
    }

    #[test]
    fn angles_are_degrees() {
        let one = |operation, a: f32, b: f32| {
            let mut out = [0.0];
            math(operation, [a, b, 0.0].map(Operand::Value), &mut out);
            out[0]
        };
        let quarters = |operation| [-90.0, 0.0, 90.0, 180.0, 270.0, 3600.0].map(|a| one(operation, a, 0.0));
        assert_eq!(quarters(Operation::Sin), [-1.0, 0.0, 1.0, 0.0, -1.0, 0.0]);
        assert_eq!(quarters(Operation::Cos), [0.0, 1.0, 0.0, -1.0, 0.0, 1.0]);
        assert_eq!(quarters(Operation::Tan), [0.0; 6], "an infinite result is 0");
        for degrees in -720..720_i16 {
            let (a, radians) = (f32::from(degrees), f64::from(degrees).to_radians());
            let near = |found: f32, expected: f64| (f64::from(found) - expected).abs() <= 2e-7 * (1.0 + expected.abs());
            assert!(near(one(Operation::Sin, a, 0.0), radians.sin()), "sin {a}");
            assert!(near(one(Operation::Cos, a, 0.0), radians.cos()), "cos {a}");
            assert!(degrees % 90 == 0 || near(one(Operation::Tan, a, 0.0), radians.tan()), "tan {a}");
        }
        for (y, x, degrees) in
            [(0.0, 1.0, 0.0), (2.0, 2.0, 45.0), (1.0, 0.0, 90.0), (0.0, -1.0, 180.0), (-3.0, 3.0, -45.0)]
        {
            assert_eq!(one(Operation::Atan2, y, x), degrees, "{y} {x}");
        }
        assert!((one(Operation::Atan2, 1.0, 2.0) - 26.565_05).abs() < 3e-5);
    }
}
