//! Reads the words of a formula into parts.
//!
//! The grammar is that of `shibo_value::expression`. Where a value is missing, there is a part for it; a word that cannot
//! stand in its place begins a new value, or is left out. Incomplete parts are kept in a list, not on the program's
//! stack.
use super::parts::{Formula, LocalName, Part, PartKind};
use super::words::{COMPARES, POWER, SIGN, Word, WordKind, binding, words};
use std::ops::Range;

/// The most brackets, signs and operators open at once. Words that would open more are left out.
const MAX_DEPTH: usize = 256;

/// Binding of two values without an operator between them.
const BESIDE: u8 = 0;

/// A part whose right end was not reached yet.
enum Open {
    Sign { word: usize },
    Operator { word: Option<usize>, binds: u8 },
    Bracket { word: usize, call: Option<usize>, items: usize },
    Let { word: usize, name: Option<usize> },
}

impl Formula {
    /// Parses a text, without the equals sign at its beginning.
    pub fn parse(text: &str) -> Self {
        let words = words(text);
        let owners = vec![None; words.len()];
        let formula = Self { text: text.to_owned(), owners, words, ..Self::default() };
        let mut parser = Parser { formula, at: 0, done: Vec::new(), open: Vec::new(), expects: true };
        parser.run();
        parser.formula
    }
}

struct Parser {
    formula: Formula,
    /// Index of the next word.
    at: usize,
    /// The complete parts that no other part has taken yet.
    done: Vec<usize>,
    open: Vec<Open>,
    /// True where a value must begin.
    expects: bool,
}

impl Parser {
    fn run(&mut self) {
        while let Some(word) = self.formula.words.get(self.at).cloned() {
            if self.expects { self.operand(&word) } else { self.after_operand(&word) }
        }
        if self.expects {
            self.missing(self.formula.text.len());
        }
        self.end_statement(None);
        self.formula.root = self.done.last().copied();
    }

    fn kind(&self, index: usize) -> Option<WordKind> {
        self.formula.words.get(index).map(|word| word.kind)
    }

    fn fault(&mut self) {
        self.formula.faulty = true;
    }

    /// Leaves a word out.
    fn skip(&mut self) {
        self.fault();
        self.at += 1;
    }

    /// Adds the place of a value that is missing before a byte.
    fn missing(&mut self, at: usize) {
        self.fault();
        self.make(PartKind::Missing, None, 0, at..at);
        self.expects = false;
    }

    fn leaf(&mut self, kind: PartKind, word: &Word) {
        self.make(kind, Some(self.at), 0, word.range.clone());
        self.at += 1;
        self.expects = false;
    }

    /// Opens a part. Returns false, and leaves the word out, if too many are open.
    fn wait(&mut self, open: Open) -> bool {
        if self.open.len() >= MAX_DEPTH {
            self.skip();
            return false;
        }
        self.open.push(open);
        true
    }

    /// Reads a word where a value must begin.
    fn operand(&mut self, word: &Word) {
        let text = self.formula.at(&word.range);
        let is_sign = matches!(text, "+" | "-" | "!");
        let unfinished = text.ends_with('.') || text == "$";
        match word.kind {
            WordKind::Number => self.leaf(PartKind::Number, word),
            WordKind::Color => self.leaf(PartKind::Color, word),
            WordKind::Name if self.defines() => self.definition(),
            WordKind::Name if self.kind(self.at + 1) == Some(WordKind::Open) => {
                self.formula.faulty |= unfinished;
                if self.wait(Open::Bracket { word: self.at + 1, call: Some(self.at), items: 0 }) {
                    self.at += 2;
                }
            }
            WordKind::Name | WordKind::Param => {
                self.formula.faulty |= unfinished;
                let kind = if word.kind == WordKind::Name { PartKind::Name } else { PartKind::Param };
                self.leaf(kind, word);
            }
            WordKind::Unknown => {
                self.fault();
                self.leaf(PartKind::Unknown, word);
            }
            WordKind::Open => {
                if self.wait(Open::Bracket { word: self.at, call: None, items: 0 }) {
                    self.at += 1;
                }
            }
            WordKind::Not | WordKind::Operator if is_sign => {
                if self.wait(Open::Sign { word: self.at }) {
                    self.at += 1;
                }
            }
            WordKind::Close if self.innermost_bracket().is_none() => self.skip(),
            WordKind::Close if self.is_empty_call() => {
                let Some(Open::Bracket { call: Some(name), .. }) = self.open.pop() else { return };
                let range = self.formula.words[name].range.start..word.range.end;
                let part = self.make(PartKind::Call, Some(name), 0, range);
                self.own(self.at - 1, part);
                self.own(self.at, part);
                self.at += 1;
                self.expects = false;
            }
            _ => self.missing(word.range.start),
        }
    }

    /// Returns true if the last word opened the bracket of a call.
    fn is_empty_call(&self) -> bool {
        matches!(self.open.last(), Some(Open::Bracket { word, call: Some(_), items: 0 }) if word + 1 == self.at)
    }

    /// Returns true if a definition begins at the next word.
    fn defines(&self) -> bool {
        self.open.is_empty()
            && self.formula.word(self.at) == "let"
            && matches!(self.kind(self.at + 1), Some(WordKind::Name | WordKind::Assign))
    }

    /// Reads `let name =`.
    fn definition(&mut self) {
        let name = Some(self.at + 1).filter(|name| self.kind(*name) == Some(WordKind::Name));
        let good = name.is_some_and(|name| !self.formula.word(name).contains('.'));
        self.open.push(Open::Let { word: self.at, name });
        self.at += if name.is_some() { 2 } else { 1 };
        let assigned = self.kind(self.at) == Some(WordKind::Assign);
        self.formula.faulty |= !good || !assigned;
        self.at += usize::from(assigned);
    }

    /// Reads a word after a complete value.
    fn after_operand(&mut self, word: &Word) {
        match word.kind {
            WordKind::Operator => {
                let binds = binding(self.formula.at(&word.range));
                // Powers group from the right.
                self.complete(binds + u8::from(binds == POWER));
                if self.wait(Open::Operator { word: Some(self.at), binds }) {
                    self.at += 1;
                    self.expects = true;
                }
            }
            WordKind::Comma => {
                self.complete(0);
                match self.open.last_mut() {
                    Some(Open::Bracket { items, .. }) => {
                        *items += 1;
                        self.at += 1;
                        self.expects = true;
                    }
                    _ => self.beside(true),
                }
            }
            WordKind::Close => {
                self.complete(0);
                match self.open.last() {
                    Some(Open::Bracket { .. }) => {
                        self.close(Some(self.at));
                        self.at += 1;
                    }
                    _ => self.skip(),
                }
            }
            WordKind::Letters => {
                let after = self.at.checked_sub(1).and_then(|before| self.kind(before));
                let joins =
                    after.is_some_and(|kind| kind.joins_letters() || matches!(kind, WordKind::Name | WordKind::Param));
                self.formula.faulty |= !joins || word.range.len() < 2;
                let start = self.done.last().map_or(word.range.start, |part| self.formula.parts[*part].range.start);
                self.make(PartKind::Letters, Some(self.at), 1, start..word.range.end);
                self.at += 1;
            }
            WordKind::Semicolon => {
                self.end_statement(Some(self.at));
                self.at += 1;
                self.expects = true;
            }
            WordKind::Assign => self.beside(true),
            _ => self.beside(false),
        }
    }

    /// Begins a value beside another one; `skips` leaves the word between them out.
    fn beside(&mut self, skips: bool) {
        self.fault();
        self.complete(0);
        if self.wait(Open::Operator { word: None, binds: BESIDE }) {
            self.at += usize::from(skips);
            self.expects = true;
        }
    }

    /// Completes everything that is open, and the definition of the statement.
    fn end_statement(&mut self, semicolon: Option<usize>) {
        self.complete(0);
        while matches!(self.open.last(), Some(Open::Bracket { .. })) {
            self.fault();
            self.close(None);
            self.complete(0);
        }
        let end = semicolon.map_or(self.formula.text.len(), |word| self.formula.words[word].range.end);
        match (self.open.pop(), semicolon) {
            (Some(Open::Let { word, name }), _) => {
                self.formula.faulty |= semicolon.is_none();
                let Some(value) = self.done.last().copied() else { return };
                let start = self.formula.words[word].range.start;
                let part = self.make(PartKind::Let, Some(word), 1, start..end);
                self.done.pop();
                if let Some(name) = name {
                    self.own(name, part);
                    let range = self.formula.words[name].range.clone();
                    // Without a semicolon, no place is behind the definition.
                    let from = if semicolon.is_some() { end } else { usize::MAX };
                    let written = self.formula.at(&range).to_owned();
                    self.formula.defined.entry(written).or_default().push(self.formula.locals.len());
                    self.formula.locals.push(LocalName { word: name, range, from, value });
                }
            }
            (_, Some(_)) => {
                // A value that nothing uses.
                self.fault();
                self.done.pop();
            }
            _ => {}
        }
    }

    /// The index of the innermost bracket that is open.
    fn innermost_bracket(&self) -> Option<usize> {
        self.open.iter().rposition(|open| matches!(open, Open::Bracket { .. }))
    }

    /// Completes the last bracket, whose closing word is missing without `word`.
    fn close(&mut self, word: Option<usize>) {
        let Some(Open::Bracket { word: open, call, items }) = self.open.pop() else { return };
        let end = word.map_or(self.formula.text.len(), |word| self.formula.words[word].range.end);
        let start = self.formula.words[call.unwrap_or(open)].range.start;
        let kind = match (call, items) {
            (Some(_), _) => PartKind::Call,
            (None, 0) => PartKind::Bracket,
            (None, _) => PartKind::Vector,
        };
        let part = self.make(kind, Some(call.unwrap_or(open)), items + 1, start..end);
        self.own(open, part);
        word.into_iter().for_each(|word| self.own(word, part));
    }

    /// Completes open signs and operators of at least this binding, up to the last bracket.
    fn complete(&mut self, least: u8) {
        loop {
            match self.open.last() {
                Some(Open::Sign { word }) if SIGN >= least => {
                    let word = *word;
                    let start = self.formula.words[word].range.start;
                    let end = self.done.last().map_or(start, |part| self.formula.parts[*part].range.end);
                    self.open.pop();
                    self.make(PartKind::Sign, Some(word), 1, start..end);
                }
                Some(Open::Operator { word, binds }) if *binds >= least => {
                    // Comparisons do not chain.
                    let chains = *binds == COMPARES && least == COMPARES;
                    let word = *word;
                    self.open.pop();
                    self.formula.faulty |= chains;
                    let [.., left, right] = self.done[..] else { return };
                    let range = self.formula.parts[left].range.start..self.formula.parts[right].range.end;
                    self.make(PartKind::Binary, word, 2, range);
                }
                _ => return,
            }
        }
    }

    /// Adds a part with the last `operands` complete parts.
    fn make(&mut self, kind: PartKind, word: Option<usize>, operands: usize, range: Range<usize>) -> usize {
        let index = self.formula.parts.len();
        let operands = operands.min(self.done.len());
        for part in self.done.drain(self.done.len() - operands..) {
            self.formula.parts[part].parent = Some(index);
        }
        self.formula.parts.push(Part { kind, range, word, operands, parent: None });
        word.into_iter().for_each(|word| self.own(word, index));
        self.done.push(index);
        index
    }

    fn own(&mut self, word: usize, part: usize) {
        if let Some(owner) = self.formula.owners.get_mut(word) {
            *owner = Some(part);
        }
    }
}
