//! Solids: functions of a point in space, in millimetres.
//!
//! A solid is evaluated for many points at once. It says how its values follow from the point and from those of other
//! solids at the same point; [`Solid::moved`] takes a solid at other points. Cutting a solid ([`Solid::cut`]) gives a
//! field: every solid on the way becomes a field with a key of its own, so that tiles of what several solids or outputs
//! read, the growth time of a tree above all, are computed once and kept by the engine's cache.
use super::{Cost, Curve, Cut, Field, FieldSource, Grid, Key, Reader, Stop, Tile, Type, Window};
use glam::DVec3;
use std::fmt;
use std::sync::Arc;

/// Points at which solids are evaluated, by rows, and what is known about how they lie.
#[derive(Clone, Copy, Debug)]
pub struct Patch<'a> {
    /// The coordinates in mm, x, y and z by themselves; empty for code that does not want them.
    pub place: [&'a [f32]; 3],
    /// The number of points in a row.
    pub columns: usize,
    /// The number of rows.
    pub rows: usize,
    /// Whether z is the same for all points of a row.
    pub level: bool,
    /// The directions of length 1 that run to the right and down, if the points lie in a plane.
    pub flat: Option<[[f32; 3]; 2]>,
    /// The largest distance of neighbours in mm; 0 for single points, which are taken as they are.
    pub pixel: f32,
}

impl Patch<'_> {
    /// The number of points.
    pub const fn len(&self) -> usize {
        self.columns * self.rows
    }

    /// Whether there is none.
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Values at the points of a patch, one channel after another.
#[derive(Clone, Copy, Debug)]
pub struct Planes<'a> {
    data: &'a [f32],
    points: usize,
}

impl<'a> Planes<'a> {
    /// `data` holds whole planes of `points` values.
    pub const fn new(data: &'a [f32], points: usize) -> Self {
        Self { data, points }
    }

    /// One channel.
    pub fn plane(&self, channel: usize) -> &'a [f32] {
        &self.data[channel * self.points..(channel + 1) * self.points]
    }

    /// The number of channels.
    pub const fn channels(&self) -> usize {
        self.data.len() / if self.points == 0 { 1 } else { self.points }
    }
}

/// What the code of a solid wants to be given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wants {
    /// The points themselves, besides the values of the inputs.
    pub place: bool,
    /// Patches of whole quads, 2×2 points, whose upper left ones have even numbers, so that differences between the
    /// points of a quad tell the footprint of a pixel. Single points come without.
    pub quads: bool,
}

/// The code behind a solid.
pub trait SolidSource: Send + Sync {
    /// Computes all planes of `out` at the points of `patch` from the values of the inputs there. Runs on one thread.
    /// The value at a point (in a quad) depends on that point (that quad) alone.
    fn fill(&self, patch: &Patch<'_>, inputs: &[Planes<'_>], out: &mut [&mut [f32]]);

    /// The same in double precision, from the inputs' values one channel after another, if there is a way.
    fn exact(&self, _at: &[DVec3], _inputs: &[Vec<f64>]) -> Option<Vec<f64>> {
        None
    }

    /// What it wants to be given.
    fn wants(&self) -> Wants {
        Wants { place: true, quads: false }
    }

    /// How to treat tiles of its cuts.
    fn cost(&self) -> Cost {
        Cost::Local
    }

    /// The memory it holds, in bytes.
    fn bytes(&self) -> usize {
        0
    }
}

#[derive(Clone)]
enum Body {
    /// Computed from inputs at the same point.
    Computed { source: Arc<dyn SolidSource>, inputs: Arc<[Solid]> },
    /// Another solid at the points that `place` gives.
    Moved { inner: Arc<Solid>, place: Arc<Solid>, keeps_z: bool },
    /// Some channels of another solid.
    Channels { of: Arc<Solid>, channels: Arc<[usize]> },
}

/// A function of a point in space: `Solid` (a number), `SolidColor` or `SolidVector`.
#[derive(Clone)]
pub struct Solid {
    ty: Type,
    channels: usize,
    key: Option<Key>,
    owner: Option<Key>,
    follows: Option<Arc<(Solid, Curve)>>,
    body: Body,
}

impl fmt::Debug for Solid {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Solid").field("ty", &self.ty).field("key", &self.key).finish_non_exhaustive()
    }
}

impl Solid {
    /// A solid of type `ty` (one of the solid types) computed by `source` from the values of `inputs` at the same point.
    pub fn new(ty: Type, inputs: Vec<Solid>, source: impl SolidSource + 'static) -> Self {
        let body = Body::Computed { source: Arc::new(source), inputs: inputs.into() };
        Self { ty, channels: ty.channels(), key: None, owner: None, follows: None, body }
    }

    /// A solid of several numbers (at most 4) of which [`channel`](Self::channel) makes solids of one, computed together.
    pub fn bundle(channels: usize, inputs: Vec<Solid>, source: impl SolidSource + 'static) -> Self {
        Self { channels: channels.clamp(1, 4), ..Self::new(Type::SolidVector, inputs, source) }
    }

    /// This solid at the points that the `SolidVector` `place` gives for each point; `keeps_z` promises that it changes
    /// no z.
    #[must_use]
    pub fn moved(&self, place: Solid, keeps_z: bool) -> Self {
        let body = Body::Moved { inner: Arc::new(self.clone()), place: Arc::new(place), keeps_z };
        Self { ty: self.ty, channels: self.channels, key: None, owner: None, follows: None, body }
    }

    /// One of its channels, as a solid of type `Solid`.
    #[must_use]
    pub fn channel(&self, channel: usize) -> Self {
        self.pick(Type::Solid, &[channel])
    }

    /// Some of its channels, as a solid of type `ty`, which has as many.
    #[must_use]
    pub fn pick(&self, ty: Type, channels: &[usize]) -> Self {
        let channels: Arc<[usize]> = channels.iter().map(|c| (*c).min(self.channels - 1)).collect();
        let count = channels.len();
        Self {
            ty,
            channels: count,
            key: None,
            owner: None,
            follows: None,
            body: Body::Channels { of: Arc::new(self.clone()), channels },
        }
    }

    /// The same, known to be the piecewise linear function through the points (x, y, ·) of `curve` of the number `of`; so
    /// that who looks it up can do so by `of`, which has no kinks.
    #[must_use]
    pub fn following(mut self, of: Solid, curve: Curve) -> Self {
        self.follows = Some(Arc::new((of, curve)));
        self
    }

    /// The solid and the curve that it is known to [follow](Self::following).
    pub fn follows(&self) -> Option<&(Solid, Curve)> {
        self.follows.as_deref()
    }

    /// Which kind of solid.
    pub const fn ty(&self) -> Type {
        self.ty
    }

    /// The number of channels.
    pub const fn channels(&self) -> usize {
        self.channels
    }

    /// Its key; `None` for a part of another that was never given one. Cuts of solids without a key are not kept.
    pub const fn key(&self) -> Option<Key> {
        self.key
    }

    /// Gives a new solid its key; a solid that has one keeps it.
    #[must_use]
    pub fn keyed(mut self, key: Key) -> Self {
        self.key.get_or_insert(key);
        self
    }

    /// The same, the work on its cuts to be counted as that of the result `owner`, of which it is a part.
    #[must_use]
    pub const fn owned_by(mut self, owner: Key) -> Self {
        self.owner = Some(owner);
        self
    }

    /// The memory it holds, in bytes.
    pub fn bytes(&self) -> usize {
        match &self.body {
            Body::Computed { source, .. } => source.bytes() + size_of::<Self>(),
            Body::Moved { .. } | Body::Channels { .. } => size_of::<Self>(),
        }
    }

    /// The type of its cuts.
    const fn field_type(&self) -> Type {
        match self.channels {
            1 => Type::Gray,
            2 => Type::Vec2,
            3 => Type::Rgb,
            _ => Type::Jacobian,
        }
    }

    /// The field that a cut through it shows.
    pub fn cut(&self, cut: &Cut) -> Field {
        let field = match &self.body {
            Body::Moved { inner, place, keeps_z } => return inner.cut(&cut.moved(place, *keeps_z)),
            Body::Computed { source, inputs } => {
                let inputs = inputs.iter().map(|input| input.cut(cut)).collect();
                Field::new(
                    self.field_type(),
                    cut.tiling(),
                    Lowered { source: source.clone(), inputs, cut: cut.clone() },
                )
            }
            Body::Channels { of, channels } => {
                let channels = channels.clone();
                let pick = move |out: &mut Tile, [from]: [&Tile; 1]| {
                    for (plane, channel) in out.planes_mut().into_iter().zip(&*channels) {
                        plane.copy_from_slice(from.plane(*channel));
                    }
                    Ok(())
                };
                Field::map(self.field_type(), [of.cut(cut)], super::Halo::NONE, pick)
            }
        };
        match self.key {
            Some(key) => {
                field.keyed(Key::of("cut", &[key.as_bytes(), cut.key().as_bytes()])).owned_by(self.owner.unwrap_or(key))
            }
            None => field,
        }
    }

    /// Its values at single points, one channel after another; in double precision wherever there is a way.
    pub fn at(&self, points: &[DVec3]) -> Vec<f64> {
        match &self.body {
            Body::Moved { inner, place, .. } => {
                let moved = place.at(points);
                let n = points.len();
                let points: Vec<_> = (0..n).map(|i| DVec3::new(moved[i], moved[n + i], moved[2 * n + i])).collect();
                inner.at(&points)
            }
            Body::Channels { of, channels } => {
                let (all, n) = (of.at(points), points.len());
                channels.iter().flat_map(|c| all[c * n..(c + 1) * n].iter().copied()).collect()
            }
            Body::Computed { source, inputs } => {
                let inputs: Vec<Vec<f64>> = inputs.iter().map(|input| input.at(points)).collect();
                source.exact(points, &inputs).unwrap_or_else(|| self.at_single(&**source, points, &inputs))
            }
        }
    }

    fn at_single(&self, source: &dyn SolidSource, points: &[DVec3], inputs: &[Vec<f64>]) -> Vec<f64> {
        let n = points.len();
        let narrow = |values: &Vec<f64>| values.iter().map(|&v| single(v)).collect();
        let inputs: Vec<Vec<f32>> = inputs.iter().map(narrow).collect();
        let inputs: Vec<Planes<'_>> = inputs.iter().map(|values| Planes::new(values, n)).collect();
        let place: [Vec<f32>; 3] = std::array::from_fn(|axis| points.iter().map(|p| single(p[axis])).collect());
        let place = [&place[0][..], &place[1][..], &place[2][..]];
        let patch = Patch { place, columns: n, rows: 1, level: false, flat: None, pixel: 0.0 };
        let mut out = vec![0.0; n * self.channels];
        source.fill(&patch, &inputs, &mut out.chunks_mut(n.max(1)).collect::<Vec<_>>());
        out.into_iter().map(f64::from).collect()
    }
}

#[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is meant")]
const fn single(value: f64) -> f32 {
    value as f32
}

/// A solid on a cut.
struct Lowered {
    source: Arc<dyn SolidSource>,
    inputs: Vec<Field>,
    cut: Cut,
}

/// The smallest window of whole quads around `window`.
fn quads(window: Window) -> Window {
    let (x, y) = (window.x & !1, window.y & !1);
    let even = |from: i32, to: i32| (to.abs_diff(from) + 1) & !1;
    Window { x, y, width: even(x, window.right()), height: even(y, window.bottom()) }
}

impl Lowered {
    fn compute(&self, reader: &dyn Reader, out: &mut Tile) -> Result<(), Stop> {
        let (grid, window) = (out.grid, out.window);
        let place = match self.source.wants().place {
            true => Some(reader.read(self.cut.place(), &grid, window)?),
            false => None,
        };
        let mut tiles = Vec::with_capacity(self.inputs.len());
        for input in &self.inputs {
            tiles.push(reader.read(input, &grid, window)?);
        }
        let inputs: Vec<Planes<'_>> = tiles.iter().map(|tile| Planes::new(tile.data(), window.len())).collect();
        let patch = Patch {
            place: place.as_ref().map_or([&[]; 3], |tile| [tile.plane(0), tile.plane(1), tile.plane(2)]),
            columns: out.width(),
            rows: out.height(),
            level: self.cut.level(),
            flat: self.cut.flat(),
            pixel: self.cut.pixel(&grid),
        };
        reader.check()?;
        self.source.fill(&patch, &inputs, &mut out.planes_mut());
        Ok(())
    }
}

impl FieldSource for Lowered {
    fn fill(&self, reader: &dyn Reader, out: &mut Tile) -> Result<(), Stop> {
        let whole = quads(out.window);
        if !self.source.wants().quads || whole == out.window || self.cut.pixel(&out.grid) == 0.0 {
            return self.compute(reader, out);
        }
        let mut larger = Tile::new(out.grid, whole, out.channels());
        self.compute(reader, &mut larger)?;
        out.copy_from(&larger, 0, 0);
        Ok(())
    }

    fn reads(&self, grid: &Grid) -> Vec<(&Field, Grid)> {
        let place = self.source.wants().place.then_some(self.cut.place());
        place.into_iter().chain(&self.inputs).map(|field| (field, *grid)).collect()
    }

    fn span(&self, _grid: &Grid, window: Window) -> Option<Window> {
        Some(if self.source.wants().quads { quads(window) } else { window })
    }

    fn cost(&self) -> Cost {
        self.source.cost()
    }
}
