//! Evaluates solids at quads: points in space that stand for their surroundings.
use super::FieldId;
use super::solid::{Body, Patch, Planes, Solid};
use std::collections::HashMap;
use std::ops::{Deref, Range};
use std::sync::Arc;

impl Solid {
    /// The values of several solids at the points with these planes of x, y and z: for each solid one channel after
    /// another. Each point stands for the space around it, `pixel` mm wide: its value depends only on the point, not on
    /// any surface. A solid that several others read is evaluated once.
    pub fn quads(solids: &[Self], points: &[&[f32]; 3], pixel: f32) -> Vec<SharedValues> {
        let mut at = AtQuads::new(points, pixel);
        solids.iter().map(|solid| at.values(solid)).collect()
    }
}

/// A part of a list of numbers. Copies share the numbers.
#[derive(Clone, Default)]
pub struct SharedValues {
    all: Arc<Vec<f32>>,
    part: Range<usize>,
}

impl SharedValues {
    /// A part of this part.
    fn part(&self, part: Range<usize>) -> Self {
        Self { all: self.all.clone(), part: self.part.start + part.start..self.part.start + part.end }
    }
}

impl From<Vec<f32>> for SharedValues {
    fn from(all: Vec<f32>) -> Self {
        Self { part: 0..all.len(), all: Arc::new(all) }
    }
}

impl Deref for SharedValues {
    type Target = [f32];

    fn deref(&self) -> &[f32] {
        &self.all[self.part.clone()]
    }
}

/// A set of points at which solids are evaluated.
struct Set<'a> {
    /// The planes of their coordinates. Quads have two rows: the points and those beside them along x, and those along y
    /// and z.
    points: [SharedValues; 3],
    in_quads: bool,
    /// The set and the solid that moved it here; `None` for the original points.
    moved_by: Option<(usize, &'a Solid)>,
    /// The same points in quads, if that set is made.
    quads: Option<usize>,
}

/// Evaluates solids at sets of points, each solid once per set: in quads where its code or that of a reader needs them,
/// else at single points, which are a quarter of the work.
struct AtQuads<'a> {
    /// First the original points, then the same in quads, then sets to which solids are moved.
    sets: Vec<Set<'a>>,
    pixel: f32,
    /// Index of the moved set, by the original set and the solid that moves it.
    moved: HashMap<(usize, FieldId), usize>,
    known: HashMap<(usize, FieldId), SharedValues>,
}

/// A solid in a set of points.
type Task<'a> = (usize, &'a Solid);

impl<'a> AtQuads<'a> {
    fn new(points: &[&[f32]; 3], pixel: f32) -> Self {
        let axis = |axis: usize| -> SharedValues {
            let beside = |along: usize| if axis == along { pixel } else { 0.0 };
            let mut plane = Vec::with_capacity(4 * points[axis].len());
            points[axis].iter().for_each(|v| plane.extend([*v, *v + beside(0)]));
            points[axis].iter().for_each(|v| plane.extend([*v + beside(1), *v + beside(2)]));
            plane.into()
        };
        let points = points.map(|plane| plane.to_vec().into());
        let single = Set { points, in_quads: false, moved_by: None, quads: Some(1) };
        let quads = Set { points: [0, 1, 2].map(axis), in_quads: true, moved_by: None, quads: Some(1) };
        Self { sets: vec![single, quads], pixel, moved: HashMap::new(), known: HashMap::new() }
    }

    /// The values of `solid` at the points. Uses a work-list, because solids may read each other in long chains.
    fn values(&mut self, solid: &'a Solid) -> SharedValues {
        let mut open: Vec<Task<'a>> = vec![(0, solid)];
        while let Some(&(set, top)) = open.last() {
            if self.known.contains_key(&(set, top.id())) {
                open.pop();
                continue;
            }
            let before = open.len();
            let wanted = self.wanted(set, top);
            open.extend(wanted.into_iter().filter(|(set, solid)| !self.known.contains_key(&(*set, solid.id()))));
            if open.len() == before {
                let values = self.compute(set, top);
                self.known.insert((set, top.id()), values);
            }
        }
        self.known.get(&(0, solid.id())).cloned().unwrap_or_default()
    }

    /// The values that a solid needs first.
    fn wanted(&mut self, set: usize, solid: &'a Solid) -> Vec<Task<'a>> {
        match solid.body() {
            Body::Computed { source, .. } if source.wants().quads && !self.sets[set].in_quads => {
                vec![self.in_quads(set).map_or_else(|first| first, |quads| (quads, solid))]
            }
            Body::Computed { inputs, .. } => inputs.iter().map(|input| (set, input)).collect(),
            Body::Channels { of, .. } => vec![(set, of)],
            Body::Moved { inner, place, .. } => vec![self.move_to(set, place).map_or((set, place), |to| (to, inner))],
        }
    }

    /// The same points in quads, or a value that is needed first to move quads there.
    fn in_quads(&mut self, set: usize) -> Result<usize, Task<'a>> {
        let mut moves: Vec<Task<'a>> = Vec::new();
        let mut from = set;
        let mut quads = loop {
            match (self.sets[from].quads, self.sets[from].moved_by) {
                (Some(quads), _) => break quads,
                (None, Some((before, place))) => {
                    moves.push((from, place));
                    from = before;
                }
                (None, None) => break from,
            }
        };
        while let Some((to, place)) = moves.pop() {
            quads = self.move_to(quads, place).ok_or((quads, place))?;
            self.sets[to].quads = Some(quads);
        }
        Ok(quads)
    }

    /// The set of points to which `place` moves `set`, if its values there are known.
    fn move_to(&mut self, set: usize, place: &'a Solid) -> Option<usize> {
        if let Some(to) = self.moved.get(&(set, place.id())) {
            return Some(*to);
        }
        let moved = self.known.get(&(set, place.id()))?;
        let n = self.sets[set].points[0].len();
        let points = [0, 1, 2].map(|axis| moved.part(axis * n..(axis + 1) * n));
        let (to, in_quads) = (self.sets.len(), self.sets[set].in_quads);
        self.sets.push(Set { points, in_quads, moved_by: Some((set, place)), quads: in_quads.then_some(to) });
        self.moved.insert((set, place.id()), to);
        Some(to)
    }

    /// The values of a solid whose inputs are known.
    fn compute(&mut self, set: usize, solid: &Solid) -> SharedValues {
        let Set { points, in_quads, quads, .. } = &self.sets[set];
        let n = points[0].len();
        let known = |set: usize, input: &Solid| self.known.get(&(set, input.id())).cloned().unwrap_or_default();
        match solid.body() {
            Body::Moved { inner, place, .. } => {
                let to = self.moved.get(&(set, place.id())).copied().unwrap_or(set);
                known(to, inner)
            }
            Body::Channels { of, channels } => {
                let of = known(set, of);
                let first = channels.first().copied().unwrap_or(0);
                if channels.iter().zip(first..).all(|(channel, next)| *channel == next) {
                    of.part(first * n..(first + channels.len()) * n)
                } else {
                    channels.iter().map(|c| &of[c * n..(c + 1) * n]).collect::<Vec<_>>().concat().into()
                }
            }
            Body::Computed { source, .. } if source.wants().quads && !in_quads => {
                let all = known(quads.unwrap_or(set), solid);
                let mut first = Vec::with_capacity(all.len() / 4);
                all.chunks((4 * n).max(1)).for_each(|plane| first.extend(plane[..2 * n].iter().step_by(2)));
                first.into()
            }
            Body::Computed { source, inputs } => {
                let inputs: Vec<SharedValues> = inputs.iter().map(|input| known(set, input)).collect();
                let inputs: Vec<Planes<'_>> = inputs.iter().map(|values| Planes::new(values, n)).collect();
                let place = Patch::of([&points[0], &points[1], &points[2]]);
                let rows = if *in_quads { 2 } else { 1 };
                let patch = Patch { columns: n / rows, rows, space: true, pixel: self.pixel, ..place };
                let mut out = vec![0.0; n * solid.channels()];
                source.fill(&patch, &inputs, &mut out.chunks_mut(n.max(1)).collect::<Vec<_>>());
                out.into()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{SolidSource, Type, Wants};
    use std::slice;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// A solid: its inputs and the coordinates at each point, combined by `body`; counts the points.
    struct Sum {
        quads: bool,
        count: Arc<AtomicUsize>,
        body: fn([f32; 3], f32, &Patch<'_>) -> f32,
    }

    impl SolidSource for Sum {
        fn fill(&self, patch: &Patch<'_>, inputs: &[Planes<'_>], out: &mut [&mut [f32]]) {
            self.count.fetch_add(patch.len(), Ordering::Relaxed);
            for (channel, out) in out.iter_mut().enumerate() {
                for (k, out) in out.iter_mut().enumerate() {
                    let at = [0, 1, 2].map(|axis: usize| patch.place[(axis + channel) % 3][k]);
                    *out = (self.body)(at, inputs.iter().map(|input| input.plane(0)[k]).sum(), patch);
                }
            }
            if self.quads {
                assert!(patch.rows == 2 && patch.columns.is_multiple_of(2) && patch.pixel > 0.0);
            }
        }

        fn wants(&self) -> Wants {
            Wants { place: true, quads: self.quads, rounded: false }
        }
    }

    fn solid(
        ty: Type,
        quads: bool,
        inputs: Vec<Solid>,
        body: fn([f32; 3], f32, &Patch<'_>) -> f32,
    ) -> (Solid, Arc<AtomicUsize>) {
        let count = Arc::new(AtomicUsize::new(0));
        (Solid::new(ty, inputs, Sum { quads, count: count.clone(), body }), count)
    }

    #[test]
    fn single_points_are_enough_where_no_code_wants_quads() {
        let points: [Vec<f32>; 3] = [0.0, 10.0, 20.0].map(|from| (0..5).map(|k| from + k as f32).collect());
        let points = [&points[0][..], &points[1], &points[2]];
        let (below, below_count) = solid(Type::Solid, false, vec![], |[x, y, _], _, _| x + y);
        let (shift, _) = solid(Type::SolidVector, false, vec![], |[x, ..], _, _| x + 1.0);
        let moved = below.moved(shift, false);
        let (ring, ring_count) = solid(Type::Solid, true, vec![moved.clone()], |[.., z], input, _| 100.0 * z + input);
        let (top, top_count) = solid(Type::Solid, false, vec![ring, moved.clone()], |_, input, _| input);
        // Only single points of a solid that no code reads in quads.
        let alone = Solid::quads(slice::from_ref(&moved), &points, 0.5).remove(0);
        assert_eq!(*alone, [12.0, 14.0, 16.0, 18.0, 20.0]);
        assert_eq!(below_count.swap(0, Ordering::Relaxed), 5);
        let all = Solid::quads(slice::from_ref(&top), &points, 0.5).remove(0);
        assert_eq!(*all, [0, 1, 2, 3, 4].map(|k| 2000.0 + 100.0 * k as f32 + 2.0 * (12.0 + 2.0 * k as f32)));
        let counts = [&below_count, &ring_count, &top_count].map(|count| count.load(Ordering::Relaxed));
        assert_eq!(counts, [25, 20, 5]);
    }

    #[test]
    fn solids_that_share_another_evaluate_it_once() {
        let (below, count) = solid(Type::SolidColor, false, vec![], |[x, ..], _, _| x);
        let parts =
            [below.pick(Type::SolidColor, &[0, 1, 2]), below.channel(1), below.pick(Type::SolidColor, &[2, 0, 0])];
        let found = Solid::quads(&parts, &[&[1.0, 2.0], &[3.0, 4.0], &[5.0, 6.0]], 0.5);
        let expected: [&[f32]; 3] = [&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0], &[3.0, 4.0], &[5.0, 6.0, 1.0, 2.0, 1.0, 2.0]];
        assert_eq!(found.iter().map(|values| &**values).collect::<Vec<_>>(), expected);
        assert_eq!(count.load(Ordering::Relaxed), 2);
    }
}
