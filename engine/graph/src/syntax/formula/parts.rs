//! The parts of a formula.
use super::words::{Word, WordKind};
use std::collections::HashMap;
use std::ops::Range;

/// Kind of a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PartKind {
    /// The place of a value that is missing.
    Missing,
    /// A number.
    Number,
    /// A colour.
    Color,
    /// A parameter.
    Param,
    /// A name of a value.
    Name,
    /// Text without a meaning.
    Unknown,
    /// A sign, or `!`, with its value.
    Sign,
    /// An operator with two values. Two values without an operator between them are such a part without a word.
    Binary,
    /// A call; its word is the name of the function.
    Call,
    /// A value in brackets; its word is the opening one.
    Bracket,
    /// Several values in brackets.
    Vector,
    /// Components of a value.
    Letters,
    /// The definition of a local name; its word is `let`.
    Let,
}

/// A part of a formula.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// The kind.
    pub kind: PartKind,
    /// All its bytes.
    pub range: Range<usize>,
    /// The index of the word that makes it.
    pub word: Option<usize>,
    /// Number of parts that it consists of.
    pub operands: usize,
    /// The part that it belongs to.
    pub parent: Option<usize>,
}

/// A local name at its definition.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LocalName {
    /// The index of its word.
    pub word: usize,
    /// The bytes of the name.
    pub range: Range<usize>,
    /// The first byte after the definition, from where the name is known.
    pub from: usize,
    /// The part that is its value.
    pub value: usize,
}

/// A call whose brackets contain a position.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OpenCall {
    /// The bytes of the function's name.
    pub name: Range<usize>,
    /// Index of the argument at the position.
    pub argument: usize,
}

/// A formula with its words and parts.
#[derive(Debug, Default)]
pub struct Formula {
    pub(super) text: String,
    pub(super) words: Vec<Word>,
    pub(super) parts: Vec<Part>,
    /// The part that each word makes or closes.
    pub(super) owners: Vec<Option<usize>>,
    pub(super) locals: Vec<LocalName>,
    /// Indices of the local names, by their text.
    pub(super) defined: HashMap<String, Vec<usize>>,
    pub(super) root: Option<usize>,
    pub(super) faulty: bool,
}

impl Formula {
    /// The text.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The words, in order.
    pub fn words(&self) -> &[Word] {
        &self.words
    }

    /// The parts, each after those that it consists of.
    pub fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// The value of the formula.
    pub fn root(&self) -> Option<usize> {
        self.root
    }

    /// The local names, in the order of their definitions.
    pub fn locals(&self) -> &[LocalName] {
        &self.locals
    }

    /// Returns true if words are missing, misplaced or without a meaning.
    pub fn is_faulty(&self) -> bool {
        self.faulty
    }

    /// The text of a range.
    pub fn at(&self, range: &Range<usize>) -> &str {
        self.text.get(range.clone()).unwrap_or_default()
    }

    /// The text of a word.
    pub fn word(&self, index: usize) -> &str {
        self.words.get(index).map_or("", |word| self.at(&word.range))
    }

    /// The index of the word that touches a position. Between two words, it is the one with letters, or else the later
    /// one.
    pub fn word_at(&self, at: usize) -> Option<usize> {
        let after = self.words.partition_point(|word| word.range.end < at);
        let touches = |index: &usize| self.words.get(*index).is_some_and(|word| word.range.start <= at);
        let has_letters = |index: &usize| {
            use WordKind::{Color, Name, Number, Param};
            self.words.get(*index).is_some_and(|word| matches!(word.kind, Color | Name | Number | Param))
        };
        let found: Vec<usize> = [after, after + 1].into_iter().filter(touches).collect();
        found.iter().copied().find(has_letters).or(found.last().copied())
    }

    /// The index of the last word that begins before a position.
    pub fn word_before(&self, at: usize) -> Option<usize> {
        self.words.partition_point(|word| word.range.start < at).checked_sub(1)
    }

    /// The part that a word makes or closes.
    pub fn part_of(&self, word: usize) -> Option<usize> {
        self.owners.get(word).copied().flatten()
    }

    /// The smallest part that covers a range.
    pub fn covering(&self, range: &Range<usize>) -> Option<usize> {
        let covers = |part: &Part| part.range.start <= range.start && range.end <= part.range.end;
        self.parts.iter().position(covers)
    }

    /// The parts that a part consists of, in order.
    pub fn operands(&self, part: usize) -> Vec<usize> {
        let mut found = Vec::new();
        let mut next = part.checked_sub(1);
        let count = self.parts.get(part).map_or(0, |part| part.operands);
        while let Some(index) = next.filter(|_| found.len() < count) {
            if self.parts[index].parent == Some(part) {
                found.push(index);
            }
            next = index.checked_sub(1);
        }
        found.reverse();
        found
    }

    /// The local name that a name means at a position, which may be the place of its definition.
    pub fn local(&self, name: &str, at: usize) -> Option<&LocalName> {
        let all = self.defined.get(name)?;
        let known = all.partition_point(|index| self.locals[*index].from <= at);
        let here = all.get(known).filter(|index| self.locals[**index].range.start == at);
        here.or_else(|| all.get(known.checked_sub(1)?)).map(|index| &self.locals[*index])
    }

    /// The innermost call whose brackets contain a position.
    pub fn call_at(&self, at: usize) -> Option<OpenCall> {
        let mut open: Vec<(Option<usize>, usize)> = Vec::new();
        for (index, word) in self.words.iter().enumerate().take_while(|(_, word)| word.range.start < at) {
            match word.kind {
                WordKind::Open => {
                    let name = index.checked_sub(1).filter(|before| self.words[*before].kind == WordKind::Name);
                    open.push((name, 0));
                }
                WordKind::Close => drop(open.pop()),
                WordKind::Comma => open.iter_mut().rev().take(1).for_each(|(_, commas)| *commas += 1),
                _ => {}
            }
        }
        let (name, argument) = open.into_iter().rev().find_map(|(name, commas)| Some((name?, commas)))?;
        Some(OpenCall { name: self.words[name].range.clone(), argument })
    }

    /// Returns true if a word is the name of a function that is called.
    pub fn is_call(&self, word: usize) -> bool {
        let is = |index: usize, kind: WordKind| self.words.get(index).is_some_and(|word| word.kind == kind);
        is(word, WordKind::Name) && is(word + 1, WordKind::Open)
    }
}
