//! Expressions as trees, which refer to parts of their text by place.
use super::Op;
use super::functions::Function;
use std::ops::Range;

/// An expression as a tree.
#[derive(Debug, Default)]
pub(super) struct Tree {
    /// Parts in postfix order: each after its operands, the whole expression last. They can be walked without
    /// recursion.
    pub(super) nodes: Vec<Node>,
}

/// A part of an expression.
#[derive(Debug)]
pub(super) struct Node {
    pub(super) kind: NodeKind,
    /// The bytes of the whole part in the text.
    pub(super) range: Range<usize>,
}

/// Kind of a part. An operation takes its operands from the end of the preceding parts that no other part has taken.
#[derive(Clone, Copy, Debug)]
pub(super) enum NodeKind {
    /// A number.
    Number(f64),
    /// A colour, scene-linear.
    Color([f32; 3]),
    /// A parameter of the graph, perhaps with components; its range is the whole word.
    Param,
    /// Another name, perhaps with components; its range is the whole word.
    Name,
    /// An operation on one part.
    Unary(Op),
    /// An operation on two parts, which are swapped for operators such as `>` that mirror the operation; and the bytes of
    /// the operator.
    Binary { op: Op, swapped: bool, start: usize, end: usize },
    /// A function call with this many arguments.
    Call { callee: Callee, args: usize, name_end: usize },
    /// A vector of this many parts.
    Tuple(usize),
    /// Components of a part; their letters begin at this byte.
    Letters { at: usize },
    /// The definition of a local name, which leaves no value.
    Let { start: usize, end: usize },
}

/// The function that a call names.
#[derive(Clone, Copy, Debug)]
pub(super) enum Callee {
    /// Functions of the language with one name; in a tree there is only one.
    BuiltIn(&'static [Function]),
    /// A function of the user: its number, and the number of its parameters.
    User { unit: usize, params: usize },
}

impl NodeKind {
    /// Number of operands.
    pub(super) fn parts(self) -> usize {
        match self {
            Self::Number(_) | Self::Color(_) | Self::Param | Self::Name => 0,
            Self::Unary(_) | Self::Letters { .. } | Self::Let { .. } => 1,
            Self::Binary { .. } => 2,
            Self::Call { args: parts, .. } | Self::Tuple(parts) => parts,
        }
    }
}
