//! Table of the kinds that formulas and other kinds replace.
//!
//! The kinds themselves may be gone, so the table has all that is known about them: their fields, their outputs, and
//! what each becomes. A rewrite is a formula whose names are the operands. Two functions exist only here: `positive(x)`
//! is `max(x, 0)` and `saturated(x)` is `clamp(x, 0, 1)`; where `x` cannot be outside, the limit is left out.
use shibo_node::registry::Registry;
use shibo_value::Type;

/// A kind that is replaced.
#[derive(Debug)]
pub(super) struct Removed {
    /// The kind.
    pub(super) kind: &'static str,
    /// Operands of its formulas.
    pub(super) operands: &'static [Operand],
    /// Its other fields.
    pub(super) fields: &'static [&'static str],
    /// Names of its outputs; the first is the main output.
    pub(super) outputs: &'static [(&'static str, Ty)],
    /// What it becomes.
    pub(super) rewrite: Rewrite,
}

/// A value that a formula computes with.
#[derive(Debug)]
pub(super) struct Operand {
    /// Its name in formulas.
    pub(super) name: &'static str,
    /// The fields that may have it, in the order of their priority.
    pub(super) fields: &'static [&'static str],
    /// The value if no field is given; without one, the operand is required.
    pub(super) default: Option<&'static str>,
}

/// Type of an output.
#[derive(Clone, Copy, Debug)]
pub(super) enum Ty {
    /// Always the same.
    Fixed(Type),
    /// The widest type of these fields.
    Like(&'static [&'static str]),
    /// Not known.
    Unknown,
}

/// The replacement of a kind.
#[derive(Debug)]
pub(super) enum Rewrite {
    /// A formula for each option of the field `operation`; the first option is its default.
    Operation(&'static [(&'static str, &'static str)]),
    /// The first formula whose operand is given; a formula without one is always possible.
    Formula(&'static [(Option<&'static str>, &'static str)]),
    /// The formula in the field `formula`.
    Expression,
    /// A channel of a material.
    Channel,
    /// The components of a vector.
    Split,
    /// A number and a colour.
    Constant,
    /// Another kind: its name, the new names of fields, and fields that are added if they are not given.
    Kind {
        kind: &'static str,
        renamed: &'static [(&'static str, &'static str)],
        added: &'static [(&'static str, &'static str)],
    },
}

const fn required(name: &'static str, fields: &'static [&'static str]) -> Operand {
    Operand { name, fields, default: None }
}

const fn optional(name: &'static str, fields: &'static [&'static str], default: &'static str) -> Operand {
    Operand { name, fields, default: Some(default) }
}

/// All kinds that are replaced.
pub(super) static REMOVED: [Removed; 11] = [
    Removed {
        kind: "Math",
        operands: &[required("a", &["a"]), optional("b", &["b"], "0"), optional("c", &["c"], "1")],
        fields: &["operation"],
        outputs: &[("result", Ty::Like(&["a", "b", "c"]))],
        rewrite: Rewrite::Operation(&[
            ("Add", "a + b"),
            ("Subtract", "a - b"),
            ("Multiply", "a * b"),
            ("Divide", "a / b"),
            ("MultiplyAdd", "c + a * b"),
            ("Min", "min(a, b)"),
            ("Max", "max(a, b)"),
            ("SmoothMin", "smooth_min(a, b, c)"),
            ("SmoothMax", "smooth_max(a, b, c)"),
            ("Power", "positive(a) ^ b"),
            ("Sqrt", "sqrt(positive(a))"),
            ("Exp", "exp(a)"),
            ("Log2", "log(max(a, 1.1754944e-38)) / log(2)"),
            ("Abs", "abs(a)"),
            ("Sign", "sign(a)"),
            ("Modulo", "a % b"),
            ("PingPong", "b * triangle(a / (2 * b))"),
            ("Floor", "floor(a)"),
            ("Ceil", "ceil(a)"),
            // `round` rounds halves away from 0.
            ("Round", "floor(a + 0.5)"),
            ("Fract", "fract(a)"),
            ("Snap", "if(b == 0, a, b * floor(a / b))"),
            ("Sin", "sin(a)"),
            ("Cos", "cos(a)"),
            ("Tan", "tan(a)"),
            ("Atan2", "atan2(a, b)"),
            ("Hypot", "sqrt(a ^ 2 + b ^ 2)"),
            ("Smoothstep", "smoothstep(b, c, a)"),
            ("Step", "step(b, a)"),
            ("Clamp", "clamp(a, b, c)"),
            ("Mix", "mix(a, b, c)"),
            ("Less", "a < b"),
            ("Greater", "a > b"),
        ]),
    },
    Removed {
        kind: "SolidMath",
        operands: &[
            required("a", &["a"]),
            optional("b", &["b", "b_value"], "1"),
            optional("c", &["c", "c_value"], "0"),
        ],
        fields: &["operation"],
        outputs: &[("value", Ty::Fixed(Type::Solid))],
        rewrite: Rewrite::Operation(&[
            ("Multiply", "a * b"),
            ("Add", "a + b"),
            ("Subtract", "a - b"),
            ("MultiplyAdd", "c + a * b"),
            ("Divide", "a / b"),
            ("Min", "min(a, b)"),
            ("Max", "max(a, b)"),
            ("Power", "positive(a) ^ b"),
            ("Fraction", "fract(a)"),
            ("Floor", "floor(a)"),
            ("Absolute", "abs(a)"),
            // `smoothstep` falls where its second edge is below the first.
            ("SmoothStep", "if(c > b, smoothstep(b, c, a), step(b, a))"),
            ("Sine", "sin(360 * a / b)"),
        ]),
    },
    Removed {
        kind: "Expression",
        operands: &[required("a", &["a"]), required("b", &["b"]), required("c", &["c"]), required("d", &["d"])],
        fields: &["formula", "seed"],
        outputs: &[("result", Ty::Unknown)],
        rewrite: Rewrite::Expression,
    },
    Removed {
        kind: "MixSolids",
        operands: &[required("a", &["a"]), required("b", &["b"]), optional("mask", &["mask", "amount"], "0.5")],
        fields: &[],
        outputs: &[("solid", Ty::Like(&["a", "b"]))],
        rewrite: Rewrite::Formula(&[(None, "mix(a, b, saturated(mask))")]),
    },
    Removed {
        kind: "MaterialChannel",
        operands: &[required("material", &["material"])],
        fields: &["channel"],
        outputs: &[("value", Ty::Fixed(Type::Gray)), ("rgb", Ty::Fixed(Type::Rgb))],
        rewrite: Rewrite::Channel,
    },
    Removed {
        kind: "SetChannels",
        operands: &[],
        fields: &[],
        outputs: &[("material", Ty::Fixed(Type::Material))],
        rewrite: Rewrite::Kind { kind: "Material", renamed: &[("material", "from")], added: &[] },
    },
    Removed {
        kind: "SplitChannels",
        operands: &[required("input", &["input"])],
        fields: &[],
        outputs: &[
            ("x", Ty::Fixed(Type::Gray)),
            ("y", Ty::Fixed(Type::Gray)),
            ("z", Ty::Fixed(Type::Gray)),
            ("r", Ty::Fixed(Type::Gray)),
            ("g", Ty::Fixed(Type::Gray)),
            ("b", Ty::Fixed(Type::Gray)),
        ],
        rewrite: Rewrite::Split,
    },
    Removed {
        kind: "MakeVector",
        operands: &[
            optional("x", &["x"], "0"),
            optional("y", &["y"], "0"),
            required("angle", &["angle"]),
            optional("length", &["length"], "1"),
        ],
        fields: &[],
        outputs: &[("vector", Ty::Fixed(Type::Vec2))],
        rewrite: Rewrite::Formula(&[(Some("angle"), "rotate((length, 0), angle)"), (None, "(x, y)")]),
    },
    Removed {
        kind: "PackChannels",
        operands: &[optional("r", &["r"], "0"), optional("g", &["g"], "0"), optional("b", &["b"], "0")],
        fields: &[],
        outputs: &[("color", Ty::Fixed(Type::Rgb))],
        rewrite: Rewrite::Formula(&[(None, "(r, g, b)")]),
    },
    Removed {
        kind: "Constant",
        operands: &[optional("value", &["value"], "0.5"), required("color", &["color"])],
        fields: &[],
        outputs: &[("value", Ty::Fixed(Type::Gray)), ("color", Ty::Fixed(Type::Rgb))],
        rewrite: Rewrite::Constant,
    },
    Removed {
        kind: "ColorSolid",
        operands: &[],
        fields: &[],
        outputs: &[("color", Ty::Fixed(Type::SolidColor))],
        rewrite: Rewrite::Kind {
            kind: "GradientMap",
            renamed: &[("solid", "input")],
            added: &[("stops", "[(0, (0.02, 0.01, 0.006)), (1, (0.8, 0.6, 0.4))]")],
        },
    },
];

/// The entry of a kind; `None` if graphs may use it, for example because a pack has a kind of this name.
pub(super) fn removed(kind: &str, registry: &Registry) -> Option<&'static Removed> {
    REMOVED.iter().find(|removed| removed.kind == kind && registry.info(kind).is_none())
}

impl Removed {
    /// True if it becomes a formula.
    pub(super) fn is_formula(&self) -> bool {
        !matches!(self.rewrite, Rewrite::Kind { .. })
    }

    /// The index of an output; the main one without a name.
    pub(super) fn output(&self, name: Option<&str>) -> Option<usize> {
        match name {
            None => Some(0),
            Some(name) => self.outputs.iter().position(|(output, _)| *output == name),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::formula::Formula;
    use super::super::words::Base;
    use super::*;

    #[test]
    fn formulas_name_only_operands() {
        for removed in &REMOVED {
            let formulas: Vec<&str> = match &removed.rewrite {
                Rewrite::Operation(table) => table.iter().map(|(_, formula)| *formula).collect(),
                Rewrite::Formula(table) => table.iter().map(|(_, formula)| *formula).collect(),
                _ => Vec::new(),
            };
            for text in formulas {
                let formula = Formula::read(text).expect(text);
                for name in formula.names() {
                    let known = removed.operands.iter().any(|operand| name.base == Base::Text(operand.name.to_owned()));
                    assert!(known, "{}: {text}", removed.kind);
                }
            }
        }
    }
}
