//! Solids: functions of a point in space, in millimetres.
//!
//! A solid is evaluated for many points at once. Its code computes values from the points and from the values of other
//! solids at the same points; [`Solid::moved`] evaluates a solid at other points. A cut through a solid
//! ([`Solid::cut`]) is a field, see [`Cuts`].
use super::link::Link;
use super::{Cost, Cut, Cuts, Field, FieldId, Key, PieceAxes, Type};
use crate::diagnostics::Problem;
use glam::DVec3;
use std::any::Any;
use std::collections::HashMap;
use std::fmt;
use std::ops::Range;
use std::sync::Arc;

/// Points at which solids are evaluated, row by row, with facts about their arrangement.
#[derive(Clone, Copy, Debug)]
pub struct Patch<'a> {
    /// The planes of the x, y and z coordinates in mm; empty for code that does not need them.
    pub place: [&'a [f32]; 3],
    /// The number of points in a row.
    pub columns: usize,
    /// The number of rows.
    pub rows: usize,
    /// True if z is the same for all points of a row.
    pub level: bool,
    /// The unit vectors that point to the right and down, if the points lie in a plane.
    pub flat: Option<[[f32; 3]; 2]>,
    /// The pieces to which the points belong, if the cut has several; `None` for code that does not need quads.
    pub pieces: Option<PatchPieces<'a>>,
    /// The inverse metric A, B, C in 1/mm², which gives gradients on a surface whose pixels may be stretched: a number
    /// that differs by (x, y) from pixel to pixel changes by at most √(A·x² + 2B·x·y + C·y²) per mm. A is 0 where the
    /// surface has no extent. Footprints are then measured along the surface, independent of its layout on the canvas.
    /// `None` for code that does not need quads.
    pub metric: Option<[&'a [f32]; 3]>,
    /// The normal of a rounded surface whose facets are the quads, in the frame of the facet: its components to the
    /// right, down and along the facet's normal. `None` if there is none, and for code that does not need it.
    pub rounded: Option<[&'a [f32]; 3]>,
    /// True if the points lie in space instead of on a surface. A quad is then a point and the points `pixel` mm beside it
    /// along x, y and z.
    pub space: bool,
    /// Maximum distance between neighbours in mm; 0 for single points without a footprint.
    pub pixel: f32,
    /// The receiver of warnings about the values, if any.
    pub listener: Option<Listener<'a>>,
}

/// A receiver of warnings about values.
#[derive(Clone, Copy)]
pub struct Listener<'a>(pub &'a dyn Fn(Problem));

impl std::fmt::Debug for Listener<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Listener")
    }
}

/// The pieces of a cut at the points of a patch. Neighbours in different pieces are not used for the footprint of a
/// pixel.
#[derive(Clone, Copy, Debug)]
pub struct PatchPieces<'a> {
    /// Id of the piece of each point.
    pub ids: &'a [f32],
    /// For plane pieces: the cosine and the sine of the angle of each piece's x axis on the canvas, and the directions
    /// of its axes in space.
    pub planes: Option<([&'a [f32]; 2], &'a PieceAxes)>,
}

impl<'a> Patch<'a> {
    /// Single points in a row.
    pub const fn of(place: [&'a [f32]; 3]) -> Self {
        let [level, space] = [false; 2];
        let (columns, pixel) = (place[0].len(), 0.0);
        let (flat, pieces, metric, rounded, listener) = (None, None, None, None, None);
        Self { place, columns, rows: 1, level, flat, pieces, metric, rounded, space, pixel, listener }
    }

    /// The number of points.
    pub const fn len(&self) -> usize {
        self.columns * self.rows
    }

    /// True if there are no points.
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Values at the points of a patch, one channel after another.
#[derive(Clone, Copy, Debug)]
pub struct Planes<'a> {
    data: &'a [f32],
    points: usize,
    /// Distance between planes.
    stride: usize,
    channels: usize,
}

impl<'a> Planes<'a> {
    /// `data` holds whole planes of `points` values.
    pub const fn new(data: &'a [f32], points: usize) -> Self {
        Self { data, points, stride: points, channels: data.len() / if points == 0 { 1 } else { points } }
    }

    /// Values at some of the points.
    pub(super) fn part(self, points: Range<usize>) -> Self {
        Self { data: self.data.get(points.start..).unwrap_or_default(), points: points.len(), ..self }
    }

    /// One channel.
    pub fn plane(&self, channel: usize) -> &'a [f32] {
        &self.data[channel * self.stride..channel * self.stride + self.points]
    }

    /// The number of channels.
    pub const fn channels(&self) -> usize {
        self.channels
    }
}

/// The inputs that the code of a solid needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wants {
    /// The coordinates of the points, besides the values of the inputs.
    pub place: bool,
    /// Patches of whole quads, 2×2 points whose upper left pixel has even coordinates, so that differences within a
    /// quad give the footprint of a pixel. Single points are not in quads.
    pub quads: bool,
    /// The normals of rounded surfaces; only together with quads.
    pub rounded: bool,
}

/// Code of a solid.
pub trait SolidSource: Send + Sync {
    /// Computes all planes of `out` at the points of `patch` from the values of the inputs there. Runs on one thread.
    /// The value at a point (in a quad) may depend only on that point (that quad).
    fn fill(&self, patch: &Patch<'_>, inputs: &[Planes<'_>], out: &mut [&mut [f32]]);

    /// Computes the values in double precision, one channel after another, if the code supports that. Inputs have the
    /// same layout.
    fn exact(&self, _at: &[DVec3], _inputs: &[Vec<f64>]) -> Option<Vec<f64>> {
        None
    }

    /// The inputs that it needs.
    fn wants(&self) -> Wants {
        Wants { place: true, quads: false, rounded: false }
    }

    /// The caching policy for tiles of its cuts.
    fn cost(&self) -> Cost {
        Cost::Local
    }

    /// Its memory in bytes.
    fn bytes(&self) -> usize {
        0
    }
}

/// The computation of a solid.
pub(super) enum Body {
    /// Computed from inputs at the same point.
    Computed { source: Arc<dyn SolidSource>, inputs: Vec<Solid> },
    /// Another solid at the points that `place` gives.
    Moved { inner: Solid, place: Solid, keeps_z: bool },
    /// Some channels of another solid.
    Channels { of: Solid, channels: Arc<[usize]> },
}

/// A function of a point in space: `Solid` (a number), `SolidColor` or `SolidVector`.
#[derive(Clone)]
pub struct Solid {
    ty: Type,
    channels: usize,
    key: Option<Key>,
    owner: Option<Key>,
    note: Option<Arc<dyn Any + Send + Sync>>,
    body: Link<Body>,
}

impl fmt::Debug for Solid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Solid").field("ty", &self.ty).field("key", &self.key).finish_non_exhaustive()
    }
}

impl Solid {
    fn of(ty: Type, channels: usize, body: Body) -> Self {
        Self { ty, channels, key: None, owner: None, note: None, body: Link::new(Arc::new(body)) }
    }

    /// A solid of type `ty` (one of the solid types) computed by `source` from the values of `inputs` at the same
    /// point.
    pub fn new(ty: Type, inputs: Vec<Solid>, source: impl SolidSource + 'static) -> Self {
        Self::of(ty, ty.channels(), Body::Computed { source: Arc::new(source), inputs })
    }

    /// A solid of several numbers (at most 4) that are computed together. [`channel`](Self::channel) gives solids of
    /// one number.
    pub fn bundle(channels: usize, inputs: Vec<Solid>, source: impl SolidSource + 'static) -> Self {
        Self { channels: channels.clamp(1, 4), ..Self::new(Type::SolidVector, inputs, source) }
    }

    /// This solid at the points that the `SolidVector` `place` gives; `keeps_z` promises that z does not change.
    #[must_use]
    pub fn moved(&self, place: Solid, keeps_z: bool) -> Self {
        Self::of(self.ty, self.channels, Body::Moved { inner: self.clone(), place, keeps_z })
    }

    /// One of its channels, as a solid of type `Solid`.
    #[must_use]
    pub fn channel(&self, channel: usize) -> Self {
        self.pick(Type::Solid, &[channel])
    }

    /// Some of its channels, as a solid of type `ty` with as many channels.
    #[must_use]
    pub fn pick(&self, ty: Type, channels: &[usize]) -> Self {
        let channels: Arc<[usize]> = channels.iter().map(|c| (*c).min(self.channels - 1)).collect();
        Self::of(ty, channels.len(), Body::Channels { of: self.clone(), channels })
    }

    /// The solid as a colour: a number becomes grey.
    #[must_use]
    pub fn to_color(&self) -> Self {
        if self.channels != 1 {
            return self.clone();
        }
        let grey = self.pick(Type::SolidColor, &[0, 0, 0]);
        match self.key {
            Some(key) => Self { owner: self.owner, ..grey.keyed(Key::of("grey solid", &[key.as_bytes()])) },
            None => grey,
        }
    }

    /// Attaches a note for the nodes that read the solid: facts besides its values. Only code that names the type of
    /// the note can read it.
    #[must_use]
    pub fn noted(mut self, note: impl Any + Send + Sync) -> Self {
        self.note = Some(Arc::new(note));
        self
    }

    /// The [note](Self::noted), if it has this type.
    pub fn note<T: Any>(&self) -> Option<&T> {
        self.note.as_deref()?.downcast_ref()
    }

    /// Its type.
    pub const fn ty(&self) -> Type {
        self.ty
    }

    /// The number of channels.
    pub const fn channels(&self) -> usize {
        self.channels
    }

    /// Type of its fields, such as cuts.
    pub const fn field_type(&self) -> Type {
        match self.channels {
            1 => Type::Gray,
            2 => Type::Vec2,
            3 => Type::Rgb,
            _ => Type::Jacobian,
        }
    }

    /// Its key; `None` for a part of another solid that was not given one. Cuts of solids without a key are not cached.
    pub const fn key(&self) -> Option<Key> {
        self.key
    }

    /// Gives a new solid its key; an existing key is kept.
    #[must_use]
    pub fn keyed(mut self, key: Key) -> Self {
        self.key.get_or_insert(key);
        self
    }

    /// Marks it as a part of the result `owner`: work on its cuts is counted for that result.
    #[must_use]
    pub const fn owned_by(mut self, owner: Key) -> Self {
        self.owner = Some(owner);
        self
    }

    /// The identity of the solid: its key, or the address of its code if it has none.
    pub(super) fn id(&self) -> FieldId {
        self.key.map_or_else(|| FieldId::Code(self.body.address()), FieldId::Key)
    }

    /// The result that its work is counted for, if any.
    pub(super) const fn owner(&self) -> Option<Key> {
        self.owner
    }

    pub(super) fn body(&self) -> &Body {
        self.body.get()
    }

    /// If its channels are consecutive channels of another solid: that solid and the range of channels. Otherwise
    /// itself and all its channels.
    pub(super) fn whole(&self) -> (&Self, Range<usize>) {
        let (mut solid, mut part) = (self, 0..self.channels);
        while let Body::Channels { of, channels } = solid.body() {
            let part_of = &channels[part.clone()];
            if part_of.windows(2).any(|pair| pair[1] != pair[0] + 1) {
                break;
            }
            let first = part_of.first().copied().unwrap_or(0);
            (solid, part) = (of, first..first + part.len());
        }
        (solid, part)
    }

    /// Its memory in bytes.
    pub fn bytes(&self) -> usize {
        match self.body() {
            Body::Computed { source, .. } => source.bytes() + size_of::<Self>(),
            Body::Moved { .. } | Body::Channels { .. } => size_of::<Self>(),
        }
    }

    /// The field of a cut through it. A solid that several others read becomes one field; to share it with other cuts,
    /// keep the [`Cuts`].
    pub fn cut(&self, cut: &Cut) -> Field {
        Cuts::default().cut(self, cut)
    }

    /// Its values at single points, one channel after another, in double precision where the code supports it. A solid
    /// that several others read is evaluated once.
    pub fn at(&self, points: &[DVec3]) -> Vec<f64> {
        At::new(points).values(self)
    }
}

/// Evaluates solids at single points, each solid once per set of points.
struct At {
    /// The original points, then the sets to which solids are moved.
    points: Vec<Arc<[DVec3]>>,
    /// Index of the moved set, by the original set and the solid that moves it.
    moved: HashMap<(usize, FieldId), usize>,
    known: HashMap<(usize, FieldId), Arc<[f64]>>,
}

impl At {
    fn new(points: &[DVec3]) -> Self {
        Self { points: vec![points.into()], moved: HashMap::new(), known: HashMap::new() }
    }

    /// The values of `solid` at the points. Uses a work-list, because solids may read each other in long chains.
    fn values(mut self, solid: &Solid) -> Vec<f64> {
        let mut open = vec![(0, solid)];
        while let Some(&(set, top)) = open.last() {
            if self.known.contains_key(&(set, top.id())) {
                open.pop();
                continue;
            }
            let before = open.len();
            let missing = |at: &Self, (set, solid): (usize, &Solid)| !at.known.contains_key(&(set, solid.id()));
            match top.body() {
                Body::Computed { inputs, .. } => {
                    open.extend(inputs.iter().map(|input| (set, input)).filter(|want| missing(&self, *want)));
                }
                Body::Channels { of, .. } => open.extend(Some((set, of)).filter(|want| missing(&self, *want))),
                Body::Moved { inner, place, .. } => match self.move_to(set, place) {
                    Some(to) => open.extend(Some((to, inner)).filter(|want| missing(&self, *want))),
                    None => open.push((set, place)),
                },
            }
            if open.len() == before {
                let values = self.compute(set, top);
                self.known.insert((set, top.id()), values);
            }
        }
        self.known.get(&(0, solid.id())).map_or_else(Vec::new, |values| values.to_vec())
    }

    /// The set of points to which `place` moves `set`, if its values there are known.
    fn move_to(&mut self, set: usize, place: &Solid) -> Option<usize> {
        if let Some(to) = self.moved.get(&(set, place.id())) {
            return Some(*to);
        }
        let moved = self.known.get(&(set, place.id()))?;
        let n = self.points[set].len();
        self.points.push((0..n).map(|i| DVec3::new(moved[i], moved[n + i], moved[2 * n + i])).collect());
        self.moved.insert((set, place.id()), self.points.len() - 1);
        Some(self.points.len() - 1)
    }

    /// The values of a solid whose inputs are known.
    fn compute(&mut self, set: usize, solid: &Solid) -> Arc<[f64]> {
        let points = self.points[set].clone();
        match solid.body() {
            Body::Moved { inner, place, .. } => {
                let to = self.move_to(set, place).unwrap_or(set);
                self.known.get(&(to, inner.id())).cloned().unwrap_or_default()
            }
            Body::Channels { of, channels } => {
                let (all, n) = (self.known.get(&(set, of.id())).cloned().unwrap_or_default(), points.len());
                channels.iter().flat_map(|c| all[c * n..(c + 1) * n].iter().copied()).collect()
            }
            Body::Computed { source, inputs } => {
                let known = |input: &Solid| self.known.get(&(set, input.id())).map_or_else(Vec::new, |v| v.to_vec());
                let inputs: Vec<Vec<f64>> = inputs.iter().map(known).collect();
                let exact = source.exact(&points, &inputs);
                exact.unwrap_or_else(|| at_single(&**source, solid.channels, &points, &inputs)).into()
            }
        }
    }
}

fn at_single(source: &dyn SolidSource, channels: usize, points: &[DVec3], inputs: &[Vec<f64>]) -> Vec<f64> {
    let n = points.len();
    let narrow = |values: &Vec<f64>| values.iter().map(|&v| single(v)).collect();
    let inputs: Vec<Vec<f32>> = inputs.iter().map(narrow).collect();
    let inputs: Vec<Planes<'_>> = inputs.iter().map(|values| Planes::new(values, n)).collect();
    let place: [Vec<f32>; 3] = std::array::from_fn(|axis| points.iter().map(|p| single(p[axis])).collect());
    let place = [&place[0][..], &place[1][..], &place[2][..]];
    let patch = Patch { columns: n, rows: 1, ..Patch::of(place) };
    let mut out = vec![0.0; n * channels];
    source.fill(&patch, &inputs, &mut out.chunks_mut(n.max(1)).collect::<Vec<_>>());
    out.into_iter().map(f64::from).collect()
}

#[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is meant")]
const fn single(value: f64) -> f32 {
    value as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Nothing;

    impl SolidSource for Nothing {
        fn fill(&self, _: &Patch<'_>, _: &[Planes<'_>], _: &mut [&mut [f32]]) {}
    }

    #[test]
    fn reads_consecutive_channels_in_place() {
        let all = Solid::bundle(4, Vec::new(), Nothing);
        let three = all.pick(Type::SolidColor, &[1, 2, 3]);
        for (solid, channels) in [(&all, 0..4), (&three, 1..4), (&three.channel(1), 2..3)] {
            let (whole, part) = solid.whole();
            assert_eq!((whole.id() == all.id(), part), (true, channels));
        }
        // Channels in another order, or with gaps, form a separate solid.
        for channels in [[2, 1, 0], [0, 2, 3]] {
            let solid = all.pick(Type::SolidColor, &channels);
            let (whole, part) = solid.whole();
            assert_eq!((whole.id() == solid.id(), part), (true, 0..3));
        }
        // The values of some points of each plane.
        let data = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0];
        let planes = Planes::new(&data, 3).part(1..3);
        assert_eq!((planes.channels(), planes.plane(0), planes.plane(1)), (2, &[1.0, 2.0][..], &[4.0, 5.0][..]));
    }
}
