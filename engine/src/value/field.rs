//! Fields: functions on the canvas, evaluated lazily in windows.
//!
//! A field is defined on the whole plane. Where it tiles it is periodic with the canvas; elsewhere it goes on beyond the
//! canvas' edge in whatever way its node says. Asking for any window at any grid gives the same bits as cutting that
//! window out of a larger one.
use super::{Grid, Key, Tile, Tiling, Type, Window};
use crate::diagnostics::Problem;
use std::fmt;
use std::sync::Arc;

/// Why a computation ended without a result.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Stop {
    /// Somebody asked it to.
    Cancelled,
    /// It could not be done.
    Failed(Box<Problem>),
}

impl From<Problem> for Stop {
    fn from(problem: Problem) -> Self {
        Self::Failed(Box::new(problem))
    }
}

impl fmt::Display for Stop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Cancelled => f.write_str("cancelled"),
            Self::Failed(problem) => problem.fmt(f),
        }
    }
}

impl std::error::Error for Stop {}

/// How the engine should treat a field's tiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cost {
    /// Cheaper to compute again than to keep, unless several nodes read it.
    Pointwise,
    /// Kept: it costs more than a copy.
    Local,
}

/// What a field's code may ask of the engine while it fills a tile.
pub trait Reader {
    /// The values of `field` in `window` of `grid`.
    fn read(&self, field: &Field, grid: &Grid, window: Window) -> Result<Arc<Tile>, Stop>;

    /// The result of [`FieldSource::prepare`] for the field and grid being filled.
    fn prepared(&self) -> Option<&Arc<Tile>>;

    /// Fails if somebody asked to stop; call it about every millisecond.
    fn check(&self) -> Result<(), Stop>;
}

/// What a node's code may ask of the engine outside of tiles: whole pictures, computed on all threads.
pub trait Evaluator: Sync {
    /// The values of `field` in `window` of `grid`.
    fn raster(&self, field: &Field, grid: &Grid, window: Window) -> Result<Tile, Stop>;

    /// Fails if somebody asked to stop; call it about every millisecond.
    fn check(&self) -> Result<(), Stop>;

    /// Tells how far the node has come.
    fn progress(&self, done: u64, total: u64);

    /// How many bytes a node may take for what it computes.
    fn memory(&self) -> u64;

    /// The key of the main output of the node that is being evaluated.
    fn key(&self) -> Option<Key> {
        None
    }

    /// Something that the user should know although the node goes on.
    fn warn(&self, problem: Problem);
}

/// The code behind a field.
pub trait FieldSource: Send + Sync {
    /// Computes every value of `out`, for its window and grid. Runs on one thread.
    fn fill(&self, reader: &dyn Reader, out: &mut Tile) -> Result<(), Stop>;

    /// The fields it will read, and on which grids, when it is asked for `grid`.
    fn reads(&self, grid: &Grid) -> Vec<(&Field, Grid)>;

    /// The part of its inputs that [`fill`](Self::fill) reads for `window` of `grid`, or a larger one; `None` if it may
    /// read anything, as code does that does not say. Of inputs on other grids nothing is said.
    fn span(&self, _grid: &Grid, _window: Window) -> Option<Window> {
        None
    }

    /// How to treat its tiles.
    fn cost(&self) -> Cost {
        Cost::Local
    }

    /// Computes what [`fill`](Self::fill) needs of the whole picture, once per grid and before any tile.
    fn prepare(&self, _grid: &Grid, _evaluator: &dyn Evaluator) -> Result<Option<Tile>, Stop> {
        Ok(None)
    }

    /// The memory that [`prepare`](Self::prepare) will need at its peak, in bytes.
    fn prepare_bytes(&self, _grid: &Grid) -> u64 {
        0
    }

    /// The memory it holds, in bytes, besides that of the objects it shares.
    fn bytes(&self) -> usize {
        0
    }
}

/// A function on the canvas: `Gray`, `Rgb`, `Vec2`, `Jacobian` or `Ids`.
#[derive(Clone)]
pub struct Field {
    ty: Type,
    tiling: Tiling,
    native: Option<Grid>,
    pixels: Option<glam::UVec2>,
    constant: Option<[f32; 4]>,
    key: Option<Key>,
    owner: Option<Key>,
    source: Arc<dyn FieldSource>,
}

impl fmt::Debug for Field {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Field")
            .field("ty", &self.ty)
            .field("tiling", &self.tiling)
            .field("key", &self.key)
            .finish_non_exhaustive()
    }
}

impl Field {
    /// A field of type `ty` (one of the field types) computed by `source`.
    pub fn new(ty: Type, tiling: Tiling, source: impl FieldSource + 'static) -> Self {
        Self {
            ty,
            tiling,
            native: None,
            pixels: None,
            constant: None,
            key: None,
            owner: None,
            source: Arc::new(source),
        }
    }

    /// A field that has the same value everywhere; `values` as many as the type has channels.
    pub fn constant(ty: Type, values: &[f32]) -> Self {
        let mut constant = [0.0; 4];
        constant[..values.len()].copy_from_slice(values);
        let bytes: Vec<u8> = constant.iter().flat_map(|v| v.to_bits().to_le_bytes()).collect();
        Self {
            constant: Some(constant),
            key: Some(Key::of("constant", &[ty.name().as_bytes(), &bytes])),
            ..Self::new(ty, Tiling::BOTH, Constant(constant))
        }
    }

    /// A field computed from others by `fill(out, inputs)`, each input covering the window of `out` grown by `halo`.
    pub fn map<const N: usize, F>(ty: Type, inputs: [Field; N], halo: Halo, fill: F) -> Self
    where
        F: Fn(&mut Tile, [&Tile; N]) -> Result<(), Stop> + Send + Sync + 'static,
    {
        let tiling = inputs.iter().fold(Tiling::BOTH, |tiling, input| tiling.and(input.tiling));
        Self::new(ty, tiling, Map { inputs, halo, fill })
    }

    /// A field computed from nothing but positions by `fill(out)`.
    pub fn generate<F>(ty: Type, tiling: Tiling, fill: F) -> Self
    where
        F: Fn(&mut Tile, &dyn Reader) -> Result<(), Stop> + Send + Sync + 'static,
    {
        Self::new(ty, tiling, Generate(fill))
    }

    /// The same with another promise of where it tiles.
    #[must_use]
    pub fn tiled(mut self, tiling: Tiling) -> Self {
        self.tiling = tiling;
        self
    }

    /// The same, made from a picture whose pixels are those of `grid`.
    #[must_use]
    pub fn with_native(mut self, grid: Grid) -> Self {
        self.native = Some(grid);
        self
    }

    /// The same, made from a picture of so many pixels, placed at the grid's origin.
    #[must_use]
    pub fn with_pixels(mut self, size: glam::UVec2) -> Self {
        self.pixels = Some(size);
        self
    }

    /// Which kind of field.
    pub fn ty(&self) -> Type {
        self.ty
    }

    /// Where it repeats.
    pub fn tiling(&self) -> Tiling {
        self.tiling
    }

    /// The number of channels.
    pub fn channels(&self) -> usize {
        self.ty.channels()
    }

    /// The pixels of the picture that it was made from, if it is a picture.
    pub fn native(&self) -> Option<Grid> {
        self.native
    }

    /// How many pixels that picture has.
    pub fn pixels(&self) -> Option<glam::UVec2> {
        self.pixels
    }

    /// Its value, if it has the same everywhere.
    pub fn as_constant(&self) -> Option<&[f32]> {
        self.constant.as_ref().map(|c| &c[..self.channels()])
    }

    /// Its key; `None` for a field that is a part of another and was never given one.
    pub fn key(&self) -> Option<Key> {
        self.key
    }

    /// Gives a new field its key; a field that has one keeps it.
    #[must_use]
    pub fn keyed(mut self, key: Key) -> Self {
        self.key.get_or_insert(key);
        self
    }

    /// The same, its work to be counted as that of the result `owner`, of which it is a part.
    #[must_use]
    pub fn owned_by(mut self, owner: Key) -> Self {
        self.owner = Some(owner);
        self
    }

    /// The result as whose work its own counts, if that is another.
    pub fn owner(&self) -> Option<Key> {
        self.owner
    }

    /// The code behind it.
    pub fn source(&self) -> &Arc<dyn FieldSource> {
        &self.source
    }

    /// The same values as `Rgb`: grey for a `Gray` field.
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
        let rgb = Self::map(Type::Rgb, [self.clone()], Halo::NONE, fill);
        match self.key {
            Some(key) => rgb.keyed(Key::of("to-rgb", &[key.as_bytes()])),
            None => rgb,
        }
    }
}

/// How much farther than its own window a field reads its inputs, in pixels of the grid, in x and y.
#[derive(Clone)]
pub struct Halo(Option<HaloRule>);

type HaloRule = Arc<dyn Fn(&Grid) -> [usize; 2] + Send + Sync>;

impl Halo {
    /// Reads only its own window.
    pub const NONE: Self = Self(None);

    /// As many pixels as `rule` says for a grid.
    pub fn new(rule: impl Fn(&Grid) -> [usize; 2] + Send + Sync + 'static) -> Self {
        Self(Some(Arc::new(rule)))
    }

    /// As many pixels on every grid.
    pub fn px(pixels: usize) -> Self {
        Self::new(move |_| [pixels; 2])
    }

    /// The pixels to be read on each side, in x and y.
    pub fn pixels(&self, grid: &Grid) -> (i32, i32) {
        let [x, y] = self.0.as_ref().map_or([0, 0], |rule| rule(grid));
        (i32::try_from(x).unwrap_or(i32::MAX / 8), i32::try_from(y).unwrap_or(i32::MAX / 8))
    }
}

struct Constant([f32; 4]);

impl FieldSource for Constant {
    fn fill(&self, _reader: &dyn Reader, out: &mut Tile) -> Result<(), Stop> {
        out.planes_mut().into_iter().zip(self.0).for_each(|(plane, value)| plane.fill(value));
        Ok(())
    }

    fn reads(&self, _grid: &Grid) -> Vec<(&Field, Grid)> {
        Vec::new()
    }

    fn span(&self, _grid: &Grid, window: Window) -> Option<Window> {
        Some(window)
    }

    fn cost(&self) -> Cost {
        Cost::Pointwise
    }
}

struct Generate<F>(F);

impl<F: Fn(&mut Tile, &dyn Reader) -> Result<(), Stop> + Send + Sync> FieldSource for Generate<F> {
    fn fill(&self, reader: &dyn Reader, out: &mut Tile) -> Result<(), Stop> {
        (self.0)(out, reader)
    }

    fn reads(&self, _grid: &Grid) -> Vec<(&Field, Grid)> {
        Vec::new()
    }

    fn span(&self, _grid: &Grid, window: Window) -> Option<Window> {
        Some(window)
    }
}

struct Map<const N: usize, F> {
    inputs: [Field; N],
    halo: Halo,
    fill: F,
}

impl<const N: usize, F> Map<N, F> {
    fn window(&self, grid: &Grid, window: Window) -> Window {
        let (dx, dy) = self.halo.pixels(grid);
        window.grow(dx, dy)
    }
}

impl<const N: usize, F> FieldSource for Map<N, F>
where
    F: Fn(&mut Tile, [&Tile; N]) -> Result<(), Stop> + Send + Sync,
{
    fn fill(&self, reader: &dyn Reader, out: &mut Tile) -> Result<(), Stop> {
        let window = self.window(&out.grid, out.window);
        let mut tiles = Vec::with_capacity(N);
        for input in &self.inputs {
            tiles.push(reader.read(input, &out.grid, window)?);
        }
        (self.fill)(out, std::array::from_fn(|i| &*tiles[i]))
    }

    fn reads(&self, grid: &Grid) -> Vec<(&Field, Grid)> {
        self.inputs.iter().map(|input| (input, *grid)).collect()
    }

    fn span(&self, grid: &Grid, window: Window) -> Option<Window> {
        Some(self.window(grid, window))
    }

    fn cost(&self) -> Cost {
        if self.halo.0.is_none() { Cost::Pointwise } else { Cost::Local }
    }
}
