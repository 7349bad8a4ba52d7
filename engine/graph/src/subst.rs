//! Replaces `"$name"` and `"= expression"` by the values of parameters.
use super::params::{ParamValue, Params};
use super::part::{PieceOrigin, Shape, Src, SyntaxValue};
use super::read::shorten;
use super::report::Report;
use super::ron_text::{number_text, ron_string};
use crate::diagnostics::{Code, Diagnostic, Span};
use crate::expression::{self, Fault, Meaning, Names, UserFunction, Value};
use crate::node;
use crate::syntax::TokenKind as Kind;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

/// The most values that a problem of an expression refers to.
const OTHERS: usize = 4;

/// A value after substitution of parameters.
pub(super) struct Substituted {
    /// The value.
    pub(super) part: SyntaxValue,
    /// The base folder of a path in it, if it comes from a parameter.
    pub(super) base: Option<PathBuf>,
    /// The whole value comes from a text parameter.
    pub(super) is_text: bool,
}

/// Substitutes all parameters in `part`; `None` after errors.
pub(super) fn substitute(part: &SyntaxValue, params: &Params, report: &mut Report) -> Option<Substituted> {
    substitute_with(part, params, report, &[])
}

/// Substitutes parameters, and replaces some parts by other texts.
pub(super) fn substitute_with(
    part: &SyntaxValue,
    params: &Params,
    report: &mut Report,
    replaced: &[(SyntaxValue, String)],
) -> Option<Substituted> {
    if replaced.is_empty() && !is_driven(part) {
        return Some(Substituted { part: part.clone(), base: None, is_text: false });
    }
    let mut made = Made { text: String::new(), pieces: Vec::new(), base: None, ok: true };
    let mut is_text = false;
    let mut words = part.words();
    while let Some((kind, word)) = words.next() {
        if let Some((whole, text)) = replaced.iter().find(|(whole, _)| whole.begins_with(&word)) {
            made.add(text, own(whole));
            words.by_ref().take(whole.tokens().len() - 1).for_each(drop);
            continue;
        }
        if kind == Kind::Str && drives(word.str()) {
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

fn drives(word: &str) -> bool {
    // The text of a raw literal begins after `r`, hashes and the quote.
    let inside = word.trim_start_matches('r').trim_start_matches('#').strip_prefix('"').unwrap_or_default();
    inside.starts_with(['$', '='])
}

/// Returns true if a value contains a parameter or an expression.
pub(super) fn is_driven(part: &SyntaxValue) -> bool {
    part.words().any(|(kind, word)| kind == Kind::Str && drives(word.str()))
}

struct Made {
    text: String,
    pieces: Vec<PieceOrigin>,
    base: Option<PathBuf>,
    ok: bool,
}

impl Made {
    fn add(&mut self, text: &str, piece: PieceOrigin) {
        self.text.push_str(text);
        self.pieces.push(PieceOrigin { end: self.text.len(), ..piece.clone() });
        self.text.push(' ');
        self.pieces.push(PieceOrigin { end: self.text.len(), copied: false, ..piece });
    }

    fn copy(&mut self, word: &SyntaxValue) {
        self.add(word.str(), PieceOrigin { copied: true, ..own(word) });
    }

    /// Substitutes a string `"$name"` or `"= expression"`; returns true if the value is a text.
    fn replace(&mut self, word: &SyntaxValue, params: &Params, report: &mut Report) -> bool {
        let Shape::Text(text) = word.shape() else { return false };
        if text.starts_with("$$") || text.starts_with("==") {
            self.add(&ron_string(&text[1..]), own(word));
            return true;
        }
        if let Some(expression) = text.strip_prefix('=') {
            match compute(word, expression, params, report) {
                Ok((value, piece)) => self.add(&value_text(&value), piece),
                Err(errors) => {
                    errors.into_iter().for_each(|e| report.push(e));
                    self.ok = false;
                }
            }
            return false;
        }
        let name = text[1..].trim();
        if params.is_late(name) {
            report.push(word.error(Code::BadExpression, too_early(name)));
            self.ok = false;
            return false;
        }
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

/// The origin of text that is copied from the value itself.
fn own(word: &SyntaxValue) -> PieceOrigin {
    PieceOrigin { end: 0, span: word.span(), copied: false, related: Vec::new(), given: false }
}

/// Places problems of an outside value where it was given, and others where it is substituted.
fn piece(word: &SyntaxValue, value: &ParamValue) -> PieceOrigin {
    if value.outside {
        return given(word, &[value.span]);
    }
    PieceOrigin { related: vec![(value.span, "its value is written here")], ..own(word) }
}

/// A value derived from outside values: placed at the first of them.
fn given(word: &SyntaxValue, spans: &[Span]) -> PieceOrigin {
    let Some((first, others)) = spans.split_first() else { return own(word) };
    let mut related = vec![(word.span(), "its value is used here")];
    related.extend(others.iter().map(|span| (*span, "together with this one")));
    PieceOrigin { span: *first, related, given: true, ..own(word) }
}

fn unknown(name: &str) -> String {
    format!("there is no parameter `{}`", shorten(name))
}

fn too_early(name: &str) -> String {
    format!("`${}` comes from the canvas, so the canvas cannot use it", shorten(name))
}

/// The names in a parameter's expression.
pub(super) struct InParams<'p> {
    params: &'p Params,
    report: &'p Report,
    /// The places of the outside values that were used.
    spans: Vec<Span>,
}

impl<'p> InParams<'p> {
    pub(super) fn new(params: &'p Params, report: &'p Report) -> Self {
        Self { params, report, spans: Vec::new() }
    }
}

/// The canvas names that expressions in parameters can use.
const CANVAS: [&str; 3] = ["canvas.width", "canvas.height", "canvas.seed"];

impl Names for InParams<'_> {
    fn param(&mut self, name: &str) -> Meaning {
        let params = self.params;
        if params.is_late(name) {
            return Meaning::Wrong(Code::BadExpression, too_early(name), None);
        }
        match params.get(name) {
            None => {
                let help = self.report.suggest(name, "parameter", params.names());
                Meaning::Wrong(Code::UnknownParam, unknown(name), help)
            }
            Some(None) => Meaning::Broken,
            Some(Some(value)) => match &value.meaning {
                Some(meaning) => {
                    if value.outside && !self.spans.contains(&value.span) && self.spans.len() < OTHERS {
                        self.spans.push(value.span);
                    }
                    meaning.clone()
                }
                None => Meaning::Wrong(Code::BadExpression, format!("`${name}` is not a number"), None),
            },
        }
    }

    fn name(&mut self, name: &str) -> Option<Meaning> {
        let index = CANVAS.iter().position(|fact| *fact == name)?;
        let Some(facts) = self.params.facts else {
            self.params.asked_early.set(true);
            return Some(Meaning::Wrong(Code::BadExpression, "the canvas cannot refer to itself".to_owned(), None));
        };
        let value = [facts.size_mm[0], facts.size_mm[1], facts.seed as f64][index];
        Some(Meaning::Known(Value::Number(value)))
    }

    fn all(&self) -> Vec<String> {
        CANVAS.map(str::to_owned).into()
    }

    fn has_words(&self) -> bool {
        true
    }

    fn instead(&mut self, name: &str) -> Option<(String, String)> {
        let node = name.split('.').next().filter(|node| self.params.nodes.contains(*node))?;
        let message = format!("`{}` is a node; a formula here is one value for the whole picture", shorten(node));
        Some((message, "formulas of nodes stand in ports and in the place of nodes".to_owned()))
    }

    fn function(&mut self, name: &str) -> Option<Arc<UserFunction>> {
        self.params.functions.get(name).cloned()
    }

    fn functions(&self) -> Vec<String> {
        self.params.functions.keys().cloned().collect()
    }

    fn in_function(&mut self, name: &str) -> Option<Meaning> {
        self.name(name)
    }

    fn seed(&mut self) -> Option<u64> {
        if self.params.facts.is_none() {
            self.params.asked_early.set(true);
        }
        self.params.facts.map(|facts| facts.seed)
    }

    fn seed_of(&mut self, seed: u64) -> Option<u64> {
        Some(node::seed_of(self.seed()?, PER_PIECE, seed))
    }
}

/// The kind whose numbers `random(i, seed)` gives.
const PER_PIECE: &str = "RegionRandom";

/// The value of an expression and its origin.
fn compute(
    word: &SyntaxValue,
    expression: &str,
    params: &Params,
    report: &Report,
) -> Result<(Value, PieceOrigin), Vec<Diagnostic>> {
    let mut names = InParams::new(params, report);
    let value = expression::evaluate(expression, &mut names);
    // In a plain literal, byte positions are shifted by the quote and the equals sign.
    let plain = word.str().len() == expression.len() + 3;
    let place = |fault: Fault| {
        let whole = fault.function.is_some() || fault.range == (0..expression.len());
        let inside = (plain && !whole).then_some((2, &fault.range));
        located(word, &fault, inside)
    };
    let value = value.map_err(|faults| faults.into_iter().map(place).collect::<Vec<_>>())?;
    Ok((value, given(word, &names.spans)))
}

/// A fault of an expression at its exact place if known, else at `word`.
pub(super) fn located(word: &SyntaxValue, fault: &Fault, inside: Option<(usize, &Range<usize>)>) -> Diagnostic {
    let mut error = word.error(fault.code, fault.message.clone());
    error.help.clone_from(&fault.help);
    if let Some((offset, range)) = inside {
        // A place past the last character becomes the closing quote, which is missing at the end of a broken text.
        let text = word.str();
        let start = (offset + range.start).min(text.len());
        error.span = word.sub_span(start, text.ceil_char_boundary((offset + range.end).max(start + 1)));
    }
    error
}

/// The names of the parameters that a value refers to.
pub(super) fn refers_to(part: &SyntaxValue) -> Vec<String> {
    let mut names = Vec::new();
    for (_, word) in part.words().filter(|(kind, word)| *kind == Kind::Str && drives(word.str())) {
        let text = word.str();
        if text.starts_with("\"$$") || text.starts_with("\"==") {
            continue;
        }
        for (at, _) in text.match_indices('$') {
            let name = text[at + 1..].trim_start();
            let end = name.find(|c: char| c != '_' && !c.is_ascii_alphanumeric()).unwrap_or(name.len());
            names.push(name[..end].to_owned());
        }
    }
    names
}

/// The value of an expression as RON.
fn value_text(value: &Value) -> String {
    match value {
        Value::Number(number) => number_text(*number),
        Value::Bool(yes) => yes.to_string(),
        Value::Word(word) => word.clone(),
        Value::Vector(numbers) => {
            let numbers: Vec<_> = numbers.iter().map(|number| number_text(*number)).collect();
            format!("({})", numbers.join(", "))
        }
    }
}
