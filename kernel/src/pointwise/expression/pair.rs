//! The pairs of operations that run as one: the value between them stays in the processor.
//!
//! Each of the two is rounded as it is alone, so a pair has the bits of two steps.
use super::formula::{self, Formula, Run};
use shibo_value::expression::Op;

/// Defines [`First`], [`Second`] and the choice of a loop for a pair.
macro_rules! pairs {
    ($($first:ident)+; $($second:ident = $op:ident at $place:literal;)+) => {
        /// The first operation of a pair.
        #[derive(Clone, Copy, Debug)]
        pub(super) enum First {
            $($first,)+
        }

        impl First {
            /// The operation as the first of a pair, if it can be one.
            pub(super) fn of(op: Op) -> Option<Self> {
                match op {
                    $(Op::$first => Some(Self::$first),)+
                    _ => None,
                }
            }
        }

        /// The second operation of a pair, and which of its arguments is the result of the first.
        #[derive(Clone, Copy, Debug)]
        pub(super) enum Second {
            $($second,)+
        }

        impl Second {
            /// The operation as the second of a pair, if it can be one.
            pub(super) fn of(op: Op, place: usize) -> Option<Self> {
                match (op, place) {
                    $((Op::$op, $place) => Some(Self::$second),)+
                    _ => None,
                }
            }
        }

        /// Calls `run` with the function of a pair: of the two arguments of the first, and the other one of the second.
        #[inline(always)]
        pub(super) fn with(first: First, second: Second, run: impl Run) {
            match first {
                $(First::$first => with_first::<formula::$first>(second, run),)+
            }
        }

        #[inline(always)]
        fn with_first<F: Formula>(second: Second, run: impl Run) {
            match second {
                $(Second::$second => run.call(
                    #[inline(always)]
                    move |[a, b, c]| {
                        let mut args = [c; 3];
                        args[$place] = F::value([a, b, c], 0, [0.0; 3]);
                        formula::$op::value(args, 0, [0.0; 3])
                    },
                ),)+
            }
        }
    };
}

pairs! {
    Add Subtract Multiply Divide Min Max;
    Add = Add at 0;
    AddTo = Add at 1;
    Subtract = Subtract at 0;
    SubtractFrom = Subtract at 1;
    Multiply = Multiply at 0;
    MultiplyBy = Multiply at 1;
    Divide = Divide at 0;
    Min = Min at 0;
    MinOf = Min at 1;
    Max = Max at 0;
    MaxOf = Max at 1;
    Abs = Abs at 0;
    Finite = Finite at 0;
}
