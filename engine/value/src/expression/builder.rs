//! Builds lists of steps: computes constants at once, in double precision, and repeated steps once.
use super::Op;
use super::op::Finite;
use std::collections::HashMap;

/// A number: a constant, or the result of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Scalar {
    Known(f64),
    Step(u32),
}

/// A step computed for every pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Step {
    /// The value of a plane.
    Plane(usize),
    /// An operation, with the seed of its random numbers.
    Op(Op, [Scalar; 3], u64),
}

/// The arguments that an operation has not.
const UNUSED: Scalar = Scalar::Known(0.0);

/// A scalar that can be compared bit by bit.
type Bits = (bool, u64);

#[derive(Debug, Default)]
pub(super) struct Builder {
    steps: Vec<Step>,
    /// For each step, whether its result is finite for any finite planes.
    finite: Vec<bool>,
    planes: HashMap<usize, u32>,
    made: HashMap<(Op, [Bits; 3], u64), u32>,
}

fn known(part: &Scalar) -> Option<f64> {
    if let Scalar::Known(value) = part { Some(*value) } else { None }
}

fn bits(part: Scalar) -> Bits {
    match part {
        Scalar::Known(value) => (false, value.to_bits()),
        Scalar::Step(step) => (true, u64::from(step)),
    }
}

impl Builder {
    pub(super) fn len(&self) -> usize {
        self.steps.len()
    }

    fn push(&mut self, step: Step, finite: bool) -> u32 {
        self.steps.push(step);
        self.finite.push(finite);
        u32::try_from(self.steps.len() - 1).unwrap_or(u32::MAX)
    }

    /// The value of a plane, which is finite.
    pub(super) fn plane(&mut self, plane: usize) -> Scalar {
        if let Some(step) = self.planes.get(&plane) {
            return Scalar::Step(*step);
        }
        let step = self.push(Step::Plane(plane), true);
        self.planes.insert(plane, step);
        Scalar::Step(step)
    }

    /// The result of an operation on numbers: a constant or a step.
    pub(super) fn make(&mut self, op: Op, args: &[Scalar], seed: u64) -> Scalar {
        let mut all = [UNUSED; 3];
        all[..args.len()].copy_from_slice(args);
        match (op, all) {
            (Op::If, [Scalar::Known(condition), yes, no]) => return if condition != 0.0 { yes } else { no },
            (Op::Power, [base @ Scalar::Step(_), Scalar::Known(exponent), _]) => {
                if let Some(part) = self.power(base, exponent) {
                    return part;
                }
            }
            _ => {}
        }
        let seed = if op.is_seeded() { seed } else { 0 };
        if let [Some(a), Some(b), Some(c)] = [known(&all[0]), known(&all[1]), known(&all[2])] {
            return Scalar::Known(op.value([a, b, c], seed));
        }
        let key = (op, all.map(bits), seed);
        if let Some(step) = self.made.get(&key) {
            return Scalar::Step(*step);
        }
        let finite = match op.row().finite {
            Finite::Always => true,
            Finite::Kept => args.iter().all(|arg| self.is_finite(*arg)),
            Finite::Free => false,
        };
        let step = self.push(Step::Op(op, all, seed), finite);
        self.made.insert(key, step);
        Scalar::Step(step)
    }

    /// Returns true if a number is finite for any finite planes, in single precision, too.
    fn is_finite(&self, part: Scalar) -> bool {
        match part {
            Scalar::Known(value) => Op::Finite.value([value, 0.0, 0.0], 0).to_bits() == value.to_bits(),
            Scalar::Step(step) => self.finite[step as usize],
        }
    }

    /// The number as a field holds it: 0 where it is not finite.
    pub(super) fn finite(&mut self, part: Scalar) -> Scalar {
        if self.is_finite(part) { part } else { self.make(Op::Finite, &[part], 0) }
    }

    /// Replaces powers by products and square roots.
    fn power(&mut self, base: Scalar, exponent: f64) -> Option<Scalar> {
        let square = |builder: &mut Self, part: Scalar| builder.make(Op::Multiply, &[part, part], 0);
        Some(match exponent {
            0.5 => self.make(Op::Sqrt, &[base], 0),
            1.0 => base,
            2.0 => square(self, base),
            3.0 => {
                let two = square(self, base);
                self.make(Op::Multiply, &[two, base], 0)
            }
            4.0 => {
                let two = square(self, base);
                square(self, two)
            }
            _ => return None,
        })
    }

    /// The steps that some numbers need, in the order in which these numbers need them first, and the numbers as results
    /// of these steps. The order does not depend on the order in which the steps were made.
    pub(super) fn finish(self, parts: &[Scalar]) -> (Vec<Step>, Vec<Scalar>) {
        let mut new = vec![None; self.steps.len()];
        let mut steps = Vec::new();
        // Steps to add; `true` if their arguments were added before.
        let mut open: Vec<(u32, bool)> = Vec::new();
        for part in parts {
            push(&mut open, *part);
            while let Some((step, ready)) = open.pop() {
                if new[step as usize].is_some() {
                    continue;
                }
                let made = match self.steps[step as usize] {
                    Step::Op(op, args, _) if !ready => {
                        open.push((step, true));
                        args[..op.args()].iter().rev().for_each(|arg| push(&mut open, *arg));
                        continue;
                    }
                    Step::Op(op, args, seed) => Step::Op(op, args.map(|arg| renamed(arg, &new)), seed),
                    plane @ Step::Plane(_) => plane,
                };
                new[step as usize] = u32::try_from(steps.len()).ok();
                steps.push(made);
            }
        }
        let parts = parts.iter().map(|part| renamed(*part, &new)).collect();
        (steps, parts)
    }
}

fn push(open: &mut Vec<(u32, bool)>, part: Scalar) {
    if let Scalar::Step(step) = part {
        open.push((step, false));
    }
}

fn renamed(part: Scalar, new: &[Option<u32>]) -> Scalar {
    match part {
        Scalar::Step(step) => Scalar::Step(new[step as usize].unwrap_or(0)),
        known @ Scalar::Known(_) => known,
    }
}
