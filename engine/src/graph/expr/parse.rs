//! From words to a tree.
//!
//! Operators by how tightly they bind, all from left to right but for the power: `+ -`, then `* / %`, then a sign in
//! front, then `^`. So `-2^2` is -4, `2^3^2` is 512 and `7 * 29 % 90` is 23.
//!
//! Parts that are not complete yet are in a list, not on the stack of the program. So any text is read in time proportional
//! to its length, and no nesting can overflow the stack.
use super::functions::{self, Function};
use super::scan::{Kind, Word, scan};
use super::{ExprError, MOST_ERRORS, bad};
use crate::diagnostics::suggest;
use std::ops::Range;

/// How many brackets, signs and operators may be open at once.
const MAX_DEPTH: usize = 256;

/// An expression as a tree.
#[derive(Debug, PartialEq)]
pub(super) struct Tree<'t> {
    /// Every part after the parts that it is made of; the last one is the whole. No recursion is needed to walk over it.
    pub(super) nodes: Vec<Node<'t>>,
}

/// A part of an expression.
#[derive(Debug, PartialEq)]
pub(super) struct Node<'t> {
    pub(super) kind: NodeKind<'t>,
    /// All of it, in bytes of the text.
    pub(super) range: Range<usize>,
}

/// What a part of an expression is. Those that are made of others take as many as they need of the parts before them
/// that nothing else takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum NodeKind<'t> {
    /// A number.
    Number(f64),
    /// The parameter of that name.
    Param(&'t str),
    /// Minus the part before.
    Negate,
    /// Two parts.
    Binary(Binary),
    /// So many parts.
    Call(&'static Function, usize),
}

/// What is made of two parts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Binary {
    Add,
    Subtract,
    Multiply,
    Divide,
    Remainder,
    Power,
}

impl Binary {
    fn of(operator: char) -> Self {
        match operator {
            '+' => Self::Add,
            '-' => Self::Subtract,
            '*' => Self::Multiply,
            '/' => Self::Divide,
            '%' => Self::Remainder,
            _ => Self::Power,
        }
    }

    /// Higher numbers bind tighter.
    fn binds(self) -> u8 {
        match self {
            Self::Add | Self::Subtract => 1,
            Self::Multiply | Self::Divide | Self::Remainder => 2,
            Self::Power => 4,
        }
    }
}

/// How tightly a sign in front binds.
const SIGN: u8 = 3;

/// A part whose right end was not reached yet.
enum Open {
    /// A sign in front.
    Sign { start: usize, minus: bool },
    /// An operator; its left side is complete.
    Operator(Binary),
    /// A bracket.
    Bracket { start: usize },
    /// The bracket of a function, with the arguments that are complete.
    Call { name: Range<usize>, function: &'static Function, args: usize },
}

/// Reads an expression. All unknown functions are reported at once, anything else is reported alone.
pub(super) fn parse(text: &str) -> Result<Tree<'_>, Vec<ExprError>> {
    let words = scan(text).map_err(|error| vec![error])?;
    let unknown: Vec<_> = words.iter().filter_map(|word| unknown_name(text, word)).take(MOST_ERRORS).collect();
    if !unknown.is_empty() {
        return Err(unknown);
    }
    let mut parser = Parser { text, words, at: 0, nodes: Vec::new(), done: Vec::new(), open: Vec::new() };
    parser.run().map_err(|error| vec![error])?;
    Ok(Tree { nodes: parser.nodes })
}

fn unknown_name(text: &str, word: &Word) -> Option<ExprError> {
    let name = &text[word.range.clone()];
    if word.kind != Kind::Name || functions::find(name).is_some() {
        return None;
    }
    let names: Vec<_> = functions::ALL.iter().map(|f| f.name).collect();
    let name = super::shorten(name);
    let message = format!("there is no function `{name}`; a parameter is written `${name}`");
    Some(ExprError { help: Some(suggest(&name, "function", &names)), ..bad(word.range.clone(), message) })
}

struct Parser<'t> {
    text: &'t str,
    words: Vec<Word>,
    /// The next word.
    at: usize,
    nodes: Vec<Node<'t>>,
    /// The parts that are complete and that nothing has taken yet.
    done: Vec<Range<usize>>,
    open: Vec<Open>,
}

impl<'t> Parser<'t> {
    fn run(&mut self) -> Result<(), ExprError> {
        if self.words.is_empty() {
            return Err(bad(0..self.text.len(), "the expression is empty"));
        }
        loop {
            while !self.operand()? {}
            while !self.after_operand()? {
                if self.at == self.words.len() {
                    return self.end();
                }
            }
        }
    }

    fn next(&mut self) -> Option<(Kind, Range<usize>)> {
        let word = self.words.get(self.at)?;
        self.at += 1;
        Some((word.kind, word.range.clone()))
    }

    /// Takes a word where a value must begin; whether the value is complete.
    fn operand(&mut self) -> Result<bool, ExprError> {
        let Some((kind, range)) = self.next() else { return Err(self.too_early()) };
        match kind {
            Kind::Number(value) => self.push(NodeKind::Number(value), range),
            Kind::Param => self.push(NodeKind::Param(&self.text[range.start + 1..range.end]), range),
            Kind::Name => return self.name(range),
            Kind::Open => return self.wait(Open::Bracket { start: range.start }, range).map(|()| false),
            Kind::Operator(sign @ ('+' | '-')) => {
                let sign = Open::Sign { start: range.start, minus: sign == '-' };
                return self.wait(sign, range).map(|()| false);
            }
            Kind::Close | Kind::Comma | Kind::Operator(_) => return Err(self.misplaced(range)),
        }
        Ok(true)
    }

    /// A constant, or the beginning of a call; whether it is complete.
    fn name(&mut self, name: Range<usize>) -> Result<bool, ExprError> {
        let Some(function) = functions::find(&self.text[name.clone()]) else { return Err(self.misplaced(name)) };
        let follows = |i: usize, kind: Kind| self.words.get(i).is_some_and(|word| word.kind == kind);
        let (has_bracket, is_empty) = (follows(self.at, Kind::Open), follows(self.at + 1, Kind::Close));
        if has_bracket && !is_empty {
            self.at += 1;
            return self.wait(Open::Call { name: name.clone(), function, args: 0 }, name).map(|()| false);
        }
        let end = if has_bracket { self.words[self.at + 1].range.end } else { name.end };
        self.at += if has_bracket { 2 } else { 0 };
        self.call(function, 0, name, end).map(|()| true)
    }

    /// Takes a word where a value is complete; whether another one must follow.
    fn after_operand(&mut self) -> Result<bool, ExprError> {
        let Some((kind, range)) = self.next() else { return Ok(false) };
        match kind {
            Kind::Operator(operator) => {
                let operator = Binary::of(operator);
                // The power groups from the right.
                let least = if operator == Binary::Power { operator.binds() + 1 } else { operator.binds() };
                self.complete(least);
                self.wait(Open::Operator(operator), range)?;
                Ok(true)
            }
            Kind::Comma => {
                self.complete(0);
                match self.open.last_mut() {
                    Some(Open::Call { args, .. }) => *args += 1,
                    _ => return Err(self.misplaced(range)),
                }
                Ok(true)
            }
            Kind::Close => {
                self.complete(0);
                match self.open.pop() {
                    Some(Open::Bracket { start }) => self.widen(start..range.end),
                    Some(Open::Call { name, function, args }) => self.call(function, args + 1, name, range.end)?,
                    _ => return Err(self.misplaced(range)),
                }
                Ok(false)
            }
            _ => Err(self.misplaced(range)),
        }
    }

    fn end(&mut self) -> Result<(), ExprError> {
        self.complete(0);
        if self.open.is_empty() { Ok(()) } else { Err(self.too_early()) }
    }

    /// Completes the signs and operators that bind at least so tightly, up to the last bracket.
    fn complete(&mut self, least: u8) {
        loop {
            match self.open.last() {
                Some(Open::Sign { start, minus }) if SIGN >= least => {
                    let range = *start..self.done.last().map_or(*start, |range| range.end);
                    if *minus {
                        self.make(NodeKind::Negate, 1, range);
                    } else {
                        self.widen(range);
                    }
                }
                Some(Open::Operator(operator)) if operator.binds() >= least => {
                    let [.., left, right] = &self.done[..] else { return };
                    let (kind, range) = (NodeKind::Binary(*operator), left.start..right.end);
                    self.make(kind, 2, range);
                }
                _ => return,
            }
            self.open.pop();
        }
    }

    fn call(
        &mut self,
        function: &'static Function,
        args: usize,
        name: Range<usize>,
        end: usize,
    ) -> Result<(), ExprError> {
        if !function.args.contains(&args) {
            let message = format!("`{}` takes {}; found {args}", function.name, function.takes());
            return Err(bad(name, message));
        }
        self.make(NodeKind::Call(function, args), args, name.start..end);
        Ok(())
    }

    fn push(&mut self, kind: NodeKind<'t>, range: Range<usize>) {
        self.make(kind, 0, range);
    }

    /// Adds a part that is made of the last `parts` complete ones.
    fn make(&mut self, kind: NodeKind<'t>, parts: usize, range: Range<usize>) {
        self.done.truncate(self.done.len() - parts);
        self.done.push(range.clone());
        self.nodes.push(Node { kind, range });
    }

    /// The last complete part is written with brackets or a sign around it.
    fn widen(&mut self, range: Range<usize>) {
        if let Some(last) = self.done.last_mut() {
            *last = range;
        }
    }

    fn wait(&mut self, open: Open, at: Range<usize>) -> Result<(), ExprError> {
        if self.open.len() >= MAX_DEPTH {
            return Err(bad(at, format!("the expression nests deeper than {MAX_DEPTH} levels")));
        }
        self.open.push(open);
        Ok(())
    }

    fn misplaced(&self, range: Range<usize>) -> ExprError {
        let word = super::shorten(&self.text[range.clone()]);
        bad(range, format!("`{word}` cannot stand here"))
    }

    fn too_early(&self) -> ExprError {
        bad(self.text.len()..self.text.len(), "the expression ends too early")
    }
}
