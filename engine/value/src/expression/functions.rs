//! The functions and constants of expressions, and their manual.
//!
//! Functions that are one operation come from the table of operations. The second table here defines functions by an
//! expression.
use super::Op;
use super::op::Kind;
use std::ops::RangeInclusive;
use std::sync::LazyLock;

/// A function, or a constant, which takes no values.
#[derive(Debug)]
pub(super) struct Function {
    pub(super) name: &'static str,
    /// Number of values it takes.
    pub(super) args: RangeInclusive<usize>,
    pub(super) makes: Makes,
    described: Described,
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
    /// The sum of all components of its values.
    Sum,
    /// A random number from all components of its values.
    Hash,
    /// The random number of a piece, with a seed of its own.
    Piece,
    /// The expression of that number in the table.
    Composed(usize),
}

/// The number of components that a value must have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Takes {
    /// Any number.
    Any,
    /// This number.
    Count(usize),
    /// At least two.
    Vector,
}

/// A function that is defined by an expression.
#[derive(Debug)]
pub(super) struct Composed {
    pub(super) params: &'static [(&'static str, Takes)],
    pub(super) body: &'static str,
}

/// A function, or a constant, which takes no values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Described {
    /// The name.
    pub name: &'static str,
    /// The call, with the names of the values.
    pub call: &'static str,
    /// The description.
    pub doc: &'static str,
}

macro_rules! takes {
    () => {
        Takes::Any
    };
    (vector) => {
        Takes::Vector
    };
    ($count:literal) => {
        Takes::Count($count)
    };
}

/// Each line is a function: its call, with the number of components of its values where that matters; its manual; and
/// its definition.
macro_rules! composed {
    ($($name:ident($first:ident $(: $count:tt)? $(, $arg:ident $(: $counts:tt)?)*) $doc:literal = $body:expr;)*) => {
        pub(super) static COMPOSED: &[Composed] = &[$(Composed {
            params: &[(stringify!($first), takes!($($count)?)), $((stringify!($arg), takes!($($counts)?)),)*],
            body: $body,
        },)*];
        static COMPOSED_MANUAL: &[Described] = &[$(Described {
            name: stringify!($name),
            call: concat!(stringify!($name), "(", stringify!($first), $(", ", stringify!($arg),)* ")"),
            doc: $doc,
        },)*];
    };
}

composed! {
    lerp(a, b, t) "The same as `mix`." = "mix(a, b, t)";
    remap(x, a, b, c, d) "The linear function that is `c` at `a` and `d` at `b`; it does not clamp."
        = "mix(c, d, (x - a) * (1 / (b - a)))";
    darken(a, b) "The blend mode: the smaller of `a` and `b`." = "min(a, b)";
    lighten(a, b) "The blend mode: the larger of `a` and `b`." = "max(a, b)";
    dot(a: vector, b: vector) "The dot product." = "sum(a * b)";
    cross(a: 3, b: 3) "The cross product." = "(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x)";
    normalize(v: vector) "The vector with length 1 in the same direction; 0 stays 0." = "v / max(length(v), 1e-20)";
    rotate(v: 2, angle: 1) "The vector turned from +x towards +y, by degrees."
        = "let c = cos(angle); let s = sin(angle); (c * v.x - s * v.y, s * v.x + c * v.y)";
    luminance(c: 3) "The luminance of a linear colour (Rec. 709)." = "0.2126 * c.r + 0.7152 * c.g + 0.0722 * c.b";
    oklab(c: 3) "The linear colour in Oklab: lightness, green to red, blue to yellow." = "
        let l = cbrt(0.41222146 * c.r + 0.53633255 * c.g + 0.051445995 * c.b);
        let m = cbrt(0.2119035 * c.r + 0.6806995 * c.g + 0.10739696 * c.b);
        let s = cbrt(0.08830246 * c.r + 0.28171885 * c.g + 0.6299787 * c.b);
        (0.21045426 * l + 0.7936178 * m - 0.004072047 * s,
         1.9779985 * l - 2.4285922 * m + 0.4505937 * s,
         0.025904037 * l + 0.78277177 * m - 0.80867577 * s)";
    from_oklab(c: 3) "The linear colour of Oklab; components below 0 become 0." = "
        let l = c.x + 0.39633778 * c.y + 0.21580376 * c.z;
        let m = c.x - 0.105561346 * c.y - 0.06385417 * c.z;
        let s = c.x - 0.08948418 * c.y - 1.2914855 * c.z;
        let p = l * l * l; let q = m * m * m; let r = s * s * s;
        max((4.0767417 * p - 3.3077116 * q + 0.23096994 * r,
             -1.268438 * p + 2.6097574 * q - 0.3413194 * r,
             -0.0041960863 * p - 0.7034186 * q + 1.7076147 * r), 0)";
    hsv(c: 3) "Hue in degrees, saturation and value of the sRGB encoding of a linear colour." = "
        let e = max(srgb(c), 0);
        let high = max(e.r, max(e.g, e.b));
        let chroma = high - min(e.r, min(e.g, e.b));
        let d = if(chroma > 0, (e.gbr - e.brg) / chroma, 0);
        let red = if(d.r < 0, d.r + 6, d.r);
        let hue = if(e.r >= high, red, if(e.g >= high, 2 + d.g, 4 + d.b));
        (if(chroma > 0, 60 * hue, 0), if(high > 0, chroma / high, 0), high)";
    from_hsv(c: 3) "The linear colour of hue in degrees, saturation and value." = "
        let turned = clamp(c.x, -1e6, 1e6) % 360;
        let k = (5, 3, 1) + if(turned >= 360, turned - 360, turned) * (1 / 60);
        let wrapped = if(k >= 6, k - 6, k);
        from_srgb(c.z - c.z * c.y * max(0, min(1, min(wrapped, 4 - wrapped))))";
}

fn of(call: &'static str, doc: &'static str, args: RangeInclusive<usize>, makes: Makes) -> Function {
    let name = call.split('(').next().unwrap_or(call);
    Function { name, args, makes, described: Described { name, call, doc } }
}

/// The functions and constants that no table defines.
fn special() -> [Function; 7] {
    let any = 1..=usize::MAX;
    let random = "A random number of each piece `i`, 0 ≤ r < 1; the seed is a constant. The same as `RegionRandom`.";
    let hash = "A random number, 0 ≤ r < 1, that depends on all components of its values and on the seed.";
    [
        of("false", "0.", 0..=0, Makes::Bool(false)),
        of("hash(a, …)", hash, any.clone(), Makes::Hash),
        of("length(a, …)", "The length of the vector of all components of its values.", any.clone(), Makes::Length),
        of("pi", "3.14159…", 0..=0, Makes::Number(std::f64::consts::PI)),
        of("random(i, seed)", random, 2..=2, Makes::Piece),
        of("sum(a, …)", "The sum of all components of its values.", any, Makes::Sum),
        of("true", "1.", 0..=0, Makes::Bool(true)),
    ]
}

/// All functions and constants, by name. Functions of one name differ in the number of values.
static ALL: LazyLock<Vec<Function>> = LazyLock::new(|| {
    let operations = Op::ALL.iter().filter_map(|op| {
        let row = op.row();
        let (args, makes) = match row.kind {
            Kind::Function | Kind::Seeded => (row.args..=row.args, Makes::Op(*op)),
            Kind::Fold => (1..=usize::MAX, Makes::Fold(*op)),
            Kind::Operator | Kind::Logical => return None,
        };
        let described = Described { name: row.name, call: row.call, doc: row.doc };
        Some(Function { name: row.name, args, makes, described })
    });
    let composed = COMPOSED.iter().zip(COMPOSED_MANUAL).enumerate().map(|(index, (composed, described))| {
        let args = composed.params.len()..=composed.params.len();
        Function { name: described.name, args, makes: Makes::Composed(index), described: *described }
    });
    let mut all: Vec<Function> = operations.chain(composed).chain(special()).collect();
    all.sort_by_key(|function| (function.name, *function.args.start()));
    all
});

static MANUAL: LazyLock<Vec<Described>> = LazyLock::new(|| ALL.iter().map(|function| function.described).collect());

/// The functions and constants of expressions, by name; two of one name differ in the number of values.
pub fn described() -> &'static [Described] {
    &MANUAL
}

impl Function {
    /// Returns true if the values are random numbers from the seed of the canvas.
    pub(super) fn is_random(&self) -> bool {
        match self.makes {
            Makes::Hash => true,
            Makes::Op(op) => op.is_seeded(),
            _ => false,
        }
    }

    /// Returns true if it is a constant, which needs no brackets.
    pub(super) fn is_constant(&self) -> bool {
        *self.args.end() == 0
    }

    /// How it is called.
    pub(super) fn call(&self) -> &'static str {
        self.described.call
    }
}

/// The functions of that name.
pub(super) fn find(name: &str) -> Option<&'static [Function]> {
    let first = ALL.partition_point(|function| function.name < name);
    let count = ALL[first..].iter().take_while(|function| function.name == name).count();
    (count > 0).then(|| &ALL[first..first + count])
}

/// The names of all functions.
pub(super) fn names<'a>() -> impl Iterator<Item = &'a str> {
    ALL.iter().map(|function| function.name)
}

/// The numbers of values that functions of one name take, in words.
pub(super) fn takes(functions: &[Function]) -> String {
    let counts: Vec<String> = functions.iter().map(|function| function.args.start().to_string()).collect();
    let one = if counts == ["1"] { "value" } else { "values" };
    match functions {
        [function] if function.is_constant() => "no values".to_owned(),
        [function] if *function.args.end() == usize::MAX => format!("at least {} {one}", counts.concat()),
        _ => format!("{} {one}", counts.join(" or ")),
    }
}

/// How to write the function that other languages call `name`.
pub(super) fn elsewhere(name: &str) -> Option<&'static str> {
    Some(match name {
        "mod" | "fmod" => "write `a % b`",
        "saturate" => "write `clamp(x, 0, 1)`",
        "ln" => "write `log(x)`, which is the natural logarithm",
        "log10" => "write `log(x) / log(10)`",
        "rand" | "rnd" => "write `random(i)`",
        "hypot" | "distance" => "write `length(a, b)`",
        "select" | "where" => "write `if(condition, a, b)`",
        "radians" | "degrees" => "angles are degrees; convert with `* pi / 180`",
        "pingpong" | "ping_pong" => "write `b * triangle(x / (2 * b))`",
        "vec2" | "vec3" | "float3" | "rgb" => "write `(x, y)` or `(r, g, b)`",
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn describes_every_function_once() {
        for function in ALL.iter() {
            let Described { name, call, doc } = function.described;
            let shown = call.strip_prefix(name).unwrap();
            let takes = shown.trim_matches(['(', ')']).split(", ").filter(|a| !a.is_empty() && *a != "…").count();
            assert_eq!((name, takes), (function.name, *function.args.start()));
            assert!(doc.ends_with('.') || doc.ends_with('…'), "{name}");
        }
        let calls: Vec<_> = ALL.iter().map(|function| (function.name, *function.args.start())).collect();
        assert!(calls.windows(2).all(|pair| pair[0] < pair[1]), "{calls:?}");
    }

    #[test]
    fn finds_functions_by_name() {
        assert_eq!(find("random").map(<[_]>::len), Some(2));
        assert_eq!(find("abs").map(<[_]>::len), Some(1));
        assert!(find("ab").is_none() && find("zzz").is_none() && find("").is_none());
    }
}
