//! Prepares programs: leaves out checks that a later one makes unnecessary, joins pairs of operations, and assigns
//! registers.
use super::pair::{First, Second};
use shibo_value::expression::{Instruction, Op, Program};

/// One or two operations on operands.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    pub(super) work: Work,
    /// The operands; unused ones are equal to a used one.
    pub(super) args: [u16; 3],
    /// The register of the result, none of the operands.
    pub(super) to: u16,
    pub(super) period: [f32; 3],
    pub(super) seed: u64,
}

/// The operations of a step.
#[derive(Clone, Copy, Debug)]
pub(super) enum Work {
    /// An operation.
    One(Op),
    /// An operation on the result of another one: on the first two operands, then with the third.
    Two(First, Second),
}

/// Steps for a block of pixels. Operands are the constants and planes of the program, then the registers.
#[derive(Clone, Debug)]
pub(super) struct Code {
    pub(super) steps: Vec<Step>,
    pub(super) registers: usize,
    /// The operands that are the components of the result.
    pub(super) results: Vec<u16>,
}

impl Code {
    /// The code of a program.
    pub(super) fn new(program: &Program, joins: bool) -> Self {
        let fixed = program.constants.len() + program.planes.len();
        Values { fixed, instructions: program.instructions.clone(), results: program.results.clone() }.code(joins)
    }

    /// The code of a program without the checks of which results tell whether they are needed: it has the bits of the
    /// program for all pixels whose results are finite. `None` if there are no such checks.
    pub(super) fn unchecked(program: &Program, joins: bool) -> Option<Self> {
        let fixed = program.constants.len() + program.planes.len();
        let at = |value: u16| usize::from(value).checked_sub(fixed);
        // The instructions whose result makes a result of the program not finite if it is not finite.
        let mut shows = vec![false; program.instructions.len()];
        program.results.iter().filter_map(|result| at(*result)).for_each(|index| shows[index] = true);
        for (index, instruction) in program.instructions.iter().enumerate().rev() {
            let used = &instruction.args[..instruction.op.args()];
            for (place, arg) in used.iter().enumerate().filter_map(|(place, arg)| Some((place, at(*arg)?))) {
                shows[arg] |= shows[index] && (instruction.op == Op::Finite || passes_on(instruction.op, place));
            }
        }
        let mut removed = false;
        let mut renamed: Vec<u16> = (0..).take(fixed).collect();
        let mut instructions = Vec::new();
        for (instruction, shows) in program.instructions.iter().zip(shows) {
            let args = instruction.args.map(|arg| renamed[usize::from(arg)]);
            let value = if instruction.op == Op::Finite && shows {
                removed = true;
                args[0]
            } else {
                instructions.push(Instruction { args, ..*instruction });
                u16::try_from(fixed + instructions.len() - 1).unwrap_or(u16::MAX)
            };
            renamed.push(value);
        }
        let results = program.results.iter().map(|result| renamed[usize::from(*result)]).collect();
        removed.then(|| Values { fixed, instructions, results }.code(joins))
    }
}

/// Returns true if the result is not finite wherever this argument is not, for any other arguments.
pub(super) fn passes_on(op: Op, place: usize) -> bool {
    match op {
        Op::Negate | Op::Abs | Op::Floor | Op::Ceil | Op::Round | Op::Fract | Op::Sqrt => true,
        Op::Add | Op::Subtract | Op::Multiply | Op::Mix | Op::Screen => true,
        Op::Divide => place == 0,
        _ => false,
    }
}

/// A program whose results of instructions follow `fixed` constants and planes.
struct Values {
    fixed: usize,
    instructions: Vec<Instruction>,
    results: Vec<u16>,
}

impl Values {
    /// The index of the instruction that makes a value.
    fn maker(&self, value: u16) -> Option<usize> {
        usize::from(value).checked_sub(self.fixed)
    }

    /// For each instruction, the one that is joined with it and makes its first or second argument.
    fn pairs(&self) -> Vec<Option<(usize, First, Second)>> {
        let mut uses = vec![0_usize; self.instructions.len()];
        let args = self.instructions.iter().flat_map(|it| &it.args[..it.op.args()]);
        args.chain(&self.results).filter_map(|value| self.maker(*value)).for_each(|index| uses[index] += 1);
        let mut pairs: Vec<Option<(usize, First, Second)>> = Vec::new();
        for it in &self.instructions {
            let pair = it.args[..it.op.args()].iter().enumerate().find_map(|(place, arg)| {
                let index = self.maker(*arg).filter(|index| uses[*index] == 1 && pairs[*index].is_none())?;
                Some((index, First::of(self.instructions[index].op)?, Second::of(it.op, place)?))
            });
            pairs.push(pair);
        }
        pairs
    }

    /// Joins pairs and assigns registers.
    fn code(&self, joins: bool) -> Code {
        let pairs = if joins { self.pairs() } else { vec![None; self.instructions.len()] };
        let mut joined = vec![false; self.instructions.len()];
        pairs.iter().flatten().for_each(|(first, ..)| joined[*first] = true);
        // The steps with numbers of values, and for each instruction the last one that needs its result.
        let mut steps = Vec::new();
        let mut last = vec![0; self.instructions.len()];
        for (index, it) in self.instructions.iter().enumerate().filter(|(index, _)| !joined[*index]) {
            let (work, args) = match pairs[index] {
                Some((first, a, b)) => {
                    let [left, right, _] = self.instructions[first].args;
                    let other = it.args[..it.op.args()].iter().find(|arg| self.maker(**arg) != Some(first));
                    (Work::Two(a, b), [left, right, *other.unwrap_or(&left)])
                }
                None => (Work::One(it.op), [0, 1, 2].map(|k| it.args[if k < it.op.args() { k } else { 0 }])),
            };
            args.iter().filter_map(|arg| self.maker(*arg)).for_each(|arg| last[arg] = index);
            steps.push((index, Step { work, args, to: 0, period: it.period, seed: it.seed }));
        }
        self.results.iter().filter_map(|result| self.maker(*result)).for_each(|index| last[index] = usize::MAX);
        self.assign(steps, &last)
    }

    /// Assigns registers to steps, each with the number of its instruction.
    fn assign(&self, steps: Vec<(usize, Step)>, last: &[usize]) -> Code {
        let mut register_of = vec![0_u16; self.instructions.len()];
        let (mut free, mut count) = (Vec::new(), 0_u16);
        let fixed = u16::try_from(self.fixed).unwrap_or(u16::MAX);
        let operand = |value: u16, register_of: &[u16]| self.maker(value).map_or(value, |it| fixed + register_of[it]);
        let mut made = Vec::new();
        for (index, step) in steps {
            let args = step.args.map(|arg| operand(arg, &register_of));
            // Taken before the registers of the operands are freed, so that it is none of them.
            let to = free.pop().unwrap_or_else(|| {
                count += 1;
                count - 1
            });
            register_of[index] = to;
            for arg in step.args.iter().filter_map(|arg| self.maker(*arg)).filter(|arg| last[*arg] == index) {
                if !free.contains(&register_of[arg]) {
                    free.push(register_of[arg]);
                }
            }
            made.push(Step { args, to, ..step });
        }
        let results = self.results.iter().map(|result| operand(*result, &register_of)).collect();
        Code { steps: made, registers: count.into(), results }
    }
}
