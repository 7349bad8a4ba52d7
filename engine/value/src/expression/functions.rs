//! The functions and constants of expressions.
use super::Op;
use std::ops::RangeInclusive;

/// A named function, or a constant, which takes no values.
#[derive(Debug)]
pub(super) struct Function {
    pub(super) name: &'static str,
    /// Number of values it takes.
    pub(super) args: RangeInclusive<usize>,
    pub(super) makes: Makes,
}

/// Definition of a function.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Makes {
    /// A constant.
    Number(f64),
    /// True or false.
    Bool(bool),
    /// One operation on all values, component by component.
    Op(Op),
    /// An operation on the first two values, then on the result and the next one, and so on.
    Fold(Op),
    /// The length of the vector of all components of its values.
    Length,
    /// A random number from all components of its values.
    Hash,
}

impl PartialEq for Function {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Function {
    /// Returns true if the values are random numbers.
    pub(super) fn is_random(&self) -> bool {
        matches!(self.makes, Makes::Hash | Makes::Op(Op::Random | Op::Noise))
    }

    /// The number of values it takes, in words.
    pub(super) fn takes(&self) -> String {
        match (*self.args.start(), *self.args.end()) {
            (0, 0) => "no values".to_owned(),
            (1, 1) => "1 value".to_owned(),
            (least, most) if least == most => format!("{least} values"),
            (1, _) => "at least 1 value".to_owned(),
            (least, _) => format!("at least {least} values"),
        }
    }
}

const fn op(name: &'static str, op: Op) -> Function {
    Function { name, args: op.args()..=op.args(), makes: Makes::Op(op) }
}

const fn any(name: &'static str, makes: Makes) -> Function {
    Function { name, args: 1..=usize::MAX, makes }
}

const fn constant(name: &'static str, makes: Makes) -> Function {
    Function { name, args: 0..=0, makes }
}

/// All functions and constants. Angles are in degrees.
pub(super) static ALL: &[Function] = &[
    op("abs", Op::Abs),
    op("acos", Op::Acos),
    op("asin", Op::Asin),
    op("atan", Op::Atan),
    op("atan2", Op::Atan2),
    op("ceil", Op::Ceil),
    op("clamp", Op::Clamp),
    op("cos", Op::Cos),
    op("exp", Op::Exp),
    constant("false", Makes::Bool(false)),
    op("floor", Op::Floor),
    op("fract", Op::Fract),
    any("hash", Makes::Hash),
    op("if", Op::If),
    any("length", Makes::Length),
    op("lerp", Op::Mix),
    op("log", Op::Log),
    any("max", Makes::Fold(Op::Max)),
    any("min", Makes::Fold(Op::Min)),
    op("mix", Op::Mix),
    op("noise", Op::Noise),
    constant("pi", Makes::Number(std::f64::consts::PI)),
    op("pow", Op::Power),
    op("random", Op::Random),
    op("round", Op::Round),
    op("sign", Op::Sign),
    op("sin", Op::Sin),
    op("smoothstep", Op::Smoothstep),
    op("sqrt", Op::Sqrt),
    op("step", Op::Step),
    op("tan", Op::Tan),
    constant("true", Makes::Bool(true)),
];

/// The function of that name.
pub(super) fn find(name: &str) -> Option<&'static Function> {
    ALL.iter().find(|function| function.name == name)
}

/// How to write the function that other languages call `name`.
pub(super) fn elsewhere(name: &str) -> Option<&'static str> {
    Some(match name {
        "mod" | "fmod" => "write `a % b`",
        "saturate" => "write `clamp(x, 0, 1)`",
        "ln" => "write `log(x)`, which is the natural logarithm",
        "log2" => "write `log(x) / log(2)`",
        "rand" | "rnd" => "write `random(i)`",
        "hypot" | "distance" => "write `length(a, b)`",
        "select" | "where" => "write `if(condition, a, b)`",
        "radians" | "degrees" => "angles are degrees; convert with `* pi / 180`",
        "vec2" | "vec3" | "float3" | "rgb" => "write `(x, y)` or `(r, g, b)`",
        _ => return None,
    })
}
