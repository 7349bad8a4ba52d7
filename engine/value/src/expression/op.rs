//! The operations of expressions, and their definition in double precision, both made from the table of
//! [`operations!`](crate::operations).
use super::scalar::{
    abs, acos, asin, atan, atan2, cbrt, ceil, cos, exp, finite, floor, from_srgb, hash, log, log2, max, min, modulo,
    noise, noise3, of_piece, power, random, round, saturate, sin, sqrt, srgb, truth,
};

/// Kind of an operation in the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// An operator, or an internal operation.
    Operator,
    /// An operator whose result is true or false.
    Logical,
    /// A function.
    Function,
    /// A function of any number of values.
    Fold,
    /// A function that needs the seed of random numbers.
    Seeded,
}

/// Where the result of an operation is finite.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Finite {
    Always,
    /// If all arguments are finite.
    Kept,
    /// Not even if all arguments are finite.
    Free,
}

/// A row of the table.
#[derive(Debug)]
pub(super) struct Row {
    /// The name of the operation in the text of a program.
    pub(super) word: &'static str,
    pub(super) kind: Kind,
    /// The name of the function.
    pub(super) name: &'static str,
    /// The call of the function, with the names of its arguments.
    pub(super) call: &'static str,
    pub(super) args: usize,
    /// The rough cost in tenths of a nanosecond per pixel.
    pub(super) cost: u32,
    pub(super) finite: Finite,
    pub(super) doc: &'static str,
}

macro_rules! kind {
    (operator) => {
        Kind::Operator
    };
    (logical) => {
        Kind::Logical
    };
    (function) => {
        Kind::Function
    };
    (fold) => {
        Kind::Fold
    };
    (seeded) => {
        Kind::Seeded
    };
}

macro_rules! is_finite {
    (always) => {
        Finite::Always
    };
    (kept) => {
        Finite::Kept
    };
    (free) => {
        Finite::Free
    };
}

macro_rules! call {
    (fold $name:ident $first:ident $($arg:ident)*) => {
        concat!(stringify!($name), "(", stringify!($first), ", …)")
    };
    ($kind:ident $name:ident $first:ident $($arg:ident)*) => {
        concat!(stringify!($name), "(", stringify!($first), $(", ", stringify!($arg),)* ")")
    };
}

macro_rules! define {
    (
        ($seed:ident, $period:ident)
        $($op:ident $kind:ident $name:ident($($arg:ident),+) $cost:literal $finite:ident $doc:literal = $formula:expr;)*
    ) => {
        /// An operation on one to three numbers. True is 1, false is 0; any number but 0 counts as true. Angles are in
        /// degrees.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Op {
            $(#[doc = $doc] $op,)*
        }

        impl Op {
            /// All operations.
            pub const ALL: &'static [Self] = &[$(Self::$op,)*];

            /// The result for constants, with the seed of random numbers. Uses the first [`args`](Self::args) numbers.
            pub fn value(self, args: [f64; 3], $seed: u64) -> f64 {
                let $period = [0.0; 3];
                match self {
                    $(Self::$op => {
                        let [$($arg,)+ ..] = args;
                        $formula
                    })*
                }
            }
        }

        /// The rows of the table, in the order of [`Op::ALL`].
        static ROWS: &[Row] = &[$(Row {
            word: stringify!($op),
            kind: kind!($kind),
            name: stringify!($name),
            call: call!($kind $name $($arg)+),
            args: [$(stringify!($arg)),+].len(),
            cost: $cost,
            finite: is_finite!($finite),
            doc: $doc,
        },)*];
    };
}

crate::operations!(define);

impl Op {
    /// Number of arguments.
    pub fn args(self) -> usize {
        self.row().args
    }

    /// Returns true if the result is true or false.
    pub fn is_logical(self) -> bool {
        self.row().kind == Kind::Logical
    }

    /// Returns true if the result depends on the seed of random numbers.
    pub(super) fn is_seeded(self) -> bool {
        matches!(self, Self::Hash | Self::Piece) || self.row().kind == Kind::Seeded
    }

    /// Its row of the table.
    pub(super) fn row(self) -> &'static Row {
        &ROWS[self as usize]
    }

    /// The operation of that name.
    pub(super) fn of_word(word: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|op| op.row().word == word)
    }
}
