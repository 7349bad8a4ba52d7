//! The functions and constants of expressions.
use std::ops::RangeInclusive;

/// Something with a name: a function, or a constant, which takes nothing.
#[derive(Debug)]
pub(super) struct Function {
    pub(super) name: &'static str,
    /// How many values it takes.
    pub(super) args: RangeInclusive<usize>,
    pub(super) value: fn(&[f64]) -> f64,
}

impl PartialEq for Function {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Function {
    /// How many values it takes, in words.
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

const fn function(name: &'static str, args: RangeInclusive<usize>, value: fn(&[f64]) -> f64) -> Function {
    Function { name, args, value }
}

const ANY: RangeInclusive<usize> = 1..=usize::MAX;

/// All of them. Angles are degrees. `libm` has the same bits on every machine.
pub(super) static ALL: &[Function] = &[
    function("abs", 1..=1, |a| a[0].abs()),
    function("ceil", 1..=1, |a| a[0].ceil()),
    function("clamp", 3..=3, |a| a[0].max(a[1]).min(a[2])),
    function("cos", 1..=1, |a| libm::cos(a[0].to_radians())),
    function("floor", 1..=1, |a| a[0].floor()),
    function("lerp", 3..=3, |a| a[0] + (a[1] - a[0]) * a[2]),
    function("max", ANY, |a| a.iter().copied().fold(f64::NEG_INFINITY, f64::max)),
    function("min", ANY, |a| a.iter().copied().fold(f64::INFINITY, f64::min)),
    function("pi", 0..=0, |_| std::f64::consts::PI),
    function("round", 1..=1, |a| a[0].round()),
    function("sin", 1..=1, |a| libm::sin(a[0].to_radians())),
    function("sqrt", 1..=1, |a| libm::sqrt(a[0])),
];

/// The one of that name.
pub(super) fn find(name: &str) -> Option<&'static Function> {
    ALL.iter().find(|function| function.name == name)
}
