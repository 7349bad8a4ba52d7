//! Puts operands into the formula of an operation, as an author would write it: constants first in products, base first
//! in sums, a difference in place of a negative factor. Only steps that keep the bits of the result are made.
use super::fold::{Fold, fold};
use super::formula::{Formula, listed};
use super::words::{POWER, PRODUCT, SIGN, SUM, Word, binding};

/// The formula of an operation with its operands.
pub(super) fn instance(template: &Formula, operand: &dyn Fn(&str) -> Formula) -> Option<Formula> {
    fold(&template.words, &mut Terms { operand })
}

struct Terms<'o> {
    operand: &'o dyn Fn(&str) -> Formula,
}

impl Fold for Terms<'_> {
    type Value = Formula;

    fn leaf(&mut self, word: &Word) -> Formula {
        use super::words::Base;
        match word {
            Word::Name(name) => match &name.base {
                Base::Text(text) => (self.operand)(text),
                _ => Formula::of(word.clone()),
            },
            _ => Formula::of(word.clone()),
        }
    }

    fn sign(&mut self, sign: char, value: Formula) -> Formula {
        match sign {
            '-' => value.negated(),
            _ => joined(vec![Word::Sign(sign)], bracket(value, POWER)),
        }
    }

    fn operator(&mut self, operator: &'static str, left: Formula, right: Formula) -> Formula {
        match operator {
            "+" => sum(left, right),
            "-" => difference(left, right),
            "*" => product(left, right),
            "/" if right.literal() == Some(1.0) => left,
            _ => binary(operator, left, right),
        }
    }

    fn call(&mut self, function: &str, mut arguments: Vec<Formula>) -> Formula {
        if let ("if", [condition, ..]) = (function, &arguments[..])
            && let Some(yes) = decided(condition)
            && arguments.len() == 3
        {
            return arguments.swap_remove(if yes { 1 } else { 2 });
        }
        if matches!(function, "min" | "max") {
            arguments = arguments
                .into_iter()
                .flat_map(|argument| argument.arguments(function).unwrap_or_else(|| vec![argument]))
                .collect();
        }
        call(function, arguments)
    }

    fn vector(&mut self, parts: Vec<Formula>) -> Formula {
        enclosed(vec![Word::Open], parts)
    }

    fn part(&mut self, value: Formula, path: &str) -> Formula {
        value.part(&format!(".{path}"))
    }
}

/// A call of a function.
pub(super) fn call(function: &str, arguments: Vec<Formula>) -> Formula {
    enclosed(vec![Word::Function(function.to_owned()), Word::Open], arguments)
}

fn enclosed(mut words: Vec<Word>, parts: Vec<Formula>) -> Formula {
    words.extend(listed(parts));
    words.push(Word::Close);
    Formula { words }
}

fn joined(mut words: Vec<Word>, formula: Formula) -> Formula {
    words.extend(formula.words);
    Formula { words }
}

fn bracket(formula: Formula, least: u8) -> Formula {
    if formula.binds() >= least {
        return formula;
    }
    enclosed(vec![Word::Open], vec![formula])
}

/// An operator between two values, with brackets where needed.
fn binary(operator: &'static str, left: Formula, right: Formula) -> Formula {
    let binds = binding(operator);
    // Powers group from the right; comparisons do not chain.
    let (least_left, least_right) = match operator {
        "^" => (binds + 1, binds),
        "+" | "-" | "*" | "/" | "%" | "&&" | "||" => (binds, binds + 1),
        _ => (binds + 1, binds + 1),
    };
    let mut words = bracket(left, least_left).words;
    words.push(Word::Operator(operator));
    words.extend(bracket(right, least_right).words);
    Formula { words }
}

/// A sum. Its sides change places where that saves brackets.
fn sum(a: Formula, b: Formula) -> Formula {
    if b.literal() == Some(0.0) {
        return a;
    }
    if a.literal() == Some(0.0) {
        return b;
    }
    if b.is_negative() {
        return difference(a, b.negated());
    }
    if a.is_negative() {
        return difference(b, a.negated());
    }
    // `0.16 * waves + 0.02`, but `$finish + 0.18 * mask`.
    let number_first = a.literal().is_some() && b.literal().is_none();
    let swaps = number_first || (b.binds() == SUM && a.binds() != SUM);
    let (a, b) = if swaps && a.binds() >= SUM { (b, a) } else { (a, b) };
    binary("+", a, b)
}

fn difference(a: Formula, b: Formula) -> Formula {
    if b.literal() == Some(0.0) {
        return a;
    }
    if b.is_negative() {
        return sum(a, b.negated());
    }
    binary("-", a, b)
}

/// A product, with a constant first.
fn product(a: Formula, b: Formula) -> Formula {
    // Numbers of the operation and of its operands.
    if let (Some(a), Some(b)) = (a.literal(), b.literal()) {
        return Formula::number(&format!("{}", a * b));
    }
    let (a, b) = if b.is_constant() && (!a.is_constant() || b.literal().is_some()) { (b, a) } else { (a, b) };
    match a.literal() {
        Some(1.0) => return b,
        Some(-1.0) => return b.negated(),
        _ => {}
    }
    // A product on the right would need brackets.
    let (a, b) = if b.binds() == PRODUCT && a.binds() != PRODUCT { (b, a) } else { (a, b) };
    binary("*", a, b)
}

/// A constant with its number first: `$pitch * -0.1` becomes `-0.1 * $pitch`.
pub(super) fn ordered(constant: Formula) -> Formula {
    let mut factors = vec![Vec::new()];
    let mut depth = 0_usize;
    for word in &constant.words {
        match word {
            Word::Open => depth += 1,
            Word::Close => depth = depth.saturating_sub(1),
            Word::Operator("*") if depth == 0 => {
                factors.push(Vec::new());
                continue;
            }
            _ => {}
        }
        if let Some(factor) = factors.last_mut() {
            factor.push(word.clone());
        }
    }
    let mut factors: Vec<Formula> = factors.into_iter().map(|words| Formula { words }).collect();
    let numbers: Vec<usize> = (0..factors.len()).filter(|at| factors[*at].literal().is_some()).collect();
    // Signs and other operators between the factors belong to several of them.
    let [number] = numbers[..] else { return constant };
    let plain = factors.iter().enumerate().all(|(at, factor)| at == number || factor.binds() > SIGN);
    if number == 0 || !plain || !constant.is_constant() {
        return constant;
    }
    let number = factors.remove(number);
    factors.into_iter().fold(number, |product, factor| binary("*", product, factor))
}

/// The value of a comparison of two numbers.
fn decided(condition: &Formula) -> Option<bool> {
    let at = condition.words.iter().position(|word| matches!(word, Word::Operator(_)))?;
    let side = |words: &[Word]| Formula { words: words.to_vec() }.literal();
    let (a, b) = (side(&condition.words[..at])?, side(&condition.words[at + 1..])?);
    match condition.words[at] {
        Word::Operator("==") => Some(a == b),
        Word::Operator(">") => Some(a > b),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::super::words::{Base, Name};
    use super::*;

    fn made(template: &str, a: &str, b: &str, c: &str) -> String {
        let operand = |name: &str| {
            let text = [("a", a), ("b", b), ("c", c)].into_iter().find(|(known, _)| *known == name).expect("known").1;
            ordered(Formula::read(text).expect("a formula"))
        };
        let made = instance(&Formula::read(template).expect("a formula"), &operand).expect("no local names");
        made.text(&|name: &Name| match &name.base {
            Base::Text(text) => format!("{text}{}", name.rest),
            _ => String::new(),
        })
    }

    #[test]
    fn writes_sums_as_an_author_would() {
        for (a, b, c, expected) in [
            ("waves", "0.16", "-0.08", "0.16 * waves - 0.08"),
            ("waves", "0.16", "0.08", "0.16 * waves + 0.08"),
            ("folds", "-0.16 * $folds", "h", "h - 0.16 * $folds * folds"),
            ("folds", "$folds * -0.16", "h", "h - 0.16 * $folds * folds"),
            ("fold", "$pitch * -0.016 * $skin", "h", "h - 0.016 * $pitch * $skin * fold"),
            ("fold", "$pitch * 2 ^ 3", "h", "h + $pitch * 2 ^ 3 * fold"),
            ("open", "0.18", "$finish", "$finish + 0.18 * open"),
            ("late", "-0.05", "0.45", "0.45 - 0.05 * late"),
            ("sap", "-1", "1", "1 - sap"),
            ("sap", "1", "0", "sap"),
            ("x + y", "k", "p + q", "p + q + (x + y) * k"),
            ("p * q", "2", "x", "x + p * q * 2"),
            ("p * q", "r * s", "0", "p * q * (r * s)"),
            ("p / q", "$k", "0", "p / q * $k"),
        ] {
            assert_eq!(made("c + a * b", a, b, c), expected, "{a} * {b} + {c}");
        }
        assert_eq!(made("a + b", "x", "p - q", ""), "p - q + x");
        assert_eq!(made("a + b", "-2 * x", "-3 * y", ""), "-2 * x - 3 * y");
        assert_eq!(made("a - b", "x", "p - q", ""), "x - (p - q)");
        assert_eq!(made("a - b", "x", "-0.5", ""), "x + 0.5");
    }

    #[test]
    fn computes_with_numbers_of_the_operation() {
        assert_eq!(made("b * triangle(a / (2 * b))", "x", "0.75", ""), "0.75 * triangle(x / 1.5)");
        assert_eq!(made("b * triangle(a / (2 * b))", "x", "0.5", ""), "0.5 * triangle(x)");
        assert_eq!(made("b * triangle(a / (2 * b))", "x", "$p", ""), "$p * triangle(x / (2 * $p))");
        assert_eq!(made("if(b == 0, a, b * floor(a / b))", "x", "0.25", ""), "0.25 * floor(x / 0.25)");
        assert_eq!(made("if(b == 0, a, b * floor(a / b))", "x", "0", ""), "x");
        assert_eq!(made("if(c > b, smoothstep(b, c, a), step(b, a))", "x", "0.4", "0.8"), "smoothstep(0.4, 0.8, x)");
        assert_eq!(made("if(c > b, smoothstep(b, c, a), step(b, a))", "x", "0.8", "0.4"), "step(0.8, x)");
        assert_eq!(made("max(a, b)", "max(x, y)", "z", ""), "max(x, y, z)");
        assert_eq!(made("max(a, b)", "max(x, y) + 1", "z", ""), "max(max(x, y) + 1, z)");
    }
}
