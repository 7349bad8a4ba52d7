//! Evaluates expressions on rows: runs the programs of the engine's [`expression`](shibo_value::expression) on blocks of
//! pixels whose registers fit into the L1 cache. Each operation is a loop without branches, and common pairs of operations
//! are one loop. Cost: 0.05 to 0.15 ns per pixel and operation, 1 to 3 ns for angles, powers and logarithms, 3 ns for
//! noise, 6 ns for noise in space.
//!
//! Between formulas that are computed together, values that are not finite count as 0. Most blocks have none, so they are
//! computed without these checks first: sums, products and some others of values that are not finite are not finite
//! either, which the results show. Only such a block is computed again with all checks.
mod code;
mod formula;
mod pair;

use crate::ground::simd;
use code::{Code, Step, Work};
use shibo_value::expression::Program;

/// Pixels of a chunk: the loop over it has no other length.
const CHUNK: usize = 64;
/// The most chunks in a block.
const MOST_CHUNKS: usize = 8;
/// Chunks that fit into half of an L1 cache of 32 KiB.
const L1_CHUNKS: usize = 64;

/// Numbers in a cache line.
const LINE: usize = 16;

type Chunk = [f32; CHUNK];

/// A program that is ready to run.
#[derive(Clone, Debug)]
pub struct Machine {
    code: Code,
    /// The same without checks that results make unnecessary.
    unchecked: Option<Code>,
    constants: Vec<f32>,
    planes: usize,
}

impl Machine {
    /// Prepares a program.
    pub fn new(program: &Program) -> Self {
        Self::with(program, true)
    }

    /// Prepares a program; the simplest code if `fast` is false, for tests.
    fn with(program: &Program, fast: bool) -> Self {
        Self {
            code: Code::new(program, fast),
            unchecked: if fast { Code::unchecked(program, fast) } else { None },
            constants: program.constants.clone(),
            planes: program.planes.len(),
        }
    }

    /// Runs the program for every pixel of `out`, which has one slice per component of the result; `planes` are the planes
    /// that the program names, in that order. Results that are not finite become 0; returns the first pixel that has one.
    ///
    /// # Panics
    /// If a plane is missing or shorter than `out`.
    pub fn run(&self, planes: &[&[f32]], out: &mut [&mut [f32]]) -> Option<usize> {
        simd::dispatch(
            #[inline(always)]
            || self.run_blocks(planes, out),
        )
    }

    #[inline(always)]
    fn run_blocks(&self, planes: &[&[f32]], out: &mut [&mut [f32]]) -> Option<usize> {
        let length = out.iter().map(|out| out.len()).min().unwrap_or(0);
        let code = self.unchecked.as_ref().unwrap_or(&self.code);
        let fit = L1_CHUNKS / (code.registers + planes.len() + 2);
        let chunks = fit.clamp(1, MOST_CHUNKS).min(length.div_ceil(CHUNK).max(1));
        let registers = self.unchecked.as_ref().map_or(0, |code| code.registers).max(self.code.registers) + 1;
        let mut buffer = vec![0.0; (self.constants.len() + registers * chunks) * CHUNK + LINE];
        // From the start of a cache line on.
        let start = buffer.as_ptr().align_offset(LINE * size_of::<f32>()).min(LINE);
        let (constants, registers) = buffer[start..].as_chunks_mut().0.split_at_mut(self.constants.len());
        constants.iter_mut().zip(&self.constants).for_each(|(chunk, value)| chunk.fill(*value));
        let mut operands: Vec<&[Chunk]> = constants.chunks(1).collect();
        let mut registers = registers.chunks_exact_mut(chunks);
        let spare = registers.next().unwrap_or_default();
        let registers = registers.collect();
        let mut state = State { machine: self, unchecked: self.unchecked.as_ref(), registers, spare, first: None };
        let whole = length - length % CHUNK;
        for start in (0..whole).step_by(chunks * CHUNK) {
            let end = whole.min(start + chunks * CHUNK);
            operands.truncate(self.constants.len());
            operands.extend(planes[..self.planes].iter().map(|plane| plane[start..end].as_chunks().0));
            state.block(&operands, out, start..end);
        }
        if whole < length {
            // The rest, filled up to a chunk.
            let mut rest = vec![[0.0; CHUNK]; self.planes];
            for (rest, plane) in rest.iter_mut().zip(planes) {
                rest[..length - whole].copy_from_slice(&plane[whole..length]);
            }
            operands.truncate(self.constants.len());
            operands.extend(rest.iter().map(std::slice::from_ref));
            state.block(&operands, out, whole..length);
        }
        state.first
    }
}

/// The state of a run.
struct State<'m> {
    machine: &'m Machine,
    /// The code to try first; `None` once it has failed.
    unchecked: Option<&'m Code>,
    registers: Vec<&'m mut [Chunk]>,
    spare: &'m mut [Chunk],
    /// The first pixel that has a result that is not finite.
    first: Option<usize>,
}

impl State<'_> {
    /// Computes some pixels of `out`; the operands are those of their chunks.
    #[inline(always)]
    fn block(&mut self, operands: &[&[Chunk]], out: &mut [&mut [f32]], pixels: std::ops::Range<usize>) {
        let chunks = pixels.len().div_ceil(CHUNK);
        let mut code = self.unchecked.unwrap_or(&self.machine.code);
        loop {
            for step in &code.steps {
                // Taken out of the list, so that the operands can be borrowed too.
                let to = usize::from(step.to);
                std::mem::swap(&mut self.registers[to], &mut self.spare);
                execute(step, operands, &self.registers, &mut self.spare[..chunks]);
                std::mem::swap(&mut self.registers[to], &mut self.spare);
            }
            let mut good = true;
            for (out, result) in out.iter_mut().zip(&code.results) {
                let result = operand(*result, operands, &self.registers);
                let out = &mut out[pixels.clone()];
                let found = store(result, out);
                if !found && self.unchecked.is_none() && self.first.is_none() {
                    let bad = |k: usize| !result[k / CHUNK % result.len()][k % CHUNK].is_finite();
                    self.first = (0..out.len()).find(|k| bad(*k)).map(|k| pixels.start + k);
                }
                good &= found;
            }
            if good || self.unchecked.is_none() {
                return;
            }
            // Others are likely to follow, so all checks are made from here on.
            self.unchecked = None;
            code = &self.machine.code;
        }
    }
}

/// The chunks of an operand; one if it is constant.
#[inline(always)]
fn operand<'a>(number: u16, operands: &[&'a [Chunk]], registers: &'a [&mut [Chunk]]) -> &'a [Chunk] {
    let number = usize::from(number);
    match operands.get(number) {
        Some(operand) => operand,
        None => registers[number - operands.len()],
    }
}

/// Writes a result; values that are not finite become 0. Returns true if there are none.
#[inline(always)]
fn store(result: &[Chunk], out: &mut [f32]) -> bool {
    let step = usize::from(result.len() > 1);
    let mut good = true;
    for (index, out) in out.chunks_mut(CHUNK).enumerate() {
        for (out, value) in out.iter_mut().zip(&result[index * step]) {
            let finite = value.abs() < f32::INFINITY;
            *out = if finite { *value } else { 0.0 };
            good &= finite;
        }
    }
    good
}

/// Runs a step for the chunks of `out`.
#[inline(always)]
fn execute(step: &Step, operands: &[&[Chunk]], registers: &[&mut [Chunk]], out: &mut [Chunk]) {
    let args = step.args.map(
        #[inline(always)]
        |arg| operand(arg, operands, registers),
    );
    let run = Loop { args, out };
    match step.work {
        Work::One(op) => formula::with(op, step.seed, step.period, run),
        Work::Two(first, second) => pair::with(first, second, run),
    }
}

/// A loop over the chunks of operands.
struct Loop<'a> {
    args: [&'a [Chunk]; 3],
    out: &'a mut [Chunk],
}

impl formula::Run for Loop<'_> {
    #[inline(always)]
    fn call(self, f: impl Fn([f32; 3]) -> f32 + Copy) {
        // A constant has one chunk, which is read again and again.
        let [a, b, c] = self.args;
        let steps = self.args.map(|arg| usize::from(arg.len() > 1));
        for (index, out) in self.out.iter_mut().enumerate() {
            each([&a[index * steps[0]], &b[index * steps[1]], &c[index * steps[2]]], out, f);
        }
    }
}

#[inline(always)]
fn each([a, b, c]: [&Chunk; 3], out: &mut Chunk, f: impl Fn([f32; 3]) -> f32) {
    for k in 0..CHUNK {
        out[k] = f([a[k], b[k], c[k]]);
    }
}

#[cfg(test)]
mod code_tests;
#[cfg(test)]
#[path = "expression/tests.rs"]
mod formulas;

#[cfg(test)]
mod tests {
    use super::super::scalar::{hash, noise, noise3, random};
    use super::*;
    use proptest::prelude::*;
    use shibo_value::expression::{Instruction, Op};

    /// A program of one operation on three planes.
    fn program(op: Op, seed: u64) -> Program {
        let args = [0, 1, 2].map(|arg| if usize::from(arg) < op.args() { arg } else { 0 });
        Program {
            instructions: vec![Instruction { op, args, period: [0.0; 3], seed }],
            constants: Vec::new(),
            planes: vec![0, 1, 2],
            results: vec![3],
        }
    }

    fn result(op: Op, [a, b, c]: [f32; 3]) -> f32 {
        let (mut out, planes) = ([7.0; 130], [[a; 130], [b; 130], [c; 130]]);
        let planes = planes.each_ref().map(|plane| plane.as_slice());
        Machine::new(&program(op, 9)).run(&planes, &mut [&mut out]);
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
        let machine = Machine::new(&program(Op::Divide, 0));
        assert_eq!(machine.run(&[&ones, &plane, &ones], &mut [&mut out]), None);
        plane[201] = 0.0;
        plane[255] = 0.0;
        assert_eq!(machine.run(&[&ones, &plane, &ones], &mut [&mut out]), Some(201));
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
