//! Expressions with resolved names.
use super::Value;
use super::builder::{Builder, Scalar, Step};

/// The most steps whose values at a point are kept on the stack.
const FEW: usize = 32;

/// An expression with resolved names: the steps that its result needs, in an order that depends only on the result.
#[derive(Clone, Debug)]
pub struct Compiled {
    /// The steps, each after its inputs.
    pub(super) steps: Vec<Step>,
    /// The components of the result.
    pub(super) parts: Vec<Scalar>,
    pub(super) sort: Sort,
}

/// Sort of the result.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Sort {
    /// One or more numbers.
    Number,
    /// True or false.
    Logical,
    /// An unknown number of components.
    Any,
    /// The word of a choice; there are no components.
    Word(String),
}

impl Compiled {
    pub(super) fn new(builder: Builder, parts: &[Scalar], sort: Sort) -> Self {
        let (steps, parts) = builder.finish(parts);
        Self { steps, parts, sort }
    }

    /// The number of components of its value; 1 if it is not known.
    pub fn components(&self) -> usize {
        self.parts.len()
    }

    /// The number of components of its value; `None` if it depends on a name whose components are not known.
    pub fn known_components(&self) -> Option<usize> {
        (self.sort != Sort::Any).then_some(self.parts.len())
    }

    /// The value, if the whole expression is constant.
    pub fn value(&self) -> Option<Value> {
        if let Sort::Word(word) = &self.sort {
            return Some(Value::Word(word.clone()));
        }
        let known = |part: &Scalar| if let Scalar::Known(value) = part { Some(*value) } else { None };
        let values: Vec<f64> = self.parts.iter().map(known).collect::<Option<_>>()?;
        Some(match &values[..] {
            [value] if self.sort == Sort::Logical => Value::Bool(*value != 0.0),
            [value] => Value::Number(*value),
            _ => Value::Vector(values),
        })
    }

    /// The numbers of the planes that the result needs, in ascending order.
    pub fn planes(&self) -> Vec<usize> {
        let plane = |step: &Step| if let Step::Plane(plane) = step { Some(*plane) } else { None };
        let mut planes: Vec<usize> = self.steps.iter().filter_map(plane).collect();
        planes.sort_unstable();
        planes
    }

    /// The rough cost of a pixel in tenths of a nanosecond.
    pub fn cost(&self) -> u32 {
        let cost = |step: &Step| if let Step::Op(op, ..) = step { op.row().cost } else { 0 };
        self.steps.iter().map(cost).fold(0, u32::saturating_add)
    }

    /// Computes the result for one point in double precision. A component that is not finite is 0.
    pub fn value_at(&self, planes: &dyn Fn(usize) -> f64, out: &mut [f64]) {
        // Most programs need no memory from the heap.
        let (mut few, mut many) = ([0.0; FEW], Vec::new());
        let values = match few.get_mut(..self.steps.len()) {
            Some(few) => few,
            None => {
                many.resize(self.steps.len(), 0.0);
                &mut many[..]
            }
        };
        let of = |values: &[f64], part: &Scalar| match part {
            Scalar::Known(value) => *value,
            Scalar::Step(step) => values[*step as usize],
        };
        for (index, step) in self.steps.iter().enumerate() {
            values[index] = match step {
                Step::Plane(plane) => planes(*plane),
                Step::Op(op, args, seed) => op.value(args.map(|arg| of(values, &arg)), *seed),
            };
        }
        for (out, part) in out.iter_mut().zip(&self.parts) {
            let value = of(values, part);
            *out = if value.is_finite() { value } else { 0.0 };
        }
    }
}
