//! Finds the directions in which results repeat with the canvas.
use super::Op;
use super::builder::{Scalar, Step};
use super::compiled::Compiled;

/// Growth of a value from one repeat of the canvas to the next, across and down; `None` if it is not the same
/// everywhere. A value with growth 0 repeats.
pub type Growth = [Option<f64>; 2];

impl Compiled {
    /// The growth of each component of the result. `planes` gives that of a plane.
    pub fn growth(&self, planes: &dyn Fn(usize) -> Growth) -> Vec<Growth> {
        let grown = self.growth_of_steps(planes);
        self.parts.iter().map(|part| grows(&grown, part)).collect()
    }

    /// The growth of each step.
    pub(super) fn growth_of_steps(&self, planes: &dyn Fn(usize) -> Growth) -> Vec<Growth> {
        let mut grown: Vec<Growth> = Vec::with_capacity(self.steps.len());
        for step in &self.steps {
            grown.push(match step {
                Step::Plane(plane) => planes(*plane),
                Step::Op(op, args, _) => {
                    let of = args.map(|arg| grows(&grown, &arg));
                    [0, 1].map(|axis| grown_by(*op, args, of.map(|growth| growth[axis])))
                }
            });
        }
        grown
    }
}

/// The periods of noise with these coordinates, which repeats with the canvas in the directions of `tiles`; 0 where
/// there is none.
pub(super) fn period(grown: &[Growth], coordinates: &[Scalar], tiles: [bool; 2]) -> [f32; 3] {
    let mut periods = [0.0; 3];
    for (period, coordinate) in periods.iter_mut().zip(coordinates) {
        let growth = grows(grown, coordinate);
        let steps = [0, 1].map(|axis| if tiles[axis] { growth[axis].unwrap_or(0.0) } else { 0.0 });
        let Some(common) = common_period(steps) else { return [0.0; 3] };
        *period = common;
    }
    periods
}

fn grows(grown: &[Growth], part: &Scalar) -> Growth {
    match part {
        Scalar::Known(_) => [Some(0.0); 2],
        Scalar::Step(step) => grown[*step as usize],
    }
}

fn is_whole(value: f64) -> bool {
    (value - value.round()).abs() <= 1e-6 * value.abs().max(1.0)
}

/// The growth of a result whose arguments grow by `of`.
fn grown_by(op: Op, args: &[Scalar; 3], of: [Option<f64>; 3]) -> Option<f64> {
    let [a, b, c] = of;
    let count = op.args();
    if of[..count].iter().all(|growth| *growth == Some(0.0)) {
        return Some(0.0);
    }
    let after = |growth: Option<f64>, period: f64| growth.filter(|growth| is_whole(growth / period)).map(|_| 0.0);
    let equal = |a: Option<f64>, b: Option<f64>| a.filter(|_| a == b);
    match (op, args) {
        (Op::Add, _) => Some(a? + b?),
        (Op::Subtract, _) => Some(a? - b?),
        (Op::Negate, _) => Some(-a?),
        (Op::Multiply, [Scalar::Known(factor), ..]) => Some(b? * factor),
        (Op::Multiply, [_, Scalar::Known(factor), _]) => Some(a? * factor),
        (Op::Divide, [_, Scalar::Known(by), _]) => Some(a? / by),
        (Op::Mix, [_, _, Scalar::Known(t)]) => Some(a? + (b? - a?) * t),
        (Op::Mix, [Scalar::Known(from), Scalar::Known(to), _]) => Some(c? * (to - from)),
        (Op::Finite, _) => a,
        (Op::Floor | Op::Ceil | Op::Round, _) => a.filter(|growth| is_whole(*growth)),
        (Op::Fract | Op::Triangle, _) => after(a, 1.0),
        (Op::Modulo, [_, Scalar::Known(by), _]) => after(a, *by),
        (Op::Sin | Op::Cos, _) => after(a, 360.0),
        (Op::Tan, _) => after(a, 180.0),
        (Op::Min | Op::Max, _) => equal(a, b),
        (Op::If, _) if a == Some(0.0) => equal(b, c),
        (Op::Noise, _) => after(a, 1.0).and(after(b, 1.0)),
        (Op::Noise3, _) => after(a, 1.0).and(after(b, 1.0)).and(after(c, 1.0)),
        _ => None,
    }
}

/// The longest period at which noise repeats although its coordinate grows by these numbers; `None` if there is none.
#[expect(clippy::cast_possible_truncation, reason = "a whole number below 2^24")]
fn common_period(steps: [f64; 2]) -> Option<f32> {
    if !steps.iter().all(|step| is_whole(*step) && step.abs() < 16_777_216.0) {
        return None;
    }
    let [mut a, mut b] = steps.map(|step| step.round().abs());
    while b != 0.0 {
        (a, b) = (b, a % b);
    }
    Some(a as f32)
}
