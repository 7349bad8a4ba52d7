//! Semantic tokens: classifies the words of a file for colouring.
use super::expect::Expect;
use super::file::Section;
use super::names::params_in;
use super::view::{Item, Shape, Value, plain};
use super::walk::{Visit, walk};
use super::world::Cx;
use shibo_node::ParamType;
use shibo_value::expression::described;
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
    /// A function in an expression.
    Function,
    /// A unit.
    Unit,
}

impl Token {
    /// All classes.
    pub const ALL: [Self; 10] = [
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
    ];
}

/// Tokens of a file in the order of the text, without overlaps.
pub fn tokens(cx: Cx<'_>) -> Vec<(Range<usize>, Token)> {
    let mut found = Found { cx, tokens: Vec::new() };
    walk(cx, &mut found);
    found.tokens.sort_by_key(|(range, _)| range.start);
    found.tokens
}

struct Found<'a> {
    cx: Cx<'a>,
    tokens: Vec<(Range<usize>, Token)>,
}

impl<'a> Visit<'a> for Found<'a> {
    fn key(&mut self, inside: Expect<'a>, item: &'a Item) {
        let Some(key) = &item.key else { return };
        let token = match inside {
            Expect::Root => Token::Section,
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
        let Some(inside) = plain(&self.cx.file.text, &value.range, text) else { return };
        let at = |range: Range<usize>| inside.start + range.start..inside.start + range.end;
        let formula = matches!(expect, Expect::Value(_, param) if param.ty == ParamType::Formula);
        match expect {
            Expect::Param(_, None) | Expect::Note if self.is_unit(value) => self.tokens.push((inside, Token::Unit)),
            Expect::Note => {}
            _ if formula || text.starts_with(['$', '=']) => {
                for range in params_in(text) {
                    self.tokens.push((at(range.start - 1..range.end), Token::Param));
                }
                for range in functions(text) {
                    self.tokens.push((at(range), Token::Function));
                }
            }
            Expect::Use(_, _, Some("graph" | "preset")) => self.tokens.push((inside, Token::Reference)),
            _ if expect.reference(self.cx).is_some() && !text.starts_with('#') && !text.is_empty() => {
                let dot = text.find('.').unwrap_or(text.len());
                if dot > 0 {
                    self.tokens.push((at(0..dot), Token::Reference));
                }
                if dot + 1 < text.len() {
                    self.tokens.push((at(dot + 1..text.len()), Token::Port));
                }
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
}

/// Ranges of functions and constants in an expression.
fn functions(text: &str) -> Vec<Range<usize>> {
    let part = |c: char| c == '_' || c == '$' || c == '.' || c.is_ascii_alphanumeric();
    let mut found = Vec::new();
    let mut start = None;
    for (i, c) in text.char_indices().chain([(text.len(), ' ')]) {
        match (part(c), start) {
            (true, None) => start = Some(i),
            (false, Some(from)) => {
                if described().iter().any(|one| one.name == &text[from..i]) {
                    found.push(from..i);
                }
                start = None;
            }
            _ => {}
        }
    }
    found
}
