//! Semantic tokens: classifies the words of a file for colouring.
use super::expect::Expect;
use super::file::Section;
use super::formula::{self, FormulaText, Role};
use super::functions::{self, Head};
use super::names::params_in;
use super::view::{Item, Shape, Value, plain};
use super::walk::{Visit, walk};
use super::world::Cx;
use shibo_graph::syntax::formula::{PartKind, WordKind};
use std::ops::Range;

/// Class of a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Token {
    /// A section of the file.
    Section,
    /// A kind of nodes, or a type.
    Kind,
    /// A field.
    Field,
    /// A node at its declaration.
    Node,
    /// A reference to a node.
    Reference,
    /// The output name after a dot.
    Port,
    /// A parameter.
    Param,
    /// An option of a choice.
    Choice,
    /// A function or a constant of formulas.
    Function,
    /// A unit.
    Unit,
    /// A number in a formula.
    Number,
    /// An operator of a formula.
    Operator,
    /// A local name of a formula, or a value of a function.
    Local,
    /// A position, or a fact of the canvas.
    Place,
    /// The word `let`.
    Keyword,
}

impl Token {
    /// All classes.
    pub const ALL: [Self; 15] = [
        Self::Section,
        Self::Kind,
        Self::Field,
        Self::Node,
        Self::Reference,
        Self::Port,
        Self::Param,
        Self::Choice,
        Self::Function,
        Self::Unit,
        Self::Number,
        Self::Operator,
        Self::Local,
        Self::Place,
        Self::Keyword,
    ];
}

/// Tokens of a file in the order of the text, without overlaps.
pub fn tokens(cx: Cx<'_>) -> Vec<(Range<usize>, Token)> {
    let mut tokens = Vec::new();
    for file in cx.file.scopes() {
        let mut found = Found { cx: cx.with(&file), tokens: Vec::new() };
        walk(found.cx, &mut found);
        tokens.extend(found.tokens);
    }
    tokens.sort_by_key(|(range, _)| range.start);
    tokens
}

struct Found<'a> {
    cx: Cx<'a>,
    tokens: Vec<(Range<usize>, Token)>,
}

impl<'a> Visit<'a> for Found<'a> {
    fn key(&mut self, inside: Expect<'a>, item: &'a Item) {
        let Some(key) = &item.key else { return };
        let token = match inside {
            Expect::Section(Section::Functions) => return self.head(item),
            Expect::Root | Expect::Local => Token::Section,
            Expect::Section(Section::Nodes | Section::Inputs) => Token::Node,
            Expect::Section(Section::Params) | Expect::Entry(Section::Presets, _) => Token::Param,
            Expect::Section(_) => Token::Node,
            _ => Token::Field,
        };
        self.tokens.push((key.range.clone(), token));
    }

    fn value(&mut self, expect: Expect<'a>, value: &'a Value) {
        if let Some(word) = value.word() {
            let declared = matches!(expect, Expect::Entry(..));
            let call = matches!(value.shape, Shape::Call { .. });
            let kind = call && (expect.takes_nodes() || declared);
            self.tokens.push((word, if kind { Token::Kind } else { Token::Choice }));
        }
        let Shape::Text(text) = &value.shape else { return };
        if let Some(formula) = FormulaText::of(self.cx, expect, value) {
            return self.formula(&formula);
        }
        let Some(inside) = plain(&self.cx.file.text, &value.range, text) else { return };
        let at = |range: Range<usize>| inside.start + range.start..inside.start + range.end;
        match expect {
            Expect::Param(_, None) | Expect::Note if self.is_unit(value) => self.tokens.push((inside, Token::Unit)),
            Expect::Note => {}
            _ if text.starts_with('$') => {
                for range in params_in(text) {
                    self.tokens.push((at(range.start - 1..range.end), Token::Param));
                }
            }
            Expect::Use(_, _, Some("graph" | "preset")) => self.tokens.push((inside, Token::Reference)),
            _ if expect.reference(self.cx).is_some() && !text.starts_with('#') && !text.is_empty() => {
                self.path(inside.start, text);
            }
            _ => {}
        }
    }
}

impl Found<'_> {
    /// Returns whether a text follows `unit:` and so is the unit of a parameter.
    fn is_unit(&self, value: &Value) -> bool {
        let before = self.cx.file.text[..value.range.start].trim_end();
        before.strip_suffix(':').is_some_and(|before| before.trim_end().ends_with("unit"))
    }

    /// Tokens of a path: the node, and the names after its dots.
    fn path(&mut self, start: usize, text: &str) {
        let mut at = start;
        for (index, part) in text.split('.').enumerate() {
            if !part.is_empty() {
                let token = if index == 0 { Token::Reference } else { Token::Port };
                self.tokens.push((at..at + part.len(), token));
            }
            at += part.len() + 1;
        }
    }

    /// Tokens of the head of a function.
    fn head(&mut self, item: &Item) {
        let Some(key) = &item.key else { return };
        let head = Head::of(&key.name);
        let named = std::iter::once((head.name, Token::Function));
        for (part, token) in named.chain(head.params.into_iter().map(|param| (param, Token::Local))) {
            let place = functions::in_head(self.cx.file, item, &part).filter(|place| !place.is_empty());
            self.tokens.extend(place.map(|place| (place, token)));
        }
    }

    /// Tokens of a formula.
    fn formula(&mut self, text: &FormulaText<'_>) {
        let values = text.values(self.cx);
        let formula = text.parse();
        for (index, word) in formula.words().iter().enumerate() {
            let Some(place) = text.in_file(&word.range) else { return };
            let says = formula.word(index);
            let first = says.split('.').next().unwrap_or_default();
            let part = formula.part_of(index).and_then(|part| formula.parts().get(part));
            let token = match word.kind {
                WordKind::Number | WordKind::Color => Token::Number,
                WordKind::Operator | WordKind::Not | WordKind::Assign => Token::Operator,
                WordKind::Param => Token::Param,
                WordKind::Letters => Token::Port,
                WordKind::Name if formula.is_call(index) => Token::Function,
                WordKind::Name if part.is_some_and(|part| part.kind == PartKind::Let) => {
                    if part.is_some_and(|part| part.word == Some(index)) { Token::Keyword } else { Token::Local }
                }
                WordKind::Name if formula.local(first, word.range.start).is_some() || values.contains(&first) => {
                    self.tokens.push((place.start..place.start + first.len(), Token::Local));
                    let rest = place.start + first.len() + 1..place.end;
                    self.tokens.extend(Some((rest, Token::Port)).filter(|(rest, _)| rest.start < rest.end));
                    continue;
                }
                WordKind::Name => match self.name(text, says) {
                    Some(Token::Reference) => {
                        self.path(place.start, says);
                        continue;
                    }
                    Some(token) => token,
                    None => continue,
                },
                _ => continue,
            };
            self.tokens.push((place, token));
        }
    }

    /// Token of a name that a formula does not define.
    fn name(&self, text: &FormulaText<'_>, says: &str) -> Option<Token> {
        let first = says.split('.').next().unwrap_or_default();
        let file = self.cx.file;
        let is_value =
            [Section::Nodes, Section::Inputs].into_iter().any(|section| file.entry(section, first).is_some());
        match text.role {
            Role::Point if is_value => Some(Token::Reference),
            _ if formula::manual(says).is_some() => Some(Token::Place),
            _ if functions::is_of_language(says) => Some(Token::Function),
            Role::Function(_) => None,
            Role::Point if says.contains('.') => Some(Token::Reference),
            Role::Point | Role::Value => Some(Token::Choice),
        }
    }
}
