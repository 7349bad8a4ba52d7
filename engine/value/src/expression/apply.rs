//! Applies operators and functions to values.
//!
//! Vectors exist only here: every step is one operation on numbers, and an operation on vectors becomes several steps.
use super::builder::{Builder, Scalar};
use super::functions::{Function, Makes, Takes};
use super::random::seed_word;
use super::term::{Sort, Term, no_words, numbers};
use super::{Fault, Names, Op, bad, components, shorten};
use crate::diagnostics::{Code, suggest};
use std::ops::Range;

pub(super) struct Maker<'u, 'n> {
    /// The text that holds the parts that are compiled.
    pub(super) text: &'u str,
    pub(super) builder: Builder,
    pub(super) names: &'n mut dyn Names,
    /// The seed of random numbers, if it is known.
    pub(super) seed: Option<u64>,
    /// Arguments are not known, so constants are not needed.
    pub(super) outline: bool,
}

/// The place of an operation: all of it, and the operator or the name of the function.
#[derive(Clone, Debug)]
pub(super) struct Place {
    pub(super) range: Range<usize>,
    pub(super) at: Range<usize>,
}

impl Maker<'_, '_> {
    fn make(&mut self, op: Op, args: &[Scalar]) -> Scalar {
        let seed = seed_word(self.seed.unwrap_or(0)).into();
        self.builder.make(op, args, seed)
    }

    pub(super) fn binary(&mut self, op: Op, swapped: bool, mut terms: Vec<Term>, place: &Place) -> Result<Term, Fault> {
        if let ([left, right], Op::Equal | Op::NotEqual) = (&terms[..], op) {
            if left.is_word() || right.is_word() {
                // A value that is not known may be a choice.
                if let Some(any) = terms.iter().find(|term| term.sort == Sort::Any) {
                    return Ok(Term { sort: Sort::Logical, range: place.range.clone(), ..any.clone() });
                }
                let same = self.same_word(left, right)?;
                return Ok(Term::logical(same == (op == Op::Equal), place.range.clone()));
            }
            return self.combine(op, &terms, place);
        }
        if swapped {
            terms.reverse();
        }
        self.apply(op, &terms, place)
    }

    fn same_word(&self, left: &Term, right: &Term) -> Result<bool, Fault> {
        let (choice, other) = if matches!(left.sort, Sort::Word { .. }) { (left, right) } else { (right, left) };
        let Sort::Word { word, options } = &choice.sort else {
            let bare = if left.is_word() { left } else { right };
            return Err(bare.no_number(self.text));
        };
        match &other.sort {
            Sort::Word { word: other, .. } => Ok(word == other),
            Sort::Bare { word: written, .. } => {
                if options.iter().any(|option| option == written) || options.is_empty() {
                    return Ok(word == written);
                }
                let of = shorten(&self.text[choice.range.clone()]);
                let names: Vec<_> = options.iter().map(String::as_str).collect();
                let message = format!("`{of}` has no option `{}`", shorten(written));
                let help = Some(suggest(written, "option", &names));
                Err(Fault { code: Code::UnknownVariant, help, ..bad(other.range.clone(), message) })
            }
            _ => Err(choice.no_number(self.text)),
        }
    }

    /// The result of a function of the language that no expression defines.
    pub(super) fn call(&mut self, function: &Function, terms: Vec<Term>, call: &Place) -> Result<Term, Fault> {
        let range = call.range.clone();
        match function.makes {
            Makes::Number(value) => Ok(Term::number(value, range)),
            Makes::Bool(value) => Ok(Term::logical(value, range)),
            Makes::Op(Op::If) => self.choose(&terms, call),
            Makes::Op(Op::Random) => {
                self.needs_seed(call)?;
                self.combine(Op::Random, &terms, call)
            }
            Makes::Op(op) => {
                if op.is_seeded() {
                    self.needs_seed(call)?;
                }
                self.apply(op, &terms, call)
            }
            Makes::Fold(op) => {
                numbers(&terms, self.text)?;
                let mut terms = terms.into_iter();
                let first = terms.next().unwrap_or_else(|| Term::number(0.0, range.clone()));
                let sort = if first.sort == Sort::Any { Sort::Any } else { Sort::Number };
                let first = Term { sort, ..first };
                let all = terms.try_fold(first, |all, term| self.apply(op, &[all, term], call))?;
                Ok(Term { range, ..all })
            }
            Makes::Length | Makes::Sum => {
                let mut sum = None;
                for part in self.components(&terms)? {
                    let part = if function.makes == Makes::Sum { part } else { self.make(Op::Multiply, &[part, part]) };
                    sum = Some(sum.map_or(part, |sum| self.make(Op::Add, &[sum, part])));
                }
                let sum = sum.unwrap_or(Scalar::Known(0.0));
                let sum = if function.makes == Makes::Sum { sum } else { self.make(Op::Sqrt, &[sum]) };
                Ok(Term { parts: vec![sum], sort: Sort::Number, range })
            }
            Makes::Hash => {
                self.needs_seed(call)?;
                no_words(&terms, self.text)?;
                let mut hash = None;
                for part in terms.iter().flat_map(|term| &term.parts) {
                    hash = Some(match hash {
                        None => self.make(Op::Random, &[*part]),
                        Some(hash) => self.make(Op::Hash, &[hash, *part]),
                    });
                }
                Ok(Term { parts: hash.into_iter().collect(), sort: Sort::Number, range })
            }
            Makes::Piece => self.piece(&terms, call),
            // The caller runs the expression that defines it.
            Makes::Composed(_) => Err(bad(call.at.clone(), "unknown")),
        }
    }

    /// `random(i, seed)`
    fn piece(&mut self, terms: &[Term], call: &Place) -> Result<Term, Fault> {
        no_words(terms, self.text)?;
        let [pieces, seed] = terms else { return Err(bad(call.at.clone(), "unknown")) };
        let known = match seed.parts[..] {
            [Scalar::Known(value)] if value >= 0.0 && value.fract() == 0.0 && value <= MOST_SEED => Some(value),
            _ => None,
        };
        let seed = match known {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a whole number of 53 bits")]
            Some(seed) => self.names.seed_of(seed as u64),
            None if self.outline || seed.sort == Sort::Any => Some(0),
            None => {
                let help = Some("write a number, or a parameter of the graph".to_owned());
                let message = "the seed of `random` is a constant whole number from 0 up";
                return Err(Fault { help, ..bad(seed.range.clone(), message) });
            }
        };
        let Some(seed) = seed.or(self.outline.then_some(0)) else {
            return Err(bad(call.at.clone(), "a seed is combined with that of the canvas, which is not known here"));
        };
        let parts = pieces.parts.iter().map(|part| self.builder.make(Op::Piece, &[*part], seed)).collect();
        let sort = if pieces.sort == Sort::Any { Sort::Any } else { Sort::Number };
        Ok(Term { parts, sort, range: call.range.clone() })
    }

    /// All components of several values.
    fn components(&self, terms: &[Term]) -> Result<Vec<Scalar>, Fault> {
        numbers(terms, self.text)?;
        Ok(terms.iter().flat_map(|term| term.parts.iter().copied()).collect())
    }

    pub(super) fn tuple(&self, terms: &[Term], range: Range<usize>) -> Result<Term, Fault> {
        if let Some(vector) = terms.iter().find(|term| term.parts.len() > 1) {
            let message = format!("a component is one number; this has {}", vector.parts.len());
            let help = Some("take one of its components, such as `.x`".to_owned());
            return Err(Fault { help, ..bad(vector.range.clone(), message) });
        }
        Ok(Term { parts: self.components(terms)?, sort: Sort::Number, range })
    }

    /// The components of a value whose letters begin at byte `at`; `place` is that of a fault.
    pub(super) fn letters(
        &self,
        terms: &[Term],
        at: usize,
        range: Range<usize>,
        place: Range<usize>,
    ) -> Result<Term, Fault> {
        let Some(term) = terms.first() else { return Err(bad(range, "unknown")) };
        if term.is_word() {
            return Err(term.no_number(self.text));
        }
        let (subject, letters) = (&self.text[range.start..at - 1], &self.text[at..range.end]);
        let chosen = letters.split('.').try_fold(term.clone(), |term, part| term.choose(part));
        let chosen = chosen.ok_or_else(|| components::check(term.count(), subject, letters).err());
        match chosen {
            Ok(chosen) => Ok(Term { range, ..chosen }),
            Err(wrong) => {
                let (message, help) = wrong.unwrap_or_default();
                Err(Fault { help: Some(help), ..bad(place, message) })
            }
        }
    }

    /// `if(condition, a, b)`. A constant condition selects at compile time.
    fn choose(&mut self, terms: &[Term], call: &Place) -> Result<Term, Fault> {
        let [condition, yes, no] = terms else { return self.apply(Op::If, terms, call) };
        let word = |term: &Term| match &term.sort {
            Sort::Word { word, .. } | Sort::Bare { word, .. } => Some(word.clone()),
            _ => None,
        };
        let known = match condition.parts[..] {
            [Scalar::Known(value)] => Some(value != 0.0),
            _ => None,
        };
        if let (Some(yes), Some(no), Some(known)) = (word(yes), word(no), known) {
            let word = if known { yes } else { no };
            return Ok(Term {
                parts: Vec::new(),
                sort: Sort::Word { word, options: Vec::new() },
                range: call.range.clone(),
            });
        }
        if let Some(any) = terms.iter().find(|term| term.sort == Sort::Any)
            && (yes.is_word() || no.is_word())
        {
            // A value that is not known may be a word, or decide between words.
            return Ok(Term { range: call.range.clone(), ..any.clone() });
        }
        let logical = yes.sort == Sort::Logical && no.sort == Sort::Logical;
        let chosen = self.apply(Op::If, terms, call)?;
        Ok(if logical { Term { sort: Sort::Logical, ..chosen } } else { chosen })
    }

    /// Applies an operation on numbers, component by component; a single number is used for all components.
    pub(super) fn apply(&mut self, op: Op, terms: &[Term], place: &Place) -> Result<Term, Fault> {
        numbers(terms, self.text)?;
        self.combine(op, terms, place)
    }

    /// Applies an operation to numbers or numbers of pieces.
    fn combine(&mut self, op: Op, terms: &[Term], place: &Place) -> Result<Term, Fault> {
        no_words(terms, self.text)?;
        let count = terms.iter().map(|term| term.parts.len()).max().unwrap_or(1);
        if let Some(other) = terms.iter().find(|term| ![1, count].contains(&term.parts.len())) {
            let message = format!("{} components and {count} do not go together", other.parts.len());
            let help = Some("use as many components of each, for example `.xy`".to_owned());
            return Err(Fault { help, ..bad(place.at.clone(), message) });
        }
        let component = |maker: &mut Self, k: usize| {
            let args: Vec<Scalar> = terms.iter().map(|term| term.part(k)).collect();
            maker.make(op, &args)
        };
        let parts: Vec<Scalar> = (0..count).map(|k| component(self, k)).collect();
        // Several components decide the number of components of a value that is not known.
        let sort = match count {
            1 if terms.iter().any(|term| term.sort == Sort::Any) => Sort::Any,
            1 if op.is_logical() => Sort::Logical,
            _ => Sort::Number,
        };
        Ok(Term { parts, sort, range: place.range.clone() })
    }

    fn needs_seed(&self, call: &Place) -> Result<(), Fault> {
        let message = "random numbers come from the seed of the canvas, so the canvas cannot use them";
        if self.seed.is_some() { Ok(()) } else { Err(bad(call.range.clone(), message)) }
    }

    /// Checks the components of the arguments of a function of the language that an expression defines.
    pub(super) fn takes(
        &self,
        function: &Function,
        params: &[(&str, Takes)],
        terms: &[Term],
        call: &Place,
    ) -> Result<(), Fault> {
        numbers(terms, self.text)?;
        for (term, (param, takes)) in terms.iter().zip(params) {
            let (needed, help) = match (takes, term.count()) {
                (Takes::Any, _) | (_, None) => continue,
                (Takes::Count(needed), Some(count)) if *needed == count => continue,
                (Takes::Vector, Some(2..)) => continue,
                (Takes::Count(1), _) => ("1 component", "take one component, such as `v.x`"),
                (Takes::Count(2), _) => ("2 components", "`(x, y)` and `v.xy` have two"),
                (Takes::Count(_), _) => ("3 components", "`(r, g, b)` and a colour have three"),
                (Takes::Vector, _) => ("a vector", "`(x, y)` and `(x, y, z)` are vectors"),
            };
            let (name, call_text) = (function.name, function.call());
            let message = format!("`{name}` takes {needed} for `{param}`; found {}", term.parts.len());
            return Err(Fault { help: Some(format!("{call_text}: {help}")), ..bad(call.at.clone(), message) });
        }
        Ok(())
    }
}

/// The largest seed: larger numbers are not exact.
const MOST_SEED: f64 = 9_007_199_254_740_992.0;
