//! The words around a place in a formula.
use shibo_graph::syntax::formula::{Formula, PartKind, WordKind};

/// The most words between a place and a bracket that belongs to it. It bounds the time for long formulas.
const REACH: usize = 500;

/// The words around a value in a formula, or around the place of a missing one.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Around {
    /// The word before it: an operator, or the function whose bracket opens there. Behind a comma of a call: the function and
    /// the index of the value, as in `mix,1`. At the beginning: `=`.
    pub before: String,
    /// The word before that: `#` is any number.
    pub second: String,
    /// The word after it, and after its brackets if it is a call.
    pub after: String,
    /// The word after that: `#` is any number.
    pub then: String,
    /// True if brackets follow directly.
    pub called: bool,
    /// The kinds of the values in these brackets.
    pub given: String,
}

impl Around {
    /// The words around `start..end`, which are the indices of one word or of none.
    pub(crate) fn of(formula: &Formula, start: usize, end: usize) -> Self {
        let kind = |index: usize| formula.words().get(index).map(|word| word.kind);
        let says = |index: usize| match kind(index) {
            Some(WordKind::Number) => "#".to_owned(),
            _ => formula.word(index).to_owned(),
        };
        let before = |back: usize| start.checked_sub(back);
        let follows = kind(end) == Some(WordKind::Open);
        let closes = follows.then(|| closing(formula, end)).flatten();
        let next = if follows { closes.unwrap_or(formula.words().len()) } else { end };
        Self {
            before: match before(1) {
                None => "=".to_owned(),
                Some(index) => opening(formula, index).unwrap_or_else(|| says(index)),
            },
            second: before(2).map(says).unwrap_or_default(),
            after: says(next),
            then: says(next + 1),
            called: follows,
            given: closes.map(|_| given(formula, end)).unwrap_or_default(),
        }
    }
}

/// The index of the word behind the bracket that closes the one at `open`, or of the end if it is left open. `None` if that is
/// too far away.
pub(crate) fn closing(formula: &Formula, open: usize) -> Option<usize> {
    let mut depth = 0;
    for (index, word) in formula.words().iter().enumerate().skip(open) {
        if index - open > REACH {
            return None;
        }
        match word.kind {
            WordKind::Open => depth += 1,
            WordKind::Close => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return Some(index + 1);
        }
    }
    Some(formula.words().len())
}

/// The function whose brackets open at a word, or in which it is a comma.
fn opening(formula: &Formula, index: usize) -> Option<String> {
    let words = formula.words();
    if words[index].kind != WordKind::Comma {
        return (words[index].kind == WordKind::Open && index > 0 && formula.is_call(index - 1))
            .then(|| formula.word(index - 1).to_owned());
    }
    let (mut depth, mut commas) = (0, 0);
    for (at, word) in words[..=index].iter().enumerate().rev().take(REACH) {
        match word.kind {
            WordKind::Close => depth += 1,
            WordKind::Open if depth > 0 => depth -= 1,
            WordKind::Open => {
                let call = at.checked_sub(1).filter(|before| formula.is_call(*before))?;
                return Some(format!("{},{commas}", formula.word(call)));
            }
            WordKind::Comma if depth == 0 => commas += 1,
            _ => {}
        }
    }
    None
}

/// A letter for each value in the brackets that open at a word, at most four: a number, a test, several numbers, or
/// another value.
fn given(formula: &Formula, open: usize) -> String {
    const MOST: usize = 4;
    let parts = formula.parts();
    let owner = |word: usize| formula.part_of(word).filter(|part| parts[*part].kind == PartKind::Call);
    let Some(part) = open.checked_sub(1).and_then(owner).or_else(|| formula.part_of(open)) else {
        return String::new();
    };
    let letter = |part: &usize| {
        let part = &parts[*part];
        match part.kind {
            PartKind::Number => 'n',
            PartKind::Binary => {
                let word = part.word.map_or("", |word| formula.word(word));
                if matches!(word, "<" | ">" | "<=" | ">=" | "==" | "!=" | "&&" | "||") { 't' } else { 'o' }
            }
            PartKind::Vector => 'v',
            PartKind::Sign => 'n',
            _ => 'o',
        }
    };
    formula.operands(part).iter().take(MOST).map(letter).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The words around the name of a call with this many values.
    fn around(values: usize) -> Around {
        let formula = Formula::parse(&format!("2 * f({}1) + b", "a, ".repeat(values)));
        Around::of(&formula, 2, 3)
    }

    #[test]
    fn brackets_are_followed_a_bounded_way() {
        let near = around(3);
        assert_eq!((near.after.as_str(), near.then.as_str(), near.given.as_str()), ("+", "b", "ooon"));
        let far = around(REACH);
        assert_eq!((far.after.as_str(), far.given.as_str(), far.called), ("", "", true));
        // The same holds before a place: the last value is too far from its function.
        let formula = Formula::parse(&format!("f({}1)", "a, ".repeat(REACH)));
        let last = formula.words().len() - 2;
        assert_eq!(Around::of(&formula, last, last + 1).before, ",");
        assert_eq!(Around::of(&formula, 4, 5).before, "f,1");
    }
}
