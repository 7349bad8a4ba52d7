//! Walks a formula from its values to its whole, without recursion.
use super::words::{SIGN, Word, binding};

/// Values that a walk computes.
pub(super) trait Fold {
    /// The value of a part.
    type Value;

    /// A number, a colour, a parameter or a name.
    fn leaf(&mut self, word: &Word) -> Self::Value;
    /// A sign before a value.
    fn sign(&mut self, sign: char, value: Self::Value) -> Self::Value;
    /// An operator between two values.
    fn operator(&mut self, operator: &'static str, left: Self::Value, right: Self::Value) -> Self::Value;
    /// A call.
    fn call(&mut self, function: &str, arguments: Vec<Self::Value>) -> Self::Value;
    /// A vector.
    fn vector(&mut self, parts: Vec<Self::Value>) -> Self::Value;
    /// Components of a value.
    fn part(&mut self, value: Self::Value, path: &str) -> Self::Value;
}

/// A part that waits for its right end.
enum Open<'w> {
    Sign(char),
    Operator(&'static str),
    /// A bracket, perhaps of a call, with the number of values below it.
    Bracket(Option<&'w str>, usize),
}

/// The value of a formula; `None` if it has local names.
pub(super) fn fold<F: Fold>(words: &[Word], fold: &mut F) -> Option<F::Value> {
    let mut values: Vec<F::Value> = Vec::new();
    let mut open: Vec<Open<'_>> = Vec::new();
    let mut function = None;
    for word in words {
        match word {
            Word::Number(_) | Word::Color(_) | Word::Param(_) | Word::Name(_) => values.push(fold.leaf(word)),
            Word::Function(name) => function = Some(name.as_str()),
            Word::Open => open.push(Open::Bracket(function.take(), values.len())),
            Word::Sign(sign) => open.push(Open::Sign(*sign)),
            Word::Operator(operator) => {
                // Powers group from the right.
                let least = binding(operator) + u8::from(*operator == "^");
                complete(least, &mut open, &mut values, fold)?;
                open.push(Open::Operator(operator));
            }
            Word::Comma => complete(0, &mut open, &mut values, fold)?,
            Word::Close => {
                complete(0, &mut open, &mut values, fold)?;
                let Some(Open::Bracket(function, below)) = open.pop() else { return None };
                let mut parts = values.split_off(below.min(values.len()));
                let value = match (function, parts.len()) {
                    (Some(function), _) => fold.call(function, parts),
                    (None, 1) => parts.pop()?,
                    (None, _) => fold.vector(parts),
                };
                values.push(value);
            }
            Word::Part(path) => {
                let value = values.pop()?;
                values.push(fold.part(value, path));
            }
            Word::Let(_) | Word::Semicolon => return None,
        }
    }
    complete(0, &mut open, &mut values, fold)?;
    values.pop()
}

/// Completes signs and operators of at least this binding, up to the last bracket.
fn complete<F: Fold>(least: u8, open: &mut Vec<Open<'_>>, values: &mut Vec<F::Value>, fold: &mut F) -> Option<()> {
    loop {
        let value = match open.last() {
            Some(Open::Sign(sign)) if SIGN >= least => fold.sign(*sign, values.pop()?),
            Some(Open::Operator(operator)) if binding(operator) >= least => {
                let right = values.pop()?;
                fold.operator(operator, values.pop()?, right)
            }
            _ => return Some(()),
        };
        open.pop();
        values.push(value);
    }
}

#[cfg(test)]
mod tests {
    use super::super::words::read;
    use super::*;

    /// Writes all brackets.
    struct Brackets;

    impl Fold for Brackets {
        type Value = String;

        fn leaf(&mut self, word: &Word) -> String {
            super::super::words::write(std::slice::from_ref(word), &|name| format!("{:?}", name.base))
                .replace("Text(\"", "")
                .replace("\")", "")
        }

        fn sign(&mut self, sign: char, value: String) -> String {
            format!("({sign}{value})")
        }

        fn operator(&mut self, operator: &'static str, left: String, right: String) -> String {
            format!("({left}{operator}{right})")
        }

        fn call(&mut self, function: &str, arguments: Vec<String>) -> String {
            format!("{function}[{}]", arguments.join(" "))
        }

        fn vector(&mut self, parts: Vec<String>) -> String {
            format!("<{}>", parts.join(" "))
        }

        fn part(&mut self, value: String, path: &str) -> String {
            format!("{value}.{path}")
        }
    }

    #[test]
    fn groups_operators_by_precedence() {
        for (text, expected) in [
            ("-a ^ 2 * b + c", "(((-(a^2))*b)+c)"),
            ("a ^ b ^ c", "(a^(b^c))"),
            ("a - b - c", "((a-b)-c)"),
            ("2 ^ -a", "(2^(-a))"),
            ("!a || b < c && d", "((!a)||((b<c)&&d))"),
            ("f(a + b, (c, d).y) / g()", "(f[(a+b) <c d>.y]/g[])"),
            ("(a)", "a"),
        ] {
            let words = read(text).expect("a formula");
            assert_eq!(fold(&words, &mut Brackets).as_deref(), Some(expected), "{text}");
        }
        assert_eq!(fold(&read("let a = 1; a").expect("a formula"), &mut Brackets), None);
    }
}
