//! The code behind fields: what it states that it reads, and what it is given.
use super::{Field, Grid, Listener, Stop, Tile, Window};
use crate::diagnostics::Problem;
use std::sync::Arc;

/// How the engine should treat a field's tiles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cost {
    /// Cheaper to compute again than to keep, unless several nodes read it.
    Pointwise,
    /// Kept: it costs more than a copy.
    Local,
}

/// A window of a field that another field reads.
#[derive(Clone, Copy, Debug)]
pub struct Read<'f> {
    /// The field that is read.
    pub field: &'f Field,
    /// On which grid.
    pub grid: Grid,
    /// Which pixels of that grid.
    pub window: Window,
}

impl<'f> Read<'f> {
    /// `window` of `field` on `grid`.
    pub const fn new(field: &'f Field, grid: &Grid, window: Window) -> Self {
        Self { field, grid: *grid, window }
    }
}

/// What a field's code is given to fill a tile from: the tiles that it asked for, and nothing else.
pub struct Given<'a> {
    tiles: &'a [Arc<Tile>],
    prepared: Option<&'a Tile>,
    stopped: &'a dyn Fn() -> bool,
    warn: Option<&'a dyn Fn(Problem)>,
}

impl<'a> Given<'a> {
    /// The tiles of [`FieldSource::inputs`], then those of [`FieldSource::later`]; the result of
    /// [`FieldSource::prepare`]; and whether the work was cancelled.
    pub fn new(tiles: &'a [Arc<Tile>], prepared: Option<&'a Tile>, stopped: &'a dyn Fn() -> bool) -> Self {
        Self { tiles, prepared, stopped, warn: None }
    }

    /// The same, with something to do with warnings.
    #[must_use]
    pub fn warning(self, warn: &'a dyn Fn(Problem)) -> Self {
        Self { warn: Some(warn), ..self }
    }

    /// Reports something that the user should know about the values; only the first report of a field counts.
    pub fn warn(&self, problem: Problem) {
        if let Some(warn) = self.warn {
            warn(problem);
        }
    }

    /// What takes such reports, for code that this field calls.
    pub fn listener(&self) -> Option<Listener<'a>> {
        self.warn.map(Listener)
    }

    /// The tile of the read with this number, which the field must have stated.
    pub fn tile(&self, number: usize) -> &'a Tile {
        &self.tiles[number]
    }

    /// All tiles, in the order in which they were asked for.
    pub fn tiles(&self) -> impl ExactSizeIterator<Item = &'a Tile> {
        self.tiles.iter().map(|tile| &**tile)
    }

    /// What the field prepared of whole pictures on this grid.
    pub const fn prepared(&self) -> Option<&'a Tile> {
        self.prepared
    }

    /// Fails if the work was cancelled; call it about every millisecond.
    ///
    /// # Errors
    /// [`Stop::Cancelled`].
    pub fn check(&self) -> Result<(), Stop> {
        if (self.stopped)() { Err(Stop::Cancelled) } else { Ok(()) }
    }
}

/// What [`FieldSource::prepare`] may read: windows of the pictures that [`FieldSource::whole`] states.
pub trait Pictures: Sync {
    /// `window` of the picture with this number, computed on all threads.
    ///
    /// # Errors
    /// As the code of the fields says.
    fn read(&self, number: usize, window: Window) -> Result<Tile, Stop>;

    /// Fails if the work was cancelled; call it about every millisecond.
    ///
    /// # Errors
    /// [`Stop::Cancelled`].
    fn check(&self) -> Result<(), Stop>;
}

/// The code behind a field.
///
/// It states what it reads, and the engine passes it that and nothing else. Reading ahead, freeing memory early and
/// computing a tile on another machine all follow from this statement. For a grid, the fields and grids that are stated
/// are the same for every window, and a part of a window needs no more than the whole.
pub trait FieldSource: Send + Sync {
    /// What [`fill`](Self::fill) reads for `window` of `grid`.
    fn inputs(&self, grid: &Grid, window: Window) -> Vec<Read<'_>>;

    /// What it reads in addition, where the windows depend on the values of the [`inputs`](Self::inputs): windows that
    /// contain everything that may be read.
    fn later(&self, _grid: &Grid, _window: Window) -> Vec<Read<'_>> {
        Vec::new()
    }

    /// The windows that it really reads of those of [`later`](Self::later), one for each and within it, found from the
    /// tiles of the inputs. By default these are the whole windows.
    fn narrow(&self, _given: &Given<'_>, grid: &Grid, window: Window) -> Vec<Window> {
        self.later(grid, window).iter().map(|read| read.window).collect()
    }

    /// Computes every value of `out`, for its window and grid. Runs on one thread.
    ///
    /// # Errors
    /// Values that cannot be computed, or that the work was cancelled.
    fn fill(&self, given: &Given<'_>, out: &mut Tile) -> Result<(), Stop>;

    /// The parameter that says how far it reads. Errors name it.
    fn reaches_by(&self) -> Option<&'static str> {
        None
    }

    /// How to treat its tiles.
    fn cost(&self) -> Cost {
        Cost::Local
    }

    /// The pictures that [`prepare`](Self::prepare) reads for `grid`, whole or by windows in any order.
    fn whole(&self, _grid: &Grid) -> Vec<Read<'_>> {
        Vec::new()
    }

    /// Computes what [`fill`](Self::fill) needs of whole pictures, once per grid and before any tile.
    ///
    /// # Errors
    /// Values that cannot be computed, or that the work was cancelled.
    fn prepare(&self, _grid: &Grid, _pictures: &dyn Pictures) -> Result<Option<Tile>, Stop> {
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
