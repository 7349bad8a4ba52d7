//! Assigns registers to steps, for running on rows; finds the directions in which results repeat.
use super::compile::{Compiled, Scalar, Step};
use super::{Fault, Op, bad};
use std::collections::BTreeMap;

/// The most steps of a program.
const MOST_STEPS: usize = 4096;

/// An operation on registers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instruction {
    /// The operation.
    pub op: Op,
    /// The registers of the arguments; unused ones are 0.
    pub args: [u16; 3],
    /// The register of the result, never one of the arguments.
    pub to: u16,
    /// Period of noise in cells, across and down; 0 without a period.
    pub period: [f32; 2],
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
    /// The seed of random numbers.
    pub seed: u32,
}

/// Growth of a value from one repeat of the canvas to the next, across and down; `None` if it is not the same
/// everywhere. A value with growth 0 repeats.
type Growth = [Option<f64>; 2];

impl Compiled {
    /// The directions in which the result repeats with the canvas. `growth` holds the growth of the first planes from
    /// one repeat to the next; the other planes repeat.
    pub fn repeats(&self, growth: &[[f64; 2]]) -> [bool; 2] {
        let grown = self.growth(growth);
        let of = |axis: usize| self.parts.iter().all(|part| grows(&grown, part)[axis] == Some(0.0));
        [of(0), of(1)]
    }

    fn growth(&self, planes: &[[f64; 2]]) -> Vec<Growth> {
        let mut grown: Vec<Growth> = Vec::with_capacity(self.steps.len());
        for step in &self.steps {
            grown.push(match step {
                Step::Plane(plane) => planes.get(*plane).copied().unwrap_or_default().map(Some),
                Step::Op(op, args) => {
                    let of = args.map(|arg| grows(&grown, &arg));
                    [0, 1].map(|axis| grown_by(*op, args, of.map(|growth| growth[axis])))
                }
            });
        }
        grown
    }

    /// Makes the program. Noise repeats with the canvas in the directions of `tiles`, where possible.
    ///
    /// # Errors
    /// The expression is too long.
    pub fn program(&self, growth: &[[f64; 2]], tiles: [bool; 2]) -> Result<Program, Fault> {
        let used = self.used();
        let count = used.iter().filter(|used| **used).count();
        if count > MOST_STEPS {
            let message = format!("the expression has {count} operations; at most {MOST_STEPS} are possible");
            return Err(bad(0..1, message));
        }
        let grown = self.growth(growth);
        let period = |args: &[Scalar; 3]| {
            let of = [0, 1].map(|arg| {
                let growth = grows(&grown, &args[arg]);
                let steps = [0, 1].map(|axis| if tiles[axis] { growth[axis].unwrap_or(0.0) } else { 0.0 });
                common_period(steps)
            });
            if of.contains(&None) { [0.0; 2] } else { of.map(Option::unwrap_or_default) }
        };
        Ok(Registers::new(self, &used).assign(self, &used, period))
    }

    /// The steps that the result needs.
    fn used(&self) -> Vec<bool> {
        let mut used = vec![false; self.steps.len()];
        let mark = |part: &Scalar, used: &mut Vec<bool>| {
            if let Scalar::Step(step) = part {
                used[*step as usize] = true;
            }
        };
        self.parts.iter().for_each(|part| mark(part, &mut used));
        for (index, step) in self.steps.iter().enumerate().rev() {
            if let (true, Step::Op(op, args)) = (used[index], step) {
                args[..op.args()].iter().for_each(|arg| mark(arg, &mut used));
            }
        }
        used
    }
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
        (Op::Floor | Op::Ceil | Op::Round, _) => a.filter(|growth| is_whole(*growth)),
        (Op::Fract, _) => after(a, 1.0),
        (Op::Modulo, [_, Scalar::Known(by), _]) => after(a, *by),
        (Op::Sin | Op::Cos, _) => after(a, 360.0),
        (Op::Tan, _) => after(a, 180.0),
        (Op::Min | Op::Max, _) => equal(a, b),
        (Op::If, _) if a == Some(0.0) => equal(b, c),
        (Op::Noise, _) => after(a, 1.0).and(after(b, 1.0)),
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
    fn new(compiled: &Compiled, used: &[bool]) -> Self {
        let mut registers = Self {
            constants: Vec::new(),
            planes: Vec::new(),
            constant_of: BTreeMap::new(),
            last: vec![0; compiled.steps.len()],
            of_step: vec![0; compiled.steps.len()],
            free: Vec::new(),
            count: 0,
        };
        for (index, step) in compiled.steps.iter().enumerate().filter(|(index, _)| used[*index]) {
            if let Step::Op(op, args) = step {
                args[..op.args()].iter().for_each(|arg| registers.note(arg, index));
            }
        }
        compiled.parts.iter().for_each(|part| registers.note(part, usize::MAX));
        registers.count = registers.constants.len() as u16;
        for (index, step) in compiled.steps.iter().enumerate().filter(|(index, _)| used[*index]) {
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

    fn assign(mut self, compiled: &Compiled, used: &[bool], period: impl Fn(&[Scalar; 3]) -> [f32; 2]) -> Program {
        let mut instructions = Vec::new();
        for (index, step) in compiled.steps.iter().enumerate().filter(|(index, _)| used[*index]) {
            let Step::Op(op, args) = step else { continue };
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
            let period = if *op == Op::Noise { period(args) } else { [0.0; 2] };
            instructions.push(Instruction { op: *op, args: from, to, period });
        }
        let results = compiled.parts.iter().map(|part| self.of(part)).collect();
        Program {
            instructions,
            constants: self.constants,
            planes: self.planes,
            registers: self.count.into(),
            results,
            seed: compiled.seed,
        }
    }
}
