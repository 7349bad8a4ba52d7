//! Parses words into a tree.
//!
//! A text is a list of local definitions, `let name = …;`, and one expression. Precedence of operators, from loose to tight: `||`, `&&`, comparisons (which do not chain), `+ -`, `* / %`, a
//! leading sign or `!`, `^`. All are left-associative except `^`. So `-2^2` is -4, `2^3^2` is 512 and `7 * 29 % 90` is
//! 23.
//!
//! Incomplete parts are kept in a list, not on the program's stack. Any text is thus parsed in time proportional to its
//! length, and no nesting can overflow the stack.
use super::functions;
use super::scan::{Kind, Word, scan};
use super::tree::{Callee, Node, NodeKind, Tree};
use super::{Fault, MOST_ERRORS, Op, bad};
use std::ops::Range;

/// The most brackets, signs and operators open at once.
const MAX_DEPTH: usize = 256;

/// Words that cannot be local names.
const RESERVED: [&str; 4] = ["let", "if", "true", "false"];

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
    Operator(Binary, Range<usize>),
    /// A bracket, with the number of complete components.
    Bracket { start: usize, items: usize },
    /// A function's bracket, with the number of complete arguments.
    Call { name: Range<usize>, callee: Callee, args: usize },
    /// The definition of a local name.
    Let { start: usize, name: Range<usize> },
}

/// Finds the functions of a text; an error is the advice for a function that does not exist.
pub(super) type Find<'f> = &'f mut dyn FnMut(&str) -> Result<Callee, String>;

/// Parses an expression. Reports all unknown functions at once, and any other error alone.
pub(super) fn parse(text: &str, find: Find<'_>) -> Result<Tree, Vec<Fault>> {
    let words = scan(text).map_err(|error| vec![error])?;
    let (mut callees, mut unknown) = (vec![None; words.len()], Vec::new());
    for (at, pair) in words.windows(2).enumerate() {
        if (pair[0].kind, pair[1].kind) != (Kind::Name, Kind::Open) {
            continue;
        }
        let name = &text[pair[0].range.clone()];
        match find(name) {
            Ok(callee) => callees[at] = Some(callee),
            Err(help) => {
                let message = format!("there is no function `{}`", super::shorten(name));
                unknown.push(Fault { help: Some(help), ..bad(pair[0].range.clone(), message) });
                if unknown.len() == MOST_ERRORS {
                    break;
                }
            }
        }
    }
    if !unknown.is_empty() {
        return Err(unknown);
    }
    let mut parser = Parser { text, words, callees, at: 0, nodes: Vec::new(), done: Vec::new(), open: Vec::new() };
    parser.run().map_err(|error| vec![error])?;
    Ok(Tree { nodes: parser.nodes })
}

struct Parser<'t> {
    text: &'t str,
    words: Vec<Word>,
    /// The function that each word calls.
    callees: Vec<Option<Callee>>,
    /// Index of the next word.
    at: usize,
    nodes: Vec<Node>,
    /// Ranges of the complete parts that no other part has taken yet.
    done: Vec<Range<usize>>,
    open: Vec<Open>,
}

impl Parser<'_> {
    fn run(&mut self) -> Result<(), Fault> {
        if self.words.is_empty() {
            return Err(bad(0..self.text.len(), "the expression is empty"));
        }
        loop {
            self.definition()?;
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

    /// The kind of the word `ahead` words after the next one.
    fn kind(&self, ahead: usize) -> Option<Kind> {
        self.words.get(self.at + ahead).map(|word| word.kind)
    }

    /// Returns true if a definition begins at the next word.
    fn defines(&self) -> bool {
        let word = self.words.get(self.at).map(|word| &self.text[word.range.clone()]);
        word == Some("let") && !matches!(self.kind(1), None | Some(Kind::Operator(_) | Kind::Semicolon))
    }

    /// Reads the beginning of a definition, if there is one here.
    fn definition(&mut self) -> Result<(), Fault> {
        if !self.open.is_empty() || !self.defines() {
            return Ok(());
        }
        let start = self.words[self.at].range.start;
        self.at += 1;
        let (kind, name) = self.next().ok_or_else(|| self.too_early())?;
        let word = &self.text[name.clone()];
        let help = Some("write `let name = …;`; a name has letters, digits and `_`".to_owned());
        if kind != Kind::Name || word.contains('.') {
            let message = format!("`{}` cannot be a local name", super::shorten(word));
            return Err(Fault { help, ..bad(name, message) });
        }
        if RESERVED.contains(&word) {
            return Err(Fault { help: None, ..bad(name, format!("`{word}` is a word of the language")) });
        }
        match self.next() {
            Some((Kind::Assign, _)) => {
                self.open.push(Open::Let { start, name });
                Ok(())
            }
            Some((_, range)) => Err(Fault { help, ..bad(range, format!("`=` must stand after `let {word}`")) }),
            None => Err(self.too_early()),
        }
    }

    /// Reads a word where a value must begin; returns true if the value is complete.
    fn operand(&mut self) -> Result<bool, Fault> {
        let Some((kind, range)) = self.next() else { return Err(self.too_early()) };
        match kind {
            Kind::Number(value) => self.push(NodeKind::Number(value), range),
            Kind::Color(color) => self.push(NodeKind::Color(color), range),
            Kind::Param => self.push(NodeKind::Param, range),
            Kind::Name => return self.name(range),
            Kind::Open => return self.wait(Open::Bracket { start: range.start, items: 0 }, range).map(|()| false),
            Kind::Operator("+") => {
                return self.wait(Open::Sign { start: range.start, op: None }, range).map(|()| false);
            }
            Kind::Operator("-") => return self.sign(Op::Negate, range),
            Kind::Not => return self.sign(Op::Not, range),
            _ => return Err(self.misplaced(kind, range)),
        }
        Ok(true)
    }

    fn sign(&mut self, op: Op, range: Range<usize>) -> Result<bool, Fault> {
        self.wait(Open::Sign { start: range.start, op: Some(op) }, range).map(|()| false)
    }

    /// Reads a name, or the beginning of a call; returns true if it is complete.
    fn name(&mut self, name: Range<usize>) -> Result<bool, Fault> {
        let Some(callee) = self.callees[self.at - 1] else {
            if &self.text[name.clone()] == "let" && self.kind(0) == Some(Kind::Name) {
                let help = Some("write local definitions before the formula, outside of brackets".to_owned());
                return Err(Fault { help, ..bad(name, "`let` cannot stand here") });
            }
            self.push(NodeKind::Name, name);
            return Ok(true);
        };
        // The bracket.
        self.at += 1;
        if self.kind(0) != Some(Kind::Close) {
            return self.wait(Open::Call { name: name.clone(), callee, args: 0 }, name).map(|()| false);
        }
        let end = self.words[self.at].range.end;
        self.at += 1;
        self.call(callee, 0, name, end).map(|()| true)
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
                let chained = matches!(self.open.last(), Some(Open::Operator(left, _)) if left.binds == COMPARES);
                if chained && operator.binds == COMPARES {
                    let help = Some("write `a < b && b < c`".to_owned());
                    return Err(Fault { help, ..bad(range, "comparisons do not chain") });
                }
                self.wait(Open::Operator(operator, range.clone()), range)?;
                Ok(true)
            }
            Kind::Comma => {
                self.complete(0);
                match self.open.last_mut() {
                    Some(Open::Call { args, .. }) => *args += 1,
                    Some(Open::Bracket { items, .. }) => *items += 1,
                    _ => return Err(self.misplaced(kind, range)),
                }
                Ok(true)
            }
            Kind::Close => {
                self.complete(0);
                match self.open.pop() {
                    Some(Open::Bracket { start, items: 0 }) => self.widen(start..range.end),
                    Some(Open::Bracket { start, items }) => self.tuple(items + 1, start..range.end)?,
                    Some(Open::Call { name, callee, args }) => self.call(callee, args + 1, name, range.end)?,
                    _ => return Err(self.misplaced(kind, range)),
                }
                Ok(false)
            }
            Kind::Letters => {
                let start = self.done.last().map_or(range.start, |part| part.start);
                self.make(NodeKind::Letters { at: range.start + 1 }, 1, start..range.end);
                Ok(false)
            }
            Kind::Semicolon => {
                self.complete(0);
                let Some(Open::Let { start, name }) = self.open.pop() else {
                    return Err(self.misplaced(kind, range));
                };
                self.make(NodeKind::Let { start: name.start, end: name.end }, 1, start..range.end);
                self.done.pop();
                Ok(true)
            }
            _ => Err(self.misplaced(kind, range)),
        }
    }

    fn end(&mut self) -> Result<(), Fault> {
        self.complete(0);
        match self.open.last() {
            None => Ok(()),
            Some(Open::Let { name, .. }) => {
                let name = super::shorten(&self.text[name.clone()]);
                let help = format!("write `;` after the definition, then the formula that uses `{name}`");
                Err(Fault { help: Some(help), ..self.too_early() })
            }
            _ => Err(self.too_early()),
        }
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
                Some(Open::Operator(operator, at)) if operator.binds >= least => {
                    let [.., left, right] = &self.done[..] else { return };
                    let (Binary { op, swapped, .. }, range) = (*operator, left.start..right.end);
                    let kind = NodeKind::Binary { op, swapped, start: at.start, end: at.end };
                    self.make(kind, 2, range);
                }
                _ => return,
            }
            self.open.pop();
        }
    }

    fn call(&mut self, callee: Callee, args: usize, name: Range<usize>, end: usize) -> Result<(), Fault> {
        let (callee, takes) = match callee {
            Callee::BuiltIn(functions) => {
                let found = functions.iter().position(|function| function.args.contains(&args));
                (found.map(|at| Callee::BuiltIn(&functions[at..=at])), functions::takes(functions))
            }
            Callee::User { params, .. } => {
                let takes = format!("{params} value{}", if params == 1 { "" } else { "s" });
                ((params == args).then_some(callee), takes)
            }
        };
        let Some(callee) = callee else {
            let message = format!("`{}` takes {takes}; found {args}", super::shorten(&self.text[name.clone()]));
            return Err(bad(name, message));
        };
        self.make(NodeKind::Call { callee, args, name_end: name.end }, args, name.start..end);
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

    fn push(&mut self, kind: NodeKind, range: Range<usize>) {
        self.make(kind, 0, range);
    }

    /// Adds a part with the last `parts` complete parts as operands.
    fn make(&mut self, kind: NodeKind, parts: usize, range: Range<usize>) {
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

    fn misplaced(&self, kind: Kind, range: Range<usize>) -> Fault {
        let word = super::shorten(&self.text[range.clone()]);
        let help = match kind {
            Kind::Assign => Some("write `==` to compare, or `let name = …;` to define a name"),
            Kind::Semicolon if self.at == self.words.len() => Some("the formula has no `;` at its end"),
            Kind::Semicolon => Some("only a definition, `let name = …;`, ends with `;`"),
            _ => None,
        };
        Fault { help: help.map(str::to_owned), ..bad(range, format!("`{word}` cannot stand here")) }
    }

    fn too_early(&self) -> Fault {
        let mut fault = bad(self.text.len()..self.text.len(), "the expression ends too early");
        let defined = self.words.last().is_some_and(|word| word.kind == Kind::Semicolon);
        let help = if defined {
            "write the formula after the last `;`, or remove the definitions"
        } else {
            "a value or a closing bracket is missing at the end"
        };
        fault.help = Some(help.to_owned());
        fault
    }
}
