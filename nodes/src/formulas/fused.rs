//! Formulas of formulas: programs that are computed together.
//!
//! A formula that reads another formula takes over its program where that is worthwhile. The values between them are
//! then not stored; a value that is not finite counts as 0 between them, as it does in a field.
use shibo_value::expression::{Compiled, FIRST_INPUT, PlaneOf};
use std::sync::Arc;

/// A formula with more readers than one is computed in each of them if it costs no more than this per pixel, in tenths
/// of a nanosecond: storing and reading a plane of a tile costs about as much.
const CHEAP: u32 = 12;

/// A program with the values that it reads.
pub(super) struct Formula<T> {
    pub(super) program: Arc<Compiled>,
    pub(super) inputs: Vec<T>,
    /// True if one formula alone reads the result.
    pub(super) inner: bool,
}

impl<T: Clone> Formula<T> {
    /// The formula together with the formulas among its inputs. `of` gives the formula that computes an input, and `same`
    /// tells whether two inputs are the same value.
    pub(super) fn fused<'i>(
        program: Compiled,
        inputs: &'i [T],
        inner: bool,
        of: impl Fn(&'i T) -> Option<&'i Self>,
        same: impl Fn(&T, &T) -> bool,
    ) -> Self
    where
        T: 'i,
    {
        let mut kept: Vec<T> = Vec::new();
        let mut place_of = |input: &T| {
            let known = kept.iter().position(|kept| same(kept, input));
            known.unwrap_or_else(|| {
                kept.push(input.clone());
                kept.len() - 1
            })
        };
        let worthwhile = |formula: &&Self| formula.inner || formula.program.cost() <= CHEAP;
        let others: Vec<Option<&Self>> = inputs.iter().map(|input| of(input).filter(worthwhile)).collect();
        // For each input, the new places of what it reads; of an input that stays, its own.
        let places: Vec<Vec<usize>> = inputs
            .iter()
            .zip(&others)
            .map(|(input, other)| match other {
                Some(other) => other.inputs.iter().map(&mut place_of).collect(),
                None => vec![place_of(input)],
            })
            .collect();
        let whole = others.iter().any(Option::is_some).then(|| {
            let replaced = |plane: usize| match PlaneOf::number(plane) {
                PlaneOf::Channel { input, channel } => {
                    others.get(input).copied().flatten().map(|other| (other.program.clone(), channel))
                }
                PlaneOf::Place(_) => None,
            };
            let place = |outer: Option<usize>, plane: usize| match (outer.map(PlaneOf::number), PlaneOf::number(plane))
            {
                (_, PlaneOf::Place(place)) => place,
                (Some(PlaneOf::Channel { input: outer, .. }), PlaneOf::Channel { input, channel }) => {
                    FIRST_INPUT + 4 * places[outer][input] + channel
                }
                (_, PlaneOf::Channel { input, channel }) => FIRST_INPUT + 4 * places[input][0] + channel,
            };
            program.fuse(&replaced, &place)
        });
        match whole.flatten() {
            Some(whole) => Self { program: Arc::new(whole), inputs: kept, inner },
            None => Self { program: Arc::new(program), inputs: inputs.to_vec(), inner },
        }
    }
}
