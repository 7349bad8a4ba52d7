//! Replaces `"$name"` and `"= expression"` by the values of parameters.
use super::expr::{self, Lookup};
use super::lex::Kind;
use super::params::{ParamValue, Params};
use super::part::{Part, Piece, Shape, Src};
use super::read::shorten;
use super::report::Report;
use crate::diagnostics::{Code, Diagnostic, Span};
use std::ops::Range;
use std::path::PathBuf;

/// The numbers that fit into the largest integers of parameters.
const INTEGERS: Range<f64> = -9.2e18..1.84e19;
/// The most values that a problem of an expression points at.
const OTHERS: usize = 4;

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
        self.pieces.push(Piece { end: self.text.len(), ..piece.clone() });
        self.text.push(' ');
        self.pieces.push(Piece { end: self.text.len(), copied: false, ..piece });
    }

    fn copy(&mut self, word: &Part) {
        self.add(word.str(), Piece { copied: true, ..own(word) });
    }

    /// Puts in the value of a string `"$name"` or `"= expression"`; whether it is a text.
    fn replace(&mut self, word: &Part, params: &Params, report: &mut Report) -> bool {
        let Shape::Text(text) = word.shape() else { return false };
        if text.starts_with("$$") || text.starts_with("==") {
            self.add(&ron_string(&text[1..]), own(word));
            return true;
        }
        if let Some(expression) = text.strip_prefix('=') {
            match compute(word, expression, params, report) {
                Ok((value, piece)) => self.add(&number_text(value), piece),
                Err(errors) => {
                    errors.into_iter().for_each(|e| report.push(e));
                    self.ok = false;
                }
            }
            return false;
        }
        let name = text[1..].trim();
        let Some(param) = params.get(name) else {
            report.unknown(word.error(Code::UnknownParam, unknown(name)), name, "parameter", params.names());
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

/// The piece for what is written in the text itself.
fn own(word: &Part) -> Piece {
    Piece { end: 0, span: word.span(), copied: false, related: Vec::new(), given: false }
}

/// Problems of a value that was given from outside are problems there, others where it is put in.
fn piece(word: &Part, value: &ParamValue) -> Piece {
    if value.outside {
        return given(word, &[value.span]);
    }
    Piece { related: vec![(value.span, "its value is written here")], ..own(word) }
}

/// A value that comes from values given from outside: at the first of them.
fn given(word: &Part, spans: &[Span]) -> Piece {
    let Some((first, others)) = spans.split_first() else { return own(word) };
    let mut related = vec![(word.span(), "its value is used here")];
    related.extend(others.iter().map(|span| (*span, "together with this one")));
    Piece { span: *first, related, given: true, ..own(word) }
}

fn unknown(name: &str) -> String {
    format!("there is no parameter `{}`", shorten(name))
}

/// The value of an expression, and what it comes from.
fn compute(word: &Part, expression: &str, params: &Params, report: &Report) -> Result<(f64, Piece), Vec<Diagnostic>> {
    let mut spans = Vec::new();
    let lookup = |name: &str| match params.get(name) {
        None => Lookup::Wrong(Code::UnknownParam, unknown(name), report.suggest(name, "parameter", params.names())),
        Some(None) => Lookup::Broken,
        Some(Some(value)) => match value.number {
            Some(number) => {
                if value.outside && !spans.contains(&value.span) && spans.len() < OTHERS {
                    spans.push(value.span);
                }
                Lookup::Number(number)
            }
            None => Lookup::Wrong(Code::BadExpression, format!("`${name}` is not a number"), None),
        },
    };
    // Bytes of a plain literal are those of its text, after the quote and the equals sign.
    let plain = word.str().len() == expression.len() + 3;
    let value = expr::evaluate(expression, lookup);
    value.map(|value| (value, given(word, &spans))).map_err(|errors| {
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
    if value.fract() == 0.0 && INTEGERS.contains(&value) { format!("{value:.0}") } else { format!("{value:?}") }
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
