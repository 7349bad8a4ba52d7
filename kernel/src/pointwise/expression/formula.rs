//! The operations of the table in single precision.
use super::super::scalar::{
    abs, acos, asin, atan, atan2, cbrt, ceil, cos, exp, finite, floor, from_srgb, hash, log, log2, max, min, modulo,
    noise, noise3, of_piece, power, random, round, saturate, sin, sqrt, srgb, truth,
};
use shibo_value::expression::Op;

/// An operation.
pub(super) trait Formula {
    /// Its value for the first of these arguments, as many as it has.
    fn value(args: [f32; 3], seed: u64, period: [f32; 3]) -> f32;
}

/// Runs a function for each pixel.
pub(super) trait Run {
    /// Runs it.
    fn call(self, f: impl Fn([f32; 3]) -> f32 + Copy);
}

macro_rules! define {
    (
        ($seed:ident, $period:ident)
        $($op:ident $kind:ident $name:ident($($arg:ident),+) $cost:literal $finite:ident $doc:literal = $formula:expr;)*
    ) => {
        $(
            #[doc = $doc]
            pub(super) enum $op {}

            impl Formula for $op {
                #[inline(always)]
                fn value(args: [f32; 3], $seed: u64, $period: [f32; 3]) -> f32 {
                    let [$($arg,)+ ..] = args;
                    let _ = ($seed, $period);
                    $formula
                }
            }
        )*

        /// Calls `run` with the function of an operation.
        #[inline(always)]
        pub(super) fn with(op: Op, seed: u64, period: [f32; 3], run: impl Run) {
            match op {
                $(Op::$op => run.call(
                    #[inline(always)]
                    move |args| $op::value(args, seed, period),
                ),)*
            }
        }
    };
}

shibo_value::operations!(define);
