//! The operations of expressions, and their definition in double precision.
use super::random;

/// An operation on one to three numbers. True is 1, false is 0; any number but 0 counts as true. Angles are in degrees.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[allow(missing_docs, reason = "those without a comment are what they are called")]
pub enum Op {
    Negate,
    Not,
    Abs,
    /// -1, 0 or 1.
    Sign,
    Floor,
    Ceil,
    /// Rounds halves away from 0.
    Round,
    /// x - floor(x)
    Fract,
    Sqrt,
    Exp,
    /// The natural logarithm.
    Log,
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    /// A random number from one number.
    Random,
    Add,
    Subtract,
    Multiply,
    Divide,
    /// a - b·floor(a/b), which has the sign of b.
    Modulo,
    Power,
    Min,
    Max,
    /// The angle of the vector (b, a).
    Atan2,
    Less,
    LessEqual,
    Equal,
    NotEqual,
    And,
    Or,
    /// 1 where b is not below the edge a, else 0.
    Step,
    /// A random number from a previous random number and one more number.
    Hash,
    /// Noise at (a, b); the instruction sets its period.
    Noise,
    /// b where a is true, else c.
    If,
    /// a within b..c
    Clamp,
    /// a + (b - a)·c
    Mix,
    /// The cubic step of c between the edges a and b.
    Smoothstep,
}

impl Op {
    /// All operations.
    pub const ALL: [Self; 40] = {
        use Op as O;
        [
            O::Negate,
            O::Not,
            O::Abs,
            O::Sign,
            O::Floor,
            O::Ceil,
            O::Round,
            O::Fract,
            O::Sqrt,
            O::Exp,
            O::Log,
            O::Sin,
            O::Cos,
            O::Tan,
            O::Asin,
            O::Acos,
            O::Atan,
            O::Random,
            O::Add,
            O::Subtract,
            O::Multiply,
            O::Divide,
            O::Modulo,
            O::Power,
            O::Min,
            O::Max,
            O::Atan2,
            O::Less,
            O::LessEqual,
            O::Equal,
            O::NotEqual,
            O::And,
            O::Or,
            O::Step,
            O::Hash,
            O::Noise,
            O::If,
            O::Clamp,
            O::Mix,
            O::Smoothstep,
        ]
    };

    /// Number of arguments.
    pub const fn args(self) -> usize {
        match self {
            Self::If | Self::Clamp | Self::Mix | Self::Smoothstep => 3,
            _ if (self as usize) < Self::Add as usize => 1,
            _ => 2,
        }
    }

    /// Returns true if the result is true or false.
    pub const fn is_logical(self) -> bool {
        matches!(self, Self::Not | Self::Less | Self::LessEqual | Self::Equal | Self::NotEqual | Self::And | Self::Or)
    }

    /// The result for constants, with the seed of random numbers. Uses the first [`args`](Self::args) numbers.
    pub fn value(self, [a, b, c]: [f64; 3], seed: u32) -> f64 {
        let truth = |yes: bool| if yes { 1.0 } else { 0.0 };
        #[expect(clippy::cast_possible_truncation, reason = "random numbers are functions of single-precision numbers")]
        let (fa, fb) = (a as f32, b as f32);
        match self {
            Self::Negate => -a,
            Self::Not => truth(a == 0.0),
            Self::Abs => a.abs(),
            Self::Sign => truth(a > 0.0) - truth(a < 0.0),
            Self::Floor => a.floor(),
            Self::Ceil => a.ceil(),
            Self::Round => a.round(),
            Self::Fract => a - a.floor(),
            Self::Sqrt => libm::sqrt(a),
            Self::Exp => libm::exp(a),
            Self::Log => libm::log(a),
            Self::Sin => turn(a, 0),
            Self::Cos => turn(a, 1),
            Self::Tan => turn(a, 0) / turn(a, 1),
            Self::Asin => libm::asin(a).to_degrees(),
            Self::Acos => libm::acos(a).to_degrees(),
            Self::Atan => libm::atan(a).to_degrees(),
            Self::Random => f64::from(random::random(seed, fa)),
            Self::Add => a + b,
            Self::Subtract => a - b,
            Self::Multiply => a * b,
            Self::Divide => a / b,
            Self::Modulo => modulo(a, b),
            Self::Power => libm::pow(a, b),
            Self::Min => a.min(b),
            Self::Max => a.max(b),
            Self::Atan2 => libm::atan2(a, b).to_degrees(),
            Self::Less => truth(a < b),
            Self::LessEqual => truth(a <= b),
            Self::Equal => truth(a == b),
            Self::NotEqual => truth(a != b),
            Self::And => truth(a != 0.0 && b != 0.0),
            Self::Or => truth(a != 0.0 || b != 0.0),
            Self::Step => truth(b >= a),
            Self::Hash => f64::from(random::hash(seed, fa, fb)),
            Self::Noise => f64::from(random::noise(seed, fa, fb, [0.0; 2])),
            Self::If => {
                if a != 0.0 {
                    b
                } else {
                    c
                }
            }
            Self::Clamp => a.max(b).min(c),
            Self::Mix => a + (b - a) * c,
            Self::Smoothstep => {
                let t = ((c - a) / (b - a)).clamp(0.0, 1.0);
                if a == b { truth(c >= a) } else { t * t * (3.0 - 2.0 * t) }
            }
        }
    }
}

/// The remainder with the sign of the divisor.
fn modulo(a: f64, b: f64) -> f64 {
    let rest = a % b;
    if rest != 0.0 && (rest < 0.0) != (b < 0.0) { rest + b } else { rest }
}

/// The sine of `x` degrees plus `quarters` quarter turns, exact at multiples of 90.
fn turn(x: f64, quarters: u8) -> f64 {
    let turned = x % 360.0;
    let nearest = (turned / 90.0).round();
    let rest = (turned - nearest * 90.0).to_radians();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from -4 to 4; others are not finite")]
    let quarter = ((nearest + 4.0) as u8).wrapping_add(quarters) % 4;
    let value = if quarter.is_multiple_of(2) { libm::sin(rest) } else { libm::cos(rest) };
    if quarter < 2 { value } else { -value }
}
