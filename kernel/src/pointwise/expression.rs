//! Evaluates expressions on rows: runs the programs of the engine's [`expression`](shibo_value::expression) on blocks of
//! pixels whose registers fit into the L1 cache. Each operation is a loop without branches. Cost: 0.1 to 0.2 ns per
//! pixel and operation, 1 to 3 ns for angles, powers and logarithms, 3 ns for noise, 6 ns for noise in space.

use super::scalar::{
    abs, acos, asin, atan, atan2, cbrt, ceil, cos, exp, finite, floor, from_srgb, hash, log, log2, max, min, modulo,
    noise, noise3, of_piece, power, random, round, saturate, sin, sqrt, srgb, truth,
};
use crate::ground::simd;
use shibo_value::expression::{Instruction, Op, Program};

/// Pixels in a block.
const BLOCK: usize = 128;

type Block = [f32; BLOCK];

/// Runs a program for every pixel of `out`, which has one slice per component of the result; `planes` are the planes
/// that the program names, in that order. Results that are not finite become 0; returns the first pixel that has one.
///
/// # Panics
/// If a plane is shorter than `out`, or `out` has fewer slices than the result has components.
pub fn run(program: &Program, planes: &[&[f32]], out: &mut [&mut [f32]]) -> Option<usize> {
    simd::dispatch(
        #[inline(always)]
        || run_blocks(program, planes, out),
    )
}

#[inline(always)]
fn run_blocks(program: &Program, planes: &[&[f32]], out: &mut [&mut [f32]]) -> Option<usize> {
    let mut registers: Vec<Box<Block>> = vec![Box::new([0.0; BLOCK]); program.registers];
    for (register, value) in registers.iter_mut().zip(&program.constants) {
        register.fill(*value);
    }
    let mut spare = Box::new([0.0; BLOCK]);
    let mut first = None;
    let length = out.first().map_or(0, |out| out.len());
    for start in (0..length).step_by(BLOCK) {
        let n = BLOCK.min(length - start);
        for (register, plane) in registers[program.constants.len()..].iter_mut().zip(planes) {
            register[..n].copy_from_slice(&plane[start..start + n]);
        }
        for instruction in &program.instructions {
            // Taken out of the list, so that the arguments can be borrowed too.
            let to = usize::from(instruction.to);
            std::mem::swap(&mut registers[to], &mut spare);
            execute(instruction, &registers, &mut spare);
            std::mem::swap(&mut registers[to], &mut spare);
        }
        for (out, result) in out.iter_mut().zip(&program.results) {
            let (out, block) = (&mut out[start..start + n], &registers[usize::from(*result)]);
            let mut good = true;
            for (out, value) in out.iter_mut().zip(block.iter()) {
                let finite = value.abs() < f32::INFINITY;
                *out = if finite { *value } else { 0.0 };
                good &= finite;
            }
            if !good && first.is_none() {
                first = block[..n].iter().position(|value| !value.is_finite()).map(|at| start + at);
            }
        }
    }
    first
}

#[inline(always)]
fn one(a: &Block, out: &mut Block, f: impl Fn(f32) -> f32) {
    for k in 0..BLOCK {
        out[k] = f(a[k]);
    }
}

#[inline(always)]
fn two(a: &Block, b: &Block, out: &mut Block, f: impl Fn(f32, f32) -> f32) {
    for k in 0..BLOCK {
        out[k] = f(a[k], b[k]);
    }
}

#[inline(always)]
fn three(a: &Block, b: &Block, c: &Block, out: &mut Block, f: impl Fn(f32, f32, f32) -> f32) {
    for k in 0..BLOCK {
        out[k] = f(a[k], b[k], c[k]);
    }
}

/// Runs a formula for every pixel of a block, with its arguments called as in the table. Without the attribute, the closure
/// of a long formula is compiled separately and only for the baseline.
macro_rules! run_formula {
    ($args:ident, $out:ident, $formula:expr, $a:ident) => {
        one(
            $args[0],
            $out,
            #[inline(always)]
            |$a| $formula,
        )
    };
    ($args:ident, $out:ident, $formula:expr, $a:ident $b:ident) => {
        two(
            $args[0],
            $args[1],
            $out,
            #[inline(always)]
            |$a, $b| $formula,
        )
    };
    ($args:ident, $out:ident, $formula:expr, $a:ident $b:ident $c:ident) => {
        three(
            $args[0],
            $args[1],
            $args[2],
            $out,
            #[inline(always)]
            |$a, $b, $c| $formula,
        )
    };
}

macro_rules! define {
    (
        ($seed:ident, $period:ident)
        $($op:ident $kind:ident $name:ident($($arg:ident),+) $cost:literal $finite:ident $doc:literal = $formula:expr;)*
    ) => {
        #[inline(always)]
        fn execute(instruction: &Instruction, registers: &[Box<Block>], out: &mut Block) {
            let args = instruction.args.map(|register| &*registers[usize::from(register)]);
            let ($seed, $period) = (instruction.seed, instruction.period);
            match instruction.op {
                $(Op::$op => run_formula!(args, out, $formula, $($arg)+),)*
            }
        }
    };
}

shibo_value::operations!(define);

#[cfg(test)]
#[path = "expression_tests.rs"]
mod formulas;

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A program of one operation on three planes.
    fn program(op: Op, seed: u64) -> Program {
        let args = [0, 1, 2].map(|arg| if usize::from(arg) < op.args() { arg } else { 0 });
        Program {
            instructions: vec![Instruction { op, args, to: 3, period: [0.0; 3], seed }],
            constants: Vec::new(),
            planes: vec![0, 1, 2],
            registers: 4,
            results: vec![3],
        }
    }

    fn result(op: Op, [a, b, c]: [f32; 3]) -> f32 {
        let (mut out, planes) = ([7.0; 130], [[a; 130], [b; 130], [c; 130]]);
        let planes = planes.each_ref().map(|plane| plane.as_slice());
        run(&program(op, 9), &planes, &mut [&mut out]);
        assert!(out.iter().all(|value| value.to_bits() == out[0].to_bits()));
        out[0]
    }

    #[test]
    fn operations_match_double_precision() {
        let values = [-2.5_f32, -1.0, -0.3, 0.0, 0.2, 0.5, 1.0, 1.75, 3.0];
        for op in Op::ALL.iter().copied() {
            for a in values {
                for b in values {
                    for c in if op.args() == 3 { &values[..] } else { &values[..1] } {
                        let expected = op.value([a, b, *c].map(f64::from), 9);
                        let expected = if expected.abs() < f64::from(f32::MAX) { expected } else { 0.0 };
                        let found = f64::from(result(op, [a, b, *c]));
                        let apart = (found - expected).abs();
                        // Near a multiple of the divisor a remainder or a multiple may be one divisor away.
                        let jumps = matches!(op, Op::Modulo | Op::Snap);
                        let apart = if jumps { apart.min((apart - f64::from(b).abs()).abs()) } else { apart };
                        let near = apart <= 2e-5 * (1.0 + expected.abs());
                        assert!(near, "{op:?} {a} {b} {c}: {found}, not {expected}");
                    }
                }
            }
        }
    }

    #[test]
    fn reports_the_first_bad_pixel() {
        let (mut out, mut plane) = ([7.0_f32; 300], [4.0_f32; 300]);
        let ones = [1.0; 300];
        let program = program(Op::Divide, 0);
        assert_eq!(run(&program, &[&ones, &plane, &ones], &mut [&mut out]), None);
        plane[201] = 0.0;
        plane[255] = 0.0;
        assert_eq!(run(&program, &[&ones, &plane, &ones], &mut [&mut out]), Some(201));
        assert_eq!((out[200], out[201], out[202]), (0.25, 0.0, 0.25));
    }

    proptest! {
        #[test]
        fn results_are_finite(bits in proptest::array::uniform3(any::<u32>()), op in 0..Op::ALL.len()) {
            prop_assert!(result(Op::ALL[op], bits.map(f32::from_bits)).is_finite());
        }

        #[test]
        fn noise_is_bounded_and_repeats(x in -90f32..90.0, y in -90f32..90.0, z in -90f32..90.0, seed: u32) {
            let flat = |x, y| noise(seed.into(), x, y, [5.0, 3.0, 0.0]);
            prop_assert!((0.0..=1.0).contains(&flat(x, y)));
            prop_assert!((flat(x, y) - flat(x + 5.0, y - 6.0)).abs() < 1e-4);
            let space = |x, y, z| noise3(seed.into(), [x, y, z], [5.0, 3.0, 7.0]);
            prop_assert!((0.0..=1.0).contains(&space(x, y, z)));
            prop_assert!((space(x, y, z) - space(x + 5.0, y - 6.0, z + 7.0)).abs() < 1e-4);
        }
    }

    #[test]
    fn random_numbers_are_even() {
        let mut counts = [0_u32; 16];
        for i in 0..16_000_u16 {
            let (a, b) = (random(5, f32::from(i)), hash(5, 0.5, f32::from(i)));
            assert!((0.0..1.0).contains(&a) && (0.0..1.0).contains(&b));
            counts[usize::from(a >= 0.5) + 2 * usize::from(b >= 0.5) + 4 * usize::from(a * 8.0 % 2.0 >= 1.0)] += 1;
        }
        assert!(counts[..8].iter().all(|count| (1_800..2_200).contains(count)), "{counts:?}");
    }
}
