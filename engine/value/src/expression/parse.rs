//! Parses words into a tree.
//!
//! Precedence of operators, from loose to tight: `||`, `&&`, comparisons (which do not chain), `+ -`, `* / %`, a
//! leading sign or `!`, `^`. All are left-associative except `^`. So `-2^2` is -4, `2^3^2` is 512 and `7 * 29 % 90` is
//! 23.
//!
//! Incomplete parts are kept in a list, not on the program's stack. Any text is thus parsed in time proportional to its
//! length, and no nesting can overflow the stack.
use super::functions::{self, Function};
use super::scan::{Kind, Word, scan};
use super::{Fault, MOST_ERRORS, Op, bad};
use crate::diagnostics::suggest;
use std::ops::Range;

/// The most brackets, signs and operators open at once.
const MAX_DEPTH: usize = 256;

/// An expression as a tree.
#[derive(Debug, PartialEq)]
pub(super) struct Tree<'t> {
    /// Parts in postfix order: each after its operands, the whole expression last. They can be walked without
    /// recursion.
    pub(super) nodes: Vec<Node<'t>>,
}

/// A part of an expression.
#[derive(Debug, PartialEq)]
pub(super) struct Node<'t> {
    pub(super) kind: NodeKind<'t>,
    /// The bytes of the whole part in the text.
    pub(super) range: Range<usize>,
}

/// Kind of a part. An operation takes its operands from the end of the preceding parts that no other part has taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum NodeKind<'t> {
    /// A number.
    Number(f64),
    /// A parameter of that name.
    Param(&'t str),
    /// Another name.
    Name(&'t str),
    /// An operation on one part.
    Unary(Op),
    /// An operation on two parts; `true` swaps them, for operators such as `>` that mirror the operation.
    Binary(Op, bool),
    /// A function call with this many arguments.
    Call(&'static Function, usize),
    /// A vector of this many parts.
    Tuple(usize),
}

impl NodeKind<'_> {
    /// Number of operands.
    pub(super) fn parts(self) -> usize {
        match self {
            Self::Number(_) | Self::Param(_) | Self::Name(_) => 0,
            Self::Unary(_) => 1,
            Self::Binary(..) => 2,
            Self::Call(_, parts) | Self::Tuple(parts) => parts,
        }
    }
}

/// An operator between two parts.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Binary {
    op: Op,
    swapped: bool,
    /// Higher numbers bind tighter.
    binds: u8,
}

impl Binary {
    fn of(operator: &str) -> Self {
        let (op, swapped, binds) = match operator {
            "||" => (Op::Or, false, 1),
            "&&" => (Op::And, false, 2),
            "<" => (Op::Less, false, COMPARES),
            "<=" => (Op::LessEqual, false, COMPARES),
            ">" => (Op::Less, true, COMPARES),
            ">=" => (Op::LessEqual, true, COMPARES),
            "==" => (Op::Equal, false, COMPARES),
            "!=" => (Op::NotEqual, false, COMPARES),
            "+" => (Op::Add, false, 4),
            "-" => (Op::Subtract, false, 4),
            "*" => (Op::Multiply, false, 5),
            "/" => (Op::Divide, false, 5),
            "%" => (Op::Modulo, false, 5),
            _ => (Op::Power, false, 7),
        };
        Self { op, swapped, binds }
    }
}

/// Precedence of comparisons.
const COMPARES: u8 = 3;
/// Precedence of a leading sign.
const SIGN: u8 = 6;

/// A part whose right end was not reached yet.
enum Open {
    /// A leading sign or negation; no operation for a plus.
    Sign { start: usize, op: Option<Op> },
    /// An operator whose left side is complete.
    Operator(Binary),
    /// A bracket, with the number of complete components.
    Bracket { start: usize, items: usize },
    /// A function's bracket, with the number of complete arguments.
    Call { name: Range<usize>, function: &'static Function, args: usize },
}

/// Parses an expression. Reports all unknown functions at once, and any other error alone.
pub(super) fn parse(text: &str) -> Result<Tree<'_>, Vec<Fault>> {
    let words = scan(text).map_err(|error| vec![error])?;
    let called = words.windows(2).filter(|pair| pair[1].kind == Kind::Open).map(|pair| &pair[0]);
    let unknown: Vec<_> = called.filter_map(|word| unknown_function(text, word)).take(MOST_ERRORS).collect();
    if !unknown.is_empty() {
        return Err(unknown);
    }
    let mut parser = Parser { text, words, at: 0, nodes: Vec::new(), done: Vec::new(), open: Vec::new() };
    parser.run().map_err(|error| vec![error])?;
    Ok(Tree { nodes: parser.nodes })
}

fn unknown_function(text: &str, word: &Word) -> Option<Fault> {
    let name = &text[word.range.clone()];
    if word.kind != Kind::Name || functions::find(name).is_some() {
        return None;
    }
    let names: Vec<_> = functions::ALL.iter().map(|f| f.name).collect();
    let help = functions::elsewhere(name).map_or_else(|| suggest(name, "function", &names), str::to_owned);
    let message = format!("there is no function `{}`", super::shorten(name));
    Some(Fault { help: Some(help), ..bad(word.range.clone(), message) })
}

struct Parser<'t> {
    text: &'t str,
    words: Vec<Word>,
    /// Index of the next word.
    at: usize,
    nodes: Vec<Node<'t>>,
    /// Ranges of the complete parts that no other part has taken yet.
    done: Vec<Range<usize>>,
    open: Vec<Open>,
}

impl<'t> Parser<'t> {
    fn run(&mut self) -> Result<(), Fault> {
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

    /// Reads a word where a value must begin; returns true if the value is complete.
    fn operand(&mut self) -> Result<bool, Fault> {
        let Some((kind, range)) = self.next() else { return Err(self.too_early()) };
        match kind {
            Kind::Number(value) => self.push(NodeKind::Number(value), range),
            Kind::Param => self.push(NodeKind::Param(&self.text[range.start + 1..range.end]), range),
            Kind::Name => return self.name(range),
            Kind::Open => return self.wait(Open::Bracket { start: range.start, items: 0 }, range).map(|()| false),
            Kind::Operator("+") => {
                return self.wait(Open::Sign { start: range.start, op: None }, range).map(|()| false);
            }
            Kind::Operator("-") => return self.sign(Op::Negate, range),
            Kind::Not => return self.sign(Op::Not, range),
            Kind::Close | Kind::Comma | Kind::Operator(_) => return Err(self.misplaced(range)),
        }
        Ok(true)
    }

    fn sign(&mut self, op: Op, range: Range<usize>) -> Result<bool, Fault> {
        self.wait(Open::Sign { start: range.start, op: Some(op) }, range).map(|()| false)
    }

    /// Reads a name, or the beginning of a call; returns true if it is complete.
    fn name(&mut self, name: Range<usize>) -> Result<bool, Fault> {
        let text = &self.text[name.clone()];
        let Some(function) = functions::find(text) else {
            self.push(NodeKind::Name(text), name);
            return Ok(true);
        };
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

    /// Reads a word after a complete value; returns true if another value must follow.
    fn after_operand(&mut self) -> Result<bool, Fault> {
        let Some((kind, range)) = self.next() else { return Ok(false) };
        match kind {
            Kind::Operator(operator) => {
                let operator = Binary::of(operator);
                // Powers are right-associative; comparisons do not chain.
                let rightwards = operator.op == Op::Power || operator.binds == COMPARES;
                self.complete(operator.binds + u8::from(rightwards));
                let chained = matches!(self.open.last(), Some(Open::Operator(left)) if left.binds == COMPARES);
                if chained && operator.binds == COMPARES {
                    let help = Some("write `a < b && b < c`".to_owned());
                    return Err(Fault { help, ..bad(range, "comparisons do not chain") });
                }
                self.wait(Open::Operator(operator), range)?;
                Ok(true)
            }
            Kind::Comma => {
                self.complete(0);
                match self.open.last_mut() {
                    Some(Open::Call { args, .. }) => *args += 1,
                    Some(Open::Bracket { items, .. }) => *items += 1,
                    _ => return Err(self.misplaced(range)),
                }
                Ok(true)
            }
            Kind::Close => {
                self.complete(0);
                match self.open.pop() {
                    Some(Open::Bracket { start, items: 0 }) => self.widen(start..range.end),
                    Some(Open::Bracket { start, items }) => self.tuple(items + 1, start..range.end)?,
                    Some(Open::Call { name, function, args }) => self.call(function, args + 1, name, range.end)?,
                    _ => return Err(self.misplaced(range)),
                }
                Ok(false)
            }
            _ => Err(self.misplaced(range)),
        }
    }

    fn end(&mut self) -> Result<(), Fault> {
        self.complete(0);
        if self.open.is_empty() { Ok(()) } else { Err(self.too_early()) }
    }

    /// Completes open signs and operators of at least this precedence, up to the last bracket.
    fn complete(&mut self, least: u8) {
        loop {
            match self.open.last() {
                Some(Open::Sign { start, op }) if SIGN >= least => {
                    let range = *start..self.done.last().map_or(*start, |range| range.end);
                    match *op {
                        Some(op) => self.make(NodeKind::Unary(op), 1, range),
                        None => self.widen(range),
                    }
                }
                Some(Open::Operator(operator)) if operator.binds >= least => {
                    let [.., left, right] = &self.done[..] else { return };
                    let (kind, range) = (NodeKind::Binary(operator.op, operator.swapped), left.start..right.end);
                    self.make(kind, 2, range);
                }
                _ => return,
            }
            self.open.pop();
        }
    }

    fn call(&mut self, function: &'static Function, args: usize, name: Range<usize>, end: usize) -> Result<(), Fault> {
        if !function.args.contains(&args) {
            let message = format!("`{}` takes {}; found {args}", function.name, function.takes());
            return Err(bad(name, message));
        }
        self.make(NodeKind::Call(function, args), args, name.start..end);
        Ok(())
    }

    fn tuple(&mut self, parts: usize, range: Range<usize>) -> Result<(), Fault> {
        if parts > 4 {
            let message = format!("a vector has at most 4 components; found {parts}");
            return Err(bad(range, message));
        }
        self.make(NodeKind::Tuple(parts), parts, range);
        Ok(())
    }

    fn push(&mut self, kind: NodeKind<'t>, range: Range<usize>) {
        self.make(kind, 0, range);
    }

    /// Adds a part with the last `parts` complete parts as operands.
    fn make(&mut self, kind: NodeKind<'t>, parts: usize, range: Range<usize>) {
        self.done.truncate(self.done.len() - parts);
        self.done.push(range.clone());
        self.nodes.push(Node { kind, range });
    }

    /// Widens the last complete part by the brackets or sign around it.
    fn widen(&mut self, range: Range<usize>) {
        if let Some(last) = self.done.last_mut() {
            *last = range;
        }
    }

    fn wait(&mut self, open: Open, at: Range<usize>) -> Result<(), Fault> {
        if self.open.len() >= MAX_DEPTH {
            return Err(bad(at, format!("the expression nests deeper than {MAX_DEPTH} levels")));
        }
        self.open.push(open);
        Ok(())
    }

    fn misplaced(&self, range: Range<usize>) -> Fault {
        let word = super::shorten(&self.text[range.clone()]);
        bad(range, format!("`{word}` cannot stand here"))
    }

    fn too_early(&self) -> Fault {
        let mut fault = bad(self.text.len()..self.text.len(), "the expression ends too early");
        fault.help = Some("a value or a closing bracket is missing at the end".to_owned());
        fault
    }
}
