//! Expressions in parameters: `"= $pitch * 2"`.
//!
//! `+ - * / % ^`, brackets, the constant `pi`, and the functions of [`FUNCTIONS`]; `sin` and `cos` take degrees, as angles
//! do everywhere in graph files. `^` binds tighter than a minus sign in front and groups from the right, as in mathematics.
//!
//! The crate `fasteval` does the work (MIT, no dependencies, no unsafe code, limits on depth and length, names its rest on
//! failure). Compared with it: `exmex` misreads `min(1, max(2, 3))` and `2^3^2` and knows neither `1e-3` nor functions of
//! three arguments; `evalexpr` divides whole numbers as such and is AGPL in its current versions; `meval` has been left
//! alone since 2018. What `fasteval` cannot do is done here by rewriting: names are looked up first, so that every unknown
//! one is reported at its place, and a minus sign in front of a power is put in brackets with it.
use crate::diagnostics::{Code, suggest};
use std::ops::Range;

/// Something wrong in an expression: the bytes at fault.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ExprError {
    /// The class of the error.
    pub(super) code: Code,
    /// Where, in bytes of the expression.
    pub(super) range: Range<usize>,
    /// What is wrong.
    pub(super) message: String,
    /// What to do about it.
    pub(super) help: Option<String>,
}

type Function = fn(&[f64]) -> f64;

/// Name, the smallest and largest number of arguments, and what it does.
const FUNCTIONS: &[(&str, usize, usize, Function)] = &[
    ("abs", 1, 1, |a| a[0].abs()),
    ("ceil", 1, 1, |a| a[0].ceil()),
    ("clamp", 3, 3, |a| a[0].max(a[1]).min(a[2])),
    ("cos", 1, 1, |a| libm::cos(a[0].to_radians())),
    ("floor", 1, 1, |a| a[0].floor()),
    ("lerp", 3, 3, |a| a[0] + (a[1] - a[0]) * a[2]),
    ("max", 1, 16, |a| a.iter().copied().fold(f64::NEG_INFINITY, f64::max)),
    ("min", 1, 16, |a| a.iter().copied().fold(f64::INFINITY, f64::min)),
    ("round", 1, 1, |a| a[0].round()),
    ("sin", 1, 1, |a| libm::sin(a[0].to_radians())),
    ("sqrt", 1, 1, |a| libm::sqrt(a[0])),
];

/// What the name of a parameter stands for.
pub(super) enum Lookup {
    /// A number.
    Number(f64),
    /// There is none of that name, or it is no number.
    Wrong(Code, String, Option<String>),
    /// Its value is in error, which was reported.
    Broken,
}

/// The value of `text`; an empty list of errors if it is unknown because of errors reported before.
pub(super) fn evaluate(text: &str, mut lookup: impl FnMut(&str) -> Lookup) -> Result<f64, Vec<ExprError>> {
    let words = scan(text)?;
    let mut values = Vec::new();
    let (mut errors, mut broken) = (Vec::new(), false);
    for word in &words {
        let name = &text[word.range.clone()];
        match word.kind {
            Kind::Param => match lookup(&name[1..]) {
                Lookup::Number(value) => values.push((name, value)),
                Lookup::Wrong(code, message, help) => {
                    errors.push(ExprError { code, range: word.range.clone(), message, help });
                }
                Lookup::Broken => broken = true,
            },
            Kind::Name => errors.extend(unknown_name(name, word.range.clone())),
            _ => {}
        }
    }
    if broken || !errors.is_empty() {
        return Err(errors);
    }
    let value = compute(text, &rewrite(text, &words), &values).map_err(|e| vec![e])?;
    if value.is_finite() {
        return Ok(value);
    }
    let what = if value.is_nan() { "not a number" } else { "infinite" };
    Err(vec![ExprError {
        code: Code::NotFinite,
        range: 0..text.len(),
        message: format!("`{}` is {what}", text.trim()),
        help: None,
    }])
}

fn bad(range: Range<usize>, message: impl Into<String>) -> ExprError {
    ExprError { code: Code::BadExpression, range, message: message.into(), help: None }
}

fn unknown_name(name: &str, range: Range<usize>) -> Option<ExprError> {
    let known = FUNCTIONS.iter().any(|f| f.0 == name) || name == "pi";
    let names: Vec<_> = FUNCTIONS.iter().map(|f| f.0).chain(["pi"]).collect();
    let help = suggest(name, "function", &names);
    let message = format!("there is no function `{name}`; a parameter is written `${name}`");
    (!known).then(|| ExprError { help: Some(help), ..bad(range, message) })
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Number,
    Param,
    Name,
    Open,
    Close,
    Operator(char),
}

#[derive(Debug)]
struct Word {
    kind: Kind,
    range: Range<usize>,
}

fn scan(text: &str) -> Result<Vec<Word>, Vec<ExprError>> {
    let is_word = |c: char| c == '_' || c.is_ascii_alphanumeric();
    let mut words: Vec<Word> = Vec::new();
    let mut at = 0;
    while let Some(c) = text[at..].chars().next() {
        let rest = &text[at..];
        let run = |from: usize| from + rest[from..].find(|c| !is_word(c)).unwrap_or(rest.len() - from);
        let (kind, len) = match c {
            c if c.is_whitespace() => {
                at += c.len_utf8();
                continue;
            }
            '$' => (Kind::Param, run(1)),
            '0'..='9' | '.' => {
                let len = number_len(rest);
                if rest[..len].parse::<f64>().is_err() {
                    return Err(vec![bad(at..at + len, format!("`{}` is not a number", &rest[..len]))]);
                }
                (Kind::Number, len)
            }
            c if is_word(c) => (Kind::Name, run(0)),
            '(' => (Kind::Open, 1),
            ')' => (Kind::Close, 1),
            '+' | '-' | '*' | '/' | '%' | '^' | ',' => (Kind::Operator(c), 1),
            c => return Err(vec![bad(at..at + c.len_utf8(), format!("`{c}` has no meaning in an expression"))]),
        };
        words.push(Word { kind, range: at..at + len });
        at += len;
    }
    Ok(words)
}

fn number_len(text: &str) -> usize {
    let mut last = ' ';
    for (i, c) in text.char_indices() {
        let sign = matches!(c, '+' | '-') && matches!(last, 'e' | 'E');
        if !(c.is_ascii_alphanumeric() || c == '.' || sign) {
            return i;
        }
        last = c;
    }
    text.len()
}

/// A text for `fasteval`, and for each of its bytes the byte of the original that it comes from.
struct Rewritten {
    text: String,
    from: Vec<usize>,
}

impl Rewritten {
    fn push(&mut self, text: &str, from: usize) {
        self.text.push_str(text);
        self.from.extend(std::iter::repeat_n(from, text.len()));
    }
}

/// Spells names so that they cannot be mistaken for those of `fasteval`, and writes `-a^b` as `(0-a^b)`.
fn rewrite(text: &str, words: &[Word]) -> Rewritten {
    let mut out = Rewritten { text: String::new(), from: Vec::new() };
    let mut closing = vec![0_usize; words.len() + 1];
    for (i, word) in words.iter().enumerate() {
        let at = word.range.start;
        out.push(&")".repeat(closing[i]), at);
        match (word.kind, power_end(words, i)) {
            (Kind::Operator('-'), Some(end)) => {
                out.push("(0-", at);
                closing[end] += 1;
            }
            (Kind::Param, _) => out.push(&format!("P_{}", &text[at + 1..word.range.end]), at),
            (Kind::Name, _) => out.push(&format!("F_{}", &text[word.range.clone()]), at),
            _ => out.push(&text[word.range.clone()], at),
        }
        out.push(" ", word.range.end);
    }
    out.push(&")".repeat(closing[words.len()]), text.len());
    out
}

/// If word `i` is a minus sign in front of a power, the index of the word after that power.
fn power_end(words: &[Word], i: usize) -> Option<usize> {
    let operand_before = i > 0 && !matches!(words[i - 1].kind, Kind::Operator(_) | Kind::Open);
    let mut end = primary_end(words, i + 1)?;
    if operand_before || words.get(end)?.kind != Kind::Operator('^') {
        return None;
    }
    while words.get(end).is_some_and(|w| w.kind == Kind::Operator('^')) {
        let mut next = end + 1;
        while words.get(next).is_some_and(|w| matches!(w.kind, Kind::Operator('-' | '+'))) {
            next += 1;
        }
        end = primary_end(words, next)?;
    }
    Some(end)
}

/// The index of the word after the number, name, call or bracket at `i`.
fn primary_end(words: &[Word], i: usize) -> Option<usize> {
    let open = match words.get(i)?.kind {
        Kind::Number | Kind::Param => return Some(i + 1),
        Kind::Name if words.get(i + 1).is_none_or(|w| w.kind != Kind::Open) => return Some(i + 1),
        Kind::Name => i + 1,
        Kind::Open => i,
        _ => return None,
    };
    let mut depth = 0_usize;
    for (j, word) in words.iter().enumerate().skip(open) {
        match word.kind {
            Kind::Open => depth += 1,
            Kind::Close if depth == 1 => return Some(j + 1),
            Kind::Close => depth -= 1,
            _ => {}
        }
    }
    None
}

fn compute(original: &str, rewritten: &Rewritten, values: &[(&str, f64)]) -> Result<f64, ExprError> {
    let mut wrong_count = None;
    let mut names = |name: &str, args: Vec<f64>| -> Option<f64> {
        if let Some(param) = name.strip_prefix("P_") {
            return values.iter().find(|(name, _)| &name[1..] == param).map(|(_, value)| *value);
        }
        let name = name.strip_prefix("F_")?;
        if name == "pi" && args.is_empty() {
            return Some(std::f64::consts::PI);
        }
        let (_, least, most, function) = FUNCTIONS.iter().find(|f| f.0 == name)?;
        if !(*least..=*most).contains(&args.len()) {
            let count = if least == most { least.to_string() } else { format!("at least {least}") };
            wrong_count = Some((name.to_owned(), format!("`{name}` takes {count} values; found {}", args.len())));
            return None;
        }
        Some(function(&args))
    };
    let result = fasteval::ez_eval(&rewritten.text, &mut names);
    let error = match result {
        Ok(value) => return Ok(value),
        Err(error) => error,
    };
    if let Some((name, message)) = wrong_count {
        let start = original.find(&name).unwrap_or(0);
        return Err(bad(start..start + name.len(), message));
    }
    Err(explain(original, rewritten, &error))
}

fn explain(original: &str, rewritten: &Rewritten, error: &fasteval::Error) -> ExprError {
    use fasteval::Error as E;
    let whole = 0..original.len();
    match error {
        E::UnparsedTokensRemaining(rest) => {
            let at = rewritten.text.len() - rest.trim_start().len().min(rewritten.text.len());
            let start = rewritten.from.get(at).copied().unwrap_or(original.len());
            let end = start + original[start..].chars().next().map_or(0, char::len_utf8);
            bad(start..end, format!("`{}` cannot stand here", &original[start..end]))
        }
        E::EOF | E::EofWhileParsing(_) if original.trim().is_empty() => bad(whole, "the expression is empty"),
        E::EOF | E::EofWhileParsing(_) => bad(original.len()..original.len(), "the expression ends too early"),
        E::TooLong | E::TooDeep => bad(whole, "the expression is too long or too deep"),
        E::ParseF64(word) => {
            let start = original.find(word.as_str()).unwrap_or(0);
            bad(start..(start + word.len()).min(original.len()), format!("`{word}` is not a number"))
        }
        _ => bad(whole, format!("`{}` cannot be read as an expression", original.trim())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(text: &str) -> f64 {
        let lookup = |name: &str| match name {
            "x" => Lookup::Number(3.0),
            "broken" => Lookup::Broken,
            _ => Lookup::Wrong(Code::UnknownParam, format!("no {name}"), None),
        };
        evaluate(text, lookup).unwrap_or_else(|e| panic!("{text}: {e:?}"))
    }

    fn error(text: &str) -> (Code, Range<usize>) {
        let lookup = |_: &str| Lookup::Wrong(Code::UnknownParam, String::new(), None);
        let errors = evaluate(text, lookup).expect_err(text);
        (errors[0].code, errors[0].range.clone())
    }

    #[test]
    fn mathematics_hold() {
        for (text, expected) in [
            ("1 + 2 * 3", 7.0),
            ("-2^2", -4.0),
            ("(-2)^2", 4.0),
            ("2^-1", 0.5),
            ("2^3^2", 512.0),
            ("8/-2^2", -2.0),
            ("2 - -$x^2", 11.0),
            ("-2^-2", -0.25),
            ("-sqrt(4)^2 * 3", -12.0),
            ("8/4*2", 4.0),
            ("1-2+3", 2.0),
            ("1e-3 * $x", 0.003),
            ("min(1, max(2, 3))", 1.0),
            ("clamp($x, 0, 2)", 2.0),
            ("lerp(1, 3, 0.5)", 2.0),
            ("round(2.5) + floor(-0.5) + ceil(0.2) + abs(-1)", 4.0),
            ("2 * pi", std::f64::consts::TAU),
            ("sin(30)", 0.5),
        ] {
            assert!((value(text) - expected).abs() < 1e-12, "{text} = {}", value(text));
        }
    }

    #[test]
    fn errors_have_places() {
        use Code::*;
        for (text, code, range) in [
            ("1 + foo(2)", BadExpression, 4..7),
            ("1 + $nope", UnknownParam, 4..9),
            ("1 2", BadExpression, 2..3),
            ("1 +", BadExpression, 3..3),
            ("1 & 2", BadExpression, 2..3),
            ("2mm", BadExpression, 0..3),
            ("1/0", NotFinite, 0..3),
            ("sqrt(0-1)", NotFinite, 0..9),
            ("1 + clamp(1)", BadExpression, 4..9),
            ("", BadExpression, 0..0),
            (")", BadExpression, 0..1),
        ] {
            assert_eq!(error(text), (code, range), "{text}");
        }
    }

    #[test]
    fn what_follows_from_another_error_is_silent() {
        assert_eq!(evaluate("$broken + 1", |_| Lookup::Broken), Err(Vec::new()));
    }

    proptest::proptest! {
        #[test]
        fn nothing_panics(text in "[0-9a-z$+*/^(), .é-]{0,40}") {
            let _ = evaluate(&text, |_| Lookup::Number(1.5));
        }
    }
}
