//! Formulas as words: reading and writing.
use std::ops::Range;

/// The deepest nesting of brackets in a formula.
const DEEPEST: usize = 256;

/// A word of a formula.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Word {
    /// A number without a sign, as written.
    Number(String),
    /// A colour, `#7a4526`.
    Color(String),
    /// A parameter with its components, without the `$`.
    Param(String),
    /// The name of a value.
    Name(Name),
    /// A function; [`Open`](Self::Open) follows.
    Function(String),
    /// `(`
    Open,
    /// `)`
    Close,
    /// `,`
    Comma,
    /// `-`, `+` or `!` before a value.
    Sign(char),
    /// An operator between two values.
    Operator(&'static str),
    /// Components after a bracket, without the dot.
    Part(String),
    /// `let NAME =`
    Let(String),
    /// `;`
    Semicolon,
}

/// A name in a formula.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Name {
    /// The value.
    pub(super) base: Base,
    /// The path after it: empty, or a dot and the rest.
    pub(super) rest: String,
}

/// The value that a name means.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Base {
    /// A name as written.
    Text(String),
    /// A node that gets this name.
    New(String),
    /// An output of a node that is rewritten, by its index.
    Value(usize),
}

impl Word {
    /// A name as written.
    pub(super) fn name(text: impl Into<String>) -> Self {
        Self::Name(Name { base: Base::Text(text.into()), rest: String::new() })
    }
}

/// A mistake in a formula.
#[derive(Debug, PartialEq)]
pub(super) struct Fault {
    /// Its bytes in the formula.
    pub(super) range: Range<usize>,
    /// The message.
    pub(super) message: String,
}

fn fault<T>(range: Range<usize>, message: impl Into<String>) -> Result<T, Fault> {
    Err(Fault { range, message: message.into() })
}

/// Longer operators first, so that the longest match wins.
const OPERATORS: [&str; 14] = ["<=", ">=", "==", "!=", "&&", "||", "+", "-", "*", "/", "%", "^", "<", ">"];

/// How tightly an operator binds; higher numbers bind tighter.
pub(super) fn binding(operator: &str) -> u8 {
    match operator {
        "||" => 1,
        "&&" => 2,
        "+" | "-" => 4,
        "*" | "/" | "%" => 5,
        "^" => POWER,
        _ => COMPARE,
    }
}

/// Binding of comparisons.
pub(super) const COMPARE: u8 = 3;
/// Binding of sums.
pub(super) const SUM: u8 = 4;
/// Binding of products.
pub(super) const PRODUCT: u8 = 5;
/// Binding of a sign.
pub(super) const SIGN: u8 = 6;
/// Binding of powers.
pub(super) const POWER: u8 = 7;
/// Binding of a value without operators.
pub(super) const ATOM: u8 = 8;

fn is_letter(c: char) -> bool {
    c == '_' || c.is_ascii_alphanumeric()
}

/// The length of a name with the parts after its dots.
fn name_len(text: &str) -> usize {
    let run = |from: usize| from + text[from..].find(|c| !is_letter(c)).unwrap_or(text.len() - from);
    let mut len = run(0);
    while len > 0 && part_follows(&text[len..]) {
        len = run(len + 1);
    }
    len
}

fn part_follows(text: &str) -> bool {
    text.strip_prefix('.').is_some_and(|rest| rest.starts_with(|c: char| c == '_' || c.is_ascii_alphabetic()))
}

fn number_len(text: &str) -> usize {
    let mut last = ' ';
    let end = text.char_indices().find(|&(_, c)| {
        let sign = matches!(c, '+' | '-') && matches!(last, 'e' | 'E');
        last = c;
        !(c.is_ascii_alphanumeric() || c == '.' || sign)
    });
    end.map_or(text.len(), |(at, _)| at)
}

/// Reads a formula.
pub(super) fn read(text: &str) -> Result<Vec<Word>, Fault> {
    let mut reader = Reader { text, at: 0, words: Vec::new(), open: 0, statement: 0, expects: true };
    while reader.word()? {}
    if reader.expects || reader.open > 0 {
        return fault(text.len()..text.len(), "the formula ends too early");
    }
    Ok(reader.words)
}

struct Reader<'t> {
    text: &'t str,
    at: usize,
    words: Vec<Word>,
    /// Number of open brackets.
    open: usize,
    /// Index of the first word after the last semicolon.
    statement: usize,
    /// True where a value must begin.
    expects: bool,
}

impl Reader<'_> {
    fn rest(&self) -> &str {
        &self.text[self.at..]
    }

    fn push(&mut self, word: Word, len: usize, expects: bool) {
        self.words.push(word);
        self.at += len;
        self.expects = expects;
    }

    /// Reads the next word; returns false at the end.
    fn word(&mut self) -> Result<bool, Fault> {
        let blank = self.rest().len() - self.rest().trim_start().len();
        self.at += blank;
        let Some(c) = self.rest().chars().next() else { return Ok(false) };
        if self.expects {
            self.operand(c)?
        } else {
            self.after_operand(c)?
        }
        Ok(true)
    }

    fn operand(&mut self, c: char) -> Result<(), Fault> {
        let rest = self.rest();
        match c {
            '0'..='9' | '.' => {
                let len = number_len(rest);
                let number = rest[..len].to_owned();
                if number.parse::<f64>().is_err() {
                    return fault(self.at..self.at + len, format!("`{number}` is not a number"));
                }
                self.push(Word::Number(number), len, false);
            }
            '#' => {
                let len = 1 + rest[1..].find(|c: char| !c.is_ascii_hexdigit()).unwrap_or(rest.len() - 1);
                if len != 4 && len != 7 {
                    return fault(self.at..self.at + len, "a colour has 3 or 6 digits after its `#`");
                }
                self.push(Word::Color(rest[..len].to_owned()), len, false);
            }
            '$' => {
                let len = 1 + name_len(&rest[1..]);
                self.push(Word::Param(rest[1..len].to_owned()), len, false);
            }
            '-' | '+' => self.push(Word::Sign(c), 1, true),
            '!' => self.push(Word::Sign(c), 1, true),
            '(' => self.bracket()?,
            _ if is_letter(c) => self.name()?,
            // `random()` has no values.
            ')' if matches!(self.words[..], [.., Word::Function(_), Word::Open]) => {
                self.open -= 1;
                self.push(Word::Close, 1, false);
            }
            _ => return fault(self.at..self.at + c.len_utf8(), format!("`{c}` cannot stand here")),
        }
        Ok(())
    }

    fn bracket(&mut self) -> Result<(), Fault> {
        if self.open >= DEEPEST {
            return fault(self.at..self.at + 1, format!("brackets nest deeper than {DEEPEST} levels"));
        }
        self.open += 1;
        self.push(Word::Open, 1, true);
        Ok(())
    }

    fn name(&mut self) -> Result<(), Fault> {
        let rest = self.rest();
        let len = name_len(rest);
        let name = rest[..len].to_owned();
        let after = rest[len..].trim_start();
        let begins = self.open == 0 && self.words.len() == self.statement;
        if begins && name == "let" && after.starts_with(is_letter) {
            let local = after[..name_len(after)].to_owned();
            let value = after[local.len()..].trim_start();
            if value.starts_with('=') && !value.starts_with("==") {
                let end = rest.len() - value.len() + 1;
                self.push(Word::Let(local), end, true);
                return Ok(());
            }
        }
        if after.starts_with('(') {
            let gap = rest.len() - len - after.len();
            self.push(Word::Function(name), len + gap, true);
            return self.bracket();
        }
        self.push(Word::name(name), len, false);
        Ok(())
    }

    fn after_operand(&mut self, c: char) -> Result<(), Fault> {
        let operator = OPERATORS.into_iter().find(|operator| self.rest().starts_with(operator));
        match (c, operator) {
            (_, Some(operator)) => self.push(Word::Operator(operator), operator.len(), true),
            (',', _) if self.open > 0 => self.push(Word::Comma, 1, true),
            (')', _) if self.open > 0 => {
                self.open -= 1;
                self.push(Word::Close, 1, false);
            }
            ('.', _)
                if part_follows(self.rest()) && matches!(self.words.last(), Some(Word::Close | Word::Color(_))) =>
            {
                let len = 1 + name_len(&self.rest()[1..]);
                let part = self.rest()[1..len].to_owned();
                self.push(Word::Part(part), len, false);
            }
            (';', _) if self.open == 0 && matches!(self.words.get(self.statement), Some(Word::Let(_))) => {
                self.push(Word::Semicolon, 1, true);
                self.statement = self.words.len();
            }
            _ => return fault(self.at..self.at + c.len_utf8(), format!("`{c}` cannot stand here")),
        }
        Ok(())
    }
}

/// Writes words as text. `name_of` spells names.
pub(super) fn write(words: &[Word], name_of: &dyn Fn(&Name) -> String) -> String {
    let mut text = String::new();
    for word in words {
        match word {
            Word::Number(number) => text.push_str(number),
            Word::Color(color) => text.push_str(color),
            Word::Param(name) => {
                text.push('$');
                text.push_str(name);
            }
            Word::Name(name) => text.push_str(&name_of(name)),
            Word::Function(name) => text.push_str(name),
            Word::Open => text.push('('),
            Word::Close => text.push(')'),
            Word::Comma => text.push_str(", "),
            Word::Sign(sign) => text.push(*sign),
            Word::Operator(operator) => {
                text.push(' ');
                text.push_str(operator);
                text.push(' ');
            }
            Word::Part(part) => {
                text.push('.');
                text.push_str(part);
            }
            Word::Let(name) => {
                text.push_str("let ");
                text.push_str(name);
                text.push_str(" = ");
            }
            Word::Semicolon => text.push_str("; "),
        }
    }
    text
}

/// The index of the bracket that closes the one at `open`.
pub(super) fn closing(words: &[Word], open: usize) -> Option<usize> {
    let mut depth = 0_usize;
    (open..words.len()).find(|&at| {
        match words[at] {
            Word::Open => depth += 1,
            Word::Close => depth = depth.saturating_sub(1),
            _ => {}
        }
        depth == 0
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn again(text: &str) -> String {
        let name_of = |name: &Name| match &name.base {
            Base::Text(text) => format!("{text}{}", name.rest),
            _ => String::new(),
        };
        read(text)
            .map_or_else(|fault| format!("{}: {}", fault.range.start, fault.message), |words| write(&words, &name_of))
    }

    #[test]
    fn writes_what_it_reads() {
        for text in [
            "0.16 * waves - 0.16 * $folds * soft_folds",
            "if(a > 0.5, (1, 2, -b.r), #7a4526.rgb)",
            "!a && -b ^ 2 <= 1e-3",
            "let r = length(x, y); let f = 1 - r / 5; clamp(f, 0, 1)",
            "rotate(v, 30).x + (a, b).y",
            "random()",
        ] {
            assert_eq!(again(text), text);
        }
        assert_eq!(again("a*b-( c+\n1 )"), "a * b - (c + 1)");
    }

    #[test]
    fn finds_mistakes() {
        for (text, at) in [
            ("", 0),
            ("a +", 3),
            ("(a", 2),
            ("a b", 2),
            ("a)", 1),
            ("2x", 0),
            ("a, b", 1),
            ("()", 1),
            ("#12", 0),
            ("ä", 0),
        ] {
            assert_eq!(read(text).map_err(|fault| fault.range.start), Err(at), "{text}");
        }
        assert!(read(&"(".repeat(100_000)).is_err());
        assert_eq!(read(&format!("{}1", "-".repeat(100_000))).map(|words| words.len()), Ok(100_001));
    }
}
