//! Values of parts of an expression while it is compiled.
use super::builder::{Builder, Scalar};
use super::components::{Chosen, choose};
use super::{Fault, Meaning, Value, bad, shorten};
use std::ops::Range;

/// The value of a part of an expression.
#[derive(Clone, Debug)]
pub(super) struct Term {
    pub(super) parts: Vec<Scalar>,
    pub(super) sort: Sort,
    /// The bytes of the part.
    pub(super) range: Range<usize>,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Sort {
    Number,
    /// True or false.
    Logical,
    /// An unknown number of components; one stands for all.
    Any,
    /// The number of a piece.
    Ids,
    /// The word of a choice that has these options.
    Word {
        word: String,
        options: Vec<String>,
    },
    /// A name that could be a word; with the message and help to report if it is not one.
    Bare {
        word: String,
        instead: Option<(String, String)>,
    },
}

impl Term {
    pub(super) fn number(value: f64, range: Range<usize>) -> Self {
        Self { parts: vec![Scalar::Known(value)], sort: Sort::Number, range }
    }

    pub(super) fn color(color: [f32; 3], range: Range<usize>) -> Self {
        let parts = color.iter().map(|value| Scalar::Known(f64::from(*value))).collect();
        Self { parts, sort: Sort::Number, range }
    }

    pub(super) fn logical(value: bool, range: Range<usize>) -> Self {
        Self { sort: Sort::Logical, ..Self::number(f64::from(u8::from(value)), range) }
    }

    /// The value of a name; `None` if it has none.
    pub(super) fn of(meaning: &Meaning, builder: &mut Builder, range: Range<usize>) -> Option<Self> {
        let (parts, sort) = match meaning {
            Meaning::Known(Value::Bool(value)) => return Some(Self::logical(*value, range)),
            Meaning::Known(Value::Number(value)) => return Some(Self::number(*value, range)),
            Meaning::Known(Value::Vector(values)) => {
                (values.iter().map(|value| Scalar::Known(*value)).collect(), Sort::Number)
            }
            Meaning::Known(Value::Word(word)) => (Vec::new(), Sort::Word { word: word.clone(), options: Vec::new() }),
            Meaning::Choice(word, options) => (Vec::new(), Sort::Word { word: word.clone(), options: options.clone() }),
            Meaning::Planes { first, count } => {
                ((*first..first + count).map(|plane| builder.plane(plane)).collect(), Sort::Number)
            }
            Meaning::Any { first } => (vec![builder.plane(*first)], Sort::Any),
            Meaning::Ids { plane } => (vec![builder.plane(*plane)], Sort::Ids),
            Meaning::Wrong(..) | Meaning::Broken => return None,
        };
        Some(Self { parts, sort, range })
    }

    /// Components of a value with an unknown number of them.
    pub(super) fn of_any(first: usize, letters: &str, builder: &mut Builder, range: Range<usize>) -> Self {
        let (word, rest) = letters.split_once('.').map_or((letters, None), |(word, rest)| (word, Some(rest)));
        let term = match choose(None, word) {
            Some(Chosen::These(indices)) => {
                let parts = indices.into_iter().map(|index| builder.plane(first + index)).collect();
                Self { parts, sort: Sort::Number, range }
            }
            _ => Self { parts: vec![builder.plane(first)], sort: Sort::Any, range },
        };
        // Letters behind letters of an unknown value may be a channel and its components.
        match rest {
            None => term,
            Some(rest) => rest.split('.').try_fold(term.clone(), |term, word| term.choose(word)).unwrap_or(term),
        }
    }

    pub(super) fn is_word(&self) -> bool {
        matches!(self.sort, Sort::Word { .. } | Sort::Bare { .. })
    }

    /// Its number of components; `None` if it is not known.
    pub(super) fn count(&self) -> Option<usize> {
        (self.sort != Sort::Any).then_some(self.parts.len())
    }

    /// The component with this index; a single number counts as all components.
    pub(super) fn part(&self, index: usize) -> Scalar {
        self.parts.get(index).or(self.parts.last()).copied().unwrap_or(Scalar::Known(0.0))
    }

    /// Its components of these letters; `None` if there are none.
    pub(super) fn choose(&self, letters: &str) -> Option<Self> {
        let (parts, sort) = match choose(self.count(), letters)? {
            Chosen::These(indices) => (indices.into_iter().map(|index| self.part(index)).collect(), Sort::Number),
            Chosen::Any => (self.parts.clone(), Sort::Any),
        };
        Some(Self { parts, sort, range: self.range.clone() })
    }

    /// The fault for a word, or for numbers of pieces, where a number is needed; `text` is that of the expression.
    pub(super) fn no_number(&self, text: &str) -> Fault {
        let written = shorten(&text[self.range.clone()]);
        let (message, help) = match &self.sort {
            Sort::Word { options, .. } => {
                let option = options.first().map_or("Option", String::as_str);
                let help = format!("compare it with one of its options, `{written} == {option}`");
                (format!("`{written}` is a choice, not a number"), Some(help))
            }
            Sort::Ids => {
                let help = format!("to compute with pieces, use `random({written})` or `random({written}, seed)`");
                (format!("`{written}` are numbers of pieces"), Some(help))
            }
            Sort::Bare { instead: Some((message, help)), .. } => (message.clone(), Some(help.clone())),
            _ => (format!("there is no name `{written}`; a parameter is written `${written}`"), None),
        };
        Fault { help, ..bad(self.range.clone(), message) }
    }
}

/// The fault of the first value that is not a number.
pub(super) fn numbers(terms: &[Term], text: &str) -> Result<(), Fault> {
    match terms.iter().find(|term| term.is_word() || term.sort == Sort::Ids) {
        Some(term) => Err(term.no_number(text)),
        None => Ok(()),
    }
}

/// The fault of the first value that is a word.
pub(super) fn no_words(terms: &[Term], text: &str) -> Result<(), Fault> {
    match terms.iter().find(|term| term.is_word()) {
        Some(term) => Err(term.no_number(text)),
        None => Ok(()),
    }
}
