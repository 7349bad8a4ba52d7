//! Compiles a tree to constants and steps.
//!
//! Vectors exist only here: every step is one operation on numbers, and an operation on vectors becomes several steps.
//! Constant parts are computed at once, in double precision; repeated parts are computed once.
use super::functions::{Function, Makes};
use super::meanings;
use super::parse::{NodeKind, Tree, parse};
use super::random::seed_word;
use super::{Fault, MOST_ERRORS, Meaning, Names, Op, Value, bad, shorten};
use crate::diagnostics::{Code, suggest};
use std::collections::HashMap;
use std::ops::Range;

/// A number: a constant, or the result of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Scalar {
    Known(f64),
    Step(u32),
}

/// A step computed for every pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Step {
    /// The value of a plane.
    Plane(usize),
    /// An operation.
    Op(Op, [Scalar; 3]),
}

/// An expression with resolved names.
#[derive(Debug)]
pub struct Compiled {
    /// The steps, each after its inputs.
    pub(super) steps: Vec<Step>,
    /// The components of the result.
    pub(super) parts: Vec<Scalar>,
    pub(super) seed: u32,
    logical: bool,
    word: Option<String>,
}

impl Compiled {
    /// The number of components of its value.
    pub fn components(&self) -> usize {
        self.parts.len()
    }

    /// The value, if the whole expression is constant.
    pub fn value(&self) -> Option<Value> {
        if let Some(word) = &self.word {
            return Some(Value::Word(word.clone()));
        }
        let known = |part: &Scalar| if let Scalar::Known(value) = part { Some(*value) } else { None };
        let values: Vec<f64> = self.parts.iter().map(known).collect::<Option<_>>()?;
        Some(match &values[..] {
            [value] if self.logical => Value::Bool(*value != 0.0),
            [value] => Value::Number(*value),
            _ => Value::Vector(values),
        })
    }
}

/// The value of `text`, which must be constant; an empty list of faults if the value is unknown because of errors that
/// were reported before.
///
/// # Errors
/// All faults of the text.
pub fn evaluate(text: &str, names: &mut dyn Names) -> Result<Value, Vec<Fault>> {
    let value = compile(text, names)?.value();
    let whole = |code, message| vec![Fault { code, range: 0..text.len(), message, help: None }];
    let numbers = match &value {
        Some(Value::Number(number)) => std::slice::from_ref(number),
        Some(Value::Vector(numbers)) => numbers,
        _ => &[],
    };
    if let Some(wrong) = numbers.iter().find(|number| !number.is_finite()) {
        let what = if wrong.is_nan() { "not a number" } else { "infinite" };
        return Err(whole(Code::NotFinite, format!("`{}` is {what}", shorten(text.trim()))));
    }
    value.ok_or_else(|| whole(Code::BadExpression, "the expression is not constant".to_owned()))
}

/// Compiles an expression, resolving its names.
///
/// # Errors
/// All faults of the text; an empty list if something is unknown because of errors that were reported before.
pub fn compile(text: &str, names: &mut dyn Names) -> Result<Compiled, Vec<Fault>> {
    let tree = parse(text)?;
    let is_random = |kind: &NodeKind<'_>| matches!(kind, NodeKind::Call(function, _) if function.is_random());
    let random = tree.nodes.iter().any(|node| is_random(&node.kind));
    let seed = if random { names.seed() } else { None };
    let mut maker = Maker { text, steps: Vec::new(), made: HashMap::new(), seed };
    let mut leaves = maker.look_up(&tree, names)?.into_iter();
    let mut terms: Vec<Term> = Vec::new();
    for node in &tree.nodes {
        let taken = terms.split_off(terms.len().saturating_sub(node.kind.parts()));
        let term = match node.kind {
            NodeKind::Number(value) => Ok(Term::number(value, node.range.clone())),
            NodeKind::Param(_) | NodeKind::Name(_) => leaves.next().ok_or_else(|| bad(node.range.clone(), "unknown")),
            NodeKind::Unary(op) => maker.apply(op, taken, node.range.clone()),
            NodeKind::Binary(op, swapped) => maker.binary(op, swapped, taken, node.range.clone()),
            NodeKind::Call(function, _) => maker.call(function, taken, node.range.clone()),
            NodeKind::Tuple(_) => maker.tuple(taken, node.range.clone()),
        };
        terms.push(term.map_err(|fault| vec![fault])?);
    }
    let Some(term) = terms.pop() else { return Err(vec![bad(0..text.len(), "the expression is empty")]) };
    let (logical, word) = match term.sort {
        Sort::Bare(_) => return Err(vec![maker.no_number(&term)]),
        Sort::Word { word, .. } => (false, Some(word)),
        sort => (sort == Sort::Logical, None),
    };
    Ok(Compiled { steps: maker.steps, parts: term.parts, seed: seed_word(maker.seed.unwrap_or(0)), logical, word })
}

/// The value of a part of the expression.
#[derive(Clone, Debug)]
struct Term {
    parts: Vec<Scalar>,
    sort: Sort,
    range: Range<usize>,
}

#[derive(Clone, Debug, PartialEq)]
enum Sort {
    Number,
    /// True or false.
    Logical,
    /// The word of a choice that has these options.
    Word {
        word: String,
        options: Vec<String>,
    },
    /// A name that could be a word; with the message and help to report if it is not one.
    Bare(Option<(String, String)>),
}

impl Term {
    fn number(value: f64, range: Range<usize>) -> Self {
        Self { parts: vec![Scalar::Known(value)], sort: Sort::Number, range }
    }

    fn is_word(&self) -> bool {
        matches!(self.sort, Sort::Word { .. } | Sort::Bare(_))
    }
}

type StepKey = (Op, [(bool, u64); 3]);

struct Maker<'t> {
    text: &'t str,
    steps: Vec<Step>,
    made: HashMap<StepKey, u32>,
    seed: Option<u64>,
}

impl Maker<'_> {
    /// Resolves the names, in the order of the tree; reports all wrong names.
    fn look_up(&mut self, tree: &Tree<'_>, names: &mut dyn Names) -> Result<Vec<Term>, Vec<Fault>> {
        let (mut terms, mut planes) = (Vec::new(), HashMap::new());
        let (mut faults, mut broken) = (Vec::new(), false);
        for node in &tree.nodes {
            let meaning = match node.kind {
                NodeKind::Param(name) => meanings::param(name, names),
                NodeKind::Name(name) => meanings::name(name, names),
                _ => continue,
            };
            let range = node.range.clone();
            let mut plane = |plane: usize| {
                let step = *planes.entry(plane).or_insert_with(|| {
                    self.steps.push(Step::Plane(plane));
                    self.steps.len() - 1
                });
                Scalar::Step(u32::try_from(step).unwrap_or(u32::MAX))
            };
            let (parts, sort) = match meaning {
                None => (Vec::new(), Sort::Bare(names.instead(&self.text[range.clone()]))),
                Some(Meaning::Known(Value::Number(value))) => (vec![Scalar::Known(value)], Sort::Number),
                Some(Meaning::Known(Value::Bool(value))) => {
                    (vec![Scalar::Known(f64::from(u8::from(value)))], Sort::Logical)
                }
                Some(Meaning::Known(Value::Vector(values))) => {
                    (values.into_iter().map(Scalar::Known).collect(), Sort::Number)
                }
                Some(Meaning::Known(Value::Word(word))) => (Vec::new(), Sort::Word { word, options: Vec::new() }),
                Some(Meaning::Choice(word, options)) => (Vec::new(), Sort::Word { word, options }),
                Some(Meaning::Planes { first, count }) => {
                    ((first..first + count).map(&mut plane).collect(), Sort::Number)
                }
                Some(Meaning::Wrong(code, message, help)) => {
                    faults.push(Fault { code, range, message, help });
                    if faults.len() == MOST_ERRORS {
                        break;
                    }
                    continue;
                }
                Some(Meaning::Broken) => {
                    broken = true;
                    continue;
                }
            };
            terms.push(Term { parts, sort, range });
        }
        if broken || !faults.is_empty() { Err(faults) } else { Ok(terms) }
    }

    /// The fault for a word where a number is needed.
    fn no_number(&self, term: &Term) -> Fault {
        let text = shorten(&self.text[term.range.clone()]);
        match &term.sort {
            Sort::Word { options, .. } => {
                let option = options.first().map_or("Option", String::as_str);
                let help = Some(format!("compare it with one of its options, `{text} == {option}`"));
                Fault { help, ..bad(term.range.clone(), format!("`{text}` is a choice, not a number")) }
            }
            Sort::Bare(Some((message, help))) => {
                Fault { help: Some(help.clone()), ..bad(term.range.clone(), message.clone()) }
            }
            _ => {
                let message = format!("there is no name `{text}`; a parameter is written `${text}`");
                bad(term.range.clone(), message)
            }
        }
    }

    fn binary(&mut self, op: Op, swapped: bool, mut terms: Vec<Term>, range: Range<usize>) -> Result<Term, Fault> {
        if let ([left, right], Op::Equal | Op::NotEqual) = (&terms[..], op)
            && (left.is_word() || right.is_word())
        {
            let same = self.same_word(left, right)?;
            let value = f64::from(u8::from(same == (op == Op::Equal)));
            return Ok(Term { sort: Sort::Logical, ..Term::number(value, range) });
        }
        if swapped {
            terms.reverse();
        }
        self.apply(op, terms, range)
    }

    fn same_word(&self, left: &Term, right: &Term) -> Result<bool, Fault> {
        let (choice, other) = if matches!(left.sort, Sort::Word { .. }) { (left, right) } else { (right, left) };
        let Sort::Word { word, options } = &choice.sort else { return Err(self.no_number(left)) };
        match &other.sort {
            Sort::Word { word: other, .. } => Ok(word == other),
            Sort::Bare(_) => {
                let written = &self.text[other.range.clone()];
                if options.iter().any(|option| option == written) || options.is_empty() {
                    return Ok(word == written);
                }
                let of = shorten(&self.text[choice.range.clone()]);
                let names: Vec<_> = options.iter().map(String::as_str).collect();
                Err(Fault {
                    code: Code::UnknownVariant,
                    range: other.range.clone(),
                    message: format!("`{of}` has no option `{}`", shorten(written)),
                    help: Some(suggest(written, "option", &names)),
                })
            }
            _ => Err(self.no_number(choice)),
        }
    }

    fn call(&mut self, function: &Function, terms: Vec<Term>, range: Range<usize>) -> Result<Term, Fault> {
        match function.makes {
            Makes::Number(value) => Ok(Term::number(value, range)),
            Makes::Bool(value) => Ok(Term { sort: Sort::Logical, ..Term::number(f64::from(u8::from(value)), range) }),
            Makes::Op(Op::If) => self.choose(terms, range),
            Makes::Op(op) => self.apply(op, terms, range),
            Makes::Fold(op) => {
                let mut terms = terms.into_iter();
                let first = terms.next().unwrap_or_else(|| Term::number(0.0, range.clone()));
                if first.is_word() {
                    return Err(self.no_number(&first));
                }
                let sum = terms.try_fold(first, |sum, term| self.apply(op, vec![sum, term], range.clone()))?;
                Ok(Term { range, sort: Sort::Number, ..sum })
            }
            Makes::Length => {
                let parts = self.components(&terms)?;
                let mut sum = None;
                for part in parts {
                    let square = self.make(Op::Multiply, &[part, part]);
                    sum = Some(sum.map_or(square, |sum| self.make(Op::Add, &[sum, square])));
                }
                let parts = vec![self.make(Op::Sqrt, &[sum.unwrap_or(Scalar::Known(0.0))])];
                Ok(Term { parts, sort: Sort::Number, range })
            }
            Makes::Hash => {
                self.needs_seed(&range)?;
                let mut hash = None;
                for part in self.components(&terms)? {
                    hash = Some(match hash {
                        None => self.make(Op::Random, &[part]),
                        Some(hash) => self.make(Op::Hash, &[hash, part]),
                    });
                }
                Ok(Term { parts: hash.into_iter().collect(), sort: Sort::Number, range })
            }
        }
    }

    /// All components of several values.
    fn components(&self, terms: &[Term]) -> Result<Vec<Scalar>, Fault> {
        if let Some(word) = terms.iter().find(|term| term.is_word()) {
            return Err(self.no_number(word));
        }
        Ok(terms.iter().flat_map(|term| term.parts.iter().copied()).collect())
    }

    fn tuple(&self, terms: Vec<Term>, range: Range<usize>) -> Result<Term, Fault> {
        if let Some(vector) = terms.iter().find(|term| term.parts.len() > 1) {
            let message = format!("a component is one number; this has {}", vector.parts.len());
            return Err(bad(vector.range.clone(), message));
        }
        Ok(Term { parts: self.components(&terms)?, sort: Sort::Number, range })
    }

    /// `if(condition, a, b)`. A constant condition selects at compile time.
    fn choose(&mut self, terms: Vec<Term>, range: Range<usize>) -> Result<Term, Fault> {
        let [condition, yes, no] = &terms[..] else { return self.apply(Op::If, terms, range) };
        let word = |term: &Term| match &term.sort {
            Sort::Word { word, .. } => Some(word.clone()),
            Sort::Bare(_) => Some(self.text[term.range.clone()].to_owned()),
            _ => None,
        };
        let known = match condition.parts[..] {
            [Scalar::Known(value)] => Some(value != 0.0),
            _ => None,
        };
        if let (Some(yes), Some(no), Some(known)) = (word(yes), word(no), known) {
            let word = if known { yes } else { no };
            return Ok(Term { parts: Vec::new(), sort: Sort::Word { word, options: Vec::new() }, range });
        }
        let sort = if yes.sort == Sort::Logical && no.sort == Sort::Logical { Sort::Logical } else { Sort::Number };
        Ok(Term { sort, ..self.apply(Op::If, terms, range)? })
    }

    /// Applies an operation component by component; a single number is used for all components.
    fn apply(&mut self, op: Op, terms: Vec<Term>, range: Range<usize>) -> Result<Term, Fault> {
        if let Some(word) = terms.iter().find(|term| term.is_word()) {
            return Err(self.no_number(word));
        }
        if matches!(op, Op::Random | Op::Hash | Op::Noise) {
            self.needs_seed(&range)?;
        }
        let count = terms.iter().map(|term| term.parts.len()).max().unwrap_or(1);
        if let Some(other) = terms.iter().find(|term| ![1, count].contains(&term.parts.len())) {
            let message = format!("{count} components and {} do not go together", other.parts.len());
            return Err(bad(other.range.clone(), message));
        }
        let component = |maker: &mut Self, k: usize| {
            let args: Vec<Scalar> = terms.iter().map(|term| term.parts[k.min(term.parts.len() - 1)]).collect();
            maker.make(op, &args)
        };
        let parts: Vec<Scalar> = (0..count).map(|k| component(self, k)).collect();
        let sort = if op.is_logical() && count == 1 { Sort::Logical } else { Sort::Number };
        Ok(Term { parts, sort, range })
    }

    fn needs_seed(&self, range: &Range<usize>) -> Result<(), Fault> {
        let message = "random numbers come from the seed of the canvas, so the canvas cannot use them";
        if self.seed.is_some() { Ok(()) } else { Err(bad(range.clone(), message)) }
    }

    /// The result of an operation on numbers: a constant or a step.
    fn make(&mut self, op: Op, args: &[Scalar]) -> Scalar {
        let mut all = [Scalar::Known(0.0); 3];
        all[..args.len()].copy_from_slice(args);
        match (op, all) {
            (Op::If, [Scalar::Known(condition), yes, no]) => return if condition != 0.0 { yes } else { no },
            (Op::Power, [base @ Scalar::Step(_), Scalar::Known(exponent), _]) => {
                if let Some(part) = self.power(base, exponent) {
                    return part;
                }
            }
            _ => {}
        }
        let known = |part: &Scalar| if let Scalar::Known(value) = part { Some(*value) } else { None };
        if let [Some(a), Some(b), Some(c)] = [known(&all[0]), known(&all[1]), known(&all[2])] {
            return Scalar::Known(op.value([a, b, c], seed_word(self.seed.unwrap_or(0))));
        }
        let key = (
            op,
            all.map(|part| match part {
                Scalar::Known(value) => (false, value.to_bits()),
                Scalar::Step(step) => (true, u64::from(step)),
            }),
        );
        let next = u32::try_from(self.steps.len()).unwrap_or(u32::MAX);
        let step = *self.made.entry(key).or_insert(next);
        if step == next {
            self.steps.push(Step::Op(op, all));
        }
        Scalar::Step(step)
    }

    /// Replaces powers by products and square roots.
    fn power(&mut self, base: Scalar, exponent: f64) -> Option<Scalar> {
        let square = |maker: &mut Self, part: Scalar| maker.make(Op::Multiply, &[part, part]);
        Some(match exponent {
            0.5 => self.make(Op::Sqrt, &[base]),
            1.0 => base,
            2.0 => square(self, base),
            3.0 => {
                let two = square(self, base);
                self.make(Op::Multiply, &[two, base])
            }
            4.0 => {
                let two = square(self, base);
                square(self, two)
            }
            _ => return None,
        })
    }
}
