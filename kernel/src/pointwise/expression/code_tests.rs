//! Compares prepared programs with their simplest code.
#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]
use super::super::scalar::finite;
use super::code::{Code, Work, passes_on};
use super::formula::Run;
use super::{Machine, formula};
use proptest::prelude::*;
use shibo_value::expression::{Instruction, Op, Program};

const PLANES: usize = 3;
/// Values that reach the ends of what operations handle.
const VALUES: [f32; 12] = [0.0, -0.0, 1.0, -1.0, 0.3, -2.5, 7.0, 1e-40, 3e38, -3e38, f32::INFINITY, f32::NEG_INFINITY];

fn instruction(op: Op, args: [u16; 3]) -> Instruction {
    Instruction { op, args, period: [0.0; 3], seed: 5 }
}

/// A program on three planes and these constants.
fn program(constants: Vec<f32>, instructions: Vec<Instruction>, results: Vec<u16>) -> Program {
    Program { instructions, constants, planes: (0..PLANES).collect(), results }
}

/// The results and the first bad pixel.
fn results(machine: &Machine, program: &Program, planes: &[Vec<f32>]) -> (Vec<Vec<u32>>, Option<usize>) {
    let planes: Vec<&[f32]> = planes.iter().map(Vec::as_slice).collect();
    let mut out = vec![vec![7.0; planes[0].len()]; program.results.len()];
    let mut slices: Vec<&mut [f32]> = out.iter_mut().map(Vec::as_mut_slice).collect();
    let bad = machine.run(&planes, &mut slices);
    (out.into_iter().map(|out| out.into_iter().map(f32::to_bits).collect()).collect(), bad)
}

fn assert_same(program: &Program, planes: &[Vec<f32>]) {
    let fast = results(&Machine::with(program, true), program, planes);
    assert_eq!(fast, results(&Machine::with(program, false), program, planes));
}

/// The value of an operation for one pixel.
fn value(op: Op, args: [f32; 3]) -> f32 {
    struct One<'a>([f32; 3], &'a mut f32);
    impl Run for One<'_> {
        fn call(self, f: impl Fn([f32; 3]) -> f32 + Copy) {
            *self.1 = f(self.0);
        }
    }
    let mut result = 0.0;
    formula::with(op, 5, [0.0; 3], One(args, &mut result));
    result
}

#[test]
fn values_that_are_not_finite_pass_on() {
    let values = || VALUES.iter().copied().chain([f32::NAN]);
    for op in Op::ALL.iter().copied() {
        for place in (0..op.args()).filter(|place| passes_on(op, *place)) {
            for (bad, a, b) in values().flat_map(|bad| values().flat_map(move |a| values().map(move |b| (bad, a, b)))) {
                let mut args = [a, b, a];
                args[(place + 1) % 3] = a;
                args[(place + 2) % 3] = b;
                args[place] = bad;
                let passed = bad.is_finite() || !value(op, args).is_finite();
                assert!(passed, "{op:?} {args:?}: {}", value(op, args));
            }
        }
    }
}

#[test]
fn chains_are_joined_without_checks_between() {
    // x * k + c, and a check, again and again.
    let constants = vec![0.9, 0.05];
    let mut instructions = Vec::new();
    let mut value = 2;
    for _ in 0..20 {
        let next = u16::try_from(2 + PLANES + instructions.len()).unwrap();
        instructions.push(instruction(Op::Multiply, [value, 0, 0]));
        instructions.push(instruction(Op::Add, [next, 1, 0]));
        instructions.push(instruction(Op::Finite, [next + 1, 0, 0]));
        value = next + 2;
    }
    let program = program(constants, instructions, vec![value]);
    let code = Code::unchecked(&program, true).unwrap();
    assert_eq!((code.steps.len(), code.registers), (20, 2));
    assert!(code.steps.iter().all(|step| matches!(step.work, Work::Two(..))));
    let plane: Vec<f32> = (0..1000_i16).map(|i| f32::from(i) * 0.01).collect();
    assert_same(&program, &vec![plane; PLANES]);
}

#[test]
fn checks_before_a_choice_stay() {
    // The smaller of a sum that is checked and a constant.
    let instructions =
        vec![instruction(Op::Add, [1, 2, 0]), instruction(Op::Finite, [4, 0, 0]), instruction(Op::Min, [5, 0, 0])];
    let program = program(vec![0.5], instructions, vec![6]);
    assert!(Code::unchecked(&program, true).is_none());
    assert_same(&program, &vec![VALUES.to_vec(); PLANES]);
}

/// An operation and numbers that choose its arguments.
fn drawn() -> impl Strategy<Value = (Op, [prop::sample::Index; 3])> {
    const OFTEN: &[Op] =
        &[Op::Add, Op::Subtract, Op::Multiply, Op::Divide, Op::Min, Op::Max, Op::Mix, Op::Abs, Op::Finite];
    let op = prop_oneof![6 => prop::sample::select(OFTEN), 1 => prop::sample::select(Op::ALL)];
    (op, any::<[prop::sample::Index; 3]>())
}

proptest! {
    #[test]
    fn all_codes_have_the_same_bits(
        ops in prop::collection::vec(drawn(), 1..60),
        recent in 1..30_usize,
        constants in prop::collection::vec(prop::sample::select(&VALUES[..]), 0..4),
        ends in prop::collection::vec(any::<prop::sample::Index>(), 1..4),
        drawn in prop::collection::vec((-3f32..3.0, prop::sample::select(&VALUES[..])), 5..40),
        rare in 0..700_usize,
        length in 1..1500_usize,
    ) {
        let mut count = constants.len() + PLANES;
        let mut instructions = Vec::new();
        for (op, args) in ops {
            // The values that were made last are the most likely ones, as in formulas.
            let pick = |index: prop::sample::Index| u16::try_from(count - 1 - index.index(count.min(recent))).unwrap();
            instructions.push(instruction(op, args.map(pick)));
            count += 1;
        }
        let results = ends.iter().map(|index| u16::try_from(count - 1 - index.index(count.min(8))).unwrap()).collect();
        let program = program(constants, instructions, results);
        let value = |plane: usize, i: usize| {
            let (common, other) = drawn[(i * (plane + 3) + plane) % drawn.len()];
            if i % 700 == rare { finite(other) } else { common }
        };
        let planes: Vec<Vec<f32>> = (0..PLANES).map(|plane| (0..length).map(|i| value(plane, i)).collect()).collect();
        assert_same(&program, &planes);
    }
}
