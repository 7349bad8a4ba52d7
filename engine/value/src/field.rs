//! Fields: functions on the canvas, evaluated lazily in windows.
//!
//! A field is defined on the whole plane. In directions in which it tiles it is periodic with the canvas; in others its
//! node defines how it continues beyond the edge. Any window on any grid has the same bits as the same part of a larger
//! window.
use super::link::Link;
use super::{Cost, Domain, FieldSource, Given, Grid, Key, Read, Stop, Tile, Tiling, Type, Window};
use std::fmt;
use std::sync::Arc;

/// The identity of a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FieldId {
    /// Its key.
    Key(Key),
    /// The address of its source.
    Code(usize),
}

/// A function on the canvas: `Gray`, `Rgb`, `Vec2`, `Jacobian` or `Ids`.
#[derive(Clone)]
pub struct Field {
    ty: Type,
    channels: usize,
    domain: Domain,
    native: Option<Grid>,
    pixels: Option<glam::UVec2>,
    constant: Option<[f32; 4]>,
    key: Option<Key>,
    owner: Option<Key>,
    overwrites: bool,
    source: Link<dyn FieldSource>,
}

impl fmt::Debug for Field {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Field")
            .field("ty", &self.ty)
            .field("tiling", &self.tiling())
            .field("key", &self.key)
            .finish_non_exhaustive()
    }
}

impl Field {
    /// A field of type `ty` (one of the field types) computed by `source`.
    pub fn new(ty: Type, tiling: Tiling, source: impl FieldSource + 'static) -> Self {
        Self {
            ty,
            channels: ty.channels(),
            domain: Domain::canvas(tiling),
            native: None,
            pixels: None,
            constant: None,
            key: None,
            owner: None,
            overwrites: false,
            source: Link::new(Arc::new(source)),
        }
    }

    /// A field of any number of channels that are computed together. [`pick`](Self::pick) gives fields of some of them.
    pub fn bundle(channels: usize, tiling: Tiling, source: impl FieldSource + 'static) -> Self {
        Self { channels, ..Self::new(Type::Gray, tiling, source) }
    }

    /// Some of its channels, as a field of type `ty` with as many channels.
    #[must_use]
    pub fn pick(&self, ty: Type, channels: impl Into<Arc<[usize]>>) -> Self {
        let channels: Arc<[usize]> = channels.into();
        let copy = move |out: &mut Tile, [from]: [&Tile; 1]| {
            for (plane, channel) in out.planes_mut().into_iter().zip(&*channels) {
                plane.copy_from_slice(from.plane(*channel));
            }
            Ok(())
        };
        Self::map(ty, [self.clone()], Halo::NONE, copy).overwriting()
    }

    /// A field with one constant value; `values` has one number per channel.
    pub fn constant(ty: Type, values: &[f32]) -> Self {
        let mut constant = [0.0; 4];
        constant[..values.len()].copy_from_slice(values);
        let bytes: Vec<u8> = constant.iter().flat_map(|v| v.to_bits().to_le_bytes()).collect();
        Self {
            constant: Some(constant),
            key: Some(Key::of("constant", &[ty.name().as_bytes(), &bytes])),
            ..Self::new(ty, Tiling::BOTH, Constant(constant)).overwriting()
        }
    }

    /// A field computed from others by `fill(out, inputs)`. Each input covers the window of `out` grown by `halo`.
    pub fn map<const N: usize, F>(ty: Type, inputs: [Field; N], halo: Halo, fill: F) -> Self
    where
        F: Fn(&mut Tile, [&Tile; N]) -> Result<(), Stop> + Send + Sync + 'static,
    {
        let tiling = inputs.iter().fold(Tiling::BOTH, |tiling, input| tiling.and(input.tiling()));
        Self::new(ty, tiling, Map { inputs, halo, fill })
    }

    /// A field computed only from positions by `fill(out, given)`; `given` reports cancellation.
    pub fn generate<F>(ty: Type, tiling: Tiling, fill: F) -> Self
    where
        F: Fn(&mut Tile, &Given<'_>) -> Result<(), Stop> + Send + Sync + 'static,
    {
        Self::new(ty, tiling, Generate(fill))
    }

    /// Declares the directions in which the field tiles.
    #[must_use]
    pub fn tiled(mut self, tiling: Tiling) -> Self {
        self.domain = Domain::canvas(tiling);
        self
    }

    /// Declares that it was made from a picture with the pixels of `grid`.
    #[must_use]
    pub fn with_native(mut self, grid: Grid) -> Self {
        self.native = Some(grid);
        self
    }

    /// Declares that it was made from a picture of `size` pixels at the origin of the grid.
    #[must_use]
    pub fn with_pixels(mut self, size: glam::UVec2) -> Self {
        self.pixels = Some(size);
        self
    }

    /// Promises that its code sets every value of a tile and reads no old values, so the tile need not be cleared
    /// before.
    #[must_use]
    pub fn overwriting(mut self) -> Self {
        self.overwrites = true;
        self
    }

    /// Replaces its code by code that wraps the field itself.
    #[must_use]
    pub fn wrapped<S: FieldSource + 'static>(mut self, wrap: impl FnOnce(Self) -> S) -> Self {
        self.source = Link::new(Arc::new(wrap(self.clone())));
        self
    }

    /// Its type.
    pub fn ty(&self) -> Type {
        self.ty
    }

    /// Directions in which it repeats.
    pub fn tiling(&self) -> Tiling {
        self.domain.tiling()
    }

    /// Its domain.
    pub fn domain(&self) -> Domain {
        self.domain
    }

    /// The number of channels.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// The pixel grid of the picture that it was made from, if any.
    pub fn native(&self) -> Option<Grid> {
        self.native
    }

    /// Size in pixels of that picture.
    pub fn pixels(&self) -> Option<glam::UVec2> {
        self.pixels
    }

    /// Its value, if it is constant.
    pub fn as_constant(&self) -> Option<&[f32]> {
        self.constant.as_ref().map(|c| &c[..self.channels()])
    }

    /// Its key; `None` for a part of another field that was not given one.
    pub fn key(&self) -> Option<Key> {
        self.key
    }

    /// Gives a new field its key; an existing key is kept.
    #[must_use]
    pub fn keyed(mut self, key: Key) -> Self {
        self.key.get_or_insert(key);
        self
    }

    /// Marks it as a part of the result `owner`: its work is counted for that result.
    #[must_use]
    pub fn owned_by(mut self, owner: Key) -> Self {
        self.owner = Some(owner);
        self
    }

    /// The result that its work is counted for, if any.
    pub fn owner(&self) -> Option<Key> {
        self.owner
    }

    /// True if its code sets every value of a tile.
    pub fn overwrites(&self) -> bool {
        self.overwrites
    }

    /// A tile for its code to fill.
    pub fn blank(&self, grid: Grid, window: Window) -> Tile {
        if self.overwrites {
            Tile::unset(grid, window, self.channels())
        } else {
            Tile::new(grid, window, self.channels())
        }
    }

    /// Its code.
    pub fn source(&self) -> &dyn FieldSource {
        self.source.get()
    }

    /// The identity of the field: its key, or the address of its code if it has none. Fields that exist at the same
    /// time and have the same identity have equal values.
    pub fn id(&self) -> FieldId {
        self.key.map_or_else(|| FieldId::Code(self.source.address()), FieldId::Key)
    }

    /// The field as `Rgb`: grey for a `Gray` field.
    #[must_use]
    pub fn to_rgb(&self) -> Self {
        if self.ty != Type::Gray {
            return self.clone();
        }
        if let Some(&[value]) = self.as_constant() {
            return Self::constant(Type::Rgb, &[value; 3]);
        }
        let fill = |out: &mut Tile, [input]: [&Tile; 1]| {
            out.planes_mut().into_iter().for_each(|plane| plane.copy_from_slice(input.plane(0)));
            Ok(())
        };
        let rgb = Self::map(Type::Rgb, [self.clone()], Halo::NONE, fill).overwriting();
        match self.key {
            Some(key) => rgb.keyed(Key::of("to-rgb", &[key.as_bytes()])),
            None => rgb,
        }
    }

    /// Angle of a `Vec2` field in degrees from +x towards +y, -180..180; 0 for a zero vector. A `Gray` field is
    /// unchanged.
    #[must_use]
    pub fn to_angle(&self) -> Self {
        if self.ty != Type::Vec2 {
            return self.clone();
        }
        let degrees = |x: f32, y: f32| {
            let angle = libm::atan2f(y, x).to_degrees();
            if angle.is_finite() { angle } else { 0.0 }
        };
        if let Some(&[x, y]) = self.as_constant() {
            return Self::constant(Type::Gray, &[degrees(x, y)]);
        }
        let fill = move |out: &mut Tile, [input]: [&Tile; 1]| {
            let vectors = input.plane(0).iter().zip(input.plane(1));
            out.plane_mut(0).iter_mut().zip(vectors).for_each(|(out, (x, y))| *out = degrees(*x, *y));
            Ok(())
        };
        let angle = Self::map(Type::Gray, [self.clone()], Halo::NONE, fill);
        match self.key {
            Some(key) => angle.keyed(Key::of("to-angle", &[key.as_bytes()])),
            None => angle,
        }
    }
}

/// Halo of a field: the margin by which it reads its inputs beyond its own window, in pixels of the grid, in x and y.
#[derive(Clone)]
pub struct Halo {
    rule: Option<HaloRule>,
    parameter: Option<&'static str>,
}

type HaloRule = Arc<dyn Fn(&Grid) -> [usize; 2] + Send + Sync>;

impl Halo {
    /// Reads only its own window.
    pub const NONE: Self = Self { rule: None, parameter: None };

    /// A halo of `rule(grid)` pixels.
    pub fn new(rule: impl Fn(&Grid) -> [usize; 2] + Send + Sync + 'static) -> Self {
        Self { rule: Some(Arc::new(rule)), parameter: None }
    }

    /// Names the parameter of the node that determines the halo.
    #[must_use]
    pub fn from_parameter(self, name: &'static str) -> Self {
        Self { parameter: Some(name), ..self }
    }

    /// The parameter that determines the halo, if it is known.
    pub const fn parameter(&self) -> Option<&'static str> {
        self.parameter
    }

    /// The same number of pixels on every grid.
    pub fn px(pixels: usize) -> Self {
        Self::new(move |_| [pixels; 2])
    }

    /// Width of the halo on each side in pixels, in x and y.
    pub fn pixels(&self, grid: &Grid) -> (i32, i32) {
        let [x, y] = self.rule.as_ref().map_or([0, 0], |rule| rule(grid));
        (i32::try_from(x).unwrap_or(i32::MAX / 8), i32::try_from(y).unwrap_or(i32::MAX / 8))
    }
}

struct Constant([f32; 4]);

impl FieldSource for Constant {
    fn inputs(&self, _grid: &Grid, _window: Window) -> Vec<Read<'_>> {
        Vec::new()
    }

    fn fill(&self, _given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        out.planes_mut().into_iter().zip(self.0).for_each(|(plane, value)| plane.fill(value));
        Ok(())
    }

    fn cost(&self) -> Cost {
        Cost::Pointwise
    }
}

struct Generate<F>(F);

impl<F: Fn(&mut Tile, &Given<'_>) -> Result<(), Stop> + Send + Sync> FieldSource for Generate<F> {
    fn inputs(&self, _grid: &Grid, _window: Window) -> Vec<Read<'_>> {
        Vec::new()
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        (self.0)(out, given)
    }
}

struct Map<const N: usize, F> {
    inputs: [Field; N],
    halo: Halo,
    fill: F,
}

impl<const N: usize, F> FieldSource for Map<N, F>
where
    F: Fn(&mut Tile, [&Tile; N]) -> Result<(), Stop> + Send + Sync,
{
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>> {
        let (dx, dy) = self.halo.pixels(grid);
        let window = window.grow(dx, dy);
        self.inputs.iter().map(|input| Read::new(input, grid, window)).collect()
    }

    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop> {
        (self.fill)(out, std::array::from_fn(|i| given.tile(i)))
    }

    fn cost(&self) -> Cost {
        if self.halo.rule.is_none() { Cost::Pointwise } else { Cost::Local }
    }

    fn reaches_by(&self) -> Option<&'static str> {
        self.halo.parameter
    }
}
