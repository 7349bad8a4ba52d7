//! Evaluates solids at quads: points in space that stand for their surroundings.
use super::FieldId;
use super::solid::{Body, Patch, Planes, Solid};
use std::collections::HashMap;
use std::sync::Arc;

impl Solid {
    /// Its values at the points with these planes of x, y and z, one channel after another. Each point stands for the
    /// space around it, `pixel` mm wide: its value depends only on the point, not on any surface. A solid that several
    /// others read is evaluated once.
    pub fn quads(&self, points: &[&[f32]; 3], pixel: f32) -> Vec<f32> {
        AtQuads::new(points, pixel).values(self)
    }
}

/// Evaluates solids at quads of points, each solid once per set of points.
struct AtQuads {
    /// The planes of each set: first the original points, then sets to which solids are moved; two rows each.
    points: Vec<[Arc<[f32]>; 3]>,
    pixel: f32,
    /// Index of the moved set, by the original set and the solid that moves it.
    moved: HashMap<(usize, FieldId), usize>,
    known: HashMap<(usize, FieldId), Arc<[f32]>>,
}

impl AtQuads {
    fn new(points: &[&[f32]; 3], pixel: f32) -> Self {
        let axis = |axis: usize| -> Arc<[f32]> {
            let beside = |along: usize| if axis == along { pixel } else { 0.0 };
            let upper = points[axis].iter().flat_map(|v| [*v, *v + beside(0)]);
            upper.chain(points[axis].iter().flat_map(|v| [*v + beside(1), *v + beside(2)])).collect()
        };
        Self { points: vec![[0, 1, 2].map(axis)], pixel, moved: HashMap::new(), known: HashMap::new() }
    }

    /// The values of `solid` at the first point of each quad. Uses a work-list, because solids may read each other in
    /// long chains.
    fn values(mut self, solid: &Solid) -> Vec<f32> {
        let mut open = vec![(0, solid)];
        while let Some(&(set, top)) = open.last() {
            let wanted: Vec<(usize, &Solid)> = match top.body() {
                _ if self.known.contains_key(&(set, top.id())) => {
                    open.pop();
                    continue;
                }
                Body::Computed { inputs, .. } => inputs.iter().map(|input| (set, input)).collect(),
                Body::Channels { of, .. } => vec![(set, of)],
                Body::Moved { inner, place, .. } => {
                    vec![self.move_to(set, place).map_or((set, place), |to| (to, inner))]
                }
            };
            let before = open.len();
            open.extend(wanted.into_iter().filter(|(set, solid)| !self.known.contains_key(&(*set, solid.id()))));
            if open.len() == before {
                let values = self.compute(set, top);
                self.known.insert((set, top.id()), values);
            }
        }
        let n = self.points[0][0].len();
        let all = self.known.get(&(0, solid.id()));
        all.map_or_else(Vec::new, |all| {
            all.chunks(n.max(1)).flat_map(|plane| plane[..n / 2].iter().step_by(2).copied()).collect()
        })
    }

    /// The set of points to which `place` moves `set`, if its values there are known.
    fn move_to(&mut self, set: usize, place: &Solid) -> Option<usize> {
        if let Some(to) = self.moved.get(&(set, place.id())) {
            return Some(*to);
        }
        let moved = self.known.get(&(set, place.id()))?;
        let n = self.points[set][0].len();
        self.points.push([0, 1, 2].map(|axis| moved[axis * n..(axis + 1) * n].into()));
        self.moved.insert((set, place.id()), self.points.len() - 1);
        Some(self.points.len() - 1)
    }

    /// The values of a solid whose inputs are known.
    fn compute(&mut self, set: usize, solid: &Solid) -> Arc<[f32]> {
        let points = self.points[set].clone();
        let n = points[0].len();
        let known = |set: usize, input: &Solid| self.known.get(&(set, input.id())).cloned().unwrap_or_default();
        match solid.body() {
            Body::Moved { inner, place, .. } => {
                let to = self.moved.get(&(set, place.id())).copied().unwrap_or(set);
                known(to, inner)
            }
            Body::Channels { of, channels } => {
                let all = known(set, of);
                channels.iter().flat_map(|c| all[c * n..(c + 1) * n].iter().copied()).collect()
            }
            Body::Computed { source, inputs } => {
                let inputs: Vec<Arc<[f32]>> = inputs.iter().map(|input| known(set, input)).collect();
                let inputs: Vec<Planes<'_>> = inputs.iter().map(|values| Planes::new(values, n)).collect();
                let place = Patch::of([&points[0], &points[1], &points[2]]);
                let patch = Patch { columns: n / 2, rows: 2, space: true, pixel: self.pixel, ..place };
                let mut out = vec![0.0; n * solid.channels()];
                source.fill(&patch, &inputs, &mut out.chunks_mut(n.max(1)).collect::<Vec<_>>());
                out.into()
            }
        }
    }
}
