//! Formulas that are put together with as few brackets as possible.
//!
//! Two formulas become one without a change of the order of operations, so that results keep their bits: a sum on the
//! right of a plus, for example, changes places with the left side, or gets brackets.
use super::words::{ATOM, Base, COMPARE, Fault, Name, POWER, PRODUCT, SIGN, SUM, Word, binding, closing, read, write};

/// The longest path after a name that is written in place of the name.
const LONGEST_PATH: usize = 80;

/// A formula.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Formula {
    /// Its words; never empty.
    pub(super) words: Vec<Word>,
}

impl Formula {
    /// Reads a formula without an equals sign.
    pub(super) fn read(text: &str) -> Result<Self, Fault> {
        Ok(Self { words: read(text)? })
    }

    /// A formula of one word.
    pub(super) fn of(word: Word) -> Self {
        Self { words: vec![word] }
    }

    /// A number, which may be negative.
    pub(super) fn number(text: &str) -> Self {
        let digits = text.trim_start_matches(['-', '+']);
        let number = Word::Number(digits.to_owned());
        if text.starts_with('-') { Self { words: vec![Word::Sign('-'), number] } } else { Self::of(number) }
    }

    /// Its text.
    pub(super) fn text(&self, name_of: &dyn Fn(&Name) -> String) -> String {
        write(&self.words, name_of)
    }

    /// The names of values in it.
    pub(super) fn names(&self) -> impl Iterator<Item = &Name> {
        self.words.iter().filter_map(|word| if let Word::Name(name) = word { Some(name) } else { None })
    }

    /// Number of operators and calls.
    pub(super) fn operations(&self) -> usize {
        self.words.iter().filter(|word| matches!(word, Word::Operator(_) | Word::Function(_))).count()
    }

    /// The deepest nesting of brackets.
    pub(super) fn depth(&self) -> usize {
        let (mut depth, mut deepest) = (0_usize, 0);
        for word in &self.words {
            match word {
                Word::Open => depth += 1,
                Word::Close => depth = depth.saturating_sub(1),
                _ => {}
            }
            deepest = deepest.max(depth);
        }
        deepest
    }

    /// How tightly its loosest operator binds.
    pub(super) fn binds(&self) -> u8 {
        let mut depth = 0_usize;
        let mut binds = ATOM;
        for word in &self.words {
            match word {
                Word::Open => depth += 1,
                Word::Close => depth = depth.saturating_sub(1),
                Word::Operator(operator) if depth == 0 => binds = binds.min(binding(operator)),
                Word::Sign(_) if depth == 0 => binds = binds.min(SIGN),
                Word::Let(_) => return 0,
                _ => {}
            }
        }
        binds
    }

    /// The operators outside brackets.
    fn outer(&self) -> impl Iterator<Item = &'static str> {
        let mut depth = 0_usize;
        self.words.iter().filter_map(move |word| {
            match word {
                Word::Open => depth += 1,
                Word::Close => depth = depth.saturating_sub(1),
                Word::Operator(operator) if depth == 0 => return Some(*operator),
                _ => {}
            }
            None
        })
    }

    /// Its value, if it is a number.
    pub(super) fn literal(&self) -> Option<f64> {
        match &self.words[..] {
            [Word::Number(number)] => number.parse().ok(),
            [Word::Sign('-'), Word::Number(number)] => number.parse::<f64>().ok().map(|value| -value),
            _ => None,
        }
    }

    /// True if it is one short word, or a number: it may be written any number of times.
    pub(super) fn is_atom(&self) -> bool {
        match &self.words[..] {
            [Word::Name(name)] => name.rest.len() <= LONGEST_PATH,
            [Word::Param(_) | Word::Color(_)] => true,
            _ => self.literal().is_some(),
        }
    }

    /// True if it has the same value everywhere.
    pub(super) fn is_constant(&self) -> bool {
        self.names().all(|name| matches!(&name.base, Base::Text(text) if text == "pi" || text.starts_with("canvas.")))
            && !self.words.iter().any(|word| matches!(word, Word::Let(_)))
    }

    /// The arguments, if the whole formula is one call of `function`.
    pub(super) fn arguments(&self, function: &str) -> Option<Vec<Self>> {
        let [Word::Function(name), Word::Open, ..] = &self.words[..] else { return None };
        if name != function || closing(&self.words, 1) != Some(self.words.len() - 1) {
            return None;
        }
        Some(split(&self.words[2..self.words.len() - 1]))
    }

    /// The components, if the whole formula is a vector.
    fn components(&self) -> Option<Vec<Self>> {
        if self.words.first() != Some(&Word::Open) || closing(&self.words, 0) != Some(self.words.len() - 1) {
            return None;
        }
        Some(split(&self.words[1..self.words.len() - 1])).filter(|parts| parts.len() > 1)
    }

    fn bracketed(mut self) -> Self {
        self.words.insert(0, Word::Open);
        self.words.push(Word::Close);
        self
    }

    /// The formula, in brackets if it binds less tightly than `least`.
    fn at_least(self, least: u8) -> Self {
        if self.binds() < least { self.bracketed() } else { self }
    }

    /// The part of its value after a dot; `rest` includes the dot.
    pub(super) fn part(mut self, rest: &str) -> Self {
        let Some(path) = rest.strip_prefix('.') else { return self };
        if let [Word::Name(name)] = &mut self.words[..] {
            name.rest.push_str(rest);
            return self;
        }
        if let [Word::Param(name)] = &mut self.words[..] {
            name.push_str(rest);
            return self;
        }
        let place = |letters: &str| letters.find(path).filter(|_| path.len() == 1);
        if let Some(parts) = self.components()
            && let Some(part) = place("xyzw").or(place("rgba")).and_then(|index| parts.into_iter().nth(index))
        {
            return part;
        }
        let ends = matches!(self.words.last(), Some(Word::Close)) && self.binds() == ATOM;
        let mut whole = if ends { self } else { self.bracketed() };
        whole.words.push(Word::Part(path.to_owned()));
        whole
    }

    /// The formula with names replaced: `with` returns what to write for a name, without what stands after its dot.
    pub(super) fn replaced(&self, with: &mut dyn FnMut(&Name) -> Option<Self>) -> Self {
        let mut words: Vec<Word> = Vec::with_capacity(self.words.len());
        // The functions of the open brackets.
        let mut open = Vec::new();
        for (at, word) in self.words.iter().enumerate() {
            let before = at.checked_sub(1).map(|before| &self.words[before]);
            match (word, before) {
                (Word::Open, Some(Word::Function(name))) => open.push(Some(name.as_str())),
                (Word::Open, _) => open.push(None),
                (Word::Close, _) => drop(open.pop()),
                _ => {}
            }
            let inner = if let Word::Name(name) = word { with(name).map(|inner| inner.part(&name.rest)) } else { None };
            let Some(mut inner) = inner else {
                words.push(word.clone());
                continue;
            };
            let after = self.words.get(at + 1);
            let least = left_need(words.last(), &inner).max(right_need(after));
            if let (Some(Word::Operator(operator)), true) = (words.last_mut(), inner.is_negative())
                && let Some(flipped) = flipped(operator)
                && least <= SUM + 1
                && after != Some(&Word::Operator("%"))
            {
                *operator = flipped;
                inner = inner.negated();
            }
            let function = open.last().copied().flatten().filter(|name| matches!(*name, "min" | "max"));
            let is_argument =
                matches!(before, Some(Word::Open | Word::Comma)) && matches!(after, Some(Word::Close | Word::Comma));
            if let Some(arguments) = function.filter(|_| is_argument).and_then(|name| inner.arguments(name)) {
                words.extend(listed(arguments));
                continue;
            }
            if inner.binds() < least
                && let Some(first) = exchanged(&words, &inner, after)
            {
                let left = words.split_off(first);
                words.extend(inner.words);
                words.extend(left.last().cloned());
                words.extend(left[..left.len() - 1].iter().cloned());
                continue;
            }
            words.extend(inner.at_least(least).words);
        }
        Self { words }.without_idle_brackets()
    }

    /// The formula without brackets around single words and calls.
    fn without_idle_brackets(self) -> Self {
        let idle = |at: usize| {
            let before = at.checked_sub(1).map(|before| &self.words[before]);
            self.words[at] == Word::Open
                && !matches!(before, Some(Word::Function(_)))
                && matches!(self.words[at + 1..], [Word::Name(_) | Word::Param(_) | Word::Number(_), Word::Close, ..])
                && !matches!(self.words.get(at + 3), Some(Word::Part(_)))
        };
        let mut words = Vec::with_capacity(self.words.len());
        let mut at = 0;
        while at < self.words.len() {
            if idle(at) {
                words.push(self.words[at + 1].clone());
                at += 3;
            } else {
                words.push(self.words[at].clone());
                at += 1;
            }
        }
        Self { words }
    }

    /// True if it begins with a minus that may become one of a difference.
    pub(super) fn is_negative(&self) -> bool {
        matches!(self.words[..], [Word::Sign('-'), ..]) && self.binds() >= PRODUCT && self.outer().all(|op| op != "%")
    }

    /// The formula with the other sign.
    pub(super) fn negated(mut self) -> Self {
        if self.is_negative() {
            self.words.remove(0);
            return self;
        }
        let least = if self.outer().all(|operator| operator != "%") { PRODUCT } else { POWER };
        let mut inner = self.at_least(least);
        inner.words.insert(0, Word::Sign('-'));
        inner
    }
}

/// Where the left side of a sum or a product begins, if `inner` may change places with it to save brackets: the last word
/// of `before` is the operator, and no other operator that binds as loosely stands before it.
fn exchanged(before: &[Word], inner: &Formula, after: Option<&Word>) -> Option<usize> {
    let (Some(Word::Operator(operator @ ("+" | "*"))), binds) = (before.last(), inner.binds()) else { return None };
    if binding(operator) != binds || right_need(after) > binds {
        return None;
    }
    let mut depth = 0_usize;
    let mut first = before.len() - 1;
    while let Some(at) = first.checked_sub(1) {
        match &before[at] {
            Word::Close => depth += 1,
            Word::Open if depth == 0 => break,
            Word::Open => depth -= 1,
            Word::Comma | Word::Semicolon | Word::Let(_) if depth == 0 => break,
            Word::Operator(other) if depth == 0 && binding(other) < binds => break,
            Word::Operator(other) if depth == 0 && binding(other) == binds => return None,
            _ => {}
        }
        first = at;
    }
    // After a minus or before a power the sides are not equal.
    let left = before.get(first.wrapping_sub(1));
    let divided = matches!(left, Some(Word::Operator("-"))) && binds == SUM;
    let negative = before.get(first).is_some_and(|word| matches!(word, Word::Sign(_)));
    (!divided && !negative).then_some(first)
}

fn flipped(operator: &str) -> Option<&'static str> {
    match operator {
        "+" => Some("-"),
        "-" => Some("+"),
        _ => None,
    }
}

/// How tightly a value must bind after this word.
fn left_need(before: Option<&Word>, inner: &Formula) -> u8 {
    match before {
        Some(Word::Operator("^")) => POWER,
        Some(Word::Operator(operator)) => binding(operator) + 1,
        // A sign may move into a product, but not into a remainder.
        Some(Word::Sign('-')) if inner.outer().all(|operator| operator != "%") && !inner.is_negative() => PRODUCT,
        Some(Word::Sign(_)) => POWER,
        _ => 0,
    }
}

/// How tightly a value must bind before this word.
fn right_need(after: Option<&Word>) -> u8 {
    match after {
        Some(Word::Operator("^")) => POWER + 1,
        Some(Word::Operator(operator)) if binding(operator) == COMPARE => COMPARE + 1,
        Some(Word::Operator(operator)) => binding(operator),
        Some(Word::Part(_)) => ATOM,
        _ => 0,
    }
}

/// Formulas with commas between them.
pub(super) fn listed(parts: Vec<Formula>) -> Vec<Word> {
    let mut words = Vec::new();
    for (index, part) in parts.into_iter().enumerate() {
        words.extend((index > 0).then_some(Word::Comma));
        words.extend(part.words);
    }
    words
}

/// The parts between the commas outside brackets.
fn split(words: &[Word]) -> Vec<Formula> {
    let (mut parts, mut part, mut depth) = (Vec::new(), Vec::new(), 0_usize);
    for word in words {
        match word {
            Word::Open => depth += 1,
            Word::Close => depth = depth.saturating_sub(1),
            Word::Comma if depth == 0 => {
                parts.push(Formula { words: std::mem::take(&mut part) });
                continue;
            }
            _ => {}
        }
        part.push(word.clone());
    }
    parts.push(Formula { words: part });
    parts
}
