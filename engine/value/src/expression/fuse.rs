//! Replaces planes of programs by constants and by other programs.
use super::builder::{Builder, Scalar, Step};
use super::compiled::Compiled;
use super::program::MOST_STEPS;
use std::sync::Arc;

/// The most steps while a program is made, before unused steps are removed.
const MOST_MADE: usize = 16 * MOST_STEPS;

impl Compiled {
    /// The program with some planes replaced by constants.
    #[must_use]
    pub fn known(&self, value: &dyn Fn(usize) -> Option<f64>) -> Self {
        let mut builder = Builder::default();
        let replace = |builder: &mut Builder, plane| match value(plane) {
            Some(value) => Some(Scalar::Known(value)),
            None => Some(builder.plane(plane)),
        };
        let parts = copy(self, &self.parts, &mut builder, usize::MAX, replace).unwrap_or_default();
        Self::new(builder, &parts, self.sort.clone())
    }

    /// The program with some planes replaced by results of other programs, with the same result as if these were fields:
    /// a value that is not finite counts as 0.
    ///
    /// `inner` gives, for a plane of this program, another program and the component of its result. `place` gives the new
    /// numbers of planes: of a plane of this program for `(None, plane)`, and of a plane of the program that replaces
    /// `outer` for `(Some(outer), plane)`. `None` if the result has more than [`MOST_STEPS`] operations, or a program
    /// has no such component.
    pub fn fuse(
        &self,
        inner: &dyn Fn(usize) -> Option<(Arc<Self>, usize)>,
        place: &dyn Fn(Option<usize>, usize) -> usize,
    ) -> Option<Self> {
        let mut builder = Builder::default();
        let replace = |builder: &mut Builder, plane| {
            let Some((program, component)) = inner(plane) else { return Some(builder.plane(place(None, plane))) };
            let part = *program.parts.get(component)?;
            let renumber = |builder: &mut Builder, own| Some(builder.plane(place(Some(plane), own)));
            let part = *copy(&program, &[part], builder, MOST_MADE, renumber)?.first()?;
            Some(builder.finite(part))
        };
        let parts = copy(self, &self.parts, &mut builder, MOST_MADE, replace)?;
        let fused = Self::new(builder, &parts, self.sort.clone());
        (fused.steps.len() <= MOST_STEPS).then_some(fused)
    }

    /// The steps that some numbers need.
    fn needed(&self, parts: &[Scalar]) -> Vec<bool> {
        let mut needed = vec![false; self.steps.len()];
        let mark = |part: &Scalar, needed: &mut Vec<bool>| {
            if let Scalar::Step(step) = part {
                needed[*step as usize] = true;
            }
        };
        parts.iter().for_each(|part| mark(part, &mut needed));
        for (index, step) in self.steps.iter().enumerate().rev() {
            if let (true, Step::Op(op, args, _)) = (needed[index], step) {
                args[..op.args()].iter().for_each(|arg| mark(arg, &mut needed));
            }
        }
        needed
    }
}

/// Makes some results of a program again, with other values for its planes. `None` if there are more than `most` steps,
/// or if `plane` gives none.
fn copy(
    from: &Compiled,
    parts: &[Scalar],
    builder: &mut Builder,
    most: usize,
    mut plane: impl FnMut(&mut Builder, usize) -> Option<Scalar>,
) -> Option<Vec<Scalar>> {
    let needed = from.needed(parts);
    let mut made = vec![Scalar::Known(0.0); from.steps.len()];
    let renamed = |made: &[Scalar], part: &Scalar| match part {
        Scalar::Step(step) => made[*step as usize],
        known @ Scalar::Known(_) => *known,
    };
    for (index, step) in from.steps.iter().enumerate().filter(|(index, _)| needed[*index]) {
        made[index] = match step {
            Step::Plane(number) => plane(builder, *number)?,
            Step::Op(op, args, seed) => {
                let args = args.map(|arg| renamed(&made, &arg));
                builder.make(*op, &args[..op.args()], *seed)
            }
        };
        if builder.len() > most {
            return None;
        }
    }
    Some(parts.iter().map(|part| renamed(&made, part)).collect())
}
