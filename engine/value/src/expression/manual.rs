//! Manual of the functions and constants of expressions.
use super::functions;

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

const fn of(name: &'static str, call: &'static str, doc: &'static str) -> Described {
    Described { name, call, doc }
}

/// All functions and constants.
static ALL: &[Described] = &[
    of("abs", "abs(x)", "The number without its sign."),
    of("acos", "acos(x)", "The angle in degrees whose cosine is `x`."),
    of("asin", "asin(x)", "The angle in degrees whose sine is `x`."),
    of("atan", "atan(x)", "The angle in degrees whose tangent is `x`."),
    of("atan2", "atan2(y, x)", "The angle in degrees of the vector `(x, y)`."),
    of("ceil", "ceil(x)", "The next whole number above."),
    of("clamp", "clamp(x, lo, hi)", "`x`, but not less than `lo` and not more than `hi`."),
    of("cos", "cos(angle)", "The cosine of an angle in degrees."),
    of("exp", "exp(x)", "e to the power of `x`."),
    of("false", "false", "0."),
    of("floor", "floor(x)", "The next whole number below."),
    of("fract", "fract(x)", "What is left of `x` after `floor(x)` is taken away."),
    of(
        "hash",
        "hash(a, …)",
        "A random number, 0 ≤ r < 1, that depends on all components of its values and on the seed.",
    ),
    of("if", "if(condition, a, b)", "`a` where the condition is not 0, else `b`."),
    of("length", "length(a, …)", "The length of the vector of all components of its values."),
    of("lerp", "lerp(a, b, t)", "The same as `mix`."),
    of("log", "log(x)", "The natural logarithm."),
    of("max", "max(a, …)", "The largest of its values."),
    of("min", "min(a, …)", "The smallest of its values."),
    of("mix", "mix(a, b, t)", "`a` where `t` is 0, `b` where it is 1, and between."),
    of("noise", "noise(x, y)", "Smooth noise from 0 to 1 with cells of size 1."),
    of("pi", "pi", "3.14159…"),
    of("pow", "pow(x, y)", "`x` to the power of `y`."),
    of("random", "random(i)", "A random number, 0 ≤ r < 1, that depends on `i` and on the seed."),
    of("round", "round(x)", "The nearest whole number; halves go away from 0."),
    of("sign", "sign(x)", "-1, 0 or 1."),
    of("sin", "sin(angle)", "The sine of an angle in degrees."),
    of("smoothstep", "smoothstep(e0, e1, x)", "0 below `e0`, 1 above `e1`, and a smooth step between."),
    of("sqrt", "sqrt(x)", "The square root."),
    of("step", "step(edge, x)", "0 below the edge, else 1."),
    of("tan", "tan(angle)", "The tangent of an angle in degrees."),
    of("true", "true", "1."),
];

/// The functions and constants of expressions, by name.
pub fn described() -> &'static [Described] {
    debug_assert_eq!(ALL.len(), functions::ALL.len(), "every function is described");
    ALL
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_function_is_described() {
        let names: Vec<_> = functions::ALL.iter().map(|function| function.name).collect();
        assert_eq!(ALL.iter().map(|d| d.name).collect::<Vec<_>>(), names);
        for (described, function) in ALL.iter().zip(functions::ALL) {
            let shown = described.call.strip_prefix(described.name).unwrap();
            let takes = shown.trim_matches(['(', ')']).split(", ").filter(|a| !a.is_empty() && *a != "…").count();
            assert_eq!(takes, *function.args.start(), "{}", described.name);
            assert!(described.doc.ends_with('.') || described.doc.ends_with('…'), "{}", described.name);
        }
    }
}
