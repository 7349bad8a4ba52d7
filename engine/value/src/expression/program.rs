//! Assigns registers to steps, for running on rows.
use super::builder::{Scalar, Step};
use super::compiled::Compiled;
use super::growth::{Growth, period};
use super::{Fault, Op, bad};
use std::collections::BTreeMap;

/// The most operations of a program.
pub const MOST_STEPS: usize = 4096;

/// An operation on registers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instruction {
    /// The operation.
    pub op: Op,
    /// The registers of the arguments; unused ones are 0.
    pub args: [u16; 3],
    /// The register of the result, never one of the arguments.
    pub to: u16,
    /// Period of noise in cells, along each of its coordinates; 0 without a period.
    pub period: [f32; 3],
    /// The seed of random numbers.
    pub seed: u64,
}

/// An expression to run for many pixels. The first registers hold the constants, the next ones the planes it reads; all
/// others are written before they are read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Program {
    /// The instructions, in order.
    pub instructions: Vec<Instruction>,
    /// The values of the first registers.
    pub constants: Vec<f32>,
    /// The numbers of the planes to read.
    pub planes: Vec<usize>,
    /// Number of registers.
    pub registers: usize,
    /// The registers of the components of the result.
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
        Ok(Registers::new(self).assign(self, |args| period(&grown, args, tiles)))
    }
}

/// State of the register allocation.
struct Registers {
    constants: Vec<f32>,
    planes: Vec<usize>,
    constant_of: BTreeMap<u32, u16>,
    /// For each step, the last step that needs its result.
    last: Vec<usize>,
    of_step: Vec<u16>,
    free: Vec<u16>,
    count: u16,
}

impl Registers {
    #[expect(clippy::cast_possible_truncation, reason = "the numbers of steps and constants are limited")]
    fn new(compiled: &Compiled) -> Self {
        let mut registers = Self {
            constants: Vec::new(),
            planes: Vec::new(),
            constant_of: BTreeMap::new(),
            last: vec![0; compiled.steps.len()],
            of_step: vec![0; compiled.steps.len()],
            free: Vec::new(),
            count: 0,
        };
        for (index, step) in compiled.steps.iter().enumerate() {
            if let Step::Op(op, args, _) = step {
                args[..op.args()].iter().for_each(|arg| registers.note(arg, index));
            }
        }
        compiled.parts.iter().for_each(|part| registers.note(part, usize::MAX));
        registers.count = registers.constants.len() as u16;
        for (index, step) in compiled.steps.iter().enumerate() {
            if let Step::Plane(plane) = step {
                registers.planes.push(*plane);
                registers.of_step[index] = registers.count;
                registers.count += 1;
            }
        }
        registers
    }

    #[expect(clippy::cast_possible_truncation, reason = "constants are limited; values are rounded to f32 once")]
    fn note(&mut self, part: &Scalar, at: usize) {
        match part {
            Scalar::Known(value) => {
                let value = *value as f32;
                if !self.constant_of.contains_key(&value.to_bits()) {
                    self.constant_of.insert(value.to_bits(), self.constants.len() as u16);
                    self.constants.push(value);
                }
            }
            Scalar::Step(step) => self.last[*step as usize] = self.last[*step as usize].max(at),
        }
    }

    #[expect(clippy::cast_possible_truncation, reason = "rounded as when it was noted")]
    fn of(&self, part: &Scalar) -> u16 {
        match part {
            Scalar::Known(value) => self.constant_of.get(&(*value as f32).to_bits()).copied().unwrap_or(0),
            Scalar::Step(step) => self.of_step[*step as usize],
        }
    }

    fn assign(mut self, compiled: &Compiled, period: impl Fn(&[Scalar]) -> [f32; 3]) -> Program {
        let mut instructions = Vec::new();
        for (index, step) in compiled.steps.iter().enumerate() {
            let Step::Op(op, args, seed) = step else { continue };
            let mut from = [0; 3];
            for (from, arg) in from.iter_mut().zip(&args[..op.args()]) {
                *from = self.of(arg);
            }
            // Taken before the arguments' registers are freed, so that it is none of them.
            let to = self.free.pop().unwrap_or_else(|| {
                self.count += 1;
                self.count - 1
            });
            self.of_step[index] = to;
            let mut over: Vec<u16> = Vec::new();
            for arg in &args[..op.args()] {
                if let Scalar::Step(step) = arg
                    && self.last[*step as usize] == index
                    && matches!(compiled.steps[*step as usize], Step::Op(..))
                    && !over.contains(&self.of_step[*step as usize])
                {
                    over.push(self.of_step[*step as usize]);
                }
            }
            self.free.extend(over);
            let period = if matches!(op, Op::Noise | Op::Noise3) { period(&args[..op.args()]) } else { [0.0; 3] };
            instructions.push(Instruction { op: *op, args: from, to, period, seed: *seed });
        }
        let results = compiled.parts.iter().map(|part| self.of(part)).collect();
        Program { instructions, constants: self.constants, planes: self.planes, registers: self.count.into(), results }
    }
}
