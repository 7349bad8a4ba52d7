//! Putting the values of parameters in the place of `"$name"` and `"= expression"`.
use super::expr::{self, Lookup};
use super::lex::Kind;
use super::params::{ParamValue, Params};
use super::part::{Part, Piece, Shape, Src};
use super::report::Report;
use crate::diagnostics::{Code, Diagnostic, suggest};
use std::path::PathBuf;

/// A value in which parameters are replaced.
pub(super) struct Substituted {
    /// The value.
    pub(super) part: Part,
    /// The folder that a path in it is relative to, if it comes from a parameter.
    pub(super) base: Option<PathBuf>,
    /// Whether the whole of it is the value of a parameter that is a text.
    pub(super) is_text: bool,
}

/// Replaces all parameters in `part`; `None` after errors.
pub(super) fn substitute(part: &Part, params: &Params, report: &mut Report) -> Option<Substituted> {
    let driven = |word: &str| word.starts_with("\"$") || word.starts_with("\"=");
    if !part.words().any(|(kind, word)| kind == Kind::Str && driven(word.str())) {
        return Some(Substituted { part: part.clone(), base: None, is_text: false });
    }
    let mut made = Made { text: String::new(), pieces: Vec::new(), base: None, ok: true };
    let mut is_text = false;
    for (kind, word) in part.words() {
        if kind == Kind::Str && driven(word.str()) {
            is_text |= made.replace(&word, params, report);
        } else {
            made.copy(&word);
        }
    }
    let whole = Src::made(part.file(), made.text, made.pieces).whole();
    let part_is_one_word = part.tokens().len() == 1;
    made.ok.then_some(whole).flatten().map(|part| Substituted {
        part,
        base: made.base,
        is_text: is_text && part_is_one_word,
    })
}

struct Made {
    text: String,
    pieces: Vec<Piece>,
    base: Option<PathBuf>,
    ok: bool,
}

impl Made {
    fn add(&mut self, text: &str, piece: Piece) {
        self.text.push_str(text);
        self.pieces.push(Piece { end: self.text.len(), ..piece });
        self.text.push(' ');
        self.pieces.push(Piece { end: self.text.len(), copied: false, ..piece });
    }

    fn copy(&mut self, word: &Part) {
        self.add(word.str(), Piece { end: 0, span: word.span(), copied: true, related: None });
    }

    /// Puts in the value of a string `"$name"` or `"= expression"`; whether it is a text.
    fn replace(&mut self, word: &Part, params: &Params, report: &mut Report) -> bool {
        let Shape::Text(text) = word.shape() else { return false };
        let own = Piece { end: 0, span: word.span(), copied: false, related: None };
        if text.starts_with("$$") || text.starts_with("==") {
            self.add(&ron_string(&text[1..]), own);
            return true;
        }
        if let Some(expression) = text.strip_prefix('=') {
            match compute(word, expression, params) {
                Ok(value) => self.add(&number_text(value), own),
                Err(errors) => {
                    errors.into_iter().for_each(|e| report.push(e));
                    self.ok = false;
                }
            }
            return false;
        }
        let name = text[1..].trim();
        let Some(param) = params.get(name) else {
            let (message, help) = unknown(name, params);
            report.push(word.error(Code::UnknownParam, message).help(help));
            self.ok = false;
            return false;
        };
        let Some(value) = param else {
            self.ok = false;
            return false;
        };
        self.add(&value.text, piece(word, value));
        self.base = value.base.clone().or(self.base.take());
        value.is_text
    }
}

/// Problems of a value that was given from outside are problems there, others where it is put in.
fn piece(word: &Part, value: &ParamValue) -> Piece {
    let (span, related) = if value.outside {
        (value.span, (word.span(), "its value is used here"))
    } else {
        (word.span(), (value.span, "its value is written here"))
    };
    Piece { end: 0, span, copied: false, related: Some(related) }
}

fn unknown(name: &str, params: &Params) -> (String, String) {
    let names: Vec<_> = params.keys().map(String::as_str).collect();
    (format!("there is no parameter `{name}`"), suggest(name, "parameter", &names))
}

fn compute(word: &Part, expression: &str, params: &Params) -> Result<f64, Vec<Diagnostic>> {
    let lookup = |name: &str| match params.get(name) {
        None => {
            let (message, help) = unknown(name, params);
            Lookup::Wrong(Code::UnknownParam, message, Some(help))
        }
        Some(None) => Lookup::Broken,
        Some(Some(value)) => match value.number {
            Some(number) => Lookup::Number(number),
            None => Lookup::Wrong(Code::BadExpression, format!("`${name}` is not a number"), None),
        },
    };
    // Bytes of a plain literal are those of its text, after the quote and the equals sign.
    let plain = word.str().len() == expression.len() + 3;
    expr::evaluate(expression, lookup).map_err(|errors| {
        let place = |e: expr::ExprError| {
            let mut error = word.error(e.code, e.message);
            error.help = e.help;
            // A place past the last character is the closing quote.
            let (start, end) = (2 + e.range.start, 2 + e.range.end.max(e.range.start + 1));
            let inside = plain && e.range != (0..expression.len());
            if inside { error.related(word.sub_span(start, end), "here in the expression") } else { error }
        };
        errors.into_iter().map(place).collect()
    })
}

/// A number as RON; whole numbers without a point, so that they also serve as counts.
pub(super) fn number_text(value: f64) -> String {
    if value.fract() == 0.0 && value.abs() < 9.0e15 { format!("{value:.0}") } else { format!("{value:?}") }
}

/// A text as a RON string.
pub(super) fn ron_string(text: &str) -> String {
    let mut out = String::with_capacity(text.len() + 2);
    out.push('"');
    for c in text.chars() {
        match c {
            '"' | '\\' => out.extend(['\\', c]),
            c if c.is_control() => out.extend(c.escape_unicode()),
            c => out.push(c),
        }
    }
    out.push('"');
    out
}
