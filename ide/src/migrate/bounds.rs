//! Bounds of the values of formulas: which limits are not needed, and which results are finite.
//!
//! A result that is not finite counts as 0 where its node ends. A formula may therefore become a part of another one
//! only if its result is finite.
use super::fold::{Fold, fold};
use super::formula::Formula;
use super::words::{Base, Name, Word};

/// The known facts about a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bounds {
    /// No component is less.
    pub(super) lo: f64,
    /// No component is more.
    pub(super) hi: f64,
    /// True if it is finite everywhere.
    pub(super) finite: bool,
    /// True if it is the same everywhere.
    constant: bool,
}

impl Bounds {
    /// Any finite value.
    pub(super) const ANY: Self = Self::new(f64::NEG_INFINITY, f64::INFINITY);
    /// A share.
    const UNIT: Self = Self::new(0.0, 1.0);

    /// Finite values of a range.
    pub(super) const fn new(lo: f64, hi: f64) -> Self {
        Self { lo, hi, finite: true, constant: false }
    }

    /// True if all values lie within 0..1.
    pub(super) fn is_unit(self) -> bool {
        self.finite && self.lo >= 0.0 && self.hi <= 1.0
    }

    /// The bounds where the value is read. A number that is not finite counts as 0 there.
    pub(super) fn read(self) -> Self {
        if self.finite { self } else { Self { lo: self.lo.min(0.0), hi: self.hi.max(0.0), finite: true, ..self } }
    }

    fn constant(self) -> Self {
        Self { constant: true, ..self }
    }

    /// The value, if it is known.
    fn known(self) -> Option<f64> {
        (self.lo == self.hi).then_some(self.lo)
    }

    /// Values of a range that follow from others.
    fn of(lo: f64, hi: f64, from: &[Self]) -> Self {
        let (lo, hi) = if lo.is_nan() || hi.is_nan() { (f64::NEG_INFINITY, f64::INFINITY) } else { (lo, hi) };
        let (finite, constant) = (from.iter().all(|b| b.finite), from.iter().all(|b| b.constant));
        Self { lo, hi, finite, constant }
    }

    fn finite_if(self, finite: bool) -> Self {
        Self { finite: self.finite && finite, ..self }
    }

    /// The least range that has the values of both.
    fn hull(self, other: Self) -> Self {
        Self::of(self.lo.min(other.lo), self.hi.max(other.hi), &[self, other])
    }

    /// True if a division by it gives a result. A constant that nothing is known about is expected not to be 0.
    fn divides(self) -> bool {
        self.lo > 0.0 || self.hi < 0.0 || (self.constant && self.lo == f64::NEG_INFINITY && self.hi == f64::INFINITY)
    }

    fn times(self, other: Self) -> Self {
        let product = |a: f64, b: f64| if a == 0.0 || b == 0.0 { 0.0 } else { a * b };
        let ends = [
            product(self.lo, other.lo),
            product(self.lo, other.hi),
            product(self.hi, other.lo),
            product(self.hi, other.hi),
        ];
        let (lo, hi) = ends.into_iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), x| (lo.min(x), hi.max(x)));
        Self::of(lo, hi, &[self, other])
    }

    fn over(self, other: Self) -> Self {
        let divides = other.divides();
        let inverse = match divides && other.lo.is_finite() && other.hi.is_finite() {
            true => Self::of(1.0 / other.hi, 1.0 / other.lo, &[other]),
            false if other.lo > 0.0 => Self::of(0.0, 1.0 / other.lo, &[other]),
            false => Self::of(f64::NEG_INFINITY, f64::INFINITY, &[other]),
        };
        self.times(inverse).finite_if(divides)
    }

    fn power(self, exponent: Self) -> Self {
        let both = [self, exponent];
        let Some(n) = exponent.known() else {
            let lo = if self.lo >= 0.0 { 0.0 } else { f64::NEG_INFINITY };
            return Self::of(lo, f64::INFINITY, &both)
                .finite_if(self.lo > 0.0 || (self.lo >= 0.0 && exponent.lo >= 0.0));
        };
        let (whole, even) = (n == n.floor(), n % 2.0 == 0.0);
        let finite = (n >= 0.0 || self.divides()) && (whole || self.lo >= 0.0);
        let (a, b) = (self.lo.powf(n), self.hi.powf(n));
        let range = match (self.lo >= 0.0, even) {
            (true, _) if n >= 0.0 => Self::of(a, b, &both),
            (true, _) => Self::of(0.0, f64::INFINITY, &both),
            (false, true) if n >= 0.0 => Self::of(if self.hi < 0.0 { b } else { 0.0 }, a.max(b), &both),
            _ => Self::of(f64::NEG_INFINITY, f64::INFINITY, &both),
        };
        range.finite_if(finite)
    }
}

/// The bounds of a formula. `name` and `param` return those of names and parameters.
pub(super) fn bounds(
    formula: &Formula,
    name: &dyn Fn(&Name) -> Bounds,
    param: &dyn Fn(&str) -> Option<(f64, f64)>,
) -> Bounds {
    let unknown = Bounds { finite: false, ..Bounds::ANY };
    fold(&formula.words, &mut Ranges { name, param }).unwrap_or(unknown)
}

struct Ranges<'a> {
    name: &'a dyn Fn(&Name) -> Bounds,
    param: &'a dyn Fn(&str) -> Option<(f64, f64)>,
}

impl Fold for Ranges<'_> {
    type Value = Bounds;

    fn leaf(&mut self, word: &Word) -> Bounds {
        match word {
            Word::Number(number) => number.parse::<f64>().map_or(Bounds::ANY, |x| Bounds::new(x, x)).constant(),
            Word::Color(_) => Bounds::UNIT.constant(),
            Word::Param(name) => (self.param)(name).map_or(Bounds::ANY, |(lo, hi)| Bounds::new(lo, hi)).constant(),
            Word::Name(name) => match &name.base {
                Base::Text(text) if text == "pi" => Bounds::new(3.0, 4.0).constant(),
                Base::Text(text) if matches!(text.as_str(), "canvas.width" | "canvas.height") => {
                    Bounds::new(f64::MIN_POSITIVE, f64::INFINITY).constant()
                }
                _ => (self.name)(name),
            },
            _ => Bounds::ANY,
        }
    }

    fn sign(&mut self, sign: char, value: Bounds) -> Bounds {
        match sign {
            '-' => Bounds::of(-value.hi, -value.lo, &[value]),
            '!' => Bounds::of(0.0, 1.0, &[value]),
            _ => value,
        }
    }

    fn operator(&mut self, operator: &'static str, a: Bounds, b: Bounds) -> Bounds {
        match operator {
            "+" => Bounds::of(a.lo + b.lo, a.hi + b.hi, &[a, b]),
            "-" => Bounds::of(a.lo - b.hi, a.hi - b.lo, &[a, b]),
            "*" => a.times(b),
            "/" => a.over(b),
            "%" => {
                let range = if b.lo > 0.0 { Bounds::of(0.0, b.hi, &[a, b]) } else { Bounds::of(b.lo, -b.lo, &[a, b]) };
                range.finite_if(b.divides())
            }
            "^" => a.power(b),
            _ => Bounds::of(0.0, 1.0, &[a, b]),
        }
    }

    fn call(&mut self, function: &str, arguments: Vec<Bounds>) -> Bounds {
        let all = &arguments[..];
        let each = |f: fn(f64) -> f64| all.first().map_or(Bounds::ANY, |x| Bounds::of(f(x.lo), f(x.hi), all));
        let of = |lo: f64, hi: f64| Bounds::of(lo, hi, all);
        let any = of(f64::NEG_INFINITY, f64::INFINITY);
        match (function, all) {
            ("max", [first, rest @ ..]) => {
                let (lo, hi) = rest.iter().fold((first.lo, first.hi), |(lo, hi), b| (lo.max(b.lo), hi.max(b.hi)));
                of(lo, hi)
            }
            ("min", [first, rest @ ..]) => {
                let (lo, hi) = rest.iter().fold((first.lo, first.hi), |(lo, hi), b| (lo.min(b.lo), hi.min(b.hi)));
                of(lo, hi)
            }
            ("clamp", [x, lo, hi]) => of(x.lo.max(lo.lo).min(hi.hi), x.hi.min(hi.hi).max(lo.lo)),
            ("mix" | "lerp", [a, b, t]) if t.is_unit() => Bounds::of(a.hull(*b).lo, a.hull(*b).hi, all),
            ("if", [_, a, b]) => Bounds { constant: of(0.0, 0.0).constant, ..a.hull(*b) },
            ("abs", [x]) => {
                let least = if x.lo <= 0.0 && x.hi >= 0.0 { 0.0 } else { x.lo.abs().min(x.hi.abs()) };
                of(least, x.lo.abs().max(x.hi.abs()))
            }
            ("sqrt", [x]) => of(x.lo.max(0.0).sqrt(), x.hi.max(0.0).sqrt()).finite_if(x.lo >= 0.0),
            ("pow", [x, y]) => x.power(*y),
            ("exp", [x]) => each(f64::exp).finite_if(x.hi <= 88.0),
            ("log", [x]) => any.finite_if(x.lo > 0.0),
            ("tan", [x]) => any.finite_if(x.lo > -90.0 && x.hi < 90.0),
            ("asin" | "acos", [x]) => of(-90.0, 180.0).finite_if(x.lo >= -1.0 && x.hi <= 1.0),
            ("atan" | "atan2", _) => of(-180.0, 180.0),
            ("sin" | "cos" | "sign", _) => of(-1.0, 1.0),
            ("fract" | "smoothstep" | "step" | "random" | "hash" | "noise" | "triangle" | "saturated", _) => {
                of(0.0, 1.0)
            }
            ("positive", [x]) => of(x.lo.max(0.0), x.hi.max(0.0)),
            ("floor", _) => each(f64::floor),
            ("ceil", _) => each(f64::ceil),
            ("round", _) => each(f64::round),
            ("length", _) => of(0.0, f64::INFINITY),
            ("rotate" | "smooth_min" | "smooth_max" | "mix" | "lerp" | "dot" | "cross" | "luminance", _) => any,
            _ => any.finite_if(false),
        }
    }

    fn vector(&mut self, parts: Vec<Bounds>) -> Bounds {
        let first = parts.first().copied().unwrap_or(Bounds::ANY);
        parts.iter().fold(first, |all, part| all.hull(*part))
    }

    fn part(&mut self, value: Bounds, _path: &str) -> Bounds {
        value
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str) -> Bounds {
        let formula = Formula::read(text).expect("a formula");
        let name = |name: &Name| if name.base == Base::Text("unit".to_owned()) { Bounds::UNIT } else { Bounds::ANY };
        bounds(&formula, &name, &|param| (param == "wear").then_some((0.0, 1.0)))
    }

    #[test]
    fn follows_ranges() {
        for (text, lo, hi) in [
            ("0.44 * smoothstep(0, 1, a)", 0.0, 0.44),
            ("$wear * (1 - 0.75 * unit)", 0.0, 1.0),
            ("clamp(a, 0.25, 0.75) - 1", -0.75, -0.25),
            ("mix(unit, 3, unit)", 0.0, 3.0),
            ("max(a, 0) ^ 2", 0.0, f64::INFINITY),
            ("(a - 1) ^ 2", 0.0, f64::INFINITY),
            ("min($wear, 0.5) / 2", 0.0, 0.25),
            ("abs(unit - 2)", 1.0, 2.0),
            ("#fff * unit", 0.0, 1.0),
            ("-fract(a)", -1.0, 0.0),
            ("(unit, 2, -1)", -1.0, 2.0),
        ] {
            assert_eq!((of(text).lo, of(text).hi), (lo, hi), "{text}");
        }
    }

    #[test]
    fn tells_results_that_may_not_be_finite() {
        for text in [
            "a / b",
            "1 / $wear",
            "a % unit",
            "sqrt(a)",
            "log(a)",
            "a ^ 0.5",
            "a ^ -1",
            "1 + 1 / a",
            "tan(a)",
            "exp(a)",
            "let b = 1; b",
            "unknown(a)",
        ] {
            assert!(!of(text).finite, "{text}");
        }
        for text in [
            "a / 2",
            "a / $pitch",
            "a / canvas.width",
            "a / (1 + unit)",
            "sqrt(max(0, a))",
            "sqrt(a ^ 2 + b ^ 2)",
            "a ^ 3",
            "max(a, 0) ^ 0.7",
            "exp(-a ^ 2)",
            "log(unit + 1)",
            "a % 4",
            "smoothstep(a, b, c)",
        ] {
            assert!(of(text).finite, "{text}");
        }
    }
}
