//! Compiles a tree to constants and steps.
//!
//! Calls of functions that expressions define are compiled in place: a list of frames, one for each call that is not
//! complete, takes the place of recursion.
use super::apply::{Maker, Place};
use super::builder::Builder;
use super::compiled::{self, Compiled};
use super::functions::{COMPOSED, Makes};
use super::program::MOST_STEPS;
use super::resolve::Leaf;
use super::term::{Sort, Term, no_words};
use super::tree::{Callee, Node, NodeKind};
use super::unit::{BUILT_IN, Loaded, Unit, load};
use super::{Fault, Meaning, Names, Value, bad, shorten};
use crate::diagnostics::Code;
use std::ops::Range;

/// The deepest nesting of calls of functions of the user.
const MOST_CALLS: usize = 32;
/// The most parts of bodies of functions that are compiled for one expression.
const MOST_PARTS: usize = 16 * MOST_STEPS;

/// The value of `text`, which must be constant; an empty list of faults if the value is unknown because of errors that
/// were reported before.
///
/// # Errors
/// All faults of the text.
pub fn evaluate(text: &str, names: &mut dyn Names) -> Result<Value, Vec<Fault>> {
    let value = compile(text, names)?.value();
    let whole = |code, message: String| vec![Fault { code, ..bad(0..text.len(), message) }];
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
    let Loaded { units, faults, broken } = load(text, names);
    if broken || !faults.is_empty() {
        return Err(faults);
    }
    let seed = if units.iter().any(Unit::is_random) { names.seed() } else { None };
    let maker = Maker { text: "", builder: Builder::default(), names, seed, outline: false };
    run(&units, Vec::new(), maker).map_err(|fault| vec![fault])
}

/// A call that is not complete, or the whole expression.
struct Frame<'u> {
    unit: &'u Unit,
    /// The next node, and the next name.
    at: usize,
    leaf: usize,
    /// The values of parameters and local names.
    locals: Vec<Term>,
    /// The call in the text of the previous frame.
    call: Place,
}

/// Compiles the first unit, whose parameters have these values.
pub(super) fn run<'u>(units: &'u [Unit], params: Vec<Term>, maker: Maker<'u, '_>) -> Result<Compiled, Fault> {
    let mut runner = Runner { units, frames: Vec::new(), terms: Vec::new(), parts: 0, maker };
    match runner.run(params) {
        Ok(term) => {
            let sort = match term.sort {
                Sort::Word { word, .. } => compiled::Sort::Word(word),
                Sort::Logical => compiled::Sort::Logical,
                Sort::Any => compiled::Sort::Any,
                _ => compiled::Sort::Number,
            };
            Ok(Compiled::new(runner.maker.builder, &term.parts, sort))
        }
        Err(fault) => Err(runner.placed(fault)),
    }
}

struct Runner<'u, 'n> {
    units: &'u [Unit],
    frames: Vec<Frame<'u>>,
    /// The values that no part has taken yet.
    terms: Vec<Term>,
    /// The number of parts of bodies of functions that were compiled.
    parts: usize,
    maker: Maker<'u, 'n>,
}

impl<'u> Runner<'u, '_> {
    fn run(&mut self, params: Vec<Term>) -> Result<Term, Fault> {
        let units = self.units;
        let Some(unit) = units.first() else { return Err(bad(0..0, "the expression is empty")) };
        self.enter(unit, params, Place { range: 0..0, at: 0..0 });
        loop {
            let Some(frame) = self.frames.last_mut() else { return Err(bad(0..0, "the expression is empty")) };
            self.maker.text = &frame.unit.text;
            if let Some(node) = frame.unit.tree.nodes.get(frame.at) {
                frame.at += 1;
                let args = self.terms.split_off(self.terms.len().saturating_sub(node.kind.parts()));
                self.node(node, args)?;
                continue;
            }
            let Some(term) = self.terms.pop() else { return Err(bad(0..0, "the expression is empty")) };
            if self.frames.len() == 1 {
                if term.sort == Sort::Ids || matches!(term.sort, Sort::Bare { .. }) {
                    return Err(term.no_number(self.maker.text));
                }
                return Ok(term);
            }
            let range = self.frames.pop().map_or(0..0, |frame| frame.call.range);
            self.terms.push(Term { range, ..term });
        }
    }

    fn enter(&mut self, unit: &'u Unit, locals: Vec<Term>, call: Place) {
        self.frames.push(Frame { unit, at: 0, leaf: 0, locals, call });
    }

    /// Compiles a part of the current text from the values of its operands.
    fn node(&mut self, node: &Node, args: Vec<Term>) -> Result<(), Fault> {
        let range = node.range.clone();
        if self.frames.len() > 1 {
            self.parts += 1;
            if self.parts > MOST_PARTS || self.maker.builder.len() > MOST_PARTS {
                let message = format!("with its functions the formula has more than {MOST_STEPS} operations");
                return Err(bad(range, message));
            }
        }
        let term = match node.kind {
            NodeKind::Number(value) => Term::number(value, range),
            NodeKind::Color(color) => Term::color(color, range),
            NodeKind::Param | NodeKind::Name => self.leaf(range)?,
            NodeKind::Unary(op) => self.maker.apply(op, &args, &Place { at: range.clone(), range })?,
            NodeKind::Binary { op, swapped, start, end } => {
                self.maker.binary(op, swapped, args, &Place { at: start..end, range })?
            }
            NodeKind::Tuple(_) => self.maker.tuple(&args, range)?,
            NodeKind::Letters { at } => {
                let place = at - 1..range.end;
                self.maker.letters(&args, at, range, place)?
            }
            NodeKind::Let { .. } => {
                if let Some(frame) = self.frames.last_mut() {
                    frame.locals.extend(args);
                }
                return Ok(());
            }
            NodeKind::Call { callee, name_end, .. } => {
                let call = Place { at: range.start..name_end, range };
                return self.call(callee, args, call);
            }
        };
        self.terms.push(term);
        Ok(())
    }

    fn call(&mut self, callee: Callee, args: Vec<Term>, call: Place) -> Result<(), Fault> {
        let (unit, params) = match callee {
            Callee::BuiltIn(functions) => {
                let Some(function) = functions.first() else { return Err(bad(call.at, "unknown")) };
                let Makes::Composed(index) = function.makes else {
                    let term = self.maker.call(function, args, &call)?;
                    self.terms.push(term);
                    return Ok(());
                };
                self.maker.takes(function, COMPOSED[index].params, &args, &call)?;
                (&BUILT_IN[index], args.len())
            }
            Callee::User { unit, params } => (&self.units[unit], params),
        };
        debug_assert_eq!(params, args.len());
        no_words(&args, self.maker.text)?;
        if self.frames.iter().any(|frame| std::ptr::eq(frame.unit, unit)) {
            return Err(recursion(call.at, unit.name.as_deref().unwrap_or_default()));
        }
        if self.frames.len() > MOST_CALLS {
            return Err(bad(call.at, format!("calls of functions nest deeper than {MOST_CALLS}")));
        }
        self.enter(unit, args, call);
        Ok(())
    }

    /// The value of the next name in the tree.
    fn leaf(&mut self, range: Range<usize>) -> Result<Term, Fault> {
        let unknown = bad(range.clone(), "unknown");
        let Some(frame) = self.frames.last_mut() else { return Err(unknown) };
        let Some(leaf) = frame.unit.leaves.get(frame.leaf) else { return Err(unknown) };
        frame.leaf += 1;
        let (term, letters) = match leaf {
            Leaf::Local(index, letters) => (frame.locals.get(*index).cloned(), *letters),
            Leaf::Value(Meaning::Any { first }, Some(at)) => {
                let letters = &self.maker.text[*at..range.end];
                (Some(Term::of_any(*first, letters, &mut self.maker.builder, range.clone())), None)
            }
            Leaf::Value(meaning, letters) => (Term::of(meaning, &mut self.maker.builder, range.clone()), *letters),
            Leaf::Bare(instead) => {
                let word = self.maker.text[range.clone()].to_owned();
                let sort = Sort::Bare { word, instead: instead.clone() };
                (Some(Term { parts: Vec::new(), sort, range: range.clone() }), None)
            }
        };
        let term = Term { range: range.clone(), ..term.ok_or(unknown)? };
        match letters {
            Some(at) => self.maker.letters(&[term], at, range.clone(), range),
            None => Ok(term),
        }
    }

    /// The fault with its function. A fault in a function of the language is one of its call.
    fn placed(&self, mut fault: Fault) -> Fault {
        for (depth, frame) in self.frames.iter().enumerate().rev() {
            if depth == 0 || frame.unit.name.is_some() {
                fault.function.clone_from(&frame.unit.name);
                break;
            }
            fault.range = frame.call.at.clone();
        }
        fault
    }
}

/// The fault of a function that needs its own value.
pub(super) fn recursion(range: Range<usize>, name: &str) -> Fault {
    let help = Some("a function cannot call itself, nor through others".to_owned());
    Fault { help, ..bad(range, format!("`{}` calls itself here", shorten(name))) }
}

impl Unit {
    /// Returns true if it has random numbers that depend on the seed of the canvas.
    fn is_random(&self) -> bool {
        let random = |node: &Node| match node.kind {
            NodeKind::Call { callee: Callee::BuiltIn(functions), .. } => functions.iter().any(|f| f.is_random()),
            _ => false,
        };
        self.tree.nodes.iter().any(random)
    }
}
