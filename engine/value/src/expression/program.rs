//! Numbers the values of an expression, for running on rows.
use super::builder::{Scalar, Step};
use super::compiled::Compiled;
use super::growth::{Growth, period};
use super::{Fault, Op, bad};
use std::collections::BTreeMap;

/// The most operations of a program.
pub const MOST_STEPS: usize = 4096;

/// An operation on values, which are numbered: first the constants of the program, then its planes, then the results of
/// its instructions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instruction {
    /// The operation.
    pub op: Op,
    /// The values of the arguments, all made before; unused ones are 0.
    pub args: [u16; 3],
    /// Period of noise in cells, along each of its coordinates; 0 without a period.
    pub period: [f32; 3],
    /// The seed of random numbers.
    pub seed: u64,
}

/// An expression to run for many pixels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Program {
    /// The instructions, in order.
    pub instructions: Vec<Instruction>,
    /// The constants.
    pub constants: Vec<f32>,
    /// The numbers of the planes to read.
    pub planes: Vec<usize>,
    /// The values that are the components of the result.
    pub results: Vec<u16>,
}

impl Compiled {
    /// Makes the program. Noise repeats with the canvas in the directions of `tiles`, where possible. `growth` gives the
    /// growth of a plane.
    ///
    /// # Errors
    /// The expression is too long.
    pub fn program(&self, growth: &dyn Fn(usize) -> Growth, tiles: [bool; 2]) -> Result<Program, Fault> {
        let count = self.steps.len();
        if count > MOST_STEPS {
            let message = format!("the expression has {count} operations; at most {MOST_STEPS} are possible");
            return Err(bad(0..1, message));
        }
        let grown = self.growth_of_steps(growth);
        Ok(Values::of(self).program(self, |args| period(&grown, args, tiles)))
    }
}

/// The numbers of values.
#[derive(Default)]
struct Values {
    constants: Vec<f32>,
    constant_of: BTreeMap<u32, u16>,
    planes: Vec<usize>,
    of_step: Vec<u16>,
}

impl Values {
    #[expect(clippy::cast_possible_truncation, reason = "the numbers of steps and constants are limited")]
    fn of(compiled: &Compiled) -> Self {
        let mut values = Self::default();
        for step in &compiled.steps {
            if let Step::Op(op, args, _) = step {
                args[..op.args()].iter().for_each(|arg| values.note(arg));
            }
        }
        compiled.parts.iter().for_each(|part| values.note(part));
        let is_plane = |step: &&Step| matches!(step, Step::Plane(_));
        let mut plane = values.constants.len() as u16;
        let mut result = plane + compiled.steps.iter().filter(is_plane).count() as u16;
        for step in &compiled.steps {
            let next = if let Step::Plane(number) = step {
                values.planes.push(*number);
                &mut plane
            } else {
                &mut result
            };
            values.of_step.push(*next);
            *next += 1;
        }
        values
    }

    #[expect(clippy::cast_possible_truncation, reason = "constants are limited; values are rounded to f32 once")]
    fn note(&mut self, part: &Scalar) {
        if let Scalar::Known(value) = part {
            let value = *value as f32;
            if !self.constant_of.contains_key(&value.to_bits()) {
                self.constant_of.insert(value.to_bits(), self.constants.len() as u16);
                self.constants.push(value);
            }
        }
    }

    #[expect(clippy::cast_possible_truncation, reason = "rounded as when it was noted")]
    fn number(&self, part: &Scalar) -> u16 {
        match part {
            Scalar::Known(value) => self.constant_of.get(&(*value as f32).to_bits()).copied().unwrap_or(0),
            Scalar::Step(step) => self.of_step[*step as usize],
        }
    }

    fn program(self, compiled: &Compiled, period: impl Fn(&[Scalar]) -> [f32; 3]) -> Program {
        let mut instructions = Vec::new();
        for step in &compiled.steps {
            let Step::Op(op, given, seed) = step else { continue };
            let mut args = [0; 3];
            for (arg, given) in args.iter_mut().zip(&given[..op.args()]) {
                *arg = self.number(given);
            }
            let period = if matches!(op, Op::Noise | Op::Noise3) { period(&given[..op.args()]) } else { [0.0; 3] };
            instructions.push(Instruction { op: *op, args, period, seed: *seed });
        }
        let results = compiled.parts.iter().map(|part| self.number(part)).collect();
        Program { instructions, constants: self.constants, planes: self.planes, results }
    }
}
